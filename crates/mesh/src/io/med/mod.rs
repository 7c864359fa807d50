//! MED, the format of Salome and Code_Aster on HDF5, of versions 3 and 4.
//!
//! Read are the points and cells of the first unstructured mesh, the groups of its families, and the fields on nodes, cells and
//! the nodes of cells at all steps. Values at Gauss points, polyhedra and further meshes are not, which is reported. Written is
//! version 4.0: each set of groups is a family.

mod cells;
mod read;
mod write;

use super::{Native, Read};

pub static FORMAT: Native = Native {
    title: "MED",
    names: &["med"],
    suffixes: &["med", "mmed", "rmed"],
    has_binary: true,
    holds_whole: false,
    // What is HDF5 is known by its root.
    recognises: |_| false,
    read: Read::Views(read::read),
    write: write::write,
};
