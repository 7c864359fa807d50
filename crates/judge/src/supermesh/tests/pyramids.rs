//! Functions on pyramids: against formulas, functions on other pyramids, hexahedra and tetrahedra.

use faceoff_mesh::CellKind;
use faceoff_mesh::field::Results;

use super::{broken_nodes, compare, grid, norms, tetrahedron, with};
use crate::Verdict;

/// The unit cube as 6 n³ pyramids: n³ cubes, whose corners are moved by at most `by`, each divided around a point near its centre.
fn pyramids(n: usize, by: f64) -> Results {
    let moved = |[x, y, z]: [f64; 3]| {
        let bump = by * 64.0 * x * (1.0 - x) * y * (1.0 - y) * z * (1.0 - z);
        [
            x + bump * (7.0 * y).sin(),
            y + bump * (5.0 * z).cos(),
            z - bump * (3.0 * x).cos(),
        ]
    };
    let mut cells: Vec<Vec<[f64; 3]>> = Vec::new();
    for (k, j, i) in (0..n).flat_map(|k| (0..n).flat_map(move |j| (0..n).map(move |i| (k, j, i)))) {
        let at = |[x, y, z]: [f64; 3]| {
            let place = [i as f64 + x, j as f64 + y, k as f64 + z];
            moved(place.map(|x| x / n as f64))
        };
        let apex = at([0.45, 0.55, 0.5]);
        for axis in 0..3 {
            for side in [0.0, 1.0] {
                let corner = |[p, q]: [f64; 2]| {
                    let mut x = [side; 3];
                    (x[(axis + 1) % 3], x[(axis + 2) % 3]) = (p, q);
                    at(x)
                };
                let mut base = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(corner);
                if side == 1.0 {
                    base.reverse();
                }
                cells.push([&base[..], &[apex]].concat());
            }
        }
    }
    broken_nodes("pyramids", CellKind::Pyramid, &cells)
}

#[test]
fn errors_on_pyramids_are_those_known() {
    let linear = |x: &[f64; 3]| 1.0 + 2.0 * x[0] - 3.0 * x[1] + x[2];
    let exact = |x: [f64; 3], _: usize| (linear(&x), [2.0, -3.0, 1.0]);
    let zero = |_: [f64; 3], _: usize| (0.0, [0.0; 3]);
    for by in [0.0, 0.06] {
        let a = with(with(pyramids(2, by), "u", linear), "one", |_| 1.0);
        let found = crate::error_against(&a, "u", 1, &exact).unwrap();
        assert!(
            found.l2 < 1e-13 && found.h1.unwrap() < 1e-8,
            "{by} {found:?}"
        );
        let volume = crate::error_against(&a, "one", 1, &zero).unwrap().l2;
        assert!((volume - 1.0).abs() < 1e-13, "{by}: {volume}");
    }
}

/// The function of a corner of the square, whose square has the integral 1/45 over the reference's pyramid: with x = r(1 - t), y = s(1 - t), z = t
/// it is ∫ r² s² (1 - t)² (1 - t)² = 1/3 · 1/3 · 1/5.
#[test]
fn the_function_that_is_no_polynomial_is_that_of_books() {
    let corners = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    ];
    let one = |x: &[f64; 3]| if x[0] * x[1] == 1.0 { 1.0 } else { 0.0 };
    let cell = broken_nodes("one", CellKind::Pyramid, &[corners.to_vec()]);
    let a = with(cell, "u", one);
    let zero = |_: [f64; 3], _: usize| (0.0, [0.0; 3]);
    let exact = |[x, y, z]: [f64; 3], _: usize| {
        let h = 1.0 - z;
        (x * y / h, [y / h, x / h, x * y / (h * h)])
    };
    let found = crate::error_against(&a, "u", 1, &exact).unwrap();
    assert!(found.l2 < 1e-14 && found.h1.unwrap() < 1e-13, "{found:?}");
    let found = crate::error_against(&a, "u", 1, &zero).unwrap();
    assert!((found.l2.powi(2) - 1.0 / 45.0).abs() < 1e-6, "{found:?}");
    // Collapsed coordinates make a polynomial of it: the rule is exact, and so is what is stated.
    let tetrahedra = [[0, 1, 2, 4], [0, 2, 3, 4]].map(|cell| cell.map(|k| corners[k]).to_vec());
    let b = broken_nodes("t", CellKind::Tetrahedron, &tetrahedra);
    let found = compare(&a, &with(b, "u", |_| 0.0)).unwrap();
    let stated = found.intersection.as_ref().unwrap().quadrature.unwrap();
    let off = (norms(&found, "u").l2 * 45.0_f64.sqrt() - 1.0).abs();
    assert!(stated < 1e-14 && off < 1e-14, "{stated} {off}");
}

#[test]
fn pyramids_agree_with_other_cells_and_faults_are_seen() {
    let linear = |x: &[f64; 3]| 1.0 + 2.0 * x[0] - 3.0 * x[1] + x[2];
    let tetrahedra = super::broken("t", tetrahedron(1), &grid(3, 1, 1, |x| x));
    let others = [tetrahedra, pyramids(1, 0.0)];
    for (other, by) in others
        .into_iter()
        .flat_map(|o| [(o.clone(), 0.0), (o, 0.06)])
    {
        let a = with(other, "u", linear);
        let b = with(pyramids(2, by), "u", linear);
        let found = compare(&a, &b).unwrap();
        assert_eq!(found.verdict, Verdict::Agree, "{by}: {:?}", found.fields);
        let common = found.intersection.unwrap();
        assert!((common.common - 1.0).abs() < 1e-12 && !common.exact);
        assert!(common.quadrature.unwrap() < 1e-4, "{common:?}");
        let wrong = with(pyramids(2, by), "u", |x| linear(x) + 1e-6 * x[2]);
        let found = compare(&a, &wrong).unwrap();
        assert_eq!(found.verdict, Verdict::Disagree, "{by}");
        // ‖10⁻⁶ z‖ on the unit cube, less the parts of cells too thin to count.
        let l2 = norms(&found, "u").l2;
        assert!((l2 / 1e-6 - (1.0_f64 / 3.0).sqrt()).abs() < 1e-4, "{l2}");
    }
}

#[test]
fn pyramids_of_order_two_are_refused_in_words() {
    let places = pyramids(1, 0.0).points[..5].to_vec();
    let nodes: Vec<[f64; 3]> = places.iter().cycle().take(14).copied().collect();
    let a = with(broken_nodes("p", CellKind::Pyramid14, &[nodes]), "u", |x| {
        x[0]
    });
    let exact = |x: [f64; 3], _: usize| (x[0], [1.0, 0.0, 0.0]);
    let error = crate::error_against(&a, "u", 1, &exact).unwrap_err();
    assert!(error.to_string().contains("not known here"), "{error}");
}
