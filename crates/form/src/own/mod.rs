//! Our own solver of weak forms: it evaluates the same expressions that scripts are written from, at the same points.
//!
//! [`solve`] is Newton's method as in all scripts; [`Assembler`] has the sums of integrals that it needs, which also say how well a result of
//! any code satisfies a form.

mod assemble;
mod batch;
mod dofs;
mod element;
mod held;
mod output;
mod solve;
mod tape;
mod work;

pub use assemble::{Assembler, System, Wanted};
pub use batch::State;
pub use dofs::{Dofs, Pattern};
pub use held::{Held, held};
pub use output::{output, values};
pub use solve::{Solution, solve};
