//! Compares one field of both sides: measures every difference, counts those above the tolerance, and locates the largest.

use super::view::{Column, Faces};
use super::{FieldVerdict, Verdict, Worst};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::{ColumnKind, PADDING};

/// A face that does not carry a field.
pub(super) const NOWHERE: u32 = u32::MAX;

impl FieldVerdict {
    /// A field that could not be judged, and why.
    pub fn failed(name: &str, tolerance: f64, reason: String) -> Self {
        FieldVerdict {
            field: name.to_owned(),
            max_abs: f64::NAN,
            max_rel: f64::NAN,
            tolerance,
            conditioned: None,
            verdict: Verdict::Undetermined,
            worst: None,
            faces: 0,
            beyond: 0,
            rms: f64::NAN,
            flips: None,
            rounding_flips: None,
            reason: Some(reason),
        }
    }
}

/// The criterion for one field.
pub(super) struct By<'a> {
    /// The word in messages for the entity that carries it.
    pub noun: &'a str,
    pub tolerance: f64,
    /// Whether NaN on both sides counts as equal.
    pub nan_equal: bool,
    /// Whether several values are components of one value, rather than values at several points.
    pub has_components: bool,
}

/// Judges |a - b| ≤ tolerance · unit(k) on the k-th face that carries `a`; `partner` is the result of [`super::align()`].
pub(super) fn judge_column(
    fields: &Faces,
    a: &Column,
    b: &Column,
    partner: &[u32],
    unit: impl Fn(usize) -> f64,
    by: &By,
) -> Result<FieldVerdict> {
    let By {
        noun, tolerance, ..
    } = *by;
    let failed = |reason: String| FieldVerdict::failed(a.name, tolerance, reason);
    if a.kind != b.kind || a.components != b.components {
        let reason = "its type or number of components differs between the two";
        return Ok(failed(reason.into()));
    }
    if a.faces.is_empty() && b.faces.is_empty() && a.name == "jump" {
        // A mesh of one cell has no interior face and hence no jump to compare.
        return Ok(FieldVerdict {
            max_abs: 0.0,
            max_rel: 0.0,
            rms: 0.0,
            verdict: Verdict::Agree,
            ..failed("the mesh has no interior face".into())
        });
    }
    if a.faces.is_empty() || a.faces.len() != b.faces.len() {
        return Ok(failed(format!(
            "one side has it on {} {noun}s, the other on {}",
            a.faces.len(),
            b.faces.len()
        )));
    }
    let rows = rows_of(b, partner.len())?;
    let mut result = FieldVerdict {
        verdict: Verdict::Agree,
        faces: a.faces.len(),
        max_abs: 0.0,
        max_rel: 0.0,
        rms: 0.0,
        reason: None,
        ..failed(String::new())
    };
    let (mut sum, mut weights, mut flips, mut rounding) = (0.0, 0.0, 0, 0);
    let mut worst = (-1.0, 0, 0.0, 0.0, 0);
    let mut compared = 0_usize;
    let mut rounded: Option<(f64, f64)> = None;
    let mut not_finite: Option<(u32, f64, f64, usize)> = None;
    for (k, &face) in a.faces.iter().enumerate() {
        cancel::check()?;
        let other = rows[partner[face as usize] as usize];
        if other == NOWHERE {
            return Ok(failed(format!(
                "only one side has it on {noun} {:?}",
                vertices(fields, face)
            )));
        }
        let unit = unit(k);
        let measure = fields.measures.get(face as usize).copied().unwrap_or(1.0);
        let mut here: f64 = 0.0;
        let pairs = a.row(k).iter().zip(b.row(other as usize));
        for (component, (&x, &y)) in pairs.enumerate() {
            if by.nan_equal && x.is_nan() && y.is_nan() {
                continue;
            }
            compared += 1;
            if !x.is_finite() || !y.is_finite() {
                not_finite.get_or_insert((face, x, y, component));
                here = f64::NAN;
                continue;
            }
            let rests = (a.rest(k, component), b.rest(other as usize, component));
            let (mut absolute, mut relative) = difference(a.kind, x, y, rests.0 - rests.1, unit);
            if a.kind == ColumnKind::Status && (x <= 0.0) != (y <= 0.0) {
                if relative <= tolerance {
                    rounding += 1;
                    (absolute, relative) = (0.0, 0.0);
                } else {
                    flips += 1;
                }
            }
            result.max_abs = result.max_abs.max(absolute);
            if !here.is_nan() {
                here = here.max(relative);
            }
            sum += measure * absolute * absolute;
            if relative > worst.0 {
                worst = (relative, face, x, y, component);
                rounded = (relative > tolerance && x == y).then_some(rests);
            }
        }
        weights += measure * a.components as f64;
        result.max_rel = result.max_rel.max(here);
        // Negated, so that NaN cannot agree.
        if !(here <= tolerance) {
            result.beyond += 1;
        }
    }
    if a.kind == ColumnKind::Status {
        result.flips = Some(flips);
        result.rounding_flips = Some(rounding);
    }
    if compared == 0 {
        return Ok(failed("all its values are NaN on both sides".into()));
    }
    let place = |(face, x, y, component): (u32, f64, f64, usize)| {
        let component = (by.has_components && a.components > 1).then_some(component);
        Worst {
            component,
            ..place(fields, face, x, y)
        }
    };
    result.rms = (sum / weights).sqrt();
    result.worst = Some(place((worst.1, worst.2, worst.3, worst.4)));
    if let Some(rests) = rounded {
        let exact = |value: f64, rest: f64| value as i128 + rest as i128;
        result.reason = Some(format!(
            "{noun} {:?} has {} against {}",
            vertices(fields, worst.1),
            exact(worst.2, rests.0),
            exact(worst.3, rests.1)
        ));
    }
    if let Some(found) = not_finite {
        let (face, x, y, _) = found;
        result.reason = Some(format!(
            "{noun} {:?} has {x} against {y}",
            vertices(fields, face)
        ));
        result.worst = Some(place(found));
        (result.max_abs, result.max_rel, result.rms) = (f64::NAN, f64::NAN, f64::NAN);
    }
    if result.beyond > 0 {
        result.verdict = Verdict::Disagree;
    }
    Ok(result)
}

/// |a - b|, absolute and relative to the unit; `rest` is the part of a - b lost to rounding. For a status: 1 if it flips, and the larger |P|.
pub(super) fn difference(kind: ColumnKind, x: f64, y: f64, rest: f64, unit: f64) -> (f64, f64) {
    match kind {
        ColumnKind::Value => {
            let difference = (x - y + rest).abs();
            (difference, relative(difference, unit))
        }
        ColumnKind::Status if (x <= 0.0) == (y <= 0.0) => (0.0, 0.0),
        ColumnKind::Status => (1.0, relative(x.abs().max(y.abs()), unit)),
    }
}

fn relative(difference: f64, unit: f64) -> f64 {
    if difference == 0.0 && unit.is_finite() {
        0.0
    } else {
        difference / unit
    }
}

/// The row of each of `faces` faces in a column; [`NOWHERE`] for faces without the field.
pub(super) fn rows_of(column: &Column, faces: usize) -> Result<Vec<u32>> {
    let mut rows = vec![NOWHERE; faces];
    for (row, &face) in (0..).zip(column.faces.iter()) {
        cancel::check()?;
        rows[face as usize] = row;
    }
    Ok(rows)
}

fn vertices(fields: &Faces, face: u32) -> Vec<u32> {
    let all = fields.face(face as usize).iter();
    all.copied().filter(|v| *v != PADDING).collect()
}

fn place(fields: &Faces, face: u32, a: f64, b: f64) -> Worst {
    let midpoint = fields.midpoints.get(face as usize);
    let space = fields.space;
    Worst {
        vertices: vertices(fields, face),
        midpoint: midpoint.map_or(Vec::new(), |x| x[..space].to_vec()),
        a,
        b,
        component: None,
        cells: None,
    }
}
