//! All changes of a scene's scheme that a code may have made: choices, and numbers.

use super::{Aspect, Explanation, Rank};
use crate::run::{Datum, Setup, Variation};
use crate::text::{Number, Text, text};
use faceoff_fem::contact::{Method, Term};
use faceoff_fem::quadrature;
use faceoff_fem::scene::HRule;
use faceoff_form::judge::recovery::Column;

/// A change with its explanation.
pub(super) struct Entry {
    pub make: Make,
    /// The explanation for a number; its remaining residual is filled in later.
    pub say: Box<dyn Fn(f64) -> Explanation + Sync>,
}

/// How the change is applied.
pub(super) enum Make {
    /// A different scheme.
    Choice(Variation),
    /// A scheme with a number, which is 0 for the unchanged one.
    Number {
        with: Box<dyn Fn(f64) -> Variation + Sync>,
        /// The scale of the number.
        size: f64,
        /// Further initial guesses for the number.
        starts: &'static [f64],
    },
    /// u times 1 + a number.
    Values { starts: &'static [f64] },
    /// The known remaining residual, relative to the sizes of the rows.
    Known(Vec<f64>),
}

impl Entry {
    /// A change whose remaining residual is known.
    pub fn known(left: Vec<f64>, found: Explanation) -> Self {
        Entry {
            make: Make::Known(left),
            say: Box::new(move |_| found.clone()),
        }
    }
}

impl Make {
    /// Is it a change without a number?
    pub fn is_whole(&self) -> bool {
        matches!(self, Make::Choice(_) | Make::Known(_))
    }

    /// The column of the recovery with this vector.
    pub fn column(&self, vector: Vec<f64>) -> Column {
        match self {
            Make::Choice(_) | Make::Known(_) => Column::whole(vector),
            Make::Number { size, starts, .. } => Column {
                starts,
                ..Column::number(vector, *size)
            },
            Make::Values { starts } => Column {
                starts,
                ..Column::number(vector, 1.0)
            },
        }
    }
}

/// All changes for a setup, given the size of its answers.
pub(super) fn dictionary(setup: &Setup, size: f64) -> Vec<Entry> {
    let mut all = choices(setup);
    all.extend(numbers(setup, size));
    all
}

/// Changes of quadrature rules, h, signs, boundary parts and methods.
fn choices(setup: &Setup) -> Vec<Entry> {
    let (dim, discretisation) = (setup.mesh.dim, &setup.discretisation);
    let mut all = Vec::new();
    let mut add = |ingredient, what: Text, term, variation| {
        let say = move |_| Explanation {
            term: Some(term),
            ..Explanation::new(ingredient, what.clone(), Rank::Choice, 0.0)
        };
        all.push(Entry {
            make: Make::Choice(variation),
            say: Box::new(say),
        });
    };
    if let Ok([load, contact]) = discretisation.rules(dim) {
        let others = |dim: usize, own: &'static str| {
            let known = quadrature::names(dim).iter();
            let all = known.chain(quadrature::foreign(dim)).copied();
            all.filter(move |rule| *rule != own)
        };
        for rule in others(dim, load.name) {
            let what = text!("(f,v) is integrated by {}, not {}", rule, load.name);
            let variation = Variation::LoadRule(rule.into());
            add(Aspect::LoadRule, what, Term::Load, variation);
        }
        for rule in others(dim - 1, contact.name) {
            let what = text!("Γ_C is integrated by {}, not {}", rule, contact.name);
            let variation = Variation::ContactRule(rule.into());
            add(Aspect::ContactRule, what, Term::Contact, variation);
        }
    }
    let (h, what) = match discretisation.h {
        HRule::Local => (HRule::Global, "h in γ = γ₀ h is global, not local"),
        HRule::Global => (HRule::Local, "h in γ = γ₀ h is local, not global"),
    };
    add(Aspect::H, what.into(), Term::Contact, Variation::H(h));
    for datum in Datum::ALL {
        if !datum.of(setup.scene.data()).is_zero() {
            let (name, term) = (datum.name(), term_of(datum));
            let [negated, zero] = [text!("{} has the other sign", name), text!("{} is 0", name)];
            let aspect = Aspect::Datum(datum);
            add(aspect, negated, term, Variation::Negated(datum));
            add(aspect, zero, term, Variation::Zero(datum));
        }
    }
    for (i, k, names) in [
        (2, 1, text!("Γ_C and Γ_N")),
        (2, 0, text!("Γ_C and Γ_D")),
        (1, 0, text!("Γ_N and Γ_D")),
    ] {
        let what = text!("{} are swapped", names);
        let swapped = Variation::Swapped(i, k);
        add(Aspect::Boundary, what, Term::Dirichlet, swapped);
    }
    for other in methods(discretisation.method) {
        let names = [other, discretisation.method].map(|method| method.to_string());
        let [solved, own] = names;
        let what = text!("it solves {}, not {}", solved, own);
        add(
            Aspect::Method,
            what,
            Term::Contact,
            Variation::Method(other),
        );
    }
    all
}

fn term_of(datum: Datum) -> Term {
    match datum {
        Datum::F | Datum::T => Term::Load,
        Datum::G => Term::Dirichlet,
        Datum::Psi => Term::Contact,
    }
}

/// The other methods on the same element.
fn methods(own: Method) -> impl Iterator<Item = Method> {
    // With θ₁ = θ₂ = 0 and no contact, a scheme has many solutions, including those of the others.
    let family = [[1, 0], [1, 1], [0, 1], [-1, 0], [-1, 1]];
    let family = family.map(|theta| {
        let [theta1, theta2] = theta.map(f64::from);
        Method::nitsche(own.element, theta1, theta2)
    });
    let named = ["cr-fc", "cr-vi", "p1-vi", "penalty", "multiplier"];
    let named = named
        .into_iter()
        .filter_map(|name| name.parse::<Method>().ok());
    let all = family.into_iter().chain(named);
    all.filter(move |other| other.element.name() == own.element.name() && other.law != own.law)
}

/// γ₀, every datum times a number or plus a number, and u times a number.
fn numbers(setup: &Setup, size: f64) -> Vec<Entry> {
    let (data, gamma0) = (setup.scene.data(), setup.discretisation.gamma0());
    let mut all = Vec::new();
    let mut add = |make, say: Box<dyn Fn(f64) -> Explanation + Sync>| all.push(Entry { make, say });
    let number = |aspect, what, term, factor| Explanation {
        term,
        factor,
        ..Explanation::new(aspect, what, Rank::Number, 0.0)
    };
    if setup.discretisation.method.is_nitsche() {
        add(
            Make::Number {
                with: Box::new(move |log: f64| Variation::Gamma0(gamma0 * log.exp())),
                size: 1.0,
                // In the limits 0 and infinity the answer no longer depends on γ, and many values would fit.
                starts: &[0.0, -2.3, 2.3, -4.6, 4.6, -9.2, 9.2],
            },
            Box::new(move |log: f64| {
                let factor = log.exp();
                let exact: f64 = format!("{:.9e}", factor * gamma0).parse().unwrap_or(factor);
                let what = text!("γ is {} on all faces", times(factor));
                let found = number(Aspect::Gamma, what, Some(Term::Contact), Some(factor));
                found.more(text!(", as with γ₀ = {}", Number::exact(exact)))
            }),
        );
    }
    let is_homogeneous = [Datum::G, Datum::Psi].iter().all(|d| d.of(data).is_zero());
    for datum in Datum::ALL {
        let (name, term) = (datum.name(), Some(term_of(datum)));
        let or_u = match datum {
            Datum::F if is_homogeneous && data.t.is_zero() => " (or u as a whole)",
            _ => "",
        };
        if !datum.of(data).is_zero() {
            add(
                Make::Number {
                    with: Box::new(move |more: f64| Variation::Scaled(datum, 1.0 + more)),
                    size: 1.0,
                    starts: &[],
                },
                Box::new(move |more: f64| {
                    let what = text!("{} is {}{}", name, times(1.0 + more), or_u);
                    number(Aspect::Datum(datum), what, term, Some(1.0 + more))
                }),
            );
        }
        add(
            Make::Number {
                with: Box::new(move |by: f64| Variation::Shifted(datum, by)),
                size,
                starts: &[],
            },
            Box::new(move |by: f64| {
                let way = if by > 0.0 { "large" } else { "small" };
                let by = Number::power(rounded(by.abs()));
                let what = text!("{} is {} too {}", name, by, way);
                number(Aspect::Datum(datum), what, term, None)
            }),
        );
    }
    add(
        Make::Values { starts: &[-2.0] },
        Box::new(move |more: f64| {
            let factor = 1.0 / (1.0 + more);
            let what = text!("u is {} as a whole", times(factor));
            number(Aspect::U, what, None, Some(factor))
        }),
    );
    all
}

/// `× 1.00100`: three digits of the deviation from 1.
pub(super) fn times(factor: f64) -> Text {
    let off = (factor - 1.0).abs();
    let number = match off {
        _ if !(0.1..1e6).contains(&factor.abs()) => Number::new(factor, 7),
        off if off < 1e-11 => Number::fixed(1.0, 0),
        _ => {
            // The digits of 0.000999999 are those of 0.001.
            let power = (off * (1.0 + 1e-6)).log10().floor();
            let digits = (2.0 - power).clamp(3.0, 14.0) as usize;
            Number::fixed(factor, digits)
        }
    };
    text!("× {}", number)
}

/// The number with four digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_have_three_digits_of_their_own() {
        let factors = [1.000_999_999_9, 1.01, 1.000_001, 2.0, -1.0, 77.0, 1e-8];
        let words = factors.map(|factor| times(factor).to_string());
        let expected = [
            "× 1.00100",
            "× 1.0100",
            "× 1.00000100",
            "× 2.000",
            "× -1.000",
            "× 77.000",
            "× 1.000000e-8",
        ];
        assert_eq!(words, expected);
        let rounded = [1e-6, 0.25].map(|value| Number::power(rounded(value)).to_string());
        assert_eq!(rounded, ["1e-6", "2.5e-1"]);
    }
}
