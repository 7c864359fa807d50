//! Products with the matrix of P2 in a third of the operations that the cells' matrices take.
//!
//! With Bernstein's coefficients b, b_ij = 2 u_ij - (u_i + u_j)/2 for the edge ij, the derivative of u along the edge from j to i is
//! linear with the values c_k = 2 (b_ik - b_jk) at the corners, and the mean of the product of two such is
//! (Σ c_k d_k + Σ c_k Σ d_k) / ((d+1)(d+2)).

use super::{Stiffness, add_over_cells, clear};
use faceoff_mesh::mesh::local_edges;

impl Stiffness<'_> {
    /// A u on cells with V corners and L dofs, into `y`.
    pub(super) fn times_quadratic<const V: usize, const L: usize>(&self, u: &[f64], y: &mut [f64]) {
        clear(y);
        add_over_cells(&self.space, y, |cells, vectors| {
            for (cell, y) in cells.zip(vectors.as_chunks_mut().0) {
                *y = self.cell_times_quadratic::<V, L>(cell, u);
            }
        });
    }

    fn cell_times_quadratic<const V: usize, const L: usize>(
        &self,
        cell: usize,
        u: &[f64],
    ) -> [f64; L] {
        let (edges, scale) = (local_edges(V - 1), 4.0 / (V * (V + 1)) as f64);
        let mut at = [0.0; L];
        for (at, &dof) in at.iter_mut().zip(self.space.cell_dofs(cell)) {
            *at = u[dof as usize];
        }
        let (mut b, mut sum) = ([[0.0; V]; V], [[0.0; V]; V]);
        for i in 0..V {
            b[i][i] = at[i];
        }
        for (&[i, j], middle) in edges.iter().zip(&at[V..]) {
            b[i][j] = 2.0 * middle - 0.5 * (at[i] + at[j]);
            b[j][i] = b[i][j];
        }
        // In the order of the pairs, with lengths that are known.
        let weights = self.weights_at(cell);
        let mut pair = 0;
        for j in 0..V {
            for i in 0..j {
                let c: [f64; V] = std::array::from_fn(|k| b[i][k] - b[j][k]);
                let all: f64 = c.iter().sum();
                let weight = scale * weights[pair];
                for k in 0..V {
                    let product = weight * (c[k] + all);
                    sum[i][k] += product;
                    sum[j][k] -= product;
                }
                pair += 1;
            }
        }
        let mut y = [0.0; L];
        for i in 0..V {
            y[i] = sum[i][i];
        }
        for (e, &[i, j]) in edges.iter().enumerate() {
            let both = sum[i][j] + sum[j][i];
            y[V + e] = 2.0 * both;
            y[i] -= 0.5 * both;
            y[j] -= 0.5 * both;
        }
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{CR, Element, P1, P2, Space};
    use crate::scene::Scene;

    /// These, and those of module `graph`.
    #[test]
    fn products_are_those_of_the_matrices() {
        for scene in ["l-shape", "one-zone-3d"] {
            let mesh = Scene::find(scene).unwrap().triangulation(Some(4)).unwrap();
            for element in [&P1 as &dyn Element, &CR, &P2] {
                let space = Space::new(&mesh, element);
                let stiffness = Stiffness::new(&space);
                assert_eq!(stiffness.is_graph, element.degree() == 1);
                let mut random = crate::Random::new(5);
                let u: Vec<f64> = (0..space.dofs).map(|_| random.next()).collect();
                let (mut expected, mut sizes) = (vec![0.0; space.dofs], vec![0.0; space.dofs]);
                stiffness.for_each(0..mesh.cell_count(), |i, j, value| {
                    expected[i as usize] += value * u[j as usize];
                    sizes[i as usize] += value.abs();
                });
                let found = stiffness.times(&u);
                for ((found, expected), size) in found.iter().zip(expected).zip(sizes) {
                    let off = (found - expected).abs();
                    assert!(off <= 1e-14 * size, "{} {off}", element.name());
                }
            }
        }
    }
}
