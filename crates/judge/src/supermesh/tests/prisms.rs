//! Functions on prisms: against formulas, functions on other prisms and on tetrahedra.

use faceoff_mesh::CellKind;
use faceoff_mesh::field::Results;

use super::super::element::Element;
use super::{broken_nodes, compare, with};
use crate::Verdict;

/// The unit cube, sheared along z by a multiple of x, as 2 n² n prisms with nodes of their own.
fn prisms(kind: CellKind, n: usize, shear: f64) -> Results {
    let element = Element::new(kind).unwrap();
    let at = |i: f64, j: f64, k: f64| {
        let [x, y, z] = [i, j, k].map(|k| k / n as f64);
        [x, y, z + shear * x]
    };
    let mut cells = Vec::new();
    for (k, j, i) in (0..n).flat_map(|k| (0..n).flat_map(move |j| (0..n).map(move |i| (k, j, i)))) {
        let [i, j, k] = [i, j, k].map(|k| k as f64);
        for (origin, sign) in [([i, j], 1.0), ([i + 1.0, j + 1.0], -1.0)] {
            let node =
                |x: &[f64; 3]| at(origin[0] + sign * x[0], origin[1] + sign * x[1], k + x[2]);
            cells.push(element.nodes.iter().map(node).collect());
        }
    }
    broken_nodes("prisms", kind, &cells)
}

#[test]
fn errors_on_prisms_are_those_known() {
    for (kind, power) in [(CellKind::Prism, 1), (CellKind::Prism18, 2)] {
        for shear in [0.0, 0.4] {
            // In the space: a polynomial in x and y times one along the prism.
            let u = move |x: &[f64; 3]| {
                (1.0 + x[0] - 2.0 * x[1]).powi(power) * (2.0 + x[2] - shear * x[0])
            };
            let exact = move |x: [f64; 3], _: usize| {
                let (p, h) = (1.0 + x[0] - 2.0 * x[1], 2.0 + x[2] - shear * x[0]);
                let slope = f64::from(power) * p.powi(power - 1) * h;
                let top = p.powi(power);
                (top * h, [slope - shear * top, -2.0 * slope, top])
            };
            let a = with(with(prisms(kind, 2, shear), "u", u), "one", |_| 1.0);
            let found = crate::error_against(&a, "u", 1, &exact).unwrap();
            assert!(
                found.l2 < 1e-13 && found.h1.unwrap() < 1e-12,
                "{kind} {found:?}"
            );
            let zero = |_: [f64; 3], _: usize| (0.0, [0.0; 3]);
            let volume = crate::error_against(&a, "one", 1, &zero).unwrap().l2;
            assert!((volume - 1.0).abs() < 1e-13, "{kind}: {volume}");
        }
    }
    // ‖x z - 0‖² = 1/9 does not depend only on x.
    let a = with(prisms(CellKind::Prism, 3, 0.0), "u", |x| x[0] * x[2]);
    let zero = |_: [f64; 3], _: usize| (0.0, [0.0; 3]);
    let found = crate::error_against(&a, "u", 1, &zero).unwrap();
    assert!((found.l2.powi(2) - 1.0 / 9.0).abs() < 1e-14, "{found:?}");
}

#[test]
fn prisms_agree_with_other_prisms_and_faults_are_seen() {
    let u = |x: &[f64; 3]| (1.0 + x[0] - 2.0 * x[1]) * (2.0 + x[2]);
    let a = with(prisms(CellKind::Prism, 2, 0.0), "u", u);
    let b = with(prisms(CellKind::Prism18, 3, 0.0), "u", u);
    let found = compare(&a, &b).unwrap();
    assert_eq!(found.verdict, Verdict::Agree, "{:?}", found.fields);
    let common = found.intersection.unwrap();
    assert!((common.common - 1.0).abs() < 1e-12 && common.exact);
    let wrong = with(prisms(CellKind::Prism18, 3, 0.0), "u", |x| {
        u(x) + 1e-6 * x[2] * x[2]
    });
    assert_eq!(compare(&a, &wrong).unwrap().verdict, Verdict::Disagree);
}

/// The same, whose inner points are moved, so that sides are not plane.
fn moved(kind: CellKind, n: usize, by: f64) -> Results {
    let mut all = prisms(CellKind::Prism, n, 0.0);
    for [x, y, z] in all.points.to_mut() {
        let bump = by * 64.0 * *x * (1.0 - *x) * *y * (1.0 - *y) * *z * (1.0 - *z);
        let [p, q] = [(7.0 * *y).sin(), (5.0 * *z).cos()];
        (*x, *y, *z) = (*x + bump * p, *y + bump * q, *z - bump);
    }
    let corners = Element::new(CellKind::Prism).unwrap();
    let nodes = Element::new(kind).unwrap().nodes;
    let cells = all.points.chunks(6).map(|cell| {
        let node = |x: &[f64; 3]| corners.interpolate(cell, x);
        nodes.iter().map(node).collect()
    });
    broken_nodes("moved", kind, &cells.collect::<Vec<Vec<_>>>())
}

#[test]
fn prisms_without_plane_sides_have_their_functions() {
    let linear = |x: &[f64; 3]| 1.0 + 2.0 * x[0] - 3.0 * x[1] + x[2];
    let exact = |x: [f64; 3], _: usize| (linear(&x), [2.0, -3.0, 1.0]);
    let zero = |_: [f64; 3], _: usize| (0.0, [0.0; 3]);
    for kind in [CellKind::Prism, CellKind::Prism18] {
        let a = with(with(moved(kind, 2, 0.05), "u", linear), "one", |_| 1.0);
        let found = crate::error_against(&a, "u", 1, &exact).unwrap();
        assert!(
            found.l2 < 1e-13 && found.h1.unwrap() < 1e-8,
            "{kind} {found:?}"
        );
        // Neighbours divide their sides alike: without gaps.
        let volume = crate::error_against(&a, "one", 1, &zero).unwrap().l2;
        assert!((volume - 1.0).abs() < 1e-13, "{kind}: {volume}");
        let straight = with(prisms(CellKind::Prism, 1, 0.0), "u", linear);
        let found = compare(&straight, &a).unwrap();
        let of_u = found.fields.iter().find(|f| f.field.field == "u").unwrap();
        assert_eq!(of_u.field.verdict, Verdict::Agree, "{kind}: {of_u:?}");
        let common = found.intersection.unwrap();
        assert!((common.common - 1.0).abs() < 1e-12 && !common.exact);
        assert!(common.quadrature.unwrap() < 1e-5, "{common:?}");
        let wrong = with(moved(kind, 2, 0.05), "u", |x| linear(x) + 1e-6 * x[0]);
        let found = compare(&straight, &wrong).unwrap();
        assert_eq!(found.verdict, Verdict::Disagree, "{kind}");
        // ‖10⁻⁶ x‖ on the unit cube, less the parts of cells too thin to count.
        let l2 = super::norms(&found, "u").l2;
        assert!((l2 / 1e-6 - (1.0_f64 / 3.0).sqrt()).abs() < 1e-5, "{l2}");
    }
}

/// Where functions are not polynomials, the stated error of the rule is at least as large as the true one.
#[test]
fn the_error_of_quadrature_is_stated() {
    let product = |x: &[f64; 3]| x[0] * x[1] * x[2];
    let a = with(prisms(CellKind::Prism, 2, 0.0), "u", |_| 0.0);
    let bent = with(moved(CellKind::Prism, 2, 0.08), "u", product);
    let found = compare(&a, &bent).unwrap();
    let stated = found.intersection.as_ref().unwrap().quadrature.unwrap();
    assert!(stated > 1e-14 && stated < 1e-3, "{stated}");
    let zero = |_: [f64; 3], _: usize| (0.0, [0.0; 3]);
    // By a rule of four degrees more.
    let better = crate::error_against(&bent, "u", 1, &zero).unwrap().l2;
    let off = (super::norms(&found, "u").l2 / better - 1.0).abs();
    assert!(off <= stated, "{off} {stated}");
}

#[test]
fn folded_prisms_are_refused() {
    let mut a = with(prisms(CellKind::Prism, 2, 0.0), "u", |x| x[0]);
    a.points.to_mut()[5][0] += 3.0;
    a.points.to_mut()[5][1] -= 3.0;
    let exact = |x: [f64; 3], _: usize| (x[0], [1.0, 0.0, 0.0]);
    let error = crate::error_against(&a, "u", 1, &exact)
        .unwrap_err()
        .to_string();
    assert!(error.contains("is folded"), "{error}");
}
