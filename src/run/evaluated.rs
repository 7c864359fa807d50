//! What an answer is worth: its errors where the solution is known, its quantities, and its certificate.

use faceoff_fem::certify::{Certificate, certify};
use faceoff_fem::contact::{Errors, Problem, Quantities, quantities};
use faceoff_fem::known::Truth;
use faceoff_mesh::error::{Error, Result};

/// An answer beside what is known.
#[derive(Debug)]
pub struct Evaluated {
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

/// A certificate, or why there is none.
///
/// # Errors
/// Those of the linear solver, and an interruption.
pub fn certificate(problem: &Problem, u: &[f64]) -> Result<Result<Certificate, String>> {
    match certify(problem, u) {
        Ok(certificate) => Ok(Ok(certificate)),
        Err(Error::Certificate { because, .. }) => Ok(Err(because)),
        Err(other) => Err(other),
    }
}
