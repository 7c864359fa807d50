//! Matches and judges the fields of two files from any codes, each with its scale.
//!
//! Matched by vertices, a point is identified by its number and a cell by the numbers of its points; matched by
//! coordinates, by their positions. Where several points share a position, as in discontinuous data, each is identified
//! as a corner of its cell.
//!
//! Relative tolerances refer to the largest value of a field on each connected part of the mesh.

use std::borrow::Cow;
use std::collections::BTreeSet;

use super::cells::other_cells;
use super::comparison::{ComparedField, Comparison, MatchBy, On, Settings, by_id};
use super::faces::{are_faces, crouzeix_raviart};
use super::groups::judge_groups;
use super::keyed::{Keyed, fields_on};
use super::parts::Parts;
use super::places;
use super::sets::{judge_sets, judge_unread, judge_whole};
use super::supermesh::{judge_functions, norms_on_mesh};
use super::up_to::{compare_up_to, look_for_open};
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{PADDING, Results};
use faceoff_mesh::io::matches;

/// Judges every field of two files.
///
/// ```
/// use faceoff_judge::{Tolerance, Tolerances, Verdict, compare_results};
/// use faceoff_mesh::io;
///
/// # fn main() -> faceoff_mesh::Result<()> {
/// let table = |name: &str, text: &str| io::read_results(name.as_ref(), text.as_bytes(), None);
/// let a = table("a.csv", "vertex,u\n0,1.0\n1,2.0\n")?;
/// let b = table("b.csv", "vertex,u\n0,1.0\n1,2.001\n")?;
/// let judged = |rtol| {
///     let of_all = Tolerance { rtol, atol: 0.0 };
///     let tolerances = Tolerances { of_all, ..Tolerances::default() };
///     compare_results(&a, &b, &tolerances.into()).map(|comparison| comparison.verdict)
/// };
/// assert_eq!(judged(1e-2)?, Verdict::Agree);
/// assert_eq!(judged(1e-6)?, Verdict::Disagree);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// Files that cannot be matched, meshes on which fields are not functions, a tolerance for a field that is in neither file, files
/// without fields.
pub fn compare_results(a: &Results, b: &Results, settings: &Settings) -> Result<Comparison> {
    let mut comparison = match settings.up_to.is_empty() {
        true => compare_unchanged(a, b, settings)?,
        false => compare_up_to([a, b], settings, &compare_unchanged)?,
    };
    look_for_open([a, b], settings, &mut comparison, &compare_unchanged)?;
    Ok(comparison)
}

/// Judges every field unchanged.
fn compare_unchanged(a: &Results, b: &Results, settings: &Settings) -> Result<Comparison> {
    let tolerances = &settings.tolerances;
    let refuse = |what: String, remedy: &str| Error::Compare {
        a: a.source.clone(),
        b: b.source.clone(),
        what,
        remedy: remedy.to_owned(),
    };
    for side in [a, b] {
        if side.is_empty() {
            let unread: Vec<&str> = side.unread.iter().map(|part| &*part.what).collect();
            let unread = match unread.is_empty() {
                true => String::new(),
                false => format!(", and this was not read: {}", unread.join("; ")),
            };
            let what = format!("{} has no field to compare{unread}", side.source);
            return Err(refuse(what, "write the fields into it"));
        }
    }
    let has = |name: &str| a.has(name) || b.has(name);
    let unknown = |pattern: &&String| {
        let known = |side: &Results| {
            side.all()
                .any(|f| f.name == **pattern || matches(pattern, &f.name))
        };
        !known(a) && !known(b)
    };
    if let Some(name) = settings.nan_equal.iter().find(unknown) {
        let what = format!("neither has a field `{name}` in which NaN could be equal");
        return Err(refuse(what, "name a field that one of them has"));
    }
    // Rows identified by their index have no key.
    if (a.space < 2 || b.space < 2) && a.space != b.space {
        let keys = |side: &Results| match side.space {
            0 => "rows in their order",
            1 => "rows by their time",
            _ => "values on points or cells",
        };
        let what = format!("one has {}, the other {}", keys(a), keys(b));
        return Err(refuse(what, "give two tables of the same kind"));
    }
    if let Some((name, _)) = tolerances.of_field.iter().find(|(name, _)| !has(name)) {
        let what = format!("neither has the field `{name}` that a tolerance is given for");
        return Err(refuse(what, "name a field that one of them has"));
    }
    let near = match settings.near {
        Some(near) => near,
        None => places::tolerance(&a.points, &b.points)?,
    };
    let map = match settings.map {
        Some(MatchBy::Coordinates) if a.points.is_empty() || b.points.is_empty() => {
            let what = "one of them has no coordinates".to_owned();
            return Err(refuse(what, "match them by vertices"));
        }
        Some(map) => map,
        None if same_points(a, b, near) => MatchBy::Vertices,
        None => MatchBy::Coordinates,
    };
    let (dims_a, dims_b) = (a.dimensions(), b.dimensions());
    let meshes = [a, b].iter().all(|side| is_domain(side) || are_faces(side));
    if map == MatchBy::Functions {
        if !meshes {
            let what = "one of them has no cells on which a field is a function".to_owned();
            return Err(refuse(
                what,
                "give results on triangles, quadrangles, tetrahedra, prisms or hexahedra",
            ));
        }
        return as_functions(a, b, near, settings, None);
    }
    let numbers = match map {
        MatchBy::Coordinates => by_place(a, b, near)?,
        _ => [by_id(a), by_id(b)].concat(),
    };
    let (of_a, of_b) = numbers.split_at(a.point_count());
    // A point that shares its position with others is identified together with its cell.
    let broken = map == MatchBy::Coordinates && (repeats(of_a)? || repeats(of_b)?);
    let by_cells = broken || [a, b].iter().all(|side| side.has_cell_fields());
    // If there are lines in addition to triangles, to mark boundaries, values on points are independent; points without cells are not a mesh.
    let others = match (dims_a.last(), dims_b.last()) {
        (Some(_), Some(_)) if by_cells => dims_a != dims_b,
        (Some(top @ 1..), Some(other @ 1..)) => top != other,
        _ => false,
    };
    if others {
        let what = format!("one has cells of dimension {dims_a:?}, the other of {dims_b:?}");
        return Err(refuse(what, "judge those of one dimension, as in --dim 2"));
    }
    let other_cells = other_cells((a, of_a), (b, of_b))?;
    if settings.map.is_none() && meshes && other_cells.is_some() {
        return as_functions(a, b, near, settings, other_cells);
    }
    let parts = match a.cell_count() {
        0 => Parts::new(b, of_b, near),
        _ => Parts::new(a, of_a, near),
    }?;
    let near = if map == MatchBy::Coordinates {
        4.0 * near
    } else {
        near
    };

    let mut comparison = Comparison::new(a, b, map);
    for on in [On::Points, On::Cells, On::Corners] {
        let exists = |side: &Results| !fields_on(side, on).is_empty();
        if exists(a) && exists(b) {
            let keyed = |side, numbers| Keyed::new(side, numbers, on, broken);
            let sides = [keyed(a, of_a)?, keyed(b, of_b)?];
            let (mut fields, mut differences) = judge_sets(on, sides, near, &parts, settings)?;
            for (name, norms) in norms_on_mesh(a, on, &mut differences) {
                let found = fields.iter_mut().filter(|f| f.field.field == name);
                found.for_each(|field| field.norms = Some(norms));
            }
            comparison.fields.extend(fields);
            comparison.differences.push(differences);
        } else {
            let (fields, without) = match exists(a) {
                true => (fields_on(a, on), b),
                false => (fields_on(b, on), a),
            };
            let missing = fields.iter().map(|field| {
                let reason = format!("{} has no field on {}s", without.source, on.noun());
                ComparedField::unjudged(on, &field.name, tolerances, reason)
            });
            comparison.fields.extend(missing);
        }
    }
    if let Some(what) = other_cells {
        return Err(refuse(what, "compare results on the same mesh"));
    }
    judge_groups(
        [(a, of_a), (b, of_b)],
        near,
        &parts,
        settings,
        &mut comparison,
    )?;
    judge_whole(a, b, settings, &mut comparison)?;
    judge_unread(a, b, settings, &mut comparison);
    comparison.identical = settings.identical;
    Ok(comparison.judged())
}

/// Is there a mesh on which fields are functions?
fn is_domain(side: &Results) -> bool {
    !side.points.is_empty() && matches!(side.dimensions().last(), Some(2 | 3))
}

/// Compares functions on the intersection of two meshes.
fn as_functions(
    a: &Results,
    b: &Results,
    near: f64,
    settings: &Settings,
    because: Option<String>,
) -> Result<Comparison> {
    let mut comparison = Comparison::new(a, b, MatchBy::Functions);
    let mut sides = [Cow::Borrowed(a), Cow::Borrowed(b)];
    let mut partial = BTreeSet::new();
    for side in &mut sides {
        if are_faces(side)
            && let Some((found, others)) = crouzeix_raviart(side)?
        {
            comparison.notes.push(format!(
                "{}: values on faces are means of Crouzeix–Raviart functions, on {} cells found from the faces",
                side.source,
                found.cell_count()
            ));
            partial.extend(others);
            *side = Cow::Owned(found);
        }
    }
    let [a, b] = [&*sides[0], &*sides[1]];
    let (fields, intersection, differences) = judge_functions(a, b, near, settings)?;
    comparison.fields = fields;
    comparison.differences.push(differences);
    let reason = "it is not a number on each face, hence no function: leave it out, as with --only";
    let partial = partial
        .iter()
        .map(|name| ComparedField::unjudged(On::Cells, name, &settings.tolerances, reason.into()));
    comparison.fields.extend(partial);
    comparison.intersection = Some(intersection);
    comparison.notes.extend(because);
    judge_whole(a, b, settings, &mut comparison)?;
    judge_unread(a, b, settings, &mut comparison);
    comparison.identical = settings.identical;
    let [a, _] = sides;
    if let Cow::Owned(found) = a {
        comparison.found = Some(Box::new(found));
    }
    Ok(comparison.judged())
}

/// If one side is a table of positions and the other only has fields on cells, the positions are the midpoints of the cells:
/// that side becomes points with these fields.
///
/// # Errors
/// Cells whose points have no coordinates.
pub fn at_midpoints(a: &mut Results, b: &mut Results) -> Result<()> {
    let is_table = |r: &Results| r.width == 0 && !r.points.is_empty();
    let by_cells = |r: &Results| r.width > 0 && r.on_points.is_empty();
    let (cells, table) = match (by_cells(a) && is_table(b), by_cells(b) && is_table(a)) {
        (true, _) => (a, b),
        (_, true) => (b, a),
        _ => return Ok(()),
    };
    if cells.points.is_empty() {
        return Err(Error::Compare {
            a: cells.source.clone(),
            b: table.source.clone(),
            what: format!(
                "{} has no coordinates to match with those of {}",
                cells.source, table.source
            ),
            remedy: "key both by vertices, or both by coordinates".into(),
        });
    }
    *cells = Results {
        points: cells.centroids()?.into(),
        on_points: std::mem::take(&mut cells.on_cells),
        source: std::mem::take(&mut cells.source),
        space: cells.space,
        whole: std::mem::take(&mut cells.whole),
        unread: std::mem::take(&mut cells.unread),
        ..Results::default()
    };
    Ok(())
}

/// The number of each point: that of the first point at its position, `a` before `b`.
fn by_place(a: &Results, b: &Results, near: f64) -> Result<Vec<u32>> {
    let mut numbers = places::numbers(&a.points, &b.points, near)?;
    let mut first = vec![PADDING; numbers.len()];
    for (k, number) in (0..).zip(&mut numbers) {
        cancel::check()?;
        let first = &mut first[*number as usize];
        *first = k.min(*first);
        *number = *first;
    }
    Ok(numbers)
}

/// Are the points the same in the same order, as far as the files have coordinates?
fn same_points(a: &Results, b: &Results, near: f64) -> bool {
    if a.points.is_empty() || b.points.is_empty() {
        return true;
    }
    // Without point numbers, the rows of a table may come in any order.
    a.points.len() == b.points.len()
        && a.ids == b.ids
        && a.points
            .iter()
            .zip(&b.points)
            .all(|(p, q)| (0..3).all(|c| (p[c] - q[c]).abs() <= near))
}

fn repeats(numbers: &[u32]) -> Result<bool> {
    let last = numbers.iter().max().copied().unwrap_or(0);
    let mut seen = vec![false; last as usize + 1];
    for &number in numbers {
        cancel::check()?;
        if std::mem::replace(&mut seen[number as usize], true) {
            return Ok(true);
        }
    }
    Ok(false)
}
