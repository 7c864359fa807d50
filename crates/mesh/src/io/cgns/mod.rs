//! CGNS, the format of flow solvers, on HDF5 and on ADF.
//!
//! Read are all zones of the first base, unstructured, or structured as hexahedra and quadrangles: boundary conditions, families
//! and sections are groups, solutions are fields, at their times where the base gives these; polygons
//! and polyhedra (NGON_n, NFACE_n) are cells.
//! Written is one unstructured zone on HDF5; each group is a boundary condition.

mod adf;
mod read;
#[cfg(test)]
mod tests;
mod tree;
mod write;

use super::{Native, Read, elements};
use crate::mesh::CellKind;

/// Elements of several kinds; of any number of corners; and of faces.
const MIXED: i64 = 20;
const NGON: i64 = 22;
const NFACE: i64 = 23;

fn number_of(kind: CellKind) -> Option<i64> {
    elements::name(|element| element.cgns, kind)
}

fn kind_of(number: i64) -> Option<CellKind> {
    elements::kind(|element| element.cgns, number)
}

pub static FORMAT: Native = Native {
    title: "CGNS",
    names: &["cgns"],
    suffixes: &["cgns"],
    has_binary: true,
    holds_whole: false,
    // HDF5 is known by its root.
    recognises: adf::is_adf,
    read: Read::Views(read::read),
    write: write::write,
};
