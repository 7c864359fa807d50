//! nutils: the form as expressions of NumPy's functions on nutils' arrays, with nutils' own derivative.

use super::frame::{self, POINTS, Sharing, Speaker, Table};
use super::python::{self, NUMPY};
use super::spelling::Style;
use super::{Code, Script};
use crate::problem::{Element, Problem, Space};
use crate::scalar::{Field, Leaf, Side};

/// nutils 9.
pub const CODE: Code = Code {
    name: "nutils",
    suffix: "_nutils.py",
    command: &["python3"],
    mesh: ("msh2", "msh"),
    script: Script::Of(&TABLE),
};

static TABLE: Table = Table {
    frame: "nutils.py",
    reserved: &[python::RESERVED, RESERVED],
    first: 0,
    mark: '_',
    pi: "np.pi",
    coordinates: ["x", "y", "z"],
    normals: ["n[0]", "n[1]", "n[2]"],
    diameter: ["h", "h"],
    clock: |t| format!("function.Argument(\"{t}\", ())"),
    other,
    leaf,
    form: STYLE,
    formulas: STYLE,
    brackets: false,
    signs: false,
    element,
    rules: frame::by_points,
    derivative: frame::by_code,
    sharing: Sharing::Together,
    points: POINTS,
    lacks: frame::nothing,
    more: frame::no_more,
};

/// nutils has `<` and `>` only, and no `np.where`.
const STYLE: Style = Style {
    choice: |sign, [a, b, c, d]| {
        let (name, yes, no) = match sign {
            "<" => ("less", c, d),
            "<=" => ("greater", d, c),
            ">" => ("greater", c, d),
            _ => ("less", d, c),
        };
        format!("np.choose(np.{name}({a}, {b}).astype(int), [{no}, {yes}])")
    },
    ..NUMPY
};

/// Names that the frame imports or makes.
pub const RESERVED: &str = "function mesh sample solver types quadrature pointsseq topo geom corners sides marked at hold held spaces bases rule \
    facet_rule total tests first F system free here found nodes degree basis interpolated unknowns part parts cell dofs fields integrand longest nodal nutils tag arguments goal mean0 multiplier0 number";

fn element(_: &Problem, space: Space) -> Result<String, String> {
    let (kind, degree) = match space.element {
        Element::Continuous(degree) => ("lagrange", degree),
        Element::Broken(degree) => ("discont", degree),
        other => return Err(format!("nutils has no {}", other.name())),
    };
    Ok(format!("topo.basis(\"{kind}\", degree={degree})"))
}

fn other(name: String, side: Side) -> String {
    match side {
        Side::Minus => format!("function.opposite({name})"),
        _ => name,
    }
}

fn leaf(of: &Speaker<'_>, leaf: Leaf) -> String {
    let name = of.words.part(leaf).to_owned();
    let sided = |text| other(text, leaf.side);
    match (leaf.field, leaf.axis, leaf.second) {
        (Field::Datum(k), ..) if of.problem.data[k].space.is_none() => name,
        (_, None, _) => sided(name),
        (_, Some(k), None) => format!("{}[{k}]", sided(format!("function.grad({name}, geom)"))),
        (_, Some(k), Some(l)) => {
            let twice = format!("function.grad(function.grad({name}, geom), geom)");
            format!("{}[{k}, {l}]", sided(twice))
        }
    }
}
