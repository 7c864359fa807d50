//! VTK's cell types, and the order of their nodes against Gmsh's.

use crate::mesh::CellKind;

/// VTK's number of a cell type; `None` where VTK has no such cell.
pub(super) fn vtk_type(kind: CellKind) -> Option<u8> {
    Some(match kind {
        CellKind::Vertex => 1,
        CellKind::Line => 3,
        CellKind::Triangle => 5,
        CellKind::Quadrangle => 9,
        CellKind::Tetrahedron => 10,
        CellKind::Hexahedron => 12,
        CellKind::Prism => 13,
        CellKind::Pyramid => 14,
        CellKind::Line3 => 21,
        CellKind::Triangle6 => 22,
        CellKind::Quadrangle8 => 23,
        CellKind::Tetrahedron10 => 24,
        CellKind::Hexahedron20 => 25,
        CellKind::Prism15 => 26,
        CellKind::Pyramid13 => 27,
        CellKind::Quadrangle9 => 28,
        CellKind::Hexahedron27 => 29,
        CellKind::Prism18 => 32,
        CellKind::Pyramid14 | CellKind::Other(_) => return None,
    })
}

/// Where in Gmsh's order each node of VTK's order stands; `None` where the two orders are the same.
///
/// Corners agree. Gmsh runs through the edges by their lower corner, VTK round the faces; derived edge by edge
/// from the figures of Gmsh's manual (node ordering) and of VTK's cell classes.
pub(super) fn order(kind: CellKind) -> Option<&'static [usize]> {
    Some(match kind {
        CellKind::Tetrahedron10 => &[0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
        CellKind::Hexahedron20 => &[
            0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15,
        ],
        CellKind::Hexahedron27 => &[
            0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15, 22, 23, 21, 24,
            20, 25, 26,
        ],
        CellKind::Prism15 => &[0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11],
        CellKind::Prism18 => &[0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11, 15, 17, 16],
        CellKind::Pyramid13 => &[0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12],
        _ => return None,
    })
}
