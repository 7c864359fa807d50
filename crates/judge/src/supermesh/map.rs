//! From a point to its reference coordinates in a cell, and the functions of a cell there.

use super::clip::{cross, dot, subtract};
use super::domain::Domain;
use super::element::Element;
use super::frame::Frame;
use super::function::Function;
use super::geometry::Geometry;

/// The functions of one cell at a time, and memory that is used again.
pub(super) struct Local<'a> {
    domain: &'a Domain<'a>,
    functions: &'a [Function<'a>],
    cell: Option<u32>,
    frame: Frame,
    /// Corner 0, and the inverse of the affine map, whose rows are the gradients of the reference coordinates.
    corner: [f64; 3],
    inverse: [[f64; 3]; 3],
    /// The element of the coordinates and their coefficients, where the map is not affine.
    map: Option<&'a Element>,
    coordinates: Vec<f64>,
    coefficients: Vec<f64>,
    nodal: Vec<f64>,
    basis: Vec<[f64; 4]>,
    /// Value and gradient of each component of each function.
    pub values: Vec<[f64; 4]>,
}

impl<'a> Local<'a> {
    pub fn new(domain: &'a Domain<'a>, functions: &'a [Function<'a>]) -> Self {
        let components = functions.iter().map(|f| f.components).sum();
        let most = domain.elements.iter().map(Element::len).max().unwrap_or(0);
        Local {
            domain,
            functions,
            cell: None,
            frame: Frame::at([0.0; 3]),
            corner: [0.0; 3],
            inverse: [[0.0; 3]; 3],
            map: None,
            coordinates: Vec::new(),
            coefficients: Vec::new(),
            nodal: vec![0.0; most],
            basis: vec![[0.0; 4]; most],
            values: vec![[0.0; 4]; components],
        }
    }

    /// Turns to a cell; places are given in `frame`.
    pub fn turn_to(&mut self, cell: u32, frame: &Frame) {
        self.frame = *frame;
        let domain = self.domain;
        let element = domain.element(cell);
        let mut corners = [[0.0; 3]; 5];
        for (corner, node) in corners.iter_mut().zip(domain.nodes(cell, frame)) {
            *corner = node;
        }
        self.corner = corners[0];
        let geometry = domain.geometries[cell as usize];
        if geometry == Geometry::Straight {
            let edges = [0, 1, 2].map(|axis| {
                let corner = corners[element.corner(axis)];
                subtract(&corner, &corners[0])
            });
            self.inverse = inverse(domain.dim, edges);
            self.map = None;
        } else {
            let map = match geometry {
                Geometry::Multilinear => domain.of_corners(element).unwrap_or(element),
                _ => element,
            };
            let count = map.len();
            self.coordinates.resize(3 * count, 0.0);
            for axis in 0..domain.dim {
                let nodes = domain.nodes(cell, frame).map(|x| x[axis]);
                self.nodal.iter_mut().zip(nodes).for_each(|(of, x)| *of = x);
                let out = &mut self.coordinates[axis * count..(axis + 1) * count];
                map.coefficients(&self.nodal[..count], out);
            }
            self.map = Some(map);
        }
        if self.cell == Some(cell) {
            return;
        }
        self.cell = Some(cell);
        self.coefficients.clear();
        for function in self.functions {
            for component in 0..function.components {
                let start = self.coefficients.len();
                if function.is_constant() {
                    self.coefficients.push(function.on_cell(cell, component));
                    continue;
                }
                let nodal = &mut self.nodal[..element.len()];
                function.at_nodes(domain, cell, component, nodal);
                self.coefficients.resize(start + element.len(), 0.0);
                element.coefficients(nodal, &mut self.coefficients[start..]);
            }
        }
    }

    /// Reference coordinates of a place, and their gradients.
    fn reference(&mut self, place: &[f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
        match &self.map {
            None => {
                let x = subtract(place, &self.corner);
                (self.inverse.map(|row| dot(&row, &x)), self.inverse)
            }
            Some(element) => {
                let dim = self.domain.dim;
                invert(dim, element, &self.coordinates, place, &mut self.basis)
            }
        }
    }

    /// φ_i at a place, for each node of the cell.
    pub fn shape_functions(&mut self, place: &[f64; 3], out: &mut [f64]) {
        let (at, _) = self.reference(place);
        let Some(cell) = self.cell else { return };
        let element = self.domain.element(cell);
        let basis = &mut self.basis[..element.len()];
        element.basis(&at, basis);
        element.shape_functions(basis, out);
    }

    /// Fills `values` with those at a place.
    pub fn evaluate(&mut self, place: &[f64; 3]) {
        let dim = self.domain.dim;
        let (at, inverse) = self.reference(place);
        let Some(cell) = self.cell else { return };
        let element = self.domain.element(cell);
        let basis = &mut self.basis[..element.len()];
        element.basis(&at, basis);
        let mut rest = &self.coefficients[..];
        let mut values = self.values.iter_mut();
        for function in self.functions {
            let count = if function.is_constant() {
                1
            } else {
                element.len()
            };
            for value in values.by_ref().take(function.components) {
                let (coefficients, others) = rest.split_at(count);
                rest = others;
                if function.is_constant() {
                    *value = [coefficients[0], 0.0, 0.0, 0.0];
                    continue;
                }
                let mut sum = [0.0; 4];
                for (c, b) in coefficients.iter().zip(&*basis) {
                    (0..4).for_each(|k| sum[k] += c * b[k]);
                }
                let slope = |k: usize| (0..dim).map(|r| sum[r + 1] * inverse[r][k]).sum();
                let [x, y, z] = self.frame.vector(&[slope(0), slope(1), slope(2)]);
                *value = [sum[0], x, y, z];
            }
        }
    }
}

/// The inverse of the matrix with these columns, completed by zeros in 2D; not finite where there is none.
fn inverse(dim: usize, [a, b, c]: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    if dim == 2 {
        let determinant = a[0] * b[1] - a[1] * b[0];
        return [
            [b[1] / determinant, -b[0] / determinant, 0.0],
            [-a[1] / determinant, a[0] / determinant, 0.0],
            [0.0; 3],
        ];
    }
    let rows = [cross(&b, &c), cross(&c, &a), cross(&a, &b)];
    let determinant = dot(&a, &rows[0]);
    rows.map(|row| row.map(|x| x / determinant))
}

/// Newton's method for the reference coordinates of a place, with the inverse of the Jacobian there; NaN where it does not
/// converge.
fn invert(
    dim: usize,
    element: &Element,
    coefficients: &[f64],
    place: &[f64; 3],
    basis: &mut [[f64; 4]],
) -> ([f64; 3], [[f64; 3]; 3]) {
    let count = element.len();
    let basis = &mut basis[..count];
    let mut x = element.centre();
    for _ in 0..50 {
        element.basis(&x, basis);
        // Row k: the k-th coordinate and its derivatives.
        let mut at = [[0.0; 4]; 3];
        for axis in 0..dim {
            let of = &coefficients[axis * count..(axis + 1) * count];
            for (c, b) in of.iter().zip(&*basis) {
                (0..4).for_each(|k| at[axis][k] += c * b[k]);
            }
        }
        let column = |k: usize| [at[0][k + 1], at[1][k + 1], at[2][k + 1]];
        let inverse = inverse(dim, [column(0), column(1), column(2)]);
        let miss = [0, 1, 2].map(|k| place[k] - at[k][0]);
        let step = inverse.map(|row| dot(&row, &miss));
        (0..dim).for_each(|k| x[k] += step[k]);
        // Quadratic convergence has done the rest.
        if step.iter().all(|s| s.abs() < 1e-9) {
            return (x, inverse);
        }
    }
    ([f64::NAN; 3], [[f64::NAN; 3]; 3])
}
