//! What stands first: the verdict, which code, which face, how much, and why; then the matrix.

use super::case;
use super::markup::{Html, element, figure, leaf, prose, table, text};
use super::pair::{self, Pair};
use super::{label, map, number, word};
use crate::campaigns::verify::{CaseOutcome, Source, VerifyOutcome, VerifyRequest, telling};
use crate::run::{Failure, RESIDUAL_TOLERANCE};
use crate::why::Diagnosis;
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;

pub(super) fn verdict(
    request: &VerifyRequest,
    outcome: &VerifyOutcome,
    diagnoses: &[Diagnosis],
    missing: &[Failure],
) -> Result<Html> {
    let name = crate::report::word(outcome.verdict);
    let mut lines: Vec<Html> = Vec::new();
    let pairs: usize = outcome.cases.iter().map(|c| c.pairs.len()).sum();
    let failed = outcome.cases.iter().flat_map(|c| &c.pairs);
    let failed = failed.filter(|p| p.field.verdict != Verdict::Agree).count();
    lines.push(text(format!(
        "{failed} of {pairs} fields of pairs differ beyond rounding, in {} on {}.",
        count(outcome.cases.len(), "case"),
        count(request.scenes.len(), "scene")
    )));
    for failure in outcome.failures.iter().chain(missing) {
        lines.push(text(&failure.message));
    }
    for (c, _) in telling(&outcome.cross) {
        if let Some(judged) = c.judged.filter(|j| j.verdict != Verdict::Agree) {
            lines.push(text(format!(
                "{}: {} by {} is certified to {:.2e} and {} by {} to {:.2e}, where {:.2e} is proved to be possible on that mesh.",
                c.scene,
                c.a.method,
                c.a.engine,
                judged.bounds[0],
                c.b.method,
                c.b.engine,
                judged.bounds[1],
                judged.best
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
    let list: Html = lines
        .into_iter()
        .map(|line| element("li", &[], line))
        .collect();
    let class = format!("verdict {name}");
    Ok(element(
        "section",
        &[
            ("class", &class),
            ("role", "status"),
            ("aria-label", &format!("verdict: {name}")),
        ],
        element(
            "div",
            &[("class", "first")],
            [
                element(
                    "div",
                    &[],
                    [
                        leaf("strong", &[("id", "verdict")], name),
                        element("ul", &[], list),
                    ],
                ),
                pictures,
            ],
        ),
    ))
}

/// `1 case`, `2 cases`
fn count(number: usize, noun: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{number} {noun}{plural}")
}

/// The pair and field that lies farthest beyond its tolerance; with the engine that is at fault, where that is told.
fn most_telling(outcome: &VerifyOutcome) -> Option<(usize, Pair<'_>)> {
    let mut worst: Option<(f64, usize, Pair)> = None;
    for (index, case) in outcome.cases.iter().enumerate() {
        for pair in pair::pairs(case) {
            let Some(field) = pair.worst() else { continue };
            if field.verdict == Verdict::Agree {
                continue;
            }
            let factor = field.max_rel / field.tolerance;
            let factor = if factor.is_nan() {
                f64::INFINITY
            } else {
                factor
            };
            if worst.as_ref().is_none_or(|(other, ..)| factor > *other) {
                worst = Some((factor, index, pair));
            }
        }
    }
    worst.map(|(_, index, pair)| (index, pair))
}

/// Who is at fault, as far as the others tell: whose answer does not solve the scheme, or who alone differs from all.
fn suspect(case: &CaseOutcome) -> Option<&str> {
    let unsolved: Vec<_> = case
        .engines
        .iter()
        .filter(|e| e.verdict != Verdict::Agree)
        .collect();
    if let [one] = unsolved[..] {
        return Some(&one.engine);
    }
    let failed: Vec<_> = case
        .pairs
        .iter()
        .filter(|p| p.field.verdict != Verdict::Agree)
        .collect();
    let in_all = |name: &str| failed.iter().all(|p| p.a == name || p.b == name);
    let mut alone = case
        .engines
        .iter()
        .map(|e| e.engine.as_str())
        .filter(|e| in_all(e));
    let first = alone
        .next()
        .filter(|_| case.engines.len() > 2 && !failed.is_empty())?;
    alone.next().is_none().then_some(first)
}

fn sentences(index: usize, case: &CaseOutcome, pair: &Pair, diagnoses: &[Diagnosis]) -> Vec<Html> {
    let mut lines = Vec::new();
    let who = match suspect(case) {
        Some(name) => Html::from([
            text("Which code: "),
            leaf("b", &[], name),
            text(format!(" in {}.", label(case))),
        ]),
        None => Html::from([
            text("Which code: one of "),
            leaf("b", &[], pair.a),
            text(" and "),
            leaf("b", &[], pair.b),
            text(format!(" in {}; nothing tells which.", label(case))),
        ]),
    };
    lines.push(who);
    if let Some(field) = pair.worst() {
        if let Some(worst) = &field.worst {
            lines.push(Html::from([
                text("Which face: "),
                leaf("b", &[], format!("{:?}", worst.vertices)),
                prose(format!(
                    " at {}, in `{}`: {} has {:e}, {} has {:e}, which is {:.2e} apart.",
                    pair::place(&worst.midpoint),
                    field.field,
                    pair.a,
                    worst.a,
                    pair.b,
                    worst.b,
                    (worst.a - worst.b).abs()
                )),
            ]));
        }
        lines.push(Html::from([
            text("How much: "),
            leaf("b", &[], format!("{:.2e}", field.max_rel)),
            text(format!(
                " of max|u|, {:.1e} times the tolerance, beyond it on {} of {} faces.",
                field.max_rel / field.tolerance,
                field.beyond,
                field.faces
            )),
        ]));
    }
    lines.push(Html::from([
        text("Why: "),
        prose(why(case, pair, diagnoses)),
    ]));
    let anchor = format!("#case-{index}");
    lines.push(element(
        "a",
        &[("href", &anchor)],
        text("All about this case"),
    ));
    lines
}

fn why(case: &CaseOutcome, pair: &Pair, diagnoses: &[Diagnosis]) -> String {
    if let Some(found) = diagnoses
        .iter()
        .find(|d| d.is_of((&case.scene, &case.method, case.n), (pair.a, pair.b)))
    {
        return found.sentence();
    }
    for engine in &case.engines {
        if !engine.converged {
            return format!(
                "{} did not converge in {} steps.",
                engine.engine, engine.iterations
            );
        }
    }
    for engine in &case.engines {
        if engine.verdict != Verdict::Agree {
            let place = engine.residual_at.as_ref();
            return format!(
                "put into the scheme again, the answer of {} leaves a backward error of {:.1e}{}, where rounding leaves less \
                 than {:.0e}: it solves another scheme. `faceoff verify --diagnose` names the ingredient.",
                engine.engine,
                engine.residual,
                place.map_or(String::new(), |x| format!(", most at {}", pair::place(x))),
                RESIDUAL_TOLERANCE
            );
        }
    }
    "every answer solves the scheme to rounding, so that the scheme itself leaves room: more than one solution, or a \
     badly conditioned mesh."
        .into()
}

fn picture(case: &CaseOutcome, pair: &Pair) -> Result<Html> {
    let Some(shown) = pair::differences(case, pair)? else {
        return Ok(Html::default());
    };
    let shown = shown.on(&case.setup.mesh);
    let name = pair.worst().map_or("", |f| f.field.as_str());
    let Some(zoom) = map::zoom(&format!("the worst face of {}", label(case)), &shown) else {
        return Ok(Html::default());
    };
    let caption = format!(
        "Around the worst face (circle): faces by |a-b| of `{name}` in units of the tolerance; {}.",
        map::orientation(&shown)
    );
    Ok(element("div", &[], [figure(zoom, caption), case::key()]))
}

/// One row a case, one column a pair.
pub(super) fn matrix(outcome: &VerifyOutcome) -> Html {
    let mut names: Vec<String> = Vec::new();
    for case in &outcome.cases {
        for pair in pair::pairs(case) {
            if !names.contains(&pair.name()) {
                names.push(pair.name());
            }
        }
    }
    let head: Vec<&str> = ["scene", "method", "n"]
        .into_iter()
        .chain(names.iter().map(String::as_str))
        .chain(["every answer solves the scheme"])
        .collect();
    let rows = outcome.cases.iter().enumerate().map(|(index, case)| {
        let link = element(
            "a",
            &[("href", &format!("#case-{index}"))],
            text(&case.scene),
        );
        let mut cells = vec![
            link,
            text(&case.method),
            text(case.n.map_or(String::new(), |n| n.to_string())),
        ];
        for name in &names {
            let found = pair::pairs(case).into_iter().find(|p| p.name() == *name);
            cells.push(found.map_or(text("no answer"), |pair| {
                let largest = pair.fields.iter().map(|f| f.max_rel).fold(0.0, f64::max);
                Html::from([word(pair.verdict()), text(" "), number(largest)])
            }));
        }
        let engines = case.engines.iter().map(|e| e.verdict).max();
        cells.push(word(engines.unwrap_or(Verdict::Undetermined)));
        (crate::report::word(case.verdict), cells)
    });
    table(
        "Scenes, methods and pairs of codes; the number is the largest difference of any field, relative to max|u|",
        &head,
        rows.collect(),
    )
}

/// The methods against each other.
pub(super) fn methods(outcome: &VerifyOutcome) -> Html {
    if outcome.cross.is_empty() {
        return Html::default();
    }
    let rows = telling(&outcome.cross).into_iter().map(|(c, pairs)| {
        let source = |s: &Source| text(format!("{} {}", s.engine, s.method));
        let n = c.n.map_or(String::new(), |n| n.to_string());
        let mut cells = vec![text(&c.scene), text(n), source(&c.a), source(&c.b)];
        cells.push(text(pairs.to_string()));
        match &c.judged {
            Some(j) => {
                let numbers = [j.distance, j.bounds[0], j.bounds[1], j.slack];
                cells.extend(numbers.map(|x| text(format!("{x:.2e}"))));
                cells.push(word(j.verdict));
                (crate::report::word(j.verdict), cells)
            }
            None => {
                cells.extend([""; 4].map(text));
                let because = c.no_certificate.as_deref().unwrap_or_default();
                cells.push(text(format!("no certificate, because {because}")));
                ("none", cells)
            }
        }
    });
    table(
        "Methods against each other: ‖∇(u_a-u_b)‖ and certified bounds of each error; of all pairs of codes the one with the least slack",
        &[
            "scene", "n", "a", "b", "pairs", "distance", "bound a", "bound b", "slack", "verdict",
        ],
        rows.collect(),
    )
}
