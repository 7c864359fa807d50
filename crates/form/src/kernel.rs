//! Constants that a form does not see: the pressure of a flow whose velocity is given on the whole boundary.
//!
//! If p occurs only as c p div(v), then a constant p adds c ∫ div v = c ∫ v·n, the integral over the boundary, and this is 0 for test
//! functions that vanish there. Codes then solve a singular system, and each returns another constant.

use std::collections::{BTreeMap, BTreeSet};

use crate::problem::{Domain, Problem};
use crate::scalar::{Field, Leaf};

/// The position of a scalar unknown up to a constant, and that of the vector whose values determine it nowhere.
pub fn free_constant(problem: &mut Problem, unmarked: usize) -> Option<(usize, usize)> {
    if unmarked > 0 {
        return None;
    }
    let is_scalar = |k: &usize| problem.unknowns[*k].space.size.is_none();
    let is_free = |k: &usize| problem.conditions.iter().all(|c| c.unknown != *k);
    let candidates = (0..problem.unknowns.len()).filter(|k| is_scalar(k) && is_free(k));
    candidates
        .collect::<Vec<_>>()
        .into_iter()
        .find_map(|k| Some((k, only_by_divergence(problem, k)?)))
}

/// The vector v, given on the whole boundary, if F depends on the values of unknown k as c p div(v) only.
fn only_by_divergence(problem: &mut Problem, k: usize) -> Option<usize> {
    let mut divergence: BTreeMap<usize, BTreeMap<usize, f64>> = BTreeMap::new();
    let is_value = |leaf: &Leaf| leaf.field == Field::Unknown(k) && leaf.axis.is_none();
    for integral in problem.residual() {
        for (test, coefficient) in &integral.terms {
            for by in problem.scalars.partials(*coefficient, is_value).values() {
                let Field::Test(v) = test.field else {
                    return None;
                };
                let is_whole =
                    integral.measure.domain == Domain::Cells && integral.measure.groups.is_empty();
                let factor = problem.scalars.number_of(*by)?;
                if !is_whole || test.axis != Some(test.component) {
                    return None;
                }
                *divergence
                    .entry(v)
                    .or_default()
                    .entry(test.component)
                    .or_default() += factor;
            }
        }
    }
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
    divergence
        .iter()
        .all(|(v, factors)| is_divergence(v, factors) && is_given(v))
        .then(|| divergence.keys().next().copied())?
}
