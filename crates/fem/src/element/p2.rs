//! The quadratic Lagrange element.

use super::{Basis, DofEntities, Element, MAX_DOFS};
use faceoff_mesh::mesh::local_edges;

/// φ_i = λ_i (2λ_i - 1) at vertex i; φ_ab = 4 λ_a λ_b at the midpoint of edge ab.
pub struct Quadratic;

impl Element for Quadratic {
    fn name(&self) -> &'static str {
        "P2"
    }

    fn degree(&self) -> usize {
        2
    }

    fn on(&self) -> DofEntities {
        DofEntities {
            vertices: true,
            edges: true,
            faces: false,
        }
    }

    fn values(&self, dim: usize, lambda: &[f64; 4]) -> Basis {
        let mut values = [0.0; MAX_DOFS];
        for i in 0..=dim {
            values[i] = lambda[i] * (2.0 * lambda[i] - 1.0);
        }
        for (value, &[a, b]) in values[dim + 1..].iter_mut().zip(local_edges(dim)) {
            *value = 4.0 * lambda[a] * lambda[b];
        }
        values
    }

    fn derivatives(&self, dim: usize, lambda: &[f64; 4]) -> [[f64; 4]; MAX_DOFS] {
        let mut derivatives = [[0.0; 4]; MAX_DOFS];
        for i in 0..=dim {
            derivatives[i][i] = 4.0 * lambda[i] - 1.0;
        }
        for (row, &[a, b]) in derivatives[dim + 1..].iter_mut().zip(local_edges(dim)) {
            row[a] = 4.0 * lambda[b];
            row[b] = 4.0 * lambda[a];
        }
        derivatives
    }
}
