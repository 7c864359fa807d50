//! Algebraic multigrid by smoothed aggregation (P. Vaněk, J. Mandel, M. Brezina, Computing 56, 1996): a hierarchy of
//! coarser matrices for a symmetric positive definite one, and the V-cycle on it.
//!
//! ```text
//! strong:   |a_ij| > θ_l √(a_ii a_jj),  θ_l = 0.08 · 2⁻ˡ
//! P = (I - ω D⁻¹ A_F) T,  A_c = Pᵀ A P
//! ```
//!
//! T is 1 on each aggregate; A_F is A with the weak entries lumped to the diagonal; ω = 2/3 for a
//! spectral radius of D⁻¹A_F up to 2.

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Mat, MatMut};

use super::csr::Csr;
use super::kernels::{clear_registers, clear_registers_everywhere};
use super::sweeps::Sweeps;

const STRONG: f64 = 0.08;
/// θ_l over that of the level above.
const WEAKER: f64 = 0.5;
const OMEGA: f64 = 2.0 / 3.0;
/// Matrices of this size are solved directly.
const COARSEST: usize = 500;
/// Coarsening that leaves more than this part of the rows is given up.
const LEAST_PROGRESS: f64 = 0.9;

/// The hierarchy.
pub struct Amg {
    levels: Vec<Level>,
    coarsest: PartialPivLu<f64>,
    /// Right-hand side and solution on the coarsest level.
    bottom: [Vec<f64>; 2],
}

struct Level {
    sweeps: Sweeps,
    prolongation: Csr<f32>,
    restriction: Csr<f32>,
    /// Right-hand side of this level, its solution, which is what is left of b on the way down, and what that was before the
    /// backward sweep.
    b: Vec<f64>,
    x: Vec<f64>,
    old: Vec<f64>,
}

impl Amg {
    /// None if a diagonal entry is not positive, or if the matrix does not coarsen and is too
    /// large to be solved directly.
    pub fn new(matrix: Csr) -> Option<Self> {
        Amg::below(matrix, STRONG)
    }

    /// The same where ties are strong above `threshold`.
    fn below(mut matrix: Csr, mut threshold: f64) -> Option<Self> {
        let _span = tracing::debug_span!("multigrid set-up", whole = true).entered();
        let mut levels = Vec::new();
        while matrix.rows() > COARSEST {
            let n = matrix.rows();
            let Some(coarser) = Coarser::new(&matrix, threshold)? else {
                break;
            };
            levels.push(Level {
                sweeps: Sweeps::new(std::mem::replace(&mut matrix, coarser.matrix)),
                prolongation: coarser.prolongation.narrow(),
                restriction: coarser.restriction.narrow(),
                b: vec![0.0; n],
                x: vec![0.0; n],
                old: vec![0.0; n],
            });
            threshold *= WEAKER;
        }
        let n = matrix.rows();
        let mut dense = Mat::<f64>::zeros(n, n);
        for i in 0..n {
            for (j, a) in matrix.row(i) {
                dense[(i, j as usize)] += a;
            }
        }
        let coarsest = dense.partial_piv_lu();
        clear_registers_everywhere();
        Some(Amg {
            levels,
            coarsest,
            bottom: [vec![0.0; n], vec![0.0; n]],
        })
    }

    /// Where the right-hand side of the next cycle belongs.
    pub fn rhs(&mut self) -> &mut [f64] {
        match self.levels.first_mut() {
            Some(level) => &mut level.b,
            None => &mut self.bottom[0],
        }
    }

    /// The result of the last cycle.
    pub fn solution(&self) -> &[f64] {
        match self.levels.first() {
            Some(level) => &level.x,
            None => &self.bottom[1],
        }
    }

    /// One V-cycle from zero, with a forward sweep of Gauss and Seidel down and a backward one up,
    /// which makes it symmetric.
    pub fn cycle(&mut self) {
        let transfers = |level: &Level| level.restriction.bytes() + level.prolongation.bytes();
        let bytes: usize = self.levels.iter().map(transfers).sum();
        let _span = tracing::debug_span!("multigrid", whole = true, bytes).entered();
        for l in 0..self.levels.len() {
            let (above, below) = self.levels.split_at_mut(l + 1);
            let level = &mut above[l];
            level.sweeps.forward(&level.b, &mut level.old, &mut level.x);
            let coarse = below.first_mut().map_or(&mut self.bottom[0], |c| &mut c.b);
            level.restriction.times(&level.x, coarse);
        }
        let [b, x] = &mut self.bottom;
        x.copy_from_slice(b);
        let n = x.len();
        let x = MatMut::from_column_major_slice_mut(x, n, 1);
        self.coarsest.solve_in_place(x);
        clear_registers();
        for l in (0..self.levels.len()).rev() {
            let (above, below) = self.levels.split_at_mut(l + 1);
            let level = &mut above[l];
            let coarse = below.first().map_or(&self.bottom[1], |c| &c.x);
            level.prolongation.add_times(coarse, &mut level.old);
            level.sweeps.backward(&level.b, &level.old, &mut level.x);
        }
    }
}

/// The next level below a matrix.
pub struct Coarser {
    /// P
    pub prolongation: Csr,
    /// Pᵀ
    restriction: Csr,
    /// PᵀAP
    matrix: Csr,
}

impl Coarser {
    /// None if a diagonal entry is not positive, or if the matrix does not coarsen and is large; none inside where that is small
    /// enough to be solved directly.
    fn new(matrix: &Csr, threshold: f64) -> Option<Option<Self>> {
        let diagonal = matrix.diagonal();
        if diagonal.iter().any(|d| !(*d > 0.0)) {
            return None;
        }
        let strength = Strength {
            matrix,
            diagonal: &diagonal,
            threshold,
        };
        let prolongation = strength.prolongation();
        let n = matrix.rows();
        if prolongation.columns() as f64 > LEAST_PROGRESS * n as f64 {
            return (n <= 10 * COARSEST).then_some(None);
        }
        let restriction = prolongation.transpose();
        let matrix = restriction.product(&matrix.product(&prolongation));
        Some(Some(Coarser {
            prolongation,
            restriction,
            matrix,
        }))
    }

    /// The first level below a matrix that is not solved directly.
    pub fn first(matrix: &Csr) -> Option<Option<Self>> {
        match matrix.rows() > COARSEST {
            true => Coarser::new(matrix, STRONG),
            false => Some(None),
        }
    }

    /// The hierarchy from that level down.
    pub fn hierarchy(self) -> Option<Amg> {
        Amg::below(self.matrix, WEAKER * STRONG)
    }
}

struct Strength<'a> {
    matrix: &'a Csr,
    diagonal: &'a [f64],
    threshold: f64,
}

const NONE: u32 = u32::MAX;

impl Strength<'_> {
    fn is_strong(&self, i: usize, j: u32, a: f64) -> bool {
        let j = j as usize;
        let limit = self.threshold * self.threshold * self.diagonal[i] * self.diagonal[j];
        j != i && a * a > limit
    }

    fn strong(&self, i: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let row = self.matrix.row(i);
        row.filter(move |&(j, a)| self.is_strong(i, j, a))
    }

    /// The aggregate of each index, and their number. Indices without strong neighbours belong to none:
    /// only the sweeps solve for them.
    fn aggregates(&self) -> (Vec<u32>, usize) {
        let n = self.matrix.rows();
        let mut of = vec![NONE; n];
        let mut count = 0;
        // Whole neighbourhoods of which nothing is taken yet.
        for i in 0..n {
            let mut near = self.strong(i).peekable();
            if of[i] != NONE || near.peek().is_none() {
                continue;
            }
            if near.all(|(j, _)| of[j as usize] == NONE) {
                of[i] = count;
                for (j, _) in self.strong(i) {
                    of[j as usize] = count;
                }
                count += 1;
            }
        }
        // What is left goes to the neighbour of the strongest tie, as these were now.
        let first = of.clone();
        for i in (0..n).filter(|&i| first[i] == NONE) {
            let taken = self.strong(i).filter(|&(j, _)| first[j as usize] != NONE);
            if let Some((j, _)) = taken.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())) {
                of[i] = first[j as usize];
            }
        }
        // And those that touch none of them make separate aggregates.
        for i in 0..n {
            if of[i] != NONE || self.strong(i).next().is_none() {
                continue;
            }
            of[i] = count;
            for (j, _) in self.strong(i) {
                if of[j as usize] == NONE {
                    of[j as usize] = count;
                }
            }
            count += 1;
        }
        (of, count as usize)
    }

    /// (I - ω D_F⁻¹ A_F) T
    fn prolongation(&self) -> Csr {
        let (of, count) = self.aggregates();
        let add = |i: usize, part: &mut Csr| {
            let own = of[i];
            let row = self.matrix.row(i);
            let weak = row.filter(|&(j, a)| j as usize != i && !self.is_strong(i, j, a));
            let lumped = self.diagonal[i] + weak.map(|(_, a)| a).sum::<f64>();
            // Lumping may leave nothing where weak entries outweigh the diagonal.
            let diagonal = if lumped > 0.0 {
                lumped
            } else {
                self.diagonal[i]
            };
            let entries = std::iter::once((own, 1.0 - OMEGA)).chain(
                self.strong(i)
                    .map(|(j, a)| (of[j as usize], -OMEGA * a / diagonal)),
            );
            part.push(entries.filter(|(aggregate, _)| *aggregate != NONE));
        };
        let n = of.len();
        Csr::by_chunks(
            n,
            count,
            || (),
            |(), rows, part| rows.for_each(|i| add(i, part)),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The five-point Laplacian of an n × n grid, with `across` as the weight of one direction.
    fn laplacian(n: usize, across: f64) -> Csr {
        let mut matrix = Csr::empty(n * n);
        for i in 0..n {
            for j in 0..n {
                let at = |i: usize, j: usize| (i * n + j) as u32;
                let mut row = vec![(at(i, j), 2.0 + 2.0 * across)];
                if j > 0 {
                    row.push((at(i, j - 1), -1.0));
                }
                if j + 1 < n {
                    row.push((at(i, j + 1), -1.0));
                }
                if i > 0 {
                    row.push((at(i - 1, j), -across));
                }
                if i + 1 < n {
                    row.push((at(i + 1, j), -across));
                }
                matrix.push(row);
            }
        }
        matrix
    }

    fn times(matrix: &Csr, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        matrix.times(x, &mut y);
        y
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    /// The error of x ← x + B (b - A x) after 8 cycles, to that at the start, in the energy norm.
    fn reduction(matrix: &Csr) -> f64 {
        let mut hierarchy = Amg::new(matrix.clone()).unwrap();
        let mut error: Vec<f64> = (0..matrix.rows()).map(|k| ((k * k) as f64).sin()).collect();
        let energy = |v: &[f64]| dot(&times(matrix, v), v);
        let start = energy(&error);
        for _ in 0..8 {
            hierarchy.rhs().copy_from_slice(&times(matrix, &error));
            hierarchy.cycle();
            for (e, d) in error.iter_mut().zip(hierarchy.solution()) {
                *e -= d;
            }
        }
        (energy(&error) / start).sqrt()
    }

    #[test]
    fn cycles_contract_whatever_the_size_and_the_direction() {
        for (n, across) in [(20, 1.0), (40, 1.0), (120, 1.0), (60, 1e-3), (60, 1e3)] {
            let found = reduction(&laplacian(n, across));
            assert!(found < 0.6_f64.powi(8), "{n} {across}: {found}");
        }
    }

    #[test]
    fn a_cycle_is_symmetric() {
        let matrix = laplacian(30, 1.0);
        let mut hierarchy = Amg::new(matrix.clone()).unwrap();
        let mut apply = |b: &[f64]| {
            hierarchy.rhs().copy_from_slice(b);
            hierarchy.cycle();
            hierarchy.solution().to_vec()
        };
        let b: Vec<f64> = (0..matrix.rows()).map(|k| (k as f64).sin()).collect();
        let c: Vec<f64> = (0..matrix.rows()).map(|k| (k as f64).cos()).collect();
        let (left, right) = (dot(&apply(&b), &c), dot(&b, &apply(&c)));
        assert!((left - right).abs() < 1e-12 * left.abs().max(1.0));
    }

    #[test]
    fn what_is_not_positive_is_refused() {
        let mut matrix = Csr::empty(600);
        for k in 0..600 {
            matrix.push([(k, f64::from(k % 2))]);
        }
        assert!(Amg::new(matrix).is_none());
    }
}
