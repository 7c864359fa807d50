//! VTK's cell types, and the order of their nodes against Gmsh's.

use super::lattice::{Order, places, reference_nodes};
use crate::io::elements;
use crate::io::sides::usual_order;
use crate::mesh::{CellKind, Shape};

/// The shapes of VTK's Lagrange cells, whose numbers begin at 68.
const LAGRANGE: [Shape; 6] = [
    Shape::Line,
    Shape::Triangle,
    Shape::Quadrangle,
    Shape::Tetrahedron,
    Shape::Hexahedron,
    Shape::Prism,
];
const FIRST_LAGRANGE: u8 = 68;
pub(crate) const POLYHEDRON: u8 = 42;

/// VTK's number of a cell type; `None` where VTK has no such cell, or not its nodes.
pub(crate) fn vtk_type(kind: CellKind) -> Option<u8> {
    Some(match kind {
        CellKind::Polygon(_) => 7,
        CellKind::Polyhedron(_) => POLYHEDRON,
        CellKind::Vtk(_) => return kind.vtk(),
        CellKind::Other(_) => {
            let place = LAGRANGE.iter().position(|shape| *shape == kind.shape())?;
            places(kind.shape(), kind.complete_order()?, Order::Vtk)?;
            FIRST_LAGRANGE + place as u8
        }
        _ => elements::name(|element| element.vtk, kind)?,
    })
}

/// VTK's number of a complete element, and its nodes in VTK's order, in coordinates of the unit cell; `None` where VTK or
/// [`reference_nodes`] has none.
pub fn vtk_nodes(kind: CellKind) -> Option<(u8, Vec<[f64; 3]>)> {
    let nodes = reference_nodes(kind)?;
    let nodes = match order(kind) {
        Some(places) => places.into_iter().map(|place| nodes[place]).collect(),
        None => nodes,
    };
    Some((vtk_type(kind)?, nodes))
}

/// The cell of order 1 or 2 of this number of VTK's.
pub(crate) fn classical(number: u64) -> Option<CellKind> {
    elements::kind(|element| element.vtk.into(), number)
}

/// Whether VTK 9 reads these nodes in another order from files of older versions.
pub(crate) fn needs_new_version(kind: CellKind) -> bool {
    vtk_type(kind) == Some(72)
}

/// VTK's number of a type, and 256 times its number of points where the type has any number.
pub(super) fn block_code(kind: CellKind) -> i64 {
    let code = i64::from(vtk_type(kind).unwrap_or(0));
    match kind {
        CellKind::Other(_) | CellKind::Polygon(_) | CellKind::Polyhedron(_) | CellKind::Vtk(_) => {
            code + 256 * kind.points() as i64
        }
        _ => code,
    }
}

/// The type that is written with this [`block_code`].
pub(super) fn written_kind(code: i64) -> Option<CellKind> {
    let (vtk, points) = (code % 256, usize::try_from(code / 256).ok()?);
    if points > 0 {
        let read = meaning(vtk.try_into().ok()?, points, Order::Vtk)?;
        return (read.parts == 1).then_some(read.kind);
    }
    classical(vtk.try_into().ok()?)
}

/// The position in Gmsh's order of each node in VTK's order; `None` if the two orders are the same.
///
/// Corners agree. Gmsh orders the edges by their lower corner, VTK goes around the faces; from the figures of Gmsh's manual
/// (node ordering) and of VTK's cell classes.
pub(crate) fn order(kind: CellKind) -> Option<Vec<usize>> {
    let places = match kind {
        CellKind::Other(_) | CellKind::Hexahedron27 => {
            places(kind.shape(), kind.complete_order()?, Order::Vtk)?
        }
        _ if kind.points() == kind.corners() || kind.vtk().is_some() => return None,
        _ => usual_order(kind, true),
    };
    (!is_in_order(&places)).then_some(places)
}

fn is_in_order(places: &[usize]) -> bool {
    places.iter().copied().eq(0..places.len())
}

/// The meaning of a VTK cell: cells of a kind, each with some of its nodes.
pub(super) struct Meaning {
    pub kind: CellKind,
    /// The number of cells: a triangle strip counts as several, and an empty cell as none.
    pub parts: usize,
    /// The nodes of the parts, as places among those of the cell; `None` for all in their order.
    pub nodes: Option<Vec<usize>>,
}

impl Meaning {
    /// Cells whose nodes are in VTK's order.
    pub fn whole(kind: CellKind) -> Self {
        Meaning {
            kind,
            parts: 1,
            nodes: None,
        }
    }
}

/// The kind of cells with VTK's type `code` and this many points; `None` if there are none. `vtk` is the order of the nodes of
/// Lagrange cells.
///
/// Lagrange cells are what dolfinx writes for meshes of any order; those of order one and two are the classical cells.
/// Polygons of three or four corners, and the pixels and voxels of images, are triangles, quadrangles and hexahedra; strips
/// are cut up.
pub(super) fn meaning(code: u8, points: usize, vtk: Order) -> Option<Meaning> {
    use CellKind as K;
    let several = |kind: CellKind, parts: usize, nodes: Vec<usize>| Meaning {
        kind,
        parts,
        nodes: Some(nodes),
    };
    let kind = match (code, points) {
        (0, _) | (2 | 4 | 6 | 7, 0) | (4, 1) | (6, 1 | 2) => {
            return Some(several(K::Vertex, 0, Vec::new()));
        }
        (2 | 7, 1) => K::Vertex,
        (2, n) => return Some(several(K::Vertex, n, (0..n).collect())),
        (4 | 7 | 75, 2) => K::Line,
        (4, n) => {
            let nodes = (1..n).flat_map(|end| [end - 1, end]);
            return Some(several(K::Line, n - 1, nodes.collect()));
        }
        (6 | 7 | 76, 3) => K::Triangle,
        (6, n) => {
            // Every second triangle has the opposite orientation.
            let nodes = (2..n).flat_map(|end| [end - 2 + end % 2, end - 1 - end % 2, end]);
            return Some(several(K::Triangle, n - 2, nodes.collect()));
        }
        (7 | 77, 4) => K::Quadrangle,
        (7, n) => K::Polygon(u32::try_from(n).ok()?),
        (8, 4) => return Some(several(K::Quadrangle, 1, vec![0, 1, 3, 2])),
        (11, 8) => return Some(several(K::Hexahedron, 1, vec![0, 1, 3, 2, 4, 5, 7, 6])),
        (78, 4) => K::Tetrahedron,
        (79, 8) => K::Hexahedron,
        (80, 6) => K::Prism,
        (74 | 81, 5) => K::Pyramid,
        (35, 4) => K::complete(Shape::Line, 3)?,
        (POLYHEDRON, n) if n > 0 => K::Polyhedron(u32::try_from(n).ok()?),
        // As dolfinx writes it; VTK has no class for it.
        (74, 14) => K::Pyramid14,
        _ => match (classical(code.into()), lagrange(code, points, vtk)) {
            (Some(kind), _) if kind.points() == points => kind,
            (_, Some(found)) => return Some(found),
            // Its edges would be wrong.
            _ if code == 72 && vtk == Order::VtkBefore => return None,
            _ => K::from_vtk(code, points)?,
        },
    };
    let nodes = order(kind).map(|order| inverse(&order));
    let parts = 1;
    Some(Meaning { kind, parts, nodes })
}

/// A Lagrange cell that Gmsh has as well.
fn lagrange(code: u8, points: usize, vtk: Order) -> Option<Meaning> {
    let shape = *LAGRANGE.get(usize::from(code.checked_sub(FIRST_LAGRANGE)?))?;
    let mut kinds = (1..).map_while(|p| Some((p, CellKind::complete(shape, p)?)));
    let (p, kind) = kinds.find(|(_, kind)| kind.points() == points)?;
    let nodes = inverse(&places(shape, p, vtk)?);
    Some(Meaning {
        kind,
        parts: 1,
        nodes: (!is_in_order(&nodes)).then_some(nodes),
    })
}

fn inverse(order: &[usize]) -> Vec<usize> {
    let mut places = vec![0; order.len()];
    for (index, &place) in order.iter().enumerate() {
        places[place] = index;
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let kinds = (1..=140).filter_map(CellKind::from_gmsh);
        let more = [CellKind::Polygon(7), CellKind::Polyhedron(9)];
        let bezier = CellKind::from_vtk(77, 16);
        let mut seen = 0;
        for kind in kinds.chain(more).chain(bezier) {
            let Some(code) = vtk_type(kind) else { continue };
            seen += 1;
            let read = meaning(code, kind.points(), Order::Vtk).expect("a type of VTK's");
            assert_eq!((read.kind, read.parts), (kind, 1));
            let order = order(kind).map(|order| inverse(&order));
            assert_eq!(read.nodes, order);
            assert_eq!(written_kind(block_code(kind)), Some(kind));
        }
        // 18 classical types, the complete ones of order 3 and more, and the three above.
        assert_eq!(seen, 18 + 8 * 4 + 7 + 3);
    }

    #[test]
    fn the_classical_cells_are_the_lagrange_cells_of_order_two() {
        for (code, points) in [(28, 9), (29, 27), (32, 18), (24, 10)] {
            let classical = meaning(code, points, Order::Vtk).expect("classical");
            let place = LAGRANGE
                .iter()
                .position(|shape| *shape == classical.kind.shape());
            let lagrange = FIRST_LAGRANGE + place.expect("a shape") as u8;
            let lagrange = meaning(lagrange, points, Order::Vtk).expect("of order two");
            assert_eq!(lagrange.kind, classical.kind);
            assert_eq!(lagrange.nodes, classical.nodes, "{}", lagrange.kind);
        }
    }
}
