//! Values that belong to a mesh: on its points, cells or faces, or to the mesh as a whole.

pub mod data;
mod faces;
mod results;
mod unread;

pub(crate) use data::to_i64;
pub use data::{GlobalArray, GlobalValues};
pub use faces::{ColumnKind, FaceColumn, FaceFields, PADDING};
pub use results::{ResultField, Results};
pub(crate) use unread::Tell;
pub use unread::Unread;
