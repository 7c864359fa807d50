//! Dense systems.

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Mat, MatRef};

/// A dense square matrix.
#[derive(Debug, Clone)]
pub struct Dense(pub(super) Mat<f64>);

/// Its factorisation with partial pivoting.
pub struct DenseLu(PartialPivLu<f64>);

/// Σ_r l_r m_rᵀ, a change of a matrix in few rows and columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LowRank {
    /// l_r and m_r by (index, value).
    terms: Vec<[Vec<(u32, f64)>; 2]>,
}

impl Dense {
    pub fn zeros(n: usize) -> Self {
        Dense(Mat::zeros(n, n))
    }

    pub fn size(&self) -> usize {
        self.0.nrows()
    }

    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        self.0[(i, j)] += value;
    }

    /// y = A x
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.0.nrows()];
        for (j, &xj) in x.iter().enumerate() {
            for (yi, a) in y.iter_mut().zip(self.0.col(j).iter()) {
                *yi += a * xj;
            }
        }
        y
    }

    /// The largest sum of |A_ij| over a column.
    pub fn norm(&self) -> f64 {
        let columns = self.0.col_iter().map(|c| c.iter().map(|a| a.abs()).sum());
        columns.fold(0.0, |largest: f64, sum: f64| largest.max(sum))
    }

    pub fn lu(&self) -> DenseLu {
        DenseLu(self.0.partial_piv_lu())
    }
}

impl LowRank {
    pub fn push(&mut self, l: Vec<(u32, f64)>, m: Vec<(u32, f64)>) {
        self.terms.push([l, m]);
    }

    pub fn rank(&self) -> usize {
        self.terms.len()
    }

    fn left(&self, n: usize) -> Mat<f64> {
        let mut l = Mat::zeros(n, self.rank());
        for (r, [left, _]) in self.terms.iter().enumerate() {
            for &(i, value) in left {
                l[(i as usize, r)] += value;
            }
        }
        l
    }

    /// Mᵀ X
    fn right_times(&self, x: MatRef<f64>) -> Mat<f64> {
        let mut product = Mat::zeros(self.rank(), x.ncols());
        for j in 0..x.ncols() {
            for (r, [_, right]) in self.terms.iter().enumerate() {
                product[(r, j)] = right
                    .iter()
                    .map(|&(i, value)| value * x[(i as usize, j)])
                    .sum();
            }
        }
        product
    }
}

impl DenseLu {
    /// Solves A x = b; not finite where A is singular.
    pub fn solve(&self, b: &[f64]) -> Vec<f64> {
        let mut x = Mat::from_fn(b.len(), 1, |i, _| b[i]);
        self.0.solve_in_place(x.as_mut());
        x.col(0).iter().copied().collect()
    }

    /// The solver of A + L Mᵀ by the formula of Woodbury (1950):
    /// x = z - A⁻¹L (1 + MᵀA⁻¹L)⁻¹ Mᵀz with z = A⁻¹b.
    pub fn changed<'a>(&'a self, change: &'a LowRank, n: usize) -> impl Fn(&[f64]) -> Vec<f64> {
        let mut columns = change.left(n);
        self.0.solve_in_place(columns.as_mut());
        let mut capacity = change.right_times(columns.as_ref());
        for r in 0..change.rank() {
            capacity[(r, r)] += 1.0;
        }
        let capacity = (change.rank() > 0).then(|| capacity.partial_piv_lu());
        move |b| {
            let mut z = Mat::from_fn(b.len(), 1, |i, _| b[i]);
            self.0.solve_in_place(z.as_mut());
            if let Some(capacity) = &capacity {
                let mut weights = change.right_times(z.as_ref());
                capacity.solve_in_place(weights.as_mut());
                z -= &columns * weights;
            }
            z.col(0).iter().copied().collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_of_low_rank_needs_no_new_factorisation() {
        let n = 30;
        let mut a = Dense::zeros(n);
        for i in 0..n {
            for j in 0..n {
                a.add(
                    i,
                    j,
                    (7.1 * (i * n + j) as f64).sin() + if i == j { 9.0 } else { 0.0 },
                );
            }
        }
        let lu = a.lu();
        let mut change = LowRank::default();
        for r in 0..4 {
            let l = vec![(r, 2.0), (r + 9, -1.0)];
            let m = vec![(2 * r, 0.5), (2 * r + 1, f64::from(r))];
            for &(i, x) in &l {
                for &(j, y) in &m {
                    a.add(i as usize, j as usize, x * y);
                }
            }
            change.push(l, m);
        }
        let b: Vec<f64> = (0..n).map(|k| (k as f64).cos()).collect();
        let x = lu.changed(&change, n)(&b);
        for (y, b) in a.times(&x).iter().zip(&b) {
            assert!((y - b).abs() < 1e-13);
        }
        assert_eq!(lu.changed(&LowRank::default(), n)(&b), lu.solve(&b));
    }
}
