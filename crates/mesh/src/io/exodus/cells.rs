//! Exodus's elements: their names, the order of their nodes against Gmsh's, and their sides.

use crate::io::sides::usual_order;
use crate::mesh::{CellKind, Shape, topology};

/// The kind of an element with this name and number of nodes; the nodes beyond those of the kind, inside the cell or its faces, have
/// no place in it.
pub fn kind(name: &str, nodes: usize) -> Option<CellKind> {
    use CellKind as K;
    let name = name.to_ascii_uppercase();
    let begins = |words: &[&str]| words.iter().any(|word| name.starts_with(word));
    // Superelements couple any number of nodes: VTK has them as points.
    let kinds: &[CellKind] = if begins(&["SPHERE", "CIRCLE", "POINT", "PARTICLE", "SUPER"]) {
        &[K::Vertex]
    } else if begins(&["BAR", "BEAM", "TRUSS", "EDGE", "ROD", "SPRING", "LINE"]) {
        let cubic = CellKind::from_gmsh(26).filter(|_| nodes == 4);
        return cubic.or(fitting(&[K::Line3, K::Line], nodes));
    } else if begins(&["TRI"]) || (begins(&["SHELL"]) && matches!(nodes, 3 | 6 | 7)) {
        &[K::Triangle6, K::Triangle]
    } else if begins(&["QUAD", "SHELL"]) {
        &[K::Quadrangle9, K::Quadrangle8, K::Quadrangle]
    } else if begins(&["TET"]) {
        &[K::Tetrahedron10, K::Tetrahedron]
    } else if begins(&["PYR"]) {
        &[K::Pyramid14, K::Pyramid13, K::Pyramid]
    } else if begins(&["WED", "PRI"]) {
        &[K::Prism18, K::Prism15, K::Prism]
    } else if begins(&["HEX"]) {
        &[K::Hexahedron27, K::Hexahedron20, K::Hexahedron]
    } else {
        return None;
    };
    // After the edges, these have other nodes than our kinds.
    let kinds = match (kinds[0], nodes) {
        (K::Prism18, 16 | 17 | 19..) | (K::Hexahedron27, 21..27) => &kinds[1..],
        _ => kinds,
    };
    fitting(kinds, nodes)
}

fn fitting(kinds: &[CellKind], nodes: usize) -> Option<CellKind> {
    kinds.iter().copied().find(|kind| kind.points() <= nodes)
}

/// The name of a kind, and whether all of it is known to Exodus.
pub fn name(kind: CellKind) -> Option<String> {
    let name = match kind.shape() {
        Shape::Vertex => "SPHERE",
        Shape::Line => "BAR",
        Shape::Triangle => "TRI",
        Shape::Quadrangle => "QUAD",
        Shape::Tetrahedron => "TETRA",
        Shape::Hexahedron => "HEX",
        Shape::Prism => "WEDGE",
        Shape::Pyramid => "PYRAMID",
        Shape::Polygon | Shape::Polyhedron => return None,
    };
    let name = match kind {
        // Plain names are those that meshio knows as well.
        CellKind::Vertex | CellKind::Tetrahedron | CellKind::Prism | CellKind::Pyramid => {
            name.into()
        }
        _ => format!("{name}{}", kind.points()),
    };
    (self::kind(&name, kind.points()) == Some(kind)).then_some(name)
}

/// The place in Gmsh's order of each node in Exodus's, which has what is inside of a hexahedron before its faces.
pub fn order(kind: CellKind) -> Vec<usize> {
    let mut places = usual_order(kind, false);
    if kind == CellKind::Hexahedron27 {
        places.splice(20.., [26, 20, 25, 22, 23, 21, 24]);
    }
    places
}

/// The corners of the sides of an element in the order of their numbers. Shells have their two faces first.
pub fn sides(shape: Shape, is_shell: bool) -> &'static [&'static [usize]] {
    match (shape, is_shell) {
        (Shape::Triangle, true) => &[&[0, 1, 2], &[0, 2, 1], &[0, 1], &[1, 2], &[2, 0]],
        (Shape::Quadrangle, true) => &[
            &[0, 1, 2, 3],
            &[0, 3, 2, 1],
            &[0, 1],
            &[1, 2],
            &[2, 3],
            &[3, 0],
        ],
        (Shape::Tetrahedron, _) => &[&[0, 1, 3], &[1, 2, 3], &[0, 3, 2], &[0, 2, 1]],
        (Shape::Hexahedron, _) => &[
            &[0, 1, 5, 4],
            &[1, 2, 6, 5],
            &[2, 3, 7, 6],
            &[0, 4, 7, 3],
            &[0, 3, 2, 1],
            &[4, 5, 6, 7],
        ],
        (Shape::Prism, _) => &[
            &[0, 1, 4, 3],
            &[1, 2, 5, 4],
            &[0, 3, 5, 2],
            &[0, 2, 1],
            &[3, 4, 5],
        ],
        (Shape::Pyramid, _) => &[
            &[0, 1, 4],
            &[1, 2, 4],
            &[2, 3, 4],
            &[0, 4, 3],
            &[0, 3, 2, 1],
        ],
        _ => topology::sides(shape),
    }
}

/// Whether the sides of an element of two dimensions begin with its faces, as those of shells and of all elements in 3D do.
pub fn is_shell(name: &str, dimension: usize) -> bool {
    dimension == 3 || name.to_ascii_uppercase().contains("SHELL")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As in VTK, a superelement is one cell without a shape.
    #[test]
    fn superelements_are_points() {
        assert_eq!(kind("SUPER", 5), Some(CellKind::Vertex));
        assert_eq!(kind("SUPERB", 0), None);
    }
}
