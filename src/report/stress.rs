//! The report of stress tests: a map with one line per extreme and one column per method.

use serde_json::json;

use super::html::{Map, Spot};
use super::json::{Judged, csv};
use super::model::{
    Block, Cell, Report, Suite, Table, TestCase, cells, count, each_once, joined, table,
};
use crate::campaigns::stress::{self, Behaviour, StressOutcome};
use crate::engine::unique;
use crate::text::number::number;
use crate::text::{Text, text};
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;

const HOW: &str = "Each problem has a known solution. `holds`: the relative error (the larger of energy norm and L²) is that of moderate \
    values, or below 10⁻⁸. `× 10`: it is ten times that. `refuses`: in words, below. `wrong`: a result reported as right that is not.";
const AMPLIFIED: &str = "The condition is an estimate, from below, of Skeel's condition number of the linearised scheme at each answer: how many times a \
    relative rounding of its terms shows in u. Digits are those that agree with the moderate solution, where that has the same dofs.";
/// The backgrounds of the map, with their meanings.
const LEGEND: [(&str, &str); 7] = [
    ("w0", "holds"),
    ("w1", "up to 10 times the error"),
    ("w2", "up to 1 000"),
    ("w3", "up to 10⁶"),
    ("w4", "more"),
    ("wr", "refuses"),
    ("wx", "wrong"),
];

/// The report of all trials.
///
/// # Errors
/// Only those of a broken installation.
pub fn stress(outcome: &StressOutcome) -> Result<Report<'_>> {
    let [hold, degrade, refuse, wrong] = counts(outcome);
    let headline = format!("{hold} hold, {degrade} degrade, {refuse} refuse, {wrong} wrong");
    let (verdict, word) = match wrong {
        0 => (Verdict::Agree, "nothing wrong"),
        _ => (Verdict::Disagree, "wrong"),
    };
    let found = Judged {
        verdict,
        found: outcome,
    };
    let mut report = Report::new("stress", "faceoff stress: what breaks?", headline, &found)?;
    report.verdict = Some((verdict, word));
    let all = outcome.entries.len();
    report.story.claim = match wrong {
        0 => text!("**Nothing is wrong** in {}", count(all, "trial")),
        _ => text!("**{wrong} of {all} answers are wrong** and claim to be right"),
    };
    report.story.rests_on = behaviours(outcome);
    report.engines = outcome.engines.clone();
    report.notes = vec![text!(HOW), text!(AMPLIFIED)];
    let drawn = Block::drawn(|| map_of(outcome).html());
    report.story.rest.push(Block::Page(vec![
        Block::heading(2, "What became of each extreme"),
        drawn,
    ]));
    for (engine, version) in &outcome.engines {
        report.suites.push(suite(outcome, engine));
        let name = format!("{engine} {version}");
        report.story.rest.push(Block::Terminal(vec![
            Block::heading(2, name.clone()),
            map(outcome, engine, became).into(),
        ]));
        let sentences = sentences(outcome, engine);
        if !sentences.is_empty() {
            let title = format!("What {name} refuses, and how");
            report
                .story
                .rest
                .push(Block::Page(vec![Block::heading(2, title)]));
            report.story.rest.push(Block::list(sentences));
        }
    }
    let folded = Block::folded(
        "Every number",
        count(all, "trial"),
        vec![numbers(outcome).into()],
    );
    report.story.rest.push(Block::Page(vec![folded]));
    report.file("map.csv", || cells_csv(outcome));
    Ok(report)
}

/// The results of the trials.
fn behaviours(outcome: &StressOutcome) -> Text {
    let [hold, degrade, refuse, _] = counts(outcome);
    let worst = outcome.entries.iter().filter_map(|c| match c.verdict {
        Behaviour::Degrades { factor } => Some((factor, c)),
        _ => None,
    });
    let worst = worst.max_by(|a, b| a.0.total_cmp(&b.0));
    let worst = worst.map(|(factor, c)| {
        text!(
            " The worst loses a factor of {}: {c.family} {c.value} by {c.method}.",
            crate::text::number::size(factor)
        )
    });
    text!(
        "**{hold}** hold their accuracy, {degrade} degrade, {refuse} are refused with a message.{worst}"
    )
}

/// The numbers of answers that hold, degrade, refuse and are wrong.
fn counts(outcome: &StressOutcome) -> [usize; 4] {
    let mut counts = [0; 4];
    for entry in &outcome.entries {
        counts[match entry.verdict {
            Behaviour::Holds => 0,
            Behaviour::Degrades { .. } => 1,
            Behaviour::Refuses { .. } => 2,
            Behaviour::Wrong { .. } => 3,
        }] += 1;
    }
    counts
}

fn entries<'a>(
    outcome: &'a StressOutcome,
    engine: &str,
) -> impl Iterator<Item = &'a stress::Entry> {
    outcome.entries.iter().filter(move |c| c.engine == engine)
}

/// The lines of an engine's map: family and value.
fn lines<'a>(outcome: &'a StressOutcome, engine: &str) -> Vec<(&'a str, &'a Text)> {
    let mut lines = unique(entries(outcome, engine).map(|c| (c.family, &c.value)));
    // Extremes of the same kind are together, regardless of their scenes.
    let families = unique(lines.iter().map(|line| line.0));
    lines.sort_by_key(|line| families.iter().position(|f| *f == line.0));
    lines
}

/// The columns.
fn methods<'a>(outcome: &'a StressOutcome, engine: &str) -> Vec<&'a str> {
    unique(entries(outcome, engine).map(|c| &*c.method))
}

fn find<'a>(
    outcome: &'a StressOutcome,
    engine: &str,
    (family, value): (&str, &Text),
    method: &str,
) -> Option<&'a stress::Entry> {
    let place = (family, value, method);
    entries(outcome, engine).find(|c| (c.family, &c.value, &*c.method) == place)
}

/// One verdict, short.
fn word(verdict: &Behaviour) -> String {
    match verdict {
        Behaviour::Holds => "holds".into(),
        Behaviour::Degrades { factor } if *factor < 100.0 => format!("× {factor:.1}"),
        Behaviour::Degrades { factor } => format!("× {}", number(*factor, 1)),
        Behaviour::Refuses { .. } => "refuses".into(),
        Behaviour::Wrong { .. } => "wrong".into(),
    }
}

/// Behaviour and steps.
fn became(cell: &stress::Entry) -> String {
    let steps = cell
        .steps
        .map(|steps| format!(" in {}", count(steps, "step")));
    word(&cell.verdict) + &steps.unwrap_or_default()
}

/// The background of a verdict.
fn ground(verdict: &Behaviour) -> &'static str {
    match verdict {
        Behaviour::Holds => "w0",
        Behaviour::Degrades { factor } if *factor <= 10.0 => "w1",
        Behaviour::Degrades { factor } if *factor <= 1e3 => "w2",
        Behaviour::Degrades { factor } if *factor <= 1e6 => "w3",
        Behaviour::Degrades { .. } => "w4",
        Behaviour::Refuses { .. } => "wr",
        Behaviour::Wrong { .. } => "wx",
    }
}

/// The numbers of a trial on one line, and why it is refused or wrong.
fn told(cell: &stress::Entry) -> String {
    let mut told = vec![format!(
        "{} {}, {} {}",
        cell.engine,
        cell.method,
        cell.family,
        cell.value.told()
    )];
    if let Behaviour::Refuses { sentence: why } | Behaviour::Wrong { why } = &cell.verdict {
        told.push(why.told());
    }
    let mut add = |name: &str, value: Option<f64>| {
        told.extend(value.map(|value| format!("{name} {}", number(value, 2))));
    };
    add("error", cell.error);
    add("moderate error", cell.reference);
    add("digits in common", cell.digits.map(agreeing));
    add("condition", cell.condition);
    add("residual", cell.residual);
    told.extend(cell.steps.map(|steps| count(steps, "step")));
    joined(told, "\n")
}

/// The map of all codes.
fn map_of(outcome: &StressOutcome) -> Map {
    let engines = || outcome.engines.iter().map(|(engine, _)| engine);
    let columns: Vec<(&String, &str)> = engines()
        .flat_map(|engine| {
            methods(outcome, engine)
                .into_iter()
                .map(move |m| (engine, m))
        })
        .collect();
    let lines = unique(engines().flat_map(|engine| lines(outcome, engine)));
    let spot = |cell: &stress::Entry| Spot {
        word: word(&cell.verdict),
        class: ground(&cell.verdict),
        title: told(cell),
    };
    let of_family = |family: &str| {
        let values = lines.iter().filter(|line| line.0 == family);
        let row = |line: &(&str, &Text)| {
            let of = columns.iter();
            let spots = of.map(|(engine, method)| find(outcome, engine, *line, method).map(spot));
            (line.1.clone(), spots.collect())
        };
        (family.to_owned(), values.map(row).collect())
    };
    let families = unique(lines.iter().map(|line| line.0)).into_iter();
    let head = outcome.engines.iter().map(|(engine, version)| {
        let methods = methods(outcome, engine).into_iter().map(str::to_owned);
        (format!("{engine} {version}"), methods.collect())
    });
    Map {
        caption: text!(
            "**Rows are extremes, columns codes and methods.** Point at a word for its error, condition, digits and steps"
        ),
        of: ["extreme", "value"],
        head: head.collect(),
        families: families.map(of_family).collect(),
        legend: LEGEND.to_vec(),
    }
}

/// Every trial with its numbers.
fn numbers(outcome: &StressOutcome) -> Table {
    let digits = |cell: &stress::Entry| cell.digits.map(|d| Cell::fixed(agreeing(d), 0));
    let ratio = |cell: &stress::Entry| Some(cell.error? / cell.reference.filter(|r| *r > 0.0)?);
    table!("", &outcome.entries, |cell|
        "code" => &cell.engine,
        "method" => &cell.method,
        "extreme" => cell.family,
        "value" => &cell.value,
        "verdict" => word(&cell.verdict),
        "error" => cell.error.map(Cell::size),
        "ratio" => ratio(cell).map(Cell::size),
        "steps" => cell.steps,
        "residual" => cell.residual.map(Cell::size),
        "condition" => cell.condition.map(Cell::size),
        "digits" => digits(cell),
    )
}

/// Integer digits; empty if the first one differs.
fn agreeing(digits: f64) -> f64 {
    digits.floor().max(0.0)
}

fn map(outcome: &StressOutcome, engine: &str, words: fn(&stress::Entry) -> String) -> Table {
    let methods = methods(outcome, engine);
    let head = [&["extreme", "value"], &methods[..]].concat();
    let rows = lines(outcome, engine).into_iter().map(|line| {
        let mut row = cells![line.0, line.1];
        let cell = |method: &&str| find(outcome, engine, line, method).map(words);
        row.extend(methods.iter().map(|method| Cell::from(cell(method))));
        row
    });
    Table::new("", head).with(rows)
}

/// Each sentence once, with its places.
fn sentences(outcome: &StressOutcome, engine: &str) -> Vec<Text> {
    let said = entries(outcome, engine).filter_map(|cell| {
        let sentence = match &cell.verdict {
            Behaviour::Refuses { sentence } => text!("refuses: {sentence}"),
            Behaviour::Wrong { why } => text!("wrong: {why}"),
            _ => return None,
        };
        Some((sentence, text!("{cell.family} {cell.value} {cell.method}")))
    });
    each_once(said, usize::MAX)
}

/// A refusal with a message is not a failure; a wrong answer is.
fn suite(outcome: &StressOutcome, engine: &str) -> Suite {
    let cases = entries(outcome, engine).map(|cell| {
        let (verdict, message) = match &cell.verdict {
            Behaviour::Wrong { why } => (Verdict::Disagree, why.to_string()),
            _ => (Verdict::Agree, String::new()),
        };
        let class = format!("{engine}.{}", cell.method);
        let name = format!("{} {}", cell.family, cell.value);
        TestCase {
            title: Some(format!("{engine}, {}: {name}", cell.method)),
            ..TestCase::new(&class, name, verdict, message)
        }
    });
    Suite::new(engine, cases)
}

/// All cells, one per line.
fn cells_csv(outcome: &StressOutcome) -> String {
    let head = "engine,method,family,value,verdict,factor,error,reference,digits,steps,residual,condition,sentence";
    let of = |cell: &stress::Entry| {
        let mut fields = json!(cell);
        if let Behaviour::Wrong { why } = &cell.verdict {
            fields["sentence"] = json!(why);
        }
        fields
    };
    csv(head, outcome.entries.iter().map(of))
}
