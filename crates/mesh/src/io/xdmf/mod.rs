//! XDMF 2 and 3: a description in XML of meshes and fields whose numbers are stored in it, in HDF5 files or in plain bytes.
//!
//! Read are uniform and structured grids, collections over time and space, what includes or refers to elsewhere in the file (as
//! dolfinx and meshio write it), mesh tags of dolfinx, sets and meshio's numbers of groups, and functions of dolfin of degree 0 and 1. Files that it names lie
//! in its folder or below. Written is one grid, or one for each time, with the numbers in an HDF5 file of the same name; groups are
//! numbers on cells and their names as meshio has them.

mod item;
mod read;
mod topology;
mod tree;
mod write;

#[cfg(test)]
mod tests;

use super::recognise::{begins, head_has};
use super::{Native, Read};

/// The numbers of the groups of each cell; the name that meshio has for them, as in VTU.
const GROUP: &str = "gmsh:physical";

pub static FORMAT: Native = Native {
    title: "XDMF",
    names: &["xdmf"],
    suffixes: &["xdmf", "xmf"],
    has_binary: true,
    holds_whole: true,
    recognises: |bytes| begins(bytes, "<") && head_has(bytes, "<Xdmf"),
    read: Read::Steps {
        times: read::times,
        at: read::read,
    },
    write: write::write,
};
