//! Semismooth Newton, and the paper's fixed point. For the variational inequalities Newton is the
//! primal-dual active set strategy (M. Hintermüller, K. Ito, K. Kunisch, SIAM J. Optim. 13, 2002).
//!
//! Every iteration here solves (A + N) δ = -R(u) with the exact residual R of (2.4). They differ
//! only in how the law u-ψ + [P(u)]₊ enters the matrix at each quadrature point, as
//! α (u-ψ) + β γ ∂ₙu:
//!
//! ```text
//! Newton                       (α, β) = (0, 1) where P > 0, (1, 0) where P ≤ 0
//! [P]₊ lagged as a whole       (1, 0)
//! [u-ψ-γ∂ₙu]₊ lagged           (0, 1)
//! flux new, displacement old   (1, 1) where P > 0, (1, 0) where P ≤ 0
//! ```

use std::fmt;
use std::str::FromStr;
use std::time::Instant;

use super::Problem;
use super::condensed::Condensed;
use super::conditions::Condition;
use crate::assembly;
use crate::error::{Error, Result};
use crate::linear::Symmetric;

/// How the nonlinear system is solved.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Iteration {
    /// Semismooth Newton.
    #[default]
    Newton,
    /// The paper's fixed point. Its splitting is not stated there.
    FixedPoint(Splitting),
}

/// The splittings that were tried for the paper's fixed point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Splitting {
    /// `[P]₊` lagged as a whole; converges for γ₀ < 1 only.
    LaggedP,
    /// `[u-ψ-γ∂ₙu]₊` lagged; needs γ above about 0.28.
    LaggedGap,
    /// The indicator of contact lagged, P new, under-relaxed by 1/6.
    Relaxed,
    /// In P the flux new, the displacement lagged.
    FluxNew,
}

const SPLITTINGS: [(&str, Splitting); 4] = [
    ("lagged-p", Splitting::LaggedP),
    ("lagged-gap", Splitting::LaggedGap),
    ("relaxed", Splitting::Relaxed),
    ("flux-new", Splitting::FluxNew),
];

impl FromStr for Iteration {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "newton" {
            return Ok(Iteration::Newton);
        }
        SPLITTINGS
            .iter()
            .find(|(name, _)| *name == text)
            .map(|(_, splitting)| Iteration::FixedPoint(*splitting))
            .ok_or_else(|| {
                let names: Vec<_> = SPLITTINGS.iter().map(|(name, _)| *name).collect();
                format!(
                    "there is no iteration `{text}`: use newton, or a splitting of the fixed point: {}",
                    names.join(", ")
                )
            })
    }
}

impl fmt::Display for Iteration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Iteration::Newton => f.pad("newton"),
            Iteration::FixedPoint(splitting) => {
                let name = SPLITTINGS.iter().find(|(_, s)| s == splitting);
                f.pad(name.map_or("fixed-point", |(name, _)| name))
            }
        }
    }
}

impl Iteration {
    /// (α, β) at a quadrature point.
    fn law(self, p: f64) -> [f64; 2] {
        let separated = p > 0.0;
        match self {
            Iteration::Newton | Iteration::FixedPoint(Splitting::Relaxed) => {
                if separated {
                    [0.0, 1.0]
                } else {
                    [1.0, 0.0]
                }
            }
            Iteration::FixedPoint(Splitting::LaggedP) => [1.0, 0.0],
            Iteration::FixedPoint(Splitting::LaggedGap) => [0.0, 1.0],
            Iteration::FixedPoint(Splitting::FluxNew) => {
                if separated {
                    [1.0, 1.0]
                } else {
                    [1.0, 0.0]
                }
            }
        }
    }

    /// Does the matrix stay the same from step to step?
    fn is_constant(self) -> bool {
        matches!(
            self,
            Iteration::FixedPoint(Splitting::LaggedP | Splitting::LaggedGap)
        )
    }

    fn relaxation(self) -> f64 {
        match self {
            Iteration::FixedPoint(Splitting::Relaxed) => 1.0 / 6.0,
            _ => 1.0,
        }
    }
}

/// When to stop: the relative broken H¹ norm of the increment, as in section 6.
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

/// Seconds spent.
#[derive(Debug, Clone, Copy, Default)]
pub struct Timings {
    pub factor: f64,
    pub iterate: f64,
}

/// What an iteration ended with.
#[derive(Debug, Clone)]
pub struct Solution {
    /// u at all dofs.
    pub u: Vec<f64>,
    /// The relative increment of each step.
    pub increments: Vec<f64>,
    pub converged: bool,
    pub seconds: Timings,
}

/// Solves (3.1). `progress` is told each step and its relative increment, and may end the run.
///
/// # Errors
/// What `progress` returns; a fixed point for a method that has none; a stiffness that is not positive definite, or a singular Newton matrix. An iteration that does
/// not reach its tolerance is no error: it says so.
pub fn solve(
    problem: &Problem,
    iteration: Iteration,
    stop: Stop,
    mut progress: impl FnMut(usize, f64) -> Result<()>,
) -> Result<Solution> {
    if iteration != Iteration::Newton && !problem.method.is_nitsche() {
        return Err(Error::usage(
            format!(
                "{iteration} is a fixed point of the family (2.4), and {} is not of it",
                problem.method
            ),
            "use newton, which for the variational inequalities is the primal-dual active set",
        ));
    }
    let clock = Instant::now();
    let mass = assembly::mass(&problem.space);
    let condensed = Condensed::new(problem)?;
    let factor = clock.elapsed().as_secs_f64();
    let clock = Instant::now();
    let mut u = problem.start();
    let mut increments = Vec::new();
    let mut converged = false;
    let mut matrix = None;
    while !converged && increments.len() < stop.max_iterations {
        if matrix.is_none() || !iteration.is_constant() {
            let choose = |condition: &Condition| iteration.law(condition.trace(&u).p);
            matrix = Some(condensed.contact_matrix(problem, choose));
        }
        let Some(contact) = &matrix else { break };
        let step = condensed.step(contact, &problem.residual(&u))?;
        let step: Vec<f64> = step.iter().map(|d| iteration.relaxation() * d).collect();
        for (u, d) in u.iter_mut().zip(&step) {
            *u += d;
        }
        let increment = relative_increment(problem, &mass, &step, &u);
        increments.push(increment);
        progress(increments.len(), increment)?;
        converged = increment < stop.increment;
        if !increment.is_finite() {
            break;
        }
    }
    Ok(Solution {
        u,
        increments,
        converged,
        seconds: Timings {
            factor,
            iterate: clock.elapsed().as_secs_f64(),
        },
    })
}

/// ‖δ‖_{1,h} / ‖u‖_{1,h} with ‖v‖²_{1,h} = ‖∇v‖²_h + ‖v‖²; 0 where both vanish.
fn relative_increment(problem: &Problem, mass: &Symmetric, step: &[f64], u: &[f64]) -> f64 {
    let norm = |v: &[f64]| (problem.stiffness.energy(v) + mass.energy(v)).sqrt();
    let increment = norm(step);
    if increment == 0.0 {
        return 0.0;
    }
    increment / norm(u)
}
