//! The map as text: a line an extreme, a column a method.

use std::fmt::Write as _;

use comfy_table::{Table, presets};

use super::{Entry, Finding, StressOutcome};

/// The map, and every refusal and defect in words.
pub fn table(outcome: &StressOutcome) -> String {
    let mut text = String::new();
    for (engine, version) in &outcome.engines {
        let _ = writeln!(text, "## {engine} {version}\n");
        write_map(&mut text, outcome, engine, verdict);
        write_counts(&mut text, outcome, engine);
        write_sentences(&mut text, outcome, engine);
    }
    text
}

/// The report: the map with its figure.
pub fn report(outcome: &StressOutcome) -> String {
    let mut text = String::from(
        "# What breaks\n\nEach problem has a known solution. `holds`: the relative error (the larger of energy norm and L²) is that of moderate values, or below \
         1e-8. `× 10`: it is ten times that. `refuses`: in words, below. `wrong`: an answer that claims to be one and is not. After a comma the steps.\n\n",
    );
    for (engine, _) in &outcome.engines {
        let _ = writeln!(text, "![map of {engine}](map-{engine}.svg)\n");
    }
    text += &table(outcome);
    text += "# How rounding is amplified\n\nAn estimate, from below, of Skeel's condition number of the linearised scheme at each answer: so many times a relative rounding of its terms shows in u. \
             After a comma the digits that agree with the moderate solution, where that has the same dofs.\n\n";
    for (engine, version) in &outcome.engines {
        let _ = writeln!(text, "## {engine} {version}\n");
        let _ = writeln!(text, "![conditions of {engine}](condition-{engine}.svg)\n");
        write_map(&mut text, outcome, engine, conditioning);
    }
    text
}

/// The lines of an engine's map: family and value.
pub fn lines<'a>(outcome: &'a StressOutcome, engine: &str) -> Vec<(&'a str, &'a str)> {
    let mut lines: Vec<(&str, &str)> = Vec::new();
    for cell in outcome.entries.iter().filter(|c| c.engine == engine) {
        let line = (cell.family, &*cell.value);
        if !lines.contains(&line) {
            lines.push(line);
        }
    }
    // What is extreme in the same way stands together, whichever scene it is of.
    let mut families: Vec<&str> = Vec::new();
    for (family, _) in &lines {
        if !families.contains(family) {
            families.push(family);
        }
    }
    lines.sort_by_key(|line| families.iter().position(|f| *f == line.0));
    lines
}

/// The columns.
pub fn methods<'a>(outcome: &'a StressOutcome, engine: &str) -> Vec<&'a str> {
    let mut methods: Vec<&str> = Vec::new();
    for cell in outcome.entries.iter().filter(|c| c.engine == engine) {
        if !methods.contains(&&*cell.method) {
            methods.push(&cell.method);
        }
    }
    methods
}

pub fn find<'a>(
    outcome: &'a StressOutcome,
    engine: &str,
    (family, value): (&str, &str),
    method: &str,
) -> Option<&'a Entry> {
    let place = (engine, family, value, method);
    let cells = outcome.entries.iter();
    cells
        .into_iter()
        .find(|c| (&*c.engine, c.family, &*c.value, &*c.method) == place)
}

/// One verdict, short.
pub fn word(verdict: &Finding) -> String {
    match verdict {
        Finding::Holds => "holds".into(),
        Finding::Degrades { factor } if *factor < 100.0 => format!("× {factor:.1}"),
        Finding::Degrades { factor } => format!("× {factor:.0e}"),
        Finding::Refuses { .. } => "refuses".into(),
        Finding::Wrong { .. } => "wrong".into(),
    }
}

/// Verdict and steps.
fn verdict(cell: &Entry) -> String {
    let steps = cell.steps.map(|steps| format!(", {steps}"));
    word(&cell.verdict) + &steps.unwrap_or_default()
}

/// Condition and digits.
fn conditioning(cell: &Entry) -> String {
    let digits = cell.digits.map(|digits| format!(", {digits:.0}"));
    amplified(cell) + &digits.unwrap_or_default()
}

/// The condition, to a decade.
pub fn amplified(cell: &Entry) -> String {
    cell.condition.map_or(String::new(), |c| format!("{c:.0e}"))
}

fn write_map(
    text: &mut String,
    outcome: &StressOutcome,
    engine: &str,
    words: fn(&Entry) -> String,
) {
    let methods = methods(outcome, engine);
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header(["extreme", ""].iter().chain(&methods).copied());
    for (family, value) in lines(outcome, engine) {
        let mut row = vec![family.to_owned(), value.to_owned()];
        row.extend(methods.iter().map(|method| {
            find(outcome, engine, (family, value), method).map_or(String::new(), words)
        }));
        table.add_row(row);
    }
    let _ = writeln!(text, "{table}\n");
}

fn write_counts(text: &mut String, outcome: &StressOutcome, engine: &str) {
    let count = |of: fn(&Finding) -> bool| {
        let cells = outcome.entries.iter().filter(|c| c.engine == engine);
        cells.filter(|c| of(&c.verdict)).count()
    };
    let _ = writeln!(
        text,
        "{} hold, {} degrade, {} refuse, {} wrong\n",
        count(|v| *v == Finding::Holds),
        count(|v| matches!(v, Finding::Degrades { .. })),
        count(|v| matches!(v, Finding::Refuses { .. })),
        count(Finding::is_wrong),
    );
}

/// Each sentence once, with the places where it was said.
fn write_sentences(text: &mut String, outcome: &StressOutcome, engine: &str) {
    let mut said: Vec<(String, Vec<String>)> = Vec::new();
    for cell in outcome.entries.iter().filter(|c| c.engine == engine) {
        let sentence = match &cell.verdict {
            Finding::Refuses { sentence } => format!("refuses: {sentence}"),
            Finding::Wrong { why } => format!("wrong: {why}"),
            _ => continue,
        };
        let place = format!("{} {} {}", cell.family, cell.value, cell.method);
        match said.iter_mut().find(|(known, _)| *known == sentence) {
            Some((_, places)) => places.push(place),
            None => said.push((sentence, vec![place])),
        }
    }
    for (sentence, places) in said {
        let _ = writeln!(text, "- {sentence} ({})", places.join("; "));
    }
}

/// All cells, one a line; every text is quoted (RFC 4180).
pub fn csv(outcome: &StressOutcome) -> String {
    let mut text = String::from(
        "engine,method,family,value,verdict,factor,error,reference,digits,steps,residual,condition,sentence\n",
    );
    let quoted = |s: &str| format!("\"{}\"", s.replace('"', "\"\""));
    let some = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:e}"));
    for c in &outcome.entries {
        let (verdict, factor, sentence) = match &c.verdict {
            Finding::Holds => ("holds", None, ""),
            Finding::Degrades { factor } => ("degrades", Some(*factor), ""),
            Finding::Refuses { sentence } => ("refuses", None, &**sentence),
            Finding::Wrong { why } => ("wrong", None, &**why),
        };
        let fields = [
            quoted(&c.engine),
            quoted(&c.method),
            quoted(c.family),
            quoted(&c.value),
            verdict.to_owned(),
            some(factor),
            some(c.error),
            some(c.reference),
            some(c.digits),
            c.steps.map_or(String::new(), |s| s.to_string()),
            some(c.residual),
            some(c.condition),
            quoted(sentence),
        ];
        let _ = writeln!(text, "{}", fields.join(","));
    }
    text
}
