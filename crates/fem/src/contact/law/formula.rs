//! The definition of a law.

use crate::assembly::Stiffness;
use crate::contact::condition::Condition;
use crate::contact::face::ContactFace;
use crate::contact::held::Held;
use crate::element::{Element, Space};
use crate::scene::Expression;
use faceoff_mesh::error::Result;

/// A law of contact: the conditions it sets, and what the solvers have to know of it.
pub trait Formula {
    /// θ₁ and θ₂ of what the contact condition is tested with, θ₂γ⁻¹v + θ₁∂ₙv.
    fn thetas(&self) -> [f64; 2];

    /// The conditions on the contact faces.
    ///
    /// # Errors
    /// A value of ψ that is not finite.
    fn conditions(&self, on: &OnContact) -> Result<Vec<Condition>>;

    /// Its own parameter: γ is this times h_F = d|κ|/|F|. None: γ = γ₀ h of the scene.
    fn gamma0(&self) -> Option<f64> {
        None
    }

    /// Whether it is Nitsche's method, of the family (2.4) or with the flux corrected. All codes have it.
    fn is_nitsche(&self) -> bool {
        false
    }

    /// Whether each of its conditions replaces the row of one dof, so that the matrix is nearly symmetric.
    fn replaces_rows(&self) -> bool {
        false
    }

    /// Its changes to the contact faces once the load is known.
    fn prepare(&self, _space: &Space, _load: &[f64], _faces: &mut [ContactFace]) {}

    /// The order of the error in L² that it cannot exceed, whatever u.
    fn highest_order(&self, element: &dyn Element, _load_free: bool) -> f64 {
        element.degree() as f64 + 1.0
    }
}

/// The parts of conditions.
pub struct OnContact<'a> {
    /// V_h before boundary conditions.
    pub space: &'a Space<'a>,
    /// All contact faces, ascending.
    pub faces: &'a [ContactFace],
    /// ψ
    pub psi: &'a Expression,
    /// (∇φ_j, ∇φ_i)_h, all dofs.
    pub stiffness: &'a Stiffness<'a>,
    /// L(φ_i)
    pub load: &'a [f64],
    /// The value of g at each dof on Γ_D, none elsewhere.
    pub dirichlet: &'a Held,
}

impl OnContact<'_> {
    /// The traces at the rule's points, with the flux counted `times`.
    pub fn at_points(&self, thetas: [f64; 2], times: f64) -> Vec<Condition> {
        let mut conditions = Vec::new();
        for face in self.faces {
            let dofs = self.space.cell_dofs(face.cell);
            conditions.extend(face.points.iter().map(|point| Condition {
                weight: point.weight,
                gamma: face.gamma,
                dofs: dofs.to_vec(),
                displacement: point.phi[..dofs.len()].to_vec(),
                flux: point.dn[..dofs.len()].iter().map(|dn| times * dn).collect(),
                flux_at_rest: times * point.flux_at_rest,
                psi: point.psi,
                thetas,
                row: None,
            }));
        }
        conditions
    }
}
