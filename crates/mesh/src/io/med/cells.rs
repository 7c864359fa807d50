//! MED's cells, and the order of their nodes against Gmsh's. MED's cells of three dimensions are mirrored.

use crate::io::sides;
use crate::mesh::{CellKind, Shape};

/// MED's names of kinds.
pub const KINDS: [(&str, CellKind); 18] = [
    ("PO1", CellKind::Vertex),
    ("SE2", CellKind::Line),
    ("SE3", CellKind::Line3),
    ("TR3", CellKind::Triangle),
    ("TR6", CellKind::Triangle6),
    ("QU4", CellKind::Quadrangle),
    ("QU8", CellKind::Quadrangle8),
    ("QU9", CellKind::Quadrangle9),
    ("TE4", CellKind::Tetrahedron),
    ("T10", CellKind::Tetrahedron10),
    ("HE8", CellKind::Hexahedron),
    ("H20", CellKind::Hexahedron20),
    ("H27", CellKind::Hexahedron27),
    ("PE6", CellKind::Prism),
    ("P15", CellKind::Prism15),
    ("P18", CellKind::Prism18),
    ("PY5", CellKind::Pyramid),
    ("P13", CellKind::Pyramid13),
];

pub fn name(kind: CellKind) -> Option<&'static str> {
    KINDS
        .iter()
        .find(|(_, known)| *known == kind)
        .map(|(name, _)| *name)
}

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
