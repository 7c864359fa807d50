//! The linear Lagrange element.

use super::{Basis, DofEntities, Element, MAX_DOFS};

/// φ_i = λ_i, vertex i.
pub struct Linear;

impl Element for Linear {
    fn name(&self) -> &'static str {
        "P1"
    }

    fn degree(&self) -> usize {
        1
    }

    fn on(&self) -> DofEntities {
        DofEntities {
            vertices: true,
            edges: false,
            faces: false,
        }
    }

    fn values(&self, dim: usize, lambda: &[f64; 4]) -> Basis {
        let mut values = [0.0; MAX_DOFS];
        values[..=dim].copy_from_slice(&lambda[..=dim]);
        values
    }

    fn derivatives(&self, dim: usize, _lambda: &[f64; 4]) -> [[f64; 4]; MAX_DOFS] {
        let mut derivatives = [[0.0; 4]; MAX_DOFS];
        for (i, row) in derivatives.iter_mut().enumerate().take(dim + 1) {
            row[i] = 1.0;
        }
        derivatives
    }
}
