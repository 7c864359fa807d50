//! The types of elements by their numbers, and the order of their nodes.

use crate::io::sides::Between;
use crate::mesh::CellKind;

/// The kind of an element with this descriptor and number of nodes.
pub fn kind(descriptor: u64, nodes: usize) -> Option<CellKind> {
    use CellKind as K;
    Some(match (descriptor, nodes) {
        (161, 1) => K::Vertex,
        (11..=32 | 121 | 136..=139, 2) => K::Line,
        (11..=32, 3) => K::Line3,
        (41..=109, 3) => K::Triangle,
        (41..=99, 4) => K::Quadrangle,
        (41..=99, 6) => K::Triangle6,
        (41..=99, 8) => K::Quadrangle8,
        (41..=99, 9) => K::Quadrangle9,
        (101..=119, 4) => K::Tetrahedron,
        (101..=119 | 312, 5) => K::Pyramid,
        (101..=119, 6) => K::Prism,
        (101..=119, 8) => K::Hexahedron,
        (101..=119, 10) => K::Tetrahedron10,
        (101..=119 | 312, 13) => K::Pyramid13,
        (101..=119, 15) => K::Prism15,
        (101..=119, 20) => K::Hexahedron20,
        _ => return None,
    })
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
