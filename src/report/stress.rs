//! What breaks: a map with a line an extreme and a column a method.

mod figure;

use serde_json::json;

use super::json::{Judged, csv};
use super::model::{Block, Cell, Report, Suite, Table, TestCase, cells, count};
use super::number::number;
use crate::campaigns::stress::{self, Behaviour, StressOutcome};
use crate::engine::unique;
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;

const HOW: &str = "Each problem has a known solution. `holds`: the relative error (the larger of energy norm and L²) is that of moderate \
    values, or below 1e-8. `× 10`: it is ten times that. `refuses`: in words, below. `wrong`: an answer that claims to be one and is \
    not.";
const AMPLIFIED: &str = "An estimate, from below, of Skeel's condition number of the linearised scheme at each answer: so many times a relative \
    rounding of its terms shows in u. Beside it the digits that agree with the moderate solution, where that has the same dofs.";

/// The report of all trials.
///
/// # Errors
/// None but of a broken installation.
pub fn stress(outcome: &StressOutcome) -> Result<Report<'_>> {
    let those =
        |of: fn(&Behaviour) -> bool| outcome.entries.iter().filter(|c| of(&c.verdict)).count();
    let wrong = those(Behaviour::is_wrong);
    let headline = format!(
        "{} hold, {} degrade, {} refuse, {wrong} wrong",
        those(|v| *v == Behaviour::Holds),
        those(|v| matches!(v, Behaviour::Degrades { .. })),
        those(|v| matches!(v, Behaviour::Refuses { .. })),
    );
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
    report.claim = match wrong {
        0 => format!(
            "**Nothing is wrong** in {}: what does not hold is refused",
            count(all, "trial")
        ),
        _ => format!("**{wrong} of {all} answers are wrong** and claim to be right"),
    };
    report.lede = behaviours(outcome);
    report.engines = outcome.engines.clone();
    report
        .blocks
        .push(Block::Page(vec![Block::Text(HOW.into())]));
    for (engine, version) in &outcome.engines {
        report.suites.push(suite(outcome, engine));
        report.blocks.extend([
            Block::Heading(2, format!("{engine} {version}")),
            Block::Page(vec![
                Block::Figure(figure::map(outcome, engine)),
                Block::Folded(
                    "The same as a table · with the steps".into(),
                    vec![map(outcome, engine, became).into()],
                ),
            ]),
            Block::Terminal(vec![map(outcome, engine, became).into()]),
            Block::List(sentences(outcome, engine)),
            Block::Page(vec![
                Block::Heading(3, format!("How rounding is amplified in {engine}")),
                Block::Text(AMPLIFIED.into()),
                Block::Figure(figure::conditions(outcome, engine)),
                Block::Folded(
                    "The same as a table · with the digits".into(),
                    vec![map(outcome, engine, conditioning).into()],
                ),
            ]),
        ]);
    }
    report.file("map.csv", || cells_csv(outcome));
    Ok(report)
}

/// What became of the trials.
fn behaviours(outcome: &StressOutcome) -> String {
    let of = |is: fn(&Behaviour) -> bool| outcome.entries.iter().filter(|c| is(&c.verdict)).count();
    let worst = outcome.entries.iter().filter_map(|c| match c.verdict {
        Behaviour::Degrades { factor } => Some((factor, c)),
        _ => None,
    });
    let worst = worst.max_by(|a, b| a.0.total_cmp(&b.0));
    let worst = worst.map_or(String::new(), |(factor, c)| {
        format!(
            " The worst loses a factor of {}: {} {} by {}.",
            super::number::size(factor),
            c.family,
            c.value,
            c.method
        )
    });
    format!(
        "**{}** hold their accuracy, {} degrade, {} are refused in words.{worst}",
        of(|v| *v == Behaviour::Holds),
        of(|v| matches!(v, Behaviour::Degrades { .. })),
        of(|v| matches!(v, Behaviour::Refuses { .. }))
    )
}

fn entries<'a>(
    outcome: &'a StressOutcome,
    engine: &str,
) -> impl Iterator<Item = &'a stress::Entry> {
    outcome.entries.iter().filter(move |c| c.engine == engine)
}

/// The lines of an engine's map: family and value.
fn lines<'a>(outcome: &'a StressOutcome, engine: &str) -> Vec<(&'a str, &'a str)> {
    let mut lines = unique(entries(outcome, engine).map(|c| (c.family, &*c.value)));
    // What is extreme in the same way stands together, whichever scene it is of.
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
    (family, value): (&str, &str),
    method: &str,
) -> Option<&'a stress::Entry> {
    let place = (family, value, method);
    entries(outcome, engine).find(|c| (c.family, &*c.value, &*c.method) == place)
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

/// Condition and digits.
fn conditioning(cell: &stress::Entry) -> String {
    let digits = cell.digits.map(|digits| format!(", {digits:.0} digits"));
    amplified(cell) + &digits.unwrap_or_default()
}

/// The condition, to a decade.
fn amplified(cell: &stress::Entry) -> String {
    cell.condition.map_or(String::new(), |c| number(c, 1))
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
    Table::new("", &head).with(rows)
}

/// Each sentence once, with the places where it was said.
fn sentences(outcome: &StressOutcome, engine: &str) -> Vec<String> {
    let mut said: Vec<(String, Vec<String>)> = Vec::new();
    for cell in entries(outcome, engine) {
        let sentence = match &cell.verdict {
            Behaviour::Refuses { sentence } => format!("refuses: {sentence}"),
            Behaviour::Wrong { why } => format!("wrong: {why}"),
            _ => continue,
        };
        let place = format!("{} {} {}", cell.family, cell.value, cell.method);
        match said.iter_mut().find(|(known, _)| *known == sentence) {
            Some((_, places)) => places.push(place),
            None => said.push((sentence, vec![place])),
        }
    }
    let said = said.into_iter();
    said.map(|(sentence, places)| format!("{sentence} ({})", places.join("; ")))
        .collect()
}

/// A refusal in words is no failure; an answer that is none is.
fn suite(outcome: &StressOutcome, engine: &str) -> Suite {
    let cases = entries(outcome, engine).map(|cell| {
        let (verdict, message) = match &cell.verdict {
            Behaviour::Wrong { why } => (Verdict::Disagree, why.clone()),
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

/// All cells, one a line.
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
