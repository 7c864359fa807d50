//! Functions on prisms that are affine images of one: against formulas and functions on hexahedra; others are refused.

use faceoff_mesh::CellKind;
use faceoff_mesh::field::Results;

use super::super::element::Element;
use super::{broken_nodes, compare, with};
use crate::Verdict;

/// The unit cube, sheared by so much of x along z, as 2 n² n prisms with nodes of their own.
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
    // ‖x z - 0‖² = 1/9 is no function of x alone.
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

#[test]
fn prisms_that_are_no_affine_image_are_refused() {
    let mut a = with(prisms(CellKind::Prism, 2, 0.0), "u", |x| x[0]);
    a.points.to_mut()[5][0] += 0.1;
    let exact = |x: [f64; 3], _: usize| (x[0], [1.0, 0.0, 0.0]);
    let error = crate::error_against(&a, "u", 1, &exact)
        .unwrap_err()
        .to_string();
    assert!(error.contains("not the affine image"), "{error}");
}
