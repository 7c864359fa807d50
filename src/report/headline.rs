//! What `verify` says first and last: which code does what differently, and every case in a line.

use super::model::{Table, count, joined, short, table, word};
use crate::campaigns::verify::{CaseOutcome, Settled, VerifyOutcome};
use crate::run::RESIDUAL_TOLERANCE;
use crate::text::number::place;
use crate::text::{Number, Text, at_most, text};
use crate::why::Diagnosis;
use faceoff_judge::Verdict;

/// The verdict; and if it is no agreement, which code does what differently, where, and what the others make of it.
pub(super) fn headline(outcome: &VerifyOutcome, diagnoses: &[Diagnosis]) -> Text {
    let verdict = word(outcome.verdict);
    match outcome.verdict {
        Verdict::Agree => return verdict.into(),
        Verdict::Conditioned | Verdict::Several => {
            let why = settled(outcome);
            return Text::joined([Text::from(verdict)].into_iter().chain(why), ": ");
        }
        _ => {}
    }
    let Some((case, engine)) = outcome.culprit() else {
        let failed = outcome.failures.first();
        let differing = |c: &&CaseOutcome| c.verdict == Verdict::Disagree;
        let why = match (failed, outcome.cases.iter().find(differing)) {
            (Some(failure), None) => text!("no answer from {}", &failure.engine),
            (_, Some(case)) => {
                let sentences = diagnoses.iter().map(Diagnosis::sentence);
                let why = sentences.into_iter().next();
                let why = why.unwrap_or_else(|| text!("`--diagnose` runs the codes again"));
                text!(
                    "{}: the answers differ though each solves the scheme: {}",
                    case.label(),
                    why
                )
            }
            (None, None) => "the certified bounds of two methods do not fit together".into(),
        };
        return text!("{}: {}", verdict, why);
    };
    let name = &engine.engine;
    let what = match &engine.findings {
        Some(found) if !found.solves() => found.sentence(),
        _ if !engine.finite => "its values are not finite".into(),
        _ if engine.residual <= RESIDUAL_TOLERANCE => text!(
            "it says that it did not converge in {} steps, though it solves the scheme to {}",
            engine.iterations,
            short(engine.residual)
        ),
        _ => text!("it did not converge in {} steps", engine.iterations),
    };
    let others = case.pairs.iter().filter(|p| p.a != *name && p.b != *name);
    let apart = others.clone().map(|p| p.field.max_rel).reduce(f64::max);
    let others = match (apart, others.map(|p| p.field.verdict).max()) {
        (Some(apart), Some(verdict)) if verdict.passes() => {
            let others = match case.engines.len() - 1 {
                2 => "two".into(),
                others => others.to_string(),
            };
            text!("; the other {} agree to {}", others, Number::new(apart, 2))
        }
        _ => Text::default(),
    };
    let failed = outcome.cases.iter().filter(|case| {
        let mut of = case.engines.iter().filter(|e| e.engine == *name);
        of.any(|e| !e.verdict.passes())
    });
    let (failed, all) = (failed.count(), outcome.cases.len());
    let in_how_many = match all {
        1 => Text::default(),
        _ => text!("; it fails in {} of {} cases", failed, all),
    };
    let silent = outcome
        .failures
        .iter()
        .map(|failure| failure.engine.clone());
    let silent = match joined(silent, ", ") {
        none if none.is_empty() => Text::default(),
        silent => text!("; no answer from {}", silent),
    };
    text!(
        "{}: {}: {}{}{} ({}{})",
        verdict,
        name,
        what,
        others,
        silent,
        case.label(),
        in_how_many
    )
}

/// Why answers that solve their scheme differ, if that is all that is to be said: of the case where they do most.
pub(super) fn settled(outcome: &VerifyOutcome) -> Option<Text> {
    if !matches!(outcome.verdict, Verdict::Conditioned | Verdict::Several) {
        return None;
    }
    let with = outcome
        .cases
        .iter()
        .filter(|case| case.verdict == outcome.verdict);
    let farthest = |case: &CaseOutcome| most(case.pairs.iter().map(|p| p.field.max_rel));
    let case = with.max_by(|a, b| farthest(a).total_cmp(&farthest(b)))?;
    let two = |settled: &&Settled| settled.several.is_some() == (case.verdict == Verdict::Several);
    let settled = case.settled.iter().filter(two);
    let tolerance = |s: &Settled| s.conditioning.worst().map_or(0.0, |part| part.tolerance);
    let settled = settled.max_by(|a, b| tolerance(a).total_cmp(&tolerance(b)))?;
    let (a, b, about) = (&settled.a, &settled.b, case.label());
    if let Some(several) = &settled.several {
        let mesh = &case.setup.mesh;
        let face = several.faces.first().map(|face| {
            let at = place(&mesh.face_midpoint(*face)[..mesh.dim]);
            text!(
                ", first on face {} at {}",
                format!("{:?}", mesh.face(*face)),
                at
            )
        });
        let unique = several.unique_above.map(|gamma0| {
            text!(
                "; with gamma0 above {} there is one only",
                at_most(gamma0, 3)
            )
        });
        return Some(text!(
            "the codes {} and {} have found two solutions of the same scheme, {} of max|u| apart: contact differs at {}{} ({} of {} choices \
                 of contact there solve it){}; no code is wrong ({})",
            a,
            b,
            short(several.apart),
            count(several.differing, "point"),
            face.unwrap_or_default(),
            several.found,
            several.tried,
            unique.unwrap_or_default(),
            about
        ));
    }
    let part = settled.conditioning.worst()?;
    let [of_a, of_b] = part.residuals.map(short);
    Some(text!(
        "the answers differ by {} of max|u|, and rounding alone may move them by {}: condition {} times residuals {} and {} \
                 of {} and {} ({})",
        short(farthest(case)),
        short(part.tolerance),
        short(part.condition),
        of_a,
        of_b,
        a,
        b,
        about
    ))
}

/// The largest, 0 of none; what is not a number is larger than any.
fn most(numbers: impl Iterator<Item = f64>) -> f64 {
    let sizes = numbers.map(f64::abs);
    sizes.max_by(f64::total_cmp).unwrap_or(0.0)
}

/// So many cases fit into a dozen lines.
const CASES: usize = 8;

/// A line a case, those that are farthest from agreement first where they are too many.
pub(super) fn overview(outcome: &VerifyOutcome) -> Table {
    let largest = |case: &CaseOutcome| most(case.pairs.iter().map(|p| p.field.max_rel));
    let excess = |case: &CaseOutcome| {
        let of = case.pairs.iter();
        most(of.map(|p| p.field.max_rel / p.field.tolerance))
    };
    let residual = |case: &CaseOutcome| most(case.engines.iter().map(|e| e.residual));
    let mut cases: Vec<&CaseOutcome> = outcome.cases.iter().collect();
    let more = cases.len().saturating_sub(CASES);
    if more > 0 {
        cases.sort_by(|a, b| {
            let by_verdict = b.verdict.cmp(&a.verdict);
            by_verdict.then(excess(b).total_cmp(&excess(a)))
        });
        cases.truncate(CASES);
    }
    let caption = match more {
        0 => String::new(),
        more => {
            format!(
                "The {CASES} cases that are farthest from agreement; {more} more with --verbose"
            )
        }
    };
    table!(caption, cases, |case|
        "case" => case.label(),
        "codes" => case.engines.len(),
        "largest residual" => residual(case),
        "largest |a-b|" => largest(case),
        "verdict" => case.verdict,
    )
}
