//! Compares one set of matched fields: those on points, on cells, at corners, or on the files as a whole.

use std::borrow::Cow;
use std::collections::HashMap;

use super::align::{Nearness, align_by};
use super::column::{By, NOWHERE, judge_column, rows_of};
use super::comparison::{ComparedField, Comparison, Differences, On, Settings};
use super::keyed::{Keyed, same_length};
use super::parts::Parts;
use super::view::Column;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::{ResultField, Results, Unread};

/// Judges the fields of one set, with their differences. If only `b` has coordinates, they are used for `a` too.
pub(super) fn judge_sets(
    on: On,
    [mut a, b]: [Keyed; 2],
    near: f64,
    parts: &Parts,
    settings: &Settings,
) -> Result<(Vec<ComparedField>, Differences)> {
    let noun = match (on, a.fields.space) {
        (On::Points, 0 | 1) => "row",
        _ => on.noun(),
    };
    let near = move |_| near;
    let partner = align_by(&a.fields, &b.fields, &Nearness { noun, near: &near })?;
    if a.fields.midpoints.is_empty() && !b.fields.midpoints.is_empty() {
        let place = |other: &u32| b.fields.midpoints[*other as usize];
        a.fields.midpoints = partner.iter().map(place).collect();
        a.fields.space = b.fields.space;
    }
    let faces = 0..a.fields.count();
    let part = |face: usize| cancel::check().map(|()| parts.of(a.fields.face(face)));
    let of_a = faces.map(part).collect::<Result<Vec<u32>>>()?;
    let mut of_b = vec![0; of_a.len()];
    for (&other, &part) in partner.iter().zip(&of_a) {
        of_b[other as usize] = part;
    }
    let on = if a.corner_points.is_some() {
        On::Corners
    } else {
        on
    };
    let mut differences = Differences {
        on,
        places: Vec::new(),
        fields: Vec::new(),
    };
    let mut judged = Vec::new();
    for (name, sides) in by_name(a.carried, b.carried, |f| &f.name) {
        let (&[field_a], &[field_b]) = (&sides[0][..], &sides[1][..]) else {
            let reason = if sides.iter().any(|fields| fields.len() > 1) {
                "a file has it more than once".to_owned()
            } else {
                let without = if sides[0].is_empty() { &a } else { &b };
                lacks(name, without.fields.source)
            };
            judged.push(ComparedField::unjudged(
                on,
                name,
                &settings.tolerances,
                reason,
            ));
            continue;
        };
        let tolerance = settings.tolerances.of_fields(field_a, field_b);
        let (mut column_a, mut column_b) = (a.column(field_a)?, b.column(field_b)?);
        if a.fields.space == 2 && b.fields.space == 2 {
            same_length(&mut column_a, &mut column_b);
        }
        let mut scales = vec![0.0; parts.count + 1];
        for (side, field, column, part) in [
            (&a, field_a, &column_a, &of_a),
            (&b, field_b, &column_b, &of_b),
        ] {
            let scaling = side.scaling(field)?;
            add_scales(&mut scales, scaling.as_ref().unwrap_or(column), part)?;
        }
        let by = By {
            noun,
            tolerance: tolerance.of_scale(0.0).0,
            nan_equal: settings.nan_equal(name),
            has_components: true,
        };
        let unit = |k: usize| {
            let part = of_a[column_a.faces[k] as usize];
            tolerance.of_scale(scales[part as usize]).1
        };
        let verdict = judge_column(&a.fields, &column_a, &column_b, &partner, unit, &by)?;
        if let Some(values) = subtract(&column_a, &column_b, &partner)? {
            let components = column_a.components;
            let difference = (name.to_owned(), components, values);
            differences.fields.push(difference);
        }
        judged.push(ComparedField {
            on,
            scale: Some(scales.into_iter().fold(0.0, f64::max)),
            rtol: tolerance.rtol,
            atol: tolerance.atol,
            norms: None,
            single: field_a.single || field_b.single,
            removed: Vec::new(),
            equal_after: Vec::new(),
            field: verdict,
        });
    }
    if let Cow::Owned(places) = a.fields.midpoints {
        differences.places = places;
    }
    Ok((judged, differences))
}

/// Names of arrays in which programs keep data about the mesh, in addition to results.
const BOOKKEEPING: [&str; 14] = [
    "Label",
    "label",
    "labels",
    "ref",
    "gmsh:physical",
    "gmsh:geometrical",
    "medit:ref",
    "GlobalNodeId",
    "GlobalElementId",
    "GlobalPointIds",
    "GlobalCellIds",
    "ObjectId",
    "ProcessId",
    "partition",
];

/// Why a field that only one file has cannot be judged.
pub(super) fn lacks(name: &str, without: &str) -> String {
    let hint = match BOOKKEEPING.contains(&name) {
        true => format!(
            "; it is data about the mesh rather than a result: select the results with --only, or leave it out with --except {name}"
        ),
        false => String::new(),
    };
    format!("{without} does not have it{hint}")
}

/// The largest finite |value| of a column on each part; `part` is that of each face.
fn add_scales(scales: &mut [f64], column: &Column, part: &[u32]) -> Result<()> {
    for (k, &face) in column.faces.iter().enumerate() {
        cancel::check()?;
        let scale = &mut scales[part[face as usize] as usize];
        let finite = column.row(k).iter().filter(|v| v.is_finite());
        *scale = finite.fold(*scale, |m, v| m.max(v.abs()));
    }
    Ok(())
}

/// a - b for everything in the first file.
fn subtract(a: &Column, b: &Column, partner: &[u32]) -> Result<Option<Vec<f64>>> {
    if a.components != b.components {
        return Ok(None);
    }
    let rows = rows_of(b, partner.len())?;
    let mut values = vec![f64::NAN; partner.len() * a.components];
    for (k, &face) in a.faces.iter().enumerate() {
        cancel::check()?;
        let row = rows[partner[face as usize] as usize];
        if row != NOWHERE {
            let start = face as usize * a.components;
            let pairs = a.row(k).iter().zip(b.row(row as usize));
            for (c, (value, (x, y))) in values[start..].iter_mut().zip(pairs).enumerate() {
                *value = x - y + (a.rest(k, c) - b.rest(row as usize, c));
            }
        }
    }
    Ok(Some(values))
}

/// Compares numbers on the files as a whole that both have, and notes those that only one has: a file need not state a time.
pub(super) fn judge_whole(
    a: &Results,
    b: &Results,
    settings: &Settings,
    comparison: &mut Comparison,
) -> Result<()> {
    let mut only = [Vec::new(), Vec::new()];
    for (name, sides) in by_name(&a.whole, &b.whole, |f| &f.name) {
        match (&sides[0][..], &sides[1][..]) {
            (&[of_a], &[of_b]) if of_a.is_empty() && of_b.is_empty() => {}
            (&[of_a], &[of_b]) if of_a.len() == of_b.len() => {
                let sides = [Keyed::of_whole(a, of_a), Keyed::of_whole(b, of_b)];
                let parts = Parts::default();
                let (fields, _) = judge_sets(On::Whole, sides, 0.0, &parts, settings)?;
                comparison.fields.extend(fields);
            }
            ([], _) => only[1].push(format!("`{name}`")),
            (_, []) => only[0].push(format!("`{name}`")),
            (of_a, of_b) => {
                let count = |arrays: &[&ResultField]| arrays.iter().map(|f| f.len()).sum::<usize>();
                let (count_a, count_b) = (count(of_a), count(of_b));
                let reason = format!("one side has {count_a} entries, the other {count_b}");
                let unjudged =
                    ComparedField::unjudged(On::Whole, name, &settings.tolerances, reason);
                comparison.fields.push(unjudged);
            }
        }
    }
    for (names, side) in only.iter().zip([a, b]) {
        if !names.is_empty() {
            let names = names.join(", ");
            let note = format!(
                "only {} has, about the file as a whole, {names}",
                side.source
            );
            comparison.notes.push(note);
        }
    }
    Ok(())
}

/// A row for everything in a file that its reader did not read and that is therefore unknown.
pub(super) fn judge_unread(
    a: &Results,
    b: &Results,
    settings: &Settings,
    comparison: &mut Comparison,
) {
    let of = |side: &Results, part: &Unread| (side.source.clone(), part.clone());
    let mut parts: Vec<(String, Unread)> = a.unread.iter().map(|part| of(a, part)).collect();
    for part in &b.unread {
        match parts.iter_mut().find(|(_, known)| known == part) {
            Some((sources, _)) => *sources = format!("{sources} and {}", b.source),
            None => parts.push(of(b, part)),
        }
    }
    for (sources, part) in parts {
        let Unread { name, what, .. } = &part;
        if settings.identical && !part.is_outside {
            comparison
                .fields
                .push(ComparedField::same_bytes(name, what));
            continue;
        }
        let reason = format!(
            "not read in {sources}: {what}; if it does not matter, leave it out by --except {name:?}"
        );
        let tolerances = &settings.tolerances;
        let row = ComparedField::unjudged(On::Unread, name, tolerances, reason);
        comparison.fields.push(row);
    }
}

/// Every name, in order of appearance, with the fields on either side that have it.
pub(super) fn by_name<'a, F>(
    a: impl IntoIterator<Item = F>,
    b: impl IntoIterator<Item = F>,
    name: impl Fn(&F) -> &'a str,
) -> Vec<(&'a str, [Vec<F>; 2])> {
    let mut known = HashMap::new();
    let mut names = Vec::new();
    let sides: [Vec<F>; 2] = [a.into_iter().collect(), b.into_iter().collect()];
    for (side, fields) in sides.into_iter().enumerate() {
        for field in fields {
            let name = name(&field);
            let k = *known.entry(name).or_insert(names.len());
            if k == names.len() {
                names.push((name, [Vec::new(), Vec::new()]));
            }
            names[k].1[side].push(field);
        }
    }
    names
}
