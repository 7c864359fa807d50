//! Values that belong to a mesh: on its points, its cells, its faces, or the whole of it.

pub mod data;
mod faces;
mod results;

pub use data::{Whole, WholeValues};
pub use faces::{ColumnKind, FaceColumn, FaceFields, PADDING};
pub use results::{Carried, Results};
