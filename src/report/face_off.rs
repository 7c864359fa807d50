//! What `verify` found of a face-off file: codes of one's own on any problem.

use super::html;
use super::model::{Block, Cell, Report, Suite, Table, TestCase, Todo, joined, table, word};
use super::number::{number, size};
use super::verify::{why, worst};
use crate::campaigns::face_off::{
    Diagnosis, FaceOffOutcome, OfField, OfNumber, OfOrder, OfPair, RowOfNumber, RunOf,
};
use crate::campaigns::limit::Found;
use crate::run::Same;
use faceoff_judge::{Norms, On, Verdict};
use faceoff_mesh::error::Result;

/// The report of a face-off.
///
/// # Errors
/// None but of a broken installation.
pub fn face_off(of: &FaceOffOutcome) -> Result<Report<'_>> {
    let question = "faceoff verify: do codes of one's own agree?";
    let verdict = word(of.verdict);
    let mut report = Report::new("face-off", question, verdict, of)?;
    report.verdict = Some((of.verdict, verdict));
    report.claim = claim(of, verdict);
    report.lede = lede(of);
    report.lead = lead(of);
    report.next = next(of);
    for field in &of.fields {
        report.blocks.push(pairs_table(field).into());
        if !field.orders.is_empty() {
            report.blocks.push(orders_table(field).into());
            let figures = Block::Html(Box::new(move || Ok(order_figures(field))));
            report.blocks.push(Block::Page(vec![figures]));
        }
    }
    for number in &of.numbers {
        report.blocks.push(number_table(number).into());
    }
    if let Some(diagnosis) = &of.diagnosis {
        report.blocks.push(moved_table(diagnosis).into());
    }
    report.blocks.push(runs_table(&of.runs).into());
    report.notes.extend(of.shown.as_ref().map(|(shown, _)| {
        let (a, b) = (&shown.a, &shown.b);
        format!("On the map a is `{a}` and b is `{b}`.")
    }));
    report.suites = suites(of);
    Ok(report)
}

fn at(n: Option<usize>) -> String {
    n.map_or(String::new(), |n| format!(", n = {n}"))
}

/// What fails first: a code, a field, an order, a number.
fn claim(of: &FaceOffOutcome, word: &str) -> String {
    if let Some(run) = of.runs.iter().find(|run| run.failure.is_some()) {
        return format!("**{}** gave no result{}", run.code, at(run.n));
    }
    let fields = of.fields.iter().filter(|f| !f.verdict.passes());
    let wrong: Vec<&str> = fields
        .map(|f| &*f.field)
        .chain(
            of.numbers
                .iter()
                .filter(|n| !n.verdict.passes())
                .map(|n| &*n.number),
        )
        .collect();
    if let Some(odd) = of.fields.iter().find_map(OfField::odd_one) {
        return odd;
    }
    let low = of
        .fields
        .iter()
        .flat_map(|f| &f.orders)
        .find(|o| o.verdict == Some(Verdict::Disagree));
    match (&wrong[..], low) {
        ([], _) => {
            let mut codes: Vec<&str> = of.runs.iter().map(|run| &*run.code).collect();
            codes.sort_unstable();
            codes.dedup();
            format!("{} **{word}** on {}", codes.join(", "), of.name)
        }
        ([_], Some(order)) if is_low(order) => format!(
            "**{}**: the order of {} is too low",
            order.of, order.found.field
        ),
        ([_], Some(order)) => format!("**{}**: {} does not converge", order.of, order.found.field),
        ([one], None) if is_untold(of) => {
            format!("**{one}** cannot be told to converge on these meshes")
        }
        ([one], None) => format!("**{one}** differs"),
        (several, _) => format!("**{}** differ", several.join(", ")),
    }
}

fn lede(of: &FaceOffOutcome) -> String {
    let mut told = Vec::new();
    if let Some(failure) = of.runs.iter().find_map(|run| run.failure.as_ref()) {
        told.push(format!("{failure}."));
    }
    let farthest = farthest(of);
    if let Some((field, pair)) = farthest {
        let found = &pair.compared.field;
        told.push(match (&found.reason, found.verdict.passes()) {
            (Some(reason), _) => format!(
                "`{}`, {} – {}{}: {reason}.",
                field.field,
                pair.a,
                pair.b,
                at(pair.n)
            ),
            (None, true) => format!(
                "The largest difference is **{}** of its field, in `{}`, {} – {}{}.",
                size(found.max_rel),
                field.field,
                pair.a,
                pair.b,
                at(pair.n)
            ),
            (None, false) => format!(
                "`{}` of {} and {} differs by **{}** of it{}, {} times what is allowed.",
                field.field,
                pair.a,
                pair.b,
                size(found.max_rel),
                at(pair.n),
                number(pair.compared.factor(), 2)
            ),
        });
    }
    let orders = of
        .fields
        .iter()
        .flat_map(|f| &f.orders)
        .filter_map(order_words);
    told.extend(orders);
    let findings = of.diagnosis.iter().flat_map(|d| &d.findings);
    told.extend(findings.map(|finding| format!("{finding}.")));
    if !of.about.is_empty() {
        told.insert(0, format!("{}.", of.about.trim_end_matches('.')));
    }
    told.join(" ")
}

/// The pair of codes that is farthest beyond what is allowed, or nearest to it.
fn farthest(of: &FaceOffOutcome) -> Option<(&OfField, &OfPair)> {
    let pairs = of
        .fields
        .iter()
        .flat_map(|f| f.pairs.iter().map(move |p| (f, p)));
    let judged = pairs.filter(|(_, pair)| pair.judged);
    judged.max_by(|(_, p), (_, q)| {
        let key = |p: &OfPair| (p.compared.field.verdict, p.compared.factor());
        let ((v, x), (w, y)) = (key(p), key(q));
        v.cmp(&w).then(x.total_cmp(&y))
    })
}

/// Is nothing wrong but that orders leave open what is left in the limit?
fn is_untold(of: &FaceOffOutcome) -> bool {
    let mut orders = of.fields.iter().flat_map(|f| &f.orders);
    of.verdict == Verdict::Undetermined
        && orders.any(|order| order.verdict == Some(Verdict::Undetermined))
        && of
            .fields
            .iter()
            .flat_map(|f| &f.pairs)
            .all(|pair| pair.compared.field.reason.is_none())
}

/// Is an order lower than that of theory? Else the limit is not zero.
fn is_low(of: &OfOrder) -> bool {
    of.limits
        .iter()
        .flatten()
        .all(|limit| limit.found != Found::Apart)
}

/// What is wrong with an order, and what is left in the limit.
fn order_words(of: &OfOrder) -> Option<String> {
    let limits = ["L²", "H¹"].iter().zip(of.limits);
    let limits = limits.filter_map(|(norm, limit)| {
        let limit = limit.filter(|limit| limit.found != Found::Zero)?;
        let what = match of.found.against {
            "code" => "difference",
            _ => "error",
        };
        let (field, words) = (&of.found.field, limit.words());
        Some(format!(
            "The {what} in `{field}` of {} in {norm} {words}.",
            of.of
        ))
    });
    let limits = limits.collect::<Vec<_>>();
    let low = low_words(of);
    let all = low.into_iter().chain(limits).collect::<Vec<_>>().join(" ");
    Some(all).filter(|all| !all.is_empty())
}

fn low_words(of: &OfOrder) -> Option<String> {
    if of.verdict != Some(Verdict::Disagree) {
        return None;
    }
    let fit = [Some(&of.found.l2), of.found.h1.as_ref()]
        .map(|o| o.and_then(|o| o.fit).map(|f| f.exponent));
    let told = ["L²", "H¹"]
        .iter()
        .zip(of.theory)
        .zip(fit)
        .filter_map(|((norm, theory), fit)| {
            Some(format!(
                "{} in {norm} instead of {}",
                number(fit?, 3),
                theory?
            ))
        });
    Some(format!(
        "`{}` of {} has order {}.",
        of.found.field,
        of.of,
        joined(told, " and ")
    ))
}

/// The map of the pair that is farthest from agreement.
fn lead(of: &FaceOffOutcome) -> Vec<Block<'_>> {
    let Some((comparison, of_a)) = &of.shown else {
        return Vec::new();
    };
    let shown = comparison.fields.iter().find(|f| f.on != On::Domain);
    vec![Block::Html(Box::new(move || {
        let compared = shown.and_then(|field| html::Compared::new(comparison, of_a, field));
        Ok(compared.map_or_else(html::Html::default, |compared| compared.figures()))
    }))]
}

/// What to do about what fails.
fn next(of: &FaceOffOutcome) -> Vec<Todo> {
    let none: [&str; 0] = [];
    let mut steps = Vec::new();
    if of.verdict.passes() {
        return steps;
    }
    if of.runs.iter().any(|run| run.failure.is_some()) {
        steps.push(Todo::new(
            "Keep the folders of the runs by --keep DIR; command.txt in each is what was typed, log.txt what it said.",
            none,
        ));
    }
    let is_wrong = |order: &&OfOrder| order.verdict == Some(Verdict::Disagree);
    if let Some(order) = of.fields.iter().flat_map(|f| &f.orders).find(is_wrong) {
        steps.push(Todo::new(
            format!("{} falls short of theory: refine further; if it stays so, look for a constant, a condition, the form, data or the element that is another.", order.of),
            none,
        ));
    } else if of.fields.iter().any(|f| f.verdict == Verdict::Disagree) {
        steps.push(Todo::new(
            "Look where the difference enters: on a boundary it is a condition or a group, everywhere a coefficient, a sign or a quadrature rule.",
            none,
        ));
    }
    steps
}

fn runs_table(runs: &[RunOf]) -> Table {
    let n = |run: &RunOf| run.n.map(|n| Cell::Number(n as f64, n.to_string()));
    let outcome = |run: &RunOf| run.failure.clone().unwrap_or_else(|| "done".to_owned());
    table!("", runs, |run|
        "code" => &run.code,
        "n" => n(run),
        "time" => run.seconds.map(super::model::duration),
        "outcome" => outcome(run),
    )
}

fn moved_table(of: &Diagnosis) -> Table {
    let caption = format!("What moves an answer{}", at(of.n));
    table!(caption, &of.moved, |moved|
        "code" => &moved.code,
        "change" => moved.change,
        "of" => &moved.of,
        "moved by" => moved.relative,
        "remark" => moved.reason.clone(),
    )
}

fn pairs_table(of: &OfField) -> Table {
    let n = |pair: &OfPair| pair.n.map(|n| Cell::Number(n as f64, n.to_string()));
    let norm = |pair: &OfPair, pick: fn(&Norms) -> Option<(f64, f64)>| {
        let (norm, scale) = pair.compared.norms.as_ref().and_then(pick)?;
        Some(format!("{} of {}", size(norm), size(scale)))
    };
    let verdict = |pair: &OfPair| match pair.judged {
        true => Cell::Verdict(pair.compared.field.verdict),
        false => "told".into(),
    };
    let as_functions = |pair: &OfPair| {
        let is = of.same == Same::Discretisation && pair.compared.on == On::Functions;
        is.then(|| "as functions, since the files have other cells".to_owned())
    };
    let remark = |pair: &OfPair| {
        pair.compared
            .field
            .reason
            .clone()
            .or_else(|| as_functions(pair))
    };
    table!(format!("`{}`", of.field), &of.pairs, |pair|
        "codes" => format!("{} – {}", pair.a, pair.b),
        "n" => n(pair),
        "max |a-b|" => pair.compared.field.max_abs,
        "relative" => pair.compared.field.max_rel,
        "allowed" => pair.compared.field.tolerance,
        "L2" => norm(pair, |n| Some((n.l2, n.l2_scale))),
        "H1" => norm(pair, |n| n.h1.zip(n.h1_scale)),
        "worst" => worst(&pair.compared.field),
        "verdict" => verdict(pair),
        "remark" => remark(pair),
    )
}

fn orders_table(of: &OfField) -> Table {
    let rows = of.orders.iter().flat_map(|order| {
        let h1 = order.found.h1.as_ref().map(|h1| (order, "H¹", 1, h1));
        [(order, "L²", 0, &order.found.l2)].into_iter().chain(h1)
    });
    let caption = format!("Observed orders of `{}`", of.field);
    let limit = |order: &OfOrder, k: usize| order.limits[k].map(|limit| limit.words());
    table!(caption, rows, |(order, norm, k, found)|
        "of" => &order.of,
        "norm" => norm,
        "against" => order.found.against,
        "between meshes" => joined(found.steps.iter().map(|o| format!("{o:.2}")), " "),
        "fit" => found.fit.map(|fit| Cell::fixed(fit.exponent, 2)),
        "theory" => order.theory[k].map(|theory| number(theory, 2)),
        "verdict" => order.verdict.filter(|_| order.theory[k].is_some()),
        "limit" => limit(order, k),
    )
}

/// Errors, or differences of codes, by n.
fn order_figures(of: &OfField) -> html::Html {
    let lines = |pick: fn(&Norms) -> Option<f64>, h1: bool| -> Vec<html::Line> {
        let line = |order: &OfOrder| {
            let levels = order.n.iter().zip(&order.found.levels);
            let errors = levels.filter_map(|(n, l)| Some(((*n)?, pick(l.norms.as_ref()?)?)));
            let found = if h1 {
                order.found.h1.as_ref()
            } else {
                Some(&order.found.l2)
            };
            html::Line {
                name: order.of.clone(),
                errors: errors.collect(),
                order: found.and_then(|o| o.fit).map(|fit| fit.exponent),
            }
        };
        of.orders.iter().map(line).collect()
    };
    let name = &of.field;
    html::beside([
        (
            "c6",
            html::errors(
                &lines(|n| Some(n.l2), false),
                &format!("**{name}** in L² by n, with its order"),
            ),
        ),
        (
            "c6",
            html::errors(
                &lines(|n| n.h1, true),
                &format!("**{name}** in H¹ by n, with its order"),
            ),
        ),
    ])
}

fn number_table(of: &OfNumber) -> Table {
    let exact = of
        .exact
        .map_or(String::new(), |exact| format!(", exact {exact}"));
    let values = |row: &RowOfNumber| {
        joined(
            row.values
                .iter()
                .map(|(code, value)| format!("{code} {value:.12e}")),
            ", ",
        )
    };
    table!(format!("`{}`{exact}", of.number), &of.rows, |row|
        "n" => row.n.map(|n| Cell::Number(n as f64, n.to_string())),
        "values" => values(row),
        "verdict" => row.verdict,
        "remark" => &row.reason,
    )
}

/// A case for every pair, order and number, and for every code that failed.
fn suites(of: &FaceOffOutcome) -> Vec<Suite> {
    let mut cases = Vec::new();
    for run in &of.runs {
        if let Some(failure) = &run.failure {
            let name = format!("run of {}{}", run.code, at(run.n));
            cases.push(TestCase::new(
                &of.name,
                name,
                Verdict::Undetermined,
                failure.clone(),
            ));
        }
    }
    for field in &of.fields {
        for pair in field.pairs.iter().filter(|pair| pair.judged) {
            let name = format!("{}, {} – {}{}", field.field, pair.a, pair.b, at(pair.n));
            let found = &pair.compared.field;
            cases.push(TestCase::new(&of.name, name, found.verdict, why(found)));
        }
        for order in &field.orders {
            if let Some(verdict) = order.verdict {
                let name = format!("order of {}, {}", field.field, order.of);
                cases.push(TestCase::new(
                    &of.name,
                    name,
                    verdict,
                    order_words(order).unwrap_or_default(),
                ));
            }
        }
    }
    for number in &of.numbers {
        for row in &number.rows {
            let name = format!("{}{}", number.number, at(row.n));
            cases.push(TestCase::new(
                &of.name,
                name,
                row.verdict,
                row.reason.clone(),
            ));
        }
    }
    vec![Suite::new(&of.name, cases)]
}
