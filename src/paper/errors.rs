//! The errors of a solution on the unit square against the mesh-free one, whichever element it has.

use super::distance::distance;
use super::fine::fine_errors;
use faceoff_fem::contact::{Errors, Problem, quantities};
use faceoff_fem::truth::Reference;

/// The errors of u (values at all dofs), relative to the norms of the reference.
///
/// Crouzeix–Raviart by the face means of the reference; conforming elements, which vanish on Γ_D, by Green's formula.
pub fn reference_errors(problem: &Problem, u: &[f64], truth: &Reference) -> Errors {
    if problem.space.element.on().faces && problem.space.element.degree() == 1 {
        distance(&problem.space, u, truth)
    } else {
        fine_errors(problem, u, &quantities(problem, u), truth)
    }
}
