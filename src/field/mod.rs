//! Values on the parts of a mesh.

mod faces;

pub use faces::{ColumnKind, FaceColumn, FaceFields};
