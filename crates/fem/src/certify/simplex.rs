//! A cell in interval arithmetic: its measure, its gradients, and norms of quadratic fields on it.
//!
//! The vertices are exact: their coordinates are the mesh.

use crate::interval::{Interval, above_of_sum};
use crate::quadrature::Piece;
use faceoff_mesh::mesh::Triangulation;

/// A vector, or a point; the third component is 0 in 2D.
pub(super) type Vector = [Interval; 3];

pub(super) const ZERO: Vector = [Interval::ZERO; 3];

/// Measure and barycentric gradients of a cell.
#[derive(Debug, Clone, Copy)]
pub(super) struct Simplex {
    pub dim: usize,
    pub vertices: [[f64; 3]; 4],
    /// |κ|
    pub measure: Interval,
    /// ∇λ_i
    pub gradients: [Vector; 4],
    /// At least the longest edge.
    pub diameter: f64,
}

impl Simplex {
    pub fn new(mesh: &Triangulation, cell: usize) -> Self {
        let (dim, vertices) = (mesh.dim, mesh.vertices(cell));
        let edge = |i: usize, j: usize| -> Vector {
            std::array::from_fn(|k| Interval::at(vertices[j][k]) - Interval::at(vertices[i][k]))
        };
        let [a, b] = [edge(0, 1), edge(0, 2)];
        // J⁻ᵀ by cofactors: ∇λ_i is normal to the face opposite i.
        let (determinant, cofactors) = if dim == 2 {
            let zero = Interval::ZERO;
            let of_1 = [b[1], -b[0], zero];
            let of_2 = [-a[1], a[0], zero];
            (a[0] * b[1] - a[1] * b[0], [of_1, of_2, ZERO])
        } else {
            let c = edge(0, 3);
            let of = [cross(&b, &c), cross(&c, &a), cross(&a, &b)];
            (dot(&a, &of[0], 3), of)
        };
        let mut gradients = [ZERO; 4];
        for i in 1..=dim {
            gradients[i] = cofactors[i - 1].map(|c| c / determinant);
        }
        for k in 0..dim {
            gradients[0][k] = -(1..=dim).map(|i| gradients[i][k]).sum::<Interval>();
        }
        let factor = if dim == 2 { 2.0 } else { 6.0 };
        let mut diameter = 0.0_f64;
        for i in 0..=dim {
            for j in 0..i {
                let edge = edge(j, i);
                diameter = diameter.max(dot(&edge, &edge, dim).root().high);
            }
        }
        Simplex {
            dim,
            vertices,
            measure: determinant.abs() / Interval::at(factor),
            gradients,
            diameter,
        }
    }

    /// x_j - x_i
    #[inline]
    pub fn edge(&self, i: usize, j: usize) -> Vector {
        let [a, b] = [self.vertices[i], self.vertices[j]];
        std::array::from_fn(|k| Interval::at(b[k]) - Interval::at(a[k]))
    }

    /// |F_i| = d |κ| |∇λ_i|
    pub fn face_measure(&self, i: usize) -> Interval {
        self.dim as f64 * (self.measure * norm(&self.gradients[i], self.dim))
    }

    /// Σ_i a_i ∇λ_i of vertex values, from their differences to the first.
    #[inline]
    pub fn gradient(&self, values: &[Interval; 4]) -> Vector {
        let mut sum = ZERO;
        for i in 1..=self.dim {
            let difference = values[i] - values[0];
            if !difference.is_zero() {
                add(&mut sum, difference, &self.gradients[i], self.dim);
            }
        }
        sum
    }

    /// Σ_i b_i x_i where the b_i sum to 0: a vector.
    #[inline]
    pub fn vector(&self, b: &[Interval; 4]) -> Vector {
        let mut sum = ZERO;
        for i in 1..=self.dim {
            add(&mut sum, b[i], &self.edge(0, i), self.dim);
        }
        sum
    }
}

/// sum += a v
#[inline]
pub(super) fn add(sum: &mut Vector, a: Interval, v: &Vector, dim: usize) {
    for k in 0..dim {
        sum[k] += a * v[k];
    }
}

#[inline]
pub(super) fn plus(a: &Vector, b: &Vector) -> Vector {
    std::array::from_fn(|k| a[k] + b[k])
}

#[inline]
pub(super) fn minus(a: &Vector, b: &Vector) -> Vector {
    std::array::from_fn(|k| a[k] - b[k])
}

#[inline]
pub(super) fn times(s: Interval, a: &Vector) -> Vector {
    a.map(|a| s * a)
}

/// The half of a vector; exact.
#[inline]
pub(super) fn half(a: &Vector) -> Vector {
    a.map(|a| Interval::new(0.5 * a.low, 0.5 * a.high))
}

#[inline]
pub(super) fn dot(a: &Vector, b: &Vector, dim: usize) -> Interval {
    (0..dim).map(|k| a[k] * b[k]).sum()
}

#[inline]
pub(super) fn norm(a: &Vector, dim: usize) -> Interval {
    (0..dim).map(|k| a[k].square()).sum::<Interval>().root()
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    let at = |i: usize, j: usize| a[i] * b[j] - a[j] * b[i];
    [at(1, 2), at(2, 0), at(0, 1)]
}

/// A linear field with these values at the corners, at a point.
#[inline]
pub(super) fn interpolated(corners: &[Vector; 4], lambda: &[f64; 4], dim: usize) -> Vector {
    let mut sum = ZERO;
    for (corner, weight) in corners.iter().zip(lambda).take(dim + 1) {
        add(&mut sum, Interval::at(*weight), corner, dim);
    }
    sum
}

/// A vector field that is a polynomial of degree 2 on a simplex: its values at the corners, and at the midpoints of the
/// edges 01, 02, 12, 03, 13, 23.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quadratic {
    pub corners: [Vector; 4],
    pub middles: [Vector; 6],
}

/// The corners of each edge, in the order of [`Quadratic::middles`].
pub(super) const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [1, 2], [0, 3], [1, 3], [2, 3]];

impl Quadratic {
    pub const ZERO: Quadratic = Quadratic {
        corners: [ZERO; 4],
        middles: [ZERO; 6],
    };

    /// The linear field with these values at the corners.
    #[inline]
    pub fn linear(corners: [Vector; 4]) -> Self {
        Quadratic {
            corners,
            middles: EDGES.map(|[i, j]| half(&plus(&corners[i], &corners[j]))),
        }
    }

    /// The field on a part of the simplex.
    pub fn on(&self, piece: &Piece, dim: usize) -> Self {
        let middle = |i: usize, j: usize| -> [f64; 4] {
            std::array::from_fn(|k| 0.5 * (piece[i][k] + piece[j][k]))
        };
        Quadratic {
            corners: piece.map(|corner| self.at(&corner, dim)),
            middles: EDGES.map(|[i, j]| {
                if i.max(j) <= dim {
                    self.at(&middle(i, j), dim)
                } else {
                    ZERO
                }
            }),
        }
    }

    /// The field at a point with exact coordinates: Σ w(x_i) λ_i (2λ_i-1) + Σ w(m_ij) 4 λ_i λ_j.
    pub fn at(&self, lambda: &[f64; 4], dim: usize) -> Vector {
        let at = Interval::at;
        let mut sum = ZERO;
        for i in 0..=dim {
            let weight = at(lambda[i]) * (at(2.0 * lambda[i]) - Interval::ONE);
            add(&mut sum, weight, &self.corners[i], dim);
        }
        for ([i, j], middle) in EDGES.iter().zip(&self.middles).take(dim * (dim + 1) / 2) {
            let weight = at(4.0 * lambda[*i]) * at(lambda[*j]);
            add(&mut sum, weight, middle, dim);
        }
        sum
    }

    /// Adds a multiple of another field.
    pub fn plus(&self, factor: f64, other: &Self) -> Self {
        let of = |a: &Vector, b: &Vector| plus(a, &times(Interval::at(factor), b));
        Quadratic {
            corners: std::array::from_fn(|i| of(&self.corners[i], &other.corners[i])),
            middles: std::array::from_fn(|i| of(&self.middles[i], &other.middles[i])),
        }
    }

    /// The mean over the simplex: that of Bernstein's coefficients.
    pub fn mean(&self, dim: usize) -> Vector {
        let (corners, edges) = (dim + 1, dim * (dim + 1) / 2);
        // Σ b_ij = 2 Σ w(m_ij) - d/2 Σ w(x_i), as each corner is on d edges.
        let share = 1.0 - 0.5 * dim as f64;
        std::array::from_fn(|k| {
            let at_corners: Interval = self.corners[..corners].iter().map(|w| w[k]).sum();
            let at_middles: Interval = self.middles[..edges].iter().map(|w| w[k]).sum();
            (share * at_corners + 2.0 * at_middles) / Interval::at((corners + edges) as f64)
        })
    }

    /// The mean of |·|² over the simplex.
    ///
    /// With Bernstein's coefficients b_ii = w(x_i) and b_ij = 2 w(m_ij) - (b_ii + b_jj)/2 it is F(b) = Σ b_α·b_β g(α, β),
    /// g(α, β) = C(α+β, α) / (C(4, 2) C(4+d, d)) (R. T. Farouki, T. N. T. Goodman, Math. Comp. 65, 1996). The weights g are
    /// positive, and each row of them has the sum 1/N, N coefficients: with S the mean of b², and b known up to ρ, F of the
    /// middles is off by no more than 2ρ√S + ρ², and its rounding by no more than 2⁻⁴⁸ S, as each term is rounded less than 2⁵
    /// times.
    pub fn mean_square(&self, dim: usize) -> Interval {
        let edges = dim * (dim + 1) / 2;
        let scale = 6.0 * if dim == 2 { 15.0 } else { 35.0 };
        let (mut sum, mut off) = (0.0, 0.0);
        for k in 0..dim {
            let corner: [f64; 4] = std::array::from_fn(|i| self.corners[i][k].mid());
            let middle: [f64; 6] = std::array::from_fn(|e| {
                let [i, j] = EDGES[e];
                2.0 * self.middles[e][k].mid() - 0.5 * (corner[i] + corner[j])
            });
            let (mut largest, mut radius) = (0.0_f64, 0.0_f64);
            for w in self.corners[..=dim].iter().chain(&self.middles[..edges]) {
                largest = largest.max(w[k].magnitude());
                radius = radius.max(w[k].radius());
            }
            if largest == 0.0 {
                continue;
            }
            // Σ_α Σ_β with α+β over the multi-indices of degree 4: C(α+β, α) is 6 for (2e_i, 2e_i), 1 for
            // (2e_i, 2e_j), 3 for (2e_i, e_i+e_j), 1 for (2e_i, e_j+e_k), 4 for twice one edge, 2 for edges with one
            // corner in common, 1 for opposite edges of a tetrahedron. A middle coefficient stands for one multi-index.
            let all: f64 = corner[..=dim].iter().sum();
            let squares: f64 = corner[..=dim].iter().map(|c| c * c).sum();
            let mut own = all * all + 5.0 * squares;
            for e in 0..edges {
                let [i, j] = EDGES[e];
                own += middle[e] * (2.0 * (all + 2.0 * (corner[i] + corner[j])));
                own += 4.0 * middle[e] * middle[e];
                for f in 0..e {
                    let [k, l] = EDGES[f];
                    let shared = [i, j].iter().filter(|v| [k, l].contains(v)).count();
                    own += if shared == 1 { 4.0 } else { 2.0 } * middle[e] * middle[f];
                }
            }
            sum += own / scale;
            // b is rounded three times, and is no larger than 3 max |w|.
            let radius = 3.0 * radius + largest * 2f64.powi(-51);
            let mean = (squares + middle[..edges].iter().map(|b| b * b).sum::<f64>())
                / (dim + 1 + edges) as f64;
            off += 2.0 * radius * mean.sqrt() + radius * radius + mean * 2f64.powi(-48);
        }
        if off == 0.0 {
            return Interval::ZERO;
        }
        // `off` itself, and the sum of the components, are rounded.
        let off = 1.001 * off + f64::MIN_POSITIVE;
        Interval::new((sum - off).max(0.0), sum + off)
    }
}

/// The mean of the square of a linear function with these corner values, or of a field component by component.
#[inline]
pub(super) fn mean_square_of_linear(corners: &[Interval]) -> Interval {
    let count = corners.len() as f64;
    let squares: Interval = corners.iter().map(|c| c.square()).sum();
    let all: Interval = corners.iter().copied().sum();
    (squares + all.square()) / Interval::at(count * (count + 1.0))
}

/// Bernstein's coefficients of 4 λ_a λ_b on a piece, at its corners and for [`EDGES`].
pub(super) fn bubble_on(piece: &Piece, [a, b]: [usize; 2], dim: usize) -> [Interval; 10] {
    let at = |i: usize, k: usize| Interval::at(piece[i][k]);
    std::array::from_fn(|n| {
        let [i, j] = if n < 4 { [n, n] } else { EDGES[n - 4] };
        if i.max(j) > dim {
            return Interval::ZERO;
        }
        2.0 * (at(i, a) * at(j, b) + at(j, a) * at(i, b))
    })
}

/// The mean of the product of a linear function with these corner values and a quadratic one with these coefficients of
/// Bernstein: Σ_i Σ_α p_i b_α (α_i+1) / (3 C(3+d, 3)) (R. T. Farouki, T. N. T. Goodman, Math. Comp. 65, 1996).
pub(super) fn mean_with_bubble(p: &[Interval; 4], b: &[Interval; 10], dim: usize) -> Interval {
    let all: Interval = p[..=dim].iter().copied().sum();
    let terms = b.iter().enumerate().map(|(n, b)| {
        let [i, j] = if n < 4 { [n, n] } else { EDGES[n - 4] };
        let own = if i.max(j) > dim {
            Interval::ZERO
        } else {
            p[i] + p[j]
        };
        *b * (all + own)
    });
    let count = [12.0, 30.0, 60.0][dim - 1];
    terms.sum::<Interval>() / Interval::at(count)
}

/// The corners of a piece as intervals, from the corners of the whole; exact coordinates where the piece has them.
pub(super) fn corners(vertices: &[[f64; 3]], piece: &Piece, dim: usize) -> [Vector; 4] {
    let count = vertices.len();
    std::array::from_fn(|j| {
        if j >= count {
            return ZERO;
        }
        if let Some(i) = (0..count).find(|&i| piece[j][i] == 1.0) {
            return vertices[i].map(Interval::at);
        }
        std::array::from_fn(|k| {
            if k >= dim {
                return Interval::ZERO;
            }
            let sum: Interval = (0..count)
                .map(|i| piece[j][i] * Interval::at(vertices[i][k]))
                .sum();
            // A convex combination: it is in the box of the vertices, whatever the rounding.
            let ends = vertices.iter().map(|x| Interval::at(x[k]));
            sum.meet(ends.reduce(Interval::hull).unwrap_or(Interval::WHOLE))
        })
    })
}

/// √(a b) rounded up, of numbers that are not negative.
pub(super) fn root_of_product(a: f64, b: f64) -> f64 {
    (Interval::at(a) * Interval::at(b)).root().high
}

/// √(Σ a²), rounded up.
pub(super) fn length(values: impl IntoIterator<Item = f64>) -> f64 {
    let squares = values.into_iter().map(|v| Interval::at(v).square().high);
    Interval::at(crate::interval::above_of_all(squares))
        .root()
        .high
}

/// a + b rounded up.
pub(super) fn up(a: f64, b: f64) -> f64 {
    above_of_sum(a, b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::{WHOLE, exact};
    use faceoff_mesh::mesh::generate::{union_cube, union_jack};

    /// Against the quadrature rule of degree 4, which is another formula.
    #[test]
    fn squares_of_quadratic_fields_are_integrated() {
        let mut random = crate::Random::new(7);
        let mut random = || 2.0 * random.next() - 1.0;
        for dim in [2, 3] {
            let mut field = Quadratic::ZERO;
            for w in field.corners[..=dim]
                .iter_mut()
                .chain(&mut field.middles[..dim * (dim + 1) / 2])
            {
                (0..dim).for_each(|k| w[k] = Interval::at(random()));
            }
            let at = |lambda: &[f64; 4], k: usize| -> f64 {
                let corners = (0..=dim)
                    .map(|i| field.corners[i][k].mid() * lambda[i] * (2.0 * lambda[i] - 1.0));
                let edges = EDGES[..dim * (dim + 1) / 2].iter().zip(&field.middles);
                let middles = edges.map(|([i, j], w)| 4.0 * w[k].mid() * lambda[*i] * lambda[*j]);
                corners.sum::<f64>() + middles.sum::<f64>()
            };
            let rule = exact(dim, 4);
            let expected: f64 = rule
                .iter()
                .map(|(l, w)| w * (0..dim).map(|k| at(&l, k).powi(2)).sum::<f64>())
                .sum();
            let found = field.mean_square(dim);
            assert!(
                (found.mid() / expected - 1.0).abs() < 1e-12,
                "{dim}: {found:?} {expected}"
            );
            assert!(found.high - found.low < 1e-13 * expected);
            for k in 0..dim {
                let expected: f64 = rule.iter().map(|(l, w)| w * at(&l, k)).sum();
                assert!((field.mean(dim)[k].mid() - expected).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn geometry_is_that_of_the_mesh() {
        let flat = Triangulation::new("uj", &union_jack(3, [2.0, 0.3])).unwrap();
        let solid = Triangulation::new("uc", &union_cube(2, [1.3, 0.7, 2.0])).unwrap();
        for mesh in [&flat, &solid] {
            for cell in 0..mesh.cell_count() {
                let (of, geometry) = (Simplex::new(mesh, cell), mesh.geometry(cell));
                let near = |a: Interval, b: f64| {
                    (a.mid() - b).abs() <= 1e-13 * (1.0 + b.abs())
                        && a.high - a.low < 1e-12 * (1.0 + b.abs())
                };
                assert!(
                    near(of.measure, geometry.measure())
                        && of.diameter >= geometry.diameter * (1.0 - 1e-15)
                );
                for i in 0..=mesh.dim {
                    assert!(near(of.face_measure(i), geometry.face_measure(i)));
                    assert!((0..3).all(|k| near(of.gradients[i][k], geometry.gradients[i][k])));
                }
                let [a, ..] = corners(&of.vertices[..=mesh.dim], &WHOLE, mesh.dim);
                assert_eq!(a.map(Interval::mid), of.vertices[0]);
            }
        }
    }
}
