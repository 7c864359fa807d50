//! Compares the equations of any code with a form: finds the changed form that they belong to, regardless of the code's solution.

use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Mesh;

use super::explain::{explain, limit, wanted};
use super::residual::{Residual, largest};
use super::{Explanation, Term, terms};
use crate::own::Assembler;
use crate::problem::Problem;

/// Entries of systems that differ by at most this fraction of a row are equal up to rounding.
const UNIT: f64 = 2.5e-13;

/// Another code's equations in relation to a form.
#[derive(Debug)]
pub struct Equations {
    /// The largest difference of a row from that of the form, relative to its size.
    pub left: f64,
    /// The bound for rounding.
    pub limit: f64,
    /// The terms of F, in their order.
    pub terms: Vec<Term>,
    /// The changed form whose equations they are; `None` if they are those of the given form, or no such form is known.
    pub explanation: Option<Explanation>,
}

/// Compares F(u; ·) with `rows`, the residual of the same u in another code's equations: u has any values of all dofs, with the code's own where it prescribes them. A row that
/// the code does not have is `None`.
///
/// # Errors
/// A form with time steps; a number of rows that differs from that of the form; a residual that is not finite.
pub fn equations(
    problem: &Problem,
    source: &Mesh,
    u: Vec<f64>,
    rows: &[Option<f64>],
) -> Result<Equations> {
    let assembler = Assembler::of(problem, source, &problem.integrals, true)?;
    if problem.time.is_some() || [u.len(), rows.len()] != [assembler.dofs.count(); 2] {
        let what = format!(
            "{} rows are not those of {}, which has {} and no steps in time",
            rows.len(),
            problem.name,
            assembler.dofs.count()
        );
        return Err(Error::usage(what, "give one row for each dof"));
    }
    let mut residual = Residual::of(problem, source, assembler, u)?;
    let mut goal: Vec<f64> = rows.iter().map(|row| row.unwrap_or(0.0)).collect();
    residual.free(&mut goal);
    residual.goal = goal;
    // A row without a size explains nothing, and needs no explanation.
    for (size, _) in residual
        .sizes
        .iter_mut()
        .zip(rows)
        .filter(|(_, row)| row.is_none())
    {
        *size = 0.0;
    }
    let left = largest(&wanted(&residual, &residual.values));
    let is_form = left <= limit(UNIT);
    Ok(Equations {
        left,
        limit: limit(UNIT),
        terms: terms(&residual),
        explanation: if is_form {
            None
        } else {
            explain(&residual, UNIT)
        },
    })
}
