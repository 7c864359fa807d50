//! A certificate, for scripts and people.

use serde::Serialize;

use super::model::{joined, percent};
use crate::text::{Digits, Text, above, at_most, below, interval, text};
use faceoff_fem::certify::{Certificate, Numbers, OfPart, Parts, Target};

/// Bounds of ‖∇u - …‖ for one target, with their parts.
#[derive(Debug, Clone, Serialize)]
pub struct Certified {
    /// The field whose error is bounded.
    pub target: Target,
    /// The error is at most this.
    pub upper: f64,
    /// The error is at least this.
    pub lower: f64,
    /// `upper` divided by a lower bound of ‖∇u‖; `None` if that is 0.
    pub relative: Option<f64>,
    /// The part of the data that no flux balances; as in `parts`.
    pub oscillation: f64,
    /// The parts of `upper`.
    pub parts: Parts,
    /// Every target's upper bound.
    pub bounds: Bounds,
    /// A lower and an upper bound of ‖∇u‖.
    pub gradient: [f64; 2],
    /// A lower and an upper bound of J(u) = ½‖∇u‖² - (f,u) - <t,u>.
    pub energy: [f64; 2],
    /// Functionals of u, each with its interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub numbers: Option<Numbers>,
}

/// Upper bounds, as in [`Certificate`].
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Bounds {
    /// The bound of ‖∇u-G‖.
    pub g: f64,
    /// The bound of ‖∇(u-v)‖.
    pub v: f64,
    /// The bound of ‖∇u-∇u_h‖_h.
    pub u_h: f64,
}

impl Certified {
    /// The bounds of a certificate for one target.
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
            energy: certificate.energy,
            numbers: certificate.numbers.clone(),
        }
    }

    /// The proven statements on u, one per line.
    pub fn facts(&self) -> Vec<(Text, Text)> {
        let within = |of: [f64; 2]| Text::from(format!("in {}", interval(of, 9)));
        let mut facts = vec![("energy J(u)".into(), within(self.energy))];
        let Some(numbers) = &self.numbers else {
            return facts;
        };
        let of_parts = |name: &str, parts: &[OfPart]| {
            let of_part = |of: &OfPart| match of.interval {
                Some(bounds) => format!("{} {}", of.part, within(bounds)),
                None => format!("{} not known, as it meets another group", of.part),
            };
            let parts = joined(parts.iter().map(of_part), "; ");
            (!parts.is_empty()).then(|| (name.into(), parts.into()))
        };
        let force = numbers.contact_force;
        facts.extend(force.map(|of| ("contact force".into(), within(of))));
        facts.extend(of_parts("contact force on", &numbers.contact_forces));
        let flux = numbers.dirichlet_flux;
        facts.extend(flux.map(|of| (text!("flux on Γ_D"), within(of))));
        facts.extend(of_parts("flux on", &numbers.dirichlet_fluxes));
        facts.push(("mean of u".into(), within(numbers.mean)));
        facts.extend(of_parts("mean of u over", &numbers.means));
        if let Some(contact) = &numbers.contact {
            // A smaller part of Γ_C, and longer intervals.
            let digits = Digits::Decimals(4);
            let inside = |from, to| {
                let [from, to] = [above(from, digits), below(to, digits)];
                format!("[{from:.4}, {to:.4}]")
            };
            let free = contact.free.iter().map(|[from, to]| inside(*from, *to));
            let touched = contact.touched.iter().map(|t| {
                let window = above(t.window, digits);
                let inside = inside(t.from, t.to);
                format!("in every window of length {window:.4} in {inside}")
            });
            let or_none = |words: String| match words.is_empty() {
                true => Text::from("nowhere"),
                false => words.into(),
            };
            let free = or_none(joined(free, ", "));
            let touched = or_none(joined(touched, "; "));
            facts.push(("free for certain".into(), free));
            facts.push(("contact for certain".into(), touched));
        }
        facts
    }

    /// The bound in a few words.
    pub fn brief(&self) -> String {
        match self.percent() {
            Some(percent) => format!("the error of ∇u is at most {percent} of ‖∇u‖"),
            None => format!("the error of ∇u is at most {}", self.short()),
        }
    }

    /// The relative bound, with three digits.
    pub fn percent(&self) -> Option<String> {
        self.relative.map(percent_above)
    }

    /// The bound, with three digits.
    pub fn short(&self) -> String {
        at_most(self.upper, 3)
    }

    /// The certificate on one line.
    pub fn sentence(&self) -> String {
        let of = match self.target {
            Target::G => "of the averaged gradient",
            Target::V => "of the admissible v",
            Target::UH => "of ∇u_h",
            Target::ContactForce => "of the contact force, taken as the middle of its interval,",
        };
        let relative = match self.percent() {
            Some(percent) if self.target == Target::ContactForce => format!(", {percent} of it"),
            Some(percent) => format!(", {percent} of ‖∇u‖"),
            None => String::new(),
        };
        format!(
            "the error {of} is at most {}{relative}; ‖∇u‖ is in {}",
            at_most(self.upper, 5),
            interval(self.gradient, 7)
        )
    }
}

/// A relative bound, with three digits.
pub fn percent_above(relative: f64) -> String {
    percent(above(relative, Digits::Counting(3)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_fem::certify::{ContactProof, Touched};

    /// None of these numbers would be a bound if it were rounded to the nearest.
    #[test]
    fn what_is_said_is_not_more_than_what_is_proved() {
        let (gradient, energy) = ([1.551_336_8, 1.551_348_4], [-1.203_340_923, -1.0]);
        let contact = ContactProof {
            free: vec![[0.193_81, 0.806_19]],
            touched: vec![Touched {
                from: 0.656_21,
                to: 0.999_96,
                window: 0.125_01,
            }],
        };
        let parts = Parts {
            misfit: 0.0,
            contact: 0.0,
            oscillation: 0.0,
            unknown: 0.0,
        };
        let certified = Certified {
            target: Target::G,
            upper: 3.074_01e-3,
            lower: 0.0,
            relative: Some(1.982e-3),
            oscillation: 0.0,
            parts,
            bounds: Bounds {
                g: 0.0,
                v: 0.0,
                u_h: 0.0,
            },
            gradient,
            energy,
            numbers: Some(Numbers {
                contact_force: None,
                dirichlet_flux: None,
                mean: [0.25, 0.5],
                contact_forces: Vec::new(),
                dirichlet_fluxes: Vec::new(),
                means: Vec::new(),
                contact: Some(contact),
            }),
        };
        assert_eq!(
            certified.sentence(),
            "the error of the averaged gradient is at most 0.0030741, 0.199 % of ‖∇u‖; ‖∇u‖ is in [1.551336, 1.551349]"
        );
        assert_eq!(
            certified.brief(),
            "the error of ∇u is at most 0.199 % of ‖∇u‖"
        );
        assert_eq!(certified.short(), "0.00308");
        let facts: Vec<String> = certified
            .facts()
            .into_iter()
            .map(|fact| fact.1.to_string())
            .collect();
        assert_eq!(
            facts,
            [
                "in [−1.20334093, −1.00000000]",
                "in [0.250000000, 0.500000000]",
                "[0.1939, 0.8061]",
                "in every window of length 0.1251 in [0.6563, 0.9999]",
            ]
        );
    }
}
