//! P2 on the fine mesh and on those with n/2 and n/4: the paper's reference, and its accuracy.

use serde::Serialize;

use super::example::Example;
use super::fine::{Fine, step_between};
use super::iterations::steps_to;
use super::work::{Part, Work};
use crate::campaigns::orders::Theory;
use crate::run::Observed;
use faceoff_fem::contact::{
    Discretisation, Errors, Iteration, Method, Problem, Stop, quantities, solve,
};
use faceoff_fem::known::{Function, fine_errors};
use faceoff_fem::truth::exact::Regularity;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Triangulation;

/// P2 on the fine mesh and on those with n/2 and n/4.
#[derive(Debug, Serialize)]
pub struct FineOutcome {
    /// Ascending, each twice the one before.
    pub n: Vec<usize>,
    /// On each mesh.
    pub dofs: Vec<usize>,
    /// Steps of Newton's method until the increment was below the paper's tolerance.
    pub steps: Vec<Option<usize>>,
    /// Did Newton's iteration reach its tolerance on all of them?
    pub converged: bool,
    /// With respect to the mesh-free reference.
    pub errors: Vec<Errors>,
    /// Orders of these errors in the energy norm.
    pub h1: Observed,
    /// Orders of these errors in L².
    pub l2: Observed,
    /// ‖∇(U-V)‖/‖∇U‖ for U on each mesh and V on the one before.
    pub steps_between: Vec<f64>,
    /// The interval of the H¹ error on the fine mesh that follows from P2's last step and the theoretical order.
    pub predicted: [f64; 2],
    /// The contact zones on Γ_C according to the fine solution.
    pub contact_set: Vec<[f64; 2]>,
    /// u on a grid, for its elevation plot.
    #[serde(skip)]
    pub elevation: Vec<Vec<f64>>,
}

/// The elevation plot has this many intervals in each direction.
const ELEVATION: usize = 48;

fn elevation(solved: &Fine) -> Vec<Vec<f64>> {
    let at = |k: usize| k as f64 / ELEVATION as f64;
    let row = |j: usize| {
        (0..=ELEVATION)
            .map(|i| solved.value(at(i), at(j)))
            .collect()
    };
    (0..=ELEVATION).map(row).collect()
}

/// Solves on `meshes`, each with twice the n of the one before, and keeps the last solution.
///
/// # Errors
/// Errors of the solver, and an interruption.
pub fn run_fine<'a>(
    example: &'a Example,
    meshes: &'a [(usize, Triangulation)],
    work: &Work,
) -> Result<(Fine<'a>, FineOutcome)> {
    let (mut dofs, mut steps, mut errors, mut between) = (vec![], vec![], vec![], vec![]);
    let mut converged = true;
    let mut last: Option<Fine<'a>> = None;
    for (n, mesh) in meshes {
        let n = *n;
        let what = format!("{}, p2 on {n} × {n}", example.title());
        work.next(&what)?;
        let problem = Problem::new(
            &example.scene,
            mesh,
            &Discretisation::of(&example.scene, Method::p2()),
        )?;
        let solution = solve(&problem, Iteration::Newton, Stop::default(), |step, _| {
            work.next(&format!("{what}, step {step}"))
        })?;
        work.next(&format!("{what}, its errors"))?;
        let norms = quantities(&problem, &solution.u);
        errors.push(fine_errors(&problem, &solution.u, &norms, &example.truth));
        if let Some(coarse) = &last {
            between.push(step_between(&problem, &solution.u, coarse));
        }
        converged &= solution.converged;
        dofs.push(problem.space.dofs);
        steps.push(steps_to(super::TOL, &solution.increments));
        work.finish(Part::Fine.cost(n));
        let Problem { space, .. } = problem;
        last = Some(Fine {
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
    let observed =
        |error: fn(&Errors) -> f64| Observed::new(n.iter().copied().zip(errors.iter().map(error)));
    let last_step = between.last().copied().unwrap_or(f64::NAN);
    let outcome = FineOutcome {
        h1: observed(|e| e.h1),
        l2: observed(|e| e.l2),
        n,
        dofs,
        steps,
        converged,
        errors,
        predicted: predicted(last_step, order_of_theory()),
        steps_between: between,
        contact_set: solved.norms.contact_set.runs().to_vec(),
        elevation: elevation(&solved),
    };
    Ok((solved, outcome))
}

/// The H¹ error after a step to a mesh with half the h, if errors shrink like h^order.
///
/// The errors before and after are e₁ = 2^order e₂. If the new error is orthogonal to the step d, as for Galerkin's method, d² = e₁² - e₂²;
/// if it is parallel, d = e₁ - e₂. Nitsche's method is between the two.
fn predicted(step: f64, order: f64) -> [f64; 2] {
    let ratio = order.exp2();
    [step / (ratio * ratio - 1.0).sqrt(), step / (ratio - 1.0)]
}

/// In both examples the transitions are generic, u ∈ H^(5/2-ε).
fn order_of_theory() -> f64 {
    Theory::new(&Method::p2(), Regularity::transition(2.5), false).h1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_predict_errors() {
        // Errors 1/4 and 1/16 that are parallel, and such that the second is orthogonal to the step.
        let [orthogonal, parallel] = predicted(0.1875, 2.0);
        assert!((parallel - 0.0625).abs() < 1e-15);
        assert!((orthogonal.hypot(0.1875) - 4.0 * orthogonal).abs() < 1e-15);
        assert_eq!(order_of_theory(), 1.5);
    }
}
