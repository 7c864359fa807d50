//! The story of `verify`: one reading of an outcome, which gives its sentence, its claim, the evidence and the
//! suggestions.

use crate::campaigns::verify::{CaseOutcome, EngineOutcome, Settled, VerifyOutcome, telling};
use crate::engine::{self, unique};
use crate::report::culprit::{claim, equations, look};
use crate::report::model::{Todo, count, joined, sentence, short};
use crate::run::{Failure, RESIDUAL_TOLERANCE};
use crate::text::number::{number, place, size, whole};
use crate::text::{Number, Text, at_most, text};
use crate::why::Diagnosis;
use faceoff_fem::scene::Scene;
use faceoff_judge::Verdict;

/// The conclusions of a run.
#[derive(Default)]
pub(super) struct Told {
    /// The code that differs, how and where, and what the others show; empty if all agree.
    pub sentence: Text,
    /// The same without position and digits.
    pub claim: Text,
    /// The evidence.
    pub because: Text,
    /// The smallest command that shows the fault, its position, and the command that checks the repair.
    pub next: Vec<Todo>,
}

/// From a run, and the requested engines that were left out.
pub(super) fn told(outcome: &VerifyOutcome, diagnoses: &[Diagnosis], missing: &[Failure]) -> Told {
    let mut told = match outcome.culprit() {
        Some((case, engine)) => of_culprit(outcome, case, engine),
        None => without_culprit(outcome, diagnoses),
    };
    let mut because = vec![told.because];
    let silent = outcome.failures.iter().chain(missing);
    because.extend(silent.map(|f| Text::message(&sentence(&f.message))));
    because.extend(telling(&outcome.cross).into_iter().filter_map(|(c, _)| {
        let judged = c.judged.filter(|judged| !judged.verdict.passes())?;
        let [a, b, best] = [judged.bounds[0], judged.bounds[1], judged.best].map(|x| at_most(x, 2));
        Some(text!("{c.scene}: {c.a.method} by {c.a.engine} is certified to {a} and {c.b.method} by {c.b.engine} to {b}, where {best} is proved to be possible on that mesh."))
    }));
    because.extend(others(outcome));
    let said = because.into_iter().filter(|words| !words.is_empty());
    told.because = Text::joined(said, " ");
    told
}

/// An answer does not solve its scheme.
fn of_culprit(outcome: &VerifyOutcome, case: &CaseOutcome, engine: &EngineOutcome) -> Told {
    let (name, label) = (&engine.engine, case.label());
    let steps = count(engine.iterations, "step");
    let found = engine.findings.as_ref();
    let unsolved = found.filter(|found| !found.solves());
    let nothing_converged = case.engines.len() > 1 && case.engines.iter().all(|e| !e.converged);
    let what = match unsolved {
        Some(found) => found.sentence(),
        None if !engine.finite => "its values are not finite".into(),
        None if engine.residual <= RESIDUAL_TOLERANCE => text!(
            "it says that it did not converge in {engine.iterations} steps, though it solves the scheme to {}",
            short(engine.residual)
        ),
        None => text!("it did not converge in {engine.iterations} steps"),
    };
    let claim = match unsolved {
        _ if nothing_converged => text!("**No code converged** in {steps}"),
        _ if !engine.finite => text!("**{name}** gives values that are not finite"),
        Some(found) => claim(name, found),
        None if !engine.converged => text!("**{name}** did not converge in {steps}"),
        None => text!("**{name}** does not solve the scheme"),
    };
    let because = match (
        found,
        engine.answer.u.iter().filter(|u| !u.is_finite()).count(),
    ) {
        (Some(found), _) => equations(found, &label),
        (None, 0) => {
            let last = engine.increments.last().copied().unwrap_or(f64::NAN);
            text!("In {label} the last increment is {}.", size(last))
        }
        (None, lost) => text!(
            "In {label} **{} of {} values** are not finite.",
            whole(lost),
            whole(case.dofs)
        ),
    };

    let others = case.pairs.iter().filter(|p| p.a != *name && p.b != *name);
    let apart = others.clone().map(|p| p.field.max_rel).reduce(f64::max);
    let apart = apart.filter(|_| others.clone().all(|p| p.field.verdict.passes()));
    let others = apart.map(|apart| {
        let others = match case.engines.len() - 1 {
            2 => "two".into(),
            others => others.to_string(),
        };
        let apart = Number::new(apart, 2);
        text!("; the other {others} agree to {apart}")
    });
    let is_wrong = |e: &EngineOutcome| e.engine == *name && !e.verdict.passes();
    let failed = outcome
        .cases
        .iter()
        .filter(|c| c.engines.iter().any(is_wrong));
    let (failed, all) = (failed.count(), outcome.cases.len());
    let in_how_many = (all > 1).then(|| text!("; it fails in {failed} of {all} cases"));
    let silent = joined(outcome.failures.iter().map(|f| f.engine.clone()), ", ");
    let silent = (!silent.is_empty()).then(|| text!("; no answer from {silent}"));

    let code = as_typed(name);
    let fault = outcome.at_fault();
    let beside = || {
        case.engines
            .iter()
            .map(|e| &*e.engine)
            .filter(|of| of != name)
    };
    let right = beside().find(|name| !fault.contains(name));
    let beside = right.or(beside().next());
    let beside = beside.map_or(String::new(), |name| as_typed(name) + ",");
    let alone = alone(case, &format!("{beside}{code}"));
    let seconds = number(engine.seconds, 2);
    let see = format!("See it alone; {name} takes {seconds} s:");
    let look = found.and_then(|found| look(found, name, Some(&case.setup.mesh)));
    let check = format!("faceoff engines check {code}");
    let next = [Todo::new(see, [format!("{alone} --keep job")])]
        .into_iter()
        .chain(look);
    Told {
        sentence: text!("{name}: {what}{others}{silent} ({label}{in_how_many})"),
        claim,
        because,
        next: next
            .chain([Todo::new("When it is mended:", [check])])
            .collect(),
    }
}

/// All answers solve their schemes.
fn without_culprit(outcome: &VerifyOutcome, diagnoses: &[Diagnosis]) -> Told {
    if let Some(case) = undecided(outcome) {
        let apart = case.pairs.iter().filter(|p| !p.field.verdict.passes());
        let apart = unique(apart.flat_map(|p| [&*p.a, &*p.b]));
        let names = unique(case.engines.iter().map(|e| &*e.engine));
        let names = joined(names.into_iter().map(as_typed), ",");
        let why = diagnoses.iter().map(Diagnosis::sentence).next();
        let why = why.unwrap_or_else(|| text!("`--diagnose` runs the codes again"));
        let label = case.label();
        return Told {
            sentence: text!("{label}: the answers differ though each solves the scheme: {why}"),
            claim: text!(
                "**{}** differ, though each solves the scheme",
                listed(&apart)
            ),
            because: text!("{label}: {why}."),
            next: vec![Todo::new(
                "Run this case again with one thing matched at a time:",
                [format!("{} --diagnose", alone(case, &names))],
            )],
        };
    }
    let settled = settled(outcome);
    let because = settled
        .as_ref()
        .map(|why| text!("{}.", why.clone().capitalised()));
    let told = Told {
        sentence: settled.unwrap_or_default(),
        because: because.unwrap_or_default(),
        ..Told::default()
    };
    let verdict = outcome.verdict;
    if verdict.passes() {
        let cases = match &outcome.cases[..] {
            [case] => text!("in {}", case.label()),
            [_, _] => "in both cases".into(),
            all => text!("in all {} cases", whole(all.len())),
        };
        let rounding = if verdict == Verdict::Agree {
            ", to rounding"
        } else {
            ""
        };
        let codes = counted(outcome.engines().len());
        let claim = text!("{codes} codes **{}** {cases}{rounding}", verdict.word());
        return Told { claim, ..told };
    }
    if verdict == Verdict::Several {
        let unique = unique_from(outcome).map(|(case, gamma0)| {
            let n = case.n.map_or(String::new(), |n| format!(" --n {n}"));
            let (scene, method) = (scene_as_typed(&case.scene), &case.method);
            Todo::new(
                text!("See the one solution that it has with a larger γ₀, and put that under `[method]` of the scene:"),
                [format!("faceoff solve {scene}{n} --method {method} --gamma0 {gamma0:.2e}")],
            )
        });
        return Told {
            claim: text!(
                "**Several solutions:** no code is wrong, and the scheme has more than one"
            ),
            next: unique.into_iter().collect(),
            ..told
        };
    }
    let silent = unique(outcome.failures.iter().map(|f| &*f.engine));
    let Some(first) = silent.first() else {
        let [sentence, claim] = match verdict {
            Verdict::Disagree => [
                "the certified bounds of two methods do not fit together".into(),
                text!("**The certified bounds** of two methods do not fit together"),
            ],
            _ => [
                "there is nothing to compare".into(),
                text!("**There is nothing to compare**: fewer than two codes answered"),
            ],
        };
        return Told {
            sentence,
            claim,
            ..told
        };
    };
    let (again, check) = (engine::typed(), as_typed(first));
    Told {
        sentence: text!("no answer from {first}"),
        claim: text!("**{}** gave no answer", listed(&silent)),
        next: vec![
            Todo::new(
                "Run it again and keep what it was given and what it said:",
                [format!("faceoff {again} --keep job")],
            ),
            Todo::only(text!("Read its own words in `log.txt` of its job folder.")),
            Todo::new(
                "Try it on small cases with known answers:",
                [format!("faceoff engines check {check}")],
            ),
        ],
        ..told
    }
}

/// The first case whose answers differ without a known cause.
fn undecided(outcome: &VerifyOutcome) -> Option<&CaseOutcome> {
    let is_told = outcome.verdict.passes() || outcome.verdict == Verdict::Several;
    let case = outcome.differing().filter(|_| !is_told)?;
    let counts = case.verdict == Verdict::Disagree || outcome.failures.is_empty();
    counts.then_some(case)
}

/// The codes that are right although others are not.
fn others(outcome: &VerifyOutcome) -> Option<Text> {
    let fault = outcome.at_fault();
    let mut right = outcome.engines();
    right.retain(|name| !fault.contains(name));
    if outcome.verdict.passes() || right.is_empty() {
        return None;
    }
    let is_right = |name: &String| right.contains(&&**name);
    let among = outcome.pairs().filter(|p| is_right(&p.a) && is_right(&p.b));
    if among.clone().any(|p| !p.field.verdict.passes()) {
        return None;
    }
    let apart = among.map(|p| p.field.max_rel).reduce(f64::max);
    let within = apart.map(|apart| text!(", and within {} of each other", size(apart)));
    let is = if right.len() == 1 { "solves" } else { "solve" };
    let all = match outcome.cases.len() {
        1 => "it".into(),
        2 => "both cases".into(),
        cases => text!("all {} cases", whole(cases)),
    };
    Some(text!("{} {is} {all} to rounding{within}.", listed(&right)))
}

/// Why answers that solve their scheme differ, if nothing else is wrong: for the case with the largest difference.
fn settled(outcome: &VerifyOutcome) -> Option<Text> {
    if !matches!(outcome.verdict, Verdict::Conditioned | Verdict::Several) {
        return None;
    }
    let with = outcome
        .cases
        .iter()
        .filter(|case| case.verdict == outcome.verdict);
    let farthest = |case: &CaseOutcome| super::most(case.pairs.iter().map(|p| p.field.max_rel));
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
                ", first on face {} at {at}",
                format!("{:?}", mesh.face(*face))
            )
        });
        let unique = several.unique_above.map(|gamma0| {
            text!(
                "; with gamma0 above {} there is one only",
                at_most(gamma0, 3)
            )
        });
        return Some(text!(
            "the codes {a} and {b} have found two solutions of the same scheme, {} of max|u| apart: contact differs at {}{} ({several.found} of {several.tried} choices \
                 of contact there solve it){}; no code is wrong ({about})",
            short(several.apart),
            count(several.differing, "point"),
            face.unwrap_or_default(),
            unique.unwrap_or_default()
        ));
    }
    let part = settled.conditioning.worst()?;
    let [of_a, of_b] = part.residuals.map(short);
    Some(text!(
        "the answers differ by {} of max|u|, and rounding alone may move them by {}: condition {} times residuals {of_a} and {of_b} \
                 of {a} and {b} ({about})",
        short(farthest(case)),
        short(part.tolerance),
        short(part.condition)
    ))
}

/// A case with several solutions, and a γ₀ for which there is only one.
fn unique_from(outcome: &VerifyOutcome) -> Option<(&CaseOutcome, f64)> {
    let several = |case: &&CaseOutcome| case.verdict == Verdict::Several;
    let mut cases = outcome.cases.iter().filter(several);
    cases.find_map(|case| {
        let mut of = case.settled.iter().filter_map(|s| s.several.as_ref());
        // Beyond the last digit that is printed.
        Some((case, 1.05 * of.find_map(|several| several.unique_above)?))
    })
}

/// The command of one case.
fn alone(case: &CaseOutcome, engines: &str) -> String {
    let n = case.n.map_or(String::new(), |n| format!(" --n {n}"));
    format!(
        "faceoff verify {}{n} --methods {} --engines {engines}",
        scene_as_typed(&case.scene),
        case.method
    )
}

/// The command line; a word that is not valid Unicode is shown as far as possible.
fn words_typed() -> impl Iterator<Item = String> {
    std::env::args_os().map(|word| word.to_string_lossy().into_owned())
}

/// An engine by its name on the command line, if a file describes it.
fn as_typed(name: &str) -> String {
    let words: Vec<String> = words_typed().collect();
    let value = words
        .iter()
        .position(|w| w == "--engines")
        .and_then(|k| words.get(k + 1).cloned());
    let value = value.or_else(|| {
        words
            .iter()
            .find_map(|w| w.strip_prefix("--engines=").map(str::to_owned))
    });
    let files: Vec<String> = value
        .iter()
        .flat_map(|v| v.split(','))
        .filter(|e| e.ends_with(".toml"))
        .map(str::to_owned)
        .collect();
    match (engine::NAMES.contains(&name), &files[..]) {
        (false, [one]) => one.clone(),
        _ => name.to_owned(),
    }
}

fn scene_as_typed(name: &str) -> String {
    if Scene::builtin_names().any(|known| known == name) {
        return name.to_owned();
    }
    let engines: Vec<String> = words_typed()
        .filter(|w| w.ends_with(".toml") && !w.contains(','))
        .collect();
    match &engines[..] {
        [one] => one.clone(),
        _ => name.to_owned(),
    }
}

/// A few words for a number of things.
fn counted(number: usize) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_listed_as_a_person_lists_them() {
        assert_eq!(listed(&["a", "b", "c"]), "a, b and c");
        assert_eq!(listed(&["a"]), "a");
    }
}
