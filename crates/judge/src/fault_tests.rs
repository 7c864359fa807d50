//! Files with one fault each, which the comparison must detect; and changes that are not faults.

use super::*;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::{PADDING, ResultField, Results};

/// An n × n square mesh of triangles with a field on points, one on cells, and both as discontinuous data when `broken`.
fn results(source: &str, n: usize, broken: bool) -> Results {
    let at = |k: usize| k as f64 / n as f64;
    let mut points: Vec<[f64; 3]> = Vec::new();
    for j in 0..=n {
        for i in 0..=n {
            points.push([at(i), at(j) + 0.1 * at(i) * at(i), 0.0]);
        }
    }
    let mut cells = Vec::new();
    for j in 0..n {
        for i in 0..n {
            let k = (j * (n + 1) + i) as u32;
            let up = k + n as u32 + 1;
            cells.extend([k, k + 1, up + 1, k, up + 1, up]);
        }
    }
    let mut cell_values = Vec::new();
    for (k, cell) in cells.chunks_exact(3).enumerate() {
        let x: f64 = cell.iter().map(|v| points[*v as usize][0]).sum();
        cell_values.extend([x.sin(), 1.0 + k as f64]);
    }
    let value = |p: &[f64; 3]| (3.0 * p[0] + 5.0 * p[1]).sin();
    let mut on_points: Vec<f64> = points.iter().map(value).collect();
    if broken {
        on_points = cells
            .iter()
            .zip(0..)
            .map(|(&v, k)| value(&points[v as usize]) + f64::from(k))
            .collect();
        points = cells.iter().map(|v| points[*v as usize]).collect();
        cells = (0..cells.len() as u32).collect();
    }
    Results {
        source: source.into(),
        space: 2,
        points: points.into(),
        width: 3,
        cells: cells.into(),
        on_points: vec![field("u", 1, on_points)],
        on_cells: vec![field("q", 2, cell_values)],
        ..Results::default()
    }
}

fn field(name: &str, components: usize, values: Vec<f64>) -> ResultField {
    ResultField {
        name: name.into(),
        components,
        values: values.into(),
        rest: None,
        at: None,
        scaled_by: None,
        single: false,
    }
}

/// The same with points and cells in a different order, and the corners of cells rotated.
fn permuted(of: &Results) -> Results {
    let mut other = of.clone();
    other.source = "permuted".into();
    let (points, cells) = (of.points.len(), of.cell_count());
    // Coprime strides.
    let stride = |count: usize| {
        (1..)
            .map(|k| 7 * k + 3)
            .find(|s| gcd(*s, count) == 1)
            .unwrap_or(1)
    };
    let moved = |k: usize, count: usize| (k * stride(count) + 5) % count;
    for k in 0..points {
        other.points.to_mut()[moved(k, points)] = of.points[k];
        other.on_points[0].values.to_mut()[moved(k, points)] = of.on_points[0].values[k];
    }
    for c in 0..cells {
        let to = moved(c, cells);
        for i in 0..3 {
            let point = of.cells[3 * c + (i + c) % 3] as usize;
            other.cells.to_mut()[3 * to + i] = moved(point, points) as u32;
        }
        for i in 0..2 {
            other.on_cells[0].values.to_mut()[2 * to + i] = of.on_cells[0].values[2 * c + i];
        }
    }
    other
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

fn compare(a: &Results, b: &Results, map: Option<MatchBy>) -> Result<Comparison> {
    let tolerance = Tolerance {
        rtol: 1e-12,
        atol: 0.0,
    };
    let tolerances = Tolerances {
        of_all: tolerance,
        of_field: Vec::new(),
        is_given: true,
    };
    let settings = Settings {
        map,
        ..tolerances.into()
    };
    compare_results(a, b, &settings)
}

fn verdict(a: &Results, b: &Results) -> Option<Verdict> {
    compare(a, b, None).ok().map(|c| c.verdict)
}

#[test]
fn the_order_of_points_and_cells_does_not_matter() {
    for broken in [false, true] {
        let a = results("a", 6, broken);
        let comparison = compare(&a, &permuted(&a), None).unwrap();
        assert_eq!(
            (comparison.verdict, comparison.map),
            (Verdict::Agree, MatchBy::Coordinates)
        );
        assert_eq!(comparison.fields[0].field.faces, a.points.len());
        assert_eq!(
            compare(&a, &a.clone(), None).unwrap().map,
            MatchBy::Vertices
        );
        assert!(compare(&a, &permuted(&a), Some(MatchBy::Vertices)).is_err());
    }
}

#[test]
fn the_worst_is_named_by_the_first_files_own_numbers() {
    for broken in [false, true] {
        let a = results("a", 6, broken);
        let mut b = permuted(&a);
        let point = b.points.iter().position(|p| *p == a.points[9]).unwrap();
        b.on_points[0].values.to_mut()[point] += 1e-3;
        b.on_cells[0].values.to_mut()[7] = 0.5;
        let comparison = compare(&a, &b, None).unwrap();
        let worst = comparison.fields[0].field.worst.clone().unwrap();
        assert_eq!(comparison.fields[0].field.beyond, 1);
        assert_eq!(worst.midpoint, a.points[9][..2]);
        let named = *worst.vertices.last().unwrap() as usize;
        assert_eq!(a.points[named], a.points[9]);
        assert_eq!(comparison.fields[1].field.beyond, 1);
        assert_eq!(
            comparison.fields[1]
                .field
                .worst
                .as_ref()
                .unwrap()
                .vertices
                .len(),
            3
        );
        let nonzero = |values: &[f64]| values.iter().filter(|v| v.abs() > 1e-6).count();
        assert_eq!(nonzero(&comparison.differences[0].fields[0].2), 1);
    }
}

#[test]
fn continuous_data_are_compared_with_discontinuous_corner_by_corner() {
    let a = results("a", 4, false);
    let mut b = results("b", 4, true);
    let value = |p: &[f64; 3]| (3.0 * p[0] + 5.0 * p[1]).sin();
    b.on_points[0].values = b.points.iter().map(value).collect();
    assert_eq!(verdict(&a, &b), Some(Verdict::Agree));
    assert_eq!(verdict(&b, &a), Some(Verdict::Agree));
    b.on_points[0].values.to_mut()[17] += 1.0;
    let comparison = compare(&a, &b, None).unwrap();
    assert_eq!(
        (comparison.verdict, comparison.fields[0].field.beyond),
        (Verdict::Disagree, 1)
    );
    assert_eq!(comparison.fields[0].on, On::Corners);
}

type Fault = (&'static str, fn(&mut Results));

/// The faults that one of two files may have.
const FAULTS: [Fault; 30] = [
    ("a value", |r| r.on_points[0].values.to_mut()[7] += 1e-9),
    ("a sign", |r| r.on_points[0].values.to_mut()[7] *= -1.0),
    ("all signs", |r| {
        r.on_points[0]
            .values
            .to_mut()
            .iter_mut()
            .for_each(|v| *v *= -1.0)
    }),
    ("a unit, in the tenth digit", |r| {
        r.on_points[0]
            .values
            .to_mut()
            .iter_mut()
            .for_each(|v| *v *= 1.0 + 1e-10)
    }),
    ("a unit, a thousand times", |r| {
        r.on_cells[0]
            .values
            .to_mut()
            .iter_mut()
            .for_each(|v| *v *= 1e3)
    }),
    ("a shift", |r| {
        r.on_points[0]
            .values
            .to_mut()
            .iter_mut()
            .for_each(|v| *v += 1e-9)
    }),
    ("two values swapped", |r| {
        r.on_points[0].values.to_mut().swap(3, 11)
    }),
    ("values off by one", |r| {
        r.on_points[0].values.to_mut().rotate_left(1)
    }),
    ("values reversed", |r| {
        r.on_points[0].values.to_mut().reverse()
    }),
    ("cell values off by one cell", |r| {
        r.on_cells[0].values.to_mut().rotate_right(2)
    }),
    ("components swapped", |r| {
        r.on_cells[0].values.to_mut().swap(4, 5)
    }),
    ("all components swapped", |r| {
        r.on_cells[0]
            .values
            .to_mut()
            .chunks_exact_mut(2)
            .for_each(|c| c.swap(0, 1))
    }),
    ("fields swapped by name", |r| {
        r.on_points[0].name = "q".into();
        r.on_cells[0].name = "u".into();
    }),
    ("NaN", |r| r.on_points[0].values.to_mut()[2] = f64::NAN),
    ("infinity", |r| {
        r.on_points[0].values.to_mut()[2] = f64::INFINITY
    }),
    ("minus infinity on a cell", |r| {
        r.on_cells[0].values.to_mut()[2] = f64::NEG_INFINITY
    }),
    ("all NaN", |r| r.on_points[0].values.to_mut().fill(f64::NAN)),
    ("all zero", |r| r.on_points[0].values.to_mut().fill(0.0)),
    ("a field missing", |r| r.on_cells.clear()),
    ("a field too many", |r| {
        r.on_points.push(ResultField {
            name: "extra".into(),
            ..r.on_points[0].clone()
        })
    }),
    ("a field twice", |r| {
        r.on_points.push(r.on_points[0].clone())
    }),
    ("a field on no point", |r| {
        r.on_points[0].values.to_mut().clear();
        r.on_points[0].at = Some(Vec::new());
    }),
    ("a field that one point lacks", |r| {
        r.on_points[0].values.to_mut().pop();
        r.on_points[0].at = Some((0..r.points.len() as u32 - 1).collect());
    }),
    ("another number of components", |r| {
        r.on_cells[0].components = 1;
        r.on_cells[0].values.to_mut().truncate(r.cells.len() / 3);
    }),
    ("a point elsewhere", |r| r.points.to_mut()[5][0] += 1e-4),
    ("a coordinate that is no number", |r| {
        r.points.to_mut()[5][1] = f64::NAN
    }),
    ("the mesh scaled in the seventh digit", |r| {
        r.points
            .to_mut()
            .iter_mut()
            .flatten()
            .for_each(|x| *x *= 1.0 + 1e-7)
    }),
    ("a cell twice", |r| {
        let first = r.cells[..3].to_vec();
        r.cells.to_mut()[3..6].copy_from_slice(&first);
    }),
    ("a cell of other points", |r| {
        r.cells.to_mut()[0] = (r.cells[0] + 13) % r.points.len() as u32;
    }),
    ("a cell missing", |r| {
        let (cells, values) = (r.cells.to_mut(), r.on_cells[0].values.to_mut());
        cells.truncate(cells.len() - 3);
        values.truncate(values.len() - 2);
    }),
];

#[test]
fn every_fault_is_seen_from_either_side() {
    let whole = results("a", 5, false);
    assert_eq!(verdict(&whole, &permuted(&whole)), Some(Verdict::Agree));
    for (name, fault) in FAULTS {
        for base in [whole.clone(), permuted(&whole)] {
            let mut faulty = base;
            faulty.source = "faulty".into();
            fault(&mut faulty);
            for judged in [verdict(&whole, &faulty), verdict(&faulty, &whole)] {
                assert_ne!(judged, Some(Verdict::Agree), "{name}");
            }
        }
    }
}

#[test]
fn discontinuous_data_show_the_same_faults() {
    let whole = results("a", 5, true);
    for (name, fault) in FAULTS {
        let mut faulty = permuted(&whole);
        fault(&mut faulty);
        assert_ne!(verdict(&whole, &faulty), Some(Verdict::Agree), "{name}");
        assert_ne!(verdict(&faulty, &whole), Some(Verdict::Agree), "{name}");
    }
}

#[test]
fn the_reason_of_every_fault_is_told() {
    let whole = results("a", 5, false);
    let reason = |fault: fn(&mut Results)| {
        let mut faulty = whole.clone();
        faulty.source = "b".into();
        fault(&mut faulty);
        let comparison = compare(&whole, &faulty, None).unwrap();
        let first = comparison
            .fields
            .iter()
            .find(|f| f.field.verdict != Verdict::Agree);
        first
            .and_then(|f| f.field.reason.clone())
            .unwrap_or_default()
    };
    assert!(reason(|r| r.on_points[0].values.to_mut()[2] = f64::NAN).contains("has 0.9"));
    assert_eq!(
        reason(|r| r.on_points[0].name = "w".into()),
        "b does not have it"
    );
    assert!(reason(|r| r.on_cells.clear()).contains("b has no field on cells"));
    let none = compare_results(
        &whole,
        &Results {
            on_points: vec![],
            on_cells: vec![],
            ..whole.clone()
        },
        &Tolerances {
            of_all: Tolerance {
                rtol: 1.0,
                atol: 0.0,
            },
            of_field: vec![],
            is_given: true,
        }
        .into(),
    );
    assert!(
        none.unwrap_err()
            .to_string()
            .contains("has no field to compare")
    );
}

#[test]
fn all_values_that_are_not_finite_are_counted() {
    let whole = results("a", 5, false);
    let mut b = whole.clone();
    b.on_points[0].values.to_mut()[2] = f64::NAN;
    b.on_points[0].values.to_mut()[9] = f64::INFINITY;
    b.on_points[0].values.to_mut()[11] += 1.0;
    let comparison = compare(&whole, &b, None).unwrap();
    assert_eq!(comparison.fields[0].field.beyond, 3);
}

#[test]
fn a_place_that_is_ambiguous_is_refused() {
    // Two points of one cell at the same place; two points of a cloud at the same place.
    let a = results("a", 3, false);
    let mut b = permuted(&a);
    b.points.to_mut()[b.cells[1] as usize] = b.points[b.cells[0] as usize];
    let error = compare(&a, &b, Some(MatchBy::Coordinates))
        .unwrap_err()
        .to_string();
    assert!(error.contains("ambiguous"), "{error}");
    let cloud = |source: &str| Results {
        width: 0,
        cells: Vec::new().into(),
        on_cells: Vec::new(),
        ..results(source, 3, false)
    };
    let (mut a, mut b) = (cloud("a"), cloud("b"));
    (a.points.to_mut()[3], b.points.to_mut()[3]) = (a.points[4], b.points[4]);
    let error = compare(&a, &b, Some(MatchBy::Coordinates))
        .unwrap_err()
        .to_string();
    assert!(error.contains("ambiguous"), "{error}");
}

#[test]
fn tolerances_are_those_of_the_field_its_scale_and_a_floor() {
    let a = results("a", 4, false);
    let mut b = a.clone();
    b.on_points[0]
        .values
        .to_mut()
        .iter_mut()
        .for_each(|v| *v *= 1.0 + 1e-7);
    let judged = |rtol: f64, atol: f64, of_field: Vec<(String, Tolerance)>| {
        let of_all = Tolerance { rtol, atol };
        compare_results(
            &a,
            &b,
            &Tolerances {
                of_all,
                of_field,
                is_given: true,
            }
            .into(),
        )
        .unwrap()
        .verdict
    };
    assert_eq!(judged(1e-6, 0.0, vec![]), Verdict::Agree);
    assert_eq!(judged(1e-8, 0.0, vec![]), Verdict::Disagree);
    assert_eq!(judged(0.0, 1e-6, vec![]), Verdict::Agree);
    assert_eq!(judged(0.0, 1e-8, vec![]), Verdict::Disagree);
    assert_eq!(judged(1e-12, 1e-6, vec![]), Verdict::Agree);
    let own = |rtol| vec![("u".to_owned(), Tolerance { rtol, atol: 0.0 })];
    assert_eq!(judged(1e-9, 0.0, own(1e-6)), Verdict::Agree);
    assert_eq!(judged(1e-6, 0.0, own(1e-9)), Verdict::Disagree);
    let of_all = Tolerance {
        rtol: 1.0,
        atol: 0.0,
    };
    let of_field = vec![("w".to_owned(), of_all)];
    assert!(
        compare_results(
            &a,
            &b,
            &Tolerances {
                of_all,
                of_field,
                is_given: true
            }
            .into()
        )
        .is_err()
    );

    // Values that are noise on the field's scale are judged with an absolute tolerance, or not at all.
    let (mut a, mut b) = (a.clone(), a.clone());
    a.on_points[0].values.to_mut().fill(1e-17);
    b.on_points[0].values.to_mut().fill(0.0);
    assert_eq!(verdict(&a, &b), Some(Verdict::Disagree));
    a.on_points[0].scaled_by = Some("v".into());
    b.on_points[0].scaled_by = Some("v".into());
    for side in [&mut a, &mut b] {
        let points = side.points.len();
        side.on_points.push(field("v", 1, vec![1.0; points]));
    }
    assert_eq!(verdict(&a, &b), Some(Verdict::Agree));
    assert!(PADDING as usize > a.points.len());
}

#[test]
fn a_vector_of_the_plane_may_have_a_third_component_that_is_zero() {
    let a = results("a", 4, false);
    let mut b = permuted(&a);
    let with_third = |values: &[f64], third: f64| -> Vec<f64> {
        let vectors = values.chunks_exact(2);
        vectors.flat_map(|v| [v[0], v[1], third]).collect()
    };
    let two = b.on_cells[0].values.clone();
    b.on_cells[0].components = 3;
    b.on_cells[0].values = with_third(&two, 0.0).into();
    assert_eq!(verdict(&a, &b), Some(Verdict::Agree));
    assert_eq!(verdict(&b, &a), Some(Verdict::Agree));
    b.on_cells[0].values = with_third(&two, 1e-3).into();
    assert_eq!(verdict(&a, &b), Some(Verdict::Disagree));
    assert_eq!(verdict(&b, &a), Some(Verdict::Disagree));
    // In 3D a component is missing.
    let (mut a, mut b) = (a, b);
    b.on_cells[0].values = with_third(&two, 0.0).into();
    (a.space, b.space) = (3, 3);
    assert_eq!(verdict(&a, &b), Some(Verdict::Undetermined));
}

#[test]
fn nan_may_be_expected_on_both_sides_and_never_on_one() {
    let a = results("a", 3, false);
    let with = |at: &[usize]| {
        let mut side = a.clone();
        at.iter()
            .for_each(|k| side.on_points[0].values.to_mut()[*k] = f64::NAN);
        side
    };
    let judged = |a: &Results, b: &Results, names: &[&str]| {
        let settings = Settings {
            nan_equal: names.iter().map(|&name| name.into()).collect(),
            ..Settings::default()
        };
        let compared = compare_results(a, b, &settings).unwrap();
        compared.fields[0].field.verdict
    };
    assert_eq!(judged(&with(&[2]), &with(&[2]), &[]), Verdict::Disagree);
    assert_eq!(judged(&with(&[2]), &with(&[2]), &["q"]), Verdict::Disagree);
    assert_eq!(judged(&with(&[2]), &with(&[2]), &["u"]), Verdict::Agree);
    assert_eq!(
        judged(&with(&[2]), &with(&[2, 3]), &["u"]),
        Verdict::Disagree
    );
    assert_eq!(
        judged(&with(&[2, 3]), &with(&[2]), &["*"]),
        Verdict::Disagree
    );
    let all: Vec<usize> = (0..16).collect();
    assert_eq!(
        judged(&with(&all), &with(&all), &["u"]),
        Verdict::Undetermined
    );
}

/// The same corners in a different cyclic order are another cell, which is folded if the first is not.
#[test]
fn a_quadrangle_with_two_corners_exchanged_is_another_cell() {
    let quadrangle = |corners: [u32; 4]| Results {
        source: "q".into(),
        space: 2,
        points: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]].into(),
        width: 4,
        cells: corners.to_vec().into(),
        kinds: vec![(faceoff_mesh::CellKind::Quadrangle, 1)],
        on_points: vec![field("u", 1, vec![1.0, 2.0, 3.0, 4.0])],
        ..Results::default()
    };
    let whole = quadrangle([0, 1, 2, 3]);
    for turned in [[1, 2, 3, 0], [3, 2, 1, 0]] {
        assert_eq!(verdict(&whole, &quadrangle(turned)), Some(Verdict::Agree));
    }
    for folded in [[0, 2, 1, 3], [0, 1, 3, 2]] {
        let error = compare(&whole, &quadrangle(folded), None).unwrap_err();
        assert!(error.to_string().contains("is folded"), "{error}");
        let by_vertices = compare(&whole, &quadrangle(folded), Some(MatchBy::Vertices));
        assert!(
            by_vertices
                .unwrap_err()
                .to_string()
                .contains("1 of 1 cells")
        );
    }
}
