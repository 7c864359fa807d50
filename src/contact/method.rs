//! The methods by name: an element and two parameters of the family (2.4).

use std::fmt;
use std::str::FromStr;

use crate::element::{CR, Element, P1, P2};

/// A member of the family (2.4) on an element.
#[derive(Clone, Copy)]
pub struct Method {
    pub element: &'static dyn Element,
    /// θ₁ ∈ {-1, 0, 1}: weight of <u, ∂ₙv>_C.
    pub theta1: i8,
    /// θ₂ ∈ {0, 1}: weight of the penalty <γ⁻¹u, v>_C.
    pub theta2: i8,
}

impl Method {
    /// The paper's penalty-free method (3.2).
    pub fn cr() -> Self {
        Method {
            element: &CR,
            theta1: 1,
            theta2: 0,
        }
    }

    /// Chouly, Hild, Renard's nonsymmetric method on P2: the paper's reference.
    pub fn p2() -> Self {
        Method {
            element: &P2,
            theta1: 1,
            theta2: 1,
        }
    }
}

/// `cr` is θ = (1, 0), `p1` and `p2` are θ = (1, 1); other members are named with their
/// parameters, as in `p2(1,0)`.
impl FromStr for Method {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unknown = || {
            format!(
                "there is no method `{text}`: use cr, p1, p2, or a member of the family (2.4) \
                 with its parameters, as in p2(1,0), theta1 in -1, 0, 1 and theta2 in 0, 1"
            )
        };
        let (name, parameters) = match text.split_once('(') {
            Some((name, rest)) => (name, Some(rest.strip_suffix(')').ok_or_else(unknown)?)),
            None => (text, None),
        };
        let mut method = match name {
            "cr" => Method::cr(),
            "p1" => Method {
                element: &P1,
                ..Method::p2()
            },
            "p2" => Method::p2(),
            _ => return Err(unknown()),
        };
        if let Some(parameters) = parameters {
            let (theta1, theta2) = parameters.split_once(',').ok_or_else(unknown)?;
            method.theta1 = theta1.trim().parse().map_err(|_| unknown())?;
            method.theta2 = theta2.trim().parse().map_err(|_| unknown())?;
            if !(-1..=1).contains(&method.theta1) || !(0..=1).contains(&method.theta2) {
                return Err(unknown());
            }
            if method.theta1 == 0 && method.theta2 == 0 {
                return Err(format!(
                    "{text}: with theta1 = theta2 = 0 nothing imposes the contact condition"
                ));
            }
        }
        Ok(method)
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.element.name().to_lowercase();
        let usual = if name == "cr" { (1, 0) } else { (1, 1) };
        if (self.theta1, self.theta2) == usual {
            f.pad(&name)
        } else {
            f.pad(&format!("{name}({},{})", self.theta1, self.theta2))
        }
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
        for name in ["cr", "p1", "p2", "p2(1,0)", "p1(-1,1)", "cr(0,1)"] {
            assert_eq!(name.parse::<Method>().unwrap().to_string(), name);
        }
        assert_eq!("p2(1,1)".parse::<Method>().unwrap().to_string(), "p2");
        for name in ["", "p3", "cr(", "cr(2,0)", "cr(1)", "p2(0,0)", "p2(1,0"] {
            assert!(name.parse::<Method>().is_err(), "{name}");
        }
    }
}
