//! Every choice that a code may have made differently.

use super::{Aspect, Explanation, Rank};
use crate::run::{Datum, Setup, Variation};
use crate::text::{Text, text};
use faceoff_fem::contact::{Method, Term};
use faceoff_fem::quadrature;
use faceoff_fem::scene::HRule;

/// A choice, how the scheme has it then, and what is said of who made it.
pub(super) struct Candidate {
    pub ingredient: Aspect,
    pub what: Text,
    pub term: Term,
    /// Does it change no other term?
    pub alone: bool,
    pub variation: Variation,
}

impl Candidate {
    /// With the residual that is left.
    pub fn leaving(self, left: f64) -> Explanation {
        Explanation {
            term: Some(self.term),
            ..Explanation::new(self.ingredient, self.what, Rank::Choice, left)
        }
    }
}

/// All of them for a setup: quadratures, h, signs, parts of the boundary, methods.
pub(super) fn candidates(setup: &Setup) -> Vec<Candidate> {
    let (dim, discretisation) = (setup.mesh.dim, &setup.discretisation);
    let mut all = Vec::new();
    let mut add = |ingredient, what: Text, (term, alone), variation| {
        all.push(Candidate {
            ingredient,
            what,
            term,
            alone,
            variation,
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
            add(Aspect::LoadRule, what, (Term::Load, true), variation);
        }
        for rule in others(dim - 1, contact.name) {
            let what = text!("Γ_C is integrated by {}, not {}", rule, contact.name);
            let variation = Variation::ContactRule(rule.into());
            // t is integrated by it as well.
            let term = (Term::Contact, setup.scene.data().t.is_zero());
            add(Aspect::ContactRule, what, term, variation);
        }
    }
    let (h, what) = match discretisation.h {
        HRule::Local => (HRule::Global, "h in γ = γ₀ h is global, not local"),
        HRule::Global => (HRule::Local, "h in γ = γ₀ h is local, not global"),
    };
    add(
        Aspect::H,
        what.into(),
        (Term::Contact, true),
        Variation::H(h),
    );
    for datum in Datum::ALL {
        if !datum.of(setup.scene.data()).is_zero() {
            let (name, term) = (datum.name(), (term_of(datum), true));
            let [negated, zero] = [text!("{} has the other sign", name), text!("{} is 0", name)];
            add(
                Aspect::Datum(datum),
                negated,
                term,
                Variation::Negated(datum),
            );
            add(Aspect::Datum(datum), zero, term, Variation::Zero(datum));
        }
    }
    for (i, k, names) in [
        (2, 1, text!("Γ_C and Γ_N")),
        (2, 0, text!("Γ_C and Γ_D")),
        (1, 0, text!("Γ_N and Γ_D")),
    ] {
        let what = text!("{} are swapped", names);
        let swapped = Variation::Swapped(i, k);
        add(Aspect::Boundary, what, (Term::Dirichlet, false), swapped);
    }
    for other in methods(discretisation.method) {
        let names = [other, discretisation.method].map(|method| method.to_string());
        let [solved, own] = names;
        let what = text!("it solves {}, not {}", solved, own);
        let variation = Variation::Method(other);
        add(Aspect::Method, what, (Term::Contact, false), variation);
    }
    all
}

pub(super) fn term_of(datum: Datum) -> Term {
    match datum {
        Datum::F | Datum::T => Term::Load,
        Datum::G => Term::Dirichlet,
        Datum::Psi => Term::Contact,
    }
}

/// The other methods on the same element.
fn methods(own: Method) -> impl Iterator<Item = Method> {
    let family = [[1, 0], [1, 1], [0, 1], [-1, 0], [-1, 1], [0, 0]];
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
