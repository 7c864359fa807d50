//! Meshes of finite elements, fields on them, and the files that hold both.
//!
//! A file of any format that is known becomes a [`Mesh`] and its fields, and a mesh becomes a file again, with its groups,
//! names and numbers; what a format cannot hold is an error or, on request, a warning each.

pub mod cancel;
pub mod error;
pub mod field;
pub mod io;
pub mod mesh;
pub mod process;

pub use error::{Error, Place, Result};
pub use mesh::Mesh;
