//! A certificate as scripts and people read it.

use serde::Serialize;

use super::model::{joined, percent, short};
use super::outward::{Digits, above, below, interval};
use faceoff_fem::certify::{Certificate, Numbers, OfPart, Parts, Target};

/// Bounds of ‖∇u - …‖ for one target, and what they are made of.
#[derive(Debug, Clone, Serialize)]
pub struct Certified {
    /// Whose error is bounded.
    pub target: Target,
    /// The error is at most this.
    pub upper: f64,
    /// The error is at least this.
    pub lower: f64,
    /// `upper` over a bound of ‖∇u‖ from below; none where that is 0.
    pub relative: Option<f64>,
    /// What is known of the data and no flux balances; as in `parts`.
    pub oscillation: f64,
    /// What `upper` is made of.
    pub parts: Parts,
    /// Every target's upper bound.
    pub bounds: Bounds,
    /// ‖∇u‖ is at least and at most this.
    pub gradient: [f64; 2],
    /// J(u) = ½‖∇u‖² - (f,u) - <t,u> is at least and at most this.
    pub energy: [f64; 2],
    /// Numbers of u, each in its interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub numbers: Option<Numbers>,
}

/// Upper bounds, as in [`Certificate`].
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Bounds {
    /// ‖∇u-G‖ is at most this.
    pub g: f64,
    /// ‖∇(u-v)‖ is at most this.
    pub v: f64,
    /// ‖∇u-∇u_h‖_h is at most this.
    pub u_h: f64,
}

impl Certified {
    /// What a certificate says of a target.
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

    /// What is proved of u, a line each.
    pub fn facts(&self) -> Vec<(&'static str, String)> {
        let interval = |of: [f64; 2]| format!("in {}", interval(of, 8));
        let mut facts = vec![("energy J(u)", interval(self.energy))];
        let Some(numbers) = &self.numbers else {
            return facts;
        };
        facts.extend(
            numbers
                .contact_force
                .map(|of| ("contact force", interval(of))),
        );
        let of_parts = |what: &'static str, parts: &[OfPart]| {
            let of_part = |of: &OfPart| match of.interval {
                Some(of_part) => format!("{} {}", of.part, interval(of_part)),
                None => format!("{} not known, as it meets another group", of.part),
            };
            (!parts.is_empty()).then(|| (what, joined(parts.iter().map(of_part), "; ")))
        };
        facts.extend(of_parts("contact force on", &numbers.contact_forces));
        facts.extend(
            numbers
                .dirichlet_flux
                .map(|of| ("flux on Γ_D", interval(of))),
        );
        facts.extend(of_parts("flux on", &numbers.dirichlet_fluxes));
        facts.push(("mean of u", interval(numbers.mean)));
        facts.extend(of_parts("mean of u over", &numbers.means));
        if let Some(contact) = &numbers.contact {
            // Less of Γ_C, and longer windows.
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
            let or_none = |words: String| {
                if words.is_empty() {
                    "nowhere".into()
                } else {
                    words
                }
            };
            facts.push(("free for certain", or_none(joined(free, ", "))));
            facts.push(("contact for certain", or_none(joined(touched, "; "))));
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
        short(above(self.upper, Digits::Counting(3)))
    }

    /// One line.
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
            "the error {of} is at most {:.4e}{relative}; ‖∇u‖ is in {}",
            above(self.upper, Digits::Counting(5)),
            interval(self.gradient, 6)
        )
    }
}

/// A relative bound, with three digits.
pub fn percent_above(relative: f64) -> String {
    percent(above(relative, Digits::Counting(3)))
}
