//! What an answer is worth: its errors where the solution is known, its quantities, and its certificate.

use faceoff_fem::certify::{Certificate, Target};
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

/// How far a measured error may be off, relative to it: the accuracy of the quadrature that it comes from, twice.
const MEASURED: f64 = 2e-3;
/// And relative to ‖∇u‖, where it is the root of what cancels.
const CANCELLED: f64 = 1e-6;

/// Refuses an error ‖∇(u - u_h)‖ / ‖∇u‖ that the certificate of the same field excludes: what is told lies within what is certified.
///
/// # Errors
/// [`Error::Contradiction`].
pub fn consistent(h1: Option<f64>, certificate: &Certificate) -> Result<()> {
    let Some(h1) = h1 else { return Ok(()) };
    let [least, most] = certificate.of(Target::UH);
    let [low, high] = certificate.gradient;
    let is_within = h1 * low <= most * (1.0 + MEASURED) + CANCELLED * low
        && h1 * high >= least * (1.0 - MEASURED) - CANCELLED * high;
    if is_within {
        return Ok(());
    }
    Err(Error::Contradiction {
        what: format!(
            "the error ‖∇(u - u_h)‖ / ‖∇u‖ = {h1:e} was measured, and {least:e} ≤ ‖∇(u - u_h)‖ ≤ {most:e}, {low:e} ≤ ‖∇u‖ ≤ {high:e} were proved"
        ),
    })
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
