//! The fields of two files from any codes, matched and judged, each on its own scale.
//!
//! Matched by vertices, a point is identified by its number and a cell by the numbers of its points; matched by
//! coordinates, by their positions. Where several points share a position, as in discontinuous data, each is identified
//! as a corner of its cell.
//!
//! Relative tolerances refer to the largest value of a field on each connected part of the mesh.

use std::collections::HashMap;

use serde::Serialize;

use super::align::{Nearness, align_by};
use super::cells::other_cells;
use super::column::{judge_column, rows_of};
use super::keyed::{Keyed, fields_on, same_length};
use super::law::{Tolerance, Tolerances};
use super::parts::Parts;
use super::places;
use super::supermesh::{Intersection, Norms, judge_functions};
use super::{FieldVerdict, Verdict};
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{FaceColumn, PADDING, ResultField, Results};

/// How points and cells are matched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum MatchBy {
    Vertices,
    Coordinates,
    /// Not at all: fields are functions, which are compared where both are.
    Functions,
}

/// What a comparison of two files finds.
#[derive(Debug, Serialize)]
pub struct Comparison {
    pub verdict: Verdict,
    pub a: String,
    pub b: String,
    pub map: MatchBy,
    pub fields: Vec<ComparedField>,
    /// Where fields are compared as functions: what the two meshes have in common.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intersection: Option<Intersection>,
    /// What only one file has without being judged.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    #[serde(skip)]
    pub differences: Vec<Differences>,
}

/// One field of two files. What the verdict calls a face is the point, cell or corner that carries the field.
#[derive(Debug, Serialize)]
pub struct ComparedField {
    pub on: On,
    /// The largest |value| on either side: the scale on which the field is judged; each connected part has its own.
    pub scale: Option<f64>,
    pub rtol: f64,
    pub atol: f64,
    /// Norms of the difference, where cells are known.
    #[serde(flatten)]
    pub norms: Option<Norms>,
    #[serde(flatten)]
    pub field: FieldVerdict,
}

impl ComparedField {
    pub(super) fn unjudged(on: On, name: &str, tolerances: &Tolerances, reason: String) -> Self {
        let Tolerance { rtol, atol } = tolerances.of(name);
        ComparedField {
            on,
            scale: None,
            rtol,
            atol,
            norms: None,
            field: FieldVerdict::failed(name, rtol, reason),
        }
    }
}

/// What carries a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum On {
    Points,
    Cells,
    /// Corners of cells, which need not agree where they meet.
    Corners,
    /// The file as a whole.
    Whole,
    /// All cells, whatever carries the values of either side.
    Functions,
    /// The mesh itself: what part of it the other mesh does not cover.
    Domain,
}

impl On {
    fn noun(self) -> &'static str {
        match self {
            On::Points => "point",
            On::Cells => "cell",
            On::Corners => "corner",
            On::Whole => "entry",
            On::Functions | On::Domain => "cell",
        }
    }
}

/// a - b for all fields on points, cells or corners, in the order of the first file.
#[derive(Debug)]
pub struct Differences {
    pub on: On,
    /// Coordinates of the corners, cell by cell, or of the points or cells in the order of the file.
    pub places: Vec<[f64; 3]>,
    /// Name, components and values; NaN where a field is not carried.
    pub fields: Vec<(String, usize, Vec<f64>)>,
}

/// By what two results are compared.
#[derive(Clone, Default)]
pub struct Settings<'a> {
    pub tolerances: Tolerances,
    /// Without it, points and cells are matched by their numbers if the points of both files are the same in the same order,
    /// and by coordinates otherwise; fields on meshes with other cells are compared as functions.
    pub map: Option<MatchBy>,
    /// Of functions: the part of a mesh that the other one need not cover; `None`: no more than rounding of the coordinates.
    pub alone: Option<f64>,
    /// Hears how much of a long comparison is done, from 0 to 1.
    pub progress: Option<&'a (dyn Fn(f64) + Sync)>,
}

impl From<Tolerances> for Settings<'_> {
    fn from(tolerances: Tolerances) -> Self {
        Settings {
            tolerances,
            ..Settings::default()
        }
    }
}

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
/// Files that cannot be matched, meshes that are no domain of functions, a tolerance for a field that neither has, files
/// without fields.
pub fn compare_results(a: &Results, b: &Results, settings: &Settings) -> Result<Comparison> {
    let tolerances = &settings.tolerances;
    let refuse = |what: String, remedy: &str| Error::Compare {
        a: a.source.clone(),
        b: b.source.clone(),
        what,
        remedy: remedy.to_owned(),
    };
    for side in [a, b] {
        if side.is_empty() {
            let what = format!("{} has no field to compare", side.source);
            return Err(refuse(what, "write the fields into it"));
        }
    }
    let has = |name: &str| a.has(name) || b.has(name);
    if let Some((name, _)) = tolerances.of_field.iter().find(|(name, _)| !has(name)) {
        let what = format!("neither has the field `{name}` that a tolerance is given for");
        return Err(refuse(what, "name a field that one of them has"));
    }
    let near = places::tolerance(&a.points, &b.points)?;
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
    let meshes = [a, b].iter().all(|side| is_domain(side));
    if map == MatchBy::Functions {
        if !meshes {
            let what = "one of them has no cells on which a field is a function".to_owned();
            return Err(refuse(
                what,
                "give results on triangles, quadrangles or tetrahedra",
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
    // Of lines beside triangles, which mark their sides, values on points are independent; points alone are no mesh.
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
            let (side_a, side_b) = (keyed(a, of_a)?, keyed(b, of_b)?);
            let (fields, differences) =
                judge_sets(on, [&side_a, &side_b], near, &parts, tolerances)?;
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
    judge_whole(a, b, tolerances, &mut comparison)?;
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
    let tolerances = &settings.tolerances;
    let progress = settings.progress.unwrap_or(&|_| {});
    let (fields, intersection) = judge_functions(a, b, near, tolerances, settings.alone, progress)?;
    comparison.fields = fields;
    comparison.intersection = Some(intersection);
    comparison.notes.extend(because);
    judge_whole(a, b, tolerances, &mut comparison)?;
    Ok(comparison.judged())
}

impl Comparison {
    fn new(a: &Results, b: &Results, map: MatchBy) -> Self {
        Comparison {
            verdict: Verdict::Undetermined,
            a: a.source.clone(),
            b: b.source.clone(),
            map,
            fields: Vec::new(),
            intersection: None,
            notes: Vec::new(),
            differences: Vec::new(),
        }
    }

    /// With the verdict that its fields have together.
    fn judged(mut self) -> Self {
        let verdicts = self.fields.iter().map(|f| f.field.verdict);
        self.verdict = verdicts.max().unwrap_or(Verdict::Undetermined);
        self
    }
}

/// Where one side is a table of places and the other has fields on cells only, the places are the midpoints of the cells:
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
        points: cells.centroids()?,
        on_points: std::mem::take(&mut cells.on_cells),
        source: std::mem::take(&mut cells.source),
        space: cells.space,
        whole: std::mem::take(&mut cells.whole),
        ..Results::default()
    };
    Ok(())
}

/// Numbers about the files as a whole that both have, and a note of what only one has: there is no need to write a time.
fn judge_whole(
    a: &Results,
    b: &Results,
    tolerances: &Tolerances,
    comparison: &mut Comparison,
) -> Result<()> {
    let mut only = [Vec::new(), Vec::new()];
    for (name, sides) in by_name(&a.whole, &b.whole, |f| &f.name) {
        match (&sides[0][..], &sides[1][..]) {
            (&[of_a], &[of_b]) if of_a.is_empty() && of_b.is_empty() => {}
            (&[of_a], &[of_b]) if of_a.len() == of_b.len() => {
                let (of_a, of_b) = (Keyed::of_whole(a, of_a), Keyed::of_whole(b, of_b));
                let parts = Parts::default();
                let (fields, _) = judge_sets(On::Whole, [&of_a, &of_b], 0.0, &parts, tolerances)?;
                comparison.fields.extend(fields);
            }
            ([], _) => only[1].push(format!("`{name}`")),
            (_, []) => only[0].push(format!("`{name}`")),
            (of_a, of_b) => {
                let count = |arrays: &[&ResultField]| arrays.iter().map(|f| f.len()).sum::<usize>();
                let (count_a, count_b) = (count(of_a), count(of_b));
                let reason = format!("one side has {count_a} entries, the other {count_b}");
                let unjudged = ComparedField::unjudged(On::Whole, name, tolerances, reason);
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

pub(super) fn by_id(results: &Results) -> Vec<u32> {
    if results.ids.is_empty() {
        (0..results.point_count() as u32).collect()
    } else {
        results.ids.clone()
    }
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

fn judge_sets(
    on: On,
    [a, b]: [&Keyed; 2],
    near: f64,
    parts: &Parts,
    tolerances: &Tolerances,
) -> Result<(Vec<ComparedField>, Differences)> {
    let noun = on.noun();
    let near = move |_| near;
    let partner = align_by(&a.fields, &b.fields, &Nearness { noun, near: &near })?;
    let faces = 0..a.fields.face_count();
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
                let without = if sides[0].is_empty() { a } else { b };
                format!("{} does not have it", without.fields.source)
            };
            judged.push(ComparedField::unjudged(on, name, tolerances, reason));
            continue;
        };
        let tolerance = if field_a.rest.is_some() && field_b.rest.is_some() {
            tolerances.of_integers(name)
        } else {
            tolerances.of(name)
        };
        let (mut column_a, mut column_b) = (a.column(field_a)?, b.column(field_b)?);
        if a.fields.space == 2 && b.fields.space == 2 {
            same_length(&mut column_a, &mut column_b);
        }
        let mut scales = vec![0.0; parts.count + 1];
        for (side, field, column, part) in [
            (a, field_a, &column_a, &of_a),
            (b, field_b, &column_b, &of_b),
        ] {
            let scaling = side.scaling(field)?;
            add_scales(&mut scales, scaling.as_ref().unwrap_or(column), part)?;
        }
        let allowed = tolerance.of_scale(0.0).0;
        let unit = |k: usize| {
            let part = of_a[column_a.faces[k] as usize];
            tolerance.of_scale(scales[part as usize]).1
        };
        let verdict = judge_column(&a.fields, &column_a, &column_b, &partner, unit, allowed)?;
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
            field: verdict,
        });
    }
    differences.places.clone_from(&a.fields.midpoints);
    Ok((judged, differences))
}

/// The largest finite |value| of a column on each part; `part` is that of each face.
fn add_scales(scales: &mut [f64], column: &FaceColumn, part: &[u32]) -> Result<()> {
    for (k, &face) in column.faces.iter().enumerate() {
        cancel::check()?;
        let scale = &mut scales[part[face as usize] as usize];
        let finite = column.row(k).iter().filter(|v| v.is_finite());
        *scale = finite.fold(*scale, |m, v| m.max(v.abs()));
    }
    Ok(())
}

/// a - b for everything in the first file.
fn subtract(a: &FaceColumn, b: &FaceColumn, partner: &[u32]) -> Result<Option<Vec<f64>>> {
    if a.components != b.components {
        return Ok(None);
    }
    let rows = rows_of(b, partner.len())?;
    let mut values = vec![f64::NAN; partner.len() * a.components];
    for (k, &face) in a.faces.iter().enumerate() {
        cancel::check()?;
        let row = rows[partner[face as usize] as usize];
        if row != super::column::NOWHERE {
            let start = face as usize * a.components;
            let pairs = a.row(k).iter().zip(b.row(row as usize));
            for (c, (value, (x, y))) in values[start..].iter_mut().zip(pairs).enumerate() {
                *value = x - y + (a.rest(k, c) - b.rest(row as usize, c));
            }
        }
    }
    Ok(Some(values))
}
