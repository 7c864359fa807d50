//! Basis functions of finite elements on the reference cell.
//!
//! A scalar element is nodal: each basis function is 1 at one node and 0 at the others. Functions of the elements of vectors, those of
//! Raviart–Thomas and Nédélec, are linear on each cell, so they are sums of the linear basis functions with vectors as coefficients, and
//! all integrals are first computed for these.

use faceoff_mesh::mesh::CellGeometry;

use crate::grid::Cells;
use crate::problem::Element;

/// The functions of one component on a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Shape {
    /// All polynomials of this degree, by their values at equidistant nodes.
    Lagrange(u8),
    /// All products of polynomials of this degree in each coordinate, by their values at equidistant nodes: for quadrangles and hexahedra.
    Product(u8),
    /// Linear functions by their values at the centres of facets.
    Crouzeix,
}

/// The basis functions of a shape at some points, with derivatives by the reference coordinates ξ₁, …, ξ_d, which are λ₁, …, λ_d
/// for a simplex.
#[derive(Debug, Clone)]
pub struct Table {
    /// The number of basis functions.
    pub count: usize,
    /// By the derivative (0 the function, then ∂₁ to ∂_d, then ∂₁∂₁, ∂₁∂₂, … row by row), then the point, then the function.
    values: Vec<f64>,
    points: usize,
}

impl Table {
    /// The values of all functions at a point.
    pub fn row(&self, derivative: usize, point: usize) -> &[f64] {
        let at = (derivative * self.points + point) * self.count;
        &self.values[at..at + self.count]
    }
}

impl Shape {
    /// The shape of each component of an element's functions.
    pub fn of(element: Element, cells: Cells) -> Self {
        match element {
            Element::Continuous(degree) | Element::Broken(degree) => Shape::nodal(cells, degree),
            Element::CrouzeixRaviart => Shape::Crouzeix,
            Element::RaviartThomas | Element::Nedelec => Shape::Lagrange(1),
        }
    }

    /// The shape for values at equidistant nodes.
    pub fn nodal(cells: Cells, degree: u8) -> Self {
        match cells {
            Cells::Simplices => Shape::Lagrange(degree),
            Cells::Cubes => Shape::Product(degree),
        }
    }

    /// The polynomial degree.
    pub fn degree(self) -> usize {
        match self {
            Shape::Lagrange(degree) | Shape::Product(degree) => degree.into(),
            Shape::Crouzeix => 1,
        }
    }

    /// The nodes, as coordinates in the reference cell times the degree; for constants the only node is 0.
    pub fn lattice(self, dim: usize) -> Vec<[u8; 4]> {
        let degree = self.degree() as u8;
        if let Shape::Product(_) = self {
            let width = usize::from(degree) + 1;
            let digit = |node: usize, k: u32| (node / width.pow(k) % width) as u8;
            let node = |node: usize| [0, digit(node, 0), digit(node, 1), digit(node, 2)];
            return (0..width.pow(dim as u32)).map(node).collect();
        }
        let mut all = Vec::new();
        let mut push = |node: [u8; 4]| {
            if node[..=dim].iter().sum::<u8>() == degree && node[dim + 1..].iter().all(|k| *k == 0)
            {
                all.push(node);
            }
        };
        let each = || (0..=degree).rev();
        for a in each() {
            for b in each() {
                for c in each() {
                    each().for_each(|d| push([a, b, c, d]));
                }
            }
        }
        all
    }

    /// The nodes as positions in the reference cell.
    pub fn nodes(self, dim: usize) -> Vec<[f64; 4]> {
        match self {
            Shape::Product(0) => vec![[0.0, 0.5, 0.5, if dim == 3 { 0.5 } else { 0.0 }]],
            Shape::Lagrange(0) => {
                let mut centre = [0.0; 4];
                centre[..=dim].fill(1.0 / (dim + 1) as f64);
                vec![centre]
            }
            Shape::Lagrange(degree) | Shape::Product(degree) => {
                let lattice = self.lattice(dim).into_iter();
                lattice
                    .map(|node| node.map(|k| f64::from(k) / f64::from(degree)))
                    .collect()
            }
            Shape::Crouzeix => (0..=dim)
                .map(|i| {
                    let mut node = [0.0; 4];
                    node[..=dim].fill(1.0 / dim as f64);
                    node[i] = 0.0;
                    node
                })
                .collect(),
        }
    }

    /// The number of basis functions.
    pub fn count(self, dim: usize) -> usize {
        match self {
            Shape::Crouzeix => dim + 1,
            Shape::Lagrange(_) | Shape::Product(_) => self.lattice(dim).len(),
        }
    }

    /// Basis functions and their derivatives at positions in the reference cell.
    pub fn table(self, dim: usize, points: &[[f64; 4]]) -> Table {
        let count = self.count(dim);
        let derivatives = 1 + dim + dim * dim;
        let mut values = vec![0.0; derivatives * points.len() * count];
        let mut put = |derivative: usize, q: usize, i: usize, value: f64| {
            values[(derivative * points.len() + q) * count + i] = value;
        };
        let lattice = self.lattice(dim);
        for (q, lambda) in points.iter().enumerate() {
            for i in 0..count {
                // By barycentric coordinates; λ₀ = 1 - λ₁ - … is not a reference coordinate. Products do not depend on it.
                let (value, first, second) = match self {
                    Shape::Crouzeix => {
                        let slope = -(dim as f64);
                        let mut first = [0.0; 4];
                        first[i] = slope;
                        (1.0 + slope * lambda[i], first, [[0.0; 4]; 4])
                    }
                    Shape::Lagrange(degree) => {
                        product(|k| ascending(degree, lattice[i][k], lambda[k]))
                    }
                    Shape::Product(degree) => product(|k| match k {
                        0 => [1.0, 0.0, 0.0],
                        _ => cardinal(degree, lattice[i][k], lambda[k]),
                    }),
                };
                put(0, q, i, value);
                for a in 1..=dim {
                    put(a, q, i, first[a] - first[0]);
                    for b in 1..=dim {
                        let bend = second[a][b] - second[a][0] - second[0][b] + second[0][0];
                        put(dim + 1 + (a - 1) * dim + b - 1, q, i, bend);
                    }
                }
            }
        }
        Table {
            count,
            values,
            points: points.len(),
        }
    }
}

/// Π_{m < k} (degree x - m)/(m + 1) with its derivatives: a Lagrange basis function is the product of these over the barycentric coordinates
/// (P. Silvester).
fn ascending(degree: u8, k: u8, x: f64) -> [f64; 3] {
    let [mut f, mut df, mut ddf] = [1.0, 0.0, 0.0];
    for m in (0..k).map(f64::from) {
        let degree = f64::from(degree);
        let (g, dg) = ((degree * x - m) / (m + 1.0), degree / (m + 1.0));
        ddf = ddf * g + 2.0 * df * dg;
        df = df * g + f * dg;
        f *= g;
    }
    [f, df, ddf]
}

/// The polynomial of this degree that is 1 at node k of an interval and 0 at the others, with its derivatives: the product of two of the above, one
/// from each end.
fn cardinal(degree: u8, k: u8, x: f64) -> [f64; 3] {
    let [f, df, ddf] = ascending(degree, k, x);
    let [g, dg, ddg] = ascending(degree, degree - k, 1.0 - x);
    [f * g, df * g - f * dg, ddf * g - 2.0 * df * dg + f * ddg]
}

/// The product over i of functions of λ_i, each with its derivatives, and its derivatives by the λ_i.
fn product(of: impl Fn(usize) -> [f64; 3]) -> (f64, [f64; 4], [[f64; 4]; 4]) {
    let factors = [0, 1, 2, 3].map(of);
    let product = |order: [usize; 4]| (0..4).map(|i| factors[i][order[i]]).product::<f64>();
    let mut first = [0.0; 4];
    let mut second = [[0.0; 4]; 4];
    for a in 0..4 {
        let mut order = [0; 4];
        order[a] += 1;
        first[a] = product(order);
        for (b, value) in second[a].iter_mut().enumerate() {
            let mut both = order;
            both[b] += 1;
            *value = product(both);
        }
    }
    (product([0; 4]), first, second)
}

/// The local facets or edges that carry the dofs of an element of vectors: vertex i for the facet opposite to it, or two vertices.
pub fn carriers(element: Element, dim: usize) -> Vec<[usize; 2]> {
    match element {
        Element::RaviartThomas => (0..=dim).map(|i| [i, i]).collect(),
        _ => faceoff_mesh::mesh::local_edges(dim).to_vec(),
    }
}

/// The vectors at the vertices of a cell that define the basis function of a carrier. Its flux through the facet, or its circulation along the
/// edge from the first vertex to the second, is 1.
pub fn vectors(element: Element, geometry: &CellGeometry, [a, b]: [usize; 2]) -> [[f64; 3]; 4] {
    let dim = geometry.dim;
    let mut all = [[0.0; 3]; 4];
    match element {
        Element::RaviartThomas => {
            for (j, vector) in all.iter_mut().enumerate().take(dim + 1) {
                let difference = geometry.vertices[j] - geometry.vertices[a];
                *vector = (difference / (dim as f64 * geometry.measure())).into();
            }
        }
        _ => {
            all[a] = geometry.gradients[b].into();
            all[b] = (-geometry.gradients[a]).into();
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nodal values are 1 and 0; derivatives agree with differences, and are exact for the monomials of the degree.
    #[test]
    fn basis_functions_are_nodal_and_their_derivatives_right() {
        for dim in [2, 3] {
            let products = (0..3).map(Shape::Product);
            let shapes = (0..4)
                .map(Shape::Lagrange)
                .chain([Shape::Crouzeix])
                .chain(products);
            for shape in shapes {
                let table = shape.table(dim, &shape.nodes(dim));
                for q in 0..shape.count(dim) {
                    for (i, value) in table.row(0, q).iter().enumerate() {
                        let wanted = f64::from(u8::from(i == q));
                        assert!((value - wanted).abs() < 1e-14, "{shape:?}");
                    }
                }
                let at = [0.1, 0.2, 0.3, 0.4];
                let point = |shift: [f64; 3]| {
                    let mut lambda = [0.0; 4];
                    for k in 1..=dim {
                        lambda[k] = at[k] + shift[k - 1];
                    }
                    lambda[0] = 1.0 - lambda[1..].iter().sum::<f64>();
                    lambda
                };
                // Polynomials of degree 3 and central differences.
                let eps = 1e-4;
                let shifted = |k: usize, by: f64| {
                    let mut shift = [0.0; 3];
                    shift[k] = by;
                    point(shift)
                };
                for k in 0..dim {
                    let t = shape.table(dim, &[point([0.0; 3]), shifted(k, eps), shifted(k, -eps)]);
                    for i in 0..t.count {
                        let slope = (t.row(0, 1)[i] - t.row(0, 2)[i]) / (2.0 * eps);
                        assert!((t.row(1 + k, 0)[i] - slope).abs() < 1e-6, "{shape:?}");
                        for l in 0..dim {
                            let bend = (t.row(1 + l, 1)[i] - t.row(1 + l, 2)[i]) / (2.0 * eps);
                            let found = t.row(dim + 1 + k * dim + l, 0)[i];
                            assert!((found - bend).abs() < 1e-6, "{shape:?}");
                        }
                    }
                }
            }
        }
    }
}
