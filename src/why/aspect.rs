//! What may differ between a code and the scheme.

use std::fmt::{self, Display, Formatter};

use serde::{Serialize, Serializer};

use crate::run::Datum;

/// What a change of the scheme or of the values is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aspect {
    /// The digits with which values are written.
    Digits,
    /// The rule by which the load is integrated.
    LoadRule,
    /// That of Γ_C.
    ContactRule,
    /// h in γ = γ₀ h.
    H,
    /// One of f, g, t, ψ.
    Datum(Datum),
    /// Which part of the boundary is which.
    Boundary,
    /// The law of contact and θ.
    Method,
    /// γ, everywhere or on some faces.
    Gamma,
    /// Whose values are whose.
    Order,
    /// Values of u.
    U,
    /// Which points are in contact.
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
