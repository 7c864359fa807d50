//! Bytes to meshes and fields, and back.

pub mod msh;
mod loss;
mod out;
mod scan;

use crate::mesh::Mesh;

/// What a file holds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Content {
    pub mesh: Mesh,
    /// The name of the format: `msh`, `vtu`, `freefem`, `medit`, or as meshio calls it.
    pub format: String,
    /// The format's version as the file gives it.
    pub version: Option<String>,
    /// `ascii`, `binary-little`, `binary-big`, or what else the format calls it.
    pub encoding: String,
    /// What is odd about the file, although it was read whole.
    pub warnings: Vec<String>,
    /// What the file holds and `mesh` does not.
    pub unread: Vec<String>,
}
