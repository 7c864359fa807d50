//! CGNS's elements: their numbers, and the order of their nodes against Gmsh's.

use crate::io::sides;
use crate::mesh::{CellKind, Shape};

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

/// The place in Gmsh's order of each node in CGNS's.
pub fn order(kind: CellKind) -> Vec<usize> {
    let (edges, faces): (&[[usize; 2]], &[&[usize]]) = match kind.shape() {
        Shape::Tetrahedron => (&[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]], &[]),
        Shape::Hexahedron => (
            &[
                [0, 1],
                [1, 2],
                [2, 3],
                [3, 0],
                [0, 4],
                [1, 5],
                [2, 6],
                [3, 7],
                [4, 5],
                [5, 6],
                [6, 7],
                [7, 4],
            ],
            &[
                &[0, 1, 2, 3],
                &[0, 1, 4, 5],
                &[1, 2, 5, 6],
                &[2, 3, 6, 7],
                &[0, 3, 4, 7],
                &[4, 5, 6, 7],
            ],
        ),
        Shape::Prism => (
            &[
                [0, 1],
                [1, 2],
                [2, 0],
                [0, 3],
                [1, 4],
                [2, 5],
                [3, 4],
                [4, 5],
                [5, 3],
            ],
            &[&[0, 1, 3, 4], &[1, 2, 4, 5], &[0, 2, 3, 5]],
        ),
        Shape::Pyramid => (
            &[
                [0, 1],
                [1, 2],
                [2, 3],
                [3, 0],
                [0, 4],
                [1, 4],
                [2, 4],
                [3, 4],
            ],
            &[&[0, 1, 2, 3]],
        ),
        _ => return (0..kind.points()).collect(),
    };
    let has_faces = matches!(
        kind,
        CellKind::Hexahedron27 | CellKind::Prism18 | CellKind::Pyramid14
    );
    let corners: Vec<usize> = (0..kind.corners()).collect();
    sides::order(kind, &corners, edges, if has_faces { faces } else { &[] })
}
