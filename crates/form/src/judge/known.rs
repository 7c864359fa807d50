//! Faults that only show in comparison with the solution: permuted values, a few wrong ones, and a step of Newton's method that was the last one.

use super::change::{Cause, Change, Explanation};
use super::residual::{Residual, dot, largest};
use crate::own::{places, solve_with};

/// Values are equal up to this fraction of the largest difference, and of the largest value.
const SAME: [f64; 2] = [1e-6, 1e-12];
/// If numbers were rounded when they were written, a value may be wrong by this many units of their last digits.
const WRITTEN: f64 = 4.0;
/// At most one of this number of values may be wrong.
const FEW: usize = 20;
/// An iterate is the result if their errors agree up to this fraction.
const NEAR: f64 = 1e-3;

/// Solves the form, and compares; `None` if it has no solution, or if the values are not conclusive.
pub fn explain(residual: &Residual<'_>, unit: f64) -> Option<Explanation> {
    let mut steps: Vec<Vec<f64>> = Vec::new();
    let solution = solve_with(residual.problem, residual.source, |u| {
        steps.push(u.to_vec())
    });
    let (u, known) = (&residual.u, solution.ok()?.u);
    let error = difference(u, &known);
    let size = SAME[1].max(WRITTEN * unit) * largest(&known);
    let same = (SAME[0] * largest(&error)).max(size);
    let off: Vec<usize> = (0..u.len()).filter(|k| error[*k].abs() > same).collect();
    let cause = |change: Change| {
        let causes = vec![Cause {
            change,
            factor: 1.0,
        }];
        Some(Explanation {
            causes,
            left: 0.0,
            share: 1.0,
            is_exact: true,
            alike: Vec::new(),
        })
    };
    let [count, of] = [off.len(), u.len()];
    let free = residual.held.is_held.iter().filter(|is| !**is).count();
    let sorted = |values: &[f64]| {
        let mut all: Vec<f64> = off.iter().map(|k| values[*k]).collect();
        all.sort_by(f64::total_cmp);
        all
    };
    let rest = difference(&sorted(u), &sorted(&known));
    if count > 1 && rest.iter().all(|d| d.abs() <= same) {
        return cause(Change::Exchanged { count, of });
    }
    if count > 0 && FEW * count <= free {
        let places = places(&residual.assembler);
        let mut between = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for (axis, x) in off
            .iter()
            .flat_map(|k| places[*k].2.into_iter().enumerate())
        {
            between[0][axis] = between[0][axis].min(x);
            between[1][axis] = between[1][axis].max(x);
        }
        return cause(Change::Values { count, of, between });
    }
    let is_it = |step: &Vec<f64>| {
        let own = difference(step, &known);
        let apart = difference(&own, &error);
        dot(&apart, &apart) <= NEAR * NEAR * dot(&own, &own)
    };
    // The last but one confirms the solution.
    let step = steps
        .iter()
        .take(steps.len().saturating_sub(1))
        .position(is_it)?;
    cause(Change::Stopped {
        step: step + 1,
        of: steps.len(),
    })
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}
