//! Linear algebra: the one wrapper of faer. It knows matrices, not meshes.

mod cholesky;
mod dense;
mod gmres;
mod ordering;
mod sparse;

pub use cholesky::Cholesky;
pub use dense::{Dense, DenseLu};
pub use gmres::gmres;
pub use ordering::nested_dissection;
pub use sparse::{Symmetric, SymmetricBuilder};
