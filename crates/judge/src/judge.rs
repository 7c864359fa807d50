//! Tolerance and verdict, field by field.
//!
//! A field agrees if |a - b| ≤ tolerance · max|u| · s on every face, where max|u| is the size of the
//! solution and s is how much the field can change when the dofs change by 1. Values that are not
//! finite, and fields that are empty or missing on one side, never pass.

use serde::Serialize;

use super::align;
use super::column::{By, NOWHERE, difference, judge_column, rows_of};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::FaceFields;

/// The outcome of a comparison, a case or a whole run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// All fields are within their tolerance.
    Agree,
    /// The difference exceeds the fixed tolerance, but not the effect of rounding on the solution of such an ill-conditioned
    /// scheme.
    #[serde(rename = "agree (conditioned)")]
    Conditioned,
    /// Something could not be judged.
    Undetermined,
    /// Both solve the scheme, which has more than one solution.
    #[serde(rename = "several solutions")]
    Several,
    /// A field is beyond its tolerance, or not finite.
    Disagree,
}

impl Verdict {
    /// Is it an agreement?
    pub fn passes(self) -> bool {
        matches!(self, Verdict::Agree | Verdict::Conditioned)
    }

    /// The worst of several; undetermined if there is none, since nothing was judged.
    pub fn of_all(all: impl IntoIterator<Item = Verdict>) -> Self {
        all.into_iter().max().unwrap_or(Verdict::Undetermined)
    }

    /// The name in messages and JSON.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Agree => "agree",
            Verdict::Conditioned => "agree (conditioned)",
            Verdict::Undetermined => "undetermined",
            Verdict::Several => "several solutions",
            Verdict::Disagree => "disagree",
        }
    }
}

/// One field of a pair of results.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FieldVerdict {
    /// The name of the field.
    pub field: String,
    /// Largest |a - b|; for the contact status 1 if a quadrature point differs beyond rounding.
    pub max_abs: f64,
    /// Largest |a - b| / (max|u| s), comparable with the tolerance.
    pub max_rel: f64,
    /// The bound for `max_rel`.
    pub tolerance: f64,
    /// The tolerance as enlarged by the condition number at the face with the largest difference; `None` unless this was requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub conditioned: Option<f64>,
    /// Whether the field agrees.
    pub verdict: Verdict,
    /// Where the difference is largest.
    pub worst: Option<Worst>,
    /// Faces that carry the field.
    pub faces: usize,
    /// Faces beyond the tolerance.
    pub beyond: usize,
    /// The root mean square of a - b, weighted by face measure.
    pub rms: f64,
    /// Quadrature points of Γ_C whose status differs although P is beyond rounding.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flips: Option<usize>,
    /// The same where |P| is of the size of rounding: reported, but not counted against agreement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rounding_flips: Option<usize>,
    /// Why it could not be judged, or why it fails regardless of the values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// The face where two results differ most.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Worst {
    /// The vertices of the face, ascending.
    pub vertices: Vec<u32>,
    /// Its centroid, with one coordinate per dimension of the mesh; empty if positions are unknown.
    pub midpoint: Vec<f64>,
    /// The value of the first result.
    pub a: f64,
    /// The value of the second.
    pub b: f64,
    /// The index of the component, for a field with several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub component: Option<usize>,
    /// If two meshes are compared: the cells, by their indices in either file, that have these values at this position.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cells: Option<[u32; 2]>,
}

/// Judges every field that at least one side has.
///
/// # Errors
/// Faces that cannot be matched.
pub fn judge(a: &FaceFields, b: &FaceFields, tolerance: f64) -> Result<Vec<FieldVerdict>> {
    let partner = align(a, b)?;
    let size = size(a).max(size(b));
    let by = By {
        noun: "face",
        tolerance,
        nan_equal: false,
        has_components: false,
    };
    let mut names: Vec<&str> = a.columns.iter().map(|c| c.name.as_str()).collect();
    for column in &b.columns {
        if !names.contains(&column.name.as_str()) {
            names.push(&column.name);
        }
    }
    names
        .into_iter()
        .map(|name| match (a.column(name), b.column(name)) {
            (Some(of_a), Some(of_b)) => {
                let unit = |k: usize| size * of_a.sensitivity[k];
                judge_column(&a.into(), &of_a.into(), &of_b.into(), &partner, unit, &by)
            }
            (one, _) => {
                let without = if one.is_some() { &b.source } else { &a.source };
                let reason = format!("{without} does not have it");
                Ok(FieldVerdict::failed(name, tolerance, reason))
            }
        })
        .collect()
}

/// Judges again each field that disagrees, given the absolute amount `moved` by which rounding may have moved the dofs of
/// each face of `a`: differences up to that amount agree, as conditioned.
///
/// # Errors
/// Faces that cannot be matched.
pub fn judge_conditioned(
    a: &FaceFields,
    b: &FaceFields,
    judged: &mut [FieldVerdict],
    moved: &[f64],
) -> Result<()> {
    let partner = align(a, b)?;
    let size = size(a).max(size(b));
    for field in judged.iter_mut() {
        let (Some(of_a), Some(of_b)) = (a.column(&field.field), b.column(&field.field)) else {
            continue;
        };
        if field.verdict != Verdict::Disagree || !field.max_rel.is_finite() {
            continue;
        }
        let tolerance = |k: usize| {
            let conditioned = moved[of_a.faces[k] as usize] / size;
            if conditioned > field.tolerance {
                conditioned
            } else {
                field.tolerance
            }
        };
        // In units of the tolerance, which differs from face to face.
        let unit = |k: usize| size * of_a.sensitivity[k] * tolerance(k);
        let by = By {
            noun: "face",
            tolerance: 1.0,
            nan_equal: false,
            has_components: false,
        };
        let again = judge_column(&a.into(), &of_a.into(), &of_b.into(), &partner, unit, &by)?;
        let largest = (0..of_a.faces.len()).map(tolerance).fold(0.0, f64::max);
        field.conditioned = Some(largest);
        field.beyond = again.beyond;
        if again.verdict == Verdict::Agree {
            field.verdict = Verdict::Conditioned;
            (field.flips, field.rounding_flips) = (again.flips, again.rounding_flips);
        }
    }
    Ok(())
}

/// max|u| over the face means; NaN if any of them is NaN.
fn size(fields: &FaceFields) -> f64 {
    let means = fields.column("mean").map_or(&[][..], |c| &c.values);
    means.iter().fold(0.0, |max: f64, v| {
        if v.is_nan() || max.is_nan() {
            f64::NAN
        } else {
            max.max(v.abs())
        }
    })
}

/// |a - b| / (max|u| s) on each face that carries `field` on both sides, as [`judge`] compares it with the tolerance:
/// faces of `a`, with the largest of the values on each. NaN if one is not finite.
///
/// # Errors
/// Faces that cannot be matched.
pub fn relative_differences(
    a: &FaceFields,
    b: &FaceFields,
    field: &str,
) -> Result<Vec<(u32, f64)>> {
    let partner = align(a, b)?;
    let size = size(a).max(size(b));
    let (Some(of_a), Some(of_b)) = (a.column(field), b.column(field)) else {
        return Ok(Vec::new());
    };
    let rows = rows_of(&of_b.into(), b.face_count())?;
    let on = |k: usize, face: u32| -> Option<Result<(u32, f64)>> {
        let row = rows[partner[face as usize] as usize];
        (row != NOWHERE).then(|| {
            cancel::check()?;
            let values = of_a.row(k).iter().zip(of_b.row(row as usize));
            let unit = size * of_a.sensitivity[k];
            let largest = values
                .map(|(&x, &y)| difference(of_a.kind, x, y, 0.0, unit).1)
                .fold(0.0, |m: f64, d| if d.is_nan() { d } else { m.max(d) });
            Ok((face, largest))
        })
    };
    let faces = of_a.faces.iter().enumerate();
    faces.filter_map(|(k, &face)| on(k, face)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_mesh::field::{ColumnKind, FaceColumn};

    fn fields(source: &str) -> FaceFields {
        let faces = 6;
        let column = |name: &str, kind, components: usize, carriers: Vec<u32>| FaceColumn {
            name: name.into(),
            kind,
            components,
            values: (0..carriers.len() * components)
                .map(|k| (1.0 + k as f64).sin())
                .collect(),
            sensitivity: vec![1.0; carriers.len()],
            faces: carriers,
        };
        FaceFields {
            source: source.into(),
            dim: 2,
            space: 2,
            vertices: (0..faces).flat_map(|f| [f, f + 10]).collect(),
            midpoints: (0..faces).map(|f| [f64::from(f), 0.5, 0.0]).collect(),
            measures: vec![1.0; faces as usize],
            columns: vec![
                column("mean", ColumnKind::Value, 1, (0..faces).collect()),
                column("status", ColumnKind::Status, 2, vec![1, 4]),
            ],
        }
    }

    /// The same fields with the faces in reverse order.
    fn reversed(source: &str) -> FaceFields {
        let mut f = fields(source);
        let n = f.face_count() as u32;
        f.vertices = (0..n).rev().flat_map(|k| [k, k + 10]).collect();
        f.midpoints.reverse();
        for column in &mut f.columns {
            for face in &mut column.faces {
                *face = n - 1 - *face;
            }
        }
        f
    }

    fn verdicts(a: &FaceFields, b: &FaceFields) -> Vec<Verdict> {
        let judged = judge(a, b, 1e-12).unwrap();
        judged.iter().map(|f| f.verdict).collect()
    }

    #[test]
    fn the_order_of_faces_does_not_matter() {
        assert_eq!(verdicts(&fields("a"), &reversed("b")), [Verdict::Agree; 2]);
    }

    #[test]
    fn the_worst_face_is_named() {
        let mut b = reversed("b");
        b.columns[0].values[3] += 1e-6;
        b.columns[0].values[5] += 1e-9;
        let judged = judge(&fields("a"), &b, 1e-12).unwrap();
        let worst = judged[0].worst.as_ref().unwrap();
        assert_eq!(judged[0].verdict, Verdict::Disagree);
        assert_eq!(worst.vertices, [3, 13]);
        assert_eq!((judged[0].beyond, worst.midpoint[0]), (2, 3.0));
        assert!((judged[0].max_abs - 1e-6).abs() < 1e-14);
    }

    #[test]
    fn what_cannot_be_judged_is_never_a_pass() {
        let a = fields("a");
        let change = |f: &dyn Fn(&mut FaceFields)| {
            let mut b = fields("b");
            f(&mut b);
            b
        };
        for bad in [f64::NAN, f64::INFINITY] {
            let b = change(&|b| b.columns[0].values[2] = bad);
            assert_eq!(verdicts(&a, &b)[0], Verdict::Disagree);
            assert_ne!(verdicts(&b, &b.clone())[0], Verdict::Agree);
            assert_eq!(judge(&a, &b, 1e-12).unwrap()[0].beyond, 1);
            let b = change(&|b| b.columns[1].values[2] = bad);
            assert_eq!(verdicts(&a, &b)[1], Verdict::Disagree);
        }
        let b = change(&|b| {
            b.columns.pop();
        });
        assert_eq!(verdicts(&a, &b)[1], Verdict::Undetermined);
        assert_eq!(verdicts(&b, &a)[1], Verdict::Undetermined);
        let b = change(&|b| b.columns[1].faces[1] = 5);
        assert_eq!(verdicts(&a, &b)[1], Verdict::Undetermined);
        let b = change(&|b| b.columns[0].components = 2);
        assert_eq!(verdicts(&a, &b)[0], Verdict::Undetermined);
        let empty = change(&|b| {
            for c in &mut b.columns {
                c.faces.clear();
                c.values.clear();
            }
        });
        assert!(!verdicts(&empty, &empty.clone()).contains(&Verdict::Agree));
    }

    #[test]
    fn faces_that_do_not_match_are_refused() {
        let a = fields("a");
        for change in [
            (|b: &mut FaceFields| b.vertices[11] = 99) as fn(&mut FaceFields),
            |b| b.midpoints[2][1] += 1e-3,
            |b| b.midpoints[2][1] = f64::NAN,
            |b| {
                b.measures.pop();
            },
            |b| b.vertices[2..4].copy_from_slice(&[0, 10]),
        ] {
            let mut b = fields("b");
            change(&mut b);
            assert!(judge(&a, &b, 1e-12).is_err());
            assert!(judge(&b, &a, 1e-12).is_err());
        }
    }

    #[test]
    fn a_flip_at_rounding_level_is_named_and_a_real_one_fails() {
        let (mut a, mut b) = (fields("a"), fields("b"));
        a.columns[1].values[2] = 1e-15;
        b.columns[1].values[2] = -1e-15;
        let judged = judge(&a, &b, 1e-12).unwrap();
        assert_eq!(judged[1].verdict, Verdict::Agree);
        assert_eq!(
            (judged[1].flips, judged[1].rounding_flips),
            (Some(0), Some(1))
        );
        b.columns[1].values[2] = -1e-3;
        let judged = judge(&a, &b, 1e-12).unwrap();
        assert_eq!(judged[1].verdict, Verdict::Disagree);
        assert_eq!(judged[1].worst.as_ref().unwrap().vertices, [4, 14]);
    }

    #[test]
    fn fields_near_zero_are_judged_by_the_size_of_the_solution() {
        let (mut a, mut b) = (fields("a"), fields("b"));
        a.columns[0].values[0] = 0.0;
        b.columns[0].values[0] = 5e-14;
        assert_eq!(verdicts(&a, &b)[0], Verdict::Agree);
        for column in [&mut a.columns[0], &mut b.columns[0]] {
            column.values.fill(0.0);
        }
        assert_eq!(verdicts(&a, &b)[0], Verdict::Agree);
        b.columns[0].values[0] = 1e-300;
        assert_eq!(verdicts(&a, &b)[0], Verdict::Disagree);
    }
}
