//! Products with the matrices of P1 and of Crouzeix and Raviart, which are those of a graph: the row of i has Σ_j c_ij (u_i - u_j).

use super::{Stiffness, add_over_cells};

impl Stiffness<'_> {
    /// A u on cells with L corners, into `y`.
    pub(super) fn times_graph<const L: usize>(&self, u: &[f64], y: &mut [f64]) {
        self.over_graph::<L>(u, y, |at, weights, y| {
            for_each_pair::<L>(weights, |weight, i, j| {
                let flux = weight * (at[i] - at[j]);
                y[i] += flux;
                y[j] -= flux;
            });
        });
    }

    /// Σ_j |A_ij u_j|, the entries of each cell counted for themselves, into `y`.
    pub(super) fn sizes_graph<const L: usize>(&self, u: &[f64], y: &mut [f64]) {
        self.over_graph::<L>(u, y, |at, weights, y| {
            let mut own = [0.0; L];
            for_each_pair::<L>(weights, |weight, i, j| {
                own[i] += weight;
                own[j] += weight;
                y[i] += (weight * at[j]).abs();
                y[j] += (weight * at[i]).abs();
            });
            for ((y, own), at) in y.iter_mut().zip(own).zip(at) {
                *y += (own * at).abs();
            }
        });
    }

    /// Σ over the cells of what `form` adds up from u on the cell, scaled, and -|κ| ∇λ_i·∇λ_j of the pairs, into `y`.
    fn over_graph<const L: usize>(
        &self,
        u: &[f64],
        y: &mut [f64],
        form: impl Fn(&[f64; L], &[f64; 6], &mut [f64; L]) + Sync,
    ) {
        // The same for all pairs, as the elements are symmetric.
        let scale = self
            .pairs
            .first()
            .map_or(0.0, |(i, _, reference)| reference[i * L + i]);
        y.fill(0.0);
        add_over_cells(&self.space, y, |cells, vectors| {
            for (cell, y) in cells.zip(vectors.as_chunks_mut().0) {
                let mut at = [0.0; L];
                for (at, &dof) in at.iter_mut().zip(self.space.cell_dofs(cell)) {
                    *at = scale * u[dof as usize];
                }
                *y = [0.0; L];
                form(&at, &self.weights_at(cell), y);
            }
        });
    }
}

/// Visits the pairs i < j of L, in the order of the weights, with lengths that are known.
#[inline(always)]
fn for_each_pair<const L: usize>(weights: &[f64; 6], mut visit: impl FnMut(f64, usize, usize)) {
    let mut pair = 0;
    for j in 0..L {
        for i in 0..j {
            visit(weights[pair], i, j);
            pair += 1;
        }
    }
}
