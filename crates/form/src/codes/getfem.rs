//! GetFEM: the form in its weak form language, in scalars, with GetFEM's derivative.

use super::python::{LEAVES, RESERVED as PYTHON, USUAL};
use super::spelling::Style;
use super::table::{Code, Leaves};
use crate::grid::Cells;
use crate::problem::{Element, Problem, Space};
use crate::scalar::{Field, Leaf, Side};

/// GetFEM 5 in the system's Python, where packages of Linux distributions install it.
pub const CODE: Code = Code {
    name: "getfem",
    suffix: "_getfem.py",
    command: &["/usr/bin/python3"],
    frame: include_str!("frames/getfem.py"),
    reserved: &[PYTHON, RESERVED],
    pi: "pi",
    coordinates: ["X(1)", "X(2)", "X(3)"],
    normals: ["Normal(1)", "Normal(2)", "Normal(3)"],
    on_side: |value, side| match side {
        Side::Minus => format!("Interpolate({value}, neighbor_element)"),
        _ => value,
    },
    leaves: Leaves {
        name: |of, leaf| match leaf.field {
            Field::Test(k) => {
                let field = Field::Unknown(k);
                format!("Test_{}", of.function(Leaf { field, ..leaf }))
            }
            _ => of.function(leaf),
        },
        first: "Grad_%",
        second: "Hess_%",
        index: |places| {
            let places: Vec<String> = places.iter().map(|k| (k + 1).to_string()).collect();
            format!("({})", places.join(","))
        },
        ..LEAVES
    },
    form: STYLE,
    formulas: STYLE,
    brackets: true,
    signs: false,
    element,
    rules,
    ..USUAL
};

/// The weak form language has no conditional; `Heaviside` is 1 from 0 on.
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

/// Names that the frame defines, and reserved words of the weak form language.
const RESERVED: &str = "each inside gf model mesh sides side on space spaces value hold held free nodes at order output faces exact facet where fixed cell \
    X Normal Id Trace Sym Skew Det Inv Cofactor Norm Heaviside sign pos_part neg_part sqr element_size timestep qdim meshdim sin cos tan asin \
    name of_it local own region F getfem corners dofs face longest total \
    acos atan atan2 sinh cosh tanh exp log sqrt erf Interpolate Print Derivative Def t T u_ goal first number size hold_whole";

fn element(problem: &Problem, space: Space) -> Result<String, String> {
    let dim = problem.dim;
    let family = match problem.cells {
        Cells::Simplices => "PK",
        Cells::Cubes => "QK",
    };
    Ok(match space.element {
        Element::Continuous(degree) => format!("FEM_{family}({dim},{degree})"),
        Element::Broken(degree) => format!("FEM_{family}_DISCONTINUOUS({dim},{degree})"),
        Element::CrouzeixRaviart if dim == 2 => "FEM_P1_NONCONFORMING".into(),
        Element::CrouzeixRaviart => {
            return Err("GetFEM has no Crouzeix-Raviart element in 3D".into());
        }
        Element::RaviartThomas => format!("FEM_RT0({dim})"),
        Element::Nedelec => format!("FEM_NEDELEC({dim})"),
    })
}

/// GetFEM takes rules by name, not by points; a rule on facets is part of one on cells.
fn rules(problem: &Problem) -> Result<Vec<&'static str>, String> {
    if problem.all_rules().len() > 2 {
        return Err("its scripts have one rule on cells and one on facets, and no measure with another degree".into());
    }
    let [cells, facets] = problem.rules().map(|rule| rule.name);
    if problem.cells == Cells::Cubes {
        let product = |name| match (name, problem.dim) {
            ("gauss-2", 2) => "IM_GAUSS_PARALLELEPIPED(2,3)",
            ("gauss-3", 2) => "IM_GAUSS_PARALLELEPIPED(2,5)",
            (_, 2) => "IM_GAUSS_PARALLELEPIPED(2,9)",
            ("gauss-2", _) => "IM_GAUSS_PARALLELEPIPED(3,3)",
            ("gauss-3", _) => "IM_GAUSS_PARALLELEPIPED(3,5)",
            _ => "IM_GAUSS_PARALLELEPIPED(3,9)",
        };
        return Ok(vec![product(cells), product(facets)]);
    }
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
    Ok(vec![of_cells, of_facets])
}
