//! How far rounding moves a solution, after M. Arioli, J. W. Demmel, I. S. Duff, SIAM J. Matrix Anal. Appl. 10, 1989: the
//! solution of the scheme linearised there, whose right side is off by what rounding may do to each row.

use super::active_set::{ActiveSet, Per};
use super::choose::system;
use super::condition::Condition;
use super::form::Problem;
use super::iteration::Iteration;
use super::scheme::{Scheme, clear_rows};
use super::system::{System, Weights, largest};
use crate::linear::Settings;
use faceoff_mesh::error::Result;

/// How far rounding in the contact terms moves u. No backward error sees it: a row in which γ∂ₙu∂ₙv is 1e16 times the
/// rest holds the rest no more.
///
/// # Errors
/// A singular matrix.
pub(super) fn moved_by_rounding(scheme: &dyn System, laws: &[Weights], u: &[f64]) -> Result<f64> {
    let mut terms = vec![0.0; u.len()];
    for_each_contact_term(scheme.conditions(), laws, u, |row, size| terms[row] += size);
    if largest(&terms) == 0.0 {
        return Ok(0.0);
    }
    let moved = most(&terms, |off| scheme.respond(laws, off))?;
    Ok(f64::EPSILON * (moved / largest(u)))
}

/// Skeel's condition number of (3.1) linearised at u, from below: relative errors ε in each term of each row move u by ε
/// times this, relative to its largest value.
///
/// # Errors
/// Those of [`super::solve_by`].
pub fn condition(problem: &Problem, u: &[f64], settings: Settings) -> Result<f64> {
    let system = system(Scheme::new(problem), settings)?;
    let scheme = system.scheme();
    let set = ActiveSet::new(&*system, &system.restrict(u), Per::Condition);
    let laws = set.laws(&*system, Iteration::Newton);
    let terms = sizes_of_rows(scheme, &laws, u);
    let size = largest(u);
    if size == 0.0 {
        return Ok(1.0);
    }
    Ok(most(&terms, |off| system.step_everywhere(&laws, off))? / size)
}

/// Sums of the sizes of the terms of each row, 0 on Γ_D.
fn sizes_of_rows(scheme: &Scheme, laws: &[Weights], u: &[f64]) -> Vec<f64> {
    let mut terms = scheme.problem.stiffness.sizes(u);
    for (terms, load) in terms.iter_mut().zip(&*scheme.load) {
        *terms += load.abs();
    }
    clear_rows(&scheme.conditions, &mut terms);
    for_each_contact_term(&scheme.conditions, laws, u, |row, size| terms[row] += size);
    for (terms, g) in terms.iter_mut().zip(&scheme.problem.dirichlet) {
        if g.is_some() {
            *terms = 0.0;
        }
    }
    terms
}

/// The largest entry of what answers right sides of these sizes. Of all signs two choices are tried: one sign, which is the
/// worst where the inverse is positive, as that of a stiffness nearly is, and signs in turn.
fn most(terms: &[f64], answer: impl Fn(&[f64]) -> Result<Vec<f64>>) -> Result<f64> {
    let signs = [1.0, -1.0].into_iter().cycle();
    let in_turn: Vec<f64> = terms.iter().zip(signs).map(|(t, sign)| t * sign).collect();
    Ok(largest(&answer(terms)?).max(largest(&answer(&in_turn)?)))
}

/// The sizes of the contact terms at u, and their rows.
pub(super) fn for_each_contact_term(
    conditions: &[Condition],
    laws: &[Weights],
    u: &[f64],
    mut visit: impl FnMut(usize, f64),
) {
    for (condition, [alpha, beta]) in conditions.iter().zip(laws) {
        let [gap, flux] = condition.sizes(u);
        let law = alpha * gap + beta * condition.gamma * flux;
        for (j, &dof) in condition.dofs.iter().enumerate() {
            let (test, g) = (condition.test(j), condition.flux_test(j));
            visit(
                dof as usize,
                condition.weight * (law * test.abs() + flux * g.abs()),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Discretisation, Stop, solve};
    use crate::scene::Scene;
    use nalgebra::{DMatrix, DVector};

    /// Against the inverse matrix, column by column, and all signs.
    #[test]
    fn the_estimate_is_below_the_condition_and_near_it() {
        let scene = Scene::find("one-zone").unwrap();
        let mesh = scene.triangulation(Some(6)).unwrap();
        for method in ["cr-fc", "p1", "p2"] {
            let problem = Problem::new(
                &scene,
                &mesh,
                &Discretisation::of(&scene, method.parse().unwrap()),
            )
            .unwrap();
            let report = |_, _| Ok(());
            let u = solve(&problem, Iteration::Newton, Stop::default(), report)
                .unwrap()
                .u;
            let system = system(Scheme::new(&problem), Settings::default()).unwrap();
            let scheme = system.scheme();
            let set = ActiveSet::new(&*system, &system.restrict(&u), Per::Condition);
            let laws = set.laws(&*system, Iteration::Newton);
            let free: Vec<usize> = (0..u.len())
                .filter(|&k| problem.dirichlet[k].is_none())
                .collect();
            let at_rest = scheme.linear_residual(&laws, &vec![0.0; u.len()]);
            let matrix = DMatrix::from_fn(free.len(), free.len(), |i, j| {
                let mut unit = vec![0.0; u.len()];
                unit[free[j]] = 1.0;
                scheme.linear_residual(&laws, &unit)[free[i]] - at_rest[free[i]]
            });
            let terms = sizes_of_rows(scheme, &laws, &u);
            let terms = DVector::from_fn(free.len(), |i, _| terms[free[i]]);
            let inverse = matrix.try_inverse().unwrap().abs();
            let exact = (inverse * terms).max() / largest(&u);
            let found = condition(&problem, &u, Settings::default()).unwrap();
            println!("{method}: {found:.1} of {exact:.1}");
            assert!(found <= exact * (1.0 + 1e-9) && found > 1e-2 * exact);
        }
    }
}
