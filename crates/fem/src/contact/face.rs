//! The contact faces, and what is read off u_h on them.

use crate::assembly::{FacePoints, value_at};
use crate::element::{Basis, MAX_DOFS, Space};
use crate::quadrature::Rule;
use crate::scene::Expression;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::CellGeometry;

/// A contact face F.
pub struct ContactFace {
    /// Its number in the mesh.
    pub face: usize,
    /// The cell behind it.
    pub cell: usize,
    /// γ = γ₀ h, constant on F; of the penalty, ε.
    pub gamma: f64,
    /// |F|
    pub measure: f64,
    /// Those of the rule on Γ_C, in its order.
    pub points: Vec<ContactPoint>,
}

/// One quadrature point of a contact face.
pub struct ContactPoint {
    /// Quadrature weight times |F|.
    pub weight: f64,
    pub x: [f64; 3],
    /// φ_i
    pub phi: Basis,
    /// ∂ₙφ_i
    pub dn: Basis,
    /// The flux of u = 0: -L(φ_F)/|F| where the flux is corrected by the load, else 0.
    pub flux_at_rest: f64,
    /// ψ
    pub psi: f64,
}

/// u_h on Γ_C at one quadrature point.
#[derive(Debug, Clone, Copy)]
pub struct Trace {
    /// u - ψ
    pub gap: f64,
    /// ∂ₙu, or λ where the flux is corrected
    pub flux: f64,
    /// P(u) = γ ∂ₙu - (u - ψ)
    pub p: f64,
}

impl ContactPoint {
    /// The trace of a function with these local dofs.
    pub fn trace(&self, gamma: f64, local: &Basis) -> Trace {
        let dot = |basis: &Basis| -> f64 { basis.iter().zip(local).map(|(b, u)| b * u).sum() };
        let flux = dot(&self.dn) + self.flux_at_rest;
        Trace::new(dot(&self.phi) - self.psi, flux, gamma)
    }
}

impl Trace {
    pub(super) fn new(gap: f64, flux: f64, gamma: f64) -> Self {
        Trace {
            gap,
            flux,
            p: gamma * flux - gap,
        }
    }
}

impl ContactFace {
    /// `gamma` takes the geometry of the cell and |F|.
    pub(super) fn new(
        space: &Space,
        face: usize,
        psi: &Expression,
        gamma: impl Fn(&CellGeometry, f64) -> f64,
        rule: &Rule,
    ) -> Result<Self> {
        let points = FacePoints::new(space, face, rule);
        let mesh = space.mesh;
        let cell = mesh.face_cells(face)[0] as usize;
        let geometry = *points.geometry();
        let normal = geometry.normal(mesh.local_face(cell, face));
        let measure = points.measure();
        let points = points
            .map(|point| {
                let gradients = space.gradients(&geometry, &point.lambda);
                let mut dn = [0.0; MAX_DOFS];
                for (dn, gradient) in dn.iter_mut().zip(&gradients) {
                    *dn = gradient.dot(&normal);
                }
                Ok(ContactPoint {
                    weight: point.weight,
                    x: point.x,
                    phi: space.element.values(mesh.dim, &point.lambda),
                    dn,
                    flux_at_rest: 0.0,
                    psi: value_at(psi, "psi", point.x)?,
                })
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(ContactFace {
            face,
            cell,
            gamma: gamma(&geometry, measure),
            measure,
            points,
        })
    }
}
