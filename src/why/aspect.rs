//! The ways in which a code may differ from the scheme.

use std::fmt::{self, Display, Formatter};

use serde::{Serialize, Serializer};

use crate::run::Datum;

/// The part of the scheme or of the values that a change concerns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aspect {
    /// The number of digits in the file.
    Digits,
    /// The quadrature rule of the load.
    LoadRule,
    /// The quadrature rule on Γ_C.
    ContactRule,
    /// The meaning of h in γ = γ₀ h.
    H,
    /// One of f, g, t, ψ.
    Datum(Datum),
    /// The assignment of boundary parts.
    Boundary,
    /// The contact law and θ.
    Method,
    /// γ, everywhere or on some faces.
    Gamma,
    /// The order of the values.
    Order,
    /// Values of u.
    U,
    /// The points in contact.
    Status,
    /// An iteration that stopped early.
    Iteration,
    /// The terms of the scheme as a weak form.
    Form,
    /// Several of them at once.
    Several,
}

impl Display for Aspect {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        f.write_str(match self {
            Aspect::Digits => "the digits",
            Aspect::LoadRule => "the quadrature of the load",
            Aspect::ContactRule => "the quadrature on Γ_C",
            Aspect::H => "h",
            Aspect::Datum(datum) => datum.name(),
            Aspect::Boundary => "the boundary",
            Aspect::Method => "the method",
            Aspect::Gamma => "γ",
            Aspect::Order => "the order",
            Aspect::U => "u",
            Aspect::Status => "the contact status",
            Aspect::Iteration => "the iteration",
            Aspect::Form => "the form",
            Aspect::Several => "two changes",
        })
    }
}

impl Serialize for Aspect {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
