//! The paper, equation by equation: Nitsche's method for the Signorini problem
//!
//! ```text
//! (1.1)  -Δu = f in Ω,  u = g on Γ_D,  ∂ₙu = t on Γ_N,
//!        u ≤ ψ,  ∂ₙu ≤ 0,  (u-ψ) ∂ₙu = 0 on Γ_C
//! ```
//!
//! E. Burman, P. Hansbo, M. G. Larson: The penalty-free Nitsche method and nonconforming finite
//! elements for the Signorini problem, SIAM J. Numer. Anal. 55 (2017). The paper has
//! g = t = ψ = 0; with ψ, u becomes u-ψ wherever the contact condition is meant.

mod active_set;
mod condensed;
mod conditions;
mod contact_set;
mod discretisation;
mod errors;
mod form;
mod iteration;
mod krylov;
mod method;
mod nested;
mod quantities;
mod scheme;
mod sensitivity;
mod solve;
mod system;

pub use crate::assembly::combine as gradient;
pub use conditions::Condition;
pub use contact_set::{ContactSet, ZoneFace, Zones};
pub use discretisation::Discretisation;
pub use errors::{Errors, errors};
pub use form::{ContactFace, Problem};
pub use iteration::{Iteration, Splitting};
pub use method::{Law, Method};
pub use quantities::{Quantities, face_fields, quantities};
pub use sensitivity::condition;
pub use solve::{Ended, Solution, Stop, Timings, solve, solve_by};
pub use system::Built;

#[cfg(test)]
mod random_tests;
#[cfg(test)]
mod solve_tests;
#[cfg(test)]
mod tests;
