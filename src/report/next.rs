//! What to do next: the least command that shows what is wrong, where to look, and what proves the mend.

use super::model::Todo;
use crate::campaigns::verify::{CaseOutcome, VerifyOutcome};
use crate::engine::{self, unique};
use crate::text::number::number;
use crate::text::text;
use crate::why::{self, Explanation, Findings};
use faceoff_fem::contact::Term;
use faceoff_fem::scene::Scene;
use faceoff_judge::Verdict;

/// What to do about it.
pub(super) fn next_of(outcome: &VerifyOutcome) -> Vec<Todo> {
    let mut steps = Vec::new();
    if let Some((case, engine)) = outcome.culprit() {
        let code = as_typed(&engine.engine);
        let fault = outcome.at_fault();
        let others = case
            .engines
            .iter()
            .map(|e| &*e.engine)
            .filter(|name| *name != engine.engine);
        let beside = others
            .clone()
            .find(|name| !fault.contains(name))
            .or(others.clone().next());
        let beside = beside.map_or(String::new(), |name| as_typed(name) + ",");
        let alone = alone(case, &format!("{beside}{code}"));
        let seconds = engine.seconds;
        steps.push(Todo::new(
            format!(
                "See it alone; {} takes {} s:",
                engine.engine,
                number(seconds, 2)
            ),
            [format!("{alone} --keep job")],
        ));
        steps.extend(
            engine
                .findings
                .as_ref()
                .and_then(|found| look(found, &engine.engine, case)),
        );
        steps.push(Todo::new(
            "When it is mended:",
            [format!("faceoff engines check {code}")],
        ));
        return steps;
    }
    if let Some(failure) = outcome.failures.first() {
        let code = as_typed(&failure.engine);
        steps.push(Todo::new(
            "Run it again and keep what it was given and what it said:",
            [format!("faceoff {} --keep job", engine::typed())],
        ));
        steps.push(Todo::only(text!(
            "Read its own words in `log.txt` of its job folder."
        )));
        steps.push(Todo::new(
            "Try it on small cases with known answers:",
            [format!("faceoff engines check {code}")],
        ));
    } else if let Some((case, gamma0)) = unique_from(outcome) {
        let n = case.n.map_or(String::new(), |n| format!(" --n {n}"));
        steps.push(Todo::new(
            text!("See the one solution that it has with a larger γ₀, and put that under `[method]` of the scene:"),
            [format!(
                "faceoff solve {}{n} --method {} --gamma0 {gamma0:.2e}",
                scene_as_typed(&case.scene),
                case.method
            )],
        ));
    } else if let Some(case) = outcome.differing() {
        let names: Vec<String> = unique(case.engines.iter().map(|e| &*e.engine))
            .into_iter()
            .map(as_typed)
            .collect();
        let again = alone(case, &names.join(","));
        steps.push(Todo::new(
            "Run this case again with one thing matched at a time:",
            [format!("{again} --diagnose")],
        ));
    }
    steps
}

/// A case with several solutions, and a γ₀ with which it has one.
fn unique_from(outcome: &VerifyOutcome) -> Option<(&CaseOutcome, f64)> {
    let several = |case: &&CaseOutcome| case.verdict == Verdict::Several;
    let mut cases = outcome.cases.iter().filter(several);
    cases.find_map(|case| {
        let mut of = case.settled.iter().filter_map(|s| s.several.as_ref());
        // Beyond the last digit that is written.
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

/// Where the code has what is wrong.
fn look(found: &Findings, name: &str, case: &CaseOutcome) -> Option<Todo> {
    let culprit = found.culprit();
    if let Some(Explanation { at, .. }) = culprit.filter(|c| c.is_gamma()) {
        let [spot] = &at[..] else {
            return Some(Todo::only(text!(
                "Look where {} makes or reads **γ**; in `job/*/case-0` is what it was given.",
                name
            )));
        };
        let mesh = &case.setup.mesh;
        let cell = mesh
            .find_face(&spot.vertices)
            .map(|face| mesh.face_cells(face)[0])?;
        return Some(Todo::only(text!(
            "Look where {} reads **γ of cell {}**, behind {}; `job/*/case-0` has what it was given.",
            name,
            cell,
            spot.carrier()
        )));
    }
    let term = |term: Term| text!("Look where {} assembles **{}**.", name, why::name(term));
    let words = match culprit.and_then(|c| c.term) {
        Some(of) => term(of),
        None => {
            let mut suspects = found.terms.iter().filter(|t| t.suspect).map(|t| t.term);
            term(suspects.next()?)
        }
    };
    Some(Todo::only(words))
}

/// What was typed; a word that is no Unicode as far as it is.
fn words_typed() -> impl Iterator<Item = String> {
    std::env::args_os().map(|word| word.to_string_lossy().into_owned())
}

/// An engine as it was named on the command line, where a file describes it.
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
