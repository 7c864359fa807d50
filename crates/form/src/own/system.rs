//! The linear system of a form, as other programs can read it.

use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::io::{Coordinates, DofTable};
use faceoff_mesh::mesh::Mesh;

use super::assemble::{Assembler, Wanted};
use super::batch::State;
use super::held::held;
use super::places::dof_table;
use crate::problem::Problem;

/// A, b and the table of dofs of a form: the derivative of F at 0 and -F(0; ·), with rows of the identity for given dofs. Means and their multipliers are not
/// part of it.
///
/// # Errors
/// A form with steps in time; a mesh on which nothing can be solved; values that are not finite.
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
    let zero = vec![0.0; count];
    let state = State {
        u: &zero,
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
            "shift the problem so that its derivative at 0 exists",
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
    Ok((matrix, load.collect(), dof_table(&assembler)?))
}
