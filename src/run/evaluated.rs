//! What an answer is worth: its errors where the solution is known, its quantities, and its certificate.

use faceoff_fem::contact::{Errors, Problem, Quantities, quantities};
use faceoff_fem::known::Truth;
use faceoff_mesh::error::{Error, Result};

/// An answer beside what is known.
#[derive(Debug)]
pub struct Evaluated {
    /// Numbers of u_h.
    pub quantities: Quantities,
    /// Relative to the solution; none where it is not known, or u is not finite.
    pub errors: Option<Errors>,
}

impl Evaluated {
    /// Of u at all dofs of the problem's space.
    ///
    /// # Errors
    /// A known solution that is not finite.
    pub fn new(problem: &Problem, u: &[f64], truth: Option<&Truth>) -> Result<Self> {
        let quantities = quantities(problem, u);
        let known = truth.filter(|_| quantities.grad_norm_sq.is_finite());
        Ok(Evaluated {
            errors: known.map(|truth| truth.errors(problem, u)).transpose()?,
            quantities,
        })
    }
}

/// What is certified, or why nothing is.
///
/// # Errors
/// Other errors than a refusal: those of the linear solver, and an interruption.
pub fn certificate<T>(found: Result<T>) -> Result<Result<T, String>> {
    match found {
        Ok(certified) => Ok(Ok(certified)),
        Err(Error::Certificate { because, .. }) => Ok(Err(because)),
        Err(other) => Err(other),
    }
}
