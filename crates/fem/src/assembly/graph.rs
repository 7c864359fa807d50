//! Products with the matrices of P1 and of Crouzeix and Raviart, which are those of a graph: the row of i has Σ_j c_ij (u_i - u_j).

use super::{Stiffness, add_over_cells};

impl Stiffness<'_> {
    /// A u on cells with L corners, into `y`.
    pub(super) fn times_graph<const L: usize>(&self, u: &[f64], y: &mut [f64]) {
        // The same for all pairs, as the elements are symmetric.
        let scale = self
            .pairs
            .first()
            .map_or(0.0, |(i, _, reference)| reference[i * L + i]);
        y.fill(0.0);
        add_over_cells(&self.space, y, |cells, vectors| {
            for (cell, y) in cells.zip(vectors.as_chunks_mut().0) {
                *y = self.cell_times_graph::<L>(cell, scale, u);
            }
        });
    }

    fn cell_times_graph<const L: usize>(&self, cell: usize, scale: f64, u: &[f64]) -> [f64; L] {
        let (mut at, mut y) = ([0.0; L], [0.0; L]);
        for (at, &dof) in at.iter_mut().zip(self.space.cell_dofs(cell)) {
            *at = scale * u[dof as usize];
        }
        // In the order of the pairs, with lengths that are known.
        let weights = self.weights_at(cell);
        let mut pair = 0;
        for j in 0..L {
            for i in 0..j {
                let flux = weights[pair] * (at[i] - at[j]);
                y[i] += flux;
                y[j] -= flux;
                pair += 1;
            }
        }
        y
    }
}
