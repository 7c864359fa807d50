//! Crouzeix and Raviart (1973): affine on each cell, continuous at the faces' midpoints.

use super::{Basis, DofEntities, Element, MAX_DOFS};

/// φ_i = 1 - d λ_i, the face opposite vertex i.
pub struct CrouzeixRaviart;

impl Element for CrouzeixRaviart {
    fn name(&self) -> &'static str {
        "CR"
    }

    fn degree(&self) -> usize {
        1
    }

    fn on(&self) -> DofEntities {
        DofEntities {
            vertices: false,
            edges: false,
            faces: true,
        }
    }

    fn values(&self, dim: usize, lambda: &[f64; 4]) -> Basis {
        let mut values = [0.0; MAX_DOFS];
        for i in 0..=dim {
            values[i] = 1.0 - dim as f64 * lambda[i];
        }
        values
    }

    fn derivatives(&self, dim: usize, _lambda: &[f64; 4]) -> [[f64; 4]; MAX_DOFS] {
        let mut derivatives = [[0.0; 4]; MAX_DOFS];
        for (i, row) in derivatives.iter_mut().enumerate().take(dim + 1) {
            row[i] = -(dim as f64);
        }
        derivatives
    }
}
