//! The methods by name: an element, and the law that imposes the contact condition on it.

use std::fmt;
use std::str::FromStr;

use super::law::{Law, Multiplier, Nitsche, Penalty};
use crate::element::{CR, Element, P1, P2};
use faceoff_mesh::error::meant;

/// An element and a contact law.
#[derive(Clone, Copy)]
pub struct Method {
    /// V_h.
    pub element: &'static dyn Element,
    /// How the contact condition is imposed on it.
    pub law: Law,
}

const ELEMENTS: [(&str, &dyn Element); 3] = [("cr", &CR), ("p1", &P1), ("p2", &P2)];

/// A law with its own name, on its element.
struct Named {
    name: &'static str,
    element: &'static dyn Element,
    /// The law with a parameter, which those without one ignore.
    law: fn(f64) -> Law,
    /// The default parameter of the name; None for laws without one.
    usual: Option<f64>,
}

const NAMED: [Named; 5] = [
    Named {
        name: "cr-fc",
        element: &CR,
        law: |_| Law::FluxCorrected,
        usual: None,
    },
    Named {
        name: "p1-vi",
        element: &P1,
        law: |_| Law::Variational,
        usual: None,
    },
    Named {
        name: "cr-vi",
        element: &CR,
        law: |_| Law::Variational,
        usual: None,
    },
    Named {
        name: "penalty",
        element: &P1,
        law: |epsilon0| Law::Penalty(Penalty { epsilon0 }),
        usual: Some(Penalty::USUAL),
    },
    Named {
        name: "multiplier",
        element: &P1,
        law: |gamma0| Law::Multiplier(Multiplier { gamma0 }),
        usual: Some(Multiplier::USUAL),
    },
];

impl Method {
    /// The paper's penalty-free method (3.2).
    pub fn cr() -> Self {
        Method::nitsche(&CR, 1.0, 0.0)
    }

    /// Chouly, Hild, Renard's nonsymmetric method on P2: the paper's reference.
    pub fn p2() -> Self {
        Method::nitsche(&P2, 1.0, 1.0)
    }

    /// A member of the family (2.4).
    pub fn nitsche(element: &'static dyn Element, theta1: f64, theta2: f64) -> Self {
        Method {
            element,
            law: Law::Nitsche(Nitsche { theta1, theta2 }),
        }
    }

    /// The paper's penalty-free method with the flux corrected by the load.
    pub fn cr_fc() -> Self {
        Method {
            element: &CR,
            law: Law::FluxCorrected,
        }
    }

    /// Whether it is Nitsche's method, of the family (2.4) or with the flux corrected. All codes have it.
    pub fn is_nitsche(&self) -> bool {
        self.law.is_nitsche()
    }

    /// γ₀ of γ = γ₀ h: the scene's, or the law's own.
    pub fn gamma0(&self, of_scene: f64) -> f64 {
        self.law.gamma0().unwrap_or(of_scene)
    }
}

/// `cr` is θ = (1, 0), `p1` and `p2` are θ = (1, 1); other members are named with their
/// parameters, as in `p2(1,0)`. `cr-fc` is `cr` with the flux corrected. The classical methods are `p1-vi`, `cr-vi`, `penalty` and
/// `multiplier`, the last two with a parameter as in `penalty(0.01)`.
impl FromStr for Method {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unknown = || {
            let named: Vec<&str> = NAMED.iter().map(|named| named.name).collect();
            format!(
                "there is no method `{text}`: {}use cr, p1, p2, or a member of the family (2.4) \
                 with its parameters, as in p2(1,0) or p2(-0.5,1); \
                 or {}",
                meant(text, named.iter().copied().chain(["cr", "p1", "p2"])),
                named.join(", ")
            )
        };
        let (name, parameters) = match text.split_once('(') {
            Some((name, rest)) => (name, Some(rest.strip_suffix(')').ok_or_else(unknown)?)),
            None => (text, None),
        };
        if let Some(named) = NAMED.iter().find(|named| named.name == name) {
            let parameter = match (parameters, named.usual) {
                (None, usual) => usual.unwrap_or_default(),
                (Some(_), None) => return Err(unknown()),
                (Some(parameter), Some(_)) => {
                    let value = parameter.trim().parse().ok();
                    value
                        .filter(|v: &f64| *v > 0.0 && v.is_finite())
                        .ok_or_else(|| format!("{text}: `{parameter}` is not a positive number"))?
                }
            };
            return Ok(Method {
                element: named.element,
                law: (named.law)(parameter),
            });
        }
        let (name, element) = ELEMENTS
            .into_iter()
            .find(|(known, _)| *known == name)
            .ok_or_else(unknown)?;
        let Some(parameters) = parameters else {
            let [theta1, theta2] = usual(name);
            return Ok(Method::nitsche(element, theta1, theta2));
        };
        let (theta1, theta2) = parameters.split_once(',').ok_or_else(unknown)?;
        let number = |text: &str| -> Result<f64, String> {
            let value = text.trim().parse().ok().filter(|v: &f64| v.is_finite());
            // Not -0, which has another name.
            value.map(|v| v + 0.0).ok_or_else(unknown)
        };
        let [theta1, theta2] = [number(theta1)?, number(theta2)?];
        if theta1 == 0.0 && theta2 == 0.0 {
            return Err(format!(
                "{text}: with theta1 = theta2 = 0 nothing imposes the contact condition"
            ));
        }
        Ok(Method::nitsche(element, theta1, theta2))
    }
}

/// θ of the default member for an element's name.
fn usual(element: &str) -> [f64; 2] {
    if element == "cr" {
        [1.0, 0.0]
    } else {
        [1.0, 1.0]
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let element = self.element.name().to_lowercase();
        if let Law::Nitsche(Nitsche { theta1, theta2 }) = self.law {
            return f.pad(&if [theta1, theta2] == usual(&element) {
                element
            } else {
                format!("{element}({theta1},{theta2})")
            });
        }
        let parameter = self.law.gamma0().unwrap_or_default();
        let named = NAMED.iter().find(|named| {
            named.element.name() == self.element.name() && (named.law)(parameter) == self.law
        });
        f.pad(&match named {
            Some(named) if named.usual.is_none_or(|usual| usual == parameter) => named.name.into(),
            Some(named) => format!("{}({parameter})", named.name),
            None => format!("{:?} on {element}", self.law),
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
            "p2(-0.5,1)",
            "p1(2.25,0.125)",
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
            "cr(nan,0)",
            "cr(1,inf)",
            "cr(-0,0)",
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
