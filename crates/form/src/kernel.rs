//! Constants in the kernel of a form: the pressure of a flow whose velocity is prescribed on the whole boundary.
//!
//! If p occurs only as c p div(v), then a constant p adds c ∫ div v = c ∫ v·n, the integral over the boundary, and this is 0 for test
//! functions that vanish there. Codes then solve a singular system, and each returns a different constant.

use std::collections::{BTreeMap, BTreeSet};

use crate::problem::{Domain, Element, Problem};
use crate::scalar::{Field, Id, Leaf};
use crate::swap;

/// Why a constant can be added to an unknown without any change of F.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Free {
    /// F only depends on its derivatives and jumps.
    Differences,
    /// F depends on its values times the divergence of a vector, at this position, that is prescribed on the whole boundary.
    Divergence(usize),
}

/// Is the scalar unknown k determined only up to a constant, and why?
pub fn free_constant(problem: &mut Problem, unmarked: usize, k: usize) -> Option<Free> {
    let is_held = problem.conditions.iter().any(|c| c.unknown == k);
    if is_held || problem.unknowns[k].space.size.is_some() {
        return None;
    }
    let mut divergence: BTreeMap<usize, BTreeMap<usize, f64>> = BTreeMap::new();
    let is_value = |leaf: &Leaf| leaf.field == Field::Unknown(k) && leaf.axis.is_none();
    for integral in problem.residual() {
        for (test, coefficient) in &integral.terms {
            let by = problem.scalars.partials(*coefficient, is_value);
            let by: Vec<Id> = by.into_values().collect();
            if cancel(problem, &by) {
                continue;
            }
            let (Field::Test(v), [by]) = (test.field, &by[..]) else {
                return None;
            };
            let is_whole =
                integral.measure.domain == Domain::Cells && integral.measure.groups.is_empty();
            let factor = problem.scalars.number_of(*by)?;
            // All derivatives of a Raviart–Thomas function are equal.
            let is_one = problem.unknowns[v].space.element == Element::RaviartThomas;
            if !is_whole || test.axis != Some(test.component) || test.second.is_some() {
                return None;
            }
            let all = divergence.entry(v).or_default();
            for component in 0..problem.dim {
                if is_one || component == test.component {
                    *all.entry(component).or_default() += factor;
                }
            }
        }
    }
    let Some(v) = divergence.keys().next() else {
        return Some(Free::Differences);
    };
    let is_given = |v: &usize| {
        let space = problem.unknowns[*v].space;
        let boundary = (0..problem.groups.len())
            .filter(|group| problem.groups[*group].on == Some(Domain::Boundary));
        let held: BTreeSet<(usize, usize)> = problem
            .conditions
            .iter()
            .filter(|c| c.unknown == *v)
            .map(|c| (c.group, c.component))
            .collect();
        boundary
            .flat_map(|group| (0..space.count()).map(move |c| (group, c)))
            .all(|both| held.contains(&both))
    };
    let is_divergence = |v: &usize, factors: &BTreeMap<usize, f64>| {
        problem.unknowns[*v].space.size == Some(problem.dim)
            && factors.len() == problem.dim
            && factors
                .values()
                .all(|factor| Some(factor) == factors.get(&0))
    };
    let is_free = unmarked == 0
        && divergence
            .iter()
            .all(|(v, factors)| is_divergence(v, factors) && is_given(v));
    is_free.then_some(Free::Divergence(*v))
}

/// Is the sum of some expressions 0 for all values of their leaves?
fn cancel(problem: &Problem, parts: &[Id]) -> bool {
    (0..4).all(|seed| {
        let of = |node| swap::random(problem, seed, node, false);
        let values = parts.iter().map(|id| problem.scalars.value(*id, &of));
        let (sum, size) = values.fold((0.0, 0.0), |(sum, size), v| (sum + v, size + v.abs()));
        sum.abs() <= 1e-8 * size
    })
}
