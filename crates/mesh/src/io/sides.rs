//! The positions of the nodes of quadratic cells, and the facets of cells.

use super::vtu::lattice::{Order, scheme};
use crate::mesh::{CellKind, Shape};

/// A node by the two corners of a cell that it lies between: one corner twice for that corner, opposite corners of a
/// face or of the cell for its centre.
pub type Between = [usize; 2];

/// The edges of a cell in the order of their nodes, as Gmsh has it.
pub fn edges(shape: Shape) -> &'static [Between] {
    scheme(shape, Order::Gmsh).map_or(&[], |(_, edges, _)| edges)
}

/// The middles of the quadrangles whose centres are nodes, in the order of these, as Gmsh has it.
fn centres(shape: Shape) -> impl Iterator<Item = (Between, &'static [usize])> {
    let faces = scheme(shape, Order::Gmsh).map_or(&[][..], |(.., faces)| faces);
    let quadrangles = faces.iter().filter(|face| face.len() == 4);
    quadrangles.map(|face| ([face[0], face[2]], *face))
}

/// The quadrangles of a cell as most formats have them: from the bottom around to the top.
pub fn quadrangles(shape: Shape) -> &'static [[usize; 4]] {
    match shape {
        Shape::Quadrangle | Shape::Pyramid => &[[0, 1, 2, 3]],
        Shape::Prism => &[[0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]],
        Shape::Hexahedron => &[
            [0, 1, 2, 3],
            [0, 1, 5, 4],
            [1, 2, 6, 5],
            [2, 3, 7, 6],
            [3, 0, 4, 7],
            [4, 5, 6, 7],
        ],
        _ => &[],
    }
}

/// The quadratic cell of this shape with this many nodes.
pub fn quadratic(shape: Shape, nodes: usize) -> Option<CellKind> {
    let named = (1..=19).filter_map(CellKind::from_gmsh);
    let mut found = named.filter(|kind| kind.shape() == shape && kind.points() == nodes);
    found.find(|kind| kind.points() > shape.corners())
}

/// The place of a node in Gmsh's order; `None` where a cell of this kind has no such node.
pub fn place(kind: CellKind, [a, b]: Between) -> Option<usize> {
    let shape = kind.shape();
    let corners = shape.corners();
    if a == b {
        return Some(a).filter(|&a| a < corners);
    }
    if matches!(kind, CellKind::Other(_)) {
        return None; // of higher order
    }
    let edges = edges(shape);
    let edge = edges
        .iter()
        .position(|edge| *edge == [a, b] || *edge == [b, a]);
    let face = || {
        let mut faces = centres(shape).map(|(_, face)| face);
        let face = faces.position(|face| face.contains(&a) && face.contains(&b));
        edges.len() + face.unwrap_or(centres(shape).count())
    };
    Some(corners + edge.unwrap_or_else(face)).filter(|&place| place < kind.points())
}

/// The edges of a cell as most formats have them: around the bottom, up, around the top, or up as the last.
pub fn around(shape: Shape, up_last: bool) -> Vec<Between> {
    let all = shape.corners();
    let base = match shape {
        Shape::Triangle | Shape::Tetrahedron | Shape::Prism => 3,
        Shape::Quadrangle | Shape::Pyramid | Shape::Hexahedron => 4,
        _ => return edges(shape).to_vec(),
    };
    let ring = |first: usize| (0..base).map(move |k| [first + k, first + (k + 1) % base]);
    let up = (0..base).filter(|_| all > base);
    let up = up.map(|k| [k, if all == 2 * base { base + k } else { base }]);
    let top = ring(base).filter(|_| all == 2 * base);
    match up_last {
        true => ring(0).chain(top).chain(up).collect(),
        false => ring(0).chain(up).chain(top).collect(),
    }
}

/// The place in Gmsh's order of each node of a format that has corners, then nodes on edges as [`around`], on the
/// [`quadrangles`], and inside. `corners` are the places of its corners.
pub fn order(kind: CellKind, corners: &[usize], up_last: bool) -> Vec<usize> {
    let of = |between: Between| place(kind, between.map(|corner| corners[corner]));
    let edges = around(kind.shape(), up_last);
    let faces = quadrangles(kind.shape()).iter();
    let betweens = edges
        .into_iter()
        .chain(faces.map(|face| [face[0], face[2]]));
    let mut places = corners.to_vec();
    places.extend(betweens.filter_map(of));
    places.extend(places.len()..kind.points());
    places
}

/// [`order`] where the corners are those of Gmsh.
pub fn usual_order(kind: CellKind, up_last: bool) -> Vec<usize> {
    order(kind, &Vec::from_iter(0..kind.corners()), up_last)
}

/// Where the nodes of a cell lie, in Gmsh's order.
pub fn nodes(kind: CellKind) -> impl Iterator<Item = Between> {
    let shape = kind.shape();
    let corners = (0..shape.corners()).map(|a| [a, a]);
    let faces = centres(shape).map(|(centre, _)| centre);
    let all = corners.chain(edges(shape).iter().copied()).chain(faces);
    all.chain([[0, 6]]).take(kind.points())
}

/// The side of a cell that has these corners: its kind and its points, with those on edges and in the middle.
pub fn side(kind: CellKind, nodes: &[u32], corners: &[usize]) -> Option<(CellKind, Vec<u32>)> {
    let node = |between| nodes.get(place(kind, between)?).copied();
    let mut found: Vec<u32> = corners.iter().filter_map(|&a| node([a, a])).collect();
    if found.len() != corners.len() {
        return None;
    }
    let (shape, linear) = match corners.len() {
        1 => return Some((CellKind::Vertex, found)),
        2 => (Shape::Line, CellKind::Line),
        3 => (Shape::Triangle, CellKind::Triangle),
        4 => (Shape::Quadrangle, CellKind::Quadrangle),
        _ => return None,
    };
    if kind.points() == kind.shape().corners() {
        return Some((linear, found));
    }
    let corner = |place: usize| corners.get(place).copied();
    for &[a, b] in edges(shape) {
        found.extend(node([corner(a)?, corner(b)?]));
    }
    if shape == Shape::Quadrangle {
        found.extend(node([corner(0)?, corner(2)?]));
    }
    Some((quadratic(shape, found.len())?, found))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every node of every kind has one place; the middle of a side lies between its corners.
    #[test]
    fn all_nodes_are_named_once() {
        for kind in (1..=19).filter_map(CellKind::from_gmsh) {
            let corners = kind.shape().corners();
            let pairs = (0..corners).flat_map(|a| (0..corners).map(move |b| [a, b]));
            let mut places: Vec<usize> = pairs.filter_map(|pair| place(kind, pair)).collect();
            places.sort_unstable();
            places.dedup();
            assert!(places.into_iter().eq(0..kind.points()), "{kind}");
            let places = nodes(kind).map(|between| place(kind, between));
            assert!(places.eq((0..kind.points()).map(Some)), "{kind}");
        }
        let numbers: Vec<u32> = (0..27).collect();
        let top = side(CellKind::Hexahedron27, &numbers, &[4, 5, 6, 7]);
        let top = top.expect("a face");
        assert_eq!(top.0, CellKind::Quadrangle9);
        assert_eq!(top.1, [4, 5, 6, 7, 16, 18, 19, 17, 25]);
        let edge = side(CellKind::Triangle, &[7, 8, 9], &[2, 0]);
        assert_eq!(edge, Some((CellKind::Line, vec![9, 7])));
        assert_eq!(side(CellKind::Triangle, &[7, 8, 9], &[2, 3]), None);
    }
}
