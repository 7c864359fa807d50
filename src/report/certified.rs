//! A certificate as scripts and people read it.

use serde::Serialize;

use super::model::percent;
use faceoff_fem::certify::{Certificate, Parts, Target};

/// Bounds of ‖∇u - …‖ for one target, and what they are made of.
#[derive(Debug, Clone, Serialize)]
pub struct Certified {
    pub target: Target,
    pub upper: f64,
    pub lower: f64,
    /// `upper` over a bound of ‖∇u‖ from below; none where that is 0.
    pub relative: Option<f64>,
    pub oscillation: f64,
    pub parts: Parts,
    /// Every target's upper bound.
    pub bounds: Bounds,
    /// ‖∇u‖ is at least and at most this.
    pub gradient: [f64; 2],
}

#[derive(Debug, Clone, Copy, Serialize)]
pub struct Bounds {
    pub g: f64,
    pub v: f64,
    pub u_h: f64,
}

impl Certified {
    pub fn new(target: Target, certificate: &Certificate) -> Self {
        let [lower, upper] = certificate.of(target);
        let of = |target| certificate.of(target)[1];
        Certified {
            target,
            upper,
            lower,
            relative: Some(certificate.relative(target)).filter(|r| r.is_finite()),
            oscillation: certificate.parts.oscillation,
            parts: certificate.parts,
            bounds: Bounds {
                g: of(Target::G),
                v: of(Target::V),
                u_h: of(Target::UH),
            },
            gradient: certificate.gradient,
        }
    }

    /// One line.
    pub fn sentence(&self) -> String {
        let of = match self.target {
            Target::G => "of the averaged gradient",
            Target::V => "of the admissible v",
            Target::UH => "of ∇u_h",
        };
        let relative = match self.relative {
            Some(relative) => format!(", {} of ‖∇u‖", percent(relative)),
            None => String::new(),
        };
        format!(
            "the error {of} is at most {:.4e}{relative}; ‖∇u‖ is in [{:.6e}, {:.6e}]",
            self.upper, self.gradient[0], self.gradient[1]
        )
    }
}
