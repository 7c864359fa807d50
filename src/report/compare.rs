//! What `compare` found.

use super::difference::write_differences;
use super::model::{Block, Cell, Report, Suite, Table, TestCase, cells, count, word};
use super::verify::{remark, why, worst};
use faceoff_judge::{Comparison, FieldVerdict, MatchBy, Verdict};
use faceoff_mesh::error::Result;
use faceoff_mesh::field::Results;

/// The report of a comparison; `a` is the first side, whose mesh the differences lie on.
///
/// # Errors
/// None but of a broken installation.
pub fn compare<'a>(comparison: &'a Comparison, a: &'a Results) -> Result<Report<'a>> {
    let question = "faceoff compare: do two results agree, field by field?";
    let verdict = word(comparison.verdict);
    let mut report = Report::new("compare", question, verdict, comparison)?;
    report.verdict = Some((comparison.verdict, verdict));
    let fields = comparison.fields.iter().map(|f| &f.field);
    let failed = fields
        .clone()
        .filter(|f| f.verdict != Verdict::Agree)
        .count();
    let mut lead = vec![format!(
        "{failed} of {} do not agree within their tolerances.",
        count(comparison.fields.len(), "field")
    )];
    let farthest = fields.filter(|f| f.verdict != Verdict::Agree);
    let farthest = farthest.max_by(|f, g| {
        let factor = |f: &FieldVerdict| match f.max_rel / f.tolerance {
            factor if factor.is_nan() => f64::INFINITY,
            factor => factor,
        };
        factor(f).total_cmp(&factor(g))
    });
    lead.extend(
        farthest.map(|field| format!("Farthest beyond: `{}`: {}.", field.field, why(field))),
    );
    lead.extend(comparison.notes.iter().cloned());
    report.lead.push(Block::List(lead));
    let map = match comparison.map {
        MatchBy::Vertices => "vertices",
        MatchBy::Coordinates => "coordinates",
    };
    let facts = [
        ("a", comparison.a.as_str()),
        ("b", &comparison.b),
        ("matched by", map),
    ];
    let facts = facts.map(|(name, fact)| (name.to_owned(), fact.to_owned()));
    report.blocks.push(Block::Facts(facts.into()));
    report.blocks.push(fields_table(comparison).into());
    let name = format!("{} – {}", comparison.a, comparison.b);
    let cases = comparison.fields.iter().map(|field| TestCase {
        class: name.clone(),
        name: format!("{} on {:?}", field.field.field, field.on).to_lowercase(),
        title: Some(format!("{name}: {}", field.field.field)),
        seconds: 0.0,
        verdict: field.field.verdict,
        message: why(&field.field),
    });
    let cases = cases.collect();
    report.suites.push(Suite {
        name,
        properties: Vec::new(),
        cases,
    });
    report.inputs = [&comparison.a, &comparison.b].map(Into::into).into();
    // A table of keys has no places.
    if !a.points.is_empty() {
        report.files.push(Box::new(move |folder| {
            write_differences(&folder.join("differences.vtu"), a, comparison)
        }));
    }
    Ok(report)
}

/// One line a field.
fn fields_table(comparison: &Comparison) -> Table {
    let rows = comparison.fields.iter().map(|compared| {
        let field = &compared.field;
        let on = format!("{:?}", compared.on).to_lowercase();
        let given = |value: f64| {
            Cell::Number(
                value,
                if value == 0.0 {
                    "0".into()
                } else {
                    format!("{value:e}")
                },
            )
        };
        cells![
            &field.field,
            on.as_str(),
            field.max_abs,
            field.max_rel,
            compared.scale,
            given(compared.rtol),
            given(compared.atol),
            worst(field),
            field.verdict,
            remark(field, &on)
                .split_once(": ")
                .map(|(_, what)| what.to_owned()),
        ]
    });
    let head = [
        "field",
        "on",
        "max |a-b|",
        "relative",
        "scale",
        "rtol",
        "atol",
        "worst",
        "verdict",
        "remark",
    ];
    Table::new("", &head).with(rows)
}
