//! NGSolve: the form as coefficient functions of scalar trial and test functions, with NGSolve's derivative.

use faceoff_fem::scene::expression::Function;
use minijinja::context;

use super::python::{LEAVES, RESERVED as PYTHON, USUAL};
use super::speaker::Speaker;
use super::spelling::{Exponent, Style};
use super::table::{Code, Leaves, Sharing};
use crate::grid::Cells;
use crate::problem::{Domain, Element, Problem, Space};
use crate::scalar::{Field, Leaf, Side};

/// NGSolve 6.2, without its user interface.
pub const CODE: Code = Code {
    name: "ngsolve",
    suffix: "_ngsolve.py",
    frame: include_str!("frames/ngsolve.py"),
    reserved: &[PYTHON, RESERVED],
    on_side: |value, side| match side {
        Side::Minus => format!("{value}.Other()"),
        _ => value,
    },
    leaves: Leaves {
        name,
        first: "grad(%)",
        second: "%.Operator(\"hesse\")",
        whole: Some(["div(%)", "curl(%)"]),
        ..LEAVES
    },
    form: STYLE,
    formulas: STYLE,
    element,
    // NGSolve linearises integrals over interior facets correctly only if they are bilinear.
    by_hand: |problem, integral| {
        integral.measure.domain == Domain::Interior && !problem.is_bilinear(integral)
    },
    sharing: Sharing::Apart,
    more: |of| {
        let Problem { dim, cells, .. } = of.problem;
        context! { nodes => vec![reference(cells, dim - 1), reference(cells, dim)] }
    },
    has_eigen: true,
    ..USUAL
};

const STYLE: Style = Style {
    call: |function, arguments| match (function, arguments) {
        (Function::Max, [a, b]) => format!("IfPos({a} - ({b}), {a}, {b})"),
        (Function::Min, [a, b]) => format!("IfPos({a} - ({b}), {b}, {a})"),
        (Function::Abs, [a, ..]) => format!("IfPos({a}, {a}, -({a}))"),
        (Function::Tanh, [a, ..]) => format!("(sinh({a})/cosh({a}))"),
        _ => format!("{}({})", function.names()[0], arguments.join(", ")),
    },
    // Powers are differentiated by the logarithm, which fails for negative bases, unless the exponent is a positive integer.
    power: |base, exponent| match exponent {
        Exponent::Integer(n) if *n < 0 => format!("(1.0/{base}**{})", -n),
        _ => exponent.after(base, "**"),
    },
    // `IfPos(a, b, c)` is b where a > 0.
    choice: |sign, [a, b, c, d]| match sign {
        "<" => format!("IfPos({b} - ({a}), {c}, {d})"),
        "<=" => format!("IfPos({a} - ({b}), {d}, {c})"),
        ">" => format!("IfPos({a} - ({b}), {c}, {d})"),
        _ => format!("IfPos({b} - ({a}), {d}, {c})"),
    },
};

/// Names that the frame imports or defines.
const RESERVED: &str = "lines mode value modes eigenvalues matrix start fields each from_nodes function held scipy to_nodes values_at_nodes ngsolve netgen mesh here descriptor grid groups inside label mapped point where known V W a b J u_ gf between found hold free nodes at values rule facet_rule rule2 rule3 rule4 rule5 rule6 rule7 rule8 number names CF IfPos sin cos tan exp log \
    sqrt atan atan2 asin acos sinh cosh grad ds dx specialcf TRIG SEGM TET QUAD HEX BND VOL Mesh H1 L2 FESpace BilinearForm GridFunction total e t space inverse curl div goal before mean0 multiplier0 hold_whole normal tangential";

/// The beginning of a space, to which arguments may be added.
fn element(problem: &Problem, space: Space) -> Result<String, String> {
    Ok(match space.element {
        Element::Continuous(degree) => format!("ngsolve.H1(mesh, order={degree}"),
        Element::Broken(degree) => format!("ngsolve.L2(mesh, order={degree}"),
        Element::CrouzeixRaviart if problem.dim == 2 => {
            "ngsolve.FESpace(\"nonconforming\", mesh, order=1".into()
        }
        Element::CrouzeixRaviart => {
            return Err("NGSolve has Crouzeix-Raviart elements on triangles only".into());
        }
        Element::RaviartThomas => "ngsolve.HDiv(mesh, order=0, RT=True".into(),
        Element::Nedelec => "ngsolve.HCurl(mesh, order=0, type1=True".into(),
    })
}

/// The derivative is taken at the approximation, `total`, in the direction of the residual's trial functions.
fn name(of: &Speaker<'_>, leaf: Leaf) -> String {
    match leaf.field {
        Field::Unknown(k) if of.in_derivative => total(&of.problem, k, leaf.component),
        Field::Increment(k) => {
            let field = Field::Unknown(k);
            of.function(Leaf { field, ..leaf })
        }
        _ => of.function(leaf),
    }
}

/// The part of the approximation for a component.
fn total(problem: &Problem, unknown: usize, component: usize) -> String {
    match problem.blocks().len() + problem.means.len() {
        1 => "total".into(),
        _ => format!("total.components[{}]", problem.block(unknown, component)),
    }
}

/// The nodes of degrees 0 to 3 on a reference cell, by the degree; of degree 0, the centre; and the centres of the facets of a simplex.
fn reference(cells: Cells, dim: usize) -> Vec<Vec<Vec<String>>> {
    let is_simplex = cells == Cells::Simplices;
    let points = |degree: usize| {
        let mut all: Vec<Vec<usize>> = vec![Vec::new()];
        for _ in 0..dim {
            let longer = |p: Vec<usize>| (0..=degree).map(move |k| [&p[..], &[k]].concat());
            all = all.into_iter().flat_map(longer).collect();
        }
        all.retain(|p| !is_simplex || p.iter().sum::<usize>() <= degree);
        let place = |k: &usize| format!("{:?}", *k as f64 / degree as f64);
        let place = |p: Vec<usize>| p.iter().map(place).collect();
        all.into_iter().map(place).collect::<Vec<Vec<String>>>()
    };
    let parts = if is_simplex { dim + 1 } else { 2 };
    let centre = vec![vec![format!("1/{parts}"); dim]];
    // The centres of facets are opposite the vertices.
    let facet = |j| {
        let place = |i| {
            if i == j {
                "0".into()
            } else {
                format!("1/{dim}")
            }
        };
        (0..dim).map(place).collect()
    };
    let facets = (0..=dim).map(facet).collect();
    vec![centre, points(1), points(2), points(3), facets]
}
