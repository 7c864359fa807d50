//! Small dense systems.

use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};

/// A dense square matrix.
#[derive(Debug, Clone)]
pub struct Dense(pub(super) Mat<f64>);

/// Its factorisation with partial pivoting.
pub struct DenseLu(PartialPivLu<f64>);

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

    /// A + B
    pub fn plus(&self, other: &Dense) -> Dense {
        Dense(&self.0 + &other.0)
    }

    /// A - B
    pub fn minus(&self, other: &Dense) -> Dense {
        Dense(&self.0 - &other.0)
    }

    pub fn lu(&self) -> DenseLu {
        DenseLu(self.0.partial_piv_lu())
    }
}

impl DenseLu {
    /// Solves A x = b; not finite where A is singular.
    pub fn solve(&self, b: &[f64]) -> Vec<f64> {
        let mut x = Mat::from_fn(b.len(), 1, |i, _| b[i]);
        self.0.solve_in_place(x.as_mut());
        x.col(0).iter().copied().collect()
    }
}
