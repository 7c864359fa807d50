//! A preconditioner for a space that contains a smaller one, whose matrix coarsens well.
//!
//! P1 lies in CR (and in P2): with E the values of a P1 function at the dofs, EᵀAE is the P1
//! matrix exactly. So
//!
//! ```text
//! forward sweep on the dofs,  V-cycle on Eᵀ(b - A x),  backward sweep
//! ```
//!
//! contracts whatever the size of the mesh: the sweeps reduce what P1 does not see. Rows that are not swept are solved for as one
//! block before and after the V-cycle.

use super::amg::{Amg, Coarser};
use super::csr::Csr;
use super::pool::zeros;
use super::sweeps::Sweeps;

/// Changes x where its rows are solved for as one block; gets b and x.
pub type Relax<'a> = &'a dyn Fn(&[f64], &mut [f64]);

/// The embedding and the hierarchy below.
pub struct Embedded {
    embedding: Csr<f32>,
    restriction: Csr<f32>,
    coarse: Amg,
    /// x before the backward sweep.
    old: Vec<f64>,
}

impl Embedded {
    /// `embedding`: dofs × coarse unknowns; `coarse`: the coarse matrix, EᵀAE. None if it does not
    /// coarsen or is not positive. Where coarse unknowns are dofs themselves, the sweeps on these are the first level's.
    pub fn new(embedding: Csr<f32>, coarse: Csr) -> Option<Self> {
        let are_dofs = embedding.entries() == embedding.columns();
        let below = if are_dofs {
            Coarser::first(&coarse)?
        } else {
            None
        };
        let (embedding, coarse) = match below {
            Some(below) => (
                embedding.product(&below.prolongation).narrow(),
                below.hierarchy()?,
            ),
            None => (embedding, Amg::new(coarse)?),
        };
        Some(Embedded {
            old: zeros(embedding.rows()),
            restriction: embedding.transpose(),
            coarse,
            embedding,
        })
    }

    /// x ≈ A⁻¹ b, and the product A x where it is wanted; `relax_block` is for rows that are not swept.
    pub fn apply(
        &mut self,
        sweeps: &Sweeps,
        b: &[f64],
        x: &mut [f64],
        product: Option<&mut [f64]>,
        relax_block: Option<Relax>,
    ) {
        // Until the backward sweep x is what is left.
        let old = &mut self.old;
        sweeps.forward(b, old, x);
        if let Some(relax_block) = relax_block {
            relax_block(b, old);
            sweeps.matrix().residual(b, old, x);
        }
        let transfer = |bytes: usize| tracing::debug_span!("P1 and back", bytes).entered();
        let vectors = 8 * (self.embedding.rows() + self.embedding.columns());
        let span = transfer(self.restriction.bytes() + vectors);
        self.restriction.times(x, self.coarse.rhs());
        drop(span);
        self.coarse.cycle();
        let span = transfer(self.embedding.bytes() + vectors);
        self.embedding.add_times(self.coarse.solution(), old);
        drop(span);
        if let Some(relax_block) = relax_block {
            relax_block(b, old);
        }
        sweeps.backward(b, old, x);
        if let Some(product) = product {
            sweeps.product(b, x, old, product);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::dot;

    /// Where coarse unknowns are the unknowns themselves, except some that are constrained, sweeps and the rest of the hierarchy make
    /// cycles that contract.
    #[test]
    fn a_hierarchy_of_its_own_goes_on_below_the_sweeps() {
        let held = |i: usize| i.is_multiple_of(97);
        for n in [10, 60, 120] {
            let (mut matrix, mut number, mut count) = (Csr::empty(n * n), Vec::new(), 0);
            for i in 0..n * n {
                let (row, column) = (i / n, i % n);
                let near = [
                    (row > 0).then(|| i - n),
                    (column > 0).then(|| i - 1),
                    (column + 1 < n).then(|| i + 1),
                    (row + 1 < n).then(|| i + n),
                ];
                let near = near.into_iter().flatten().filter(|_| !held(i));
                let near = near.filter(|j| !held(*j)).map(|j| (j as u32, -1.0));
                matrix.push(near.chain([(i as u32, 4.0)]));
                number.push((!held(i)).then_some(count));
                count += u32::from(!held(i));
            }
            let rows = |(): &mut (), rows: std::ops::Range<usize>, part: &mut Csr<f32>| {
                rows.for_each(|i| part.end_row(number[i].map(|k| (k, 1.0))));
            };
            let embedding = Csr::by_chunks(n * n, count as usize, || (), rows);
            let coarse = matrix.submatrix(&number);
            let mut embedded = Embedded::new(embedding, coarse).unwrap();
            assert!(embedded.embedding.columns() < n * n / 2 || n == 10);
            let sweeps = Sweeps::new(matrix.clone());
            let mut error: Vec<f64> = (0..n * n).map(|k| ((k * k) as f64).sin()).collect();
            let times = |x: &[f64]| {
                let mut y = vec![0.0; n * n];
                matrix.times(x, &mut y);
                y
            };
            let start = dot(&times(&error), &error);
            let mut change = vec![0.0; n * n];
            for _ in 0..8 {
                embedded.apply(&sweeps, &times(&error), &mut change, None, None);
                error.iter_mut().zip(&change).for_each(|(e, d)| *e -= d);
            }
            let found = (dot(&times(&error), &error) / start).sqrt();
            assert!(found < 0.6_f64.powi(8), "{n}: {found}");
        }
    }
}
