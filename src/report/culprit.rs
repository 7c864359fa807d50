//! What is wrong in one sentence, what that rests on, and what to do next.

use super::headline::{culprit, settled};
use super::model::count;
use super::number::{number, place, share, size, whole};
use super::verify::label;
use crate::campaigns::verify::{CaseOutcome, EngineOutcome, VerifyOutcome, telling};
use crate::engine::unique;
use crate::run::Failure;
use crate::why::{self, Diagnosis, Explanation, Findings, Spot};
use faceoff_judge::Verdict;

/// More words than these do not make a headline.
const BRIEF: usize = 90;

/// `**name:** γ is 1 % too large on one contact face`
pub(super) fn claim(name: &str, found: &Findings) -> String {
    if let Some(culprit) = found.culprit() {
        return format!("**{name}:** {}", in_short(culprit));
    }
    let place = match found.worst.first() {
        Some(_) if 2 * found.failing > found.rows => " nearly anywhere".to_owned(),
        Some(spot) => format!(" at {}", carrier(spot)),
        None => String::new(),
    };
    format!("**{name}** does not solve the scheme{place}")
}

/// An explanation without places and digits.
fn in_short(of: &Explanation) -> String {
    let is_gamma = of.ingredient == "γ";
    let on = match of.at.len() {
        0 => "on all contact faces".to_owned(),
        1 => "on one contact face".to_owned(),
        more => format!("on {} contact faces", whole(more)),
    };
    match of.factor {
        Some(factor) if is_gamma => format!("γ is {} {on}", too_much(factor)),
        None if is_gamma => format!("γ is wrong {on}"),
        _ => {
            // Up to the first place that it names.
            let named = [
                " on face ",
                " on edge ",
                " on vertex ",
                ", face ",
                ", as when ",
                ", as after ",
            ];
            let ends = named.iter().filter_map(|word| of.what.find(word));
            let end = ends.min().unwrap_or(of.what.len());
            let what = &of.what[..end];
            match what.char_indices().nth(BRIEF) {
                Some((end, _)) => format!("{}…", &what[..end]),
                None => what.to_owned(),
            }
        }
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

/// `face [6, 7]`
pub(super) fn carrier(spot: &Spot) -> String {
    let kind = match spot.vertices.len() {
        1 => "vertex",
        n if n == spot.midpoint.len() => "face",
        _ => "edge",
    };
    format!("{kind} {:?}", spot.vertices)
}

/// How many equations a field fails, and with what change none.
pub(super) fn equations(found: &Findings, of: &str) -> String {
    let most = found.worst.first().map_or(String::new(), |spot| {
        format!(
            ", most that of {} at {}",
            carrier(spot),
            place(&spot.midpoint)
        )
    });
    let fails = format!(
        "It fails **{} of {} equations** of {of}{most}.",
        whole(found.failing),
        whole(found.rows)
    );
    let change = match found.culprit() {
        Some(culprit) => {
            let with = match (culprit.factor, &culprit.at[..]) {
                (Some(factor), [spot]) if culprit.ingredient == "γ" => {
                    format!("With **{} γ on {}**", number(factor, 5), carrier(spot))
                }
                (Some(factor), []) if culprit.ingredient == "γ" => {
                    format!(
                        "With **{} γ**",
                        number(
                            factor,
                            (3.0 - (factor - 1.0).abs().log10()).clamp(4.0, 13.0) as usize
                        )
                    )
                }
                _ => "With this one change".into(),
            };
            format!(
                "{with} it solves them all: the residual falls from {} to {}.",
                size(found.residual),
                size(culprit.left)
            )
        }
        None => {
            let suspects = found.terms.iter().filter(|t| t.suspect);
            let suspects: Vec<&str> = suspects.map(|t| why::name(t.term)).collect();
            let nearest = found
                .explanations
                .first()
                .filter(|e| e.left < 0.1 * found.residual);
            let more = match (nearest, &suspects[..]) {
                (Some(e), _) => format!("; the nearest, {}, leaves {}", in_short(e), size(e.left)),
                (None, []) => String::new(),
                (None, some) => format!("; all that fail contain **{}**", some.join("** or **")),
            };
            format!(
                "The residual is {}, and no single change of the scheme explains it{more}.",
                size(found.residual)
            )
        }
    };
    format!("{fails} {change}")
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

/// The engines that answered anything.
fn names(outcome: &VerifyOutcome) -> Vec<&str> {
    unique(
        outcome
            .cases
            .iter()
            .flat_map(|c| &c.engines)
            .map(|e| &*e.engine),
    )
}

/// Those whose answers do not all solve their schemes.
pub(super) fn at_fault(outcome: &VerifyOutcome) -> Vec<&str> {
    let answers = outcome.cases.iter().flat_map(|c| &c.engines);
    unique(answers.filter(|e| !e.verdict.passes()).map(|e| &*e.engine))
}

/// The first case whose answers differ although each solves the scheme.
pub(super) fn differing(outcome: &VerifyOutcome) -> Option<&CaseOutcome> {
    outcome
        .cases
        .iter()
        .find(|case| !case.verdict.passes() && !case.pairs.is_empty())
}

/// What stands first on the page of `verify`.
pub(super) fn claim_of(outcome: &VerifyOutcome, word: &str) -> String {
    if let Some((case, engine)) = culprit(outcome) {
        if case.engines.len() > 1 && case.engines.iter().all(|e| !e.converged) {
            return format!(
                "**No code converged** in {}",
                count(engine.iterations, "step")
            );
        }
        return match &engine.findings {
            _ if !engine.finite => {
                format!("**{}** gives values that are not finite", engine.engine)
            }
            Some(found) if !found.solves() => claim(&engine.engine, found),
            _ if !engine.converged => {
                format!(
                    "**{}** did not converge in {}",
                    engine.engine,
                    count(engine.iterations, "step")
                )
            }
            _ => format!("**{}** does not solve the scheme", engine.engine),
        };
    }
    if outcome.verdict.passes() {
        let cases = match outcome.cases.len() {
            1 => format!("in {}", label(&outcome.cases[0])),
            2 => "in both cases".into(),
            all => format!("in all {} cases", whole(all)),
        };
        let rounding = if word == "agree" { ", to rounding" } else { "" };
        return format!(
            "{} codes **{word}** {cases}{rounding}",
            counted(names(outcome).len())
        );
    }
    if outcome.verdict == Verdict::Several {
        return "**Several solutions:** no code is wrong, and the scheme has more than one".into();
    }
    if let Some(case) = differing(outcome) {
        let apart: Vec<&str> = unique(
            case.pairs
                .iter()
                .filter(|p| !p.field.verdict.passes())
                .flat_map(|p| [&*p.a, &*p.b]),
        );
        return format!(
            "**{}** differ, though each solves the scheme",
            listed(&apart)
        );
    }
    let silent = unique(outcome.failures.iter().map(|f| &*f.engine));
    match &silent[..] {
        [] if outcome.verdict == Verdict::Disagree => {
            "**The certified bounds** of two methods do not fit together".into()
        }
        [] => "**There is nothing to compare**: fewer than two codes answered".into(),
        some => format!("**{}** gave no answer", listed(some)),
    }
}

/// What the claim rests on.
pub(super) fn lede_of(
    outcome: &VerifyOutcome,
    diagnoses: &[Diagnosis],
    missing: &[Failure],
) -> String {
    let mut told = Vec::new();
    let fault = at_fault(outcome);
    if let Some((case, engine)) = culprit(outcome) {
        match &engine.findings {
            Some(found) => told.push(equations(found, &label(case))),
            None => {
                let lost = engine.answer.u.iter().filter(|u| !u.is_finite()).count();
                told.push(match lost {
                    0 => format!(
                        "In {} the last increment is {}.",
                        label(case),
                        size(engine.increments.last().copied().unwrap_or(f64::NAN))
                    ),
                    lost => format!(
                        "In {} **{} of {} values** are not finite.",
                        label(case),
                        whole(lost),
                        whole(case.dofs)
                    ),
                });
            }
        }
    } else if let Some(why) = settled(outcome) {
        let (first, rest) = why.split_at(1);
        told.push(format!("{}{rest}.", first.to_uppercase()));
    } else if let Some(case) = differing(outcome) {
        let why = diagnoses.iter().map(Diagnosis::sentence).next();
        let why = why.unwrap_or_else(|| "`--diagnose` runs the codes again to see why".into());
        told.push(format!("{}: {why}.", label(case)));
    }
    told.extend(
        outcome
            .failures
            .iter()
            .chain(missing)
            .map(|f| format!("{}.", f.message.trim_end_matches('.'))),
    );
    for (c, _) in telling(&outcome.cross) {
        if let Some(judged) = c.judged.filter(|j| !j.verdict.passes()) {
            told.push(format!(
                "{}: {} by {} is certified to {} and {} by {} to {}, where {} is proved to be possible on that mesh.",
                c.scene, c.a.method, c.a.engine, size(judged.bounds[0]), c.b.method, c.b.engine, size(judged.bounds[1]), size(judged.best)
            ));
        }
    }
    let right: Vec<&str> = names(outcome)
        .into_iter()
        .filter(|name| !fault.contains(name))
        .collect();
    let cases = outcome.cases.len();
    if !outcome.verdict.passes() && !right.is_empty() && differing_only_by(outcome, &fault) {
        let pairs = outcome.cases.iter().flat_map(|c| &c.pairs);
        let among = pairs
            .filter(|p| right.contains(&&*p.a) && right.contains(&&*p.b))
            .map(|p| p.field.max_rel);
        let within = match among.reduce(f64::max) {
            Some(apart) => format!(", and within {} of each other", size(apart)),
            None => String::new(),
        };
        let is = if right.len() == 1 { "solves" } else { "solve" };
        let all = match cases {
            1 => "it".to_owned(),
            2 => "both cases".into(),
            cases => format!("all {} cases", whole(cases)),
        };
        told.push(format!(
            "{} {is} {all} to rounding{within}.",
            listed(&right)
        ));
    }
    told.join(" ")
}

/// Do all others agree?
fn differing_only_by(outcome: &VerifyOutcome, fault: &[&str]) -> bool {
    let pairs = outcome.cases.iter().flat_map(|c| &c.pairs);
    let mut others = pairs.filter(|p| !fault.contains(&&*p.a) && !fault.contains(&&*p.b));
    others.all(|p| p.field.verdict.passes())
}

/// The engine that stands beside the culprit: the first that is right.
pub(super) fn reference<'a>(case: &'a CaseOutcome, fault: &[&str]) -> Option<&'a EngineOutcome> {
    case.engines.iter().find(|e| !fault.contains(&&*e.engine))
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
