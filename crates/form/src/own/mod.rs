//! Our solver of weak forms: it evaluates the same expressions from which scripts are written, at the same points.
//!
//! [`solve()`] is Newton's method as in all scripts; [`Assembler`] computes the sums of integrals for it, which also show how well a result of
//! any code satisfies a form ([`crate::judge`]).

mod assemble;
mod batch;
mod dofs;
mod eigen;
mod element;
mod functional;
mod held;
mod on_cells;
mod on_facets;
mod output;
mod places;
mod read;
mod reduced;
mod solve;
mod system;
mod tape;
#[cfg(test)]
mod tests;
mod work;

pub use assemble::{Assembler, System, Wanted};
pub use batch::State;
pub(crate) use dofs::is_on_facet;
pub use dofs::{Dofs, Pattern};
pub use eigen::{Pair, Pencil};
pub(crate) use element::Shape;
pub use functional::Functionals;
pub use held::{Held, held};
pub(crate) use held::{means, value};
pub use on_cells::with_means;
pub use on_facets::{Means, OnFacets};
pub use output::{output, values};
pub use places::dof_table;
pub(crate) use places::places;
pub(crate) use read::read;
pub use solve::{Solution, solve, solve_with};
pub use system::{state, system};
pub(crate) use work::{Entity, Work, facets};
