//! P2 on the fine mesh, on that of half its n and of a quarter: the paper's reference, and how far it can be trusted.

use serde::Serialize;

use super::distance::Truth;
use super::example::Example;
use super::fine::{Fine, fine_errors, step_between};
use super::study::steps_to;
use super::work::{Work, cost};
use crate::contact::{Errors, Iteration, Method, Problem, Quantities, Stop, quantities, solve};
use crate::element::Space;
use crate::error::{Error, Result};
use crate::mesh::Triangulation;
use crate::orders::Observed;

/// P2 on the fine mesh and on those of half and a quarter of its n.
#[derive(Debug, Serialize)]
pub struct FineOutcome {
    pub n: Vec<usize>,
    pub dofs: Vec<usize>,
    /// Steps of Newton until the increment was below the paper's tolerance.
    pub steps: Vec<Option<usize>>,
    pub converged: bool,
    /// To the mesh-free reference.
    pub errors: Vec<Errors>,
    pub h1: Observed,
    pub l2: Observed,
    /// ‖∇(U-V)‖/‖∇U‖ of each mesh's U and the V before it.
    pub steps_between: Vec<f64>,
    /// Between which H¹ errors P2's own steps put that of the fine mesh; none where they do not shrink.
    pub predicted: Option<[f64; 2]>,
    /// Where Γ_C carries contact, by the fine solution itself.
    pub contact_set: Vec<[f64; 2]>,
    /// u on a grid, for its elevation.
    #[serde(skip)]
    pub elevation: Vec<Vec<f64>>,
}

/// The elevation is drawn from this many intervals each way.
const ELEVATION: usize = 48;

/// P2 on one mesh.
pub struct Solved<'a> {
    n: usize,
    space: Space<'a>,
    u: Vec<f64>,
    norms: Quantities,
}

impl Solved<'_> {
    pub fn known(&self) -> Fine<'_> {
        Fine::new(&self.space, &self.u, self.n, &self.norms)
    }

    fn elevation(&self) -> Vec<Vec<f64>> {
        let known = self.known();
        let at = |k: usize| k as f64 / ELEVATION as f64;
        let row = |j: usize| (0..=ELEVATION).map(|i| known.value(at(i), at(j))).collect();
        (0..=ELEVATION).map(row).collect()
    }
}

/// Solves on `meshes`, each with twice the n of the one before, and keeps the last solution.
///
/// # Errors
/// What solving refuses, and an interruption.
pub fn run_fine<'a>(
    example: &Example,
    meshes: &'a [(usize, Triangulation)],
    work: &Work,
) -> Result<(Solved<'a>, FineOutcome)> {
    let (mut dofs, mut steps, mut errors, mut between) = (vec![], vec![], vec![], vec![]);
    let mut converged = true;
    let mut last: Option<Solved<'a>> = None;
    for (n, mesh) in meshes {
        let n = *n;
        let what = format!("{}, p2 on {n} × {n}", example.title());
        work.tell(&what)?;
        let problem = Problem::new(&example.scene, mesh, Method::p2())?;
        let solution = solve(&problem, Iteration::Newton, Stop::default(), |step, _| {
            work.tell(&format!("{what}, step {step}"))
        })?;
        work.tell(&format!("{what}, its errors"))?;
        let norms = quantities(&problem, &solution.u);
        errors.push(fine_errors(&problem, &solution.u, &norms, &example.truth));
        if let Some(coarse) = &last {
            between.push(step_between(&problem, &solution.u, &coarse.known()));
        }
        converged &= solution.converged;
        dofs.push(problem.space.dofs);
        steps.push(steps_to(super::TOL, &solution.increments));
        work.finish(cost::fine(n));
        let Problem { space, .. } = problem;
        last = Some(Solved {
            n,
            space,
            u: solution.u,
            norms,
        });
    }
    let Some(solved) = last else {
        return Err(Error::usage("there is no fine mesh", "report this"));
    };
    let n: Vec<usize> = meshes.iter().map(|(n, _)| *n).collect();
    let observed = |error: fn(&Errors) -> f64| {
        let pairs: Vec<_> = n.iter().copied().zip(errors.iter().map(error)).collect();
        Observed::new(&pairs)
    };
    let outcome = FineOutcome {
        h1: observed(|e| e.h1),
        l2: observed(|e| e.l2),
        n,
        dofs,
        steps,
        converged,
        errors,
        predicted: predicted(&between),
        steps_between: between,
        contact_set: solved.norms.contact_set.clone(),
        elevation: solved.elevation(),
    };
    Ok((solved, outcome))
}

/// The H¹ errors that P2's own steps d₁, d₂ predict: with order p, from d₁/d₂ = 2^p.
///
/// The errors before and after the step d₂ are e₁ = 2^p e₂. Where they are parallel, d₂ = e₁ - e₂; where the new error is orthogonal to
/// the step, as for Galerkin's method, d₂² = e₁² - e₂². Nitsche's method lies between.
fn predicted(between: &[f64]) -> Option<[f64; 2]> {
    let &[first, second] = between else {
        return None;
    };
    let ratio = first / second;
    (ratio > 1.0).then(|| {
        [
            second / (ratio * ratio - 1.0).sqrt(),
            second / (ratio - 1.0),
        ]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_predict_errors() {
        // Errors 1, 1/4, 1/16 that are parallel, and such that are orthogonal to the steps.
        let [_, parallel] = predicted(&[0.75, 0.1875]).unwrap();
        assert!((parallel - 0.0625).abs() < 1e-15);
        let [orthogonal, _] = predicted(&[0.9375_f64.sqrt(), 0.9375_f64.sqrt() / 4.0]).unwrap();
        assert!((orthogonal - 0.0625).abs() < 1e-15);
        assert!(predicted(&[1.0, 1.0]).is_none() && predicted(&[1.0]).is_none());
    }
}
