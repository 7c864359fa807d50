//! The report of `compare`.

use std::cmp::Ordering;

use super::described::{open, rests_on, why, worst};
use super::difference::write_differences;
use super::html::{self, Dot, DotAxis};
use super::model::{
    Block, Cell, Column, Report, Story, Suite, Table, TestCase, Todo, Write, count, joined,
    sentence, table,
};
use crate::engine::unique;
use crate::text::number::{number, place, size, whole};
use crate::text::{Number, Text, text};
use faceoff_judge::{
    ComparedField, Comparison, Comparisons, FieldVerdict, Intersection, MatchBy, On, Part, Verdict,
};
use faceoff_mesh::error::Result;
use faceoff_mesh::field::Results;

/// The report of a comparison; `a` is the first side, whose mesh carries the differences.
///
/// # Errors
/// Only those of a broken installation.
pub fn compare<'a>(comparison: &'a Comparison, a: &'a Results) -> Result<Report<'a>> {
    let question = "faceoff compare: do two results agree, field by field?";
    let verdict = comparison.verdict;
    let mut report = Report::judging("compare", question, verdict, comparison)?;
    let wrong = comparison.fields.iter();
    let wrong: Vec<&ComparedField> = wrong.filter(|f| !f.field.verdict.passes()).collect();
    let farthest = wrong.iter().copied().max_by(|f, g| telling(f, g));
    // A table of keys has no positions, and two meshes have no common points.
    let has_differences = !a.points.is_empty() && !comparison.differences.is_empty();
    let shown = farthest.or_else(|| comparison.fields.iter().max_by(|f, g| telling(f, g)));
    let map = match comparison.map {
        MatchBy::Vertices => "vertices",
        MatchBy::Coordinates => "coordinates",
        MatchBy::Functions => "nothing: as functions on the intersection of the meshes",
    };
    let mut facts = sides(&comparison.a, &comparison.b);
    facts.push(("matched by", map.into()));
    let common: Vec<_> = comparison.intersection.iter().flat_map(covered).collect();
    facts.extend(common.iter().cloned());
    facts.extend(comparison.notes.iter().map(|note| ("note", note.into())));
    let about = "A dot is the largest difference of a field; the dashed lines are the tolerances. Norms are of the difference, and of the larger one of the two.";
    let mut page = vec![
        Block::heading(2, "One row per field"),
        Block::text(about),
        fields_table(comparison).into(),
    ];
    page.extend((!common.is_empty()).then(|| Block::facts(common)));
    report.story = Story {
        claim: claim(comparison, &wrong, verdict.word()),
        rests_on: lede(comparison, &wrong, farthest),
        picture: Vec::from_iter(shown.map(|of| compared(comparison, a, of))),
        next: farthest.map_or(Vec::new(), |of| next(comparison, of, has_differences)),
        rest: vec![
            Block::Terminal(vec![Block::facts(facts), fields_table(comparison).into()]),
            Block::Page(page),
        ],
    };
    report.notes = vec![text!(
        "Agrees where |a − b| ≤ atol + rtol × the largest value of the field; matched by {map}. a is `{comparison.a}`, b is `{comparison.b}`."
    )];
    let name = format!("{} – {}", comparison.a, comparison.b);
    report.suites = vec![Suite::new(&name, cases(&name, comparison))];
    report.inputs = [&comparison.a, &comparison.b].map(Into::into).into();
    if has_differences {
        report.files.push(differences(comparison, a));
    }
    Ok(report)
}

/// A field of both results, as a picture.
pub(super) fn compared<'a>(
    comparison: &'a Comparison,
    a: &'a Results,
    of: &'a ComparedField,
) -> Block<'a> {
    Block::drawn(move || {
        let compared = html::Compared::new(comparison, a, of);
        compared.map_or_else(html::Html::default, |compared| compared.figures())
    })
}

fn differences<'a>(comparison: &'a Comparison, a: &'a Results) -> Write<'a> {
    Box::new(move |folder| write_differences(&folder.join("differences.vtu"), a, comparison))
}

fn sides(a: &str, b: &str) -> Vec<(&'static str, Text)> {
    vec![("a", a.into()), ("b", b.into())]
}

/// The order of importance: fields with values before missing ones, functions before quantities derived from them on cells, and among these
/// the one with the largest difference relative to its tolerance.
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
    let (known, unknown): (Vec<&ComparedField>, Vec<&ComparedField>) = wrong
        .iter()
        .partition(|f| f.field.verdict != Verdict::Undetermined);
    let names = known.iter().chain(&unknown).map(|f| &*f.field.field);
    let names: Vec<&str> = names.collect();
    let all = comparison.fields.len();
    match (&names[..], &known[..]) {
        ([], _) => {
            let fields = match all {
                1 => "one field".into(),
                _ => text!("all {all} fields"),
            };
            let [a, b] = [&comparison.a, &comparison.b].map(|path| name(path));
            text!("{a} and {b} **{word}** in {fields}")
        }
        ([one], []) => text!("**{one}** cannot be judged"),
        ([one, two], []) => text!("**{one}, {two}** cannot be judged"),
        ([one, two, rest @ ..], []) => text!(
            "**{one}, {two}** and {} more of {all} fields cannot be judged",
            rest.len()
        ),
        ([one], [of, ..]) => {
            let worst = of.field.worst.as_ref().filter(|_| of.field.max_abs != 0.0);
            let at = worst
                .map(|worst| &worst.midpoint)
                .filter(|at| !at.is_empty());
            let at = at.map(|at| text!(", most at {}", place(at)));
            text!("**{one}** differs{at}")
        }
        _ => text!("{} differ", several(&names, Some(all))),
    }
}

/// The first of several names, and the number of others.
fn several(names: &[&str], all: Option<usize>) -> Text {
    let of = all.map(|all| text!(" of {all}"));
    match names {
        [one, two] => text!("**{one} and {two}**"),
        [one, two, rest @ ..] => {
            text!("**{one}, {two}** and {} more{of} fields", rest.len())
        }
        _ => names.concat().into(),
    }
}

fn name(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

/// The size of the differences, and what was left out.
fn lede(
    comparison: &Comparison,
    wrong: &[&ComparedField],
    farthest: Option<&ComparedField>,
) -> Text {
    let mut told: Vec<Text> = Vec::new();
    if let Some(ComparedField { field, .. }) = farthest {
        told.push(match &field.reason {
            Some(reason) => text!("`{field.field}`: {reason}."),
            None => {
                let values = field.worst.as_ref().map_or(Text::default(), |w| {
                    text!(" There a has {} and b {}.", number(w.a, 6), number(w.b, 6))
                });
                let times = Some(field.max_rel / field.tolerance).filter(|t| t.is_finite());
                let times = times.map(|t| text!(", {} times the tolerance", number(t, 2)));
                text!("`{field.field}` differs by **{} of its largest value**{times}, and beyond it in {} of {} values.{values}", size(field.max_rel), whole(field.beyond), whole(field.faces))
            }
        });
        let opens = wrong
            .iter()
            .filter_map(|of| Some((of, open(of, ["a", "b"])?)));
        told.extend(opens.map(|(of, words)| text!("`{of.field.field}`: {words}.")));
        let others = comparison.fields.len() - wrong.len();
        if others > 0 {
            told.push(match others {
                1 => "The other field agrees.".into(),
                _ => text!("The other {others} fields agree."),
            });
        }
    } else {
        let sizes = comparison.fields.iter().map(|f| f.field.max_rel);
        let largest = sizes.fold(0.0, f64::max);
        told.push(match largest {
            0.0 => "All values are the same, to the last bit.".into(),
            largest => text!("The largest difference is **{}** of the largest value of its field. No value is missing, none is not a number.", size(largest)),
        });
    }
    if comparison.identical {
        told.push("The files have identical bytes.".into());
    }
    let notes = comparison.notes.iter();
    told.extend(notes.map(|note| Text::message(&sentence(note))));
    Text::joined(told, " ")
}

/// Suggestions for fields that differ.
fn next(comparison: &Comparison, farthest: &ComparedField, has_differences: bool) -> Vec<Todo> {
    let (a, b, field) = (&comparison.a, &comparison.b, &farthest.field);
    let look = text!(
        "Look at it in ParaView: `differences.vtu` next to this page has a − b of every field."
    );
    let ask = "If both solve a scene that faceoff knows, ask which of the two is wrong, and why:";
    let allow = (field.reason.is_none() && field.max_rel.is_finite()).then(|| {
        let rtol = 10f64.powf(field.max_rel.log10().ceil());
        let words = format!(
            "If a difference of {} is as it should be:",
            size(field.max_rel)
        );
        Todo::new(
            words,
            [format!("faceoff compare {a} {b} --rtol {rtol:.0e}")],
        )
    });
    let mut steps = Vec::from_iter(has_differences.then(|| Todo::only(look)));
    steps.push(Todo::new(ask, [format!("faceoff judge {b} --scene SCENE")]));
    steps.extend(allow);
    steps
}

/// One test case per field.
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
/// Only those of a broken installation.
pub fn compare_many(all: &Comparisons) -> Result<Report<'_>> {
    let question = "faceoff compare: do two results agree, time by time or file by file?";
    let mut report = Report::judging("compare", question, all.verdict, all)?;
    let farthest_of = all
        .worst()
        .filter(|(part, of)| !part.verdict.passes() && of.field.reason.is_none());
    let rests_on = farthest_of.map(|(part, of)| {
        text!("Farthest from agreement is **{}**: `{of.field.field}` differs by {} of its largest value, {} times the tolerance.", part.title(), size(of.field.max_rel), number(of.factor(), 2))
    });
    let mut facts = sides(&all.a, &all.b);
    facts.extend(all.worst().map(|(part, of)| {
        let name = &of.field.field;
        let told = text!("{}, `{name}`: {}", part.title(), why(&of.field));
        ("worst", told)
    }));
    facts.extend(all.notes.iter().map(|note| ("note", note.into())));
    let mut rest = vec![
        Block::Terminal(vec![Block::facts(facts)]),
        parts_table(all).into(),
    ];
    if let Some((part, comparison, of_a)) = farthest(all) {
        let shown = comparison.fields.iter().max_by(|f, g| telling(f, g));
        let heading = format!("Farthest from agreement: {}", part.title());
        let drawn = shown.map(|of| compared(comparison, of_a, of));
        rest.push(Block::Page(vec![
            Block::heading(2, heading),
            Block::Beside(vec![("c9", Vec::from_iter(drawn))]),
        ]));
        if !of_a.points.is_empty() && !comparison.differences.is_empty() {
            report.files.push(differences(comparison, of_a));
        }
    }
    for part in all.parts.iter().filter(|part| !part.verdict.passes()) {
        if let Some(comparison) = &part.comparison {
            rest.extend([
                Block::heading(2, part.title()),
                fields_table(comparison).into(),
            ]);
        }
    }
    report.story = Story {
        claim: claim_of_many(all, all.verdict.word()),
        rests_on: rests_on.unwrap_or_default(),
        picture: vec![Block::drawn(move || html::steps(all))],
        next: Vec::new(),
        rest,
    };
    let notes = all.notes.iter();
    report.notes = notes.map(|note| Text::message(&sentence(note))).collect();
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

/// The number of parts that do not agree, and their fields.
fn claim_of_many(all: &Comparisons, word: &str) -> Text {
    let in_time = all.parts.iter().all(|part| part.name.is_empty());
    let count = |n: usize| match in_time {
        true => count(n, "time"),
        false => count(n, "part"),
    };
    let failed: Vec<&Part> = all.parts.iter().filter(|p| !p.verdict.passes()).collect();
    if failed.is_empty() {
        let [a, b] = [&all.a, &all.b].map(|path| name(path));
        return text!("{a} and {b} **{word}** in all {}", count(all.parts.len()));
    }
    let fields = failed.iter().flat_map(|part| {
        let fields = part.comparison.iter().flat_map(|of| &of.fields);
        fields
            .filter(|f| !f.field.verdict.passes())
            .map(|f| &*f.field.field)
    });
    let of = count(all.parts.len());
    match &unique(fields)[..] {
        [] => text!("**{} of {of}** could not be compared", failed.len()),
        [one] => text!("**{one}** differs in {} of {of}", failed.len()),
        names => text!(
            "{} differ in {} of {of}",
            several(names, None),
            failed.len()
        ),
    }
}

/// The part that is farthest from agreement, with the first of its results; `None` if all are equal.
fn farthest(all: &Comparisons) -> Option<(&Part, &Comparison, &Results)> {
    let (k, of_a) = all.farthest.as_ref()?;
    let part = all.parts.get(*k)?;
    let comparison = part.comparison.as_ref()?;
    let differs = comparison.fields.iter().any(|f| f.field.max_abs != 0.0);
    differs.then_some((part, comparison, of_a))
}

/// One line per part: its field with the largest difference relative to the tolerance.
fn parts_table(all: &Comparisons) -> Table {
    let farthest = |part: &Part| {
        let fields = part.comparison.as_ref()?.fields.iter();
        fields
            .max_by(|f, g| f.factor().total_cmp(&g.factor()))
            .map(|f| f.field.clone())
    };
    let remark = |part: &Part| match &part.comparison {
        Some(of) if of.identical => Some("identical bytes".to_owned()),
        Some(of) => {
            let reason = of.fields.iter().find_map(|f| f.field.reason.clone());
            reason.or_else(|| of.fields.iter().find_map(|f| open(f, ["a", "b"])))
        }
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

/// The overlap of the meshes, and what it leaves out.
fn covered(found: &Intersection) -> Vec<(&'static str, Text)> {
    let of = |k: usize| {
        let part = found.alone[k] / found.measures[k];
        let curved = match found.curved[k] {
            0 => Text::default(),
            many => text!(", {} taken as straight pieces", count(many, "curved cell")),
        };
        let cells = count(found.cells[k], "cell");
        text!(
            "{cells}, measure {}; {} of it alone{curved}",
            size(found.measures[k]),
            Number::new(part, 4)
        )
    };
    let exact = match (found.exact, found.quadrature) {
        (true, _) => text!("integrals are exact but for rounding"),
        (_, None) => text!("by a rule of higher degree, since not all functions are polynomials"),
        (_, Some(change)) => text!(
            "by a rule of higher degree, since not all functions are polynomials; norms change by at most {} of the larger field's with a rule of two degrees less and with parts too thin to count",
            Number::at_most(change, 2)
        ),
    };
    let surfaces = match found.distance {
        Some(distance) => text!(
            "; the surfaces are up to {} apart, and b is projected on the cells of a",
            Number::at_most(distance, 2)
        ),
        None => Text::default(),
    };
    vec![
        ("mesh of a", of(0)),
        ("mesh of b", of(1)),
        (
            "in common",
            text!("{}: {exact}{surfaces}", size(found.common)),
        ),
    ]
}

/// The difference in L² and in H¹, with the norms it refers to.
pub(super) fn norms(of: &ComparedField) -> [Option<String>; 2] {
    let l2 = of.norms.map(|n| (n.l2, n.l2_scale));
    let h1 = of.norms.and_then(|n| n.h1.zip(n.h1_scale));
    [l2, h1].map(|of| of.map(|(norm, scale)| format!("{} of {}", size(norm), size(scale))))
}

/// One row per field.
fn fields_table(comparison: &Comparison) -> Table {
    let fields = &comparison.fields;
    let tolerances = fields.iter().map(|f| f.field.tolerance);
    let mut tolerances: Vec<f64> = tolerances.filter(|t| *t > 0.0).collect();
    tolerances.sort_by(f64::total_cmp);
    tolerances.dedup();
    let axis = DotAxis::new(fields.iter().map(|f| f.field.max_rel), tolerances);
    let dots = |f: &FieldVerdict| {
        let is_bad = !f.verdict.passes();
        let dot = Dot {
            value: f.max_rel,
            class: if is_bad { "bd" } else { "" },
            title: f.field.clone(),
        };
        let is_unknown = f.worst.is_none() && is_bad;
        Cell::dots(
            &axis,
            if is_unknown {
                &[]
            } else {
                std::slice::from_ref(&dot)
            },
            f.max_rel,
        )
    };
    let on = |of: &ComparedField| format!("{:?}", of.on).to_lowercase();
    let remark = |of: &ComparedField| {
        let carriers = match of.on {
            On::Functions | On::Domain => "cells".to_owned(),
            _ => on(of),
        };
        let what = rests_on(&of.field, &carriers);
        let single = of.single.then(|| "f32: 6e-8 is its rounding".to_owned());
        let identical = comparison.identical.then(|| "identical bytes".to_owned());
        let open = open(of, ["a", "b"]);
        joined([what, open, single, identical].into_iter().flatten(), "; ")
    };
    let all = table!("", fields, |of|
        ("w", "field") => &of.field.field,
        ("opt", "on") => on(of),
        ("n opt page", "values") => of.field.faces,
        Column::of_dots("largest |a − b|, relative", &axis) => dots(&of.field),
        ("n", "relative") => Cell::size(of.field.max_rel),
        ("n", "max |a − b|") => Cell::size(of.field.max_abs),
        ("n opt", "L²") => norms(of)[0].clone(),
        ("n opt", "H¹") => norms(of)[1].clone(),
        ("n opt", "scale") => of.scale,
        ("n opt", "rtol") => Cell::size(of.rtol),
        ("n opt", "atol") => Cell::size(of.atol),
        ("w opt", "worst") => worst(&of.field),
        ("", "verdict") => of.field.verdict,
        ("", "remark") => remark(of),
    );
    all.setting_off(fields.iter().map(|_| false)).known()
}
