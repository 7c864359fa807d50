//! Medit's `.mesh`, text, and `.meshb`, binary of versions 1 to 4, in one to three dimensions: keywords, each with a count
//! and rows that end in a label.
//!
//! The format has no names of groups: in text they are kept in comment lines, which other readers skip.

mod binary;
mod read;
mod sections;
pub mod sol;
mod write;

use super::elements::ELEMENTS;
use super::{Native, Read};
use crate::mesh::CellKind;

pub static FORMAT: Native = Native {
    title: "Medit",
    names: &["medit"],
    suffixes: &["mesh", "meshb"],
    has_binary: true,
    holds_whole: false,
    recognises: sections::recognises,
    read: Read::Once(read::read),
    write: write::write,
};

/// Keywords of cells, their numbers in binary files, and their kinds. Nodes are in Gmsh's order, except for the [`SWAPPED`].
fn cells() -> impl Iterator<Item = (&'static str, i32, CellKind)> {
    let all = ELEMENTS.iter().map(|of| (of.medit.0, of.medit.1, of.kind));
    all.filter(|(keyword, ..)| !keyword.is_empty())
}

/// The nodes of the quadratic tetrahedron that Gmsh has the other way round.
const SWAPPED: (usize, usize) = (8, 9);

/// Starts the comment that names a group; dimension, label and name follow.
const NAME: &[u8] = b"# faceoff group ";
