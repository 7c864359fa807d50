//! What `verify` found of a face-off file: codes of one's own on any problem.

use super::described::worst;
use super::html::{self, Chart, Line};
use super::model::{
    Block, Cell, Report, Suite, Table, TestCase, Todo, joined, sentence, table, word,
};
use super::orders::{over_n, slopes_of};
use super::verify::why;
use crate::campaigns::face_off::{
    Diagnosis, FaceOffOutcome, OfField, OfForm, OfNumber, OfOrder, OfPair, RowOfNumber, RunOf,
    short, worst as worst_time,
};
use crate::run::convergence::Found;
use crate::run::{Judged, Label, Same};
use crate::text::number::{number, size};
use crate::text::{Number, Text, text};
use crate::why::InForm;
use faceoff_judge::{Norms, On, Verdict};
use faceoff_mesh::error::Result;

/// Of coarser levels of one problem.
const NOT_JUDGED: &str = "not judged";

/// The report of a face-off.
///
/// # Errors
/// None but of a broken installation.
pub fn face_off(of: &FaceOffOutcome) -> Result<Report<'_>> {
    let question = "faceoff verify: do these codes agree?";
    let verdict = word(of.verdict);
    let headline = match unsolved(of) {
        Some(unsolved) => text!("{}: {}", verdict, unsolved),
        None => verdict.into(),
    };
    let mut report = Report::new("face-off", question, headline, of)?;
    report.verdict = Some((of.verdict, verdict));
    report.claim = claim(of, verdict);
    report.lede = lede(of);
    report.lead = lead(of);
    report.next = next(of);
    for field in &of.fields {
        let shown = worst_times(field);
        let more = times_words(field);
        let words = text!("Differences of `{}`{}", &field.field, &more);
        let table = pairs_table(field, &shown, &more);
        report.blocks.extend(headed(words, table));
        if shown.len() < field.pairs.len() {
            let all: Vec<&OfPair> = field.pairs.iter().collect();
            let table = pairs_table(field, &all, " at every time");
            let caption = text!("All times of `{}`", &field.field);
            let folded = Block::folded(caption, "", vec![table.into()]);
            report.blocks.push(Block::Page(vec![folded]));
        }
        if !field.orders.is_empty() {
            let table = orders_table(field);
            report.blocks.extend(headed(table.caption.clone(), table));
            let figures = Block::Html(Box::new(move || Ok(order_figures(field))));
            report.blocks.push(Block::Page(vec![figures]));
        }
    }
    for number in &of.numbers {
        let table = number_table(number);
        report.blocks.extend(headed(table.caption.clone(), table));
    }
    if !of.in_form.is_empty() {
        let table = in_form_table(&of.in_form);
        report.blocks.extend(headed(table.caption.clone(), table));
    }
    if let Some(diagnosis) = &of.diagnosis {
        report.blocks.push(moved_table(diagnosis).into());
    }
    report.blocks.extend(headed("Runs", runs_table(&of.runs)));
    report.notes.extend(of.shown.as_ref().map(|(shown, _)| {
        let (a, b) = (&shown.a, &shown.b);
        text!("On the map a is `{}` and b is `{}`.", a, b)
    }));
    report.suites = suites(of);
    Ok(report)
}

/// With its time.
fn place(pair: &OfPair) -> String {
    let time = pair.t.map(|t| format!(", t = {}", short(t)));
    pair.level.at() + &time.unwrap_or_default()
}

/// Of each two codes on each level the time at which they are farthest from agreement.
fn worst_times(of: &OfField) -> Vec<&OfPair> {
    let key = |pair: &'_ OfPair| (pair.a.clone(), pair.b.clone(), pair.level.clone());
    let groups = of.pairs.chunk_by(|p, q| key(p) == key(q));
    groups.filter_map(worst_time).collect()
}

/// Which times are judged, where that is not all.
fn times_words(of: &OfField) -> String {
    match &of.times {
        Judged::All => String::new(),
        Judged::Last => ": only the last time of each result is judged".to_owned(),
        Judged::At(list) => {
            let list = list.iter().map(|t| short(*t).to_string());
            format!(": only these times are judged: {}", joined(list, ", "))
        }
    }
}

/// A table under its heading; on the terminal its caption does.
fn headed<'a>(words: impl Into<Text>, table: Table) -> [Block<'a>; 2] {
    let bare = Table {
        caption: Text::default(),
        ..table.clone()
    };
    [
        Block::Terminal(vec![table.into()]),
        Block::Page(vec![Block::heading(2, words), bare.into()]),
    ]
}

/// What fails first: a code, a field, an order, a number.
fn claim(of: &FaceOffOutcome, word: &str) -> Text {
    if let Some(run) = of.runs.iter().find(|run| run.failure.is_some()) {
        return text!("**{}** gave no result{}", &run.code, run.level.at());
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
    if let Some(unsolved) = unsolved(of) {
        return unsolved;
    }
    if let Some(odd) = of.fields.iter().find_map(OfField::odd_one) {
        return odd;
    }
    // A code whose order is wrong where another's is right, before what differs as a consequence.
    if let Some(order) = odd_order(of) {
        let observed = observed(order);
        return text!("`{}` of **{}** {}", &order.found.field, &order.of, observed);
    }
    let low = orders_of(of).find(|o| o.verdict == Some(Verdict::Disagree));
    match (&wrong[..], low) {
        ([], _) => {
            let mut codes: Vec<&str> = of.runs.iter().map(|run| &*run.code).collect();
            codes.sort_unstable();
            codes.dedup();
            text!("{} **{}** on {}", codes.join(", "), word, &of.name)
        }
        ([_], Some(order)) if !has_differing_pair(of) => {
            text!("**{}** {}", &order.found.field, observed(order))
        }
        ([one], _) if is_untold(of) => {
            text!("**{}** cannot be told to converge on these meshes", one)
        }
        ([one], _) if of.verdict == Verdict::Undetermined => {
            text!("**{}** cannot be judged", one)
        }
        ([one], _) => text!("**{}** differs", one),
        (several, _) if of.verdict == Verdict::Undetermined => {
            text!("**{}** cannot be judged", several.join(", "))
        }
        (several, _) => text!("**{}** differ", several.join(", ")),
    }
}

/// The codes whose results do not solve the form, with the first one's cause.
fn unsolved(of: &FaceOffOutcome) -> Option<Text> {
    let all = of.in_form.iter();
    let wrong = all.filter_map(|of| Some((&*of.code, of.wrong()?)));
    let (codes, found): (Vec<&str>, Vec<&InForm>) = wrong.unzip();
    let does = if codes.len() == 1 { "does" } else { "do" };
    let first = found.first()?;
    let cause = match first.cause() {
        Some(words) => text!(", but as if {}", words),
        None => text!(": {}", &first.sentence),
    };
    Some(text!(
        "**{}** {} not solve the form{}",
        codes.join(", "),
        does,
        cause
    ))
}

fn orders_of(of: &FaceOffOutcome) -> impl Iterator<Item = &OfOrder> {
    of.fields.iter().flat_map(|f| &f.orders)
}

fn has_differing_pair(of: &FaceOffOutcome) -> bool {
    let mut pairs = of.fields.iter().flat_map(|f| &f.pairs);
    pairs.any(|p| p.judged && p.compared.field.verdict == Verdict::Disagree)
}

/// The order of a code that is too low, where that of another code is right in the same field.
fn odd_order(of: &FaceOffOutcome) -> Option<&OfOrder> {
    let has_right = |f: &&OfField| {
        let mut orders = f.orders.iter();
        orders.any(|o| o.verdict == Some(Verdict::Agree))
    };
    let mut orders = of.fields.iter().filter(has_right).flat_map(|f| &f.orders);
    orders.find(|o| o.verdict == Some(Verdict::Disagree))
}

/// What was seen of an order that is too low, or of what does not fall to 0.
fn observed(of: &OfOrder) -> Text {
    let limits = ["L²", "H¹"].into_iter().zip(of.limits);
    let apart = limits.filter_map(|(norm, limit)| {
        let limit = limit.filter(|limit| limit.found == Found::Apart)?;
        Some(text!("{} in {}", limit.words(), norm))
    });
    Text::joined(low(of).into_iter().chain(apart), " and ")
}

/// The norms whose order is too low; where the limit is known not to be 0, the order says less.
fn low(of: &OfOrder) -> Option<Text> {
    let orders = [Some(&of.found.l2), of.found.h1.as_ref()];
    let told = (0..2).filter_map(|k| {
        let is_apart = of.limits[k].is_some_and(|limit| limit.found == Found::Apart);
        let is_low = of.verdicts[k] == Some(Verdict::Disagree) && !is_apart;
        let (fit, theory) = (orders[k]?.fit?.exponent, of.theory[k]?);
        let norm = ["L²", "H¹"][k];
        is_low.then(|| {
            text!(
                "{} in {} instead of {}",
                number(fit, 3),
                norm,
                theory.to_string()
            )
        })
    });
    let told: Vec<Text> = told.collect();
    let axis = match &*of.axis {
        "h" => Text::default(),
        other => text!(" in {}", other),
    };
    (!told.is_empty()).then(|| text!("has order {}{}", Text::joined(told, " and "), axis))
}

fn lede(of: &FaceOffOutcome) -> Text {
    let mut told: Vec<Text> = Vec::new();
    if let Some(failure) = of.runs.iter().find_map(|run| run.failure.as_ref()) {
        told.push(Text::message(&sentence(failure)));
    }
    let farthest = farthest(of);
    if let Some((field, pair)) = farthest {
        let found = &pair.compared.field;
        told.push(match (&found.reason, found.verdict.passes()) {
            (Some(reason), _) => text!(
                "`{}`, {} – {}{}: {}.",
                &field.field,
                &pair.a,
                &pair.b,
                place(pair),
                reason
            ),
            (None, true) => text!(
                "The largest difference is **{}** of its field, in `{}`, {} – {}{}.",
                size(found.max_rel),
                &field.field,
                &pair.a,
                &pair.b,
                place(pair)
            ),
            (None, false) => text!(
                "`{}` of {} and {} differs by **{}** of it{}, {} times what is allowed.",
                &field.field,
                &pair.a,
                &pair.b,
                size(found.max_rel),
                place(pair),
                number(pair.compared.factor(), 2)
            ),
        });
    }
    let wrong = of
        .in_form
        .iter()
        .filter_map(|of| Some((of, &of.wrong()?.sentence)));
    told.extend(wrong.map(|(of, words)| text!("`{}`{}: {}.", &of.code, of.level.at(), words)));
    let orders = of
        .fields
        .iter()
        .flat_map(|f| &f.orders)
        .filter_map(order_words);
    told.extend(orders);
    let missing = of.missing.iter();
    told.extend(missing.map(|of| Text::message(&sentence(&of.message))));
    let findings = of.diagnosis.iter().flat_map(|d| &d.findings);
    told.extend(findings.map(|finding| text!("{}.", finding)));
    if !of.about.is_empty() {
        told.insert(0, Text::message(&sentence(&of.about)));
    }
    Text::joined(told, " ")
}

/// The pair of codes that is farthest beyond what is allowed, or nearest to it.
fn farthest(of: &FaceOffOutcome) -> Option<(&OfField, &OfPair)> {
    let judged = of.fields.iter().filter_map(|field| {
        let judged = field.pairs.iter().filter(|pair| pair.judged);
        Some((field, worst_time(judged)?))
    });
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

/// What is wrong with an order, and what is left in the limit.
fn order_words(of: &OfOrder) -> Option<Text> {
    let limits = ["L²", "H¹"].into_iter().zip(of.limits);
    let limits = limits.filter_map(|(norm, limit)| {
        let limit = limit.filter(|limit| limit.found != Found::Zero)?;
        let what = match of.found.against {
            "code" => "difference",
            _ => "error",
        };
        let (field, words) = (&of.found.field, limit.words());
        Some(text!(
            "The {} in `{}` of {} in {} {}.",
            what,
            field,
            &of.of,
            norm,
            words
        ))
    });
    let low = low(of).map(|low| text!("`{}` of {} {}.", &of.found.field, &of.of, low));
    let all = Text::joined(low.into_iter().chain(limits), " ");
    Some(all).filter(|all| !all.is_empty())
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
    let mut steps = Vec::new();
    if of.verdict.passes() {
        return steps;
    }
    if of.runs.iter().any(|run| run.failure.is_some()) {
        steps.push(Todo::only("Keep the folders of the runs by --keep DIR; command.txt in each is what was typed, log.txt what it said."));
    }
    let is_wrong = |order: &&OfOrder| order.verdict == Some(Verdict::Disagree);
    if let Some(order) = orders_of(of).find(is_wrong) {
        let has_times = of
            .fields
            .iter()
            .flat_map(|f| &f.pairs)
            .any(|p| p.t.is_some());
        let is_constant = order.verdicts == [Some(Verdict::Disagree), Some(Verdict::Agree)];
        steps.push(Todo::only(match (has_times, is_constant, odd_order(of).is_some()) {
                (true, _, false) if order.axis == "h" => "The error of the time step does not fall with the mesh: let the step fall with it, by a list under [parameters] as long as n, before looking for another cause.".into(),
                (_, true, _) => text!("The gradient of `{}` converges as it should and `{}` itself does not: see first what fixes the constant in it, a value at a point or the mean, in the codes and in exact.", &order.found.field, &order.found.field),
                _ => "Refine further to see whether the order rises, and take parts of the form, the data and the element away one by one, in each code whose order is low.".into(),
            }));
    } else if let Some(known) = of
        .in_form
        .iter()
        .find(|of| of.wrong().and_then(InForm::cause).is_some())
    {
        steps.push(Todo::only(text!(
            "Mend that in `{}`, or in the form, and run this again.",
            &known.code
        )));
    } else if of.fields.iter().any(|f| f.verdict == Verdict::Disagree) {
        steps.push(Todo::only("Look where the difference enters: on a boundary it is a condition or a group, everywhere a coefficient, a sign or a quadrature rule."));
    }
    steps
}

/// The number of a refinement, or what another level is called.
fn level(of: &Label) -> Option<Cell> {
    match of {
        Label::Only => None,
        Label::Mesh(n) => Some(Cell::number(*n as f64, n.to_string())),
        Label::Named(name) => Some(name.into()),
    }
}

fn runs_table(runs: &[RunOf]) -> Table {
    let outcome = |run: &RunOf| run.failure.as_deref().map_or("done".into(), Text::message);
    table!("", runs, |run|
        "code" => &run.code,
        "n" => level(&run.level),
        "time" => run.seconds.map(super::model::duration),
        "outcome" => outcome(run),
    )
}

fn moved_table(of: &Diagnosis) -> Table {
    let n = of.n.map_or(String::new(), |n| format!(", n = {n}"));
    let caption = format!("What moves an answer{n}");
    table!(caption, &of.moved, |moved|
        "code" => &moved.code,
        "change" => moved.change.words(),
        "of" => &moved.of,
        "moved by" => moved.relative,
        "remark" => moved.reason.clone(),
    )
}

fn pairs_table(of: &OfField, pairs: &[&OfPair], more: &str) -> Table {
    let norm = |pair: &OfPair, pick: fn(&Norms) -> Option<(f64, f64)>| {
        let (norm, scale) = pair.compared.norms.as_ref().and_then(pick)?;
        Some(format!("{} of {}", size(norm), size(scale)))
    };
    let verdict = |pair: &OfPair| match pair.judged {
        true => Cell::from(pair.compared.field.verdict),
        false => NOT_JUDGED.into(),
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
    table!(text!("`{}`{}", &of.field, more), pairs, |pair|
        "codes" => format!("{} – {}", pair.a, pair.b),
        "n" => level(&pair.level),
        "t" => pair.t.map(|t| Cell::number(t, short(t).to_string())),
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

/// What the result of each code leaves of the form.
fn in_form_table(all: &[OfForm]) -> Table {
    let caption = text!("The results in the form{}", all[0].level.at());
    table!(caption, all, |of|
        "code" => &of.code,
        "verdict" => of.found.as_ref().map_or(Verdict::Undetermined, |found| found.verdict),
        "residual" => of.found.as_ref().map(|found| found.residual),
        "found" => match (&of.found, &of.refused) {
            (Some(found), _) => match found.cause() {
                Some(cause) => text!("as if {}", cause),
                None => found.sentence.clone(),
            },
            (None, refused) => Text::message(refused.as_deref().unwrap_or_default()),
        },
    )
}

fn orders_table(of: &OfField) -> Table {
    let rows = of.orders.iter().flat_map(|order| {
        let h1 = order.found.h1.as_ref().map(|h1| (order, "H¹", 1, h1));
        [(order, "L²", 0, &order.found.l2)].into_iter().chain(h1)
    });
    let times = of.errors_of.map(|times| format!(", of errors at {times}"));
    let caption = text!(
        "Observed orders of `{}`{}",
        &of.field,
        times.unwrap_or_default()
    );
    let limit = |order: &OfOrder, k: usize| order.limits[k].map(|limit| limit.words());
    table!(caption, rows, |(order, norm, k, found)|
        "of" => &order.of,
        "norm" => norm,
        "against" => order.found.against,
        "in" => &order.axis,
        "between levels" => joined(found.steps.iter().map(|o| format!("{o:.2}")), " "),
        "fit" => found.fit.map(|fit| Cell::fixed(fit.exponent, 2)),
        "theory" => order.theory[k].map(|theory| number(theory, 2)),
        "verdict" => order.verdicts[k],
        "limit" => limit(order, k),
    )
}

/// Errors, or differences of codes, by n.
fn order_figures(of: &OfField) -> html::Html {
    type Pick = fn(&Norms) -> Option<f64>;
    let panel = |norm: &str, k: usize, pick: Pick| {
        let line = |(place, order): (usize, &OfOrder)| {
            let levels = order.n.iter().zip(&order.found.levels);
            let errors = levels.filter_map(|(n, l)| Some([(*n)? as f64, pick(l.norms.as_ref()?)?]));
            let found = [Some(&order.found.l2), order.found.h1.as_ref()][k];
            let fit = found
                .and_then(|o| o.fit)
                .map(|fit| format!("{:.2}", fit.exponent));
            Line {
                about: fit.unwrap_or_default(),
                ..Line::new(&order.of, place, errors)
            }
        };
        let lines = of.orders.iter().enumerate().map(line).collect();
        Chart {
            slopes: slopes_of(of.orders.iter().filter_map(|order| order.theory[k])),
            ..over_n(norm, lines)
        }
    };
    let mut panels = vec![panel("L²", 0, |n| Some(n.l2)), panel("H¹", 1, |n| n.h1)];
    panels.retain(|panel| !panel.is_empty());
    let dotted = if panels.iter().any(|p| !p.slopes.is_empty()) {
        "; dotted: theory"
    } else {
        ""
    };
    let caption = text!("**{}** by n, with the order that fits{}", &of.field, dotted);
    let widest = if panels.len() > 1 {
        html::WIDEST
    } else {
        535.0
    };
    html::chart_figure(&caption, &panels, widest)
}

fn number_table(of: &OfNumber) -> Table {
    let exact = of.exact.map(|x| text!(", exact {}", Number::exact(x)));
    let values = |row: &RowOfNumber| {
        let of = |(code, value): (&String, &f64)| text!("{} {}", code, Number::new(*value, 13));
        Text::joined(row.values.iter().map(of), ", ")
    };
    let verdict = |row: &RowOfNumber| match row.judged {
        true => Cell::from(row.verdict),
        false => NOT_JUDGED.into(),
    };
    table!(text!("`{}`{}", &of.number, exact), &of.rows, |row|
        "n" => level(&row.level),
        "values" => values(row),
        "verdict" => verdict(row),
        "remark" => &row.reason,
    )
}

/// A case for every pair, order and number, and for every code that failed.
fn suites(of: &FaceOffOutcome) -> Vec<Suite> {
    let mut cases = Vec::new();
    for run in &of.runs {
        if let Some(failure) = &run.failure {
            let name = format!("run of {}{}", run.code, run.level.at());
            cases.push(TestCase::new(
                &of.name,
                name,
                Verdict::Undetermined,
                failure.clone(),
            ));
        }
    }
    cases.extend(of.missing.iter().map(|missing| {
        let name = format!("run of {}", missing.engine);
        TestCase::new(
            &of.name,
            name,
            Verdict::Undetermined,
            missing.message.clone(),
        )
    }));
    for field in &of.fields {
        for pair in worst_times(field).into_iter().filter(|pair| pair.judged) {
            let level = pair.level.at();
            let name = format!("{}, {} – {}{level}", field.field, pair.a, pair.b);
            let found = &pair.compared.field;
            let time = pair.t.map(|t| format!("t = {}: ", short(t)));
            let why = match why(found) {
                why if why.is_empty() => why,
                why => time.unwrap_or_default() + &why,
            };
            cases.push(TestCase::new(&of.name, name, found.verdict, why));
        }
        for order in &field.orders {
            if let Some(verdict) = order.verdict {
                let name = format!("order of {}, {}", field.field, order.of);
                cases.push(TestCase::new(
                    &of.name,
                    name,
                    verdict,
                    order_words(order).unwrap_or_default().to_string(),
                ));
            }
        }
    }
    for number in &of.numbers {
        for row in number.rows.iter().filter(|row| row.judged) {
            let name = format!("{}{}", number.number, row.level.at());
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
