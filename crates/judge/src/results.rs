//! The fields of two files from any codes, matched and judged, each on its own scale.
//!
//! Matched by vertices, a point is identified by its number and a cell by the numbers of its points; matched by
//! coordinates, by their positions. Where several points share a position, as in discontinuous data, each is identified
//! as a corner of its cell.

use serde::Serialize;

use super::align::{Nearness, align_by};
use super::column::judge_column;
use super::keyed::{Keyed, fields_on, same_length};
use super::law::{Tolerance, Tolerances};
use super::places;
use super::{FieldVerdict, Verdict};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{FaceColumn, PADDING, ResultField, Results};

/// How points and cells are matched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum MatchBy {
    Vertices,
    Coordinates,
}

/// What a comparison of two files finds.
#[derive(Debug, Serialize)]
pub struct Comparison {
    pub verdict: Verdict,
    pub a: String,
    pub b: String,
    pub map: MatchBy,
    pub fields: Vec<ComparedField>,
    #[serde(skip)]
    pub differences: Vec<Differences>,
}

/// One field of two files. What the verdict calls a face is the point, cell or corner that carries the field.
#[derive(Debug, Serialize)]
pub struct ComparedField {
    pub on: On,
    /// The largest |value| on either side: the scale on which the field is judged.
    pub scale: Option<f64>,
    pub rtol: f64,
    pub atol: f64,
    #[serde(flatten)]
    pub field: FieldVerdict,
}

/// What carries a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum On {
    Points,
    Cells,
    /// Corners of cells, which need not agree where they meet.
    Corners,
}

impl On {
    fn noun(self) -> &'static str {
        match self {
            On::Points => "point",
            On::Cells => "cell",
            On::Corners => "corner",
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

/// Judges every field of two files. Without `map`, they are matched by vertices if the points of both files are the
/// same in the same order, and by coordinates otherwise.
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
///     compare_results(&a, &b, None, &tolerances).map(|comparison| comparison.verdict)
/// };
/// assert_eq!(judged(1e-2)?, Verdict::Agree);
/// assert_eq!(judged(1e-6)?, Verdict::Disagree);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// Files that cannot be matched, a tolerance for a field that neither has, files without fields.
pub fn compare_results(
    a: &Results,
    b: &Results,
    map: Option<MatchBy>,
    tolerances: &Tolerances,
) -> Result<Comparison> {
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
    let has = |name: &str| {
        let sides = [a, b].into_iter().flat_map(all_fields);
        sides.into_iter().any(|field| field.name == name)
    };
    if let Some((name, _)) = tolerances.of_field.iter().find(|(name, _)| !has(name)) {
        let what = format!("neither has the field `{name}` that a tolerance is given for");
        return Err(refuse(what, "name a field that one of them has"));
    }
    let near = places::tolerance(&a.points, &b.points);
    let map = match map {
        Some(MatchBy::Coordinates) if a.points.is_empty() || b.points.is_empty() => {
            let what = "one of them has no coordinates".to_owned();
            return Err(refuse(what, "match them by vertices"));
        }
        Some(map) => map,
        None if same_points(a, b, near) => MatchBy::Vertices,
        None => MatchBy::Coordinates,
    };
    let numbers = match map {
        MatchBy::Vertices => [by_id(a), by_id(b)].concat(),
        MatchBy::Coordinates => by_place(a, b, near),
    };
    let (of_a, of_b) = numbers.split_at(a.point_count());
    // A point that shares its position with others is identified together with its cell.
    let broken = map == MatchBy::Coordinates && (repeats(of_a) || repeats(of_b));
    let near = if map == MatchBy::Coordinates {
        4.0 * near
    } else {
        near
    };
    let (dims_a, dims_b) = (a.dimensions(), b.dimensions());
    let by_cells = broken || [a, b].iter().all(|side| side.has_cell_fields());
    if by_cells && dims_a != dims_b && !dims_a.is_empty() && !dims_b.is_empty() {
        let what = format!("one has cells of dimension {dims_a:?}, the other of {dims_b:?}");
        return Err(refuse(what, "judge those of one dimension, as in --dim 2"));
    }

    let mut comparison = Comparison {
        verdict: Verdict::Undetermined,
        a: a.source.clone(),
        b: b.source.clone(),
        map,
        fields: Vec::new(),
        differences: Vec::new(),
    };
    for on in [On::Points, On::Cells, On::Corners] {
        let exists = |side: &Results| !fields_on(side, on).is_empty();
        if exists(a) && exists(b) {
            let keyed = |side, numbers| Keyed::new(side, numbers, on, broken);
            let (side_a, side_b) = (keyed(a, of_a)?, keyed(b, of_b)?);
            let (fields, differences) = judge_sets(on, &side_a, &side_b, near, tolerances)?;
            comparison.fields.extend(fields);
            comparison.differences.push(differences);
        } else {
            let (fields, without) = match exists(a) {
                true => (fields_on(a, on), b),
                false => (fields_on(b, on), a),
            };
            let missing = fields.iter().map(|field| {
                let Tolerance { rtol, atol } = tolerances.of(&field.name);
                let reason = format!("{} has no field on {}s", without.source, on.noun());
                ComparedField {
                    on,
                    scale: None,
                    rtol,
                    atol,
                    field: FieldVerdict::failed(&field.name, rtol, reason),
                }
            });
            comparison.fields.extend(missing);
        }
    }
    let verdicts = comparison.fields.iter().map(|f| f.field.verdict);
    comparison.verdict = verdicts.max().unwrap_or(Verdict::Undetermined);
    Ok(comparison)
}

fn all_fields(results: &Results) -> impl Iterator<Item = &ResultField> {
    let [points, cells, corners] =
        [On::Points, On::Cells, On::Corners].map(|on| fields_on(results, on));
    points.iter().chain(cells).chain(corners)
}

fn by_id(results: &Results) -> Vec<u32> {
    if results.ids.is_empty() {
        (0..results.point_count() as u32).collect()
    } else {
        results.ids.clone()
    }
}

/// The number of each point: that of the first point at its position, `a` before `b`.
fn by_place(a: &Results, b: &Results, near: f64) -> Vec<u32> {
    let mut numbers = places::numbers(&a.points, &b.points, near);
    let mut first = vec![PADDING; numbers.len()];
    for (k, number) in (0..).zip(&mut numbers) {
        let first = &mut first[*number as usize];
        *first = k.min(*first);
        *number = *first;
    }
    numbers
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

fn repeats(numbers: &[u32]) -> bool {
    let last = numbers.iter().max().copied().unwrap_or(0);
    let mut seen = vec![false; last as usize + 1];
    numbers
        .iter()
        .any(|&n| std::mem::replace(&mut seen[n as usize], true))
}

fn judge_sets(
    on: On,
    a: &Keyed,
    b: &Keyed,
    near: f64,
    tolerances: &Tolerances,
) -> Result<(Vec<ComparedField>, Differences)> {
    let noun = on.noun();
    let near = move |_| near;
    let partner = align_by(&a.fields, &b.fields, &Nearness { noun, near: &near })?;
    let mut differences = Differences {
        on: if a.corner_points.is_some() {
            On::Corners
        } else {
            on
        },
        places: Vec::new(),
        fields: Vec::new(),
    };
    let mut names: Vec<&str> = Vec::new();
    for field in a.carried.iter().chain(b.carried) {
        if !names.contains(&field.name.as_str()) {
            names.push(&field.name);
        }
    }
    let mut judged = Vec::new();
    for name in names {
        let tolerance = tolerances.of(name);
        let find = |side: &Keyed| -> Vec<usize> {
            let named = side.carried.iter().enumerate();
            named
                .filter(|(_, f)| f.name == name)
                .map(|(k, _)| k)
                .collect()
        };
        let (scale, field) = match (&find(a)[..], &find(b)[..]) {
            (&[i], &[j]) => {
                let (mut of_a, mut of_b) = (a.column(&a.carried[i]), b.column(&b.carried[j]));
                if a.fields.space == 2 && b.fields.space == 2 {
                    same_length(&mut of_a, &mut of_b);
                }
                let scale = scale(a, &a.carried[i]).max(scale(b, &b.carried[j]));
                let (allowed, unit) = tolerance.of_scale(scale);
                let verdict = judge_column(&a.fields, &of_a, &of_b, &partner, |_| unit, allowed);
                if let Some(values) = subtract(&of_a, &of_b, &partner) {
                    let components = of_a.components;
                    differences
                        .fields
                        .push((name.to_owned(), components, values));
                }
                (Some(scale), verdict)
            }
            (of_a, of_b) => {
                let reason = if of_a.len() > 1 || of_b.len() > 1 {
                    "a file has it more than once".to_owned()
                } else {
                    let without = if of_a.is_empty() { a } else { b };
                    format!("{} does not have it", without.fields.source)
                };
                (None, FieldVerdict::failed(name, tolerance.rtol, reason))
            }
        };
        judged.push(ComparedField {
            on: differences.on,
            scale,
            rtol: tolerance.rtol,
            atol: tolerance.atol,
            field,
        });
    }
    differences.places.clone_from(&a.fields.midpoints);
    Ok((judged, differences))
}

/// The largest finite |value| of a field, or of the field that sets its scale.
fn scale(side: &Keyed, field: &ResultField) -> f64 {
    let by = field.scaled_by.as_ref();
    let other = by.and_then(|name| side.carried.iter().find(|f| f.name == *name));
    let values = &other.unwrap_or(field).values;
    let finite = values.iter().filter(|v| v.is_finite());
    finite.fold(0.0, |m: f64, v| m.max(v.abs()))
}

/// a - b for everything in the first file.
fn subtract(a: &FaceColumn, b: &FaceColumn, partner: &[u32]) -> Option<Vec<f64>> {
    if a.components != b.components {
        return None;
    }
    let rows = super::column::rows_of(b, partner.len());
    let mut values = vec![f64::NAN; partner.len() * a.components];
    for (k, &face) in a.faces.iter().enumerate() {
        let row = rows[partner[face as usize] as usize];
        if row != super::column::NOWHERE {
            let start = face as usize * a.components;
            let pairs = a.row(k).iter().zip(b.row(row as usize));
            for (value, (x, y)) in values[start..].iter_mut().zip(pairs) {
                *value = x - y;
            }
        }
    }
    Some(values)
}
