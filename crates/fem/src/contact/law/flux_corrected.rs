//! The penalty-free law on CR with the flux that balances the load.
//!
//! # Why the flux is corrected
//!
//! Take (3.2) on CR, and a cell κ with the set C of faces on Γ_C. ∇u is constant on κ, and φ_F has
//! the mean 1 on F and 0 on the other faces, so that (∇u,∇φ_F)_κ = |F| ∂ₙu, which the term
//! <∂ₙu,φ_F> takes away again. With M_G the mean of max(u-ψ, γ∂ₙu) on G what is left of row F is
//!
//! ```text
//! Σ_{G ∈ C} |G| M_G ∂ₙφ_F|_G = Σ_{G ∈ C} (∇φ_G,∇φ_F)_κ M_G = L(φ_F),   F ∈ C
//! ```
//!
//! and the Gram matrix of the ∇φ_G gives M_F = m_F of order h²f instead of 0. A free face so
//! carries the flux m_F/γ, which is of order h where γ = γ₀ h: first order in L², and no better.
//! The flux through F in equilibrium with its load is (after L. D. Marini, SIAM J. Numer. Anal. 22, 1985)
//!
//! ```text
//! λ_F = ((∇u,∇φ_F)_κ - L(φ_F)) / |F| = ∂ₙu - L(φ_F)/|F|,   L(φ_F) = (f,φ_F) + <t,φ_F>_N
//! ```
//!
//! With λ in the place of ∂ₙu the right-hand side of row F is L(φ_F) - L(φ_F) = 0. So M_F = 0:
//! at the midpoint u ≤ ψ, λ ≤ 0, (u-ψ)λ = 0, in which γ has no part; and in the rows of all other
//! faces G, where the terms on Γ_C are Σ_F |F| M_F ∂ₙφ_G|_F = 0, the plain (∇u,∇φ_G) = L(φ_G). The
//! equilibrated flux of Marini, in H(div), has the normal components λ_F on Γ_C without any change.

use super::formula::{Formula, OnContact};
use crate::contact::condition::Condition;
use crate::contact::face::ContactFace;
use crate::element::Space;
use faceoff_mesh::error::Result;

/// λ = ∂ₙu - L(φ_F)/|F| on F in the place of ∂ₙu: its error in L² has order 2 whatever γ.
pub(super) struct FluxCorrected;

impl Formula for FluxCorrected {
    fn thetas(&self) -> [f64; 2] {
        [1.0, 0.0]
    }

    fn conditions(&self, on: &OnContact) -> Result<Vec<Condition>> {
        Ok(on.at_points(self.thetas(), 1.0))
    }

    fn is_nitsche(&self) -> bool {
        true
    }

    /// φ_F is the one basis function with a mean on F.
    fn prepare(&self, space: &Space, load: &[f64], faces: &mut [ContactFace]) {
        for face in faces {
            let local = space.mesh.local_face(face.cell, face.face);
            let on_face: f64 = space
                .face_dofs(face.cell, local)
                .map(|dof| load[dof as usize])
                .sum();
            for point in &mut face.points {
                point.flux_at_rest = -on_face / face.measure;
            }
        }
    }
}
