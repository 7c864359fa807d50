//! Lagrange elements of any order on triangles, quadrangles, tetrahedra and hexahedra, of orders 1 and 2 on prisms, and of order 1 on
//! pyramids, as files state them: by the nodes of a cell, in Gmsh's order.
//!
//! The basis is one of products of Legendre polynomials, in which high orders keep their digits; a field on a cell is given
//! by its coefficients there.

use nalgebra::DMatrix;

use faceoff_mesh::CellKind;
use faceoff_mesh::io::reference_nodes;
use faceoff_mesh::mesh::Shape;

/// Larger than any order here.
pub(super) const ORDERS: usize = 11;

/// Corners of the pyramid.
pub(super) const PYRAMID: [[f64; 3]; 5] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
];

/// The basis function of a pyramid that is not a polynomial.
const PRODUCT: usize = 3;

/// xy/(1 - z) with its gradient: with 1, x, y and z all that is linear on the triangles and bilinear on the square of a pyramid (Bedrosian,
/// Shape functions and integration formulas for three-dimensional finite element analysis, 1992). At the apex it is 0.
fn over_height([x, y, z]: &[f64; 3]) -> [f64; 4] {
    let height = 1.0 - z;
    if height.abs() < f64::EPSILON {
        return [0.0; 4];
    }
    let (p, q) = (x / height, y / height);
    [p * y, q, p, p * q]
}

/// The polynomials on one kind of cell; on a pyramid, one function is none.
#[derive(Debug, Clone)]
pub(super) struct Element {
    pub kind: CellKind,
    pub dim: usize,
    /// The largest degree in one coordinate.
    pub order: usize,
    /// The largest degree of a polynomial, of all coordinates together.
    pub degree: usize,
    /// Degrees of each basis function in each coordinate.
    powers: Vec<[u8; 3]>,
    /// Reference coordinates of the nodes, in [0, 1].
    pub nodes: Vec<[f64; 3]>,
    /// Coefficients from values at the nodes: one row of nodes for each basis function.
    to_coefficients: Vec<f64>,
}

impl Element {
    /// `None` for cells of other shapes, and for incomplete ones but the quadrangle of 8 nodes.
    pub fn new(kind: CellKind) -> Option<Self> {
        let shape = kind.shape();
        let is_serendipity = kind == CellKind::Quadrangle8;
        let order = if is_serendipity {
            2
        } else {
            let known = [Shape::Triangle, Shape::Tetrahedron, Shape::Prism];
            let is_known = known.contains(&shape) || is_product(shape);
            let is_pyramid = kind == CellKind::Pyramid;
            let order = kind.complete_order().filter(|_| is_known);
            order.or(is_pyramid.then_some(1))?
        };
        let dim = usize::from(kind.dim());
        let is_prism = shape == Shape::Prism;
        let is_pyramid = shape == Shape::Pyramid;
        let is_simplex = !is_product(shape) && !is_prism && !is_pyramid;
        let p = order as u8;
        let powers = (0..=if dim == 3 { p } else { 0 })
            .flat_map(|k| (0..=p).flat_map(move |j| (0..=p).map(move |i| [i, j, k])));
        let powers = powers.filter(|power| match (is_simplex, is_serendipity) {
            (true, _) => power.iter().sum::<u8>() <= p,
            (_, true) => power.iter().sum::<u8>() <= 3,
            _ if is_pyramid => power[2] == 0 || power[0] + power[1] == 0,
            _ => !is_prism || power[0] + power[1] <= p,
        });
        let powers: Vec<[u8; 3]> = powers.collect();
        // The last node of nine is the centre, which eight do without.
        let mut nodes = match is_pyramid {
            true => PYRAMID.to_vec(),
            false => reference_nodes(CellKind::complete(shape, order)?)?,
        };
        nodes.truncate(powers.len());
        let element = Element {
            kind,
            dim,
            order,
            degree: match (is_simplex, is_prism) {
                (true, _) => order,
                (_, true) => 2 * order,
                _ if is_pyramid => 2,
                _ => dim * order,
            },
            powers,
            nodes: Vec::new(),
            to_coefficients: Vec::new(),
        };
        element.with_nodes(nodes)
    }

    /// The same polynomials by their values at other nodes; `None` where these do not tell them apart.
    pub fn with_nodes(mut self, nodes: Vec<[f64; 3]>) -> Option<Self> {
        let count = self.len();
        let mut at_nodes = Vec::with_capacity(count * count);
        let mut row = vec![[0.0; 4]; count];
        for node in &nodes {
            self.basis(node, &mut row);
            at_nodes.extend(row.iter().map(|value| value[0]));
        }
        let inverse = DMatrix::from_row_slice(count, count, &at_nodes).try_inverse()?;
        self.to_coefficients = inverse.transpose().as_slice().to_vec();
        self.nodes = nodes;
        Some(self)
    }

    /// Is it on the unit square or cube?
    pub fn is_product(&self) -> bool {
        is_product(self.kind.shape())
    }

    /// Is it on the product of the unit triangle and [0, 1]?
    pub fn is_prism(&self) -> bool {
        self.kind.shape() == Shape::Prism
    }

    /// Is it on the pyramid over the unit square, with its apex over the first corner?
    pub fn is_pyramid(&self) -> bool {
        self.kind == CellKind::Pyramid
    }

    /// A place inside of the reference cell.
    pub fn centre(&self) -> [f64; 3] {
        let mut x = [0.0; 3];
        x[..self.dim].fill(match self.is_product() {
            true => 0.5,
            false => 1.0 / (self.dim + 1) as f64,
        });
        x
    }

    /// The corner at the end of an axis of the reference cell, from 0 on.
    pub fn corner(&self, axis: usize) -> usize {
        match self.is_product() || self.is_pyramid() {
            true => [1, 3, 4][axis],
            false => axis + 1,
        }
    }

    /// Number of nodes, which is that of basis functions.
    pub fn len(&self) -> usize {
        self.powers.len()
    }

    /// Value and gradient in reference coordinates of each basis function.
    pub fn basis(&self, x: &[f64; 3], out: &mut [[f64; 4]]) {
        let mut legendre = [[[0.0; 2]; ORDERS]; 3];
        for axis in 0..self.dim {
            legendre[axis] = polynomials(x[axis], self.order);
        }
        legendre[self.dim..]
            .iter_mut()
            .for_each(|of| of[0][0] = 1.0);
        for (out, power) in out.iter_mut().zip(&self.powers) {
            let [p, q, r] = [0, 1, 2].map(|axis| legendre[axis][usize::from(power[axis])]);
            *out = [
                p[0] * q[0] * r[0],
                p[1] * q[0] * r[0],
                p[0] * q[1] * r[0],
                p[0] * q[0] * r[1],
            ];
        }
        if self.is_pyramid() {
            out[PRODUCT] = over_height(x);
        }
    }

    /// The coefficients of the polynomial with these values at the nodes.
    pub fn coefficients(&self, values: &[f64], out: &mut [f64]) {
        let rows = self.to_coefficients.chunks_exact(self.len());
        for (out, row) in out.iter_mut().zip(rows) {
            *out = row.iter().zip(values).map(|(m, v)| m * v).sum();
        }
    }

    /// φ_i at a point of the reference cell, one for each node, from the values of [`Element::basis`] there.
    pub fn shape_functions(&self, basis: &[[f64; 4]], out: &mut [f64]) {
        out.fill(0.0);
        let rows = self.to_coefficients.chunks_exact(self.len());
        for (row, basis) in rows.zip(basis) {
            let terms = out.iter_mut().zip(row);
            terms.for_each(|(out, m)| *out += m * basis[0]);
        }
    }
}

fn is_product(shape: Shape) -> bool {
    matches!(shape, Shape::Quadrangle | Shape::Hexahedron)
}

/// Legendre's polynomials P_0, …, P_n on [0, 1] with their derivatives.
fn polynomials(x: f64, n: usize) -> [[f64; 2]; ORDERS] {
    let s = 2.0 * x - 1.0;
    let mut p = [[0.0; 2]; ORDERS];
    p[0][0] = 1.0;
    p[1] = [s, 2.0];
    for k in 1..n {
        let (a, b) = ((2 * k + 1) as f64, k as f64);
        p[k + 1] = [
            (a * s * p[k][0] - b * p[k - 1][0]) / (b + 1.0),
            (a * (2.0 * p[k][0] + s * p[k][1]) - b * p[k - 1][1]) / (b + 1.0),
        ];
    }
    p
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_of_every_order_come_back_from_their_nodes() {
        let shapes = [
            Shape::Triangle,
            Shape::Quadrangle,
            Shape::Tetrahedron,
            Shape::Hexahedron,
            Shape::Prism,
        ];
        for shape in shapes {
            let orders = match shape {
                Shape::Hexahedron => 4,
                Shape::Prism => 2,
                _ => 10,
            };
            for kind in (1..=orders).map(|order| CellKind::complete(shape, order).unwrap()) {
                let element = Element::new(kind).unwrap();
                assert_eq!(element.len(), kind.points(), "{kind}");
                let p = element.order as i32;
                let f = |x: &[f64; 3]| (0.3 + x[0] - 0.7 * x[1] + 0.2 * x[2]).powi(p);
                let values: Vec<f64> = element.nodes.iter().map(f).collect();
                let mut coefficients = vec![0.0; element.len()];
                element.coefficients(&values, &mut coefficients);
                let mut basis = vec![[0.0; 4]; element.len()];
                let x = [0.21, 0.37, if element.dim == 3 { 0.11 } else { 0.0 }];
                element.basis(&x, &mut basis);
                let of = |k: usize| -> f64 {
                    let terms = basis.iter().zip(&coefficients);
                    terms.map(|(b, c)| b[k] * c).sum()
                };
                assert!((of(0) - f(&x)).abs() < 1e-10, "{kind}: {} {}", of(0), f(&x));
                let h = 1e-6;
                let slope = (f(&[x[0], x[1] + h, x[2]]) - f(&[x[0], x[1] - h, x[2]])) / (2.0 * h);
                assert!((of(2) - slope).abs() < 1e-7, "{kind}: {} {slope}", of(2));
            }
        }
        assert!(Element::new(CellKind::Pyramid14).is_none());
        let cut = CellKind::from_gmsh(20).unwrap();
        assert!(Element::new(cut).is_none(), "{cut} lacks a node inside");
        assert_eq!(Element::new(CellKind::Quadrangle8).unwrap().len(), 8);
    }
}
