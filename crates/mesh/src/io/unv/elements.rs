//! The types of elements by their numbers, and the order of their nodes.

use crate::io::sides::{Between, place};
use crate::mesh::{CellKind, Shape};

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

/// Whether a line about the orientation precedes the nodes.
pub fn is_beam(descriptor: u64) -> bool {
    matches!(descriptor, 11 | 21..=24)
}

/// The place in Gmsh's order of each node: around the bottom, corners and middles in turn, then up, then around the top.
pub fn order(kind: CellKind) -> Vec<usize> {
    let around = |first: usize, count: usize| {
        (0..count).flat_map(move |i| [[first + i, first + i], [first + i, first + (i + 1) % count]])
    };
    let up = |count: usize, to: usize| (0..count).map(move |i| [i, to + i]);
    let tip = |tip: usize| (0..=tip).map(move |i| [i, tip]);
    let (shape, corners) = (kind.shape(), kind.corners());
    let betweens: Vec<Between> = match shape {
        // Those of no middles, and what is beyond the format.
        _ if kind.points() == corners || kind == CellKind::Quadrangle9 => {
            return (0..kind.points()).collect();
        }
        Shape::Line => vec![[0, 0], [0, 1], [1, 1]],
        Shape::Tetrahedron | Shape::Pyramid => {
            around(0, corners - 1).chain(tip(corners - 1)).collect()
        }
        Shape::Prism | Shape::Hexahedron => {
            let half = corners / 2;
            let bottom = around(0, half).chain(up(half, half));
            bottom.chain(around(half, half)).collect()
        }
        _ => around(0, corners).collect(),
    };
    let places = betweens
        .into_iter()
        .filter_map(|between| place(kind, between));
    places.collect()
}
