//! VTK's cell types, and the order of their nodes against Gmsh's.

use crate::mesh::CellKind;
use vtkio::model::CellType;

/// VTK's number of a cell type; `None` where VTK has no such cell.
pub(in crate::io) fn vtk_type(kind: CellKind) -> Option<u8> {
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

/// The type that is written with this VTK number.
pub(in crate::io) fn written_kind(code: i64) -> Option<CellKind> {
    let gmsh = (1..=19).filter_map(CellKind::from_gmsh);
    let mut written = gmsh.filter_map(|kind| Some((kind, vtk_type(kind)?)));
    written.find_map(|(kind, vtk)| (i64::from(vtk) == code).then_some(kind))
}

/// The position in Gmsh's order of each node in VTK's order; `None` if the two orders are the same.
///
/// Corners agree. Gmsh orders the edges by their lower corner, VTK goes around the faces; derived edge by edge
/// from the figures of Gmsh's manual (node ordering) and of VTK's cell classes.
pub(in crate::io) fn order(kind: CellKind) -> Option<&'static [usize]> {
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

/// The kind of a VTK cell and, if the orders differ, the positions of its nodes in Gmsh's order.
///
/// Lagrange cells are what dolfinx writes for meshes of order one and two; VTK's numbering of theirs is that of the
/// classical cells up to the tetrahedron. Polygons of three or four corners, and the pixels and voxels of images,
/// are triangles, quadrangles and hexahedra.
pub(in crate::io) fn kind(
    vtk: CellType,
    points: usize,
) -> Option<(CellKind, Option<&'static [usize]>)> {
    use CellType as T;
    let kind = match (vtk, points) {
        (T::Vertex | T::PolyVertex, 1) => CellKind::Vertex,
        (T::Line | T::PolyLine | T::LagrangeCurve, 2) => CellKind::Line,
        (T::Triangle | T::Polygon | T::TriangleStrip | T::LagrangeTriangle, 3) => {
            CellKind::Triangle
        }
        (T::Quad | T::Polygon | T::LagrangeQuadrilateral, 4) => CellKind::Quadrangle,
        (T::Tetra | T::LagrangeTetrahedron, 4) => CellKind::Tetrahedron,
        (T::Hexahedron | T::LagrangeHexahedron, 8) => CellKind::Hexahedron,
        (T::Wedge | T::LagrangeWedge, 6) => CellKind::Prism,
        (T::Pyramid | T::LagrangePyramid, 5) => CellKind::Pyramid,
        (T::Pixel, 4) => return Some((CellKind::Quadrangle, Some(&[0, 1, 3, 2]))),
        (T::Voxel, 8) => return Some((CellKind::Hexahedron, Some(&[0, 1, 3, 2, 4, 5, 7, 6]))),
        (T::QuadraticEdge | T::LagrangeCurve, 3) => CellKind::Line3,
        (T::QuadraticTriangle | T::LagrangeTriangle, 6) => CellKind::Triangle6,
        (T::QuadraticQuad, 8) => CellKind::Quadrangle8,
        (T::BiquadraticQuad | T::LagrangeQuadrilateral, 9) => CellKind::Quadrangle9,
        (T::QuadraticTetra | T::LagrangeTetrahedron, 10) => CellKind::Tetrahedron10,
        (T::QuadraticHexahedron, 20) => CellKind::Hexahedron20,
        (T::TriquadraticHexahedron, 27) => CellKind::Hexahedron27,
        (T::QuadraticWedge, 15) => CellKind::Prism15,
        (T::BiquadraticQuadraticWedge, 18) => CellKind::Prism18,
        (T::QuadraticPyramid, 13) => CellKind::Pyramid13,
        _ => return None,
    };
    Some((kind, order(kind)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_traits::FromPrimitive;

    /// The ends of the edges in the order of their nodes, after the figures of VTK's and of Gmsh's manual.
    type Edges = &'static [[usize; 2]];
    const CELLS: [(CellKind, Edges, Edges); 4] = [
        (
            CellKind::Tetrahedron10,
            &[[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]],
            &[[0, 1], [1, 2], [0, 2], [0, 3], [2, 3], [1, 3]],
        ),
        (
            CellKind::Hexahedron20,
            &[
                [0, 1],
                [1, 2],
                [2, 3],
                [0, 3],
                [4, 5],
                [5, 6],
                [6, 7],
                [4, 7],
                [0, 4],
                [1, 5],
                [2, 6],
                [3, 7],
            ],
            &[
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
        ),
        (
            CellKind::Prism15,
            &[
                [0, 1],
                [1, 2],
                [0, 2],
                [3, 4],
                [4, 5],
                [3, 5],
                [0, 3],
                [1, 4],
                [2, 5],
            ],
            &[
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
        ),
        (
            CellKind::Pyramid13,
            &[
                [0, 1],
                [1, 2],
                [2, 3],
                [0, 3],
                [0, 4],
                [1, 4],
                [2, 4],
                [3, 4],
            ],
            &[
                [0, 1],
                [0, 3],
                [0, 4],
                [1, 2],
                [1, 4],
                [2, 3],
                [2, 4],
                [3, 4],
            ],
        ),
    ];

    #[test]
    fn edge_nodes_stay_on_their_edges() {
        for (kind, vtk, gmsh) in CELLS {
            let order = order(kind).expect("the orders differ");
            let corners = kind.shape().corners();
            assert!(order[..corners].iter().copied().eq(0..corners));
            for (edge, &place) in vtk.iter().zip(&order[corners..]) {
                assert_eq!(edge, &gmsh[place - corners], "{kind}");
            }
        }
    }

    #[test]
    fn what_is_written_is_read_as_the_same_kind() {
        for kind in (1..=19).filter_map(CellKind::from_gmsh) {
            if let Some(code) = vtk_type(kind) {
                let vtk = CellType::from_u8(code).expect("a type of VTK's");
                assert_eq!(super::kind(vtk, kind.points()), Some((kind, order(kind))));
                assert_eq!(written_kind(code.into()), Some(kind));
            }
        }
    }
}
