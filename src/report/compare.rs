//! What `compare` found.

use super::difference::write_differences;
use super::model::{Block, Cell, Report, Suite, Table, TestCase, count, short, table, word};
use super::verify::{remark, why, worst};
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
    let fields = comparison.fields.iter().map(|f| &f.field);
    let failed = fields.filter(|f| f.verdict != Verdict::Agree).count();
    let mut lead = vec![format!(
        "{failed} of {} do not agree within their tolerances.",
        count(comparison.fields.len(), "field")
    )];
    let beyond = comparison.fields.iter();
    let beyond = beyond.filter(|f| f.field.verdict != Verdict::Agree);
    let farthest = beyond.max_by(|f, g| f.factor().total_cmp(&g.factor()));
    lead.extend(farthest.map(|of| {
        let field = &of.field;
        format!("Farthest beyond: `{}`: {}.", field.field, why(field))
    }));
    if comparison.identical {
        lead.push("The files have identical bytes.".into());
    }
    report.lead.push(Block::List(lead));
    let map = match comparison.map {
        MatchBy::Vertices => "vertices",
        MatchBy::Coordinates => "coordinates",
        MatchBy::Functions => "nothing: as functions on the intersection of the meshes",
    };
    let mut facts = vec![
        ("a", comparison.a.clone()),
        ("b", comparison.b.clone()),
        ("matched by", map.to_owned()),
    ];
    facts.extend(
        comparison
            .intersection
            .as_ref()
            .into_iter()
            .flat_map(covered),
    );
    facts.extend(comparison.notes.iter().map(|note| ("note", note.clone())));
    report.blocks.push(Block::facts(facts));
    report.blocks.push(fields_table(comparison).into());
    let name = format!("{} – {}", comparison.a, comparison.b);
    report
        .suites
        .push(Suite::new(&name, cases(&name, comparison)));
    report.inputs = [&comparison.a, &comparison.b].map(Into::into).into();
    // A table of keys has no places, and two meshes have none together.
    if !a.points.is_empty() && !comparison.differences.is_empty() {
        report.files.push(Box::new(move |folder| {
            write_differences(&folder.join("differences.vtu"), a, comparison)
        }));
    }
    Ok(report)
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
    let failed = all
        .parts
        .iter()
        .filter(|part| part.verdict != Verdict::Agree);
    let times = all.parts.iter().all(|part| part.name.is_empty());
    let lead = vec![format!(
        "{} of {} do not agree within their tolerances.",
        failed.count(),
        count(all.parts.len(), if times { "time" } else { "part" })
    )];
    report.lead.push(Block::List(lead));
    let mut facts = vec![("a", all.a.clone()), ("b", all.b.clone())];
    facts.extend(all.worst().map(|(part, of)| {
        let name = &of.field.field;
        (
            "worst",
            format!("{}, `{name}`: {}", part.title(), why(&of.field)),
        )
    }));
    facts.extend(all.notes.iter().map(|note| ("note", note.clone())));
    report.blocks.push(Block::facts(facts));
    report.blocks.push(parts_table(all).into());
    for part in all
        .parts
        .iter()
        .filter(|part| part.verdict != Verdict::Agree)
    {
        if let Some(comparison) = &part.comparison {
            report.blocks.push(Block::Heading(2, part.title()));
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
fn covered(found: &Intersection) -> Vec<(&'static str, String)> {
    let of = |k: usize| {
        let part = found.alone[k] / found.measures[k];
        let curved = match found.curved[k] {
            0 => String::new(),
            many => format!(", {} taken as straight pieces", count(many, "curved cell")),
        };
        let cells = count(found.cells[k], "cell");
        format!(
            "{cells}, measure {}; {part:.3e} of it alone{curved}",
            short(found.measures[k])
        )
    };
    let exact = match found.exact {
        true => "integrals are exact but for rounding",
        false => "by a rule of higher degree, since not all cells are straight",
    };
    vec![
        ("mesh of a", of(0)),
        ("mesh of b", of(1)),
        ("in common", format!("{}: {exact}", short(found.common))),
    ]
}

/// One line a field.
fn fields_table(comparison: &Comparison) -> Table {
    let on = |of: &ComparedField| format!("{:?}", of.on).to_lowercase();
    let given = |value: f64| match value {
        0.0 => Cell::from(0_usize),
        _ => Cell::Number(value, format!("{value:e}")),
    };
    let remark = |of: &ComparedField| {
        let carriers = match of.on {
            On::Functions | On::Domain => "cells".to_owned(),
            _ => on(of),
        };
        let remark = remark(&of.field, &carriers);
        let what = remark.split_once(": ").map(|(_, what)| what.to_owned());
        let single = of.single.then(|| "f32: 6e-8 is its rounding".to_owned());
        let identical = comparison.identical.then(|| "identical bytes".to_owned());
        let remarks: Vec<String> = [what, single, identical].into_iter().flatten().collect();
        (!remarks.is_empty()).then(|| remarks.join("; "))
    };
    let norm = |of: &ComparedField, pick: fn(&Norms) -> Option<(f64, f64)>| {
        let (norm, scale) = of.norms.as_ref().and_then(pick)?;
        Some(format!("{} of {}", short(norm), short(scale)))
    };
    table!("", &comparison.fields, |of|
        "field" => &of.field.field,
        "on" => on(of),
        "max |a-b|" => of.field.max_abs,
        "relative" => of.field.max_rel,
        "L2" => norm(of, |n| Some((n.l2, n.l2_scale))),
        "H1" => norm(of, |n| n.h1.zip(n.h1_scale)),
        "scale" => of.scale,
        "rtol" => given(of.rtol),
        "atol" => given(of.atol),
        "worst" => worst(&of.field),
        "verdict" => of.field.verdict,
        "remark" => remark(of),
    )
}
