//! Answers of two codes with one fault in one of them, which the judge of faces must detect.

use super::*;
use faceoff_mesh::field::{ColumnKind, FaceColumn, FaceFields};

const FACES: u32 = 40;

/// Faces between consecutive points of a line; the last eight are on Γ_C.
fn fields(source: &str) -> FaceFields {
    let column = |name: &str, kind, components: usize, faces: Vec<u32>, shift: f64| {
        let values = (0..faces.len() * components).map(|k| (shift + 0.37 * k as f64).sin());
        FaceColumn {
            name: name.into(),
            kind,
            components,
            values: values.collect(),
            sensitivity: vec![1.0; faces.len()],
            faces,
        }
    };
    let contact: Vec<u32> = (FACES - 8..FACES).collect();
    FaceFields {
        source: source.into(),
        dim: 2,
        space: 2,
        vertices: (0..FACES).flat_map(|f| [f, f + 1]).collect(),
        midpoints: (0..FACES).map(|f| [f64::from(f) + 0.5, 0.0, 0.0]).collect(),
        measures: vec![1.0; FACES as usize],
        columns: vec![
            column("mean", ColumnKind::Value, 1, (0..FACES).collect(), 1.0),
            column("jump", ColumnKind::Value, 1, (1..FACES - 8).collect(), 2.0),
            column("flux", ColumnKind::Value, 1, contact.clone(), 3.0),
            column("status", ColumnKind::Status, 5, contact, 0.5),
        ],
    }
}

type Fault = (&'static str, fn(&mut FaceFields));

const FAULTS: [Fault; 20] = [
    ("a value, in the eleventh digit", |f| {
        f.columns[0].values[4] += 1e-11
    }),
    ("a sign of the flux", |f| f.columns[2].values[3] *= -1.0),
    ("a unit", |f| {
        f.columns[0]
            .values
            .iter_mut()
            .for_each(|v| *v *= 1.0 + 1e-10)
    }),
    ("faces off by one", |f| f.columns[0].values.rotate_left(1)),
    ("contact faces off by one", |f| {
        f.columns[2].faces.iter_mut().for_each(|face| *face -= 1)
    }),
    ("two faces permuted", |f| f.columns[0].values.swap(2, 30)),
    ("two fields swapped", |f| {
        let (a, b) = (f.columns[1].name.clone(), f.columns[2].name.clone());
        (f.columns[1].name, f.columns[2].name) = (b, a);
    }),
    ("the answer of another code in one field", |f| {
        f.columns[2].values.iter_mut().for_each(|v| *v = 0.3 - *v)
    }),
    ("a stale status", |f| f.columns[3].values.rotate_right(5)),
    ("a status turned over", |f| {
        f.columns[3].values.iter_mut().for_each(|p| *p *= -1.0)
    }),
    ("one status turned over at one point", |f| {
        f.columns[3].values[17] *= -1.0
    }),
    ("all in contact", |f| f.columns[3].values.fill(-1.0)),
    ("NaN in the status", |f| f.columns[3].values[7] = f64::NAN),
    ("infinity in a jump", |f| {
        f.columns[1].values[7] = f64::INFINITY
    }),
    ("the flux missing", |f| drop(f.columns.remove(2))),
    ("a field too many", |f| {
        let mut more = f.columns[2].clone();
        more.name = "pressure".into();
        f.columns.push(more);
    }),
    ("an empty field", |f| {
        f.columns[2].faces.clear();
        f.columns[2].values.clear();
    }),
    ("the mean as a status", |f| {
        f.columns[0].kind = ColumnKind::Status
    }),
    ("fewer quadrature points", |f| {
        f.columns[3].components = 4;
        f.columns[3].values.truncate(32);
    }),
    ("a face elsewhere", |f| f.midpoints[9][1] = 1e-6),
];

fn worst(a: &FaceFields, b: &FaceFields) -> Option<Verdict> {
    let judged = judge(a, b, 1e-12).ok()?;
    judged.iter().map(|field| field.verdict).max()
}

#[test]
fn every_fault_of_an_answer_is_seen_from_either_side() {
    assert_eq!(worst(&fields("a"), &fields("b")), Some(Verdict::Agree));
    for (name, fault) in FAULTS {
        let mut faulty = fields("b");
        fault(&mut faulty);
        assert_ne!(worst(&fields("a"), &faulty), Some(Verdict::Agree), "{name}");
        assert_ne!(worst(&faulty, &fields("a")), Some(Verdict::Agree), "{name}");
    }
}

#[test]
fn differences_on_faces_are_those_that_are_judged() {
    let (a, mut b) = (fields("a"), fields("b"));
    b.columns[2].values[3] += 1e-3;
    let on_faces = relative_differences(&a, &b, "flux").unwrap();
    let judged = judge(&a, &b, 1e-12).unwrap();
    let (face, largest) = on_faces[3];
    assert_eq!((on_faces.len(), face), (8, FACES - 5));
    assert_eq!(largest, judged[2].max_rel);
    assert!(on_faces.iter().filter(|(_, d)| *d > 0.0).count() == 1);
    assert!(relative_differences(&a, &b, "none").unwrap().is_empty());
}
