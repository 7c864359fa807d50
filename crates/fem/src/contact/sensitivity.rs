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

/// The relative change of u by one choice of signs below which no other is tried: five digits below what matters to [`super::solve()`].
const NEGLIGIBLE: f64 = 1e-7;
/// The residual of a right-hand side for which only the size of the response matters.
const ROUGH: f64 = 0.5;

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
    let respond = |off: &[f64]| scheme.rough_step(laws, off, ROUGH);
    let of_one_sign = f64::EPSILON * (largest(&respond(&terms)?) / largest(u));
    // Where one sign is that far below all that counts, signs in turn are as well.
    if of_one_sign < NEGLIGIBLE {
        return Ok(of_one_sign);
    }
    Ok(f64::EPSILON * (most(&terms, respond)? / largest(u)))
}

/// Skeel's condition number of (3.1) linearised at u, from below: relative errors ε in each term of each row move u by ε
/// times this, relative to its largest value.
///
/// # Errors
/// The errors of [`super::solve_by`].
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
    Ok(most(&terms, |off| system.step_everywhere(&laws, off.to_vec()))? / size)
}

/// How far apart two solutions may be because of what they leave in the rows.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Conditioning {
    /// By connected part of the mesh.
    pub parts: Vec<PartConditioning>,
}

/// A connected part of the mesh.
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub struct PartConditioning {
    /// κ, from below: relative errors ε in each row of (2.4) move u by κ ε max|u|.
    pub condition: f64,
    /// The backward errors of the two.
    pub residuals: [f64; 2],
    /// κ times their sum.
    pub tolerance: f64,
    /// The same times max|u|.
    pub moved: f64,
}

impl Conditioning {
    /// Of two fields at all dofs; κ is the larger one of the schemes linearised at them.
    ///
    /// # Errors
    /// The errors of [`super::solve_by`].
    pub fn new(problem: &Problem, answers: [&[f64]; 2], settings: Settings) -> Result<Self> {
        let (part_of, count) = &problem.bodies;
        let rows = answers.map(|u| problem.rows(u));
        let mut parts = vec![[0.0_f64; 4]; *count];
        for (dof, part) in part_of.iter().enumerate() {
            let [residual_a, residual_b, size, _] = &mut parts[*part as usize];
            *residual_a = residual_a.max(rows[0].error(dof));
            *residual_b = residual_b.max(rows[1].error(dof));
            *size = size.max(answers[0][dof].abs()).max(answers[1][dof].abs());
        }
        let difference: Vec<f64> = rows[0]
            .residual
            .iter()
            .zip(&rows[1].residual)
            .map(|(a, b)| a - b)
            .collect();
        let system = system(Scheme::as_it_stands(problem), settings)?;
        for (u, rows) in answers.iter().zip(&rows) {
            let set = ActiveSet::new(&*system, &system.restrict(u), Per::Condition);
            let laws = set.laws(&*system, Iteration::Newton);
            // What is off with g moves u by no more than itself, at least if it is the only error.
            let free = |row: usize| problem.dirichlet[row].is_none();
            for signs in signs(&difference) {
                let terms = rows.scale.iter().zip(&signs).enumerate();
                let off: Vec<f64> = terms
                    .map(|(row, (size, sign))| if free(row) { size * sign } else { 0.0 })
                    .collect();
                let answer = system.step_everywhere(&laws, off)?;
                for (delta, part) in answer.iter().zip(part_of) {
                    let moved = &mut parts[*part as usize][3];
                    *moved = moved.max(delta.abs());
                }
            }
        }
        let of_part = |[a, b, size, response]: [f64; 4]| {
            let moved = (response + size) * (a + b);
            PartConditioning {
                condition: 1.0 + if size > 0.0 { response / size } else { 0.0 },
                residuals: [a, b],
                tolerance: if size > 0.0 { moved / size } else { 0.0 },
                moved,
            }
        };
        Ok(Conditioning {
            parts: parts.into_iter().map(of_part).collect(),
        })
    }

    /// How far each face's dofs may be moved.
    pub fn by_face(&self, problem: &Problem) -> Vec<f64> {
        let mesh = problem.space.mesh;
        let of_face = |face: usize| {
            let cell = mesh.face_cells(face)[0] as usize;
            let dof = problem.space.cell_dofs(cell)[0];
            self.parts[problem.bodies.0[dof as usize] as usize].moved
        };
        (0..mesh.face_count()).map(of_face).collect()
    }

    /// The part where conditioning allows most.
    pub fn worst(&self) -> Option<&PartConditioning> {
        self.parts
            .iter()
            .max_by(|a, b| a.tolerance.total_cmp(&b.tolerance))
    }
}

/// Choices of signs for the right sides: of one sign, in turn, and as the two residuals differ.
fn signs(difference: &[f64]) -> [Vec<f64>; 3] {
    let one = vec![1.0; difference.len()];
    let in_turn = [1.0, -1.0]
        .into_iter()
        .cycle()
        .take(difference.len())
        .collect();
    [
        one,
        in_turn,
        difference.iter().map(|d| 1.0_f64.copysign(*d)).collect(),
    ]
}

/// Sums of the sizes of the terms of each row, 0 on Γ_D.
fn sizes_of_rows(scheme: &Scheme, laws: &[Weights], u: &[f64]) -> Vec<f64> {
    let mut terms = scheme.problem.stiffness.sizes(u);
    for (terms, load) in terms.iter_mut().zip(scheme.load()) {
        *terms += load.abs();
    }
    clear_rows(&scheme.conditions, &mut terms);
    for_each_contact_term(&scheme.conditions, laws, u, |row, size| terms[row] += size);
    for (dof, _) in scheme.problem.dirichlet.given() {
        terms[dof] = 0.0;
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
            let residual = |u: &[f64]| scheme.linear_residual(problem.stiffness.times(u), &laws, u);
            let at_rest = residual(&vec![0.0; u.len()]);
            let matrix = DMatrix::from_fn(free.len(), free.len(), |i, j| {
                let mut unit = vec![0.0; u.len()];
                unit[free[j]] = 1.0;
                residual(&unit)[free[i]] - at_rest[free[i]]
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
