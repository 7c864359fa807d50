//! CGNS's elements by their numbers.

use crate::mesh::CellKind;

pub const MIXED: i64 = 20;
/// Elements of any number of corners, and of faces.
pub const NGON: i64 = 22;
pub const NFACE: i64 = 23;

/// CGNS's numbers of kinds.
const KINDS: [(i64, CellKind); 19] = [
    (2, CellKind::Vertex),
    (3, CellKind::Line),
    (4, CellKind::Line3),
    (5, CellKind::Triangle),
    (6, CellKind::Triangle6),
    (7, CellKind::Quadrangle),
    (8, CellKind::Quadrangle8),
    (9, CellKind::Quadrangle9),
    (10, CellKind::Tetrahedron),
    (11, CellKind::Tetrahedron10),
    (12, CellKind::Pyramid),
    (13, CellKind::Pyramid14),
    (14, CellKind::Prism),
    (15, CellKind::Prism15),
    (16, CellKind::Prism18),
    (17, CellKind::Hexahedron),
    (18, CellKind::Hexahedron20),
    (19, CellKind::Hexahedron27),
    (21, CellKind::Pyramid13),
];

pub fn kind(number: i64) -> Option<CellKind> {
    KINDS
        .iter()
        .find(|(known, _)| *known == number)
        .map(|(_, kind)| *kind)
}

pub fn number(kind: CellKind) -> Option<i64> {
    KINDS
        .iter()
        .find(|(_, known)| *known == kind)
        .map(|(number, _)| *number)
}
