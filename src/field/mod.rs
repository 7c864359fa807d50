//! Values that belong to a mesh: on its points, its cells, or the whole of it.

pub mod data;

pub use data::{Whole, WholeValues};
