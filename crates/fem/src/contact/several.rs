//! More than one solution of a scheme, where γ is so small that Proposition 4.2 does not exclude it (see `unique`).
//!
//! With a status for each contact condition the scheme is linear, and its solution solves (3.1) if it contradicts none of them.
//! Two answers that both solve (3.1) differ in some statuses; each choice of those is tried.

use super::active_set::{ActiveSet, Per};
use super::choose::system;
use super::form::Problem;
use super::iteration::Iteration;
use super::scheme::Scheme;
use super::solve::take_step;
use super::system::{System, largest};
use super::unique::{Doubt, doubt};
use crate::linear::Settings;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;

/// Up to this many conditions with different statuses, all choices are tried; beyond, those of the two answers and all that differ from
/// one of them in one condition.
const ALL_OF: usize = 6;
/// An answer is one of the solutions that were found if it is this near, relative to their distance.
const NEAR: f64 = 1e-2;
/// Solutions are two if they are farther apart, relative to max|u|.
const APART: f64 = 1e-10;

/// Several solutions of one scheme.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Several {
    /// How many were found.
    pub found: usize,
    /// Choices of statuses that were tried.
    pub tried: usize,
    /// Conditions on Γ_C whose status differs between the two answers.
    pub differing: usize,
    /// max|a-b| over max|u|
    pub apart: f64,
    /// The faces of Γ_C whose statuses differ.
    pub faces: Vec<usize>,
    /// The backward errors of the two solutions that the answers are.
    pub residuals: [f64; 2],
    /// With a larger γ₀ there is one solution only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unique_above: Option<f64>,
}

/// Whether two answers are two solutions of the scheme. None if this is not known.
///
/// # Errors
/// The errors of [`super::solve_by`] but for a singular matrix, with which there is no solution of that choice; an interruption.
pub fn several(
    problem: &Problem,
    answers: [&[f64]; 2],
    settings: Settings,
) -> Result<Option<Several>> {
    let apart = distance(answers[0], answers[1]);
    let size = largest(answers[0]).max(largest(answers[1]));
    if !(apart > APART * size) {
        return Ok(None);
    }
    let system = system(Scheme::new(problem), settings)?;
    let of = |u: &[f64]| ActiveSet::new(&*system, &system.restrict(u), Per::Condition);
    let (a, b) = (of(answers[0]), of(answers[1]));
    let differing = a.differing(&b);
    if differing.is_empty() {
        return Ok(None);
    }
    let choices = choices(&differing);
    let start = |choice: &[usize]| answers[usize::from(choice.len() * 2 > differing.len())];
    let solutions = solutions(problem, &*system, &a, &choices, start)?;
    let nearest = |u: &[f64]| {
        let distances = solutions
            .iter()
            .map(|(solution, _)| distance(solution, u))
            .enumerate();
        distances.min_by(|a, b| a.1.total_cmp(&b.1))
    };
    let (Some((of_a, off_a)), Some((of_b, off_b))) = (nearest(answers[0]), nearest(answers[1]))
    else {
        return Ok(None);
    };
    if of_a == of_b || !(off_a.max(off_b) <= NEAR * apart) {
        return Ok(None);
    }
    Ok(Some(Several {
        found: solutions.len(),
        tried: choices.len(),
        differing: differing.len(),
        apart: apart / size,
        faces: faces_of(problem, &differing),
        residuals: [solutions[of_a].1, solutions[of_b].1],
        unique_above: match doubt(problem) {
            Some(Doubt::GammaTooSmall { factor, .. }) => {
                Some(factor * problem.discretisation.gamma0())
            }
            _ => None,
        },
    }))
}

/// The solutions of the scheme, with their backward errors, among those with the statuses of `set` but for some choice of conditions;
/// each choice starts from a different field.
fn solutions<'u>(
    problem: &Problem,
    system: &dyn System,
    set: &ActiveSet,
    choices: &[Vec<usize>],
    start: impl Fn(&[usize]) -> &'u [f64],
) -> Result<Vec<(Vec<f64>, f64)>> {
    let mut solutions: Vec<(Vec<f64>, f64)> = Vec::new();
    for choice in choices {
        cancel::check()?;
        let set = set.with_turned(choice.iter().copied());
        let laws = set.laws(system, Iteration::Newton);
        let mut u = start(choice).to_vec();
        let solved = (0..3).try_for_each(|_| take_step(system, &laws, &mut u).map(|_| ()));
        if solved.is_err() || u.iter().any(|v| !v.is_finite()) {
            cancel::check()?;
            continue;
        }
        let is_new = |(known, _): &(Vec<f64>, f64)| distance(known, &u) > APART * largest(&u);
        if set.violated(system, &system.restrict(&u)).is_empty() && solutions.iter().all(is_new) {
            let residual = problem.backward_error(&u).0;
            solutions.push((u, residual));
        }
    }
    Ok(solutions)
}

/// Which of the differing conditions are turned over, the first answer's statuses being none of them and the second's all.
fn choices(differing: &[usize]) -> Vec<Vec<usize>> {
    if differing.len() <= ALL_OF {
        let subset = |chosen: usize| {
            let bits = differing.iter().enumerate();
            bits.filter(|(k, _)| chosen >> k & 1 == 1)
                .map(|(_, c)| *c)
                .collect()
        };
        return (0..1 << differing.len()).map(subset).collect();
    }
    let mut choices = vec![Vec::new(), differing.to_vec()];
    for &one in differing.iter().take(1 << (ALL_OF - 1)) {
        choices.push(vec![one]);
        choices.push(differing.iter().copied().filter(|k| *k != one).collect());
    }
    choices
}

/// The contact faces that conditions belong to, ascending.
fn faces_of(problem: &Problem, conditions: &[usize]) -> Vec<usize> {
    if !problem.method().is_nitsche() {
        return Vec::new();
    }
    let mut end = 0;
    let ends = problem.contact.iter().map(|face| {
        end += face.points.len();
        (end, face.face)
    });
    let ends: Vec<(usize, usize)> = ends.collect();
    let mut faces: Vec<usize> = conditions
        .iter()
        .filter_map(|k| {
            ends.get(ends.partition_point(|(end, _)| end <= k))
                .map(|(_, face)| *face)
        })
        .collect();
    faces.sort_unstable();
    faces.dedup();
    faces
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Discretisation, Method};
    use crate::scene::Scene;
    use faceoff_mesh::mesh::Triangulation;
    use proptest::prelude::*;
    use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
    use std::cell::Cell;

    /// How many solutions a scheme has, of all choices of statuses.
    fn number(problem: &Problem) -> Vec<Vec<f64>> {
        let system = system(Scheme::new(problem), Settings::default()).unwrap();
        let start = problem.start();
        let mut set = ActiveSet::new(&*system, &system.restrict(&start), Per::Condition);
        let all: Vec<usize> = (0..problem.conditions.len()).collect();
        let reference = set.laws(&*system, Iteration::Newton);
        let in_contact: Vec<usize> = all
            .iter()
            .copied()
            .filter(|k| reference[*k][0] != 0.0)
            .collect();
        set = set.with_turned(in_contact);
        let subset = |chosen: usize| {
            all.iter()
                .copied()
                .filter(|k| chosen >> k & 1 == 1)
                .collect()
        };
        let choices: Vec<Vec<usize>> = (0..1 << all.len()).map(subset).collect();
        let found = solutions(problem, &*system, &set, &choices, |_| &start).unwrap();
        found.into_iter().map(|(u, _)| u).collect()
    }

    /// All choices of statuses of small meshes: one solution where Proposition 4.2 holds, and at times more where it does not.
    #[test]
    fn there_is_one_solution_where_it_is_shown_and_not_always_elsewhere() {
        let data = (
            1usize..4,
            -6.0..6.0,
            0.05..3.0,
            -5.0..0.5,
            0.0..1.0,
            0.0..1.0,
            -3.0..3.0,
            -40.0..40.0,
            -40.0..40.0,
        );
        let scheme = (
            prop::sample::select(&["gauss-2", "midpoint"][..]),
            prop::sample::select(&["cr", "cr-fc"][..]),
        );
        let (shown, several_found, none) = (Cell::new(0), Cell::new(0), Cell::new(0));
        let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &[7; 32]);
        let config = Config {
            cases: 1000 * crate::asked_for().1 as u32,
            ..Config::default()
        };
        let outcome = TestRunner::new_with_rng(config, rng).run(&(data, scheme), |(data, (rule, method))| {
            let (n, shear, height, power, x, y, slope, below, above) = data;
            let gamma0 = 10f64.powf(power);
            let scene = Scene::parse(&format!(
                "name = \"random\"\n[mesh]\ngenerator = \"union-jack\"\nn = {n}\nsize = [1.0, {height}]\n\
                 [boundary]\ndirichlet = [\"top\"]\nneumann = [\"left\", \"right\"]\ncontact = [\"bottom\"]\n\
                 [data]\nf = \"if(x < {x}, {below}, {above})\"\ng = \"{slope}*(x-{y})\"\n\
                 [method]\ngamma0 = {gamma0:?}\ncontact_quadrature = \"{rule}\"\n"
            )).unwrap();
            let (name, mut mesh) = scene.mesh(None).unwrap();
            for point in mesh.points.to_mut() {
                point[0] += shear * point[1];
            }
            let mesh = Triangulation::new(&name, &mesh).unwrap();
            let method: Method = method.parse().unwrap();
            let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method)).unwrap();
            let found = number(&problem);
            if doubt(&problem).is_none() {
                shown.set(shown.get() + 1);
                prop_assert_eq!(found.len(), 1, "{:?}", gamma0);
            } else if let [a, b, ..] = &found[..] {
                several_found.set(several_found.get() + 1);
                    println!("{data:?} {rule} {method}: {}", found.len());
                // And they are distinguished from there.
                let told = several(&problem, [a, b], Settings::default()).unwrap();
                prop_assert!(told.is_some_and(|told| told.found > 1 && told.residuals.iter().all(|r| *r < 1e-12)));
            }
            none.set(none.get() + usize::from(found.is_empty()));
            Ok(())
        });
        outcome.unwrap();
        println!(
            "shown {}, several {}, none {}",
            shown.get(),
            several_found.get(),
            none.get()
        );
        assert!(shown.get() > 100 && several_found.get() > 0);
    }
}
