//! The shape of a cell: how its reference cell becomes it.

use super::clip::{cross, dot, subtract};
use super::element::Element;
use faceoff_mesh::mesh::Shape;

/// How the reference cell becomes the cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Geometry {
    /// An affine map: simplices, parallelograms, parallelepipeds, and prisms and pyramids that are images of those of the reference.
    Straight,
    /// A quadrangle, hexahedron, prism or pyramid with straight edges.
    Multilinear,
    /// By all nodes.
    Curved,
}

impl Geometry {
    /// Of a cell with these nodes, where points within `near` are one.
    pub fn of(element: &Element, nodes: &[[f64; 3]], near: f64) -> Self {
        let size = subtract(&nodes[1], &nodes[0]);
        let size = dot(&size, &size).sqrt();
        let largest = nodes.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        // Rounding of nodes curves no cell: a rule for a curved one has hundreds of times as many points.
        let least = (4.0 * f64::EPSILON * largest).min(1e-9 * size);
        let near = near.min(1e-3 * size).max(least);
        let lies = |place: &dyn Fn(&[f64; 3], usize) -> f64| {
            let mut all = nodes.iter().zip(&element.nodes);
            all.all(|(node, at)| (0..3).all(|axis| (place(at, axis) - node[axis]).abs() <= near))
        };
        let affine = |at: &[f64; 3], axis: usize| {
            let steps = (0..element.dim).map(|k| {
                let corner = &nodes[element.corner(k)];
                at[k] * (corner[axis] - nodes[0][axis])
            });
            nodes[0][axis] + steps.sum::<f64>()
        };
        let of_corners = |at: &[f64; 3], axis: usize| -> f64 {
            let all = nodes.iter().zip(corner_functions(element, at));
            all.map(|(node, weight)| weight * node[axis]).sum()
        };
        let is_simplex = matches!(element.kind.shape(), Shape::Triangle | Shape::Tetrahedron);
        match (lies(&affine), !is_simplex && lies(&of_corners)) {
            (true, _) => Geometry::Straight,
            (_, true) => Geometry::Multilinear,
            _ => Geometry::Curved,
        }
    }
}

/// The functions that are 1 at one corner, of quadrangles, hexahedra, prisms and pyramids; 0 where there are fewer corners than eight.
fn corner_functions(element: &Element, &[x, y, z]: &[f64; 3]) -> [f64; 8] {
    let square = |x: f64, y: f64| [(1.0 - x) * (1.0 - y), x * (1.0 - y), x * y, (1.0 - x) * y];
    let mut all = [0.0; 8];
    match element.kind.shape() {
        Shape::Prism => {
            for (k, part) in [1.0 - x - y, x, y].into_iter().enumerate() {
                (all[k], all[k + 3]) = (part * (1.0 - z), part * z);
            }
        }
        Shape::Pyramid => {
            let height = 1.0 - z;
            if height > 0.0 {
                let base = square(x / height, y / height);
                (0..4).for_each(|k| all[k] = base[k] * height);
            }
            all[4] = z;
        }
        _ => {
            for (k, part) in square(x, y).into_iter().enumerate() {
                (all[k], all[k + 4]) = (part * (1.0 - z), part * z);
            }
        }
    }
    all
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

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_mesh::CellKind;
    use faceoff_mesh::mesh::Shape;

    #[test]
    fn rounding_of_nodes_curves_no_cell() {
        let kind = CellKind::complete(Shape::Hexahedron, 3).unwrap();
        let element = Element::new(kind).unwrap();
        let nodes = |off: f64| {
            let mut nodes = element.nodes.clone();
            let last = nodes.last_mut().unwrap();
            last[0] += off;
            nodes
        };
        assert_eq!(
            Geometry::of(&element, &nodes(2e-16), 0.0),
            Geometry::Straight
        );
        assert_eq!(Geometry::of(&element, &nodes(1e-14), 0.0), Geometry::Curved);
    }
}
