//! Solves (3.1): Newton as the primal-dual active set strategy, which always ends, and the paper's
//! fixed points.

use std::time::Instant;

use super::Problem;
use super::active_set::{ActiveSet, Per};
use super::condensed::Condensed;
use super::iteration::Iteration;
use super::scheme::Scheme;
use crate::assembly;
use crate::error::{Error, Result};
use crate::linear::Symmetric;

/// When to stop: the relative broken H¹ norm of the increment, as in section 6; or where rounding
/// leaves nothing to gain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// ‖δ‖_{1,h} < increment · ‖u‖_{1,h}
    pub increment: f64,
    pub max_iterations: usize,
}

impl Default for Stop {
    fn default() -> Self {
        Stop {
            increment: 1e-12,
            max_iterations: 50,
        }
    }
}

/// A residual is rounding when two steps in a row leave not more than this, relative to the
/// largest terms.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Why an iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ended {
    /// The increment is below the tolerance.
    Increment,
    /// The residual is at rounding, so that the increments cannot get smaller.
    Rounding,
    /// The steps allowed are done, or an overflow.
    NotReached,
}

/// Seconds spent.
#[derive(Debug, Clone, Copy, Default)]
pub struct Timings {
    pub factor: f64,
    pub iterate: f64,
}

/// What an iteration ended with.
#[derive(Debug, Clone)]
pub struct Solution {
    /// u at all dofs: of the last step, or where nothing was reached of the step with the smallest
    /// residual.
    pub u: Vec<f64>,
    /// The step that u comes from, from 1; 0 is the start.
    pub step: usize,
    /// The relative increment of each step.
    pub increments: Vec<f64>,
    /// How many contact conditions changed their status after each step.
    pub changes: Vec<usize>,
    /// ‖R(u)‖ after each step, relative to ‖A‖ ‖u‖ and the contact terms, all in the maximum norm.
    pub residuals: Vec<f64>,
    pub ended: Ended,
    /// Did it end by increment or rounding?
    pub converged: bool,
    pub seconds: Timings,
}

/// Solves (3.1). `progress` is told each step and its relative increment, and may end the run.
///
/// # Errors
/// What `progress` returns; a fixed point for a method that has none; a stiffness that is not
/// positive definite, or a singular Newton matrix. An iteration that does not reach its tolerance is
/// no error: it says so.
pub fn solve(
    problem: &Problem,
    iteration: Iteration,
    stop: Stop,
    mut progress: impl FnMut(usize, f64) -> Result<()>,
) -> Result<Solution> {
    if iteration != Iteration::Newton && !problem.method.is_nitsche() {
        return Err(Error::usage(
            format!(
                "{iteration} is a fixed point of the family (2.4) and of cr-fc, and {} is neither",
                problem.method
            ),
            "use newton, which for the variational inequalities is the primal-dual active set",
        ));
    }
    let clock = Instant::now();
    let mass = assembly::mass(&problem.space);
    let condensed = Condensed::new(problem)?;
    let scale = Scale::new(problem);
    let factor = clock.elapsed().as_secs_f64();
    let clock = Instant::now();

    let is_newton = iteration == Iteration::Newton;
    let scheme = if is_newton {
        Scheme::new(problem)
    } else {
        Scheme::as_it_stands(problem)
    };
    let mut per = if scheme.is_by_faces() {
        Per::Face
    } else {
        Per::Condition
    };
    let mut u = problem.start();
    let mut r = scheme.residual(&u);
    let mut set = ActiveSet::new(&scheme, &u, per);
    set.scale_rows(&scheme, &mut r);
    let (mut increments, mut changes, mut residuals) = (Vec::new(), Vec::new(), Vec::new());
    let mut best = (f64::INFINITY, 0, Vec::new());
    let mut matrix = None;
    let mut ended = Ended::NotReached;
    while ended == Ended::NotReached && increments.len() < stop.max_iterations {
        if is_newton {
            set.linear_residual(&scheme, &u, &mut r);
        }
        if matrix.is_none() || !iteration.is_constant() {
            let mut laws = set.laws(&scheme, iteration).into_iter();
            let choose = |_: &_| laws.next().unwrap_or_default();
            matrix = Some(condensed.contact_matrix(&scheme.conditions, choose));
        }
        let Some(contact) = &matrix else { break };
        let mut step = condensed.step(contact, &r)?;
        step.iter_mut().for_each(|d| *d *= iteration.relaxation());
        let next: Vec<f64> = u.iter().zip(&step).map(|(u, d)| u + d).collect();
        let increment = relative_increment(problem, &mass, &step, &next);
        if let Some(residual) = residuals.last().filter(|r| **r < best.0) {
            best = (*residual, increments.len(), u);
        }
        u = next;
        // A small increment says nothing of violations that were left standing.
        let arrived = increment < stop.increment && !set.is_partial();
        let mut changed = if is_newton {
            set.pivot(&scheme, &u)
        } else {
            set.follow(&scheme, &u)
        };
        if per == Per::Face && (changed == 0 || arrived) {
            per = Per::Condition;
            let by_face = std::mem::replace(&mut set, ActiveSet::new(&scheme, &u, per));
            changed = set.differs(&by_face);
        }
        r = scheme.residual(&u);
        set.scale_rows(&scheme, &mut r);
        let before = residuals.last().copied();
        let residual = scale.relative(&scheme, &set, &u, &r);
        increments.push(increment);
        changes.push(changed);
        residuals.push(residual);
        progress(increments.len(), increment)?;
        if !increment.is_finite() {
            break;
        }
        if per == Per::Condition && arrived {
            ended = Ended::Increment;
        } else if residual <= ROUNDING && before.is_some_and(|r| r <= ROUNDING) {
            ended = Ended::Rounding;
        }
    }
    let mut step = increments.len();
    let converged = ended != Ended::NotReached;
    if !converged && !residuals.last().is_some_and(|r| *r <= best.0) && !best.2.is_empty() {
        (_, step, u) = best;
    }
    Ok(Solution {
        u,
        step,
        increments,
        changes,
        residuals,
        ended,
        converged,
        seconds: Timings {
            factor,
            iterate: clock.elapsed().as_secs_f64(),
        },
    })
}

/// What residuals are relative to.
struct Scale {
    /// ‖A‖ in the maximum norm, max |L|.
    stiffness: f64,
    load: f64,
}

impl Scale {
    fn new(problem: &Problem) -> Self {
        let rows = problem.stiffness.sizes(&vec![1.0; problem.space.dofs]);
        Scale {
            stiffness: largest(&rows),
            load: largest(&problem.load),
        }
    }

    /// max |R_i| over ‖A‖ max |u|, max |L| and the largest contact term; 0 where all vanish. Rows
    /// are scaled as `set` has them.
    fn relative(&self, scheme: &Scheme, set: &ActiveSet, u: &[f64], r: &[f64]) -> f64 {
        let size = largest(r);
        if size == 0.0 {
            return 0.0;
        }
        let mut terms = self.stiffness * largest(u) + self.load;
        for (condition, law) in scheme
            .conditions
            .iter()
            .zip(set.laws(scheme, Iteration::Newton))
        {
            let [gap, flux] = condition.sizes(u);
            let law = law[0] * gap + law[1] * condition.gamma * flux;
            for j in 0..condition.dofs.len() {
                let (test, g) = (condition.test(j), condition.flux_test(j));
                terms = terms.max(condition.weight * (law * test.abs() + flux * g.abs()));
            }
        }
        size / terms
    }
}

/// The largest |v_i|; NaN where there is one.
fn largest(v: &[f64]) -> f64 {
    v.iter().fold(
        0.0,
        |m: f64, v| {
            if v.is_nan() { f64::NAN } else { m.max(v.abs()) }
        },
    )
}

/// ‖δ‖_{1,h} / ‖u‖_{1,h} with ‖v‖²_{1,h} = ‖∇v‖²_h + ‖v‖²; 0 where both vanish.
fn relative_increment(problem: &Problem, mass: &Symmetric, step: &[f64], u: &[f64]) -> f64 {
    let norm = |v: &[f64]| (problem.stiffness.energy(v) + mass.energy(v)).sqrt();
    // Squares of what is not near 1 would overflow, or vanish.
    let norm = |v: &[f64]| {
        let unit = largest(v);
        if unit == 0.0 || (1e-100..1e100).contains(&unit) {
            return norm(v);
        }
        unit * norm(&v.iter().map(|x| x / unit).collect::<Vec<_>>())
    };
    let increment = norm(step);
    if increment == 0.0 {
        return 0.0;
    }
    increment / norm(u)
}
