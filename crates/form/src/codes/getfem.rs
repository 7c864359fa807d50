//! GetFEM: the form in its weak form language, in scalars, with GetFEM's own derivative.

use super::frame::{self, POINTS, Sharing, Speaker, Table};
use super::python;
use super::spelling::Style;
use super::{Code, Script};
use crate::problem::{Element, Problem, Space};
use crate::scalar::{Field, Leaf, Side};

/// GetFEM 5 in the system's Python, where packages of Linux distributions put it.
pub const CODE: Code = Code {
    name: "getfem",
    suffix: "_getfem.py",
    command: &["/usr/bin/python3"],
    mesh: ("msh2", "msh"),
    script: Script::Of(&TABLE),
};

static TABLE: Table = Table {
    frame: "getfem.py",
    reserved: &[python::RESERVED, RESERVED],
    first: 0,
    mark: '_',
    pi: "pi",
    coordinates: ["X(1)", "X(2)", "X(3)"],
    normals: ["Normal(1)", "Normal(2)", "Normal(3)"],
    diameter: ["h", "h"],
    clock: str::to_owned,
    other,
    leaf,
    form: STYLE,
    formulas: STYLE,
    brackets: true,
    signs: false,
    element,
    rules,
    derivative: frame::by_code,
    sharing: Sharing::Together,
    points: POINTS,
    lacks: frame::nothing,
    more: frame::no_more,
};

/// The weak form language has no choice; `Heaviside` is 1 from 0 on.
const STYLE: Style = Style {
    call: |function, arguments| format!("{}({})", function.names()[0], arguments.join(", ")),
    power: |base, n| format!("pow({base}, {})", n.text()),
    choice: |sign, [a, b, c, d]| {
        let (step, yes, no) = match sign {
            "<" => (format!("Heaviside({a} - ({b}))"), d, c),
            "<=" => (format!("Heaviside({b} - ({a}))"), c, d),
            ">" => (format!("Heaviside({b} - ({a}))"), d, c),
            _ => (format!("Heaviside({a} - ({b}))"), c, d),
        };
        format!("(({no}) + {step}*(({yes}) - ({no})))")
    },
};

/// Names that the frame makes, and words of the weak form language.
pub const RESERVED: &str = "gf model mesh sides side on space spaces value hold held free nodes at order output faces exact facet where fixed cell \
    X Normal Id Trace Sym Skew Det Inv Cofactor Norm Heaviside sign pos_part neg_part sqr element_size timestep qdim meshdim sin cos tan asin \
    name of_it region F getfem corners dofs face longest total \
    acos atan atan2 sinh cosh tanh exp log sqrt erf Interpolate Print Derivative Def t T u_ goal first number size hold_whole";

fn element(problem: &Problem, space: Space) -> Result<String, String> {
    let dim = problem.dim;
    Ok(match space.element {
        Element::Continuous(degree) => format!("FEM_PK({dim},{degree})"),
        Element::Broken(degree) => format!("FEM_PK_DISCONTINUOUS({dim},{degree})"),
        Element::CrouzeixRaviart if dim == 2 => "FEM_P1_NONCONFORMING".into(),
        Element::CrouzeixRaviart => {
            return Err("GetFEM has no Crouzeix-Raviart element in 3D".into());
        }
        Element::RaviartThomas => format!("FEM_RT0({dim})"),
        Element::Nedelec => format!("FEM_NEDELEC({dim})"),
    })
}

/// GetFEM takes no points, only names; a rule on facets is part of one on cells.
fn rules(problem: &Problem) -> Result<[String; 2], String> {
    let [cells, facets] = problem.rules().map(|rule| rule.name);
    let of_cells = match cells {
        "radon-7" => "IM_TRIANGLE(5)",
        "edges-3" => "IM_NC(2,2)",
        "hammer-4" => "IM_TETRAHEDRON(2)",
        _ => {
            return Err(format!(
                "GetFEM has no rule with the points of {cells}: take a degree of at most 2"
            ));
        }
    };
    let of_facets = match (facets, problem.dim) {
        ("gauss-5", _) => "IM_TRIANGLE(9)",
        ("gauss-3", _) => "IM_TRIANGLE(5)",
        ("gauss-2", _) => "IM_TRIANGLE(2)",
        ("radon-7", _) => "IM_TETRAHEDRON(5)",
        _ => "IM_NC(3,2)",
    };
    Ok([of_cells, of_facets].map(str::to_owned))
}

fn other(name: String, side: Side) -> String {
    match side {
        Side::Minus => format!("Interpolate({name}, neighbor_element)"),
        _ => name,
    }
}

fn leaf(of: &Speaker<'_>, leaf: Leaf) -> String {
    let (test, field) = match leaf.field {
        Field::Test(k) => ("Test_", Field::Unknown(k)),
        field => ("", field),
    };
    let (name, is_vector) = of.function(Leaf { field, ..leaf });
    if matches!(field, Field::Datum(k) if of.problem.data[k].space.is_none()) {
        return name.to_owned();
    }
    let sided = |what: &str| other(format!("{what}{test}{name}"), leaf.side);
    let components = [is_vector.then_some(leaf.component), leaf.axis, leaf.second];
    let places: Vec<String> = components
        .iter()
        .flatten()
        .map(|k| (k + 1).to_string())
        .collect();
    let value = match (leaf.axis, leaf.second) {
        (None, _) => sided(""),
        (Some(_), None) => sided("Grad_"),
        (Some(_), Some(_)) => sided("Hess_"),
    };
    match places.is_empty() {
        true => value,
        false => format!("{value}({})", places.join(",")),
    }
}
