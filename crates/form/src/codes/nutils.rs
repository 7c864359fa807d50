//! nutils: the form as expressions of NumPy's functions on nutils' arrays, with nutils' derivative.

use super::points::NUMPY;
use super::python::{LEAVES, RESERVED as PYTHON, USUAL};
use super::spelling::Style;
use super::table::{Code, Leaves};
use crate::grid::Cells;
use crate::problem::{Element, Problem, Space};
use crate::scalar::Side;

/// nutils 9.
pub const CODE: Code = Code {
    name: "nutils",
    suffix: "_nutils.py",
    frame: include_str!("frames/nutils.py"),
    reserved: &[PYTHON, RESERVED],
    clock: |t| format!("function.Argument(\"{t}\", ())"),
    on_side: |value, side| match side {
        Side::Minus => format!("function.opposite({value})"),
        _ => value,
    },
    leaves: Leaves {
        first: "function.grad(%, geom)",
        second: "function.grad(function.grad(%, geom), geom)",
        ..LEAVES
    },
    form: STYLE,
    formulas: STYLE,
    signs: false,
    element,
    lacks: |problem| match problem.cells {
        Cells::Simplices => Ok(()),
        Cells::Cubes => Err(format!(
            "nutils has {} in structured meshes only",
            problem.cells.names(problem.dim)
        )),
    },
    ..USUAL
};

/// nutils only has `<` and `>`, and no `np.where`.
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

/// Names that the frame imports or defines.
const RESERVED: &str = "function mesh sample solver types quadrature pointsseq topo geom corners sides marked at hold held spaces bases rule \
    facet_rule rule2 rule3 rule4 rule5 rule6 rule7 rule8 total tests first F system free here found nodes degree basis interpolated unknowns part parts cell dofs fields integrand longest nodal nutils tag arguments goal mean0 multiplier0 number";

fn element(_: &Problem, space: Space) -> Result<String, String> {
    let (kind, degree) = match space.element {
        Element::Continuous(degree) => ("lagrange", degree),
        Element::Broken(degree) => ("discont", degree),
        other => return Err(format!("nutils has no {}", other.name())),
    };
    Ok(format!("topo.basis(\"{kind}\", degree={degree})"))
}
