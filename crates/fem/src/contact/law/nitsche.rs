//! Nitsche's method (2.4).

use super::formula::{Formula, OnContact};
use crate::contact::condition::Condition;
use crate::element::Element;
use faceoff_mesh::error::Result;

/// A member of the family (2.4), with γ = γ₀ h of the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nitsche {
    /// Weight of <u, ∂ₙv>_C: any real number, -1 and 1 for the symmetric and the nonsymmetric method.
    pub theta1: f64,
    /// Weight of the penalty <γ⁻¹u, v>_C: 1, or 0 where the method is free of it.
    pub theta2: f64,
}

impl Formula for Nitsche {
    fn thetas(&self) -> [f64; 2] {
        [self.theta1, self.theta2]
    }

    fn conditions(&self, on: &OnContact) -> Result<Vec<Condition>> {
        Ok(on.at_points(self.thetas(), 1.0))
    }

    fn is_nitsche(&self) -> bool {
        true
    }

    /// On CR a free face carries the flux (f, φ_F)/(γ|F|), of order h where γ = γ₀ h. The members with θ₁ ≠ -1 are not
    /// adjoint consistent, which costs 1/2 on a boundary condition.
    fn highest_order(&self, element: &dyn Element, load_free: bool) -> f64 {
        let degree = element.degree() as f64;
        if element.on().faces && !load_free {
            1.0
        } else if self.theta1 != -1.0 {
            degree + 0.5
        } else {
            degree + 1.0
        }
    }
}
