//! Linear algebra: the one wrapper of faer. It knows matrices, not meshes.

mod amg;
mod analysis;
mod bisection;
mod cholesky;
mod csr;
mod dense_lu;
mod dissection;
pub mod eigen;
mod elements;
mod embedded;
mod factor;
mod frontier;
mod general;
mod kernels;
mod krylov;
mod lu;
mod lu_plan;
mod multifrontal;
mod plan;
mod pool;
mod schur;
mod settings;
mod sparse;
mod substitution;
mod sweeps;

pub use analysis::Analysis;
pub use cholesky::Cholesky;
pub use csr::Csr;
pub use elements::{Changed, Elements, Role};
pub use embedded::Embedded;
pub use factor::{Choice, Factor, Reduced, condense};
pub use general::General;
pub use krylov::{Ended, KrylovStop, Room, add, conjugate_gradients, dot, gmres, norm};
pub use lu::SchurLu;
pub use multifrontal::Multifrontal;
pub use pool::{clear, zeros};
pub use schur::{LowRank, Row, Schur, Solved};
pub use settings::{Precision, Settings, Solver};
pub use sparse::Symmetric;
pub use sweeps::Sweeps;

/// An entry: row, column, value.
pub type Entry = (u32, u32, f64);

#[cfg(test)]
mod tests;
