//! The nodes of complete elements of any order in Gmsh's and in VTK's order, as places in a lattice.
//!
//! Both begin with the corners and go on with the edges, the faces and the inside; they differ in the order and the
//! direction of edges and faces, and inside of quadrangles and hexahedra, where Gmsh repeats the scheme and VTK goes
//! through the rows. Gmsh's is that of its manual, VTK's that of vtkLagrange…::PointIndexFromIJK; the test of the program
//! holds both against the libraries.

use crate::mesh::{CellKind, Shape};

type Node = [usize; 3];

/// Whose order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Order {
    Gmsh,
    Vtk,
    /// VTK's of files before version 2.1 (XML) and 5 (legacy), in which two edges of a hexahedron are exchanged the other way
    /// round.
    VtkBefore,
}

/// Corners in the unit lattice; edges; faces, of which each begins at the node that the rows of its inside begin at.
type Scheme = (
    &'static [Node],
    &'static [[usize; 2]],
    &'static [&'static [usize]],
);

/// The corners of a hexahedron; for a quadrangle, a line or a vertex only as many as it has.
pub(crate) const CUBE: [Node; 8] = [
    [0, 0, 0],
    [1, 0, 0],
    [1, 1, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 0, 1],
    [1, 1, 1],
    [0, 1, 1],
];
const WEDGE: [Node; 6] = [
    [0, 0, 0],
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 0, 1],
    [0, 1, 1],
];
/// The corners of a tetrahedron, or of a triangle.
pub(crate) const SIMPLEX: [Node; 4] = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]];

/// The corners of a pyramid, which has no lattice here, are left out.
pub(crate) fn scheme(shape: Shape, order: Order) -> Option<Scheme> {
    let gmsh = order == Order::Gmsh;
    Some(match shape {
        Shape::Line => (&CUBE[..2], &[[0, 1]], &[]),
        Shape::Triangle => (&SIMPLEX[..3], &[[0, 1], [1, 2], [2, 0]], &[&[0, 1, 2]]),
        Shape::Quadrangle if gmsh => (
            &CUBE[..4],
            &[[0, 1], [1, 2], [2, 3], [3, 0]],
            &[&[0, 1, 2, 3]],
        ),
        Shape::Quadrangle => (
            &CUBE[..4],
            &[[0, 1], [1, 2], [3, 2], [0, 3]],
            &[&[0, 1, 2, 3]],
        ),
        Shape::Tetrahedron if gmsh => (
            &SIMPLEX,
            &[[0, 1], [1, 2], [2, 0], [3, 0], [3, 2], [3, 1]],
            &[&[0, 2, 1], &[0, 1, 3], &[0, 3, 2], &[3, 1, 2]],
        ),
        Shape::Tetrahedron => (
            &SIMPLEX,
            &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
            &[&[0, 1, 3], &[2, 3, 1], &[0, 3, 2], &[0, 2, 1]],
        ),
        #[rustfmt::skip]
        Shape::Hexahedron if gmsh => (
            &CUBE,
            &[
                [0, 1], [0, 3], [0, 4], [1, 2], [1, 5], [2, 3],
                [2, 6], [3, 7], [4, 5], [4, 7], [5, 6], [6, 7],
            ],
            &[
                &[0, 3, 2, 1], &[0, 1, 5, 4], &[0, 4, 7, 3],
                &[1, 2, 6, 5], &[2, 3, 7, 6], &[4, 5, 6, 7],
            ],
        ),
        #[rustfmt::skip]
        Shape::Hexahedron => (
            &CUBE,
            if order == Order::Vtk {
                &[
                    [0, 1], [1, 2], [3, 2], [0, 3], [4, 5], [5, 6],
                    [7, 6], [4, 7], [0, 4], [1, 5], [2, 6], [3, 7],
                ]
            } else {
                &[
                    [0, 1], [1, 2], [3, 2], [0, 3], [4, 5], [5, 6],
                    [7, 6], [4, 7], [0, 4], [1, 5], [3, 7], [2, 6],
                ]
            },
            &[
                &[0, 3, 7, 4], &[1, 2, 6, 5], &[0, 1, 5, 4],
                &[3, 2, 6, 7], &[0, 1, 2, 3], &[4, 5, 6, 7],
            ],
        ),
        #[rustfmt::skip]
        Shape::Prism if gmsh => (
            &WEDGE,
            &[[0, 1], [0, 2], [0, 3], [1, 2], [1, 4], [2, 5], [3, 4], [3, 5], [4, 5]],
            &[&[0, 1, 4, 3], &[0, 3, 5, 2], &[1, 2, 5, 4]],
        ),
        #[rustfmt::skip]
        Shape::Prism => (
            &WEDGE,
            &[[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]],
            &[&[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]],
        ),
        #[rustfmt::skip]
        Shape::Pyramid if gmsh => (
            &[],
            &[[0, 1], [0, 3], [0, 4], [1, 2], [1, 4], [2, 3], [2, 4], [3, 4]],
            &[&[0, 3, 2, 1]],
        ),
        _ => return None,
    })
}

/// The nodes of a complete element of degree `p`; those of prisms are right up to degree 2.
fn nodes(shape: Shape, p: usize, order: Order) -> Vec<Node> {
    let found = scheme(shape, order).filter(|(corners, ..)| !corners.is_empty());
    let Some((corners, edges, faces)) = found else {
        return Vec::new();
    };
    if p == 0 {
        return vec![[0; 3]];
    }
    // A sum of corners with weights that add up to p.
    let at = |parts: &[(usize, usize)]| -> Node {
        [0, 1, 2].map(|axis| {
            parts
                .iter()
                .map(|&(k, weight)| weight * corners[k][axis])
                .sum()
        })
    };
    let mut all: Vec<Node> = (0..corners.len()).map(|k| at(&[(k, p)])).collect();
    for &[a, b] in edges {
        all.extend((1..p).map(|k| at(&[(a, p - k), (b, k)])));
    }
    // The inside of an element is one of a lower degree, or rows.
    let inside = |shape: Shape, less: usize| -> Vec<Node> {
        let Some(p) = p.checked_sub(less) else {
            return Vec::new();
        };
        match shape {
            Shape::Quadrangle | Shape::Hexahedron if order != Order::Gmsh => {
                let k = 0..=if shape == Shape::Hexahedron { p } else { 0 };
                let rows =
                    k.flat_map(|k| (0..=p).flat_map(move |j| (0..=p).map(move |i| [i, j, k])));
                rows.collect()
            }
            _ => nodes(shape, p, order),
        }
    };
    for face in faces {
        let (shape, less, last) = match face.len() {
            3 => (Shape::Triangle, 3, face[2]),
            _ => (Shape::Quadrangle, 2, face[face.len() - 1]),
        };
        // In a quadrangle the weight of the first corner may be negative, as -1 = (i - p) + (j - p) + p.
        let place = |[i, j, _]: Node| {
            let step = |axis: usize| {
                let [a, b, c] = [face[0], face[1], last].map(|k| corners[k][axis] as isize);
                let (i, j, p) = (i as isize + 1, j as isize + 1, p as isize);
                (p * a + i * (b - a) + j * (c - a)) as usize
            };
            [0, 1, 2].map(step)
        };
        all.extend(inside(shape, less).into_iter().map(place));
    }
    let less = match shape {
        Shape::Tetrahedron => 4,
        Shape::Hexahedron => 2,
        _ => return all,
    };
    all.extend(
        inside(shape, less)
            .into_iter()
            .map(|node| node.map(|x| x + 1)),
    );
    all
}

/// The nodes of a complete element in Gmsh's order, in coordinates of the unit cell; `None` for any other, for pyramids, and
/// for prisms beyond degree 2.
pub fn reference_nodes(kind: CellKind) -> Option<Vec<[f64; 3]>> {
    let p = kind.complete_order()?;
    let nodes = of_gmsh(kind.shape(), p).into_iter();
    let nodes: Vec<_> = nodes
        .map(|node| node.map(|k| k as f64 / p as f64))
        .collect();
    (nodes.len() == kind.points()).then_some(nodes)
}

/// The places of the nodes of a complete element in Gmsh's order; none of a shape that has no lattice here, and those of
/// prisms up to degree 2.
pub(crate) fn of_gmsh(shape: Shape, p: usize) -> Vec<Node> {
    match shape {
        Shape::Prism if p > 2 => Vec::new(),
        _ => nodes(shape, p, Order::Gmsh),
    }
}

/// The place in Gmsh's order of each node in VTK's; `None` where one of the two is not known.
pub(super) fn places(shape: Shape, p: usize, vtk: Order) -> Option<Vec<usize>> {
    if shape == Shape::Prism && p > 2 {
        return None;
    }
    let gmsh = nodes(shape, p, Order::Gmsh);
    let place = |node: Node| (node[2] * (p + 1) + node[1]) * (p + 1) + node[0];
    let mut at = vec![None; (p + 1).pow(3)];
    for (index, &node) in gmsh.iter().enumerate() {
        at[place(node)] = Some(index);
    }
    let vtk = nodes(shape, p, vtk);
    vtk.into_iter().map(|node| at[place(node)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_node_has_one_place() {
        for shape in [
            Shape::Line,
            Shape::Triangle,
            Shape::Quadrangle,
            Shape::Tetrahedron,
            Shape::Hexahedron,
            Shape::Prism,
        ] {
            for (p, kind) in (1..).map_while(|p| Some((p, CellKind::complete(shape, p)?))) {
                let orders = [Order::Vtk, Order::VtkBefore].map(|order| places(shape, p, order));
                for mut found in orders.into_iter().flatten() {
                    found.sort_unstable();
                    assert!(found.into_iter().eq(0..kind.points()), "{kind}");
                }
                assert_eq!(kind.complete_order(), Some(p));
            }
        }
    }
}
