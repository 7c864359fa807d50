//! Medit's `.mesh`, text, and `.meshb`, binary of versions 1 to 4, in one to three dimensions: keywords, each with a count
//! and rows that end in a label.
//!
//! The format has no names of groups: in text they are kept in comment lines, which other readers skip.

mod binary;
mod read;
mod sections;
pub mod sol;
mod write;

use super::Native;
use crate::mesh::CellKind;

pub static FORMAT: Native = Native {
    title: "Medit",
    names: &["medit"],
    suffixes: &["mesh", "meshb"],
    has_binary: true,
    holds_whole: false,
    recognises: sections::recognises,
    read: read::read,
    write: write::write,
};

/// Keywords of cells and their numbers in binary files. Nodes are in Gmsh's order, except for the [`SWAPPED`].
const CELLS: [(&str, i32, CellKind); 11] = [
    ("Edges", 5, CellKind::Line),
    ("Triangles", 6, CellKind::Triangle),
    ("Quadrilaterals", 7, CellKind::Quadrangle),
    ("Tetrahedra", 8, CellKind::Tetrahedron),
    ("Hexahedra", 10, CellKind::Hexahedron),
    ("Prisms", 9, CellKind::Prism),
    ("Pyramids", 49, CellKind::Pyramid),
    ("EdgesP2", 25, CellKind::Line3),
    ("TrianglesP2", 24, CellKind::Triangle6),
    ("QuadrilateralsQ2", 27, CellKind::Quadrangle9),
    ("TetrahedraP2", 30, CellKind::Tetrahedron10),
];

/// The nodes of the quadratic tetrahedron that Gmsh has the other way round.
const SWAPPED: (usize, usize) = (8, 9);

/// Starts the comment that names a group; dimension, label and name follow.
const NAME: &[u8] = b"# faceoff group ";
