//! The penalty method.

use super::formula::{Formula, OnContact};
use crate::contact::condition::Condition;
use crate::element::Element;
use faceoff_mesh::error::Result;

/// <ε⁻¹ [u-ψ]₊, v>_C in the place of -<∂ₙu, v>_C, ε = ε₀ h_F (F. Chouly, P. Hild, Comput. Math.
/// Appl. 65, 2013). ε ~ h is what keeps the order of the H¹ error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Penalty {
    /// ε₀ of ε = ε₀ h_F; without dimension.
    pub epsilon0: f64,
}

impl Penalty {
    /// Small, so that the penalty's error stays below that of P1 on usual meshes.
    pub const USUAL: f64 = 0.1;
}

impl Formula for Penalty {
    fn thetas(&self) -> [f64; 2] {
        [0.0, 1.0]
    }

    fn conditions(&self, on: &OnContact) -> Result<Vec<Condition>> {
        Ok(on.at_points(self.thetas(), 0.0))
    }

    fn gamma0(&self) -> Option<f64> {
        Some(self.epsilon0)
    }

    /// It errs by ε = ε₀ h.
    fn highest_order(&self, _: &dyn Element, _: bool) -> f64 {
        1.0
    }
}
