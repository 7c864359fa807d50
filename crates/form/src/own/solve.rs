//! Newton's method as in all scripts: from 0, with Dirichlet values imposed by the first increment, until an increment is negligible.

use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Mesh;

use super::assemble::{Assembler, System, Wanted};
use super::batch::State;
use super::held::{Held, held, initial};
use super::reduced::Reduced;
use crate::problem::Problem;

/// The most steps of Newton's method.
const MOST_STEPS: usize = 200;
/// The number of full steps, as in all scripts. If they have not converged, active sets repeat: from then on each step is the fraction
/// that leaves the smallest residual.
const WHOLE_STEPS: usize = 12;
/// The most halvings of a step.
const HALVINGS: i32 = 6;
/// The stopping tolerance for an increment, relative to the largest dof.
const SMALL: f64 = 1e-10;

/// The solution of a form.
#[derive(Debug)]
pub struct Solution {
    /// The form on its mesh.
    pub assembler: Assembler,
    /// The dofs of all unknowns.
    pub u: Vec<f64>,
    /// The number of steps of Newton's method, over all time steps.
    pub steps: usize,
}

/// Solves a form on a mesh.
///
/// # Errors
/// A mesh on which the form cannot be solved, a singular matrix, values that are not finite, and an iteration that does not converge.
pub fn solve(problem: &Problem, source: &Mesh) -> Result<Solution> {
    solve_with(problem, source, |_| ())
}

/// The same, and calls `with` with the dofs after each step of Newton's method.
///
/// # Errors
/// Errors of [`solve()`].
pub fn solve_with(
    problem: &Problem,
    source: &Mesh,
    mut with: impl FnMut(&[f64]),
) -> Result<Solution> {
    let assembler = Assembler::new(problem, source)?;
    let is_linear = problem.clone().is_linear();
    let mut parameters: Vec<f64> = problem.parameters.iter().map(|p| p.value).collect();
    let (count, step) = match &problem.time {
        None => (1, None),
        Some(time) => (
            time.steps,
            Some((time.parameter, parameters[time.parameter + 1])),
        ),
    };
    if let Some((t, _)) = step {
        parameters[t] = 0.0;
    }
    let mut u = initial(problem, &assembler.mesh, &assembler.dofs, &parameters);
    let mut old = Vec::new();
    let mut steps = 0;
    for number in 1..=count {
        if let Some((t, dt)) = step {
            parameters[t] = number as f64 * dt;
            old.clone_from(&u);
        }
        let held = held(&assembler, source, &parameters)?;
        let state = State {
            u: &[],
            old: &old,
            parameters: &parameters,
        };
        steps += newton(&assembler, &held, state, is_linear, &mut u, &mut with)?;
    }
    Ok(Solution {
        assembler,
        u,
        steps,
    })
}

/// Solves for u, and returns the number of steps.
fn newton(
    assembler: &Assembler,
    held: &Held,
    state: State,
    is_linear: bool,
    u: &mut [f64],
    with: &mut impl FnMut(&[f64]),
) -> Result<usize> {
    let mut equations = Reduced::new(assembler, held);
    for step in 1..=MOST_STEPS {
        cancel::check()?;
        let is_new = step == 1 || !is_linear;
        let wanted = if is_new {
            Wanted::Both
        } else {
            Wanted::Residual
        };
        let system = assembler.assemble(State { u, ..state }, wanted);
        finite(&assembler.problem, &system.residual)?;
        finite(&assembler.problem, &system.matrix)?;
        let d = equations
            .solve(&system, u)
            .map_err(|e| singular(&assembler.problem, e))?;
        let whole = step <= WHOLE_STEPS || is_linear;
        let part = if whole {
            1.0
        } else {
            damped(assembler, held, state, u, &d, &system)
        };
        move_by(held, u, &d, part);
        finite(&assembler.problem, u)?;
        with(u);
        let largest = |v: &[f64]| v.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        if largest(&d) <= SMALL * largest(u) {
            return Ok(step);
        }
    }
    Err(Error::Solver {
        what: format!(
            "Newton's method did not converge on {} in {MOST_STEPS} steps",
            assembler.problem.name
        ),
        remedy: "scale the data down, or shift the problem so that 0 is near to the solution"
            .into(),
    })
}

/// u minus a fraction of an increment, with the values of prescribed dofs.
fn move_by(held: &Held, u: &mut [f64], d: &[f64], part: f64) {
    for (k, u) in u.iter_mut().enumerate() {
        *u = match held.is_held[k] {
            true => held.values[k],
            false => *u - part * d[k],
        };
    }
}

/// The fraction of an increment after which the residual of the free dofs is smallest, each row relative to its diagonal entry: for a nearly
/// incompressible material the sizes of rows differ widely.
fn damped(
    assembler: &Assembler,
    held: &Held,
    state: State,
    u: &[f64],
    d: &[f64],
    system: &System,
) -> f64 {
    let mut diagonal = vec![0.0; u.len()];
    assembler
        .pattern
        .for_rows(&assembler.dofs, |dof, columns, at| {
            let own = columns.iter().position(|column| *column as usize == dof);
            diagonal[dof] = own.map_or(0.0, |k| system.matrix[at + k].abs());
        });
    let size = |part: f64| {
        let mut there = u.to_vec();
        move_by(held, &mut there, d, part);
        let at = State { u: &there, ..state };
        let residual = assembler.assemble(at, Wanted::Residual).residual;
        let rows = residual.iter().zip(&diagonal).zip(&held.is_held);
        let rows = rows.filter(|(_, is_held)| !**is_held);
        rows.map(|((r, a), _)| if *a > 0.0 { (r / a).powi(2) } else { r * r })
            .sum::<f64>()
    };
    let (mut best, mut smallest) = (1.0, f64::INFINITY);
    for k in 0..=HALVINGS {
        let part = 0.5_f64.powi(k);
        let there = size(part);
        // NaN is not smaller.
        if there < smallest {
            (best, smallest) = (part, there);
        }
    }
    best
}

fn singular(problem: &Problem, error: Error) -> Error {
    match error {
        Error::Solver { what, .. } => Error::Solver {
            what: format!("the form {}: {what}", problem.name),
            remedy: "give Dirichlet values or a mean that fix what F leaves free, and check that spaces fit each other".into(),
        },
        other => other,
    }
}

fn finite(problem: &Problem, values: &[f64]) -> Result<()> {
    match values.iter().all(|v| v.is_finite()) {
        true => Ok(()),
        false => Err(Error::Solver {
            what: format!("a number of {} is not finite", problem.name),
            remedy: "check its expressions for divisions by 0, roots and logarithms of negative numbers, and overflow".into(),
        }),
    }
}
