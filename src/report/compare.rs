//! What `compare` found.

use super::difference::write_differences;
use super::model::{Block, Cell, Report, Suite, Table, TestCase, count, table, word};
use super::verify::{remark, why, worst};
use faceoff_judge::{ComparedField, Comparison, FieldVerdict, MatchBy};
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
    let failed = fields.clone().filter(|f| !f.verdict.passes()).count();
    let mut lead = vec![format!(
        "{failed} of {} do not agree within their tolerances.",
        count(comparison.fields.len(), "field")
    )];
    let farthest = fields.filter(|f| !f.verdict.passes());
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
    report.blocks.push(Block::facts([
        ("a", comparison.a.clone()),
        ("b", comparison.b.clone()),
        ("matched by", map.to_owned()),
    ]));
    report.blocks.push(fields_table(comparison).into());
    let name = format!("{} – {}", comparison.a, comparison.b);
    let cases = comparison.fields.iter().map(|compared| {
        let field = &compared.field;
        let of = format!("{} on {:?}", field.field, compared.on).to_lowercase();
        TestCase {
            title: Some(format!("{name}: {}", field.field)),
            ..TestCase::new(&name, of, field.verdict, why(field))
        }
    });
    report.suites.push(Suite::new(&name, cases));
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
    let on = |of: &ComparedField| format!("{:?}", of.on).to_lowercase();
    let given = |value: f64| match value {
        0.0 => Cell::from(0_usize),
        _ => Cell::Number(value, format!("{value:e}")),
    };
    let remark = |of: &ComparedField| {
        let remark = remark(&of.field, &on(of));
        remark.split_once(": ").map(|(_, what)| what.to_owned())
    };
    table!("", &comparison.fields, |of|
        "field" => &of.field.field,
        "on" => on(of),
        "max |a-b|" => of.field.max_abs,
        "relative" => of.field.max_rel,
        "scale" => of.scale,
        "rtol" => given(of.rtol),
        "atol" => given(of.atol),
        "worst" => worst(&of.field),
        "verdict" => of.field.verdict,
        "remark" => remark(of),
    )
}
