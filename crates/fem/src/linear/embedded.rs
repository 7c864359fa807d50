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
    residual: Vec<f64>,
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
            residual: zeros(embedding.rows()),
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
        let residual = &mut self.residual;
        sweeps.forward(b, x, residual);
        if let Some(relax_block) = relax_block {
            relax_block(b, x);
            sweeps.matrix().residual(b, x, residual);
        }
        let transfer = |bytes: usize| tracing::debug_span!("P1 and back", bytes).entered();
        let vectors = 8 * (self.embedding.rows() + self.embedding.columns());
        let span = transfer(self.restriction.bytes() + vectors);
        self.restriction.times(residual, self.coarse.rhs());
        drop(span);
        self.coarse.cycle();
        let span = transfer(self.embedding.bytes() + vectors);
        self.embedding.add_times(self.coarse.solution(), x);
        drop(span);
        if let Some(relax_block) = relax_block {
            relax_block(b, x);
        }
        sweeps.backward(b, x, residual);
        if let Some(product) = product {
            sweeps.product(b, x, residual, product);
        }
    }
}
