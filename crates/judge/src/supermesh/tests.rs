//! Functions on two meshes of one domain: against integrals that are known, and polynomials that both have exactly.

mod differing;
mod hexahedra;
mod prisms;
mod pyramids;
mod surfaces;

use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};

use crate::{
    Comparison, MatchBy, Norms, On, Settings, Tolerance, Tolerances, Verdict, compare_results,
    project,
};
use faceoff_mesh::CellKind;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::{ResultField, Results};

use super::element::Element;

/// Cells of one kind; every cell has nodes of its own, by its element.
fn broken(source: &str, kind: CellKind, corners: &[Vec<[f64; 3]>]) -> Results {
    let nodes = Element::new(kind).unwrap().nodes;
    broken_at(source, kind, corners, &nodes)
}

/// The same with nodes at these places of the reference cell.
fn broken_at(
    source: &str,
    kind: CellKind,
    corners: &[Vec<[f64; 3]>],
    nodes: &[[f64; 3]],
) -> Results {
    let place = |cell: &Vec<[f64; 3]>, node: &[f64; 3]| match cell.len() {
        // Bilinear.
        4 if kind.dim() == 2 => {
            let [x, y, _] = *node;
            let weights = [(1.0 - x) * (1.0 - y), x * (1.0 - y), x * y, (1.0 - x) * y];
            [0, 1, 2].map(|k| (0..4).map(|i| weights[i] * cell[i][k]).sum())
        }
        _ => [0, 1, 2].map(|k| {
            let steps = (1..cell.len()).map(|i| node[i - 1] * (cell[i][k] - cell[0][k]));
            cell[0][k] + steps.sum::<f64>()
        }),
    };
    let cells = corners
        .iter()
        .map(|cell| nodes.iter().map(|node| place(cell, node)).collect());
    broken_nodes(source, kind, &cells.collect::<Vec<Vec<_>>>())
}

/// The same with all nodes of each cell.
fn broken_nodes(source: &str, kind: CellKind, cells: &[Vec<[f64; 3]>]) -> Results {
    let points = cells.concat();
    Results {
        source: source.into(),
        space: if kind.dim() == 2 { 2 } else { 3 },
        cells: (0..points.len() as u32).collect(),
        points: points.into(),
        width: kind.points(),
        kinds: vec![(kind, cells.len())],
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

fn with(mut results: Results, name: &str, f: impl Fn(&[f64; 3]) -> f64) -> Results {
    let values = results.points.iter().map(f).collect();
    results.on_points.push(field(name, 1, values));
    results
}

/// The unit square or cube in simplices, moved by `bend`: a grid with diagonals that alternate by `seed`.
fn grid(
    dim: usize,
    n: usize,
    seed: u64,
    bend: impl Fn([f64; 3]) -> [f64; 3],
) -> Vec<Vec<[f64; 3]>> {
    let at = |i: [usize; 3]| bend(i.map(|k| k as f64 / n as f64));
    let paths: &[[usize; 3]] = &[
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    let mut cells = Vec::new();
    for cube in 0..n.pow(dim as u32) {
        let base = [cube % n, cube / n % n, cube / n / n];
        if dim == 2 {
            let [a, b, c, d] =
                [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[i, j]| at([base[0] + i, base[1] + j, 0]));
            let turn = (cube as u64).wrapping_mul(seed) % 7 < 3;
            cells.extend(match turn {
                true => [vec![a, b, c], vec![a, c, d]],
                false => [vec![a, b, d], vec![b, c, d]],
            });
            continue;
        }
        for path in paths {
            let mut i = base;
            let mut cell = vec![at(i)];
            for axis in path {
                i[*axis] += 1;
                cell.push(at(i));
            }
            cells.push(cell);
        }
    }
    cells
}

fn compare(a: &Results, b: &Results) -> Result<Comparison> {
    let of_all = Tolerance {
        rtol: 1e-12,
        atol: 0.0,
    };
    let tolerances = Tolerances {
        of_all,
        of_field: Vec::new(),
        is_given: true,
    };
    let settings = Settings {
        map: Some(MatchBy::Functions),
        ..tolerances.into()
    };
    compare_results(a, b, &settings)
}

fn norms(comparison: &Comparison, name: &str) -> Norms {
    let found = comparison
        .fields
        .iter()
        .find(|f| f.field.field == name && f.on == On::Functions);
    found.and_then(|f| f.norms).unwrap()
}

fn triangle(order: usize) -> CellKind {
    CellKind::from_gmsh([2, 9, 21, 23, 25, 42][order - 1]).unwrap()
}

fn tetrahedron(order: usize) -> CellKind {
    CellKind::from_gmsh([4, 11, 29, 30, 31, 71][order - 1]).unwrap()
}

/// dolfinx puts the nodes of order 3 and more at the points of Gauss, Lobatto and Legendre, and writes them there.
#[test]
fn nodes_are_where_the_file_has_them() {
    let g = 0.5 - 0.05_f64.sqrt();
    let warped = |node: &[f64; 3]| {
        let on_edge = [node[0], node[1], 1.0 - node[0] - node[1]]
            .iter()
            .any(|x| x.abs() < 1e-9);
        let warp = |x: f64| match () {
            () if !on_edge || !(0.1..0.9).contains(&x) => x,
            () if x < 0.5 => g,
            () => 1.0 - g,
        };
        node.map(warp)
    };
    let lattice = Element::new(triangle(3)).unwrap().nodes;
    let nodes: Vec<[f64; 3]> = lattice.iter().map(warped).collect();
    assert_ne!(nodes, lattice);
    let cubic = |x: &[f64; 3]| x[0].powi(3) - 2.0 * x[0] * x[1] * x[1] + x[1];
    let a = with(
        broken_at("a", triangle(3), &grid(2, 3, 3, |x| x), &nodes),
        "u",
        cubic,
    );
    let b = with(broken("b", triangle(3), &grid(2, 4, 5, |x| x)), "u", cubic);
    for (a, b) in [(&a, &b), (&b, &a)] {
        let compared = compare(a, b).unwrap();
        let u = &compared.fields[0].field;
        assert_eq!(u.verdict, Verdict::Agree, "{u:?}");
        assert!(norms(&compared, "u").l2 < 1e-14);
        assert!(compared.intersection.unwrap().exact);
    }
}

/// a = x on one mesh and b = y on another: ∫ (x - y)² = 1/6 and |a - b|² in H¹ = 2 on the unit square; the maximum, 1, is at a
/// corner of the square.
#[test]
fn norms_are_those_known_in_closed_form() {
    let a = with(broken("a", triangle(1), &grid(2, 5, 3, |x| x)), "u", |x| {
        x[0]
    });
    for (kind, n) in [(triangle(1), 7), (triangle(3), 4)] {
        let b = with(broken("b", kind, &grid(2, n, 5, |x| x)), "u", |x| x[1]);
        let compared = compare(&a, &b).unwrap();
        let found = norms(&compared, "u");
        assert!(
            (found.l2 - (1.0_f64 / 6.0).sqrt()).abs() < 1e-14,
            "{found:?}"
        );
        assert!(
            (found.h1.unwrap() - 2.0_f64.sqrt()).abs() < 1e-12,
            "{found:?}"
        );
        assert!((found.l2_scale - (1.0_f64 / 3.0).sqrt()).abs() < 1e-14);
        let u = &compared.fields[0].field;
        let worst = u.worst.as_ref().unwrap();
        assert!((u.max_abs - 1.0).abs() < 1e-14, "{u:?}");
        assert!((worst.midpoint[0] - worst.midpoint[1]).abs() > 1.0 - 1e-14);
        assert_eq!((worst.a - worst.b).abs(), u.max_abs);
        assert_eq!((u.verdict, compared.fields.len()), (Verdict::Disagree, 1));
        let [i, j] = worst.cells.unwrap();
        for (side, cell) in [(&a, i), (&b, j)] {
            let nodes = side.cell(cell as usize).map(|p| side.points[p as usize]);
            let near = |x: [f64; 3]| (0..2).all(|k| (x[k] - worst.midpoint[k]).abs() < 1e-14);
            assert!(
                nodes.clone().any(near),
                "cell {cell} has the place as a corner"
            );
        }
        let found = compared.intersection.unwrap();
        assert!(
            (found.common - 1.0).abs() < 1e-14 && found.exact,
            "{found:?}"
        );
    }
    // P0: the halves of a square against thirds. ∫ (a - b)² = 2/3 · 0 + 1/3 · 1 …
    let cell = |x0: f64, x1: f64| {
        vec![
            [x0, 0.0, 0.0],
            [x1, 0.0, 0.0],
            [x1, 1.0, 0.0],
            [x0, 1.0, 0.0],
        ]
    };
    let quadrangles = |cuts: &[f64], values: &[f64]| {
        let cells: Vec<_> = cuts.windows(2).map(|w| cell(w[0], w[1])).collect();
        let mut side = broken("q", CellKind::Quadrangle, &cells);
        side.on_cells.push(field("c", 1, values.to_vec()));
        side
    };
    let a = quadrangles(&[0.0, 0.5, 1.0], &[1.0, 3.0]);
    let b = quadrangles(&[0.0, 1.0 / 3.0, 1.0], &[1.0, 2.0]);
    let compared = compare(&a, &b).unwrap();
    // Equal on [0, 1/3], 1 apart on the rest.
    let found = norms(&compared, "c");
    assert!(
        (found.l2 - (2.0_f64 / 3.0).sqrt()).abs() < 1e-15,
        "{found:?}"
    );
    assert_eq!((found.h1, compared.fields[0].field.max_abs), (None, 1.0));
    // In 3D: x against y z, ∫ (x - yz)² = 1/3 - 1/4 + 1/9, ∫ |∇|² = 1 + 2/3.
    let a = with(
        broken("a", tetrahedron(1), &grid(3, 3, 1, |x| x)),
        "u",
        |x| x[0],
    );
    let b = with(
        broken("b", tetrahedron(2), &grid(3, 2, 1, |x| x)),
        "u",
        |x| x[1] * x[2],
    );
    let found = norms(&compare(&a, &b).unwrap(), "u");
    let exact = (1.0_f64 / 3.0 - 0.25 + 1.0 / 9.0).sqrt();
    assert!((found.l2 - exact).abs() < 1e-14, "{found:?} {exact}");
    assert!((found.h1.unwrap() - (5.0_f64 / 3.0).sqrt()).abs() < 1e-12);
}

/// How far the inside of the unit square or cube is bent, its sides staying where they are.
fn bent(dim: usize, amount: f64) -> impl Fn([f64; 3]) -> [f64; 3] {
    move |x| {
        let bump: f64 = x[..dim].iter().map(|x| 4.0 * x * (1.0 - x)).product();
        let bump = amount * bump;
        [
            x[0] + bump,
            x[1] - 0.7 * bump,
            if dim == 3 { x[2] + 0.4 * bump } else { 0.0 },
        ]
    }
}

/// Polynomials that both meshes hold exactly are equal to rounding, whatever the cells: slivers, cells that share sides, one
/// mesh and a copy, moved, turned, small, large, far away.
#[test]
fn polynomials_are_equal_whatever_the_meshes() {
    let mut runner = TestRunner::new(ProptestConfig {
        cases: 120,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(2017),
        ..ProptestConfig::default()
    });
    let sizes = prop_oneof![Just(1e-8), Just(1.0), Just(1e8)];
    // Of the grid: none, exactly zero, and so small that cells nearly coincide.
    let bends = prop_oneof![Just(0.0), Just(1e-15), Just(1e-11), Just(1e-6), 0.0..0.12];
    let thin = prop_oneof![Just(1.0), Just(1e-3)];
    let far = prop_oneof![Just(0.0), Just(1.0), Just(1e5)];
    let meshes = (
        2..=3usize,
        1..5usize,
        1..5usize,
        (1..=4usize, 1..=4usize),
        (bends.clone(), bends),
    );
    let places = (0.0..7.0, sizes, thin, far, any::<u64>());
    runner
        .run(
            &(meshes, places),
            |((dim, n, m, orders, bends), (angle, size, thin, far, seed))| {
                let (n, m) = if dim == 3 {
                    (n.min(3), m.min(2))
                } else {
                    (n, m)
                };
                let (sin, cos) = f64::sin_cos(angle);
                let place = |x: [f64; 3]| {
                    let (u, v) = (x[0], thin * x[1]);
                    let z = if dim == 3 { size * (x[2] + far) } else { 0.0 };
                    [
                        size * (cos * u - sin * v + far),
                        size * (sin * u + cos * v - far),
                        z,
                    ]
                };
                let mesh = |source, n, order, bend: f64| {
                    let cells = grid(dim, n, seed, bent(dim, bend));
                    let cells: Vec<_> = cells
                        .into_iter()
                        .map(|c| c.into_iter().map(place).collect())
                        .collect();
                    let kind = if dim == 2 {
                        triangle(order)
                    } else {
                        tetrahedron(order)
                    };
                    broken(source, kind, &cells)
                };
                let degree = orders.0.min(orders.1) as i32;
                let f = |x: &[f64; 3]| {
                    let x = x.map(|x| x / size);
                    ((x[0] - far) - 0.6 * (x[1] + far) + 0.3 * x[2] + 0.5).powi(degree)
                };
                let a = with(mesh("a", n, orders.0, bends.0), "u", f);
                let b = with(mesh("b", m, orders.1, bends.1), "u", f);
                let compared = compare(&a, &b).map_err(|e| TestCaseError::fail(e.to_string()))?;
                let found = compared.intersection.clone().unwrap();
                let exact = thin * size.powi(dim as i32);
                // What rounding of the places does by itself, which is larger far away and in thin cells.
                let rounding = 1e-13 * (1.0 + far) / thin;
                prop_assert!(
                    (found.common / exact - 1.0).abs() < rounding,
                    "{found:?} {exact}"
                );
                let u = &compared.fields[0];
                prop_assert!(u.field.max_rel < 1e2 * rounding, "{:?}", u.field);
                let norms = u.norms.unwrap();
                prop_assert!(norms.l2 < 1e2 * rounding * norms.l2_scale, "{norms:?}");
                // A gradient in a thin cell is a difference over its height.
                let slope = norms.h1.unwrap();
                prop_assert!(
                    slope <= 1e4 * rounding / thin * norms.h1_scale.unwrap(),
                    "{norms:?}"
                );
                prop_assert!(compared.fields.len() == 1, "{:?}", compared.fields[1]);
                Ok(())
            },
        )
        .unwrap();
}

/// x y is bilinear, x² y² biquadratic; neither is a polynomial of low degree on triangles.
#[test]
fn quadrangles_are_exact_too() {
    let quadrangles = |n: usize, bend: f64| -> Vec<Vec<[f64; 3]>> {
        let at =
            |i: usize, j: usize| bent(2, bend)([i as f64 / n as f64, j as f64 / n as f64, 0.0]);
        let cells = (0..n * n).map(|k| (k % n, k / n));
        cells
            .map(|(i, j)| vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
            .collect()
    };
    let straight = with(
        broken("a", CellKind::Quadrangle, &quadrangles(3, 0.0)),
        "u",
        |x| x[0] * x[1],
    );
    let fine = with(
        broken("b", CellKind::Quadrangle9, &quadrangles(4, 0.0)),
        "u",
        |x| x[0] * x[1],
    );
    let compared = compare(&straight, &fine).unwrap();
    assert!(norms(&compared, "u").l2 < 1e-15, "{compared:?}");
    assert!(compared.intersection.unwrap().exact);
    // Bent ones have no polynomials but linear ones in common with triangles; biquadratic ones have all quadratic.
    for (kind, degree) in [(CellKind::Quadrangle, 1), (CellKind::Quadrangle9, 2)] {
        let f = |x: &[f64; 3]| (0.2 + x[0] - 0.4 * x[1]).powi(degree);
        let a = with(broken("a", kind, &quadrangles(4, 0.1)), "u", f);
        let b = with(
            broken("b", triangle(2), &grid(2, 3, 5, bent(2, -0.1))),
            "u",
            f,
        );
        let compared = compare(&a, &b).unwrap();
        assert!(norms(&compared, "u").l2 < 1e-14, "{compared:?}");
        assert!(!compared.intersection.unwrap().exact);
    }
    // Folded: two corners change places.
    let mut cells = quadrangles(2, 0.0);
    cells[1].swap(0, 1);
    let a = with(broken("a", CellKind::Quadrangle, &cells), "u", |x| x[0]);
    let error = compare(&a, &straight).unwrap_err().to_string();
    assert!(
        error.contains("cell 1") && error.contains("is folded"),
        "{error}"
    );
}

/// Quadratic cells with a bent side: of area 1/2 + 2/3 · 0.1 · √2 … by hand, and the function of all nodes.
#[test]
fn curved_cells_are_taken_as_pieces_and_told() {
    let mut a = broken("a", triangle(2), &grid(2, 2, 1, |x| x));
    // The middle of a side inside moves, in both cells that have it.
    let middle = [0.5, 0.25, 0.0];
    let moved = a.points.to_mut().iter_mut().filter(|p| **p == middle);
    assert_eq!(moved.map(|p| p[0] += 0.02).count(), 2);
    let a = with(a, "u", |x| x[0] - x[1]);
    let b = with(broken("b", triangle(1), &grid(2, 3, 1, |x| x)), "u", |x| {
        x[0] - x[1]
    });
    let compared = compare(&a, &b).unwrap();
    let found = compared.intersection.clone().unwrap();
    assert_eq!(found.curved, [2, 0]);
    assert!((found.common - 1.0).abs() < 1e-14 && !found.exact);
    // What is linear in the nodes is linear on the curved cell.
    assert!(norms(&compared, "u").l2 < 1e-14, "{:?}", compared.fields);
}

#[test]
fn fields_of_other_kinds_and_ranks() {
    let a = with(broken("a", triangle(1), &grid(2, 3, 1, |x| x)), "u", |x| {
        x[0]
    });
    let vectors = |side: &mut Results, components: usize, third: f64| {
        let rows = side
            .points
            .iter()
            .flat_map(|x| [x[0], x[1], third].into_iter().take(components));
        side.on_points.push(field("v", components, rows.collect()));
    };
    let on = |components, third| {
        let mut side = with(broken("b", triangle(1), &grid(2, 4, 1, |x| x)), "u", |x| {
            x[0]
        });
        vectors(&mut side, components, third);
        side
    };
    let mut a = a;
    vectors(&mut a, 2, 0.0);
    let verdict = |b: &Results| compare(&a, b).unwrap().fields[1].field.verdict;
    assert_eq!(verdict(&on(2, 0.0)), Verdict::Agree);
    assert_eq!(verdict(&on(3, 0.0)), Verdict::Agree);
    assert_eq!(verdict(&on(3, 1e-9)), Verdict::Disagree);
    assert_eq!(verdict(&on(1, 0.0)), Verdict::Undetermined);
    // Labels of points are not a function; a field of only one side never passes.
    let mut labelled = on(2, 0.0);
    labelled.on_points[0].rest = Some(Vec::new());
    let compared = compare(&a, &labelled).unwrap();
    assert_eq!(compared.verdict, Verdict::Undetermined);
    let mut other = on(2, 0.0);
    other.on_points[1].name = "w".into();
    let compared = compare(&a, &other).unwrap();
    let lacks: Vec<_> = compared
        .fields
        .iter()
        .filter_map(|f| f.field.reason.clone())
        .collect();
    assert_eq!(lacks, ["b does not have it", "a does not have it"]);
    // The same function at corners and on points; constants on cells that differ in their last digit only.
    let mut corners = on(2, 0.0);
    corners.on_corners = std::mem::take(&mut corners.on_points);
    assert_eq!(compare(&a, &corners).unwrap().verdict, Verdict::Agree);
    let huge = |last: f64| {
        let mut side = broken(
            "ids",
            triangle(1),
            &grid(2, if last > 0.0 { 2 } else { 4 }, 1, |x| x),
        );
        let count = side.cell_count();
        side.on_cells.push(ResultField {
            rest: Some(vec![last; count]),
            ..field("id", 1, vec![2.0_f64.powi(60); count])
        });
        side
    };
    let ids = |last| compare(&huge(0.0), &huge(last)).unwrap().verdict;
    assert_eq!(ids(1.0), Verdict::Disagree);
    assert_eq!(
        compare(&huge(0.0), &huge(0.0)).unwrap().verdict,
        Verdict::Agree
    );
}

/// a = x² and b = x² - y - 1 differ by 1 + y, most at a corner of each cell; the mean of x² on a simplex is known. Half of
/// the cells are not covered, or hold a value that is not a number.
#[test]
fn on_each_cell_stand_its_largest_difference_and_the_means() {
    for dim in [2, 3] {
        let (kind, bend) = (
            if dim == 2 {
                triangle(2)
            } else {
                tetrahedron(2)
            },
            |x| x,
        );
        let cells = grid(dim, 4, 1, bend);
        let a = with(broken("a", kind, &cells), "u", |x| x[0] * x[0]);
        let mut b = with(
            broken(
                "b",
                kind,
                &grid(dim, 2, 5, |x: [f64; 3]| [0.5 * x[0], x[1], x[2]]),
            ),
            "u",
            |x| x[0] * x[0] - x[1] - 1.0,
        );
        for damaged in [false, true] {
            if damaged {
                b.on_points[0].values.to_mut().fill(f64::NAN);
            }
            let found = compare(&a, &b).unwrap();
            let [set] = &found.differences[..] else {
                panic!("one set of differences");
            };
            let (name, 3, rows) = &set.fields[0] else {
                panic!("three numbers a cell");
            };
            assert_eq!((set.on, &**name), (On::Functions, "u"));
            for (corners, row) in cells.iter().zip(rows.chunks(3)) {
                let is_covered = corners.iter().all(|x| x[0] <= 0.5);
                let n = corners.len() as f64;
                let sum = |f: &dyn Fn(&[f64; 3]) -> f64| corners.iter().map(f).sum::<f64>();
                let of_a = (sum(&|x| x[0]).powi(2) + sum(&|x| x[0] * x[0])) / (n * (n + 1.0));
                let highest = corners.iter().map(|x| x[1]).fold(0.0, f64::max);
                let of_b = of_a - 1.0 - sum(&|x| x[1]) / n;
                let expected = match (is_covered, damaged) {
                    (true, false) => [1.0 + highest, of_a, of_b],
                    (true, true) => [f64::NAN, of_a, f64::NAN],
                    (false, _) => [f64::NAN; 3],
                };
                for (found, expected) in row.iter().zip(expected) {
                    let both_nan = found.is_nan() && expected.is_nan();
                    assert!(
                        both_nan || (found - expected).abs() < 1e-14,
                        "{row:?} {expected:?}"
                    );
                }
            }
        }
    }
}

/// Projections keep integrals, and what is in the other space; the mean of x² on the cells of a square is known.
#[test]
fn projections_keep_integrals_and_polynomials() {
    let none = &|_: f64| {};
    for dim in [2, 3] {
        let kind = |order| {
            if dim == 2 {
                triangle(order)
            } else {
                tetrahedron(order)
            }
        };
        let square = |x: &[f64; 3]| x[0] * x[0];
        let mut from = with(
            broken("from", kind(2), &grid(dim, 3, 1, bent(dim, 0.1))),
            "u",
            square,
        );
        let means: Vec<f64> = (0..from.cell_count()).map(|k| (k as f64).sin()).collect();
        from.on_cells.push(field("c", 1, means));
        for order in [1, 2, 3] {
            let onto = broken("onto", kind(order), &grid(dim, 2, 5, |x| x));
            let projected = project(&onto, &from, none).unwrap();
            assert_eq!(projected.results.cells, onto.cells);
            assert!(projected.uncovered < 1e-14);
            for (name, _, [before, after]) in &projected.integrals {
                assert!((before - after).abs() < 1e-14, "{name}: {before} {after}");
            }
            let (_, _, [before, _]) = projected.integrals[0];
            assert!((before - 1.0 / 3.0).abs() < 1e-14, "{before}");
            let of = &projected.results.on_points[0];
            let far = of.values.iter().zip(&onto.points);
            let far = far.map(|(u, x)| (u - square(x)).abs()).fold(0.0, f64::max);
            assert_eq!(far < 1e-12, order >= 2, "{dim} {order}: {far}");
        }
        // To the space of the field of that name: constants, and points that cells share.
        let mut onto = broken("onto", kind(1), &grid(dim, 2, 5, |x| x));
        onto.on_cells
            .push(field("u", 1, vec![0.0; onto.cell_count()]));
        let projected = project(&onto, &from, none).unwrap();
        let values = &projected.results.on_cells[0].values;
        let exact = |cell: usize| {
            // The mean of x² on a simplex: (Σ x_i)² + Σ x_i² over (d + 1)(d + 2).
            let x: Vec<f64> = onto
                .cell(cell)
                .map(|p| onto.points[p as usize][0])
                .collect();
            let (sum, squares): (f64, f64) = (x.iter().sum(), x.iter().map(|x| x * x).sum());
            (sum * sum + squares) / ((dim + 1) * (dim + 2)) as f64
        };
        for cell in 0..onto.cell_count() {
            assert!(
                (values[cell] - exact(cell)).abs() < 1e-14,
                "{} {}",
                values[cell],
                exact(cell)
            );
        }
    }
    // Where nothing covers the mesh there is no value, and that is reported.
    let from = with(
        broken("from", triangle(1), &grid(2, 2, 1, |x| x)),
        "u",
        |x| x[1],
    );
    let onto = broken(
        "onto",
        triangle(1),
        &grid(2, 2, 1, |x| [2.0 * x[0], x[1], 0.0]),
    );
    let projected = project(&onto, &from, none).unwrap();
    assert!((projected.uncovered - 0.5).abs() < 1e-14);
    let values = &projected.results.on_points[0].values;
    for (value, place) in values.iter().zip(&onto.points).filter(|(_, x)| x[0] != 1.0) {
        let covered = place[0] < 1.0;
        assert_eq!(
            (value - place[1]).abs() < 1e-13,
            covered,
            "{value} {place:?}"
        );
        assert_eq!(value.is_nan(), !covered);
    }
}

/// ‖x - x y‖² = 1/3 · 1/3 and ‖∇(x - x y)‖² = 1/3 + 1/3 on the unit square.
#[test]
fn errors_against_a_formula_are_those_known() {
    let exact = |x: [f64; 3], _| (x[0] * x[1], [x[1], x[0], 0.0]);
    let mut a = with(broken("a", triangle(1), &grid(2, 3, 1, |x| x)), "u", |x| {
        x[0]
    });
    let found = crate::error_against(&a, "u", 1, &exact).unwrap();
    assert!((found.l2 - 1.0 / 3.0).abs() < 1e-15, "{found:?}");
    assert!((found.h1.unwrap() - (2.0_f64 / 3.0).sqrt()).abs() < 1e-14);
    assert!((found.l2_scale - 1.0 / 3.0).abs() < 1e-15);
    assert!(crate::error_against(&a, "w", 1, &exact).is_err());
    assert!(crate::error_against(&a, "u", 2, &exact).is_err());
    // (x, 1, 0) against (x y, 1): the second component adds nothing, the third has no formula.
    let values = a.points.iter().flat_map(|x| [x[0], 1.0, 0.0]).collect();
    a.on_points.push(field("v", 3, values));
    let both = |x: [f64; 3], k| [exact(x, k), (1.0, [0.0; 3])][k];
    let of_vector = crate::error_against(&a, "v", 2, &both).unwrap();
    assert!((of_vector.l2 - found.l2).abs() < 1e-15, "{of_vector:?}");
    let size = crate::Size::of(&a).unwrap();
    assert_eq!(
        (size.cells, (size.h * 18.0_f64.sqrt() - 1.0).abs() < 1e-14),
        (18, true)
    );
}
