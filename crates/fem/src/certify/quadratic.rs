//! Vector fields of degree 1 and 2 on a cell by about their values at points, with one bound for all rounding of a component
//! instead of an interval each (N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2002, ch. 3).

use super::simplex::{EDGES, Simplex, Vector, ZERO};
use crate::interval::Interval;
use crate::quadrature::Piece;

/// Twice what rounding to nearest errs by, relative to the result.
const STEP: f64 = f64::EPSILON;
/// Σ |φ| ≤ Σ λ_i |2λ_i - 1| + 4 Σ λ_i λ_j ≤ 1 + 2 (1 - Σ λ_i²) of P2's functions φ.
const LEBESGUE: f64 = 2.5;

/// Counts four roundings of numbers no larger than `size`, or more of smaller ones. That `off` and `size` are rounded
/// themselves is made good at the end, in [`Quadratic::mean_square`] and [`Linear::at_corners`].
#[inline]
fn round<const D: usize>(off: &mut [f64; D], size: &[f64; D]) {
    for (off, size) in off.iter_mut().zip(size).filter(|(_, size)| **size > 0.0) {
        *off += 2.0 * STEP * size + f64::MIN_POSITIVE;
    }
}

/// A linear vector field of D components on a simplex of no more than D dimensions.
#[derive(Debug, Clone, Copy)]
pub(super) struct Linear<const D: usize> {
    corners: [[f64; D]; 4],
    /// Each component at the corners is no farther off than this …
    off: [f64; D],
    /// … and no larger than this.
    size: [f64; D],
}

impl<const D: usize> Linear<D> {
    const ZERO: Self = Linear {
        corners: [[0.0; D]; 4],
        off: [0.0; D],
        size: [0.0; D],
    };

    /// The field with these values at the corners.
    #[inline]
    pub fn new(corners: &[Vector; 4]) -> Self {
        let mut of = Self::ZERO;
        for (value, corner) in of.corners.iter_mut().zip(corners) {
            for k in 0..D {
                value[k] = corner[k].mid();
                of.off[k] = of.off[k].max(corner[k].radius());
                of.size[k] = of.size[k].max(corner[k].magnitude());
            }
        }
        of
    }

    /// ∇(Σ a_i λ_i + Σ_F 4 b_F λ_a λ_b), F = ab, b by the vertex opposite.
    #[inline]
    pub fn gradient(cell: &Simplex, a: &[Interval; 4], b: Option<&[f64; 3]>) -> Self {
        let mut of = Self::ZERO;
        let mut flat = [0.0; D];
        for i in 1..=cell.dim {
            // Rounded once, and each end as far off as it may be.
            let middle = a[i].mid() - a[0].mid();
            let radius = a[i].radius() + a[0].radius() + STEP * middle.abs();
            if middle == 0.0 && radius == 0.0 {
                continue;
            }
            for k in 0..D {
                let slope = cell.slopes[i][k];
                let most = slope.abs() + cell.off;
                flat[k] += middle * slope;
                of.off[k] += middle.abs() * cell.off + radius * most;
                of.size[k] += (middle.abs() + radius) * most;
            }
        }
        of.corners = [flat; 4];
        if let Some(b) = b {
            for (corner, value) in of.corners.iter_mut().enumerate().take(3) {
                for j in (0..3).filter(|&j| j != corner) {
                    // The face of both is opposite the third.
                    let weight = 4.0 * b[3 - j - corner];
                    (0..2).for_each(|k| value[k] += weight * cell.slopes[j][k]);
                }
            }
            let most = 4.0 * b.iter().fold(0.0, |m: f64, b| m.max(b.abs()));
            for k in 0..2 {
                let all: f64 = cell.slopes[..3].iter().map(|g| g[k].abs()).sum();
                of.off[k] += 3.0 * most * cell.off;
                of.size[k] += most * (all + 3.0 * cell.off);
            }
        }
        round(&mut of.off, &of.size);
        of
    }

    /// A Raviart–Thomas field of lowest order: Σ_i flux_i (x - x_i)/(d|κ|).
    #[inline]
    pub fn raviart_thomas(cell: &Simplex, fluxes: &[f64]) -> Self {
        let (dim, mut of) = (cell.dim, Self::ZERO);
        let volume = dim as f64 * cell.measure;
        let known_to = volume.radius() / volume.low.max(0.0) + 2.0 * STEP;
        let x = &cell.vertices;
        let wide: [f64; D] = std::array::from_fn(|k| {
            let all = x[..=dim].iter().map(|x| x[k]);
            all.clone().fold(f64::MIN, f64::max) - all.fold(f64::MAX, f64::min)
        });
        for (i, flux) in fluxes.iter().enumerate().filter(|(_, flux)| **flux != 0.0) {
            let weight = flux / volume.mid();
            for (corner, value) in of.corners.iter_mut().enumerate().take(dim + 1) {
                (0..D).for_each(|k| value[k] += weight * (x[corner][k] - x[i][k]));
            }
            (0..D).for_each(|k| of.size[k] += weight.abs() * (1.0 + known_to) * wide[k]);
        }
        (0..D).for_each(|k| of.off[k] += known_to * of.size[k]);
        round(&mut of.off, &of.size);
        of
    }

    /// Σ_i c_i ∇λ_i, c_i = Σ_n derivatives_n,i u_n, from the derivatives of basis functions at each corner.
    #[inline]
    pub fn of_basis<const N: usize>(
        cell: &Simplex,
        derivatives: &[[[f64; 4]; N]; 4],
        u: &[f64],
    ) -> Self {
        let mut of = Self::ZERO;
        for (value, derivatives) in of.corners.iter_mut().zip(derivatives).take(cell.dim + 1) {
            let (mut off, mut size) = ([0.0; D], [0.0; D]);
            for i in 0..=cell.dim {
                let terms = derivatives.iter().zip(u).map(|(d, u)| d[i] * u);
                let (c, most) = terms.fold((0.0, 0.0), |(c, most), t: f64| (c + t, most + t.abs()));
                // Of no more than 20 terms.
                let error = 10.0 * STEP * most;
                for k in 0..D {
                    let slope = cell.slopes[i][k];
                    value[k] += c * slope;
                    off[k] += most * cell.off + error * (slope.abs() + cell.off);
                    size[k] += (c.abs() + error) * (slope.abs() + cell.off);
                }
            }
            for k in 0..D {
                of.off[k] = of.off[k].max(off[k]);
                of.size[k] = of.size[k].max(size[k]);
            }
        }
        round(&mut of.off, &of.size);
        of
    }

    /// (w₂, -w₁)
    #[inline]
    pub fn turned(mut self) -> Self {
        for w in &mut self.corners {
            w.swap(0, 1);
            w[1] = -w[1];
        }
        self.off.swap(0, 1);
        self.size.swap(0, 1);
        self
    }

    /// Adds a multiple of another field.
    #[inline]
    pub fn plus(mut self, factor: f64, other: &Self) -> Self {
        for (a, b) in self.corners.iter_mut().zip(&other.corners).take(D + 1) {
            (0..D).for_each(|k| a[k] += factor * b[k]);
        }
        for k in 0..D {
            self.off[k] += factor.abs() * other.off[k];
            self.size[k] += factor.abs() * other.size[k];
        }
        round(&mut self.off, &self.size);
        self
    }

    /// The mean over the simplex of the product with another field: (Σ_i a_i·b_i + Σ a_i · Σ b_i) / ((d+1)(d+2)), fewer than 16
    /// roundings of no more than the largest |a| |b|.
    pub fn mean_product(&self, other: &Self, dim: usize) -> Interval {
        let (count, mut sum, mut off) = ((dim + 1) as f64, 0.0, 0.0);
        for k in 0..dim.min(D) {
            let pairs = || self.corners.iter().zip(&other.corners).take(dim + 1);
            let own: f64 = pairs().map(|(a, b)| a[k] * b[k]).sum();
            let (of_a, of_b) = pairs().fold((0.0, 0.0), |s, (a, b)| (s.0 + a[k], s.1 + b[k]));
            sum += (own + of_a * of_b) / (count * (count + 1.0));
            let (size, radius) = (self.size[k] * other.size[k], self.off[k] * other.off[k]);
            off += self.off[k] * other.size[k] + self.size[k] * other.off[k] + radius;
            off += 8.0 * STEP * size;
        }
        // `off` itself, and the sum of the components, are rounded.
        if off == 0.0 {
            return Interval::ZERO;
        }
        let off = 1.001 * off + f64::MIN_POSITIVE;
        Interval::new(sum - off, sum + off)
    }

    /// Its values at the corners.
    pub fn at_corners(&self) -> [Vector; 4] {
        let around = self.off.map(|off| Interval::around_zero(1.001 * off));
        self.corners.each_ref().map(|w| {
            let mut of = ZERO;
            (0..D).for_each(|k| of[k] = Interval::at(w[k]) + around[k]);
            of
        })
    }
}

/// A vector field of degree 2: about its values at the corners, and at the midpoints of [`EDGES`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Quadratic<const D: usize> {
    pub corners: [[f64; D]; 4],
    pub middles: [[f64; D]; 6],
    /// Each component at these points is no farther off than this …
    off: [f64; D],
    /// … and no larger than this.
    size: [f64; D],
}

impl<const D: usize> Quadratic<D> {
    /// How many middles there are.
    const SIDES: usize = D * (D + 1) / 2;

    pub const ZERO: Self = Quadratic {
        corners: [[0.0; D]; 4],
        middles: [[0.0; D]; 6],
        off: [0.0; D],
        size: [0.0; D],
    };

    /// A function as the first component, by its values: none is farther off than `off`, or larger than `size`.
    pub fn scalar(
        corners: &[[f64; 3]],
        value: impl Fn([f64; 3]) -> f64,
        off: f64,
        size: f64,
    ) -> Self {
        let mut of = Self::ZERO;
        for (w, x) in of.corners.iter_mut().zip(corners) {
            w[0] = value(*x);
        }
        for (w, [i, j]) in of.middles.iter_mut().zip(EDGES) {
            if let (Some(a), Some(b)) = (corners.get(i), corners.get(j)) {
                w[0] = value(std::array::from_fn(|k| 0.5 * (a[k] + b[k])));
            }
        }
        (of.off[0], of.size[0]) = (off, size);
        of.rounded()
    }

    /// The field with these values at the corners and in the middles of [`EDGES`].
    pub fn new(corners: &[Vector; 4], middles: &[Vector; 6]) -> Self {
        let mut of = Self::ZERO;
        let points = of.corners.iter_mut().chain(&mut of.middles);
        for (value, point) in points.zip(corners.iter().chain(middles)) {
            for k in 0..D {
                value[k] = point[k].mid();
                of.off[k] = of.off[k].max(point[k].radius());
                of.size[k] = of.size[k].max(point[k].magnitude());
            }
        }
        of
    }

    /// A linear field is one.
    #[inline]
    pub fn of(linear: &Linear<D>) -> Self {
        let Linear { corners, off, size } = *linear;
        let mut of = Quadratic {
            corners,
            off,
            size,
            ..Self::ZERO
        };
        for (middle, [i, j]) in of.middles.iter_mut().zip(EDGES).take(Self::SIDES) {
            for k in 0..D {
                middle[k] = 0.5 * (of.corners[i][k] + of.corners[j][k]);
            }
        }
        of.rounded()
    }

    #[inline]
    fn rounded(mut self) -> Self {
        round(&mut self.off, &self.size);
        self
    }

    /// Adds -1/(d+1) Σ_i a_i λ_i (x - x_i) with a of the sum 0: (a_j - a_i) (x_j - x_i) / (4 (d+1)) in the middle of an edge, and 0
    /// at the corners. It has no normal trace on any face, and -div of it is Σ a_i λ_i. `edge` is x_j - x_i.
    #[inline]
    pub fn add_bubble(&mut self, dim: usize, a: &[f64; 4], edge: impl Fn(usize, usize) -> Vector) {
        for (n, &[i, j]) in EDGES.iter().take(dim * (dim + 1) / 2).enumerate() {
            let c = (a[j] - a[i]) / (4 * (dim + 1)) as f64;
            if c == 0.0 {
                continue;
            }
            self.bend(n, c, &edge(i, j));
        }
    }

    /// Adds c w in the middle of an edge, c rounded twice at most.
    #[inline]
    pub fn bend(&mut self, edge: usize, c: f64, w: &Vector) {
        for (k, w) in w.iter().enumerate().take(D) {
            let size = c.abs() * w.magnitude();
            self.middles[edge][k] += c * w.mid();
            self.size[k] += size;
            self.off[k] += c.abs() * w.radius() + 4.0 * STEP * size;
        }
        round(&mut self.off, &self.size);
    }

    /// The field on a part of the simplex.
    pub fn on(&self, piece: &Piece, dim: usize) -> Self {
        let mut of = Self::ZERO;
        for (corner, at) in of.corners.iter_mut().zip(piece).take(dim + 1) {
            *corner = self.at(at, dim);
        }
        for (middle, [i, j]) in of.middles.iter_mut().zip(EDGES).take(dim * (dim + 1) / 2) {
            let at = std::array::from_fn(|k| 0.5 * (piece[i][k] + piece[j][k]));
            *middle = self.at(&at, dim);
        }
        // Ten products of three numbers and their sum: less than 16 roundings of 2⁻⁵³.
        for k in 0..D {
            of.size[k] = LEBESGUE * self.size[k];
            of.off[k] = LEBESGUE * self.off[k] + 8.0 * STEP * of.size[k];
        }
        of.rounded()
    }

    /// The field at a point with exact coordinates: Σ w(x_i) λ_i (2λ_i-1) + Σ w(m_ij) 4 λ_i λ_j.
    pub fn at(&self, lambda: &[f64; 4], dim: usize) -> [f64; D] {
        let mut sum = [0.0; D];
        let mut add = |weight: f64, value: &[f64; D]| {
            for k in 0..D {
                sum[k] += weight * value[k];
            }
        };
        for (corner, l) in self.corners.iter().zip(lambda).take(dim + 1) {
            add(l * (2.0 * l - 1.0), corner);
        }
        for ([i, j], middle) in EDGES.iter().zip(&self.middles).take(dim * (dim + 1) / 2) {
            add(4.0 * lambda[*i] * lambda[*j], middle);
        }
        sum
    }

    /// Adds a multiple of another field.
    #[inline]
    pub fn plus(&self, factor: f64, other: &Self) -> Self {
        let mut of = *self;
        for (a, b) in of.corners.iter_mut().zip(&other.corners).take(D + 1) {
            for k in 0..D {
                a[k] += factor * b[k];
            }
        }
        let middles = of.middles.iter_mut().zip(&other.middles);
        for (a, b) in middles.take(Self::SIDES) {
            for k in 0..D {
                a[k] += factor * b[k];
            }
        }
        for k in 0..D {
            of.off[k] += factor.abs() * other.off[k];
            of.size[k] += factor.abs() * other.size[k];
        }
        of.rounded()
    }

    /// About the mean over the simplex: that of Bernstein's coefficients.
    pub fn mean(&self, dim: usize) -> [f64; D] {
        let (corners, edges) = (dim + 1, dim * (dim + 1) / 2);
        // Σ b_ij = 2 Σ w(m_ij) - d/2 Σ w(x_i), as each corner is on d edges.
        let share = 1.0 - 0.5 * dim as f64;
        std::array::from_fn(|k| {
            let at_corners: f64 = self.corners[..corners].iter().map(|w| w[k]).sum();
            let at_middles: f64 = self.middles[..edges].iter().map(|w| w[k]).sum();
            (share * at_corners + 2.0 * at_middles) / (corners + edges) as f64
        })
    }

    /// z_i and b_F of about the best Σ z_i λ_i + Σ_F 4 b_F λ_a λ_b on a triangle whose gradient it is.
    pub fn potential(&self, triangle: &Simplex) -> ([Interval; 4], [f64; 3]) {
        let x = &triangle.vertices;
        let mut rises = [0.0; 3];
        let mut b = [0.0; 3];
        for (edge, [i, j]) in EDGES.into_iter().enumerate().take(3) {
            let along = |w: &[f64; D]| (0..2).map(|k| w[k] * (x[j][k] - x[i][k])).sum::<f64>();
            let [from, to] = [along(&self.corners[i]), along(&self.corners[j])];
            rises[edge] = (from + 4.0 * along(&self.middles[edge]) + to) / 6.0;
            b[3 - i - j] = (from - to) / 8.0;
        }
        // Around the triangle a gradient rises by 0.
        let [first, second, third] = rises;
        let open = (second - first - third) / 3.0;
        let z = [0.0, first + open, second - open, 0.0];
        (z.map(Interval::at), b)
    }

    /// The mean of |·|² over the simplex.
    ///
    /// With Bernstein's coefficients b_ii = w(x_i) and b_ij = 2 w(m_ij) - (b_ii + b_jj)/2 it is F(b) = Σ b_α·b_β g(α, β),
    /// g(α, β) = C(α+β, α) / (C(4, 2) C(4+d, d)) (R. T. Farouki, T. N. T. Goodman, Math. Comp. 65, 1996). The weights g are
    /// positive, and each row of them has the sum 1/N, N coefficients: with S the mean of b², and b known up to ρ, F of the
    /// middles is off by no more than 2ρ√S + ρ², and its rounding by no more than 2⁻⁴⁸ S, as each term is rounded less than 2⁵
    /// times.
    pub fn mean_square(&self, dim: usize) -> Interval {
        match dim {
            1 => self.square_of::<1, 2, 1>(),
            2 => self.square_of::<2, 3, 3>(),
            _ => self.square_of::<3, 4, 6>(),
        }
    }

    #[inline]
    fn square_of<const DIM: usize, const CORNERS: usize, const SIDES: usize>(&self) -> Interval {
        let scale = 6.0 * [5.0, 15.0, 35.0][DIM - 1];
        let (mut sum, mut off) = (0.0, 0.0);
        for k in 0..DIM.min(D) {
            if self.size[k] == 0.0 {
                continue;
            }
            let (mut corner, mut middle) = ([0.0; CORNERS], [0.0; SIDES]);
            for (corner, w) in corner.iter_mut().zip(&self.corners) {
                *corner = w[k];
            }
            for (e, middle) in middle.iter_mut().enumerate() {
                let [i, j] = EDGES[e];
                *middle = 2.0 * self.middles[e][k] - 0.5 * (corner[i] + corner[j]);
            }
            // Σ_α Σ_β with α+β over the multi-indices of degree 4: C(α+β, α) is 6 for (2e_i, 2e_i), 1 for
            // (2e_i, 2e_j), 3 for (2e_i, e_i+e_j), 1 for (2e_i, e_j+e_k), 4 for twice one edge, 2 for edges with one
            // corner in common, 1 for opposite edges of a tetrahedron. A middle coefficient stands for one multi-index.
            let all: f64 = corner.iter().sum();
            let squares: f64 = corner.iter().map(|c| c * c).sum();
            let mut own = all * all + 5.0 * squares;
            for e in 0..SIDES {
                let [i, j] = EDGES[e];
                own += middle[e] * (2.0 * (all + 2.0 * (corner[i] + corner[j])));
                own += 4.0 * middle[e] * middle[e];
                for f in 0..e {
                    // Opposite edges of a tetrahedron: 01 and 23, 02 and 13, 12 and 03.
                    let weight = if e + f == 5 { 2.0 } else { 4.0 };
                    own += weight * middle[e] * middle[f];
                }
            }
            sum += own / scale;
            // b is rounded three times, and is no larger than 3 max |w|.
            let radius = 3.0 * self.off[k] + self.size[k] * (2.0 * STEP);
            let mean =
                (squares + middle.iter().map(|b| b * b).sum::<f64>()) / (CORNERS + SIDES) as f64;
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

/// ‖q‖_κ of a Raviart–Thomas field of lowest order.
pub(super) fn norm_of_fluxes(simplex: &Simplex, fluxes: &[f64]) -> f64 {
    let square = match simplex.dim {
        2 => Quadratic::of(&Linear::<2>::raviart_thomas(simplex, fluxes)).mean_square(2),
        dim => Quadratic::of(&Linear::<3>::raviart_thomas(simplex, fluxes)).mean_square(dim),
    };
    (square * simplex.measure).root().high
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::exact;

    /// (4 λ_a λ_b)² has the mean 8/45 on a triangle: with w from 0.9 to 1.1 all of 8/45 w² is in the interval.
    #[test]
    fn bends_are_off_by_what_their_edges_are() {
        let mut field = Quadratic::<2>::ZERO;
        field.bend(
            0,
            1.0,
            &[Interval::new(0.9, 1.1), Interval::ZERO, Interval::ZERO],
        );
        let found = field.mean_square(2);
        let [least, most] = [0.9_f64, 1.1].map(|w| 8.0 / 45.0 * w * w);
        assert!(found.low <= least && most <= found.high, "{found:?}");
    }

    /// Against the quadrature rule of degree 4, which is another formula.
    #[test]
    fn squares_of_quadratic_fields_are_integrated() {
        let mut random = crate::Random::new(7);
        let mut random = || 2.0 * random.next() - 1.0;
        for dim in [2, 3] {
            let mut vector = || {
                let mut w = ZERO;
                (0..dim).for_each(|k| w[k] = Interval::at(random()));
                w
            };
            let mut field = Quadratic::<3>::of(&Linear::new(&std::array::from_fn(|_| vector())));
            (0..dim * (dim + 1) / 2).for_each(|edge| field.bend(edge, 0.7, &vector()));
            let at = |lambda: &[f64; 4], k: usize| -> f64 {
                let corners =
                    (0..=dim).map(|i| field.corners[i][k] * lambda[i] * (2.0 * lambda[i] - 1.0));
                let edges = EDGES[..dim * (dim + 1) / 2].iter().zip(&field.middles);
                let middles = edges.map(|([i, j], w)| 4.0 * w[k] * lambda[*i] * lambda[*j]);
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
            assert!(found.high - found.low < 1e-12 * expected);
            for k in 0..dim {
                let expected: f64 = rule.iter().map(|(l, w)| w * at(&l, k)).sum();
                assert!((field.mean(dim)[k] - expected).abs() < 1e-14);
            }
        }
    }

    /// Of the product of 1 and all numbers from 0.9 to 1.1, in either order.
    #[test]
    fn a_product_is_off_by_what_either_field_is() {
        let field = |of: Interval| Linear::<2>::new(&[[of, Interval::ZERO, Interval::ZERO]; 4]);
        let [one, wide] = [Interval::ONE, Interval::new(0.9, 1.1)].map(field);
        for found in [one.mean_product(&wide, 2), wide.mean_product(&one, 2)] {
            assert!(found.low <= 0.9 && 1.1 <= found.high, "{found:?}");
        }
    }

    /// Of fields with any values in their intervals at the corners, by a rule; with values that are known it has 12 digits.
    #[test]
    fn products_of_linear_fields_are_integrated() {
        let mut random = crate::Random::new(9);
        for (dim, radius) in [(2, 0.0), (3, 0.0), (2, 0.1), (3, 0.1)] {
            for _ in 0..50 {
                let mut random = || 2.0 * random.next() - 1.0;
                let [a, b] = [(); 2].map(|()| {
                    let middles: [[f64; 3]; 4] =
                        std::array::from_fn(|_| std::array::from_fn(|_| random()));
                    let around =
                        middles.map(|w| w.map(|w| Interval::at(w) + Interval::around_zero(radius)));
                    let any = middles.map(|w| w.map(|w| w + radius * random().signum()));
                    (Linear::<3>::new(&around), any)
                });
                let rule = exact(dim, 2);
                let at = |corners: &[[f64; 3]; 4], l: &[f64; 4], k: usize| -> f64 {
                    (0..=dim).map(|i| l[i] * corners[i][k]).sum()
                };
                let product = |l: &[f64; 4]| -> f64 {
                    (0..dim).map(|k| at(&a.1, l, k) * at(&b.1, l, k)).sum()
                };
                let expected: f64 = rule.iter().map(|(l, w)| w * product(&l)).sum();
                let found = a.0.mean_product(&b.0, dim);
                assert!(found.low - 1e-14 <= expected && expected <= found.high + 1e-14);
                assert!(radius > 0.0 || found.high - found.low < 1e-13);
            }
        }
    }

    /// The error of the values at the points is larger between them: in the middle of a triangle 5/3 of it.
    #[test]
    fn a_part_is_off_by_more_than_the_points() {
        let third = 1.0 / 3.0;
        let mut piece = [[0.0; 4]; 4];
        (piece[0][0], piece[1][1]) = (1.0, 1.0);
        piece[2] = [third, third, third, 0.0];
        // The signs of P2's functions there.
        let mut field = Quadratic::<2>::ZERO;
        field.corners = [[-1.0; 2]; 4];
        field.middles = [[1.0; 2]; 6];
        let worst = field.at(&piece[2], 2)[0];
        assert!((worst - 5.0 / 3.0).abs() < 1e-14);
        let mut unknown = Quadratic::<2>::ZERO;
        (unknown.off, unknown.size) = ([1.0; 2], [1.0; 2]);
        assert!(unknown.on(&piece, 2).off.iter().all(|off| *off >= worst));
    }
}
