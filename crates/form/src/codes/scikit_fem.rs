//! scikit-fem: the form as functions of NumPy arrays, in scalars, with our derivative.

use std::collections::BTreeSet;

use minijinja::Value;
use minijinja::value::Serde;
use serde::Serialize;

use super::fields::{Named, Over, Term};
use super::frame::{self, POINTS, Sharing, Speaker, Table};
use super::python::{self, NUMPY};
use super::spelling::{Shared, comment, measure};
use super::{Code, Script};
use crate::problem::{Bilinear, Domain, Element, Integral, Problem, Space};
use crate::scalar::{Field, Id, Leaf, Node, Side};

/// scikit-fem, from release 8 on.
pub const CODE: Code = Code {
    name: "scikit-fem",
    suffix: "_skfem.py",
    command: &["python3"],
    mesh: ("msh2", "msh"),
    script: Script::Of(&TABLE),
};

static TABLE: Table = Table {
    frame: "scikit_fem.py",
    reserved: &[python::RESERVED, RESERVED],
    first: 0,
    mark: '_',
    pi: "np.pi",
    coordinates: ["x", "y", "z"],
    normals: ["n[0]", "n[1]", "n[2]"],
    diameter: ["w.h", "w.h"],
    clock: str::to_owned,
    other: |name, side| name + mark(side),
    leaf,
    form: NUMPY,
    formulas: NUMPY,
    brackets: false,
    signs: true,
    element,
    rules: frame::by_points,
    derivative: |_, _| true,
    sharing: Sharing::Own,
    points: POINTS,
    lacks: frame::nothing,
    more,
};

/// Names that the frame imports or makes.
pub const RESERVED: &str = "skfem mesh here element basis w rule facet_rule nodes at boundary fixed diameter splu bases values total free facets_of \
    BilinearForm LinearForm Basis FacetBasis InteriorFacetBasis interpolated where held hold found given residual derivative scipy asm sides other number goal before bent part rows wanted hold_whole of_element";

fn element(problem: &Problem, space: Space) -> Result<String, String> {
    let dim = problem.dim;
    let cell = if dim == 2 { "Tri" } else { "Tet" };
    let lagrange = |degree| match degree > 1 && problem.has_second() {
        true => format!("bent(skfem.Element{cell}P{degree})"),
        false => format!("skfem.Element{cell}P{degree}()"),
    };
    let name = match space.element {
        Element::Continuous(3) if dim == 3 => {
            return Err("scikit-fem has no P3 on tetrahedra".into());
        }
        Element::Continuous(degree) => lagrange(degree),
        Element::Broken(0) => format!("skfem.Element{cell}P0()"),
        Element::Broken(degree) => format!("skfem.ElementDG({})", lagrange(degree)),
        Element::RaviartThomas => return Ok(format!("skfem.Element{cell}RT0()")),
        Element::Nedelec if dim == 2 => return Ok("skfem.ElementTriN1()".into()),
        Element::Nedelec => return Ok("skfem.ElementTetN0()".into()),
        Element::CrouzeixRaviart => format!("skfem.Element{cell}CR()"),
    };
    Ok(match space.size {
        None => name,
        Some(size) => format!("skfem.ElementVector({name}, {size})"),
    })
}

/// The sides of a measure: those of interior facets, or the only one.
fn sides(domain: Domain) -> &'static [Side] {
    match domain {
        Domain::Interior => &[Side::Plus, Side::Minus],
        _ => &[Side::Here],
    }
}

fn mark(side: Side) -> &'static str {
    match side {
        Side::Here => "",
        Side::Plus => "_plus",
        Side::Minus => "_minus",
    }
}

fn leaf(of: &Speaker<'_>, leaf: Leaf) -> String {
    let dim = of.problem.dim;
    let whole = of.words.whole(leaf.field);
    let (name, space) = match leaf.field {
        Field::Datum(k) if of.problem.data[k].space.is_none() => {
            return format!(
                "{}({})",
                of.words.part(leaf),
                ["x", "y", "z"][..dim].join(", ")
            );
        }
        Field::Datum(_) => (
            format!("w.{}{}", of.words.part(leaf), mark(leaf.side)),
            None,
        ),
        Field::Unknown(k) | Field::Old(k) => (
            format!("{whole}{}", mark(leaf.side)),
            Some(of.problem.unknowns[k].space),
        ),
        Field::Test(k) | Field::Increment(k) => {
            (whole.to_owned(), Some(of.problem.unknowns[k].space))
        }
    };
    let size = space.and_then(|space| space.size);
    let at = size.map_or(String::new(), |_| format!("{}, ", leaf.component));
    match (leaf.axis, leaf.second, space.map(|space| space.element)) {
        (None, ..) if size.is_none() => name,
        (None, ..) => format!("{name}[{}]", leaf.component),
        (Some(_), _, Some(Element::RaviartThomas)) => format!("({name}.div/{dim})"),
        // The only slopes are half the components of the curl.
        (Some(_), _, Some(Element::Nedelec)) if dim == 2 => format!("({name}.curl/2)"),
        (Some(axis), _, Some(Element::Nedelec)) => {
            format!("({name}.curl[{}]/2)", 3 - axis - leaf.component)
        }
        (Some(axis), None, _) => format!("{name}.grad[{at}{axis}]"),
        (Some(axis), Some(second), _) => format!("{name}.hess[{at}{axis}, {second}]"),
    }
}

/// The forms, which are one for each side of a facet.
#[derive(Serialize)]
struct More {
    bends: bool,
    integrals: Vec<OfIntegral>,
    /// The forms of all integrals.
    residuals: Vec<Call>,
    derivatives: Vec<Call>,
}

#[derive(Serialize)]
struct OfIntegral {
    title: String,
    #[serde(flatten)]
    over: Over,
    forms: Vec<Form>,
}

/// The number of an integral, and the sides of a form.
#[derive(Serialize, Clone, Copy)]
struct Call {
    integral: usize,
    test: &'static str,
    trial: &'static str,
}

#[derive(Serialize)]
struct Form {
    is_residual: bool,
    #[serde(flatten)]
    call: Call,
    has_normal: bool,
    /// The functions that coefficients depend on, with their sides.
    fields: Vec<String>,
    shared: Vec<Named>,
    terms: Vec<Term>,
}

fn more(of: &mut Speaker<'_>) -> Result<Value, String> {
    let residual = of.problem.residual();
    let derivative = residual.iter().map(|i| of.problem.derivative(i));
    let derivative: Vec<Bilinear> = derivative.collect();
    let mut more = More {
        bends: of.problem.has_second(),
        integrals: Vec::new(),
        residuals: Vec::new(),
        derivatives: Vec::new(),
    };
    for (k, (integral, by)) in residual.iter().zip(&derivative).enumerate() {
        let forms = forms(of, k, integral, by);
        for form in &forms {
            match form.is_residual {
                true => more.residuals.push(form.call),
                false => more.derivatives.push(form.call),
            }
        }
        more.integrals.push(OfIntegral {
            title: comment(&measure(&of.problem, &integral.measure)),
            over: Over::new(&of.problem, &integral.measure),
            forms,
        });
    }
    Ok(Value::from(Serde(more)))
}

/// The residual of an integral for each side of the test function, each with its derivatives.
fn forms(of: &Speaker<'_>, at: usize, integral: &Integral, by: &Bilinear) -> Vec<Form> {
    let roots = integral.terms.values().chain(by.values()).copied();
    let shared = of.share(&roots.collect::<Vec<_>>());
    let sides = sides(integral.measure.domain);
    let mut all = Vec::new();
    for test in sides {
        let mut add = |trial: Option<Side>, products: Vec<(Id, Vec<Leaf>)>| {
            if !products.is_empty() {
                let call = Call {
                    integral: at,
                    test: mark(*test),
                    trial: trial.map_or("", mark),
                };
                all.push(form(of, call, trial.is_none(), sides, products, &shared));
            }
        };
        let terms = integral.terms.iter().filter(|(leaf, _)| leaf.side == *test);
        add(None, terms.map(|(leaf, c)| (*c, vec![*leaf])).collect());
        for trial in sides {
            let is_it = |t: &Leaf, d: &Leaf| t.side == *test && d.side == *trial;
            let terms = by.iter().filter(|((t, d), _)| is_it(t, d));
            let products = terms.map(|((t, d), c)| (*c, vec![*d, *t]));
            add(Some(*trial), products.collect());
        }
    }
    all
}

fn form(
    of: &Speaker<'_>,
    call: Call,
    is_residual: bool,
    sides: &[Side],
    products: Vec<(Id, Vec<Leaf>)>,
    (names, known): &(Vec<Named>, Shared),
) -> Form {
    let scalars = &of.problem.scalars;
    let needed = scalars.nodes_of(products.iter().map(|(c, _)| *c));
    let mut fields = BTreeSet::new();
    let mut has_normal = false;
    for id in &needed {
        match scalars.node(*id) {
            Node::Leaf(leaf) => {
                fields.insert(leaf.field);
            }
            Node::Normal(..) => has_normal = true,
            _ => {}
        }
    }
    let fields = fields
        .iter()
        .filter(|f| matches!(f, Field::Unknown(_) | Field::Old(_)));
    let fields = fields.flat_map(|f| {
        sides
            .iter()
            .map(|s| of.words.whole(*f).to_owned() + mark(*s))
    });
    let used: BTreeSet<&String> = needed.iter().filter_map(|id| known.get(id)).collect();
    let shared = names.iter().filter(|each| used.contains(&each.name));
    Form {
        is_residual,
        call,
        has_normal,
        fields: fields.collect(),
        shared: shared.cloned().collect(),
        terms: of.sum(products, known),
    }
}
