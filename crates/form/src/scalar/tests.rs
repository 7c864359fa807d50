//! Derivatives against central differences, and coefficients of linear expressions against values.

use std::path::Path;

use faceoff_fem::scene::expression::{Comparison, Function};
use faceoff_mesh::mesh::generate::union_jack;

use super::{Field, Id, Leaf, Length, Node, NotLinear, Scalars, Side};
use crate::Problem;

/// The same values on every day and machine.
struct Random(u64);

impl Random {
    fn below(&mut self, most: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % most
    }

    /// In (-1, 1).
    fn value(&mut self) -> f64 {
        self.below(2_000_001) as f64 / 1_000_000.0 - 1.0
    }
}

fn leaf(field: Field, component: usize, axis: Option<usize>) -> Leaf {
    Leaf {
        field,
        component,
        axis,
        second: None,
        side: Side::Here,
    }
}

/// A random expression of two leaves, a parameter and a coordinate; functions that are not defined everywhere get valid arguments.
fn expression(s: &mut Scalars, random: &mut Random, depth: usize) -> Id {
    if depth == 0 {
        return match random.below(5) {
            0 => s.number(random.value() * 3.0),
            1 => s.push(Node::Parameter(0)),
            2 => s.push(Node::Coordinate(0)),
            k => s.leaf(leaf(Field::Unknown(0), 0, (k == 4).then_some(1))),
        };
    }
    let a = expression(s, random, depth - 1);
    let b = expression(s, random, depth - 1);
    let one = s.number(1.0);
    // At least 1, and in (-1, 1).
    let square = s.multiply(a, a);
    let positive = s.add(one, square);
    let half = s.number(0.5);
    let sine = s.call(Function::Sin, a, None);
    let small = s.multiply(half, sine);
    match random.below(22) {
        0..3 => s.add(a, b),
        3..6 => s.multiply(a, b),
        6 => s.subtract(a, b),
        7 => s.divide(b, positive),
        8 => {
            let exponent = s.number(random.below(4) as f64 + 0.5);
            s.power(positive, exponent)
        }
        9 => s.power(positive, small),
        10 => s.call(Function::Max, a, Some(b)),
        11 => s.call(Function::Min, a, Some(b)),
        12 => s.call(Function::Atan2, a, Some(positive)),
        13 => s.call(Function::Log, positive, None),
        14 => s.call(Function::Sqrt, positive, None),
        15 => s.call(Function::Asin, small, None),
        16 => s.call(Function::Acos, small, None),
        17 => s.choose(Comparison::LessEqual, [a, b, positive, small]),
        k => {
            let all = [
                Function::Sin,
                Function::Cos,
                Function::Tan,
                Function::Atan,
                Function::Sinh,
                Function::Cosh,
                Function::Tanh,
                Function::Exp,
                Function::Abs,
            ];
            s.call(all[(k + random.below(all.len())) % all.len()], small, None)
        }
    }
}

#[test]
fn derivatives_are_limits_of_differences() {
    let mut random = Random(2017);
    let mut compared = 0;
    for _ in 0..3000 {
        let mut s = Scalars::default();
        let depth = 1 + random.below(4);
        let f = expression(&mut s, &mut random, depth);
        let point = [
            random.value(),
            random.value(),
            random.value(),
            random.value(),
        ];
        let of = |shift: f64| {
            move |node: Node| match node {
                Node::Parameter(_) => point[0],
                Node::Coordinate(_) => point[1],
                Node::Leaf(l) if l.axis.is_none() => point[2] + shift,
                _ => point[3],
            }
        };
        let by = s.partials(f, |l| l.axis.is_none());
        let exact = by.values().map(|id| s.value(*id, &of(0.0))).sum::<f64>();
        let difference = |h: f64| (s.value(f, &of(h)) - s.value(f, &of(-h))) / (2.0 * h);
        let [coarse, fine] = [difference(2e-5), difference(1e-5)];
        let size = 1.0 + exact.abs() + s.value(f, &of(0.0)).abs();
        // Differences are not used at kinks of max, min, abs and conditionals, or with overflow.
        if !coarse.is_finite() || (coarse - fine).abs() > 1e-7 * size || size > 1e6 {
            continue;
        }
        assert!(
            (exact - fine).abs() < 1e-6 * size,
            "{exact} and {fine} of {:?}",
            s.nodes
        );
        compared += 1;
    }
    assert!(compared > 2500, "{compared}");
}

/// The derivative in Newton's method, for the nonlinear forms.
#[test]
fn derivatives_of_forms_are_limits_of_differences() {
    let mut random = Random(7);
    for name in [
        "neo-hooke",
        "minimal-surface",
        "p-laplace",
        "signorini",
        "interior-penalty",
        "convection",
        "chouly-hild",
        "allen-cahn",
        "biharmonic",
    ] {
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../examples/forms/{name}.toml"));
        let text = std::fs::read_to_string(&path).expect("a form");
        let mut problem =
            Problem::parse(&path, &text, &union_jack(2, [1.0, 1.0])).expect("a problem");
        let parameters: Vec<f64> = problem.parameters.iter().map(|p| p.value).collect();
        for integral in problem.residual() {
            let bilinear = problem.derivative(&integral);
            let roots = integral.terms.values().chain(bilinear.values()).copied();
            let nodes = problem.scalars.nodes_of(roots);
            let ends: Vec<(Node, f64, f64)> = nodes
                .into_iter()
                .map(|id| {
                    let step = random.value();
                    (problem.scalars.node(id), 0.2 * random.value() + 0.3, step)
                })
                .collect();
            let of = |shift: f64| {
                let (ends, parameters) = (&ends, &parameters);
                move |node: Node| match node {
                    Node::Parameter(k) => parameters[k],
                    _ => {
                        let (_, value, step) = ends.iter().find(|e| e.0 == node).expect("an end");
                        let is_unknown =
                            matches!(node, Node::Leaf(l) if matches!(l.field, Field::Unknown(_)));
                        value + if is_unknown { shift * step } else { 0.0 }
                    }
                }
            };
            let s = &problem.scalars;
            for (test, coefficient) in &integral.terms {
                let along = bilinear
                    .iter()
                    .filter(|((t, _), _)| t == test)
                    .map(|((_, d), by)| {
                        let Field::Increment(k) = d.field else {
                            panic!("{d:?}")
                        };
                        let node = Node::Leaf(Leaf {
                            field: Field::Unknown(k),
                            ..*d
                        });
                        let step = ends.iter().find(|e| e.0 == node).map_or(0.0, |e| e.2);
                        s.value(*by, &of(0.0)) * step
                    });
                let exact: f64 = along.sum();
                let h = 1e-5;
                let fine =
                    (s.value(*coefficient, &of(h)) - s.value(*coefficient, &of(-h))) / (2.0 * h);
                let size = 1.0 + exact.abs() + s.value(*coefficient, &of(0.0)).abs();
                assert!(
                    (exact - fine).abs() < 1e-7 * size,
                    "{name}: {exact}, {fine}"
                );
            }
        }
    }
}

#[test]
fn linear_expressions_are_their_coefficients() {
    let mut s = Scalars::default();
    let [v, dv] = [None, Some(0)].map(|axis| s.leaf(leaf(Field::Test(0), 0, axis)));
    let u = s.leaf(leaf(Field::Unknown(0), 0, None));
    let is_test = |l: &Leaf| matches!(l.field, Field::Test(_));
    // 3 u v - (u v + v')/u + if(u < 2, v, 0)
    let three = s.number(3.0);
    let two = s.number(2.0);
    let zero = s.number(0.0);
    let uv = s.multiply(u, v);
    let first = s.multiply(three, uv);
    let above = s.add(uv, dv);
    let second = s.divide(above, u);
    let third = s.choose(Comparison::Less, [u, two, v, zero]);
    let sum = s.subtract(first, second);
    let sum = s.add(sum, third);
    let terms = s.linear(sum, &is_test).expect("it is linear");
    let value = |leaf: &Leaf, u: f64| s.value(terms[leaf], &|_| u);
    assert_eq!(terms.len(), 2);
    for at in [1.5, 4.0] {
        let expected = 3.0 * at - 1.0 + if at < 2.0 { 1.0 } else { 0.0 };
        assert!((value(&leaf(Field::Test(0), 0, None), at) - expected).abs() < 1e-14);
        assert!((value(&leaf(Field::Test(0), 0, Some(0)), at) + 1.0 / at).abs() < 1e-14);
    }

    let vv = s.multiply(v, dv);
    let sine = s.call(Function::Sin, v, None);
    let below = s.divide(u, v);
    let power = s.power(v, two);
    let choice = s.choose(Comparison::Less, [v, u, v, zero]);
    let shifted = s.add(v, u);
    let either = s.choose(Comparison::Less, [u, two, v, u]);
    for (id, why) in [
        (vv, NotLinear::Twice),
        (sine, NotLinear::Inside),
        (below, NotLinear::Inside),
        (power, NotLinear::Inside),
        (choice, NotLinear::Inside),
        (shifted, NotLinear::Without),
        (either, NotLinear::Without),
        (u, NotLinear::Without),
    ] {
        assert_eq!(s.linear(id, &is_test), Err(why));
    }
    assert_eq!(s.linear(zero, &is_test), Ok([].into()));
}

/// Simplification does not change the value.
#[test]
fn equal_expressions_are_one_node() {
    let mut s = Scalars::default();
    let x = s.push(Node::Coordinate(0));
    let y = s.push(Node::Coordinate(1));
    let [a, b] = [s.multiply(x, y), s.multiply(x, y)];
    assert_eq!(a, b);
    let two = s.number(2.0);
    let three = s.number(3.0);
    let [left, right] = [s.multiply(two, x), s.multiply(y, three)];
    let product = s.multiply(left, right);
    assert_eq!(
        s.value(product, &|node| if node == Node::Coordinate(0) {
            5.0
        } else {
            7.0
        }),
        210.0
    );
    let minus = s.negative(x);
    assert_eq!(s.negative(minus), x);
    let zero = s.number(-0.0);
    assert!(s.is_zero(zero));
    let sum = s.add(x, zero);
    assert_eq!(sum, x);
    assert_eq!(s.length(product), 5.0);
}

#[test]
fn lengths_of_cells_are_those_of_known_ones() {
    use faceoff_mesh::mesh::CellGeometry;
    let triangle = CellGeometry::new(2, &[[1.0, 1.0, 0.0], [5.0, 1.0, 0.0], [1.0, 4.0, 0.0]]);
    let edge = 2.0 * 2.0_f64.sqrt();
    let corners = [
        [1.0; 3],
        [1.0, -1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [-1.0, -1.0, 1.0],
    ];
    let tetrahedron = CellGeometry::new(3, &corners);
    let wanted = [
        (Length::Diameter, None, 5.0, edge),
        (Length::Circumradius, None, 2.5, 3.0_f64.sqrt()),
        (Length::Inradius, None, 1.0, 1.0 / 3.0_f64.sqrt()),
        (Length::Facet, Some(0), 5.0, edge),
        (Length::Facet, Some(1), 3.0, edge),
        (Length::Facet, None, 3.0, edge),
    ];
    for (length, facet, of_triangle, of_tetrahedron) in wanted {
        for (cell, wanted) in [(&triangle, of_triangle), (&tetrahedron, of_tetrahedron)] {
            let found = length.of(cell, facet);
            assert!(
                (found - wanted).abs() < 1e-14,
                "{length:?}: {found} in place of {wanted}"
            );
        }
    }
}
