//! The linear system of a form, for other programs.

use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::io::{Coordinates, DofTable};
use faceoff_mesh::mesh::Mesh;

use super::assemble::{Assembler, Wanted};
use super::batch::State;
use super::held::held;
use super::places::dof_table;
use crate::problem::Problem;

/// A, b and the table of dofs of a form: the derivative of F at 0 and -F(0; ·), for a nonlinear form at [`state`], with rows of the identity for prescribed
/// dofs. Means and their multipliers are not part of it.
///
/// # Errors
/// A form with time steps; a mesh on which it cannot be solved; values that are not finite.
pub fn system(problem: &Problem, source: &Mesh) -> Result<(Coordinates, Vec<f64>, DofTable)> {
    if problem.time.is_some() {
        let what = format!(
            "{} has steps in time, and so no one linear system",
            problem.name
        );
        return Err(Error::usage(what, "compare its fields"));
    }
    let assembler = Assembler::new(problem, source)?;
    let parameters: Vec<f64> = problem.parameters.iter().map(|p| p.value).collect();
    let held = held(&assembler, source, &parameters)?;
    let count = assembler.dofs.count();
    let table = dof_table(&assembler)?;
    let u = match problem.clone().is_linear() {
        true => vec![0.0; count],
        false => state(&table),
    };
    let state = State {
        u: &u,
        old: &[],
        parameters: &parameters,
    };
    let found = assembler.assemble(state, Wanted::Both);
    if found
        .matrix
        .iter()
        .chain(&found.residual)
        .any(|x| !x.is_finite())
    {
        let what = format!("a number of the system of {} is not finite", problem.name);
        return Err(Error::usage(
            what,
            "shift the problem so that its derivative exists at 0, or where it is not linear at values between 15/16 and 17/16",
        ));
    }
    let mut entries = Vec::with_capacity(assembler.pattern.values());
    assembler
        .pattern
        .for_rows(&assembler.dofs, |dof, columns, at| {
            match held.is_held[dof] {
                true => entries.push((dof as u32, dof as u32, 1.0)),
                false => entries.extend(
                    columns
                        .iter()
                        .zip(&found.matrix[at..])
                        .map(|(column, a)| (dof as u32, *column, *a)),
                ),
            }
        });
    let load = (0..count).map(|k| {
        if held.is_held[k] {
            held.values[k]
        } else {
            -found.residual[k]
        }
    });
    let matrix = Coordinates {
        rows: count,
        columns: count,
        entries,
    };
    Ok((matrix, load.collect(), table))
}

/// Values of all dofs that only depend on their positions x and directions d, so that every code has the same: Σ dᵢ (1 + sin(i + x₀ + 2 x₁ + 3 x₂)/16).
pub fn state(dofs: &DofTable) -> Vec<f64> {
    let each = dofs.at.iter().zip(&dofs.direction).map(|(x, d)| {
        let phase = x[0] + 2.0 * x[1] + 3.0 * x[2];
        let along = |i: usize| d[i] * (1.0 + (phase + i as f64).sin() / 16.0);
        (0..3).map(along).sum()
    });
    each.collect()
}
