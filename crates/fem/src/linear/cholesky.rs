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

use super::plan::Plan;
use super::{Analysis, Elements, Role, Schur, Symmetric};
use faceoff_mesh::error::{Error, Result};

/// P A Pᵀ = L Lᵀ of a symmetric positive definite matrix, the kept unknowns last.
pub struct Cholesky {
    symbolic: SymbolicCholesky<u32>,
    values: Vec<f64>,
    /// The unknowns that are not fixed, ascending: the rows of the matrix.
    unknowns: Vec<u32>,
    /// Rows of the kept unknowns.
    kept: Vec<u32>,
    schur: Schur,
}

/// A right-hand side and the solution with it.
#[derive(Clone)]
pub struct Solved {
    b: Vec<f64>,
    x: Vec<f64>,
    /// The right-hand side of the Schur complement.
    pub kept: Vec<f64>,
    /// The energy that is left with the kept unknowns at 0.
    pub energy: f64,
}

impl Cholesky {
    /// Factors the sum of the elements in the order of `analysis`, which keeps no more than it has to.
    ///
    /// # Errors
    /// A matrix that is not positive definite or has too many entries, or memory that is not there.
    pub fn new(elements: &impl Elements, roles: &[Role], analysis: Analysis) -> Result<Self> {
        let matrix = Symmetric::new(elements, roles)?;
        let unknowns: Vec<u32> = (0..roles.len() as u32)
            .filter(|&k| roles[k as usize] != Role::Fixed)
            .collect();
        let mut rows = vec![0; roles.len()];
        for (row, &k) in unknowns.iter().enumerate() {
            rows[k as usize] = row as u32;
        }
        let row_of = |k: &u32| rows[*k as usize];
        let order = analysis.order.iter().chain(&analysis.kept);
        let kept: Vec<u32> = analysis.kept.iter().map(row_of).collect();
        let order: Vec<u32> = order.map(row_of).collect();
        let (symbolic, values) = factor(&matrix, order)?;
        let mut dense = schur_complement(&symbolic, &values, kept.len());
        // What the elements aside give is sparse; where there is more, S is dense.
        let aside = analysis.aside(elements);
        for &(i, j, value) in &aside {
            dense[(i as usize, j as usize)] -= value;
        }
        let on = |(_, border): &(Plan, Vec<u32>)| {
            let place = |i: usize| border[i] as usize;
            let dense = Mat::from_fn(border.len(), border.len(), |i, j| {
                dense[(place(i), place(j))]
            });
            (border.clone(), dense)
        };
        let blocks = analysis.blocks.iter().map(on).collect();
        let schur = Schur::new(analysis.kept, blocks, aside, analysis.lu);
        Ok(Cholesky {
            symbolic,
            values,
            unknowns,
            kept,
            schur,
        })
    }

    /// S of the kept unknowns.
    pub fn schur_complement(&self) -> &Schur {
        &self.schur
    }

    /// Solves with the factor from the leaves up to the kept unknowns.
    pub fn forward(&self, b: &[f64]) -> Solved {
        let b: Vec<f64> = self.unknowns.iter().map(|&k| b[k as usize]).collect();
        let mut x = b.clone();
        self.solve(&mut x);
        let on_kept: Vec<f64> = self.kept.iter().map(|&k| x[k as usize]).collect();
        let kept = self.schur.times(&on_kept);
        let product = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let energy = (product(&b, &x) - product(&kept, &on_kept)).max(0.0);
        Solved { b, x, kept, energy }
    }

    /// The solution with the kept unknowns at `kept`, in `x`; fixed ones are left as they are.
    pub fn backward(&self, solved: Solved, kept: &[f64], x: &mut [f64]) {
        let mut y = solved.x;
        if !kept.is_empty() {
            // The forces that hold the kept unknowns there: S u - g.
            y = solved.b;
            let forces = self.schur.times(kept);
            for ((&k, force), g) in self.kept.iter().zip(forces).zip(&solved.kept) {
                y[k as usize] += force - g;
            }
            self.solve(&mut y);
            for (&k, value) in self.kept.iter().zip(kept) {
                y[k as usize] = *value;
            }
        }
        for (&k, value) in self.unknowns.iter().zip(&y) {
            x[k as usize] = *value;
        }
    }

    /// Solves A x = b in place.
    fn solve(&self, b: &mut [f64]) {
        let n = self.symbolic.nrows();
        let mut memory = MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        LltRef::<u32, f64>::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(b, n, 1),
            Par::Seq,
            MemStack::new(&mut memory),
        );
    }
}

fn factor(matrix: &Symmetric, order: Vec<u32>) -> Result<(SymbolicCholesky<u32>, Vec<f64>)> {
    let refuse = |what: String| Error::Solver {
        what,
        remedy:
            "check that Γ_D (or contact) fixes every connected part, and that no cell is degenerate"
                .into(),
    };
    let mut inverse = vec![0; order.len()];
    for (position, &row) in order.iter().enumerate() {
        inverse[row as usize] = position as u32;
    }
    let permutation = Perm::new_checked(order.into(), inverse.into(), matrix.n);
    let pattern = SymbolicSparseColMatRef::new_checked(
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
    let symbolic = factorize_symbolic_cholesky(
        pattern,
        Side::Lower,
        SymmetricOrdering::Custom(permutation.as_ref()),
        parameters,
    )
    .map_err(|e| refuse(format!("the factor cannot be laid out: {e:?}")))?;
    let mut values = vec![0.0; symbolic.len_val()];
    let scratch = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
    let mut memory = MemBuffer::try_new(scratch)
        .map_err(|e| refuse(format!("no memory for the factorisation: {e:?}")))?;
    symbolic
        .factorize_numeric_llt::<f64>(
            &mut values,
            SparseColMatRef::new(pattern, &matrix.values),
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
    Ok((symbolic, values))
}

/// S = L₂₂ L₂₂ᵀ, where L₂₂ is the trailing block of the factor with `last` rows.
fn schur_complement(symbolic: &SymbolicCholesky<u32>, values: &[f64], last: usize) -> Mat<f64> {
    let first = symbolic.nrows() - last;
    let mut factor = Mat::<f64>::zeros(last, last);
    match symbolic.raw() {
        SymbolicCholeskyRaw::Supernodal(symbolic) => {
            let supernodes = SupernodalLltRef::<u32, f64>::new(symbolic, values);
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
                        factor[(row as usize - first, column)] = block[(block.ncols() + i, j)];
                    }
                }
            }
        }
        SymbolicCholeskyRaw::Simplicial(symbolic) => {
            let (starts, rows) = (symbolic.col_ptr(), symbolic.row_idx());
            for column in first..first + last {
                for k in starts[column] as usize..starts[column + 1] as usize {
                    factor[(rows[k] as usize - first, column - first)] = values[k];
                }
            }
        }
    }
    &factor * factor.transpose()
}
