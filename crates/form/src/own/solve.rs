//! Newton's method as in all scripts: from 0, Dirichlet values by the first increment, until an increment is nothing.

use faceoff_fem::linear::General;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Mesh;

use super::assemble::{Assembler, Wanted};
use super::batch::State;
use super::held::{Held, held, initial, means};
use crate::problem::Problem;

/// Newton's method takes no more steps than this.
const MOST_STEPS: usize = 30;
/// The last increment, over the largest dof.
const SMALL: f64 = 1e-10;

/// The solution of a form.
#[derive(Debug)]
pub struct Solution {
    /// The form on its mesh.
    pub assembler: Assembler,
    /// The dofs of all unknowns.
    pub u: Vec<f64>,
    /// Steps of Newton's method, in all steps in time.
    pub steps: usize,
}

/// Solves a form on a mesh.
///
/// # Errors
/// A mesh on which nothing can be solved, a singular matrix, values that are not finite, and an iteration that does not converge.
pub fn solve(problem: &Problem, source: &Mesh) -> Result<Solution> {
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
        steps += newton(&assembler, &held, &old, &parameters, is_linear, &mut u)?;
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
    old: &[f64],
    parameters: &[f64],
    is_linear: bool,
    u: &mut [f64],
) -> Result<usize> {
    let means = means(&assembler.problem, &assembler.mesh, &assembler.dofs);
    let mut factor: Option<General> = None;
    for step in 1..=MOST_STEPS {
        cancel::check()?;
        let is_new = factor.is_none() || !is_linear;
        let wanted = if is_new {
            Wanted::Both
        } else {
            Wanted::Residual
        };
        let system = assembler.assemble(State { u, old, parameters }, wanted);
        finite(&assembler.problem, &system.residual)?;
        let mut d = vec![0.0; u.len()];
        for (k, value) in held
            .values
            .iter()
            .enumerate()
            .filter(|(k, _)| held.is_held[*k])
        {
            d[k] = u[k] - value;
        }
        let mut right = system.residual;
        if is_new {
            finite(&assembler.problem, &system.matrix)?;
            factor = Some(reduced(
                assembler,
                held,
                &means,
                &system.matrix,
                &d,
                &mut right,
            )?);
        }
        let mut b: Vec<f64> = (0..u.len())
            .filter(|k| !held.is_held[*k])
            .map(|k| right[k])
            .collect();
        b.extend(means.iter().map(|(row, wanted)| {
            let all = row.iter().zip(u.iter()).zip(&d).enumerate();
            let sum: f64 = all
                .map(|(k, ((r, u), d))| r * if held.is_held[k] { u - d } else { *u })
                .sum();
            sum - wanted
        }));
        let x = match &factor {
            Some(factor) => factor
                .solve(&b)
                .map_err(|e| singular(&assembler.problem, e))?,
            None => Vec::new(),
        };
        let mut next = x.into_iter();
        for (_, d) in d.iter_mut().enumerate().filter(|(k, _)| !held.is_held[*k]) {
            *d = next.next().unwrap_or(f64::NAN);
        }
        for (k, u) in u.iter_mut().enumerate() {
            *u = if held.is_held[k] {
                held.values[k]
            } else {
                *u - d[k]
            };
        }
        finite(&assembler.problem, u)?;
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

/// The matrix of the free dofs with the given means below, factored; what the increments of given dofs contribute is taken from the right side.
fn reduced(
    assembler: &Assembler,
    held: &Held,
    means: &[(Vec<f64>, f64)],
    values: &[f64],
    d: &[f64],
    right: &mut [f64],
) -> Result<General> {
    let mut number = vec![None; d.len()];
    let mut count = 0;
    for (_, number) in number
        .iter_mut()
        .enumerate()
        .filter(|(k, _)| !held.is_held[*k])
    {
        *number = Some(count);
        count += 1;
    }
    let mut rows: Vec<Vec<(usize, f64)>> = vec![Vec::new(); count];
    assembler
        .pattern
        .for_rows(&assembler.dofs, |dof, columns, at| {
            let Some(row) = number[dof] else { return };
            let values = &values[at..at + columns.len()];
            let mut moved = 0.0;
            rows[row].reserve(columns.len() + means.len());
            for (column, value) in columns.iter().zip(values) {
                match number[*column as usize] {
                    Some(column) => rows[row].push((column, *value)),
                    None => moved += value * d[*column as usize],
                }
            }
            right[dof] -= moved;
            for (k, (mean, _)) in means
                .iter()
                .enumerate()
                .filter(|(_, (mean, _))| mean[dof] != 0.0)
            {
                rows[row].push((count + k, mean[dof]));
            }
        });
    for (mean, _) in means {
        let entries = mean.iter().enumerate().filter(|(_, value)| **value != 0.0);
        rows.push(
            entries
                .filter_map(|(dof, value)| Some((number[dof]?, *value)))
                .collect(),
        );
    }
    General::new(rows).map_err(|e| singular(&assembler.problem, e))
}
