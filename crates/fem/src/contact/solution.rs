//! When an iteration ends, and what it ends with.

use super::system::Built;
use crate::linear::Choice;

/// When to stop: by the broken gradient of the increment, relative to that of u, which all codes measure; or where
/// rounding leaves nothing to gain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// ‖∇δ‖ < increment · ‖∇u‖, norms over the cells
    pub increment: f64,
    /// Steps after which the iteration ends as [`Ended::NotReached`].
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

/// Why an iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ended {
    /// The increment is below the tolerance, and so is the backward error.
    Increment,
    /// The residual is at rounding, so that the increments cannot get smaller.
    Rounding,
    /// The steps allowed are done, or an overflow; or refinement at all dofs finds no rest.
    NotReached,
    /// The residual is small, but the matrix is singular to working precision: rounding decides what u is.
    Undetermined,
}

impl Ended {
    /// Whether u is converged.
    pub fn converged(self) -> bool {
        matches!(self, Ended::Increment | Ended::Rounding)
    }
}

/// Seconds spent.
#[derive(Debug, Clone, Copy, Default)]
pub struct Timings {
    /// Until the system is there: assembled, and factored or preconditioned.
    pub factor: f64,
    /// For all steps.
    pub iterate: f64,
    /// From u on the contact cells to u everywhere.
    pub expand: f64,
}

/// How an iteration ended.
#[derive(Debug, Clone)]
pub struct Solution {
    /// u at all dofs: of the last step, or where nothing was reached of the step with the smallest
    /// residual.
    pub u: Vec<f64>,
    /// The step that u comes from, from 1; 0 is the start.
    pub step: usize,
    /// Steps at other γ on the way to this one, which are none of the others: see `continuation`.
    pub on_the_way: usize,
    /// The relative increment of each step.
    pub increments: Vec<f64>,
    /// How many contact conditions changed their status after each step.
    pub changes: Vec<usize>,
    /// ‖R(u)‖ after each step, relative to ‖A‖ ‖u‖ and the contact terms, all in the maximum norm.
    pub residuals: Vec<f64>,
    /// Why it ended.
    pub ended: Ended,
    /// Did it end by increment or rounding?
    pub converged: bool,
    /// [`super::Problem::backward_error`] of u.
    pub backward_error: f64,
    /// Its cost.
    pub seconds: Timings,
    /// The solver of the linear systems.
    pub linear: Choice,
    /// The systems that were built for it.
    pub built: Built,
}
