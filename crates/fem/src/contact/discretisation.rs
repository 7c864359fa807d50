//! How a problem is discretised: all that may be another while the problem stays the same.

use super::method::Method;
use crate::quadrature::{self, Rule};
use crate::scene::{HRule, Scene};
use faceoff_mesh::error::{Error, Result};

/// The scheme for a problem; it is checked where a [`super::Problem`] is made of it.
///
/// ```
/// use faceoff_fem::contact::{Discretisation, Method};
/// use faceoff_fem::scene::Scene;
///
/// # fn main() -> faceoff_mesh::Result<()> {
/// let usual = Discretisation::of(&Scene::find("one-zone")?, Method::p2());
/// let other = Discretisation {
///     gamma0: 1.0,
///     ..usual.clone()
/// };
/// assert_eq!((usual.gamma0(), other.gamma0()), (100.0, 1.0));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Discretisation {
    /// Element and contact law.
    pub method: Method,
    /// γ = γ₀ h of Nitsche's method; see [`Discretisation::gamma0`].
    pub gamma0: f64,
    /// The meaning of h in γ = γ₀ h.
    pub h: HRule,
    /// Name of the rule for (f, v); none: the default of the dimension.
    pub load_quadrature: Option<String>,
    /// Name of the rule on Γ_C and Γ_N; none: likewise.
    pub contact_quadrature: Option<String>,
}

impl Discretisation {
    /// A method with the values in the scene under `[method]`.
    pub fn of(scene: &Scene, method: Method) -> Self {
        Discretisation {
            method,
            gamma0: scene.gamma0(),
            h: scene.h(),
            load_quadrature: scene.load_quadrature().map(str::to_owned),
            contact_quadrature: scene.contact_quadrature().map(str::to_owned),
        }
    }

    /// γ₀ of γ = γ₀ h, or the method's own parameter instead.
    pub fn gamma0(&self) -> f64 {
        self.method.gamma0(self.gamma0)
    }

    /// The rules for (f, v), and for Γ_C and Γ_N, on a mesh of this dimension.
    ///
    /// # Errors
    /// A rule that is not one of this dimension.
    pub fn rules(&self, dim: usize) -> Result<[Rule; 2]> {
        self.rules_or(dim, |place, what, remedy| {
            Error::usage(format!("{place}: {what}"), remedy)
        })
    }

    /// The rules, once all is seen to be usable for a scene in this dimension.
    ///
    /// # Errors
    /// A γ₀ that is not positive, a rule that is not one of this dimension.
    pub(super) fn checked(&self, scene: &Scene, dim: usize) -> Result<[Rule; 2]> {
        let refuse = |place: &str, what: String, remedy: String| Error::Scene {
            scene: scene.name().to_owned(),
            place: place.to_owned(),
            what,
            remedy,
        };
        if !(self.gamma0 > 0.0 && self.gamma0.is_finite()) {
            return Err(refuse(
                "method.gamma0",
                format!("{} is not positive", self.gamma0),
                "the method needs gamma0 > 0 (default: 100)".into(),
            ));
        }
        self.rules_or(dim, refuse)
    }

    fn rules_or(
        &self,
        dim: usize,
        refuse: impl Fn(&str, String, String) -> Error,
    ) -> Result<[Rule; 2]> {
        let find = |place: &str, name: &Option<String>, dim: usize| {
            let known = quadrature::names(dim);
            let name = name.as_deref().unwrap_or(known[0]);
            quadrature::rule(dim, name).ok_or_else(|| {
                refuse(
                    place,
                    format!("the rule `{name}` is not one for simplices of dimension {dim}"),
                    format!("use one of {}", known.join(", ")),
                )
            })
        };
        Ok([
            find("method.load_quadrature", &self.load_quadrature, dim)?,
            find(
                "method.contact_quadrature",
                &self.contact_quadrature,
                dim - 1,
            )?,
        ])
    }
}
