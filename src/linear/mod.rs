//! Linear algebra: the one wrapper of faer. It knows matrices, not meshes.

mod cholesky;
mod dense;
mod ordering;
mod sparse;

pub use cholesky::Cholesky;
pub use dense::{Dense, DenseLu};
pub use ordering::nested_dissection;
pub use sparse::{Symmetric, SymmetricBuilder};
