//! The functions of the language, compared with values computed by hand.

use faceoff_fem::scene::expression::syntax::Term;

use super::{Names, Reader};
use crate::grid::Cells;
use crate::problem::{Datum, Element, Space, Unknown};
use crate::scalar::{Field, Leaf, Node, Scalars, Side};

/// The point, the normal of the first side, the diameters of both sides.
const POINT: [f64; 3] = [0.3, 0.7, -0.2];
const NORMAL: [f64; 3] = [0.6, -0.8, 0.0];
const DIAMETERS: [f64; 3] = [0.5, 0.25, 0.125];

fn of_side(side: Side) -> usize {
    match side {
        Side::Here => 0,
        Side::Plus => 1,
        Side::Minus => 2,
    }
}

/// Values of u: 2, 5 and -3 inside, on the first and on the second side, with its derivatives; those of the components of w are larger by 10 each.
fn end(node: Node) -> f64 {
    match node {
        Node::Coordinate(k) => POINT[k],
        Node::Normal(k, Side::Minus) => -NORMAL[k],
        Node::Normal(k, _) => NORMAL[k],
        Node::Length(_, side) => DIAMETERS[of_side(side)],
        Node::Leaf(leaf) => {
            let field = match leaf.field {
                Field::Unknown(k) => k as f64,
                _ => 0.5,
            };
            let value = [2.0, 5.0, -3.0][of_side(leaf.side)] + 100.0 * field;
            let axis = leaf.axis.map_or(0.0, |axis| axis as f64 + 1.0);
            let second = leaf.second.map_or(0.0, |axis| axis as f64 + 1.0);
            value + 10.0 * leaf.component as f64 + 0.1 * axis + 0.01 * second
        }
        other => panic!("{other:?} is not an end"),
    }
}

/// The entries of a tensor with their shape.
fn evaluated(text: &str, dim: usize) -> (Vec<usize>, Vec<f64>) {
    let unknown = |name: &str, element, size| Unknown {
        name: name.into(),
        test: format!("test.{name}"),
        space: Space { element, size },
    };
    let mut scalars = Scalars::default();
    let x = scalars.push(Node::Coordinate(0));
    let datum = Datum {
        name: "f".into(),
        shape: Vec::new(),
        components: vec![scalars.multiply(x, x)],
        texts: vec!["x*x".into()],
        space: None,
    };
    let names = Names {
        dim,
        cells: Cells::Simplices,
        unknowns: &[
            unknown("u", Element::Broken(1), None),
            unknown("w", Element::Broken(1), Some(dim)),
            unknown("q", Element::RaviartThomas, Some(dim)),
            unknown("e", Element::Nedelec, Some(dim)),
            unknown("s", Element::Continuous(2), None),
        ],
        parameters: &[],
        data: &[datum],
        groups: &[],
        unmarked: 0,
        is_timed: true,
    };
    let term = Term::parse(text).unwrap_or_else(|e| panic!("{text}: {}", e.what));
    let tensor = Reader::new(names, &mut scalars).tensor(&term);
    let tensor = tensor.unwrap_or_else(|e| panic!("{text}: {}", e.what));
    // A datum is given by its formula.
    let of = |node: Node| match node {
        Node::Leaf(Leaf {
            field: Field::Datum(_),
            axis: None,
            ..
        }) => POINT[0] * POINT[0],
        other => end(other),
    };
    let entries = tensor.entries.iter().map(|id| scalars.value(*id, &of));
    (tensor.shape, entries.collect())
}

fn assert_values(dim: usize, cases: &[(&str, &[usize], &[f64])]) {
    for (text, shape, values) in cases {
        let (found_shape, found) = evaluated(text, dim);
        assert_eq!(found_shape, *shape, "{text}");
        assert_eq!(found.len(), values.len(), "{text}");
        for (a, b) in found.iter().zip(*values) {
            assert!(
                (a - b).abs() < 1e-14 * b.abs().max(1.0),
                "{text}: {found:?}, not {values:?}"
            );
        }
    }
}

#[test]
fn matrices_in_2d() {
    const A: &str = "[[1, 2], [3, 5]]";
    let with = |text: &str| text.replace('A', A);
    for (text, shape, values) in [
        ("A", &[2, 2][..], &[1.0, 2.0, 3.0, 5.0][..]),
        ("A.T", &[2, 2], &[1.0, 3.0, 2.0, 5.0]),
        ("transpose(A)", &[2, 2], &[1.0, 3.0, 2.0, 5.0]),
        ("A[1]", &[2], &[3.0, 5.0]),
        ("A[1, 0]", &[], &[3.0]),
        ("A[1][0]", &[], &[3.0]),
        ("tr(A)", &[], &[6.0]),
        ("det(A)", &[], &[-1.0]),
        ("inv(A)", &[2, 2], &[-5.0, 2.0, 3.0, -1.0]),
        // det(A) inv(A).T
        ("cofac(A)", &[2, 2], &[5.0, -3.0, -2.0, 1.0]),
        ("dev(A)", &[2, 2], &[-2.0, 2.0, 3.0, 2.0]),
        ("sym(A)", &[2, 2], &[1.0, 2.5, 2.5, 5.0]),
        ("skew(A)", &[2, 2], &[0.0, -0.5, 0.5, 0.0]),
        ("dot(A, A)", &[2, 2], &[7.0, 12.0, 18.0, 31.0]),
        ("dot(A, [1, -1])", &[2], &[-1.0, -2.0]),
        ("dot([1, -1], A)", &[2], &[-2.0, -3.0]),
        ("inner(A, A)", &[], &[39.0]),
        (
            "outer([1, 2], [3, 4, 5])",
            &[2, 3],
            &[3.0, 4.0, 5.0, 6.0, 8.0, 10.0],
        ),
        ("2*A - A/2", &[2, 2], &[1.5, 3.0, 4.5, 7.5]),
        ("Identity(2) + A", &[2, 2], &[2.0, 2.0, 3.0, 6.0]),
        ("inv([[4]])", &[1, 1], &[0.25]),
    ] {
        assert_values(2, &[(&with(text), shape, values)]);
    }
}

#[test]
fn matrices_and_products_in_3d() {
    const B: &str = "[[2, 0, 1], [1, 3, 2], [0, 1, 4]]";
    let cofactors = [10.0, -4.0, 1.0, 1.0, 8.0, -2.0, -3.0, -3.0, 6.0];
    let inverse: Vec<f64> = [0, 3, 6, 1, 4, 7, 2, 5, 8]
        .map(|k| cofactors[k] / 21.0)
        .into();
    assert_values(
        3,
        &[
            (&format!("det({B})"), &[], &[21.0]),
            (&format!("cofac({B})"), &[3, 3], &cofactors),
            (&format!("inv({B})"), &[3, 3], &inverse),
            (&format!("tr(dev({B}))"), &[], &[0.0]),
            ("cross([1, 2, 3], [4, 5, 6])", &[3], &[-3.0, 6.0, -3.0]),
            // At (0.3, 0.7, -0.2).
            (
                "curl([y*z, x*z^2, x*y])",
                &[3],
                &[0.3 + 2.0 * 0.3 * 0.2, 0.0, 0.04 + 0.2],
            ),
            ("div([x*y, y*z, z^2])", &[], &[0.7 - 0.2 - 0.4]),
        ],
    );
}

#[test]
fn derivatives_in_space() {
    assert_values(
        2,
        &[
            ("grad(x*y + 3)", &[2], &[0.7, 0.3]),
            // (grad a)_ij is the derivative of a_i by x_j.
            ("grad([x*y, y^2])", &[2, 2], &[0.7, 0.3, 0.0, 1.4]),
            ("div([x*y, y^2])", &[], &[2.1]),
            ("div([[x, y], [x*y, y^2]])", &[2], &[2.0, 0.7 + 1.4]),
            ("curl([x*y, x^2])", &[], &[0.6 - 0.3]),
            ("rot(x*y)", &[2], &[0.3, -0.7]),
            ("grad(f)", &[2], &[0.6, 0.0]),
            ("grad(u)", &[2], &[2.1, 2.2]),
            ("grad(u^2)", &[2], &[2.0 * 2.0 * 2.1, 2.0 * 2.0 * 2.2]),
            ("grad(w)", &[2, 2], &[102.1, 102.2, 112.1, 112.2]),
            ("div(w)", &[], &[102.1 + 112.2]),
            ("div(f*w)", &[], &[0.6 * 102.0 + 0.09 * (102.1 + 112.2)]),
            ("curl(w)", &[], &[112.1 - 102.2]),
            ("grad(n)[0, 0] + grad(h)[1]", &[], &[0.0]),
        ],
    );
}

#[test]
fn sides_of_facets() {
    assert_values(
        2,
        &[
            ("u", &[], &[2.0]),
            ("u('+')", &[], &[5.0]),
            ("u('-')", &[], &[-3.0]),
            ("jump(u)", &[], &[8.0]),
            ("avg(u)", &[], &[1.0]),
            ("avg(h)", &[], &[0.1875]),
            // u⁺n⁺ + u⁻n⁻
            ("jump(u, n)", &[2], &[8.0 * 0.6, 8.0 * -0.8]),
            ("jump(w, n)", &[], &[0.6 * 8.0 - 0.8 * 8.0]),
            ("jump(grad(u), n)", &[], &[0.6 * 8.0 - 0.8 * 8.0]),
            ("avg(grad(u))", &[2], &[1.1, 1.2]),
            ("n('+')", &[2], &[0.6, -0.8]),
            ("n('-')", &[2], &[-0.6, 0.8]),
            ("grad(u)('-')", &[2], &[-2.9, -2.8]),
            ("(u^2*h)('-')", &[], &[9.0 * 0.125]),
            // A formula has one value.
            ("f('+') - f('-')", &[], &[0.0]),
            ("avg(f*u)", &[], &[0.09]),
        ],
    );
}

#[test]
fn scalar_functions() {
    let root = 0.3_f64.sqrt();
    assert_values(
        2,
        &[
            ("-2^2", &[], &[-4.0]),
            ("2^3^2", &[], &[512.0]),
            ("pow(2, -1)", &[], &[0.5]),
            ("x[0] + x[1]", &[], &[1.0]),
            ("sqrt(x) + pi", &[], &[root + std::f64::consts::PI]),
            ("sign(-x) + sign(0*x + 1)", &[], &[0.0]),
            ("sign(x - x)", &[], &[0.0]),
            ("pos(x) + pos(-x)", &[], &[0.3]),
            ("max(x, y) - min(x, y)", &[], &[0.7 - 0.3]),
            ("conditional(x < y, 1, 2)", &[], &[1.0]),
            ("if(x >= y, 1, if(x > 0, 3, 4))", &[], &[3.0]),
            ("conditional(x <= x, u, 7)", &[], &[2.0]),
            ("atan2(y, x)", &[], &[0.7_f64.atan2(0.3)]),
            ("abs(-y) + tanh(x)", &[], &[0.7 + 0.3_f64.tanh()]),
        ],
    );
}

/// The gradient of a + b x is b I and that of a + b × x is skew, on each cell.
#[test]
fn derivatives_of_vectors_as_a_whole() {
    let b = 202.1;
    let c = 312.1;
    assert_values(
        2,
        &[
            ("grad(q)", &[2, 2], &[b, 0.0, 0.0, b]),
            ("div(q)", &[], &[2.0 * b]),
            ("curl(e)", &[], &[2.0 * c]),
            ("grad(e)", &[2, 2], &[0.0, -c, c, 0.0]),
        ],
    );
    let [c0, c1, c2] = [322.2, 302.3, 312.1];
    assert_values(
        3,
        &[
            ("div(q)", &[], &[3.0 * b]),
            ("curl(e)", &[3], &[2.0 * c0, 2.0 * c1, 2.0 * c2]),
            (
                "grad(e)",
                &[3, 3],
                &[0.0, -c2, c1, c2, 0.0, -c0, -c1, c0, 0.0],
            ),
        ],
    );
}

#[test]
fn second_derivatives_and_the_step_before() {
    assert_values(
        2,
        &[
            ("grad(grad(s))", &[2, 2], &[402.11, 402.12, 402.12, 402.22]),
            ("div(grad(s))", &[], &[402.11 + 402.22]),
            ("grad(s*s)[0]", &[], &[2.0 * 402.0 * 402.1]),
            ("grad(grad(x*s))[0, 1]", &[], &[402.2 + 0.3 * 402.12]),
            ("u - old(u)", &[], &[2.0 - 52.0]),
            ("div(old(w))", &[], &[52.1 + 62.2]),
            ("grad(grad(f))[0, 0]", &[], &[2.0]),
        ],
    );
}
