//! What two meshes and their functions do not have in common is found, located, and reported or refused.

use super::*;

/// A disk as polygons of 8 and 16 sides: the areas are n/2 sin(2π/n), and the smaller one lies in the larger one.
#[test]
fn what_one_mesh_covers_alone_is_told() {
    let disk = |n: usize| {
        let at = |k: usize| {
            let (y, x) = (2.0 * std::f64::consts::PI * (k % n) as f64 / n as f64).sin_cos();
            [x, y, 0.0]
        };
        let cells: Vec<_> = (0..n).map(|k| vec![[0.0; 3], at(k), at(k + 1)]).collect();
        with(broken(&format!("disk{n}"), triangle(1), &cells), "u", |x| {
            x[0]
        })
    };
    let area = |n: f64| n / 2.0 * (2.0 * std::f64::consts::PI / n).sin();
    let (a, b) = (disk(8), disk(16));
    let compared = compare(&a, &b).unwrap();
    let found = compared.intersection.clone().unwrap();
    assert!((found.common - area(8.0)).abs() < 1e-14);
    assert!(found.alone[0] < 1e-15 && (found.alone[1] - (area(16.0) - area(8.0))).abs() < 1e-14);
    // u agrees where both are; the domains do not.
    let verdicts: Vec<_> = compared
        .fields
        .iter()
        .map(|f| (f.on, f.field.verdict))
        .collect();
    assert_eq!(
        verdicts,
        [
            (On::Functions, Verdict::Agree),
            (On::Domain, Verdict::Disagree)
        ]
    );
    assert_eq!(compared.verdict, Verdict::Disagree);
    assert!(
        compared.fields[1]
            .field
            .reason
            .as_ref()
            .unwrap()
            .contains("16 of 16 cells of disk16")
    );
    let settings = |alone| Settings {
        map: Some(MatchBy::Functions),
        alone: Some(alone),
        ..Settings::default()
    };
    let allowed = |alone| compare_results(&a, &b, &settings(alone)).unwrap().verdict;
    assert_eq!(
        [allowed(0.08), allowed(0.07)],
        [Verdict::Agree, Verdict::Disagree]
    );
    // Nothing in common, another plane, another dimension.
    let mut other = disk(8);
    other.points.to_mut().iter_mut().for_each(|x| x[0] += 3.0);
    assert!(
        compare(&a, &other)
            .unwrap_err()
            .to_string()
            .contains("nothing in common")
    );
    let mut other = disk(8);
    other.points.to_mut().iter_mut().for_each(|x| x[2] = 1.0);
    assert!(
        compare(&a, &other)
            .unwrap_err()
            .to_string()
            .contains("z = 0, the other in z = 1")
    );
    let solid = with(
        broken("solid", tetrahedron(1), &grid(3, 1, 1, |x| x)),
        "u",
        |x| x[0],
    );
    assert!(
        compare(&a, &solid)
            .unwrap_err()
            .to_string()
            .contains("dimension 2, the other of 3")
    );
}

#[test]
fn meshes_that_overlap_themselves_are_refused() {
    for dim in [2, 3] {
        let kind = if dim == 2 {
            triangle(1)
        } else {
            tetrahedron(1)
        };
        let good = with(broken("good", kind, &grid(dim, 3, 1, |x| x)), "u", |x| x[0]);
        let refused = |cells: &[Vec<[f64; 3]>], words: &str| {
            let bad = with(broken("bad", kind, cells), "u", |x| x[0]);
            for (a, b) in [(&good, &bad), (&bad, &good)] {
                let error = compare(a, b).unwrap_err().to_string();
                assert!(
                    error.contains("mesh bad") && error.contains(words),
                    "{error}"
                );
            }
        };
        // One cell twice; a fold, where a corner is moved across the opposite side; a flat cell.
        let mut cells = grid(dim, 3, 1, |x| x);
        cells.push(cells[4].clone());
        refused(&cells, "overlap");
        let folded = grid(dim, 3, 1, |x| {
            let inside = (0..dim).all(|k| x[k] > 0.3 && x[k] < 0.4);
            if inside {
                [0.8, 0.8, if dim == 3 { 0.8 } else { 0.0 }]
            } else {
                x
            }
        });
        refused(&folded, "overlap");
        let mut cells = grid(dim, 3, 1, |x| x);
        cells[2][1] = cells[2][0];
        refused(&cells, "cell 2");
    }
}

#[test]
fn a_difference_on_a_single_cell_is_found_and_named() {
    for dim in [2, 3] {
        let kinds = |order| {
            if dim == 2 {
                triangle(order)
            } else {
                tetrahedron(order)
            }
        };
        let f = |x: &[f64; 3]| 1.0 + x[0];
        let a = with(broken("a", kinds(1), &grid(dim, 3, 1, |x| x)), "u", f);
        let mut b = with(
            broken("b", kinds(2), &grid(dim, 4, 5, bent(dim, 0.05))),
            "u",
            f,
        );
        let width = b.width;
        b.on_points[0].values.to_mut()[width * 7] += 1e-6;
        let compared = compare(&a, &b).unwrap();
        let u = &compared.fields[0].field;
        let worst = u.worst.as_ref().unwrap();
        assert_eq!((u.verdict, worst.cells.unwrap()[1]), (Verdict::Disagree, 7));
        assert!((u.max_abs - 1e-6).abs() < 1e-12, "{u:?}");
        let place = b.points[width * 7];
        assert!((0..dim).all(|k| (worst.midpoint[k] - place[k]).abs() < 1e-12));
        // A NaN is never a pass, wherever it is.
        b.on_points[0].values.to_mut()[width * 7] = f64::NAN;
        let compared = compare(&a, &b).unwrap();
        let u = &compared.fields[0].field;
        assert_eq!((u.verdict, u.max_abs.is_nan()), (Verdict::Disagree, true));
        assert!(
            u.reason
                .as_ref()
                .unwrap()
                .contains("cell 7 of the second NaN"),
            "{u:?}"
        );
    }
}

/// Values on cells that jump, on a mesh and on a finer one within it, turned so that no side is where the other's is but for
/// rounding: a neighbouring cell is not taken for the cell.
#[test]
fn a_jump_between_cells_is_no_difference() {
    for dim in [2, 3] {
        let kind = |order| {
            if dim == 2 {
                triangle(order)
            } else {
                tetrahedron(order)
            }
        };
        for angle in [0.0, 0.3, 1.234] {
            let (sin, cos) = f64::sin_cos(angle);
            let turn = |x: [f64; 3]| {
                [
                    cos * x[0] - sin * x[1],
                    sin * x[0] + cos * x[1],
                    x[2] + 0.1 * x[0],
                ]
            };
            let flat = |x: [f64; 3]| {
                if dim == 2 {
                    [turn(x)[0], turn(x)[1], 0.0]
                } else {
                    turn(x)
                }
            };
            // Kuhn's division of cubes is finer within itself.
            let coarse = grid(dim, 3, 0, flat);
            let fine = grid(dim, 6, 0, flat);
            let centre = |cell: &[[f64; 3]]| -> [f64; 3] {
                [0, 1, 2].map(|k| cell.iter().map(|x| x[k]).sum::<f64>() / cell.len() as f64)
            };
            let inside = |x: &[f64; 3], cell: &[[f64; 3]]| {
                let mut of = [[0.0; 3]; 4];
                of[..=dim].copy_from_slice(cell);
                let size = crate::supermesh::measure(dim, &of);
                (0..=dim).all(|i| {
                    let mut with = of;
                    with[i] = *x;
                    crate::supermesh::measure(dim, &with) * size > 0.0
                })
            };
            let parent = |cell: &Vec<[f64; 3]>| {
                let found = coarse.iter().position(|of| inside(&centre(cell), of));
                found.unwrap() as f64
            };
            let mut a = broken("a", kind(1), &coarse);
            a.on_cells
                .push(field("c", 1, (0..coarse.len()).map(|k| k as f64).collect()));
            let mut b = broken("b", kind(1), &fine);
            b.on_cells
                .push(field("c", 1, fine.iter().map(parent).collect()));
            for (one, two) in [(&a, &b), (&b, &a), (&a, &a.clone())] {
                let compared = compare(one, two).unwrap();
                assert_eq!(
                    (compared.verdict, compared.fields.len()),
                    (Verdict::Agree, 1),
                    "{compared:?}"
                );
                assert_eq!(compared.fields[0].field.max_abs, 0.0);
                let found = norms(&compared, "c");
                assert!(found.l2 < 1e-7 * found.l2_scale, "{found:?}");
            }
        }
    }
}

/// What is small compared with another body is not small: each connected part has its own scale.
#[test]
fn a_small_body_is_judged_on_its_own_scale() {
    let bodies = |n: usize, off: f64| {
        let large = grid(2, n, 1, |x| x);
        let small = grid(2, n, 1, |x| [5.0 + x[0], x[1], 0.0]);
        let u = |x: &[f64; 3]| if x[0] > 4.0 { 1e-6 + off * x[1] } else { 1.0 };
        with(
            broken("bodies", triangle(1), &[large, small].concat()),
            "u",
            u,
        )
    };
    assert_eq!(
        compare(&bodies(2, 0.0), &bodies(3, 0.0)).unwrap().verdict,
        Verdict::Agree
    );
    let compared = compare(&bodies(2, 0.0), &bodies(3, 1e-13)).unwrap();
    assert_eq!(compared.verdict, Verdict::Disagree);
    assert!(compared.fields[0].field.worst.as_ref().unwrap().midpoint[0] > 4.0);
}

/// Cells no larger than the rounding that six digits allow: one that is missing, or there twice, is not taken for rounding.
#[test]
fn a_cell_as_small_as_the_rounding_is_a_cell() {
    let mesh = |leave: Option<usize>, twice: bool| {
        let mut cells = grid(2, 1, 1, |x| x);
        let mut small = grid(2, 2, 1, |x| [2.0 + 2e-5 * x[0], 2e-5 * x[1], 0.0]);
        leave.map(|k| small.remove(k));
        if twice {
            small.push(small[0].clone());
        }
        cells.extend(small);
        with(broken("digits", triangle(1), &cells), "u", |x| x[0])
    };
    let whole = mesh(None, false);
    assert_eq!(
        compare(&whole, &mesh(None, false)).unwrap().verdict,
        Verdict::Agree
    );
    let compared = compare(&whole, &mesh(Some(3), false)).unwrap();
    let rows: Vec<On> = compared.fields.iter().map(|f| f.on).collect();
    assert_eq!(
        (compared.verdict, rows),
        (Verdict::Disagree, vec![On::Functions, On::Domain])
    );
    assert!(compare(&whole, &mesh(None, true)).is_err());
}
