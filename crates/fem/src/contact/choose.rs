//! Which system a scheme is solved by.

use super::condensed::Condensed;
use super::krylov::Krylov;
use super::scheme::Scheme;
use super::system::System;
use crate::linear::{Settings, Solver};
use faceoff_mesh::error::Result;

/// A scheme for a linear solver. `auto` condenses it, unless iterating is predicted to be faster, or
/// the factor does not fit into memory.
///
/// # Errors
/// Nothing to solve for; a stiffness that is not positive definite; a method that the solver does
/// not take; memory that is not there.
pub(super) fn system<'a>(scheme: Scheme<'a>, settings: Settings) -> Result<Box<dyn System + 'a>> {
    let matrices = tracing::debug_span!("matrix").entered();
    scheme.problem.stiffness.keep();
    drop(matrices);
    let instead = match settings.solver {
        Solver::Iterative => return Ok(Box::new(Krylov::new(scheme)?)),
        Solver::Auto => Krylov::predicted(&scheme),
        _ => None,
    };
    Ok(match Condensed::new(scheme, settings, instead)? {
        Ok(condensed) => Box::new(condensed),
        Err(scheme) => Box::new(Krylov::new(scheme)?),
    })
}
