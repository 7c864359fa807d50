//! The types of elements by their numbers, and the order of their nodes.

use crate::io::sides::Between;
use crate::mesh::CellKind;

/// The kind of an element with this descriptor and number of nodes.
pub fn kind(descriptor: u64, nodes: usize) -> Option<CellKind> {
    let dim = match (descriptor, nodes) {
        (161, 1) => 0,
        (11..=32, 2 | 3) | (121 | 136..=139, 2) => 1,
        (41..=99, 3 | 4 | 6 | 8 | 9) | (100..=109, 3) => 2,
        (101..=119, 4 | 5 | 6 | 8 | 10 | 13 | 15 | 20) | (312, 5 | 13) => 3,
        _ => return None,
    };
    CellKind::of_points(dim, nodes)
}

/// The descriptors that are written.
pub const WRITTEN: [(CellKind, u64); 15] = [
    (CellKind::Line, 21),
    (CellKind::Line3, 24),
    (CellKind::Triangle, 41),
    (CellKind::Triangle6, 42),
    (CellKind::Quadrangle, 44),
    (CellKind::Quadrangle8, 45),
    (CellKind::Tetrahedron, 111),
    (CellKind::Prism, 112),
    (CellKind::Prism15, 113),
    (CellKind::Hexahedron, 115),
    (CellKind::Hexahedron20, 116),
    (CellKind::Tetrahedron10, 118),
    (CellKind::Pyramid, 312),
    (CellKind::Pyramid13, 114),
    (CellKind::Vertex, 161),
];

/// Whether a line about the orientation stands before the nodes.
pub fn is_beam(descriptor: u64) -> bool {
    matches!(descriptor, 11 | 21..=24)
}

/// Where the nodes lie: around the bottom, corners and middles in turn, then up, then around the top.
pub fn nodes(kind: CellKind) -> Vec<Between> {
    use CellKind as K;
    let around = |first: u8, count: u8| {
        (0..count).flat_map(move |i| [[first + i, first + i], [first + i, first + (i + 1) % count]])
    };
    let up = |count: u8, to: u8| (0..count).map(move |i| [i, to + i]);
    match kind {
        K::Line3 => vec![[0, 0], [0, 1], [1, 1]],
        K::Triangle6 => around(0, 3).collect(),
        K::Quadrangle8 => around(0, 4).collect(),
        K::Tetrahedron10 => around(0, 3)
            .chain([[0, 3], [1, 3], [2, 3], [3, 3]])
            .collect(),
        K::Pyramid13 => around(0, 4)
            .chain([[0, 4], [1, 4], [2, 4], [3, 4], [4, 4]])
            .collect(),
        K::Prism15 => around(0, 3).chain(up(3, 3)).chain(around(3, 3)).collect(),
        K::Hexahedron20 => around(0, 4).chain(up(4, 4)).chain(around(4, 4)).collect(),
        _ => crate::io::sides::nodes(kind).collect(),
    }
}
