//! All changes of a form that are tried, each as its contribution to the residual.

use std::collections::BTreeSet;

use faceoff_fem::quadrature::Rule;
use faceoff_mesh::parallel;

use super::change::{Change, Digits, Interpolated, Part, Penalty, Size};
use super::residual::{Residual, add};
use crate::grid::Cells;
use crate::language::{Formula, Names, Reader, find_group};
use crate::own::{Assembler, Wanted, Work};
use crate::problem::{Bilinear, Domain, Element, Integral, Problem, Space};
use crate::scalar::{Field, Id, Leaf, Length, Node, Scalars, Side};

/// A change, and the source of its vector.
pub struct Entry {
    pub change: Change,
    make: Make,
}

enum Make {
    /// The vector of this term.
    Term(usize),
    /// The derivative of F with respect to a parameter.
    Parameter(usize),
    /// Integrals of a problem with the same spaces by these rules, each minus the vector of the term that it replaces, if any.
    Integrals {
        problem: Box<Problem>,
        integrals: Vec<Integral>,
        rules: [Rule; 2],
        less: Vec<usize>,
    },
    /// The form on moved vertices, minus the form.
    Coordinates(Digits),
}

/// The relative step of finite differences with respect to parameters.
const STEP: f64 = 1e-4;

impl Entry {
    /// The contribution of the change to the residual for these parameter values and factors of terms.
    pub fn vector(&self, residual: &Residual<'_>, parameters: &[f64], factors: &[f64]) -> Vec<f64> {
        match &self.make {
            Make::Term(term) => term_at(residual, *term, parameters),
            Make::Parameter(k) => {
                let size = parameters[*k].abs();
                let step = STEP * if size == 0.0 { 1.0 } else { size };
                let at = |by: f64| {
                    let mut parameters = parameters.to_vec();
                    parameters[*k] += by;
                    residual.with(&parameters)
                };
                let mut slope = at(step);
                add(&mut slope, &at(-step), -1.0);
                slope
                    .iter()
                    .map(|difference| difference / (2.0 * step))
                    .collect()
            }
            Make::Coordinates(digits) => {
                let mut source = residual.source.clone();
                for x in source.points.to_mut().iter_mut().flatten() {
                    *x = digits.round(*x);
                }
                let integrals = residual.problem.clone().residual();
                let moved = Assembler::of(residual.problem, &source, &integrals, false);
                let Ok(moved) = moved else {
                    return vec![0.0; residual.u.len()];
                };
                let state = residual.state(parameters);
                let mut all = moved.assemble(state, Wanted::Residual).residual;
                residual.free(&mut all);
                add(&mut all, &residual.with(parameters), -1.0);
                all
            }
            Make::Integrals {
                problem,
                integrals,
                rules,
                less,
            } => {
                let factor = |k: usize| less.get(k).map_or(1.0, |term| factors[*term]);
                let mut all = vec![0.0; residual.u.len()];
                for (k, integral) in integrals
                    .iter()
                    .enumerate()
                    .filter(|(k, _)| factor(*k) != 0.0)
                {
                    let mut own = integrated(residual, problem, integral, rules, parameters);
                    residual.free(&mut own);
                    add(&mut all, &own, factor(k));
                    if let Some(term) = less.get(k) {
                        add(&mut all, &term_at(residual, *term, parameters), -factor(k));
                    }
                }
                all
            }
        }
    }

    /// A factor of a term.
    fn factor(term: usize) -> Self {
        Entry {
            change: Change::Factor { term },
            make: Make::Term(term),
        }
    }
}

/// The vector of a term.
fn term_at(residual: &Residual<'_>, term: usize, parameters: &[f64]) -> Vec<f64> {
    if parameters == residual.parameters {
        return residual.terms[term].clone();
    }
    let problem = residual.problem;
    let integral = &problem.integrals[term];
    let mut all = integrated(residual, problem, integral, &problem.rules(), parameters);
    residual.free(&mut all);
    all
}

/// The integral of a problem with the same spaces at the result, in all rows.
pub fn integrated(
    residual: &Residual<'_>,
    problem: &Problem,
    integral: &Integral,
    rules: &[Rule; 2],
    parameters: &[f64],
) -> Vec<f64> {
    let mut all = vec![0.0; residual.u.len()];
    let mut problem = problem.clone();
    let assembler = &residual.assembler;
    let (mesh, rules) = (&assembler.mesh, rules.clone());
    let by = Bilinear::new();
    let work = Work::new(&mut problem, mesh, residual.source, integral, rules, by);
    let state = residual.state(parameters);
    assembler.contributions(&problem, &work, state, |_, rows| {
        for (dof, value) in rows {
            all[*dof] += value;
        }
    });
    all
}

/// The dictionary of a form, with its vectors.
pub fn dictionary(residual: &Residual<'_>) -> Vec<(Entry, Vec<f64>)> {
    let problem = residual.problem;
    let terms = 0..problem.integrals.len();
    let mut all: Vec<Entry> = terms.clone().map(Entry::factor).collect();
    all.extend((0..problem.parameters.len()).map(|parameter| Entry {
        change: Change::Parameter { parameter },
        make: Make::Parameter(parameter),
    }));
    (0..2).for_each(|place| rules(problem, place, &mut all));
    for term in terms {
        groups(problem, term, &mut all);
        parts(problem, term, &mut all);
        transposed(problem, term, &mut all);
    }
    (0..problem.data.len()).for_each(|datum| data(problem, datum, &mut all));
    (0..problem.unknowns.len()).for_each(|unknown| added(problem, unknown, &mut all));
    sizes(residual, &mut all);
    obstacle(problem, &mut all);
    with_vectors(residual, all)
}

/// Changes to try if nothing else explains a result, since each needs a form on another mesh. A result on vertices that are farther
/// away is not one on the form's mesh.
pub fn coordinates(residual: &Residual<'_>) -> Vec<(Entry, Vec<f64>)> {
    let each = (6..=8).flat_map(|k| [Digits::Significant(k), Digits::Decimals(k)]);
    let all = each.chain([Digits::Single]).map(|digits| Entry {
        change: Change::Coordinates { digits },
        make: Make::Coordinates(digits),
    });
    with_vectors(residual, all.collect())
}

fn with_vectors(residual: &Residual<'_>, all: Vec<Entry>) -> Vec<(Entry, Vec<f64>)> {
    let factors = vec![1.0; residual.problem.integrals.len()];
    parallel::map(all, |entry| {
        let vector = entry.vector(residual, &residual.parameters, &factors);
        (entry, vector)
    })
}

fn changed(change: Change, problem: &Problem, integrals: Vec<Integral>, less: Vec<usize>) -> Entry {
    Entry {
        change,
        make: Make::Integrals {
            problem: Box::new(problem.clone()),
            integrals,
            rules: problem.rules(),
            less,
        },
    }
}

/// Every rule that a code may use on cells (0) or facets (1): in all terms, and in each if there are several.
fn rules(problem: &Problem, place: usize, all: &mut Vec<Entry>) {
    let dim = problem.dim - place;
    let is_here = |k: &usize| {
        let is_cells = problem.integrals[*k].measure.domain == Domain::Cells;
        is_cells == (place == 0)
    };
    let terms: Vec<usize> = (0..problem.integrals.len()).filter(is_here).collect();
    let own = problem.rules();
    let has = |k: &usize, name| {
        let measure = &problem.integrals[*k].measure;
        problem.rule_of(measure, own.clone()).name == name
    };
    for rule in problem.cells.rules(dim) {
        let mut rules = own.clone();
        let name = rule.name;
        // The terms that now have other points.
        let terms: Vec<usize> = terms.iter().filter(|k| !has(k, name)).copied().collect();
        rules[place] = rule;
        let mut push = |term: Option<usize>, terms: &[usize]| {
            let integrals = terms.iter().map(|k| {
                let mut integral = problem.integrals[*k].clone();
                integral.measure.degree = None;
                integral
            });
            all.push(Entry {
                change: Change::Rule { term, rule: name },
                make: Make::Integrals {
                    problem: Box::new(problem.clone()),
                    integrals: integrals.collect(),
                    rules: rules.clone(),
                    less: terms.to_vec(),
                },
            });
        };
        match terms[..] {
            [] => {}
            [term] => push(Some(term), &terms),
            _ => {
                push(None, &terms);
                terms.iter().for_each(|term| push(Some(*term), &[*term]));
            }
        }
    }
}

/// The term on each of its groups only, and on each other group of the boundary.
fn groups(problem: &Problem, term: usize, all: &mut Vec<Entry>) {
    let integral = &problem.integrals[term];
    let measure = &integral.measure;
    let on = |group: usize| {
        let mut integral = integral.clone();
        integral.measure.groups = vec![group];
        vec![integral]
    };
    let fits = |k: &usize| problem.groups[*k].on == Some(measure.domain);
    let fitting: Vec<usize> = (0..problem.groups.len()).filter(fits).collect();
    let own = match measure.groups.is_empty() {
        true => &fitting,
        false => &measure.groups,
    };
    if own.len() > 1 {
        for &group in own {
            all.push(changed(
                Change::Group { term, group },
                problem,
                on(group),
                vec![],
            ));
        }
    }
    if measure.domain == Domain::Boundary && !measure.groups.is_empty() {
        for &group in fitting.iter().filter(|k| !own.contains(k)) {
            let change = Change::Moved { term, group };
            all.push(changed(change, problem, on(group), vec![term]));
        }
    }
}

/// Parts by derivative and by component of the test function, and factors that vary.
fn parts(problem: &Problem, term: usize, all: &mut Vec<Entry>) {
    let integral = &problem.integrals[term];
    let of = |is: &dyn Fn(&Leaf) -> bool| {
        let mut part = integral.clone();
        part.terms.retain(|leaf, _| is(leaf));
        part
    };
    let slopes: BTreeSet<usize> = integral.terms.keys().filter_map(|leaf| leaf.axis).collect();
    let components: BTreeSet<usize> = integral.terms.keys().map(|leaf| leaf.component).collect();
    let mut push = |part: Part, of: Integral| {
        all.push(changed(
            Change::Part { term, part },
            problem,
            vec![of],
            vec![],
        ));
    };
    if slopes.len() > 1 {
        for axis in slopes {
            push(Part::Slope(axis), of(&|leaf| leaf.axis == Some(axis)));
        }
    }
    if components.len() > 1 {
        for component in components {
            push(
                Part::Component(component),
                of(&|leaf| leaf.component == component),
            );
        }
    }
    for axis in 0..problem.dim {
        let mut problem = problem.clone();
        let mut integral = integral.clone();
        let x = problem.scalars.push(Node::Coordinate(axis));
        for value in integral.terms.values_mut() {
            *value = problem.scalars.multiply(*value, x);
        }
        let change = Change::Varying { term, axis };
        all.push(changed(change, &problem, vec![integral], vec![]));
    }
}

/// Test function and unknown interchanged, if the term is linear in the unknown.
fn transposed(problem: &Problem, term: usize, all: &mut Vec<Entry>) {
    let mut problem = problem.clone();
    let mut integral = problem.integrals[term].clone();
    if !problem.is_bilinear(&integral) {
        return;
    }
    let by = problem.derivative(&integral);
    integral.terms.clear();
    for ((test, increment), value) in by {
        let (Field::Test(k), Field::Increment(l)) = (test.field, increment.field) else {
            continue;
        };
        let with = |leaf: Leaf, field: Field| Leaf { field, ..leaf };
        let unknown = problem.scalars.leaf(with(test, Field::Unknown(k)));
        let value = problem.scalars.multiply(value, unknown);
        let test = with(increment, Field::Test(l));
        let sum = match integral.terms.get(&test) {
            Some(before) => problem.scalars.add(*before, value),
            None => value,
        };
        integral.terms.insert(test, sum);
    }
    let change = Change::Transposed { term };
    all.push(changed(change, &problem, vec![integral], vec![term]));
}

/// A datum that is interpolated, or 1: in all terms that contain it, and in each if there are several.
fn data(problem: &Problem, datum: usize, all: &mut Vec<Entry>) {
    let is_it = |leaf: &Leaf| leaf.field == Field::Datum(datum);
    let has = |integral: &Integral| {
        let leaves = problem.scalars.leaves(integral.terms.values().copied());
        leaves.iter().any(is_it)
    };
    let terms = 0..problem.integrals.len();
    let with: Vec<usize> = terms.filter(|k| has(&problem.integrals[*k])).collect();
    let of = |terms: &[usize], integrals: &[Integral]| {
        terms
            .iter()
            .map(|k| integrals[*k].clone())
            .collect::<Vec<_>>()
    };
    let known = problem.data[datum].space.map(|space| space.element);
    let size = problem.data[datum].shape.iter().product::<usize>();
    let size = (!problem.data[datum].shape.is_empty()).then_some(size);
    let mut choices: Vec<(Interpolated, Option<Space>)> = Vec::new();
    if known.is_some() {
        choices.push((Interpolated::Points, None));
    }
    for degree in 0..=2 {
        let element = match degree {
            0 => Element::Broken(0),
            _ => Element::Continuous(degree),
        };
        if known != Some(element) {
            choices.push((Interpolated::Degree(degree), Some(Space { element, size })));
        }
    }
    for (by, space) in choices {
        let mut problem = problem.clone();
        problem.data[datum].space = space;
        let integrals = problem.integrals.clone();
        let mut push = |terms: &[usize], term: Option<usize>| {
            let change = Change::Data { datum, term, by };
            all.push(changed(
                change,
                &problem,
                of(terms, &integrals),
                terms.to_vec(),
            ));
        };
        push(&with, None);
        if with.len() > 1 {
            with.iter().for_each(|term| push(&[*term], Some(*term)));
        }
    }
    let one = |scalars: &mut Scalars, node: Node| match node {
        Node::Leaf(leaf) if is_it(&leaf) => {
            Some(scalars.number(if leaf.axis.is_none() { 1.0 } else { 0.0 }))
        }
        _ => None,
    };
    let (terms, problem, integrals) = replaced(problem, one);
    let (change, integrals) = (Change::One { datum }, of(&terms, &integrals));
    all.push(changed(change, &problem, integrals, terms));
}

/// The terms that contain some nodes, and all terms with these nodes replaced.
fn replaced(
    problem: &Problem,
    with: impl Fn(&mut Scalars, Node) -> Option<Id>,
) -> (Vec<usize>, Problem, Vec<Integral>) {
    let mut problem = problem.clone();
    let mut integrals = problem.integrals.clone();
    let mut terms = Vec::new();
    for (k, integral) in integrals.iter_mut().enumerate() {
        let mut is_in = false;
        for value in integral.terms.values_mut() {
            let mut each = |scalars: &mut Scalars, node: Node| {
                let other = with(scalars, node);
                is_in |= other.is_some();
                other
            };
            *value = problem.scalars.map(*value, &mut each);
        }
        if is_in {
            terms.push(k);
        }
    }
    (terms, problem, integrals)
}

/// Another length for h, and another normal: in all terms that contain it, and in each if there are several.
fn sizes(residual: &Residual<'_>, all: &mut Vec<Entry>) {
    let (problem, mesh) = (residual.problem, &residual.assembler.mesh);
    let mut push = |change: &dyn Fn(Option<usize>) -> Change,
                    with: &dyn Fn(&mut Scalars, Node) -> Option<Id>| {
        let (terms, problem, integrals) = replaced(problem, with);
        let one = (terms.len() > 1).then_some(&terms).into_iter().flatten();
        let each = one.map(|term| (Some(*term), vec![*term]));
        let whole = (!terms.is_empty()).then(|| (None, terms.clone()));
        for (term, terms) in whole.into_iter().chain(each) {
            let integrals = terms.iter().map(|k| integrals[*k].clone()).collect();
            all.push(changed(change(term), &problem, integrals, terms));
        }
    };
    push(&|term| Change::Normal { term }, &|scalars, node| {
        let is_it = matches!(node, Node::Normal(..));
        is_it.then(|| {
            let n = scalars.push(node);
            scalars.negative(n)
        })
    });
    let mut push = |of: Length, size: Size, number: Option<f64>| {
        push(
            &|term| Change::Size { term, of, size },
            &|scalars, node| match (node, size) {
                (Node::Length(own, _), _) if own != of => None,
                (Node::Length(_, side), Size::Of(length)) => {
                    Some(scalars.push(Node::Length(length, side)))
                }
                (Node::Length(..), _) => Some(scalars.number(number.unwrap_or(f64::NAN))),
                _ => None,
            },
        );
    };
    let all = [
        Length::Diameter,
        Length::Circumradius,
        Length::Inradius,
        Length::Facet,
    ];
    let own = all.into_iter().filter(|of| problem.has_length(*of));
    for of in own.filter(|_| mesh.shape == Cells::Simplices) {
        for length in all.into_iter().filter(|length| *length != of) {
            push(of, Size::Of(length), None);
        }
    }
    if problem.has_length(Length::Diameter) {
        let each = (0..mesh.cell_count()).map(|cell| mesh.diameter(&mesh.vertices(cell)));
        let [low, high] = each.fold([f64::INFINITY, 0.0], |[low, high], h| {
            [h.min(low), h.max(high)]
        });
        push(Length::Diameter, Size::Largest, Some(high));
        push(Length::Diameter, Size::Smallest, Some(low));
    }
}

/// The constraint of a body on Γ_C of a scene of elasticity: none, or a penalty.
fn obstacle(problem: &Problem, all: &mut Vec<Entry>) {
    let Some(parts) = &problem.parts else { return };
    let of_name = |name: &String| find_group(&problem.groups, name, problem.dim - 1).ok();
    let mut groups: Vec<usize> = parts.contact.iter().filter_map(of_name).collect();
    groups.sort_unstable();
    let is_there = |k: &usize| {
        let measure = &problem.integrals[*k].measure;
        measure.domain == Domain::Boundary && measure.groups == groups
    };
    let terms: Vec<usize> = (0..problem.integrals.len()).filter(is_there).collect();
    let nothing = terms.iter().map(|k| {
        let mut problem = problem.clone();
        let mut integral = problem.integrals[*k].clone();
        let zero = problem.scalars.number(0.0);
        integral.terms.values_mut().for_each(|value| *value = zero);
        (problem, integral)
    });
    // The scalar 0 has the same position in all of them.
    let (problems, nothing): (Vec<Problem>, Vec<Integral>) = nothing.unzip();
    if let Some(with) = problems.first() {
        all.push(changed(Change::Uncoupled, with, nothing, terms));
    }
    for (by, scale) in [(Penalty::Integrated, ""), (Penalty::OverH, "/h")] {
        let over = parts.contact.join(", ");
        let text = format!("max(w_n(u) - psi, 0)*w_n(v){scale}*ds([{over}])");
        let mut own = problem.clone();
        let Ok(formula) = Formula::new(text, &own.definitions) else {
            return;
        };
        let names = Names {
            dim: own.dim,
            cells: own.cells,
            unknowns: &own.unknowns,
            parameters: &own.parameters,
            data: &own.data,
            groups: &own.groups,
            unmarked: 0,
            is_timed: false,
        };
        if let Ok(integrals) = Reader::new(names, &mut own.scalars).form(&formula.term) {
            all.push(changed(
                Change::Obstacle { by },
                &own,
                integrals,
                Vec::new(),
            ));
        }
    }
}

/// Terms that may be added: the product of an unknown, or a partial derivative of it, and its test function.
fn added(problem: &Problem, unknown: usize, all: &mut Vec<Entry>) {
    let (mut problem, dim) = (problem.clone(), problem.dim);
    let is_vector = problem.unknowns[unknown].space.element.is_vector();
    let mut product = |axis: Option<usize>| {
        let terms = (0..problem.unknowns[unknown].space.count()).map(|component| {
            let leaf = |field: Field, axis: Option<usize>| Leaf {
                field,
                component,
                axis,
                second: None,
                side: Side::Here,
            };
            let value: Id = problem.scalars.leaf(leaf(Field::Unknown(unknown), axis));
            (leaf(Field::Test(unknown), None), value)
        });
        Integral {
            measure: crate::problem::Measure {
                domain: Domain::Cells,
                groups: Vec::new(),
                degree: None,
            },
            terms: terms.collect(),
            at: 0,
            is_mass: false,
        }
    };
    let integral = product(None);
    let axes = if is_vector { 0..0 } else { 0..dim };
    let slopes: Vec<Integral> = axes.map(|axis| product(Some(axis))).collect();
    for (axis, slope) in slopes.into_iter().enumerate() {
        let change = Change::Slope { unknown, axis };
        all.push(changed(change, &problem, vec![slope], Vec::new()));
    }
    let own = problem.rules();
    let others = problem.cells.rules(problem.dim).into_iter();
    // Rules that are exact for the product give the same.
    let degree = 2 * problem.unknowns[unknown].space.element.degree();
    let others = others.filter(|rule| rule.name != own[0].name && rule.degree < degree);
    let each = others.map(|rule| (Some(rule.name), rule));
    for (rule, cells) in std::iter::once((None, own[0].clone())).chain(each) {
        all.push(Entry {
            change: Change::Mass { unknown, rule },
            make: Make::Integrals {
                problem: Box::new(problem.clone()),
                integrals: vec![integral.clone()],
                rules: [cells, own[1].clone()],
                less: Vec::new(),
            },
        });
    }
}
