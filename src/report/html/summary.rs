//! What stands first: which code, which face, how much, and why.

use super::map::{self, CLASSES};
use super::markup::{Html, element, figure, key, leaf, prose, text};
use super::pair::{self, Pair};
use crate::campaigns::verify::{CaseOutcome, VerifyOutcome, VerifyRequest, telling};
use crate::report::model::{count, exact, place, short};
use crate::report::verify::label;
use crate::run::Failure;
use crate::why::Diagnosis;
use faceoff_mesh::error::Result;

/// What stands beside the verdict.
pub(in crate::report) fn top(
    request: &VerifyRequest,
    outcome: &VerifyOutcome,
    diagnoses: &[Diagnosis],
    missing: &[Failure],
) -> Result<Html> {
    let mut lines: Vec<Html> = Vec::new();
    let pairs: usize = outcome.cases.iter().map(|c| c.pairs.len()).sum();
    let failed = outcome.cases.iter().flat_map(|c| &c.pairs);
    let failed = failed.filter(|p| !p.field.verdict.passes()).count();
    lines.push(text(format!(
        "{failed} of {pairs} fields of pairs differ beyond rounding, in {} on {}.",
        count(outcome.cases.len(), "case"),
        count(request.scenes.len(), "scene")
    )));
    for failure in outcome.failures.iter().chain(missing) {
        lines.push(text(&failure.message));
    }
    for (c, _) in telling(&outcome.cross) {
        if let Some(judged) = c.judged.filter(|j| !j.verdict.passes()) {
            lines.push(text(format!(
                "{}: {} by {} is certified to {} and {} by {} to {}, where {} is proved to be possible on that mesh.",
                c.scene,
                c.a.method,
                c.a.engine,
                short(judged.bounds[0]),
                c.b.method,
                c.b.engine,
                short(judged.bounds[1]),
                short(judged.best)
            )));
        }
    }
    let most = most_telling(outcome);
    let mut pictures = Html::default();
    if let Some((index, pair)) = &most {
        let case = &outcome.cases[*index];
        lines.extend(sentences(*index, case, pair, diagnoses));
        pictures = picture(case, pair)?;
    }
    let items = lines.into_iter().map(|line| element("li", &[], line));
    let list = element("div", &[], element("ul", &[], items));
    Ok(element("div", &[("class", "first")], [list, pictures]))
}

/// The pair and field that lies farthest beyond its tolerance; with the engine that is at fault, where that is known.
fn most_telling(outcome: &VerifyOutcome) -> Option<(usize, Pair<'_>)> {
    let mut worst: Option<(f64, usize, Pair)> = None;
    for (index, case) in outcome.cases.iter().enumerate() {
        for pair in pair::pairs(case) {
            let Some(field) = pair.worst() else { continue };
            if field.verdict.passes() {
                continue;
            }
            let factor = Pair::factor(field);
            if worst.as_ref().is_none_or(|(other, ..)| factor > *other) {
                worst = Some((factor, index, pair));
            }
        }
    }
    worst.map(|(_, index, pair)| (index, pair))
}

/// Who is at fault, as far as the others tell: whose answer does not solve the scheme, or who alone differs from all.
fn suspect(case: &CaseOutcome) -> Option<&str> {
    let engines = || case.engines.iter();
    let mut unsolved = engines().filter(|e| !e.verdict.passes());
    if let (Some(one), None) = (unsolved.next(), unsolved.next()) {
        return Some(&one.engine);
    }
    let failed = case.pairs.iter();
    let failed: Vec<_> = failed.filter(|p| !p.field.verdict.passes()).collect();
    let in_all = |name: &str| failed.iter().all(|p| p.a == name || p.b == name);
    let mut alone = engines().map(|e| &*e.engine).filter(|e| in_all(e));
    let is_told = case.engines.len() > 2 && !failed.is_empty();
    let first = alone.next().filter(|_| is_told)?;
    alone.next().is_none().then_some(first)
}

fn sentences(index: usize, case: &CaseOutcome, pair: &Pair, diagnoses: &[Diagnosis]) -> Vec<Html> {
    // What stands out between words.
    let line =
        |first: &str, bold: &str, rest: Html| Html::from([text(first), leaf("b", &[], bold), rest]);
    let about = label(case);
    let mut lines = vec![match suspect(case) {
        Some(name) => line("Which code: ", name, text(format!(" in {about}."))),
        None => {
            let rest = text(format!(" in {about}; nothing tells which."));
            line("Which code: one of ", pair.a, line(" and ", pair.b, rest))
        }
    }];
    if let Some(field) = pair.worst() {
        if let Some(worst) = &field.worst {
            let rest = format!(
                " at {}, in `{}`: {} has {}, {} has {}, which is {} apart.",
                place(&worst.midpoint),
                field.field,
                pair.a,
                exact(worst.a),
                pair.b,
                exact(worst.b),
                short((worst.a - worst.b).abs())
            );
            let face = format!("{:?}", worst.vertices);
            lines.push(line("Which face: ", &face, prose(rest)));
        }
        let rest = format!(
            " of max|u|, {} times the tolerance, beyond it on {} of {} faces.",
            short(field.max_rel / field.tolerance),
            field.beyond,
            field.faces
        );
        lines.push(line("How much: ", &short(field.max_rel), text(rest)));
    }
    let why = prose(why(case, pair, diagnoses));
    lines.push(Html::from([text("Why: "), why]));
    let anchor = format!("#case-{index}");
    lines.push(leaf("a", &[("href", &anchor)], "All about this case"));
    lines
}

fn why(case: &CaseOutcome, pair: &Pair, diagnoses: &[Diagnosis]) -> String {
    let mut engines = case.engines.iter();
    if let Some(found) = engines
        .clone()
        .find_map(|e| e.findings.as_ref())
        .filter(|f| f.is_of_scheme())
    {
        return found.sentence();
    }
    if let Some(found) = pair.diagnoses(case, diagnoses).next() {
        return found.sentence();
    }
    if let Some(engine) = engines.clone().find(|e| !e.converged) {
        let (name, steps) = (&engine.engine, engine.iterations);
        return format!("{name} did not converge in {steps} steps.");
    }
    if let Some(found) = engines.find_map(|e| e.findings.as_ref()) {
        return found.sentence();
    }
    "every answer solves the scheme to rounding, so that the scheme itself leaves room: more than one solution, or a \
     badly conditioned mesh."
        .into()
}

fn picture(case: &CaseOutcome, pair: &Pair) -> Result<Html> {
    let Some(shown) = pair::differences(case, pair)? else {
        return Ok(Html::default());
    };
    let name = pair.worst().map_or("", |f| f.field.as_str());
    let Some(zoom) = map::zoom(&format!("the worst face of {}", label(case)), &shown) else {
        return Ok(Html::default());
    };
    let caption = format!(
        "Around the worst face (circle): faces by |a-b| of `{name}` in units of the tolerance; {}.",
        map::orientation(&shown)
    );
    let key = key("k", CLASSES.len(), &CLASSES);
    Ok(element("div", &[], [figure(zoom, caption), key]))
}
