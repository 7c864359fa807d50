//! The strong form of a weak form.

use super::spelling::{Shared, Style, measure, signed};
use crate::problem::{Domain, Problem};
use crate::scalar::{Field, Id, Leaf, Node, Side};

/// Longest line of an equation in the head.
const WIDTH: usize = 110;

/// An expression with more operations than this does not fit on a line.
const SHORT: f64 = 110.0;

const PLAIN: Style = Style {
    call: |function, a| format!("{}({})", function.names()[0], a.join(", ")),
    power: |base, n| n.after(base, "^"),
    choice: |sign, [a, b, c, d]| format!("if({a} {sign} {b}, {c}, {d})"),
};

/// An expression in the notation of the form.
pub fn plain(problem: &Problem, id: Id) -> String {
    let end = |node: Node| plain_end(problem, node);
    PLAIN.with(&end).text(&problem.scalars, id, &Shared::new())
}

/// The name of a component.
pub fn component(name: &str, size: Option<usize>, component: usize) -> String {
    match size {
        None => name.to_owned(),
        Some(_) => format!("{name}[{component}]"),
    }
}

fn plain_end(problem: &Problem, node: Node) -> String {
    let axis = |k: usize| ["x", "y", "z"][k];
    match node {
        Node::Pi => "pi".into(),
        Node::Parameter(k) => problem.parameters[k].name.clone(),
        Node::Coordinate(k) => axis(k).into(),
        Node::Normal(k, _) => format!("n[{k}]"),
        Node::Length(length, _) => length.name().into(),
        Node::Leaf(leaf) => {
            let (name, size) = match leaf.field {
                Field::Unknown(k) | Field::Increment(k) | Field::Test(k) | Field::Old(k) => {
                    (&problem.unknowns[k].name, problem.unknowns[k].space.size)
                }
                Field::Datum(k) => (
                    &problem.data[k].name,
                    problem.data[k].shape.first().copied(),
                ),
            };
            let mut name = component(name, size, leaf.component);
            if matches!(leaf.field, Field::Old(_)) {
                name = format!("old({name})");
            }
            match (leaf.axis, leaf.second) {
                (None, _) => name,
                (Some(k), None) => format!("d{name}/d{}", axis(k)),
                (Some(k), Some(l)) => format!("d2{name}/d{}d{}", axis(k), axis(l)),
            }
        }
        _ => String::new(),
    }
}

/// The equations in the domain and on the boundary, by integration by parts; those that do not fit on a line are left out.
pub fn strong_form(problem: &Problem) -> Vec<String> {
    if problem.eigen.is_some() {
        return Vec::new();
    }
    let problem = &mut problem.clone();
    let integrals = problem.residual();
    let [mut cells, mut rest] = [Vec::new(), Vec::new()];
    for integral in integrals {
        match integral.measure.domain {
            Domain::Cells if integral.measure.groups.is_empty() => cells.push(integral),
            Domain::Boundary => rest.push(integral),
            _ => return Vec::new(),
        }
    }
    let Some(cells) = cells.pop() else {
        return Vec::new();
    };
    let is_whole = problem.unknowns.iter().any(|u| u.space.element.is_vector());
    if is_whole || cells.terms.keys().any(|leaf| leaf.second.is_some()) {
        return Vec::new();
    }
    let mut lines = Vec::new();
    for (unknown, component) in problem.components() {
        let leaf = |axis| Leaf {
            field: Field::Test(unknown),
            component,
            axis,
            second: None,
            side: Side::Here,
        };
        let fluxes: Vec<Option<Id>> = (0..problem.dim)
            .map(|k| cells.terms.get(&leaf(Some(k))).copied())
            .collect();
        let load = cells.terms.get(&leaf(None));
        let all = fluxes.iter().flatten().chain(load);
        if all.map(|id| problem.scalars.length(*id)).sum::<f64>() > SHORT {
            return Vec::new();
        }
        let slopes = fluxes.iter().zip(["x", "y", "z"]);
        let slopes = slopes
            .filter_map(|(flux, axis)| Some(format!("-d({})/d{axis}", plain(problem, (*flux)?))));
        let terms = slopes.chain(load.map(|load| plain(problem, *load)));
        let terms = terms.enumerate().map(|(k, term)| signed(&term, k == 0));
        let left = terms.collect::<Vec<_>>().join(" ");
        if left.is_empty() || left.len() > WIDTH {
            return Vec::new();
        }
        lines.push(format!("{left} = 0"));
        for integral in &rest {
            let is_mine =
                |test: &Leaf| test.field == leaf(None).field && test.component == component;
            let mut mine = integral.terms.iter().filter(|(test, _)| is_mine(test));
            let (Some((test, load)), None) = (mine.next(), mine.next()) else {
                continue;
            };
            if test.axis.is_some() {
                continue;
            }
            let mut all = vec![*load];
            for (k, flux) in fluxes.iter().enumerate() {
                if let Some(flux) = flux {
                    let normal = problem.scalars.push(Node::Normal(k, Side::Here));
                    all.push(problem.scalars.multiply(normal, *flux));
                }
            }
            all.rotate_left(1);
            let sum = problem.scalars.sum(all);
            if problem.scalars.length(sum) > SHORT {
                continue;
            }
            let text = plain(problem, sum);
            if text.len() <= WIDTH {
                lines.push(format!(
                    "{text} = 0 on {}",
                    measure(problem, &integral.measure)
                ));
            }
        }
    }
    lines
}
