//! A stabilised multiplier.

use super::formula::{Formula, OnContact};
use crate::contact::condition::Condition;
use crate::contact::face::ContactFace;
use crate::element::Space;
use faceoff_mesh::error::Result;

/// A multiplier λ ≤ 0 constant on every contact face, stabilised after Barbosa and Hughes by
/// -<γ (λ - ∂ₙu), ∂ₙv>, γ = γ₀ h_F (P. Hild, Y. Renard, Numer. Math. 115, 2010). With
/// h_F = d|κ|/|F| it is stable for γ₀ < 1/4 on every mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Multiplier {
    /// γ₀ of γ = γ₀ h_F; without dimension.
    pub gamma0: f64,
}

impl Multiplier {
    /// Below the bound with a margin.
    pub const USUAL: f64 = 0.1;
}

impl Formula for Multiplier {
    fn thetas(&self) -> [f64; 2] {
        [-1.0, 1.0]
    }

    fn conditions(&self, on: &OnContact) -> Result<Vec<Condition>> {
        let faces = on.faces.iter();
        Ok(faces
            .map(|face| on_average(on.space, face, self.thetas()))
            .collect())
    }

    fn gamma0(&self) -> Option<f64> {
        Some(self.gamma0)
    }
}

/// The means on a face.
fn on_average(space: &Space, face: &ContactFace, thetas: [f64; 2]) -> Condition {
    let dofs = space.cell_dofs(face.cell);
    let mut condition = Condition {
        weight: face.measure,
        gamma: face.gamma,
        dofs: dofs.to_vec(),
        displacement: vec![0.0; dofs.len()],
        flux: vec![0.0; dofs.len()],
        flux_at_rest: 0.0,
        psi: 0.0,
        thetas,
        row: None,
    };
    for point in &face.points {
        let share = point.weight / face.measure;
        for k in 0..dofs.len() {
            condition.displacement[k] += share * point.phi[k];
            condition.flux[k] += share * point.dn[k];
        }
        condition.psi += share * point.psi;
    }
    condition
}
