//! Semismooth Newton, and the paper's fixed point, by name.
//!
//! Every iteration solves (A + N) δ = -R(u) and differs only in how the law max(u-ψ, γ∂ₙu) enters
//! the matrix at each contact condition, as α (u-ψ) + β γ ∂ₙu:
//!
//! ```text
//! Newton                       (α, β) = (1, 0) in contact, (0, 1) where separated
//! [P]₊ lagged as a whole       (1, 0)
//! [u-ψ-γ∂ₙu]₊ lagged           (0, 1)
//! flux new, displacement old   (1, 1) where P > 0, (1, 0) where P ≤ 0
//! displacement new, flux old   (0, 1) where P > 0, (1, 1) where P ≤ 0
//! ```

use std::fmt;
use std::str::FromStr;

/// How the nonlinear system is solved.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Iteration {
    /// Semismooth Newton, which is the primal-dual active set strategy (M. Hintermüller, K. Ito,
    /// K. Kunisch, SIAM J. Optim. 13, 2002).
    #[default]
    Newton,
    /// The paper's fixed point. Its splitting is not stated there.
    FixedPoint(Splitting),
}

/// The splittings that were tried for the paper's fixed point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Splitting {
    /// `[P]₊` lagged as a whole; converges for γ₀ < 1 only.
    LaggedP,
    /// `[u-ψ-γ∂ₙu]₊` lagged; needs γ above about 0.28.
    LaggedGap,
    /// The indicator of contact lagged, P new, under-relaxed by 1/6.
    Relaxed,
    /// In P the flux new, the displacement lagged.
    FluxNew,
    /// In γ∂ₙu + [u-ψ-γ∂ₙu]₊ the displacement new, the flux in the bracket lagged.
    DisplacementNew,
}

/// All of them.
pub const SPLITTINGS: [Splitting; 5] = [
    Splitting::LaggedP,
    Splitting::LaggedGap,
    Splitting::Relaxed,
    Splitting::FluxNew,
    Splitting::DisplacementNew,
];

impl Splitting {
    fn name(self) -> &'static str {
        match self {
            Splitting::LaggedP => "lagged-p",
            Splitting::LaggedGap => "lagged-gap",
            Splitting::Relaxed => "relaxed",
            Splitting::FluxNew => "flux-new",
            Splitting::DisplacementNew => "displacement-new",
        }
    }
}

impl Iteration {
    /// (α, β) of a condition that is, or is not, in contact.
    pub(super) fn law(self, contact: bool) -> [f64; 2] {
        match self {
            Iteration::Newton | Iteration::FixedPoint(Splitting::Relaxed) => {
                if contact {
                    [1.0, 0.0]
                } else {
                    [0.0, 1.0]
                }
            }
            Iteration::FixedPoint(Splitting::LaggedP) => [1.0, 0.0],
            Iteration::FixedPoint(Splitting::LaggedGap) => [0.0, 1.0],
            Iteration::FixedPoint(Splitting::FluxNew) => {
                if contact {
                    [1.0, 0.0]
                } else {
                    [1.0, 1.0]
                }
            }
            Iteration::FixedPoint(Splitting::DisplacementNew) => {
                if contact {
                    [1.0, 1.0]
                } else {
                    [0.0, 1.0]
                }
            }
        }
    }

    /// Whether the matrix stays the same from step to step.
    pub(super) fn is_constant(self) -> bool {
        matches!(
            self,
            Iteration::FixedPoint(Splitting::LaggedP | Splitting::LaggedGap)
        )
    }

    pub(super) fn relaxation(self) -> f64 {
        match self {
            Iteration::FixedPoint(Splitting::Relaxed) => 1.0 / 6.0,
            _ => 1.0,
        }
    }
}

impl FromStr for Iteration {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "newton" {
            return Ok(Iteration::Newton);
        }
        SPLITTINGS
            .iter()
            .find(|splitting| splitting.name() == text)
            .map(|splitting| Iteration::FixedPoint(*splitting))
            .ok_or_else(|| {
                let names: Vec<_> = SPLITTINGS.iter().map(|splitting| splitting.name()).collect();
                format!(
                    "there is no iteration `{text}`: use newton, or a splitting of the fixed point: {}",
                    names.join(", ")
                )
            })
    }
}

impl fmt::Display for Iteration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Iteration::Newton => f.pad("newton"),
            Iteration::FixedPoint(splitting) => f.pad(splitting.name()),
        }
    }
}
