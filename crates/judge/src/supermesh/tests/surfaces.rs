//! Functions on surfaces in space: against functions in the plane, and against formulas on spheres.

use std::f64::consts::PI;

use faceoff_mesh::CellKind;
use faceoff_mesh::field::Results;

use super::{broken, broken_nodes, compare, field, grid, norms, tetrahedron, triangle, with};
use crate::{Comparison, Verdict, derive, error_against};

/// A rotation about (1, 2, 3)/√14 by an angle, by Rodrigues' formula.
fn turned(x: [f64; 3], angle: f64) -> [f64; 3] {
    let axis = [1.0, 2.0, 3.0].map(|k: f64| k / 14.0_f64.sqrt());
    let (sin, cos) = angle.sin_cos();
    let across = super::super::clip::cross(&axis, &x);
    let along = super::super::clip::dot(&axis, &x);
    [0, 1, 2].map(|k| cos * x[k] + sin * across[k] + (1.0 - cos) * along * axis[k])
}

/// The faces of an octahedron in n² triangles each, moved to the unit sphere and turned by an angle.
fn sphere(n: usize, angle: f64) -> Vec<Vec<[f64; 3]>> {
    let mut cells = Vec::new();
    for octant in 0..8 {
        let sign = [0, 1, 2].map(|k| if octant >> k & 1 == 0 { 1.0 } else { -1.0 });
        let at = |i: usize, j: usize| {
            let x = [i, j, n - i - j].map(|k| k as f64 / n as f64);
            let length = x.iter().map(|x| x * x).sum::<f64>().sqrt();
            turned([0, 1, 2].map(|k| sign[k] * x[k] / length), angle)
        };
        let mut add = |corners: [[f64; 3]; 3]| {
            let mut cell = corners.to_vec();
            // Normals point outwards in every octant.
            if sign.iter().product::<f64>() < 0.0 {
                cell.swap(1, 2);
            }
            cells.push(cell);
        };
        for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
            add([at(i, j), at(i + 1, j), at(i, j + 1)]);
            if i + j + 1 < n {
                add([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    cells
}

fn on_surface(source: &str, kind: CellKind, cells: &[Vec<[f64; 3]>]) -> Results {
    Results {
        space: 3,
        ..broken(source, kind, cells)
    }
}

fn distance(found: &Comparison) -> f64 {
    found.intersection.as_ref().unwrap().distance.unwrap()
}

fn domain_agrees(found: &Comparison) -> bool {
    let all = found.fields.iter();
    !all.map(|f| &f.field).any(|f| f.field == "domain")
}

/// Norms, maxima and their places in a square that is turned in space are those in the plane, of triangles and quadrangles.
#[test]
fn a_plane_in_space_is_like_the_plane() {
    let f = |x: &[f64; 3]| 1.0 + x[0] * x[0] - 2.0 * x[0] * x[1];
    let g = |x: &[f64; 3]| (3.0 * x[0] + x[1]).sin();
    let quadrangles: Vec<Vec<[f64; 3]>> = (0..9)
        .map(|k| {
            let at = |i: usize, j: usize| {
                let x = [i, j].map(|k| k as f64 / 3.0);
                let bump = 4.0 * x[0] * (1.0 - x[0]) * x[1] * (1.0 - x[1]);
                [x[0] + 0.2 * bump, x[1] - 0.1 * bump, 0.0]
            };
            let (i, j) = (k % 3, k / 3);
            vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]
        })
        .collect();
    for (kind, cells) in [
        (triangle(1), grid(2, 4, 5, |x| x)),
        (triangle(2), grid(2, 3, 5, |x| x)),
        (CellKind::Quadrangle, quadrangles),
    ] {
        let a = with(broken("a", triangle(2), &grid(2, 5, 3, |x| x)), "u", f);
        let b = with(broken("b", kind, &cells), "u", g);
        let plane = compare(&a, &b).unwrap();
        let lift = |side: &Results| {
            let points = side.points.iter().map(|x| turned(*x, 0.7));
            Results {
                space: 3,
                points: points.collect(),
                ..side.clone()
            }
        };
        let space = compare(&lift(&a), &lift(&b)).unwrap();
        let [p, q] = [&plane, &space].map(|found| norms(found, "u"));
        for (p, q) in [
            (p.l2, q.l2),
            (p.l2_scale, q.l2_scale),
            (p.h1.unwrap(), q.h1.unwrap()),
        ] {
            assert!((p - q).abs() < 1e-12 * p, "{kind}: {p} {q}");
        }
        let [p, q] = [&plane, &space].map(|found| found.fields[0].field.clone());
        assert!((p.max_abs - q.max_abs).abs() < 1e-12, "{p:?} {q:?}");
        let place = p.worst.unwrap().midpoint;
        let expected = turned([place[0], place[1], 0.0], 0.7);
        let place = q.worst.unwrap().midpoint;
        assert!((0..3).all(|k| (place[k] - expected[k]).abs() < 1e-9));
        assert!(distance(&space) < 1e-15 && domain_agrees(&space));
        assert!(plane.intersection.unwrap().distance.is_none());
    }
}

/// x₀ is itself on both, so that its values differ by no more than the distance of the surfaces, which is of second order.
#[test]
fn spheres_of_other_triangles_are_one_surface() {
    let mut before = f64::INFINITY;
    for n in [6, 12] {
        let of = |n: usize, angle: f64| {
            with(on_surface("s", triangle(1), &sphere(n, angle)), "u", |x| {
                x[0]
            })
        };
        let (a, b) = (of(n, 0.0), of(n + 1, 0.4));
        for (a, b) in [(&a, &b), (&b, &a)] {
            let found = compare(a, b).unwrap();
            assert!(domain_agrees(&found), "{n}: {:?}", found.fields);
            let (apart, u) = (distance(&found), &found.fields[0].field);
            assert!(
                u.max_abs <= apart * (1.0 + 1e-9) && u.max_abs > 0.5 * apart,
                "{apart} {u:?}"
            );
            let size = norms(&found, "u").l2_scale;
            let exact = (4.0 * PI / 3.0).sqrt();
            assert!(
                (size / exact - 1.0).abs() < 4.0 / (n * n) as f64,
                "{n}: {size}"
            );
            let common = found.intersection.unwrap();
            assert!(
                (common.common / common.measures[0] - 1.0).abs() < 1e-12,
                "{common:?}"
            );
            assert!(common.alone.iter().all(|of| *of < 1e-12), "{common:?}");
        }
        let apart = distance(&compare(&a, &b).unwrap());
        // Triangles with an edge h are h²/6 from a sphere in the middle, and others have corners there.
        assert!(apart < 0.33 * before, "{n}: {apart} {before}");
        before = apart;
    }
}

/// Cells of six nodes lie nearer the sphere, and their functions are compared as well.
#[test]
fn curved_cells_are_surfaces() {
    let curved = |n: usize, angle: f64| {
        let onto = |x: [f64; 3]| {
            let length = x.iter().map(|x| x * x).sum::<f64>().sqrt();
            x.map(|x| x / length)
        };
        let middle = |p: [f64; 3], q: [f64; 3]| onto([0, 1, 2].map(|k| p[k] + q[k]));
        let cells = sphere(n, angle).into_iter().map(|c| {
            let middles = [middle(c[0], c[1]), middle(c[1], c[2]), middle(c[2], c[0])];
            [&c[..], &middles].concat()
        });
        let cells: Vec<_> = cells.collect();
        let side = Results {
            space: 3,
            ..broken_nodes("c", triangle(2), &cells)
        };
        with(side, "u", |x| x[0] * x[1])
    };
    let found = compare(&curved(6, 0.0), &curved(7, 0.4)).unwrap();
    assert!(domain_agrees(&found), "{:?}", found.fields);
    let u = norms(&found, "u");
    // ∫ x² y² on the unit sphere is 4π/15.
    assert!(
        (u.l2_scale / (4.0 * PI / 15.0).sqrt() - 1.0).abs() < 0.02,
        "{u:?}"
    );
    assert!(u.l2 < 0.01 * u.l2_scale, "{u:?}");
}

/// Errors against x₀ x₁ on the sphere, whose tangential gradient has the square x₀² + x₁² - 4 x₀² x₁², are of second and first order.
#[test]
fn errors_on_a_sphere_have_their_orders() {
    let zero = |_: [f64; 3], _: usize| (0.0, [0.0; 3]);
    let exact = |x: [f64; 3], _: usize| (x[0] * x[1], [x[1], x[0], 0.0]);
    let of = |n: usize| {
        let side = with(on_surface("s", triangle(1), &sphere(n, 0.3)), "u", |x| {
            x[0] * x[1]
        });
        let size = error_against(&side, "u", 1, &zero).unwrap();
        let gradient = (8.0 * PI / 3.0 - 16.0 * PI / 15.0).sqrt();
        let found = error_against(&side, "u", 1, &exact).unwrap();
        assert!(size.h1.is_some() && (found.h1_scale.unwrap() / gradient - 1.0).abs() < 0.1);
        (found.l2, found.h1.unwrap())
    };
    let ((p, q), (r, s)) = (of(8), of(16));
    assert!((3.4..4.6).contains(&(p / r)), "{p} {r}");
    assert!((1.8..2.2).contains(&(q / s)), "{q} {s}");
}

/// The divergence of x along a surface is 2, whatever its triangles; it has no curl here.
#[test]
fn the_divergence_is_tangential() {
    let mut side = on_surface("s", triangle(1), &sphere(3, 0.2));
    let values = side.points.concat();
    side.on_points.push(field("x", 3, values));
    assert!(derive(&mut side, "div(x)", None).unwrap());
    let div = &side.on_cells[0].values;
    assert!(
        div.len() == 72 && div.iter().all(|v| (v - 2.0).abs() < 1e-12),
        "{div:?}"
    );
    let refused = derive(&mut side, "curl(x)", None).unwrap_err().to_string();
    assert!(refused.contains("surface in space"), "{refused}");
}

/// Cells that turn the other way, one by one, make no difference; a missing one does, on either side.
#[test]
fn what_is_missing_is_found_and_what_is_turned_is_not() {
    let cells = sphere(6, 0.0);
    let u = |cells: &[Vec<[f64; 3]>]| with(on_surface("s", triangle(1), cells), "u", |x| x[2]);
    let (a, b) = (u(&cells), u(&sphere(8, 0.5)));
    let whole = compare(&a, &b).unwrap();
    let mixed = cells.iter().enumerate().map(|(k, cell)| match k % 3 {
        0 => vec![cell[0], cell[2], cell[1]],
        _ => cell.clone(),
    });
    let mixed: Vec<Vec<[f64; 3]>> = mixed.collect();
    let found = compare(&u(&mixed), &b).unwrap();
    assert!(domain_agrees(&found) && (distance(&found) - distance(&whole)).abs() < 1e-12);
    assert!((norms(&found, "u").l2 - norms(&whole, "u").l2).abs() < 1e-12);
    let hole = u(&cells[1..]);
    for (a, b) in [(&hole, &b), (&b, &hole)] {
        let found = compare(a, b).unwrap();
        let row = found
            .fields
            .iter()
            .find(|f| f.field.field == "domain")
            .unwrap();
        assert_eq!(row.field.verdict, Verdict::Disagree);
        assert!(
            row.field
                .reason
                .as_ref()
                .unwrap()
                .contains("tenth of the cells' size")
        );
        let size = super::super::clip::cross(
            &[0, 1, 2].map(|k| cells[0][1][k] - cells[0][0][k]),
            &[0, 1, 2].map(|k| cells[0][2][k] - cells[0][0][k]),
        );
        let size = 0.5 * size.iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!(
            (row.field.max_abs / size - 1.0).abs() < 0.1,
            "{} {size}",
            row.field.max_abs
        );
    }
}

/// Two sheets that end in a sharp edge, with other values, are not mixed up near it; and other surfaces are not this one.
#[test]
fn sheets_are_kept_apart() {
    // The upper and the lower side of a wing with an angle of 4°.
    let wing = |n: usize, seed: u64| {
        let mut cells = grid(2, n, seed, |[x, y, _]| [x, y, 0.035 * x]);
        let lower = grid(2, n, seed, |[x, y, _]| [x, y, -0.035 * x]);
        cells.extend(lower.into_iter().map(|c| vec![c[0], c[2], c[1]]));
        let mut side = on_surface("w", triangle(1), &cells);
        let half = cells.len() / 2;
        side.on_cells.push(field(
            "side",
            1,
            (0..cells.len())
                .map(|k| if k < half { 1.0 } else { -1.0 })
                .collect(),
        ));
        side
    };
    let found = compare(&wing(4, 3), &wing(5, 5)).unwrap();
    assert_eq!(
        found.fields[0].field.verdict,
        Verdict::Agree,
        "{:?}",
        found.fields
    );
    assert!(domain_agrees(&found) && distance(&found) < 1e-12);
    // Two layers that turn the same way are not one, although their values are.
    let layers = |heights: &[f64], n: usize| {
        // Along the normal, so that their projections have the same boundary.
        let layer = |by: &f64| grid(2, n, 3, |[x, y, _]| [x - 0.1 * by, y, 0.1 * x + by]);
        let all = heights.iter().map(layer);
        let cells = all.collect::<Vec<_>>().concat();
        with(on_surface("l", triangle(1), &cells), "u", |_| 1.0)
    };
    let (one, two) = (layers(&[0.0], 4), layers(&[0.0, 0.005], 5));
    for (a, b) in [(&one, &two), (&two, &one)] {
        let found = compare(a, b).unwrap();
        assert!(!domain_agrees(&found), "{:?}", found.intersection);
        assert_eq!(found.fields[0].field.verdict, Verdict::Agree);
    }
    let s = |factor: f64, n: usize| {
        let cells: Vec<Vec<[f64; 3]>> = sphere(n, 0.0)
            .into_iter()
            .map(|c| c.into_iter().map(|x| x.map(|x| factor * x)).collect())
            .collect();
        with(on_surface("s", triangle(1), &cells), "u", |_| 1.0)
    };
    let refused = compare(&s(1.0, 8), &s(1.2, 9)).unwrap_err().to_string();
    assert!(refused.contains("nothing in common"), "{refused}");
    let plane = with(broken("p", triangle(1), &grid(2, 3, 3, |x| x)), "u", |_| {
        1.0
    });
    let refused = compare(&s(1.0, 8), &plane).unwrap_err().to_string();
    assert!(
        refused.contains("one mesh is a surface in space"),
        "{refused}"
    );
    let solid = with(
        broken("v", tetrahedron(1), &grid(3, 2, 3, |x| x)),
        "u",
        |_| 1.0,
    );
    assert!(compare(&s(1.0, 8), &solid).is_err());
    // Cells on top of each other are refused, although both have a plane of their own.
    let mut twice = sphere(4, 0.0);
    twice.push(twice[5].clone());
    let twice = with(on_surface("t", triangle(1), &twice), "u", |_| 1.0);
    let refused = compare(&twice, &s(1.0, 8)).unwrap_err().to_string();
    assert!(refused.contains("overlap"), "{refused}");
}
