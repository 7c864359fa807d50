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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{CR, Element, P1, Space};
    use crate::scene::Scene;

    #[test]
    fn products_are_those_of_the_matrices() {
        for scene in ["l-shape", "one-zone-3d"] {
            let mesh = Scene::find(scene).unwrap().triangulation(Some(4)).unwrap();
            for element in [&P1 as &dyn Element, &CR] {
                let space = Space::new(&mesh, element);
                let stiffness = Stiffness::new(&space);
                assert!(stiffness.is_graph);
                let mut random = crate::Random::new(5);
                let u: Vec<f64> = (0..space.dofs).map(|_| random.next()).collect();
                let (mut expected, mut sizes) = (vec![0.0; space.dofs], vec![0.0; space.dofs]);
                stiffness.for_each(0..mesh.cell_count(), |i, j, value| {
                    expected[i as usize] += value * u[j as usize];
                    sizes[i as usize] += value.abs();
                });
                let found = stiffness.times(&u);
                for ((found, expected), size) in found.iter().zip(expected).zip(sizes) {
                    assert!(
                        (found - expected).abs() <= 1e-14 * size,
                        "{found} {expected}"
                    );
                }
            }
        }
    }
}
