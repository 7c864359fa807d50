//! A preconditioner for a space that contains a smaller one, whose matrix coarsens well.
//!
//! P1 lies in CR (and in P2): with E the values of a P1 function at the dofs, EᵀAE is the P1
//! matrix exactly. So
//!
//! ```text
//! forward sweep on the dofs,  V-cycle on Eᵀ(b - A x),  backward sweep
//! ```
//!
//! contracts whatever the size of the mesh: the sweeps reduce what P1 does not see. Rows that no sweep reduces have 0 in the
//! place of their inverse diagonal, and are solved for as one block before and after the V-cycle.

use super::amg::Amg;
use super::csr::{Csr, Sweep};

/// The embedding and the hierarchy below.
pub struct Embedded {
    embedding: Csr,
    restriction: Csr,
    coarse: Amg,
    residual: Vec<f64>,
}

impl Embedded {
    /// `embedding`: dofs × coarse unknowns; `coarse`: the coarse matrix, EᵀAE. None if it does not
    /// coarsen or is not positive.
    pub fn new(embedding: Csr, coarse: Csr) -> Option<Self> {
        Some(Embedded {
            residual: vec![0.0; embedding.rows()],
            restriction: embedding.transpose(),
            coarse: Amg::new(coarse)?,
            embedding,
        })
    }

    /// x ≈ A⁻¹ b; `relax_block` gets b and the x that it is to change.
    pub fn apply(
        &mut self,
        matrix: &Csr,
        inverse_diagonal: &[f64],
        b: &[f64],
        x: &mut [f64],
        relax_block: impl Fn(&[f64], &mut [f64]),
    ) {
        matrix.gauss_seidel_from_zero(inverse_diagonal, b, x);
        relax_block(b, x);
        matrix.residual(b, x, &mut self.residual);
        self.restriction.times(&self.residual, self.coarse.rhs());
        self.coarse.cycle();
        self.embedding.add_times(self.coarse.solution(), x);
        relax_block(b, x);
        matrix.gauss_seidel(inverse_diagonal, b, x, Sweep::Backward);
    }
}
