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
mod choose;
mod condensed;
mod condition;
mod contact_set;
mod continuation;
mod discretisation;
mod errors;
mod face;
mod form;
mod held;
mod iteration;
mod krylov;
mod law;
mod layer;
mod method;
mod quantities;
mod residual;
mod scheme;
mod sensitivity;
mod several;
mod solution;
mod solve;
mod system;
mod theory;
mod unique;

pub use condition::Condition;
pub use contact_set::{ContactSet, ZoneFace, Zones};
pub use discretisation::Discretisation;
pub use errors::{Errors, errors};
pub use face::ContactFace;
pub use form::Problem;
pub use held::Held;
pub use iteration::{Iteration, SPLITTINGS, Splitting};
pub use law::{Formula, Law, Multiplier, Nitsche, OnContact, Penalty};
pub use method::Method;
pub use quantities::{Quantities, face_fields, quantities};
pub use residual::{Rows, Term};
pub use sensitivity::{Conditioning, PartConditioning, condition};
pub use several::{Several, several};
pub use solution::{Ended, Solution, Stop, Timings};
pub use solve::{solve, solve_by};
pub use system::Built;
pub use theory::{Lifting, Positivity, lifting, load_has_no_trace, positivity};
pub use unique::{Doubt, doubt};

#[cfg(test)]
mod random_tests;
#[cfg(test)]
mod solve_tests;
#[cfg(test)]
mod tests;
