//! scikit-fem: the form as functions of NumPy arrays, in scalars, with our derivative.

use std::collections::BTreeSet;

use minijinja::{Value, context};

use super::fields::{named, over};
use super::python::{LEAVES, RESERVED as PYTHON, USUAL};
use super::speaker::Speaker;
use super::spelling::Shared;
use super::table::{Code, Leaves, Sharing};
use crate::grid::Cells;
use crate::problem::{Bilinear, Domain, Element, Integral, Problem, Space};
use crate::scalar::{Field, Id, Leaf, Length, Node, Side};

/// scikit-fem, from release 8 on.
pub const CODE: Code = Code {
    name: "scikit-fem",
    suffix: "_skfem.py",
    frame: include_str!("frames/scikit_fem.py"),
    reserved: &[PYTHON, RESERVED],
    length: |length, _| match length {
        Length::Circumradius => "w.circumradius",
        Length::Facet => "w.facet_length",
        _ => "w.h",
    },
    on_side: |value, side| value + mark(side),
    leaves: Leaves {
        name: |of, leaf| match leaf.field {
            Field::Datum(k) if of.problem.data[k].space.is_none() => {
                let axes = &["x", "y", "z"][..of.problem.dim];
                format!("{}({})", of.words.part(leaf), axes.join(", "))
            }
            Field::Datum(_) => format!("w.{}", of.words.part(leaf)),
            _ => of.words.whole(leaf.field).to_owned(),
        },
        first: "%.grad",
        second: "%.hess",
        whole: Some(["%.div", "%.curl"]),
        by_component: false,
        side_first: true,
        ..LEAVES
    },
    element,
    sharing: Sharing::Own,
    more,
    has_eigen: true,
    ..USUAL
};

/// Names that the frame imports or defines.
const RESERVED: &str = "lines mode value modes eigenvalues eigsh start at_nodes a b dofs name object skfem mesh here element basis w rule facet_rule rule2 rule3 rule4 rule5 rule6 rule7 rule8 nodes at boundary fixed diameter splu bases values total free facets_of \
    BilinearForm LinearForm Basis FacetBasis InteriorFacetBasis interpolated where held hold found given residual derivative scipy asm sides other number goal before bent part rows wanted hold_whole of_element";

fn element(problem: &Problem, space: Space) -> Result<String, String> {
    let dim = problem.dim;
    let cell = match (problem.cells, dim) {
        (Cells::Simplices, 2) => "Tri",
        (Cells::Simplices, _) => "Tet",
        (Cells::Cubes, 2) => "Quad",
        (Cells::Cubes, _) => "Hex",
    };
    let of = match problem.cells {
        Cells::Simplices => "P",
        Cells::Cubes => "",
    };
    let lagrange = |degree| match degree > 1 && problem.has_second() {
        true => format!("bent(skfem.Element{cell}{of}{degree})"),
        false => format!("skfem.Element{cell}{of}{degree}()"),
    };
    let name = match space.element {
        Element::Continuous(3) if dim == 3 => {
            return Err("scikit-fem has no P3 on tetrahedra".into());
        }
        Element::Continuous(degree) => lagrange(degree),
        Element::Broken(0) => format!("skfem.Element{cell}{of}0()"),
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

fn mark(side: Side) -> &'static str {
    match side {
        Side::Here => "",
        Side::Plus => "_plus",
        Side::Minus => "_minus",
    }
}

/// The forms, one for each side of a facet.
fn more(of: &mut Speaker<'_>) -> Value {
    let residual = of.problem.residual();
    let derivative = residual.iter().map(|i| of.problem.derivative(i));
    let derivative: Vec<Bilinear> = derivative.collect();
    let each = residual.iter().zip(&derivative).enumerate();
    let forms = each.map(|(k, (integral, by))| forms(of, k, integral, by));
    let forms: Vec<Vec<Value>> = forms.collect();
    let integrals = residual.iter().zip(&forms);
    let integrals = integrals.map(|(i, forms)| context! { forms => forms.clone(), ..over(of, i) });
    context! {
        bends => of.problem.has_second(),
        integrals => integrals.collect::<Value>(),
        // For all integrals.
        forms => forms.concat(),
    }
}

/// The residual of an integral for each side of the test function, each with its derivatives.
fn forms(of: &Speaker<'_>, k: usize, integral: &Integral, by: &Bilinear) -> Vec<Value> {
    let roots = integral.terms.values().chain(by.values()).copied();
    let shared = of.share(&roots.collect::<Vec<_>>());
    let sides: &[Side] = match integral.measure.domain {
        Domain::Interior => &[Side::Plus, Side::Minus],
        _ => &[Side::Here],
    };
    let mut all = Vec::new();
    for test in sides {
        let mut add = |trial: Option<Side>, products: Vec<(Id, Vec<Leaf>)>| {
            if !products.is_empty() {
                all.push(context! {
                    integral => k,
                    is_mass => integral.is_mass,
                    is_residual => trial.is_none(),
                    test => mark(*test),
                    trial => trial.map(mark),
                    ..body(of, sides, products, &shared)
                });
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

/// The contents of a form: the functions in its coefficients, their common subexpressions, and its terms.
fn body(
    of: &Speaker<'_>,
    sides: &[Side],
    products: Vec<(Id, Vec<Leaf>)>,
    (names, known): &(Vec<(String, String)>, Shared),
) -> Value {
    let scalars = &of.problem.scalars;
    let needed = scalars.nodes_of(products.iter().map(|(c, _)| *c));
    let nodes = || needed.iter().map(|id| scalars.node(*id));
    let fields: BTreeSet<Field> = nodes()
        .filter_map(|node| match node {
            Node::Leaf(leaf) if !matches!(leaf.field, Field::Datum(_)) => Some(leaf.field),
            _ => None,
        })
        .collect();
    let fields = fields.iter().map(|field| of.words.whole(*field));
    let fields = fields.flat_map(|name| sides.iter().map(move |s| name.to_owned() + mark(*s)));
    let used: BTreeSet<&String> = needed.iter().filter_map(|id| known.get(id)).collect();
    let shared = names.iter().filter(|(name, _)| used.contains(name));
    context! {
        has_normal => nodes().any(|node| matches!(node, Node::Normal(..))),
        fields => fields.collect::<Value>(),
        shared => named(shared.cloned().collect()),
        terms => of.sum(products, known),
    }
}
