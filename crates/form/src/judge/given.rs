//! Determines the values on Dirichlet groups from the result, if they are not the prescribed ones.
//!
//! Other values are compared one by one. A condition that is not imposed at all, or by a penalty, shows in the rows that it replaces: they
//! hold with the terms of the penalty.

use std::collections::BTreeMap;

use faceoff_fem::linear::General;
use faceoff_fem::quadrature::{self, Rule};

use super::change::{Cause, Change, Given, Penalty};
use super::dictionary::integrated;
use super::residual::{Residual, add, dot, largest};
use crate::grid::Cells;
use crate::own::{Shape, facets, is_on_facet, value};
use crate::problem::{Domain, Held, Integral, Measure, Problem};
use crate::scalar::{Field, Id, Leaf, Length, Node, Side};

/// Values are equal up to this fraction of the largest, and a row holds up to this fraction of its size.
const ROUNDING: f64 = 1e-12;
/// If numbers were rounded when they were written, a value may be wrong by this many units of their last digits.
const WRITTEN: f64 = 4.0;
/// A penalty leaves at most this fraction of the rows that it explains.
const EXPLAINED: f64 = 1e-6;

/// Differences of which rounding is more than this fraction explain nothing.
const CLEAR: f64 = 0.1;

/// A dof on a facet of a condition.
struct Place {
    dof: usize,
    at: [f64; 3],
    /// The value of g.
    given: f64,
    /// The linear interpolation of g from the vertices of the facet.
    linear: f64,
}

/// A component of an unknown that is prescribed on a group.
struct Condition {
    held: Held,
    component: usize,
    facets: Vec<u32>,
    places: Vec<Place>,
}

/// A change for each condition with other values; empty if one of them is unknown. Functions of vectors as a whole are not examined.
pub fn explain(residual: &Residual<'_>, unit: f64) -> Vec<Cause> {
    let held = residual.problem.held().into_iter().enumerate();
    let all = held.filter_map(|(k, held)| Some((k, condition(residual, held)?)));
    let all: Vec<(usize, Condition)> = all.collect();
    let mut given: BTreeMap<usize, Vec<(usize, f64)>> = BTreeMap::new();
    for (k, condition) in &all {
        for place in &condition.places {
            given.entry(place.dof).or_default().push((*k, place.given));
        }
    }
    let values = Values {
        residual,
        given,
        same: ROUNDING.max(WRITTEN * unit) * largest(&residual.u),
    };
    let off = all
        .iter()
        .filter(|(k, c)| values.off(*k, c).next().is_some());
    let off: Vec<&(usize, Condition)> = off.collect();
    if off.is_empty() {
        return Vec::new();
    }
    if let Some(cause) = values.penalty(&all) {
        return vec![cause];
    }
    let each = off.iter().map(|(k, condition)| {
        let (by, factor) = values.cause(*k, condition, &all)?;
        let change = Change::Given { condition: *k, by };
        Some(Cause { change, factor })
    });
    each.collect::<Option<Vec<Cause>>>().unwrap_or_default()
}

/// The dofs of a condition; `None` if it prescribes vectors as a whole.
fn condition(residual: &Residual<'_>, held: Held) -> Option<Condition> {
    let (problem, assembler) = (residual.problem, &residual.assembler);
    let (mesh, dofs) = (&assembler.mesh, &assembler.dofs);
    let component = held.component?;
    let element = problem.unknowns[held.unknown].space.element;
    let facets = facets(problem, mesh, residual.source, held.group);
    let nodes = Shape::of(element, mesh.shape).nodes(mesh.dim);
    let g = |at: &[f64; 3]| value(problem, held.values[0], &residual.parameters, at);
    let mut places = Vec::new();
    for facet in &facets {
        let cell = mesh.face_cells(*facet as usize)[0] as usize;
        let local = mesh.local_face(cell, *facet as usize);
        let vertices = mesh.vertices(cell);
        let at_vertices = vertices.map(|x| g(&x));
        let own = dofs.of_cell(held.unknown, cell).iter().zip(&nodes);
        for (i, (node, lambda)) in own.enumerate() {
            if is_on_facet(element, mesh.shape, mesh.dim, i, local) {
                let at = mesh.place(&vertices, lambda);
                let parts = mesh.shape.parts(mesh.dim, lambda);
                let each = parts
                    .iter()
                    .zip(&at_vertices)
                    .filter(|(part, _)| **part != 0.0);
                places.push(Place {
                    dof: dofs.first[*node as usize] as usize + component,
                    at,
                    given: g(&at),
                    linear: each.map(|(part, g)| part * g).sum(),
                });
            }
        }
    }
    Some(Condition {
        held,
        component,
        facets,
        places,
    })
}

/// The values of a result where some are given.
struct Values<'a> {
    residual: &'a Residual<'a>,
    /// By dof the values of conditions, with their positions; the last one counts.
    given: BTreeMap<usize, Vec<(usize, f64)>>,
    /// The tolerance for equal values.
    same: f64,
}

impl Values<'_> {
    fn is(&self, dof: usize, value: f64) -> bool {
        (self.residual.u[dof] - value).abs() <= self.same
    }

    /// The dofs that no later condition prescribes, and whose value is none of the prescribed ones.
    fn off<'b>(&'b self, k: usize, condition: &'b Condition) -> impl Iterator<Item = &'b Place> {
        let is_off = move |place: &&Place| {
            let given = &self.given[&place.dof];
            let is_own = given.last().is_some_and(|(last, _)| *last == k);
            is_own && !given.iter().any(|(_, g)| self.is(place.dof, *g))
        };
        condition.places.iter().filter(is_off)
    }

    /// How one condition is imposed, or which values are.
    fn cause(
        &self,
        k: usize,
        condition: &Condition,
        all: &[(usize, Condition)],
    ) -> Option<(Given, f64)> {
        let off: Vec<&Place> = self.off(k, condition).collect();
        // Does the result have these values, or those of another condition where conditions meet?
        let fits = |values: &dyn Fn(&Place) -> f64| {
            condition.places.iter().all(|place| {
                let others = self.given[&place.dof]
                    .iter()
                    .filter(|(other, _)| *other != k);
                let mut others = others.map(|(_, g)| *g);
                let is = |value: f64| self.is(place.dof, value);
                is(values(place)) || others.any(is)
            })
        };
        let Residual {
            u, sizes, whole, ..
        } = self.residual;
        let holds = |place: &Place| whole[place.dof].abs() <= ROUNDING * sizes[place.dof];
        if off.iter().all(|place| holds(place)) {
            return Some((Given::Free, 1.0));
        }
        let [ug, gg] = off.iter().fold([0.0, 0.0], |[ug, gg], place| {
            let g = place.given;
            [ug + u[place.dof] * g, gg + g * g]
        });
        let mean = off
            .iter()
            .map(|place| u[place.dof] - place.given)
            .sum::<f64>()
            / off.len() as f64;
        // A single value has any factor.
        let has_many = off.len() > 1;
        if fits(&|_| 0.0) {
            return Some((Given::Factor, 0.0));
        }
        if fits(&|place| place.linear) {
            return Some((Given::Linear, 1.0));
        }
        for (k, other) in all
            .iter()
            .filter(|(_, c)| c.held.unknown == condition.held.unknown)
        {
            let g = |place: &Place| {
                let problem = self.residual.problem;
                value(
                    problem,
                    other.held.values[0],
                    &self.residual.parameters,
                    &place.at,
                )
            };
            if fits(&g) {
                return Some((Given::Of(*k), 1.0));
            }
        }
        if gg > 0.0 && (has_many || (ug / gg + 1.0).abs() < ROUNDING) {
            let factor = ug / gg;
            if fits(&|place| factor * place.given) {
                return Some((Given::Factor, factor));
            }
        }
        if has_many && fits(&|place| place.given + mean) {
            return Some((Given::Added, mean));
        }
        let dim = self.residual.problem.dim - 1;
        let names = quadrature::names(dim)
            .iter()
            .chain(quadrature::foreign(dim));
        let mut rules = names.filter_map(|name| quadrature::rule(dim, name));
        rules.find_map(|rule| {
            let projections =
                [false, true].map(|is_whole| self.projected(condition, &rule, is_whole));
            let is_it = |values: &BTreeMap<usize, f64>| {
                fits(&|place| values.get(&place.dof).copied().unwrap_or(f64::NAN))
            };
            let is_one = projections.iter().flatten().any(is_it);
            is_one.then_some((Given::Projected(rule.name), 1.0))
        })
    }

    /// The projection of g in L² on the facets of a condition: on each facet separately, with the average where they meet, or on all of them as a
    /// whole; on facets of triangles and tetrahedra.
    fn projected(
        &self,
        condition: &Condition,
        rule: &Rule,
        is_whole: bool,
    ) -> Option<BTreeMap<usize, f64>> {
        if self.residual.assembler.mesh.shape == Cells::Cubes {
            return None;
        }
        let (problem, assembler) = (self.residual.problem, &self.residual.assembler);
        let (mesh, dofs) = (&assembler.mesh, &assembler.dofs);
        let Held {
            unknown, values, ..
        } = &condition.held;
        let element = problem.unknowns[*unknown].space.element;
        let numbers: BTreeMap<usize, usize> = {
            let mut own: Vec<usize> = condition.places.iter().map(|place| place.dof).collect();
            own.sort_unstable();
            own.dedup();
            own.into_iter().zip(0..).collect()
        };
        let mut rows: Vec<BTreeMap<usize, f64>> = vec![BTreeMap::new(); numbers.len()];
        let mut right = vec![0.0; numbers.len()];
        let mut averages = vec![(0.0, 0.0); numbers.len()];
        for facet in &condition.facets {
            let cell = mesh.face_cells(*facet as usize)[0] as usize;
            let local = mesh.local_face(cell, *facet as usize);
            let geometry = mesh.geometry(cell);
            let corners: Vec<usize> = (0..=mesh.dim).filter(|i| *i != local).collect();
            let points: Vec<[f64; 4]> = (0..rule.weights.len())
                .map(|q| {
                    let mut lambda = [0.0; 4];
                    let each = corners.iter().zip(rule.barycentric(q));
                    each.for_each(|(corner, l)| lambda[*corner] = l);
                    lambda
                })
                .collect();
            let table = Shape::of(element, mesh.shape).table(mesh.dim, &points);
            let own = dofs.of_cell(*unknown, cell).iter().enumerate();
            let own = own.filter(|(i, _)| is_on_facet(element, mesh.shape, mesh.dim, *i, local));
            let own: Vec<(usize, usize)> = own
                .map(|(i, node)| (i, dofs.first[*node as usize] as usize + condition.component))
                .collect();
            let mut mass = vec![vec![(0, 0.0); own.len()]; own.len()];
            let mut load = vec![0.0; own.len()];
            for (q, weight) in rule.weights.iter().enumerate() {
                let weight = weight * geometry.face_measure(local);
                let at = mesh.place(&mesh.vertices(cell), &points[q]);
                let g = value(problem, values[0], &self.residual.parameters, &at);
                let row = table.row(0, q);
                for (i, (local, _)) in own.iter().enumerate() {
                    load[i] += weight * g * row[*local];
                    for (j, (other, _)) in own.iter().enumerate() {
                        mass[i][j].0 = j;
                        mass[i][j].1 += weight * row[*local] * row[*other];
                    }
                }
            }
            for (i, (_, dof)) in own.iter().enumerate() {
                right[numbers[dof]] += load[i];
                for (j, (_, other)) in own.iter().enumerate() {
                    *rows[numbers[dof]].entry(numbers[other]).or_default() += mass[i][j].1;
                }
            }
            if !is_whole {
                let found = General::new(mass, &[], None).ok()?.solve(&load).ok()?;
                for ((_, dof), value) in own.iter().zip(found) {
                    let (sum, count) = &mut averages[numbers[dof]];
                    *sum += value;
                    *count += 1.0;
                }
            }
        }
        let found = match is_whole {
            false => averages
                .into_iter()
                .map(|(sum, count)| sum / count)
                .collect(),
            true => {
                let rows = rows.into_iter().map(|row| row.into_iter().collect());
                General::new(rows.collect(), &[], None)
                    .ok()?
                    .solve(&right)
                    .ok()?
            }
        };
        Some(numbers.into_keys().zip(found).collect())
    }

    /// One penalty for all conditions: k times u - g at each dof, or integrated with the test function, also over h.
    fn penalty(&self, all: &[(usize, Condition)]) -> Option<Cause> {
        let Residual {
            u, sizes, whole, ..
        } = self.residual;
        let held = &self.residual.held;
        let off = |k: &usize| !self.is(*k, held.values[*k]);
        let dofs: Vec<usize> = self.given.keys().copied().filter(off).collect();
        let only = |of: &[f64]| -> Vec<f64> { dofs.iter().map(|k| of[*k]).collect() };
        let r = only(whole);
        let differences: Vec<f64> = dofs.iter().map(|k| u[*k] - held.values[*k]).collect();
        let ways = [
            (Penalty::AtDofs, differences),
            (Penalty::Integrated, only(&self.integrated(all, false))),
            (Penalty::OverH, only(&self.integrated(all, true))),
        ];
        ways.into_iter().find_map(|(by, m)| {
            let k = -dot(&r, &m) / dot(&m, &m);
            // For a small difference, rounding of u leaves few digits.
            let rest = r.iter().zip(&m).zip(&dofs).map(|((r, m), dof)| {
                let digits = k * self.same + ROUNDING * sizes[*dof];
                ((r + k * m).abs() - digits).max(0.0)
            });
            let rest: Vec<f64> = rest.collect();
            let has_digits = k * self.same <= CLEAR * largest(&r);
            let is_small = largest(&rest) <= EXPLAINED * largest(&r);
            let is_it = k > 0.0 && has_digits && is_small && dofs.len() > 1;
            let change = Change::Penalty { by };
            is_it.then_some(Cause { change, factor: k })
        })
    }

    /// ∫ (u - g) v over the facets of all conditions, or the same divided by the diameter of the cell.
    fn integrated(&self, all: &[(usize, Condition)], is_over_h: bool) -> Vec<f64> {
        let residual = self.residual;
        let mut sum = vec![0.0; residual.u.len()];
        for (_, condition) in all {
            let mut problem = residual.problem.clone();
            let integral = penalty(&mut problem, condition, is_over_h);
            let rules = problem.rules();
            let own = integrated(residual, &problem, &integral, &rules, &residual.parameters);
            add(&mut sum, &own, 1.0);
        }
        sum
    }
}

fn penalty(problem: &mut Problem, condition: &Condition, is_over_h: bool) -> Integral {
    let leaf = |field: Field| Leaf {
        field,
        component: condition.component,
        axis: None,
        second: None,
        side: Side::Here,
    };
    let Held {
        unknown,
        group,
        values,
        ..
    } = &condition.held;
    let scalars = &mut problem.scalars;
    let u = scalars.leaf(leaf(Field::Unknown(*unknown)));
    let mut value: Id = scalars.subtract(u, values[0]);
    if is_over_h {
        let h = scalars.push(Node::Length(Length::Diameter, Side::Here));
        value = scalars.divide(value, h);
    }
    Integral {
        measure: Measure {
            domain: Domain::Boundary,
            groups: vec![*group],
            degree: None,
        },
        terms: [(leaf(Field::Test(*unknown)), value)].into_iter().collect(),
        at: 0,
        is_mass: false,
    }
}
