//! The shape of a cell: how its reference cell becomes it.

use super::clip::{cross, dot, subtract};
use super::element::Element;
use faceoff_mesh::mesh::Shape;

/// How the reference cell becomes the cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Geometry {
    /// An affine map: simplices, parallelograms.
    Straight,
    /// A quadrangle with straight sides.
    Multilinear,
    /// By all nodes.
    Curved,
}

impl Geometry {
    /// Of a cell with these nodes, where points within `near` are one.
    pub fn of(element: &Element, nodes: &[[f64; 3]], near: f64) -> Self {
        let size = subtract(&nodes[1], &nodes[0]);
        let near = near.min(1e-3 * dot(&size, &size).sqrt());
        let is_quadrangle = element.kind.shape() == Shape::Quadrangle;
        let x = |k: usize, axis: usize| nodes[k][axis];
        let lies = |(node, at): (&[f64; 3], &[f64; 3]), bilinear: f64| {
            (0..3).all(|axis| {
                let steps = (1..=element.dim).map(|k| {
                    let corner = if is_quadrangle && k == 2 { 3 } else { k };
                    at[k - 1] * (x(corner, axis) - x(0, axis))
                });
                let twist = if is_quadrangle {
                    bilinear * at[0] * at[1] * (x(2, axis) - x(1, axis) - x(3, axis) + x(0, axis))
                } else {
                    0.0
                };
                (x(0, axis) + steps.sum::<f64>() + twist - node[axis]).abs() <= near
            })
        };
        let all = |bilinear| {
            nodes
                .iter()
                .zip(&element.nodes)
                .all(|pair| lies(pair, bilinear))
        };
        match (all(0.0), is_quadrangle && all(1.0)) {
            (true, _) => Geometry::Straight,
            (_, true) => Geometry::Multilinear,
            _ => Geometry::Curved,
        }
    }
}

impl Element {
    /// The image of a point of the reference cell in the cell with these nodes.
    pub fn interpolate(&self, nodes: &[[f64; 3]], x: &[f64; 3]) -> [f64; 3] {
        let mut basis = vec![[0.0; 4]; self.len()];
        let mut shape = vec![0.0; self.len()];
        self.basis(x, &mut basis);
        self.shape_functions(&basis, &mut shape);
        [0, 1, 2].map(|axis| {
            nodes
                .iter()
                .zip(&shape)
                .map(|(node, s)| node[axis] * s)
                .sum()
        })
    }
}

/// Does a quadrangle with these corners first turn the same way at each?
pub(super) fn is_convex(nodes: &[[f64; 3]]) -> bool {
    let turn = |k: usize| {
        let [p, q, r] = [k, (k + 1) % 4, (k + 2) % 4].map(|k| nodes[k]);
        cross(&subtract(&q, &p), &subtract(&r, &q))[2]
    };
    (0..4).all(|k| turn(k) > 0.0) || (0..4).all(|k| turn(k) < 0.0)
}
