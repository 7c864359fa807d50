//! Sparse Cholesky factorisation by faer, and the Schur complement it holds.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::Perm;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, Mat, MatMut, Par, Side};

use super::{Dense, Symmetric};
use crate::error::{Error, Result};

/// P A Pᵀ = L Lᵀ of a symmetric positive definite matrix.
pub struct Cholesky {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
}

impl Cholesky {
    /// Factors `matrix`, eliminating in `order`.
    ///
    /// # Errors
    /// A matrix that is not positive definite, or memory that is not there.
    pub fn factor(matrix: &Symmetric, order: &[usize]) -> Result<Self> {
        let refuse = |what: String| {
            Error::Solver {
            what,
            remedy: "check that Γ_D (or contact) fixes every connected part, and that no cell is degenerate".into(),
        }
        };
        let mut inverse = vec![0; order.len()];
        for (position, &index) in order.iter().enumerate() {
            inverse[index] = position;
        }
        let permutation = Perm::new_checked(order.into(), inverse.into(), matrix.n);
        let symbolic = SymbolicSparseColMatRef::new_checked(
            matrix.n,
            matrix.n,
            &matrix.starts,
            None,
            &matrix.rows,
        );
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let structure = factorize_symbolic_cholesky(
            symbolic,
            Side::Lower,
            SymmetricOrdering::Custom(permutation.as_ref()),
            parameters,
        )
        .map_err(|e| refuse(format!("the factor cannot be laid out: {e:?}")))?;
        let mut values = vec![0.0; structure.len_val()];
        let mut memory = MemBuffer::try_new(
            structure.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()),
        )
        .map_err(|e| refuse(format!("no memory for the factorisation: {e:?}")))?;
        structure
            .factorize_numeric_llt::<f64>(
                &mut values,
                SparseColMatRef::new(symbolic, &matrix.values),
                Side::Lower,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .map_err(|e| {
                refuse(format!(
                    "the stiffness matrix is not positive definite: {e:?}"
                ))
            })?;
        Ok(Cholesky {
            symbolic: structure,
            values,
        })
    }

    /// Solves A x = b in place.
    pub fn solve(&self, b: &mut [f64]) {
        let n = self.symbolic.nrows();
        let mut memory = MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        LltRef::<usize, f64>::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(b, n, 1),
            Par::Seq,
            MemStack::new(&mut memory),
        );
    }

    /// The Schur complement of the `last` indices eliminated last: S = L₂₂ L₂₂ᵀ, where L₂₂ is
    /// the trailing block of the factor.
    pub fn schur_complement(&self, last: usize) -> Dense {
        let first = self.symbolic.nrows() - last;
        let mut factor = Mat::<f64>::zeros(last, last);
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(symbolic) => {
                let supernodes = SupernodalLltRef::<usize, f64>::new(symbolic, &self.values);
                for s in 0..symbolic.n_supernodes() {
                    let supernode = supernodes.supernode(s);
                    let (start, block) = (supernode.start(), supernode.val());
                    for j in 0..block.ncols() {
                        if start + j < first {
                            continue;
                        }
                        let column = start + j - first;
                        for i in j..block.ncols() {
                            factor[(start + i - first, column)] = block[(i, j)];
                        }
                        for (i, &row) in supernode.pattern().iter().enumerate() {
                            factor[(row - first, column)] = block[(block.ncols() + i, j)];
                        }
                    }
                }
            }
            SymbolicCholeskyRaw::Simplicial(symbolic) => {
                let (starts, rows) = (symbolic.col_ptr(), symbolic.row_idx());
                for column in first..first + last {
                    for k in starts[column]..starts[column + 1] {
                        factor[(rows[k] - first, column - first)] = self.values[k];
                    }
                }
            }
        }
        Dense(&factor * factor.transpose())
    }

    /// Number of rows.
    pub fn size(&self) -> usize {
        self.symbolic.nrows()
    }

    /// Entries of the factor.
    pub fn entries(&self) -> usize {
        self.values.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::{SymmetricBuilder, nested_dissection};

    /// The Laplacian of a path with random weights, diagonally dominant.
    fn path(n: usize) -> Symmetric {
        let mut builder = SymmetricBuilder::new(n, 0);
        for k in 0..n as u32 {
            builder.add(k, k, 2.5 + f64::from(k % 7));
            if k > 0 {
                builder.add(k, k - 1, -1.0);
            }
            if k > 9 {
                builder.add(k, k - 10, -0.1 * f64::from(k % 3));
            }
        }
        builder.build()
    }

    #[test]
    fn it_solves_and_its_trailing_block_is_the_schur_complement() {
        let n = 300;
        let matrix = path(n);
        let points: Vec<_> = (0..n).map(|k| [k as f64, 0.0, 0.0]).collect();
        let last: Vec<bool> = (0..n).map(|k| k % 60 == 3).collect();
        let order = nested_dissection(&points, &matrix.graph(), &last);
        let cholesky = Cholesky::factor(&matrix, &order).unwrap();
        let x: Vec<f64> = (0..n).map(|k| (k as f64).sin()).collect();
        let mut b = matrix.times(&x);
        cholesky.solve(&mut b);
        for (a, b) in x.iter().zip(&b) {
            assert!((a - b).abs() < 1e-13);
        }
        // S⁻¹ is the block of A⁻¹.
        let marked: Vec<usize> = (0..n).filter(|&k| last[k]).collect();
        let lu = cholesky.schur_complement(marked.len()).lu();
        for (column, &index) in marked.iter().enumerate() {
            let mut unit = vec![0.0; n];
            unit[index] = 1.0;
            cholesky.solve(&mut unit);
            let mut short = vec![0.0; marked.len()];
            short[column] = 1.0;
            for (s, &k) in lu.solve(&short).iter().zip(&marked) {
                assert!((s - unit[k]).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn an_indefinite_matrix_is_refused() {
        let mut builder = SymmetricBuilder::new(2, 0);
        builder.add(0, 0, 1.0);
        builder.add(1, 1, -1.0);
        assert!(Cholesky::factor(&builder.build(), &[0, 1]).is_err());
    }
}
