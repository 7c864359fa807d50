//! A cell in interval arithmetic: its measure and its gradients.
//!
//! The vertices are exact: their coordinates are the mesh.

use crate::interval::{Interval, above_of_sum};
use crate::quadrature::{Piece, longest_edge};
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
    /// About ∇λ_i …
    pub slopes: [[f64; 3]; 4],
    /// … and how far off any component is at most, with some room to round.
    pub off: f64,
    /// At least the longest edge.
    pub diameter: f64,
}

/// Twice what rounding to nearest errs by, relative to the result.
const STEP: f64 = f64::EPSILON;

impl Simplex {
    /// By J⁻ᵀ from cofactors, ∇λ_i being normal to the face opposite i; with bounds of the rounding from the sizes of the
    /// terms, which take less time than an interval each.
    #[inline]
    pub fn new(mesh: &Triangulation, cell: usize) -> Self {
        let (dim, vertices) = (mesh.dim, mesh.vertices(cell));
        let edge = |i: usize, j: usize| -> [f64; 3] {
            std::array::from_fn(|k| vertices[j][k] - vertices[i][k])
        };
        let [a, b] = [edge(0, 1), edge(0, 2)];
        // Cofactors and the sums of the sizes of their terms; they are off by 4 roundings of these.
        let (cofactors, sizes) = if dim == 2 {
            let of = [[b[1], -b[0], 0.0], [-a[1], a[0], 0.0], [0.0; 3]];
            (of, of.map(|c| c.map(f64::abs)))
        } else {
            let c = edge(0, 3);
            let of = [cross(&b, &c), cross(&c, &a), cross(&a, &b)];
            (of.map(|c| c.0), of.map(|c| c.1))
        };
        let terms = (0..dim).map(|k| (a[k] * cofactors[0][k], (a[k] * sizes[0][k]).abs()));
        let (determinant, size) = terms.fold((0.0, 0.0), |sum, of| (sum.0 + of.0, sum.1 + of.1));
        let error = 6.0 * STEP * size + 8.0 * f64::MIN_POSITIVE;
        let least = determinant.abs() - error;
        let mut slopes = [[0.0; 3]; 4];
        // Of slopes that are not known nothing is.
        let mut off = if least > 0.0 { 0.0 } else { f64::INFINITY };
        if least > 0.0 {
            for i in 1..=dim {
                for k in 0..dim {
                    let slope = cofactors[i - 1][k] / determinant;
                    let rounding = 3.0 * STEP * sizes[i - 1][k] + 8.0 * f64::MIN_POSITIVE;
                    let own = (rounding + slope.abs() * error) / least + 2.0 * STEP * slope.abs();
                    off = f64::max(off, own);
                    slopes[i][k] = slope;
                    slopes[0][k] -= slope;
                }
            }
            let largest = slopes
                .iter()
                .flatten()
                .fold(0.0, |m: f64, s| m.max(s.abs()));
            off = (dim + 1) as f64 * (off + 2.0 * STEP * largest);
        }
        let factor = if dim == 2 { 2.0 } else { 6.0 };
        let mut square = 0.0_f64;
        for i in 0..=dim {
            for j in 0..i {
                let edge = edge(j, i);
                square = square.max(edge.iter().map(|x| x * x).sum());
            }
        }
        Simplex {
            dim,
            vertices,
            measure: Interval::new(least, determinant.abs() + error) / Interval::at(factor),
            slopes,
            off,
            diameter: square.sqrt() * (1.0 + 8.0 * STEP) + f64::MIN_POSITIVE,
        }
    }

    /// ∇λ_i
    #[inline]
    pub fn gradient_of(&self, i: usize) -> Vector {
        let mut gradient = ZERO;
        for (g, slope) in gradient.iter_mut().zip(self.slopes[i]).take(self.dim) {
            *g = Interval::new(slope - self.off, slope + self.off);
        }
        gradient
    }

    /// x_j - x_i
    #[inline]
    pub fn edge(&self, i: usize, j: usize) -> Vector {
        let [a, b] = [self.vertices[i], self.vertices[j]];
        std::array::from_fn(|k| Interval::at(b[k]) - Interval::at(a[k]))
    }

    /// |F_i| = d |κ| |∇λ_i|
    pub fn face_measure(&self, i: usize) -> Interval {
        self.dim as f64 * (self.measure * norm(&self.gradient_of(i), self.dim))
    }

    /// Σ_i a_i ∇λ_i of vertex values, from their differences to the first.
    #[inline]
    pub fn gradient(&self, values: &[Interval; 4]) -> Vector {
        let mut sum = ZERO;
        for i in 1..=self.dim {
            let difference = values[i] - values[0];
            if !difference.is_zero() {
                add(&mut sum, difference, &self.gradient_of(i), self.dim);
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

#[inline]
pub(super) fn dot(a: &Vector, b: &Vector, dim: usize) -> Interval {
    (0..dim).map(|k| a[k] * b[k]).sum()
}

#[inline]
pub(super) fn norm(a: &Vector, dim: usize) -> Interval {
    (0..dim).map(|k| a[k].square()).sum::<Interval>().root()
}

/// a × b, and the sums of the sizes of its terms.
fn cross(a: &[f64; 3], b: &[f64; 3]) -> ([f64; 3], [f64; 3]) {
    let of = |i: usize, j: usize| {
        let terms = [a[i] * b[j], a[j] * b[i]];
        (terms[0] - terms[1], terms[0].abs() + terms[1].abs())
    };
    let of = [of(1, 2), of(2, 0), of(0, 1)];
    (of.map(|of| of.0), of.map(|of| of.1))
}

/// The box of a simplex with these corners.
pub(super) fn around(corners: &[Vector]) -> Vector {
    let all = corners.iter().copied();
    let both = |a: Vector, b: Vector| std::array::from_fn(|k| a[k].hull(b[k]));
    all.reduce(both).unwrap_or_default()
}

/// The longest edge of a part of the simplex with these vertices.
pub(super) fn longest_edge_of(vertices: &[[f64; 3]; 4], piece: &Piece, dim: usize) -> [usize; 2] {
    longest_edge(piece, dim, |weights| {
        let along = |k: usize| vertices.iter().zip(weights).map(|(x, w)| w * x[k]).sum();
        let edge: [f64; 3] = std::array::from_fn(along);
        edge.iter().map(|x| x * x).sum()
    })
}

/// The corners of each edge.
pub(super) const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [1, 2], [0, 3], [1, 3], [2, 3]];

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
    use crate::quadrature::WHOLE;
    use faceoff_mesh::mesh::generate::{union_cube, union_jack};

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
                    assert!((0..3).all(|k| near(of.gradient_of(i)[k], geometry.gradients[i][k])));
                }
                let [a, ..] = corners(&of.vertices[..=mesh.dim], &WHOLE, mesh.dim);
                assert_eq!(a.map(Interval::mid), of.vertices[0]);
            }
        }
    }
}
