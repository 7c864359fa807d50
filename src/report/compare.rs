//! What `compare` found.

use std::cmp::Ordering;

use super::difference::write_differences;
use super::html;
use super::model::{Block, Cell, Report, Suite, Table, TestCase, Todo, table, word};
use super::number::{number, place, size, whole};
use super::verify::{remark, why, worst};
use faceoff_judge::{ComparedField, Comparison, MatchBy, On, Verdict};
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
    let wrong = comparison
        .fields
        .iter()
        .filter(|f| !f.field.verdict.passes());
    let wrong: Vec<&ComparedField> = wrong.collect();
    let farthest = wrong.iter().copied().max_by(|f, g| telling(f, g));
    report.claim = claim(comparison, &wrong, verdict);
    report.lede = lede(comparison, &wrong, farthest);
    if let Some(farthest) = farthest {
        report.next = next(comparison, farthest, !a.points.is_empty());
    }
    let shown = farthest.or_else(|| comparison.fields.iter().max_by(|f, g| telling(f, g)));
    report.lead.extend(shown.map(|of| {
        Block::Html(Box::new(move || {
            let compared = html::Compared::new(comparison, a, of);
            Ok(compared.map_or_else(html::Html::default, |compared| compared.figures()))
        }))
    }));
    let map = match comparison.map {
        MatchBy::Vertices => "vertices",
        MatchBy::Coordinates => "coordinates",
    };
    report.notes = vec![format!(
        "Agrees where |a − b| ≤ atol + rtol × the largest value of the field; matched by {map}. a is `{}`, b is `{}`.",
        comparison.a, comparison.b
    )];
    let matched = Block::facts([
        ("a", comparison.a.clone()),
        ("b", comparison.b.clone()),
        ("matched by", map.to_owned()),
    ]);
    let about = "A dot is the largest difference of a field; the dashed lines are the tolerances.";
    report.blocks = vec![
        Block::Terminal(vec![matched, fields_table(comparison).into()]),
        Block::Page(vec![
            Block::Heading(2, "One row per field".into()),
            Block::Text(about.into()),
            Block::Html(Box::new(move || Ok(html::by_field(comparison)))),
        ]),
    ];
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

/// How far beyond its tolerance a field lies.
fn factor(of: &ComparedField) -> f64 {
    match of.field.max_rel / of.field.tolerance {
        factor if factor.is_nan() => f64::INFINITY,
        factor => factor,
    }
}

/// What has values tells more than what is missing, a function more than what is derived from it on cells, and of these the
/// one that is farthest beyond its tolerance.
fn telling(f: &ComparedField, g: &ComparedField) -> Ordering {
    let key = |of: &ComparedField| {
        (
            of.field.worst.is_some(),
            matches!(of.on, On::Points | On::Corners),
        )
    };
    key(f).cmp(&key(g)).then(factor(f).total_cmp(&factor(g)))
}

/// Which fields differ, and where.
fn claim(comparison: &Comparison, wrong: &[&ComparedField], word: &str) -> String {
    let mut wrong = wrong.to_vec();
    wrong.sort_by_key(|f| f.field.verdict == Verdict::Undetermined);
    let names: Vec<&str> = wrong.iter().map(|f| &*f.field.field).collect();
    let all = comparison.fields.len();
    match (&names[..], wrong.first()) {
        ([], _) => {
            let fields = if all == 1 {
                "one field".to_owned()
            } else {
                format!("all {all} fields")
            };
            format!(
                "{} and {} **{word}** in {fields}",
                name(&comparison.a),
                name(&comparison.b)
            )
        }
        ([one], of) => match of.map(|of| (&of.field, &of.field.worst)) {
            Some((field, _)) if field.verdict == Verdict::Undetermined => {
                format!("**{one}** cannot be judged")
            }
            Some((field, Some(worst))) if field.max_abs != 0.0 && !worst.midpoint.is_empty() => {
                format!("**{one}** differs, most at {}", place(&worst.midpoint))
            }
            _ => format!("**{one}** differs"),
        },
        ([one, two], _) => format!("**{one} and {two}** differ"),
        ([one, two, rest @ ..], _) => format!(
            "**{one}, {two}** and {} more of {all} fields differ",
            rest.len()
        ),
    }
}

fn name(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

/// By how much, and what was left out.
fn lede(
    comparison: &Comparison,
    wrong: &[&ComparedField],
    farthest: Option<&ComparedField>,
) -> String {
    let mut told = Vec::new();
    if let Some(ComparedField { field, .. }) = farthest {
        told.push(match &field.reason {
            Some(reason) => format!("`{}`: {reason}.", field.field),
            None => {
                let values = field.worst.as_ref().map_or(String::new(), |w| {
                    format!(" There a has {} and b {}.", number(w.a, 6), number(w.b, 6))
                });
                let times = field.max_rel / field.tolerance;
                let times = match times.is_finite() {
                    true => format!(", {} times the tolerance", number(times, 2)),
                    false => String::new(),
                };
                format!(
                    "`{}` differs by **{} of its largest value**{times}, and beyond it in {} of {} values.{values}",
                    field.field,
                    size(field.max_rel),
                    whole(field.beyond),
                    whole(field.faces)
                )
            }
        });
        let others = comparison.fields.len() - wrong.len();
        if others > 0 {
            told.push(match others {
                1 => "The other field agrees.".into(),
                _ => format!("The other {others} fields agree."),
            });
        }
    } else {
        let largest = comparison
            .fields
            .iter()
            .map(|f| f.field.max_rel)
            .fold(0.0, f64::max);
        told.push(match largest {
            0.0 => "All values are the same, to the last bit.".into(),
            largest => format!("The largest difference is **{}** of the largest value of its field. No value is missing, none is not a number.", size(largest)),
        });
    }
    told.extend(
        comparison
            .notes
            .iter()
            .map(|note| format!("{}.", note.trim_end_matches('.'))),
    );
    told.join(" ")
}

/// What to do about fields that differ.
fn next(comparison: &Comparison, farthest: &ComparedField, has_places: bool) -> Vec<Todo> {
    let none: [&str; 0] = [];
    let mut steps = Vec::new();
    if has_places {
        steps.push(Todo::new(
            "Look at it in ParaView: `differences.vtu` beside this page has a − b of every field.",
            none,
        ));
    }
    let b = &comparison.b;
    steps.push(Todo::new(
        "If both solve a scene that faceoff knows, ask which of the two is wrong, and why:",
        [format!("faceoff judge {b} --scene SCENE")],
    ));
    let field = &farthest.field;
    if field.reason.is_none() && field.max_rel.is_finite() {
        let rtol = 10f64.powf(field.max_rel.log10().ceil());
        steps.push(Todo::new(
            format!(
                "If a difference of {} is as it should be:",
                size(field.max_rel)
            ),
            [format!(
                "faceoff compare {} {b} --rtol {rtol:.0e}",
                comparison.a
            )],
        ));
    }
    steps
}

/// One line a field.
fn fields_table(comparison: &Comparison) -> Table {
    let on = |of: &ComparedField| format!("{:?}", of.on).to_lowercase();
    let given = |value: f64| Cell::Number(value, number(value, 2));
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
