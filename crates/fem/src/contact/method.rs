//! The methods by name: an element, and the law that imposes the contact condition on it.

use std::fmt;
use std::str::FromStr;

use crate::element::{CR, Element, P1, P2};

/// An element and a contact law.
#[derive(Clone, Copy)]
pub struct Method {
    pub element: &'static dyn Element,
    pub law: Law,
}

/// How u ≤ ψ, ∂ₙu ≤ 0, (u-ψ) ∂ₙu = 0 on Γ_C enter the scheme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// The family (2.4), with γ = γ₀ h of the scene.
    Nitsche {
        /// θ₁ ∈ {-1, 0, 1}: weight of <u, ∂ₙv>_C.
        theta1: i8,
        /// θ₂ ∈ {0, 1}: weight of the penalty <γ⁻¹u, v>_C.
        theta2: i8,
    },
    /// The penalty-free law on CR with the flux that balances the load, λ = ∂ₙu - L(φ_F)/|F| on F,
    /// in the place of ∂ₙu: its error in L² has order 2 whatever γ. See `conditions` for why.
    FluxCorrected,
    /// The variational inequality over { v ∈ V_h : v ≤ ψ at every dof on Γ_C }: at the vertices
    /// for P1; for CR the mean on every face (D. Hua, L. Wang, J. Comput. Math. 25, 2007).
    Variational,
    /// <ε⁻¹ [u-ψ]₊, v>_C in the place of -<∂ₙu, v>_C, ε = ε₀ h_F (F. Chouly, P. Hild, Comput. Math.
    /// Appl. 65, 2013). ε ~ h is what keeps the order of the H¹ error; the L² error has order 1.
    Penalty { epsilon0: f64 },
    /// A multiplier λ ≤ 0 constant on every contact face, stabilised after Barbosa and Hughes by
    /// -<γ (λ - ∂ₙu), ∂ₙv>, γ = γ₀ h_F (P. Hild, Y. Renard, Numer. Math. 115, 2010). With
    /// h_F = d|κ|/|F| it is stable for γ₀ < 1/4 on every mesh.
    Multiplier { gamma0: f64 },
}

/// Small, so that the penalty's error stays below that of P1 on usual meshes.
const EPSILON0: f64 = 0.1;
/// Below the bound with a margin.
const MULTIPLIER_GAMMA0: f64 = 0.1;

const ELEMENTS: [(&str, &dyn Element); 3] = [("cr", &CR), ("p1", &P1), ("p2", &P2)];

impl Law {
    /// θ₁ and θ₂ of what the contact condition is tested with, θ₂γ⁻¹v + θ₁∂ₙv.
    pub fn thetas(&self) -> [i8; 2] {
        match *self {
            Law::Nitsche { theta1, theta2 } => [theta1, theta2],
            Law::FluxCorrected => [1, 0],
            Law::Variational | Law::Penalty { .. } => [0, 1],
            Law::Multiplier { .. } => [-1, 1],
        }
    }
}

impl Method {
    /// The paper's penalty-free method (3.2).
    pub fn cr() -> Self {
        Method::nitsche(&CR, 1, 0)
    }

    /// Chouly, Hild, Renard's nonsymmetric method on P2: the paper's reference.
    pub fn p2() -> Self {
        Method::nitsche(&P2, 1, 1)
    }

    /// A member of the family (2.4).
    pub fn nitsche(element: &'static dyn Element, theta1: i8, theta2: i8) -> Self {
        Method {
            element,
            law: Law::Nitsche { theta1, theta2 },
        }
    }

    /// The paper's penalty-free method with the flux corrected by the load.
    pub fn cr_fc() -> Self {
        Method {
            element: &CR,
            law: Law::FluxCorrected,
        }
    }

    /// Is it Nitsche's method, of the family (2.4) or with the flux corrected? All codes have it.
    pub fn is_nitsche(&self) -> bool {
        matches!(self.law, Law::Nitsche { .. } | Law::FluxCorrected)
    }

    /// γ₀ of γ = γ₀ h: the scene's, or what the law has of its own.
    pub fn gamma0(&self, of_scene: f64) -> f64 {
        match self.law {
            Law::Nitsche { .. } | Law::FluxCorrected => of_scene,
            Law::Variational => 1.0,
            Law::Penalty { epsilon0 } => epsilon0,
            Law::Multiplier { gamma0 } => gamma0,
        }
    }
}

/// `cr` is θ = (1, 0), `p1` and `p2` are θ = (1, 1); other members are named with their
/// parameters, as in `p2(1,0)`. `cr-fc` is `cr` with the flux corrected. The classical methods are `p1-vi`, `cr-vi`, `penalty` and
/// `multiplier`, the last two with a parameter of their own as in `penalty(0.01)`.
impl FromStr for Method {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unknown = || {
            format!(
                "there is no method `{text}`: use cr, cr-fc, p1, p2, or a member of the family (2.4) \
                 with its parameters, as in p2(1,0), theta1 in -1, 0, 1 and theta2 in 0, 1; \
                 or p1-vi, cr-vi, penalty, multiplier"
            )
        };
        let (name, parameters) = match text.split_once('(') {
            Some((name, rest)) => (name, Some(rest.strip_suffix(')').ok_or_else(unknown)?)),
            None => (text, None),
        };
        let own = |default: f64| -> Result<f64, String> {
            let Some(parameter) = parameters else {
                return Ok(default);
            };
            let value = parameter.trim().parse().ok();
            value
                .filter(|v: &f64| *v > 0.0 && v.is_finite())
                .ok_or_else(|| format!("{text}: `{parameter}` is no positive number"))
        };
        let on_p1 = |law| Ok(Method { element: &P1, law });
        match (name, parameters) {
            ("cr-fc", None) => Ok(Method::cr_fc()),
            ("p1-vi", None) => on_p1(Law::Variational),
            ("cr-vi", None) => Ok(Method {
                element: &CR,
                law: Law::Variational,
            }),
            ("penalty", _) => on_p1(Law::Penalty {
                epsilon0: own(EPSILON0)?,
            }),
            ("multiplier", _) => on_p1(Law::Multiplier {
                gamma0: own(MULTIPLIER_GAMMA0)?,
            }),
            _ => {
                let (name, element) = ELEMENTS
                    .into_iter()
                    .find(|(known, _)| *known == name)
                    .ok_or_else(unknown)?;
                let Some(parameters) = parameters else {
                    let [theta1, theta2] = usual(name);
                    return Ok(Method::nitsche(element, theta1, theta2));
                };
                let (theta1, theta2) = parameters.split_once(',').ok_or_else(unknown)?;
                let theta1 = theta1.trim().parse().map_err(|_| unknown())?;
                let theta2 = theta2.trim().parse().map_err(|_| unknown())?;
                if !(-1..=1).contains(&theta1) || !(0..=1).contains(&theta2) {
                    return Err(unknown());
                }
                if theta1 == 0 && theta2 == 0 {
                    return Err(format!(
                        "{text}: with theta1 = theta2 = 0 nothing imposes the contact condition"
                    ));
                }
                Ok(Method::nitsche(element, theta1, theta2))
            }
        }
    }
}

/// θ of the member that is meant by an element's name alone.
fn usual(element: &str) -> [i8; 2] {
    if element == "cr" { [1, 0] } else { [1, 1] }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let element = self.element.name().to_lowercase();
        let own = |name: &str, value: f64, default: f64| {
            if value == default {
                name.to_owned()
            } else {
                format!("{name}({value})")
            }
        };
        f.pad(&match self.law {
            Law::Nitsche { theta1, theta2 } if [theta1, theta2] == usual(&element) => element,
            Law::Nitsche { theta1, theta2 } => format!("{element}({theta1},{theta2})"),
            Law::FluxCorrected => format!("{element}-fc"),
            Law::Variational => format!("{element}-vi"),
            Law::Penalty { epsilon0 } => own("penalty", epsilon0, EPSILON0),
            Law::Multiplier { gamma0 } => own("multiplier", gamma0, MULTIPLIER_GAMMA0),
        })
    }
}

impl fmt::Debug for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")
    }
}

impl PartialEq for Method {
    fn eq(&self, other: &Self) -> bool {
        self.to_string() == other.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_parameters_round_trip() {
        for name in [
            "cr",
            "cr-fc",
            "p1",
            "p2",
            "p2(1,0)",
            "p1(-1,1)",
            "cr(0,1)",
            "p1-vi",
            "cr-vi",
            "penalty",
            "penalty(0.003)",
            "multiplier",
            "multiplier(0.2)",
        ] {
            assert_eq!(name.parse::<Method>().unwrap().to_string(), name);
        }
        assert_eq!("p2(1,1)".parse::<Method>().unwrap().to_string(), "p2");
        assert_eq!(
            "penalty(0.1)".parse::<Method>().unwrap().to_string(),
            "penalty"
        );
        for name in [
            "",
            "p3",
            "cr(",
            "cr(2,0)",
            "cr(1)",
            "p2(0,0)",
            "p2(1,0",
            "p2-fc",
            "cr-fc(1,0)",
            "p2-vi",
            "p1-vi(1)",
            "penalty()",
            "penalty(-1)",
            "penalty(nan)",
            "multiplier(inf)",
        ] {
            assert!(name.parse::<Method>().is_err(), "{name}");
        }
    }
}
