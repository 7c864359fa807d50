//! Faults that only show in comparison with the solution: right values in other positions, a few wrong ones, and an iteration that stopped early.

use super::place::Spot;
use super::search::Search;
use super::{Aspect, Explanation, Rank};
use crate::text::{Number, text};
use faceoff_fem::contact::{Iteration, SPLITTINGS, Stop, solve};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;

/// Values that differ by at most this, relative to the largest difference, are the same.
const SAME: f64 = 1e-6;
/// A fault in at most one row of this number is local.
const SPREAD: usize = 12;
/// The cosine of the angle between errors that count as parallel.
const ALONG: f64 = 0.99;
/// The number of steps of Newton's method that are examined; ten times as many for fixed points.
const STEPS: usize = 30;
/// A field farther from the solution than this, relative to its largest value, is not taken for an iteration that stopped early.
const NEARLY: f64 = 1e-2;

/// Solves, and compares; `None` if the Rust engine has no solution.
///
/// # Errors
/// An interruption.
pub(super) fn explain(search: &Search) -> Result<Option<Explanation>> {
    let Some(solution) = search.solution()? else {
        return Ok(None);
    };
    let (u, known) = (search.u, &solution.u);
    let largest = known.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
    let apart = |dof: usize| (u[dof] - known[dof]).abs();
    let farthest = (0..u.len()).map(apart).fold(0.0, f64::max);
    let same = (SAME * farthest).max(4.0 * search.limit * largest);
    let off: Vec<usize> = (0..u.len()).filter(|dof| apart(*dof) > same).collect();
    let spot = |dof: &usize| Spot::of_dof(&search.problem, *dof, search.errors[*dof]);
    let sorted = |values: &[f64]| {
        let mut sorted: Vec<f64> = off.iter().map(|dof| values[*dof]).collect();
        sorted.sort_by(f64::total_cmp);
        sorted
    };
    let pairs = sorted(u).into_iter().zip(sorted(known));
    let is_permuted = off.len() > 1 && pairs.into_iter().all(|(a, b)| (a - b).abs() <= same);
    let few = off.len() <= 3.max(u.len() / 50);
    let mut mended = u.to_vec();
    off.iter().for_each(|dof| mended[*dof] = known[*dof]);
    let left = search.problem.backward_error(&mended).0;
    if !off.is_empty() && (is_permuted || few) && left <= search.limit {
        let at: Vec<Spot> = off.iter().map(spot).collect();
        let count = off.len();
        let (aspect, brief, between) = match (is_permuted, &off[..]) {
            (true, _) => {
                let of = text!("{} of {} values", count, u.len());
                let brief = text!("its values are permuted: {} are in other positions", of);
                (Aspect::Order, brief, ", ")
            }
            (_, [one]) => {
                let [is, right] = [u, &known[..]].map(|of| Number::exact(of[*one]));
                let brief = text!("one value is off: {}, not {}", is, right);
                (Aspect::U, brief, ", on ")
            }
            _ => {
                let brief = text!("{} values are off, all others right", count);
                (Aspect::U, brief, ": on ")
            }
        };
        let more = text!("{}{}", between, Spot::list(&at));
        return Ok(Some(Explanation {
            at,
            ..Explanation::new(aspect, brief, Rank::Values, left).more(more)
        }));
    }
    // The residual of a linear solver that stopped early is in rows of all kinds.
    let failing = search.errors.iter().filter(|e| **e > search.limit).count();
    let all = SPREAD * failing >= u.len();
    if !(farthest <= NEARLY * largest) || !(all || is_iterate(search, known)?) {
        return Ok(None);
    }
    let or = match all && !search.setup.scene.data().f.is_zero() {
        true => ", or f is integrated by a rule that is not known here",
        false => "",
    };
    let away = Number::new(farthest / largest, 2);
    let brief =
        text!("no change of the scheme explains it; it is {away} of max|u| away from the solution");
    let more = text!(", as after an iteration that stopped early{or}");
    let found = Explanation::new(Aspect::Iteration, brief, Rank::Values, search.residual);
    Ok(Some(found.more(more)))
}

/// Is the error of u that of a step of Newton's method, or parallel to that of a fixed point?
fn is_iterate(search: &Search, known: &[f64]) -> Result<bool> {
    let error =
        |u: &[f64]| -> Vec<f64> { u.iter().zip(known).map(|(u, known)| u - known).collect() };
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let own = error(search.u);
    let size = (dot(&own, &own) / dot(known, known)).sqrt();
    let newton = (1..STEPS).map(|max_iterations| Stop {
        max_iterations,
        ..Stop::default()
    });
    let newton = newton.map(|stop| (Iteration::Newton, stop));
    let fixed = SPLITTINGS.into_iter().flat_map(|splitting| {
        [10.0, 1.0, 0.1].map(|of| {
            let stop = Stop {
                increment: of * size,
                max_iterations: 10 * STEPS,
            };
            (Iteration::FixedPoint(splitting), stop)
        })
    });
    for (iteration, stop) in newton.chain(fixed) {
        cancel::check()?;
        let Ok(found) = solve(&search.problem, iteration, stop, |_, _| Ok(())) else {
            continue;
        };
        let other = error(&found.u);
        let [both, of_own, of_other] =
            [(&own, &other), (&own, &own), (&other, &other)].map(|(a, b)| dot(a, b));
        let is_as_large = (1e-3..1e3).contains(&(of_other / of_own).sqrt());
        if is_as_large && both >= ALONG * (of_own * of_other).sqrt() {
            return Ok(true);
        }
    }
    Ok(false)
}
