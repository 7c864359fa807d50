//! Linear algebra: the one wrapper of faer. It knows matrices, not meshes.

mod analysis;
mod bisection;
mod cholesky;
mod elements;
mod factor;
mod gmres;
mod kernels;
mod memory;
mod multifrontal;
mod schur;
mod settings;
mod sparse;

pub use analysis::Analysis;
pub use cholesky::Cholesky;
pub use elements::{Elements, Role};
pub use factor::{Choice, Factor, Reduced, condense};
pub use gmres::gmres;
pub use multifrontal::Multifrontal;
pub use schur::{Entry, LowRank, Row, Schur, SchurLu};
pub use settings::{Precision, Settings, Solver};
pub use sparse::Symmetric;

#[cfg(test)]
mod tests;
