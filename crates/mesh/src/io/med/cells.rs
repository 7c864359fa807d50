//! MED's cells, and the order of their nodes against Gmsh's. MED's cells of three dimensions are mirrored.

use crate::io::sides;
use crate::mesh::{CellKind, Shape};

/// The place in Gmsh's order of each node in MED's.
pub fn order(kind: CellKind) -> Vec<usize> {
    let corners: &[usize] = match kind.shape() {
        Shape::Tetrahedron => &[0, 2, 1, 3],
        Shape::Hexahedron => &[0, 3, 2, 1, 4, 7, 6, 5],
        Shape::Prism => &[0, 2, 1, 3, 5, 4],
        Shape::Pyramid => &[0, 3, 2, 1, 4],
        _ => return (0..kind.points()).collect(),
    };
    sides::order(kind, corners, true)
}
