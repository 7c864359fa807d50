//! The sides of cells with all their nodes, for formats whose groups are sets of sides.

use crate::mesh::{CellKind, Shape};

/// Corners of the edges of a shape, in Gmsh's order of the nodes on them.
fn edges(shape: Shape) -> &'static [[usize; 2]] {
    match shape {
        Shape::Vertex | Shape::Polygon | Shape::Polyhedron => &[],
        Shape::Line => &[[0, 1]],
        Shape::Triangle => &[[0, 1], [1, 2], [2, 0]],
        Shape::Quadrangle => &[[0, 1], [1, 2], [2, 3], [3, 0]],
        Shape::Tetrahedron => &[[0, 1], [1, 2], [2, 0], [3, 0], [3, 2], [3, 1]],
        Shape::Hexahedron => &[
            [0, 1],
            [0, 3],
            [0, 4],
            [1, 2],
            [1, 5],
            [2, 3],
            [2, 6],
            [3, 7],
            [4, 5],
            [4, 7],
            [5, 6],
            [6, 7],
        ],
        Shape::Prism => &[
            [0, 1],
            [0, 2],
            [0, 3],
            [1, 2],
            [1, 4],
            [2, 5],
            [3, 4],
            [3, 5],
            [4, 5],
        ],
        Shape::Pyramid => &[
            [0, 1],
            [0, 3],
            [0, 4],
            [1, 2],
            [1, 4],
            [2, 3],
            [2, 4],
            [3, 4],
        ],
    }
}

/// Corners of the faces that have a node in the middle, in Gmsh's order of these nodes.
fn centred(kind: CellKind) -> &'static [&'static [usize]] {
    match kind {
        CellKind::Quadrangle9 => &[&[0, 1, 2, 3]],
        CellKind::Hexahedron27 => &[
            &[0, 1, 2, 3],
            &[0, 1, 4, 5],
            &[0, 3, 4, 7],
            &[1, 2, 5, 6],
            &[2, 3, 6, 7],
            &[4, 5, 6, 7],
        ],
        CellKind::Prism18 => &[&[0, 1, 3, 4], &[0, 2, 3, 5], &[1, 2, 4, 5]],
        CellKind::Pyramid14 => &[&[0, 1, 2, 3]],
        _ => &[],
    }
}

/// The place in Gmsh's order of each node of a format that has corners, then nodes on edges, on faces, and inside. `corners` are
/// the places of its corners; `edges` and `faces` name the format's own corners.
pub fn order(
    kind: CellKind,
    corners: &[usize],
    edges: &[[usize; 2]],
    faces: &[&[usize]],
) -> Vec<usize> {
    let mut places = corners.to_vec();
    let known = self::edges(kind.shape());
    for edge in edges
        .iter()
        .take(if is_quadratic(kind) { edges.len() } else { 0 })
    {
        let [a, b] = edge.map(|corner| corners[corner]);
        let on = known
            .iter()
            .position(|&[p, q]| [p, q] == [a, b] || [q, p] == [a, b]);
        places.extend(on.map(|on| corners.len() + on));
    }
    for face in faces {
        let mut of: Vec<usize> = face.iter().map(|&corner| corners[corner]).collect();
        of.sort_unstable();
        let on = centred(kind).iter().position(|known| **known == of);
        places.extend(on.map(|on| corners.len() + known.len() + on));
    }
    places.extend(places.len()..kind.points());
    places
}

/// Whether a cell has one node in the middle of each edge, and none elsewhere but in the middle of faces and inside.
fn is_quadratic(kind: CellKind) -> bool {
    let corners = kind.shape().corners();
    let known = !matches!(kind, CellKind::Other(_)) && corners > 0;
    known && kind.points() >= corners + edges(kind.shape()).len()
}

/// The side of a cell with these corners: its kind, and the places of its nodes among those of the cell. None if the cell
/// is of an order whose sides are not known here.
pub fn side(kind: CellKind, corners: &[usize]) -> Option<(CellKind, Vec<usize>)> {
    let mut nodes = corners.to_vec();
    if nodes.len() == 1 {
        return Some((CellKind::Vertex, nodes));
    }
    let first = kind.corners();
    let quadratic = is_quadratic(kind);
    if !quadratic && kind.points() != first {
        return None;
    }
    if quadratic {
        let edges = edges(kind.shape());
        let turns = if corners.len() == 2 { 1 } else { corners.len() };
        for k in 0..turns {
            let ends = [corners[k], corners[(k + 1) % corners.len()]];
            let on = edges
                .iter()
                .position(|&[a, b]| [a, b] == ends || [b, a] == ends)?;
            nodes.push(first + on);
        }
        let mut sorted = corners.to_vec();
        sorted.sort_unstable();
        if let Some(on) = centred(kind).iter().position(|face| **face == sorted) {
            nodes.push(first + edges.len() + on);
        }
    }
    let kind = match nodes.len() {
        2 => CellKind::Line,
        3 if corners.len() == 2 => CellKind::Line3,
        3 => CellKind::Triangle,
        4 => CellKind::Quadrangle,
        6 => CellKind::Triangle6,
        8 => CellKind::Quadrangle8,
        9 => CellKind::Quadrangle9,
        _ => return None,
    };
    Some((kind, nodes))
}
