//! What is wrong in one sentence, what that rests on, and what to do next.

use super::headline::settled;
use super::model::{count, sentence};
use crate::campaigns::verify::{VerifyOutcome, telling};
use crate::engine::unique;
use crate::run::Failure;
use crate::text::number::{number, place, share, size, whole};
use crate::text::{Text, at_most, text};
use crate::why::{self, Diagnosis, Explanation, Findings};
use faceoff_judge::Verdict;

/// `**name:** γ is 1 % too large on one contact face`
pub(super) fn claim(name: &str, found: &Findings) -> Text {
    if let Some(culprit) = found.culprit() {
        return text!("**{}:** {}", name, in_short(culprit));
    }
    let place = match found.worst.first() {
        Some(_) if 2 * found.failing > found.rows => " nearly anywhere".into(),
        Some(spot) => text!(" at {}", spot.carrier()),
        None => Text::default(),
    };
    text!("**{}** does not solve the scheme{}", name, place)
}

/// An explanation without places and digits.
fn in_short(of: &Explanation) -> Text {
    let is_gamma = of.is_gamma();
    let on = match of.at.len() {
        0 => "on all contact faces".into(),
        1 => "on one contact face".into(),
        more => text!("on {} contact faces", whole(more)),
    };
    match of.factor {
        Some(factor) if is_gamma => text!("γ is {} {}", too_much(factor), on),
        None if is_gamma => text!("γ is wrong {}", on),
        _ => of.brief.clone(),
    }
}

/// By how much a factor is not 1.
fn too_much(factor: f64) -> String {
    let off = factor - 1.0;
    let way = if off > 0.0 { "large" } else { "small" };
    match off.abs() {
        o if o < 1e-3 => format!("too {way} by {} of itself", size(o)),
        _ if (0.5..2.0).contains(&factor) => format!("{} too {way}", share(off.abs())),
        _ => format!("{} times what it should be", number(factor, 4)),
    }
}

/// How many equations a field fails, and with what change none.
pub(super) fn equations(found: &Findings, of: &str) -> Text {
    let most = found.worst.first().map_or(Text::default(), |spot| {
        text!(
            ", most that of {} at {}",
            spot.carrier(),
            place(&spot.midpoint)
        )
    });
    let fails = text!(
        "It fails **{} of {} equations** of {}{}.",
        whole(found.failing),
        whole(found.rows),
        of,
        most
    );
    let change = match found.culprit() {
        Some(culprit) => {
            let with = match (culprit.factor, &culprit.at[..]) {
                (Some(factor), [spot]) if culprit.is_gamma() => {
                    text!("With **{} γ on {}**", number(factor, 5), spot.carrier())
                }
                (Some(factor), []) if culprit.is_gamma() => {
                    text!(
                        "With **{} γ**",
                        number(
                            factor,
                            (3.0 - (factor - 1.0).abs().log10()).clamp(4.0, 13.0) as usize
                        )
                    )
                }
                _ => "With this one change".into(),
            };
            text!(
                "{} it solves them all: the residual falls from {} to {}.",
                with,
                size(found.residual),
                size(culprit.left)
            )
        }
        None => {
            let suspects = found.terms.iter().filter(|t| t.suspect);
            let suspects = suspects.map(|t| Text::strong(why::name(t.term)));
            let suspects: Vec<Text> = suspects.collect();
            let nearest = found
                .explanations
                .first()
                .filter(|e| e.left < 0.1 * found.residual);
            let more = match (nearest, &suspects[..]) {
                (Some(e), _) => text!("; the nearest, {}, leaves {}", in_short(e), size(e.left)),
                (None, []) => Text::default(),
                (None, some) => {
                    text!("; all that fail contain {}", Text::joined(some, " or "))
                }
            };
            text!(
                "The residual is {}, and no single change of the scheme explains it{}.",
                size(found.residual),
                more
            )
        }
    };
    text!("{} {}", fails, change)
}

/// A few words for a number of things.
pub(super) fn counted(number: usize) -> String {
    let words = [
        "No", "One", "Two", "Three", "Four", "Five", "Six", "Seven", "Eight", "Nine",
    ];
    words
        .get(number)
        .map_or_else(|| whole(number), |word| (*word).to_owned())
}

/// `a, b and c`
fn listed(names: &[&str]) -> String {
    match names {
        [all @ .., last] if !all.is_empty() => format!("{} and {last}", all.join(", ")),
        _ => names.concat(),
    }
}

/// What stands first on the page of `verify`.
pub(super) fn claim_of(outcome: &VerifyOutcome, word: &str) -> Text {
    if let Some((case, engine)) = outcome.culprit() {
        if case.engines.len() > 1 && case.engines.iter().all(|e| !e.converged) {
            return text!(
                "**No code converged** in {}",
                count(engine.iterations, "step")
            );
        }
        return match &engine.findings {
            _ if !engine.finite => {
                text!("**{}** gives values that are not finite", &engine.engine)
            }
            Some(found) if !found.solves() => claim(&engine.engine, found),
            _ if !engine.converged => {
                text!(
                    "**{}** did not converge in {}",
                    &engine.engine,
                    count(engine.iterations, "step")
                )
            }
            _ => text!("**{}** does not solve the scheme", &engine.engine),
        };
    }
    if outcome.verdict.passes() {
        let cases = match outcome.cases.len() {
            1 => text!("in {}", outcome.cases[0].label()),
            2 => "in both cases".into(),
            all => text!("in all {} cases", whole(all)),
        };
        let rounding = if word == "agree" { ", to rounding" } else { "" };
        return text!(
            "{} codes **{}** {}{}",
            counted(outcome.engines().len()),
            word,
            cases,
            rounding
        );
    }
    if outcome.verdict == Verdict::Several {
        return text!("**Several solutions:** no code is wrong, and the scheme has more than one");
    }
    if let Some(case) = outcome.differing() {
        let apart: Vec<&str> = unique(
            case.pairs
                .iter()
                .filter(|p| !p.field.verdict.passes())
                .flat_map(|p| [&*p.a, &*p.b]),
        );
        return text!(
            "**{}** differ, though each solves the scheme",
            listed(&apart)
        );
    }
    let silent = unique(outcome.failures.iter().map(|f| &*f.engine));
    match &silent[..] {
        [] if outcome.verdict == Verdict::Disagree => {
            text!("**The certified bounds** of two methods do not fit together")
        }
        [] => text!("**There is nothing to compare**: fewer than two codes answered"),
        some => text!("**{}** gave no answer", listed(some)),
    }
}

/// What the claim rests on.
pub(super) fn lede_of(
    outcome: &VerifyOutcome,
    diagnoses: &[Diagnosis],
    missing: &[Failure],
) -> Text {
    let mut told: Vec<Text> = Vec::new();
    let fault = outcome.at_fault();
    if let Some((case, engine)) = outcome.culprit() {
        match &engine.findings {
            Some(found) => told.push(equations(found, &case.label())),
            None => {
                let lost = engine.answer.u.iter().filter(|u| !u.is_finite()).count();
                told.push(match lost {
                    0 => text!(
                        "In {} the last increment is {}.",
                        case.label(),
                        size(engine.increments.last().copied().unwrap_or(f64::NAN))
                    ),
                    lost => text!(
                        "In {} **{} of {} values** are not finite.",
                        case.label(),
                        whole(lost),
                        whole(case.dofs)
                    ),
                });
            }
        }
    } else if let Some(why) = settled(outcome) {
        told.push(text!("{}.", why.capitalised()));
    } else if let Some(case) = outcome.differing() {
        let why = diagnoses.iter().map(Diagnosis::sentence).next();
        let why = why.unwrap_or_else(|| text!("`--diagnose` runs the codes again to see why"));
        told.push(text!("{}: {}.", case.label(), why));
    }
    told.extend(
        outcome
            .failures
            .iter()
            .chain(missing)
            .map(|f| Text::message(&sentence(&f.message))),
    );
    for (c, _) in telling(&outcome.cross) {
        if let Some(judged) = c.judged.filter(|j| !j.verdict.passes()) {
            told.push(text!("{}: {} by {} is certified to {} and {} by {} to {}, where {} is proved to be possible on that mesh.", &c.scene, &c.a.method, &c.a.engine, at_most(judged.bounds[0], 2), &c.b.method, &c.b.engine, at_most(judged.bounds[1], 2), at_most(judged.best, 2)));
        }
    }
    let right: Vec<&str> = outcome
        .engines()
        .into_iter()
        .filter(|name| !fault.contains(name))
        .collect();
    let cases = outcome.cases.len();
    if !outcome.verdict.passes() && !right.is_empty() && differing_only_by(outcome, &fault) {
        let pairs = outcome.pairs();
        let among = pairs
            .filter(|p| right.contains(&&*p.a) && right.contains(&&*p.b))
            .map(|p| p.field.max_rel);
        let within = match among.reduce(f64::max) {
            Some(apart) => text!(", and within {} of each other", size(apart)),
            None => Text::default(),
        };
        let is = if right.len() == 1 { "solves" } else { "solve" };
        let all = match cases {
            1 => "it".into(),
            2 => "both cases".into(),
            cases => text!("all {} cases", whole(cases)),
        };
        told.push(text!(
            "{} {} {} to rounding{}.",
            listed(&right),
            is,
            all,
            within
        ));
    }
    Text::joined(told, " ")
}

/// Do all others agree?
fn differing_only_by(outcome: &VerifyOutcome, fault: &[&str]) -> bool {
    let pairs = outcome.pairs();
    let mut others = pairs.filter(|p| !fault.contains(&&*p.a) && !fault.contains(&&*p.b));
    others.all(|p| p.field.verdict.passes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn how_much_is_said_as_a_person_says_it() {
        let of = |factor| too_much(factor).replace('\u{202f}', " ");
        assert_eq!(of(1.01), "1 % too large");
        assert_eq!(of(0.9), "10 % too small");
        assert_eq!(of(1.000_001), "too large by 1.0 · 10⁻⁶ of itself");
        assert_eq!(of(1e4), "10 000 times what it should be");
        assert_eq!(listed(&["a", "b", "c"]), "a, b and c");
        assert_eq!(listed(&["a"]), "a");
    }
}
