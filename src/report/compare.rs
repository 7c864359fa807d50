//! What `compare` found.

use std::cmp::Ordering;

use super::described::worst;
use super::difference::write_differences;
use super::html;
use super::model::{
    Block, Cell, Report, Suite, Table, TestCase, Todo, count, sentence, table, word,
};
use super::verify::{rests_on, why};
use crate::engine::unique;
use crate::text::number::{number, place, size, whole};
use crate::text::{Number, Text, text};
use faceoff_judge::{
    ComparedField, Comparison, Comparisons, Intersection, MatchBy, Norms, On, Part, Verdict,
};
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
    // A table of keys has no places, and two meshes have none together.
    let has_differences = !a.points.is_empty() && !comparison.differences.is_empty();
    if let Some(farthest) = farthest {
        report.next = next(comparison, farthest, has_differences);
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
        MatchBy::Functions => "nothing: as functions on the intersection of the meshes",
    };
    report.notes = vec![text!(
        "Agrees where |a − b| ≤ atol + rtol × the largest value of the field; matched by {}. a is `{}`, b is `{}`.",
        map,
        &comparison.a,
        &comparison.b
    )];
    let mut facts = vec![
        ("a", Text::from(&comparison.a)),
        ("b", Text::from(&comparison.b)),
        ("matched by", Text::from(map)),
    ];
    let common: Vec<_> = comparison.intersection.iter().flat_map(covered).collect();
    facts.extend(common.iter().cloned());
    facts.extend(comparison.notes.iter().map(|note| ("note", note.into())));
    let about = "A dot is the largest difference of a field; the dashed lines are the tolerances. Norms are relative to the larger one of the two.";
    report.blocks = vec![
        Block::Terminal(vec![Block::facts(facts), fields_table(comparison).into()]),
        Block::Page(vec![
            Block::heading(2, "One row per field"),
            Block::text(about),
            Block::Html(Box::new(move || Ok(html::by_field(comparison)))),
        ]),
    ];
    if !common.is_empty() {
        report.blocks.push(Block::Page(vec![Block::facts(common)]));
    }
    let name = format!("{} – {}", comparison.a, comparison.b);
    report
        .suites
        .push(Suite::new(&name, cases(&name, comparison)));
    report.inputs = [&comparison.a, &comparison.b].map(Into::into).into();
    if has_differences {
        report.files.push(Box::new(move |folder| {
            write_differences(&folder.join("differences.vtu"), a, comparison)
        }));
    }
    Ok(report)
}

/// What has values tells more than what is missing, a function more than what is derived from it on cells, and of these the
/// one that is farthest beyond its tolerance.
fn telling(f: &ComparedField, g: &ComparedField) -> Ordering {
    let key = |of: &ComparedField| {
        (
            of.field.worst.is_some(),
            matches!(of.on, On::Points | On::Corners | On::Functions),
        )
    };
    key(f).cmp(&key(g)).then(f.factor().total_cmp(&g.factor()))
}

/// Which fields differ, and where.
fn claim(comparison: &Comparison, wrong: &[&ComparedField], word: &str) -> Text {
    let mut wrong = wrong.to_vec();
    wrong.sort_by_key(|f| f.field.verdict == Verdict::Undetermined);
    let names: Vec<&str> = wrong.iter().map(|f| &*f.field.field).collect();
    let all = comparison.fields.len();
    let is_known = |f: &&ComparedField| f.field.verdict != Verdict::Undetermined;
    if names.len() > 1 && !wrong.iter().any(is_known) {
        let (first, rest) = (names.iter().take(2), names.len().saturating_sub(2));
        let first = first.copied().collect::<Vec<_>>().join(", ");
        return match rest {
            0 => text!("**{}** cannot be judged", first),
            rest => text!(
                "**{}** and {} more of {} fields cannot be judged",
                first,
                rest,
                all
            ),
        };
    }
    match (&names[..], wrong.first()) {
        ([], _) => {
            let fields = if all == 1 {
                "one field".into()
            } else {
                text!("all {} fields", all)
            };
            text!(
                "{} and {} **{}** in {}",
                name(&comparison.a),
                name(&comparison.b),
                word,
                fields
            )
        }
        ([one], of) => match of.map(|of| (&of.field, &of.field.worst)) {
            Some((field, _)) if field.verdict == Verdict::Undetermined => {
                text!("**{}** cannot be judged", one)
            }
            Some((field, Some(worst))) if field.max_abs != 0.0 && !worst.midpoint.is_empty() => {
                text!("**{}** differs, most at {}", one, place(&worst.midpoint))
            }
            _ => text!("**{}** differs", one),
        },
        ([one, two], _) => text!("**{} and {}** differ", one, two),
        ([one, two, rest @ ..], _) => text!(
            "**{}, {}** and {} more of {} fields differ",
            one,
            two,
            rest.len(),
            all
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
) -> Text {
    let mut told: Vec<Text> = Vec::new();
    if let Some(ComparedField { field, .. }) = farthest {
        told.push(match &field.reason {
            Some(reason) => text!("`{}`: {}.", &field.field, reason),
            None => {
                let values = field.worst.as_ref().map_or(Text::default(), |w| {
                    text!(" There a has {} and b {}.", number(w.a, 6), number(w.b, 6))
                });
                let times = field.max_rel / field.tolerance;
                let times = match times.is_finite() {
                    true => text!(", {} times the tolerance", number(times, 2)),
                    false => Text::default(),
                };
                text!("`{}` differs by **{} of its largest value**{}, and beyond it in {} of {} values.{}", &field.field, size(field.max_rel), times, whole(field.beyond), whole(field.faces), values)
            }
        });
        let others = comparison.fields.len() - wrong.len();
        if others > 0 {
            told.push(match others {
                1 => "The other field agrees.".into(),
                _ => text!("The other {} fields agree.", others),
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
            largest => text!("The largest difference is **{}** of the largest value of its field. No value is missing, none is not a number.", size(largest)),
        });
    }
    if comparison.identical {
        told.push("The files have identical bytes.".into());
    }
    told.extend(
        comparison
            .notes
            .iter()
            .map(|note| Text::message(&sentence(note))),
    );
    Text::joined(told, " ")
}

/// What to do about fields that differ.
fn next(comparison: &Comparison, farthest: &ComparedField, has_differences: bool) -> Vec<Todo> {
    let mut steps = Vec::new();
    if has_differences {
        steps.push(Todo::only(text!(
            "Look at it in ParaView: `differences.vtu` beside this page has a − b of every field."
        )));
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

/// One test case a field.
fn cases(name: &str, comparison: &Comparison) -> Vec<TestCase> {
    let case = |compared: &ComparedField| {
        let field = &compared.field;
        let of = format!("{} on {:?}", field.field, compared.on).to_lowercase();
        TestCase {
            title: Some(format!("{name}: {}", field.field)),
            ..TestCase::new(name, of, field.verdict, why(field))
        }
    };
    comparison.fields.iter().map(case).collect()
}

/// The report of comparisons of several times or files.
///
/// # Errors
/// None but of a broken installation.
pub fn compare_many(all: &Comparisons) -> Result<Report<'_>> {
    let question = "faceoff compare: do two results agree, time by time or file by file?";
    let verdict = word(all.verdict);
    let mut report = Report::new("compare", question, verdict, all)?;
    report.verdict = Some((all.verdict, verdict));
    report.claim = claim_of_many(all, verdict);
    report.lede = match all.worst() {
        Some((part, of)) if !part.verdict.passes() && of.field.reason.is_none() => text!(
            "Farthest from agreement is **{}**: `{}` differs by {} of its largest value, {} times the tolerance.",
            part.title(),
            &of.field.field,
            size(of.field.max_rel),
            number(of.factor(), 2)
        ),
        _ => Text::default(),
    };
    report
        .lead
        .push(Block::Html(Box::new(move || Ok(html::steps(all)))));
    let mut facts = vec![("a", Text::from(&all.a)), ("b", Text::from(&all.b))];
    facts.extend(all.worst().map(|(part, of)| {
        let name = &of.field.field;
        (
            "worst",
            text!("{}, `{}`: {}", part.title(), name, why(&of.field)),
        )
    }));
    facts.extend(all.notes.iter().map(|note| ("note", note.into())));
    report
        .blocks
        .push(Block::Terminal(vec![Block::facts(facts)]));
    report.blocks.push(parts_table(all).into());
    report.notes = all
        .notes
        .iter()
        .map(|note| Text::message(&sentence(note)))
        .collect();
    if let Some((part, comparison, of_a)) = farthest(all) {
        let shown = comparison.fields.iter().max_by(|f, g| telling(f, g));
        report.blocks.push(Block::Page(vec![
            Block::heading(2, format!("Farthest from agreement: {}", part.title())),
            Block::Html(Box::new(move || {
                let compared = shown.and_then(|of| html::Compared::new(comparison, of_a, of));
                Ok(compared.map_or_else(html::Html::default, |compared| {
                    html::beside([("c9", compared.figures())])
                }))
            })),
        ]));
        if !of_a.points.is_empty() && !comparison.differences.is_empty() {
            report.files.push(Box::new(move |folder| {
                write_differences(&folder.join("differences.vtu"), of_a, comparison)
            }));
        }
    }
    for part in all.parts.iter().filter(|part| !part.verdict.passes()) {
        if let Some(comparison) = &part.comparison {
            report.blocks.push(Block::heading(2, part.title()));
            report.blocks.push(fields_table(comparison).into());
        }
    }
    let suites = all.parts.iter().map(|part| {
        let title = part.title();
        let cases = match &part.comparison {
            Some(comparison) => cases(&title, comparison),
            None => {
                let reason = part.reason.clone().unwrap_or_default();
                vec![TestCase::new(&title, "comparison", part.verdict, reason)]
            }
        };
        Suite::new(title, cases)
    });
    report.suites.extend(suites);
    report.inputs = [&all.a, &all.b].map(Into::into).into();
    Ok(report)
}

/// How many parts do not agree, and in what.
fn claim_of_many(all: &Comparisons, word: &str) -> Text {
    let in_time = all.parts.iter().all(|part| part.name.is_empty());
    let count = |n: usize| match in_time {
        true => count(n, "time"),
        false => count(n, "part"),
    };
    let failed: Vec<&Part> = all.parts.iter().filter(|p| !p.verdict.passes()).collect();
    if failed.is_empty() {
        return text!(
            "{} and {} **{}** in all {}",
            name(&all.a),
            name(&all.b),
            word,
            count(all.parts.len())
        );
    }
    let fields = failed.iter().flat_map(|part| {
        let fields = part.comparison.iter().flat_map(|of| &of.fields);
        fields
            .filter(|f| !f.field.verdict.passes())
            .map(|f| &*f.field.field)
    });
    let names = unique(fields);
    let what = match names[..] {
        [] => {
            let of = count(all.parts.len());
            return text!("**{} of {}** could not be compared", failed.len(), of);
        }
        [one] => text!("**{}** differs", one),
        [one, two] => text!("**{} and {}** differ", one, two),
        [one, two, ..] => text!(
            "**{}, {}** and {} more fields differ",
            one,
            two,
            names.len() - 2
        ),
    };
    text!("{} in {} of {}", what, failed.len(), count(all.parts.len()))
}

/// The part that is farthest from agreement, with the first of its results; none where all are equal.
fn farthest(all: &Comparisons) -> Option<(&Part, &Comparison, &Results)> {
    let (k, of_a) = all.farthest.as_ref()?;
    let part = all.parts.get(*k)?;
    let comparison = part.comparison.as_ref()?;
    let differs = comparison.fields.iter().any(|f| f.field.max_abs != 0.0);
    differs.then_some((part, comparison, of_a))
}

/// One line a part: its field that is farthest beyond its tolerance.
fn parts_table(all: &Comparisons) -> Table {
    let farthest = |part: &Part| {
        let fields = part.comparison.as_ref()?.fields.iter();
        fields
            .max_by(|f, g| f.factor().total_cmp(&g.factor()))
            .map(|f| f.field.clone())
    };
    let remark = |part: &Part| match &part.comparison {
        Some(of) if of.identical => Some("identical bytes".to_owned()),
        Some(of) => of.fields.iter().find_map(|f| f.field.reason.clone()),
        None => part.reason.clone(),
    };
    table!("", &all.parts, |of|
        "part" => of.title(),
        "fields" => of.comparison.as_ref().map_or(0, |of| of.fields.len()),
        "worst field" => farthest(of).map(|f| f.field),
        "max |a-b|" => farthest(of).map(|f| f.max_abs),
        "relative" => farthest(of).map(|f| f.max_rel),
        "where" => farthest(of).and_then(|f| worst(&f)),
        "verdict" => of.verdict,
        "remark" => remark(of),
    )
}

/// What the meshes have in common, and what not.
fn covered(found: &Intersection) -> Vec<(&'static str, Text)> {
    let of = |k: usize| {
        let part = found.alone[k] / found.measures[k];
        let curved = match found.curved[k] {
            0 => Text::default(),
            many => text!(", {} taken as straight pieces", count(many, "curved cell")),
        };
        let cells = count(found.cells[k], "cell");
        text!(
            "{}, measure {}; {} of it alone{}",
            cells,
            size(found.measures[k]),
            Number::new(part, 4),
            curved
        )
    };
    let exact = match found.exact {
        true => "integrals are exact but for rounding",
        false => "by a rule of higher degree, since not all cells are straight",
    };
    vec![
        ("mesh of a", of(0)),
        ("mesh of b", of(1)),
        ("in common", text!("{}: {}", size(found.common), exact)),
    ]
}

/// One line a field.
fn fields_table(comparison: &Comparison) -> Table {
    let on = |of: &ComparedField| format!("{:?}", of.on).to_lowercase();
    let remark = |of: &ComparedField| {
        let carriers = match of.on {
            On::Functions | On::Domain => "cells".to_owned(),
            _ => on(of),
        };
        let what = rests_on(&of.field, &carriers);
        let single = of.single.then(|| "f32: 6e-8 is its rounding".to_owned());
        let identical = comparison.identical.then(|| "identical bytes".to_owned());
        let remarks: Vec<String> = [what, single, identical].into_iter().flatten().collect();
        (!remarks.is_empty()).then(|| remarks.join("; "))
    };
    let norm = |of: &ComparedField, pick: fn(&Norms) -> Option<(f64, f64)>| {
        let (norm, scale) = of.norms.as_ref().and_then(pick)?;
        Some(format!("{} of {}", size(norm), size(scale)))
    };
    table!("", &comparison.fields, |of|
        "field" => &of.field.field,
        "on" => on(of),
        "max |a-b|" => of.field.max_abs,
        "relative" => of.field.max_rel,
        "L2" => norm(of, |n| Some((n.l2, n.l2_scale))),
        "H1" => norm(of, |n| n.h1.zip(n.h1_scale)),
        "scale" => of.scale,
        "rtol" => Cell::size(of.rtol),
        "atol" => Cell::size(of.atol),
        "worst" => worst(&of.field),
        "verdict" => of.field.verdict,
        "remark" => remark(of),
    )
}
