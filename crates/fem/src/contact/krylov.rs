//! Newton's steps without a factorisation, for meshes beyond it.
//!
//! In the form of `scheme` the rows of contact faces hold nothing but their law, scaled to the size of
//! the stiffness: in contact a Dirichlet condition, separated the row of the stiffness itself, and in
//! between only on faces partly in contact. The matrix so is the stiffness with Dirichlet conditions on the
//! faces wholly in contact, up to little; P1 ⊂ CR preconditions it, with functions that vanish at
//! the vertices of these faces. A hierarchy for another such set serves as long as it is not much slower.

use std::cell::{Cell, RefCell};

use super::condition::Condition;
use super::scheme::Scheme;
use super::system::{Built, Energy, System, Weights};
use super::vertex_values::VertexValues;
use crate::assembly::Stiffness;
use crate::element::{P1, Space};
use crate::linear::{
    Choice, Csr, Elements, Embedded, KrylovStop, Precision, Role, Solver, Symmetric,
    conjugate_gradients, gmres, norm,
};
use faceoff_mesh::error::{Error, Result};

/// Most iterations for one step of Newton's method.
const STEPS: usize = 400;
/// What a step leaves of its residual while many conditions change, while a few do, and at last.
const COARSE: f64 = 1e-2;
const MEDIUM: f64 = 1e-4;
const FINE: f64 = 1e-10;

/// Vectors of this system hold all dofs.
pub(super) struct Krylov<'a> {
    scheme: Scheme<'a>,
    /// Free number of each dof, none on Γ_D, and the dof of each free number.
    free: Vec<Option<u32>>,
    dof_of: Vec<u32>,
    /// The rows that the conditions change, as A has them: free number and values.
    stiff: Vec<(u32, Vec<f64>)>,
    /// P1 by cells, and the vertices where P1 functions vanish because u is given on Γ_D.
    coarse: Stiffness<'a>,
    held: Vec<bool>,
    state: RefCell<State>,
    /// ‖u‖₂ of the last residual, and the norm of the matrix.
    size: Cell<f64>,
    scale: f64,
    /// Preconditioners so far.
    built: Cell<usize>,
}

/// What is kept from step to step.
struct State {
    matrix: Csr,
    laws: Vec<Weights>,
    preconditioner: Option<Preconditioner>,
}

struct Preconditioner {
    embedded: Embedded,
    /// The dofs in contact that it was built for.
    closed: Vec<u32>,
    /// Iterations for each digit with these.
    pace: f64,
}

/// A preconditioner for another contact set is used for so many times the iterations of its own.
const STALE: f64 = 2.0;

impl<'a> Krylov<'a> {
    /// What iterating is predicted to take; none for what it does not solve.
    pub fn predicted(scheme: &Scheme) -> Option<Choice> {
        is_nearly_symmetric(scheme).then(|| choice(scheme))
    }

    /// # Errors
    /// A scheme that is not of this kind; nothing free; a matrix too large to be summed.
    pub fn new(scheme: Scheme<'a>) -> Result<Self> {
        let problem = scheme.problem;
        let space = &problem.space;
        if !is_nearly_symmetric(&scheme) {
            return Err(Error::usage(
                format!(
                    "iterations do not solve {} on this scene: they take Newton's method for cr, cr-fc, cr-vi and \
                     p1-vi, and scenes without contact, on domains that Γ_D holds",
                    problem.method()
                ),
                "use --linear auto",
            ));
        }
        let mut free = vec![None; space.dofs];
        let mut dof_of = Vec::with_capacity(space.dofs);
        let mut roles = vec![Role::Fixed; space.dofs];
        let mut held = vec![false; space.mesh.points.len()];
        let values = VertexValues::new(space);
        for (dof, g) in problem.dirichlet.iter().enumerate() {
            if g.is_none() {
                free[dof] = Some(dof_of.len() as u32);
                dof_of.push(dof as u32);
                roles[dof] = Role::Eliminated;
            } else {
                for (vertex, _) in values.of(dof as u32) {
                    held[vertex as usize] = true;
                }
            }
        }
        if dof_of.is_empty() {
            return Err(Error::Solver {
                what: "Γ_D holds every dof, so there is nothing to solve".into(),
                remedy: "refine the mesh".into(),
            });
        }
        let mut matrix = Csr::from(&Symmetric::new(&problem.stiffness, &roles)?);
        let mut seen: Vec<u32> = scheme
            .conditions
            .iter()
            .flat_map(|c| &c.dofs)
            .filter_map(|&dof| free[dof as usize])
            .collect();
        seen.sort_unstable();
        seen.dedup();
        let stiff = seen
            .into_iter()
            .map(|row| (row, matrix.row_values_mut(row as usize).to_vec()))
            .collect();
        Ok(Krylov {
            coarse: Stiffness::new(&Space::new(space.mesh, &P1)),
            scale: matrix.norm(),
            state: RefCell::new(State {
                matrix,
                laws: Vec::new(),
                preconditioner: None,
            }),
            scheme,
            free,
            dof_of,
            stiff,
            held,
            size: Cell::new(0.0),
            built: Cell::new(0),
        })
    }

    /// The matrix of the linear scheme with these laws; the dofs wholly in contact.
    fn put(&self, laws: &[Weights], matrix: &mut Csr) -> Vec<u32> {
        for (row, values) in &self.stiff {
            matrix.row_values_mut(*row as usize).copy_from_slice(values);
        }
        let mut closed = Vec::new();
        let mut open = Vec::new();
        for (condition, law) in self.scheme.conditions.iter().zip(laws) {
            condition.for_each_entry(*law, |i, j, value| {
                let (Some(i), Some(j)) = (self.free[i as usize], self.free[j as usize]) else {
                    return;
                };
                let place = matrix.row_columns(i as usize).iter().position(|&c| c == j);
                if let Some(k) = place {
                    matrix.row_values_mut(i as usize)[k] += value;
                }
            });
            let dof = own_dof(condition);
            if law[1] == 0.0 {
                &mut closed
            } else {
                &mut open
            }
            .push(dof);
        }
        // A face partly in contact is open.
        closed.dedup();
        open.sort_unstable();
        closed.retain(|dof| open.binary_search(dof).is_err());
        closed
    }

    /// P1 functions that vanish on Γ_D and where there is contact.
    fn embedded(&self, closed: &[u32]) -> Result<Embedded> {
        let space = &self.scheme.problem.space;
        let values = VertexValues::new(space);
        let mut held = self.held.clone();
        for (vertex, _) in closed.iter().flat_map(|&dof| values.of(dof)) {
            held[vertex as usize] = true;
        }
        let mut number = vec![None; held.len()];
        let mut roles = vec![Role::Fixed; held.len()];
        let mut count = 0;
        for vertex in (0..held.len()).filter(|&vertex| !held[vertex]) {
            number[vertex] = Some(count);
            roles[vertex] = Role::Eliminated;
            count += 1;
        }
        let mut embedding = Csr::empty(count as usize);
        for &dof in &self.dof_of {
            embedding.push(values.of(dof).filter_map(|(vertex, value)| {
                number[vertex as usize].map(|column| (column, value))
            }));
        }
        let coarse = Csr::from(&Symmetric::new(&self.coarse, &roles)?);
        Embedded::new(embedding, coarse).ok_or_else(|| Error::Solver {
            what: "the P1 matrix on this mesh does not coarsen (cells of extreme shape?)".into(),
            remedy: "use --linear multifrontal".into(),
        })
    }
}

impl Krylov<'_> {
    /// δ with at most `wanted` of the residual left, or `least`.
    fn solve(&self, laws: &[Weights], r: &[f64], wanted: f64, least: f64) -> Result<Vec<f64>> {
        let state = &mut *self.state.borrow_mut();
        let closed = self.put(laws, &mut state.matrix);
        state.laws = laws.to_vec();
        let matrix = &state.matrix;
        let b: Vec<f64> = self.dof_of.iter().map(|&d| -r[d as usize]).collect();
        let size = norm(&b);
        let residual = (wanted * size).max(least);
        let digits = (size / residual).log10().max(1.0);
        let inverse: Vec<f64> = matrix.diagonal().iter().map(|d| 1.0 / d).collect();
        let mut delta = vec![0.0; b.len()];
        // From where an earlier one left off.
        let mut iterate = |embedded: &mut Embedded, steps: usize| {
            let stop = KrylovStop { residual, steps };
            let apply = |x: &[f64], y: &mut [f64]| matrix.times(x, y);
            let precondition = |r: &[f64], z: &mut [f64]| embedded.apply(matrix, &inverse, r, z);
            let ended = if laws.is_empty() {
                conjugate_gradients(apply, precondition, &b, &mut delta, stop)
            } else {
                gmres(apply, precondition, &b, &mut delta, stop)
            };
            tracing::debug!(?ended, digits, "linear iteration");
            ended
        };
        let mut steps = 0;
        if let Some(old) = &mut state.preconditioner {
            let is_stale = old.closed != closed;
            let limit = match is_stale {
                true => ((STALE * old.pace * digits).ceil() as usize).min(STEPS),
                false => STEPS,
            };
            let ended = iterate(&mut old.embedded, limit);
            steps = ended.steps;
            if is_stale && !ended.reached {
                state.preconditioner = None;
            }
        }
        if state.preconditioner.is_none() {
            let mut embedded = self.embedded(&closed)?;
            self.built.set(self.built.get() + 1);
            steps = iterate(&mut embedded, STEPS).steps;
            state.preconditioner = Some(Preconditioner {
                embedded,
                closed,
                pace: steps.max(1) as f64 / digits,
            });
        }
        if steps == STEPS || delta.iter().any(|d| !d.is_finite()) {
            return Err(not_converged(steps));
        }
        let mut all = vec![0.0; self.free.len()];
        for (&dof, d) in self.dof_of.iter().zip(&delta) {
            all[dof as usize] = *d;
        }
        Ok(all)
    }
}

impl System for Krylov<'_> {
    fn conditions(&self) -> &[Condition] {
        &self.scheme.conditions
    }

    fn put_conditions(&mut self, conditions: Vec<Condition>) {
        self.scheme.conditions = conditions.into();
    }

    fn floating(&self) -> Option<&[Option<u32>]> {
        None
    }

    fn choice(&self) -> Choice {
        choice(&self.scheme)
    }

    fn built(&self) -> Built {
        Built {
            unknowns: self.dof_of.len(),
            factors: 0,
            dense: 0,
            preconditioners: self.built.get(),
        }
    }

    fn is_solved_but_for_conditions(&self) -> bool {
        false
    }

    fn start(&self) -> Vec<f64> {
        self.scheme.problem.start()
    }

    fn residual(&self, u: &[f64]) -> Vec<f64> {
        self.size.set(norm(u));
        self.scheme.residual(u)
    }

    fn linear_residual(&self, laws: &[Weights], u: &[f64]) -> Vec<f64> {
        self.size.set(norm(u));
        self.scheme.linear_residual(laws, u)
    }

    fn scale(&self) -> [f64; 2] {
        let load = self.scheme.load.iter();
        [self.scale, load.fold(0.0, |m: f64, b| m.max(b.abs()))]
    }

    fn energy(&self, delta: &[f64]) -> Energy {
        Energy::new(delta, |v| self.scheme.problem.stiffness.energy(v))
    }

    fn size(&self, u: &[f64]) -> Energy {
        self.energy(u)
    }

    /// While conditions change, δ is only as exact as that deserves.
    fn step(&self, laws: &[Weights], r: &[f64]) -> Result<Vec<f64>> {
        let changes = {
            let old = &self.state.borrow().laws;
            let pairs = laws.iter().zip(old);
            laws.len() - pairs.filter(|(a, b)| a == b).count()
        };
        let wanted = match changes {
            0 => FINE,
            few if few <= laws.len() / 50 + 8 => MEDIUM,
            _ => COARSE,
        };
        // Below this lies the rounding of A u: no step is worth it.
        let rounding = f64::EPSILON * self.scale * self.size.get();
        self.solve(laws, r, wanted, rounding)
    }

    fn respond(&self, laws: &[Weights], r: &[f64]) -> Result<Vec<f64>> {
        self.solve(laws, r, COARSE, 0.0)
    }

    fn restrict(&self, u: &[f64]) -> Vec<f64> {
        u.to_vec()
    }

    fn complete(&self, u: &[f64]) -> Vec<f64> {
        u.to_vec()
    }

    fn scheme(&self) -> &Scheme<'_> {
        &self.scheme
    }

    /// From u as exact as a step makes it, δ to four digits is below the rounding of A u.
    fn step_everywhere(&self, laws: &[Weights], r: &[f64]) -> Result<Vec<f64>> {
        self.solve(laws, r, MEDIUM, 0.0)
    }
}

/// The dof that a condition holds where it is in contact.
fn own_dof(condition: &Condition) -> u32 {
    let of_variational = || condition.displacement.iter().position(|g| *g != 0.0);
    let local = condition.row.map(|row| row.local).or_else(of_variational);
    condition.dofs[local.unwrap_or(0)]
}

/// Is the matrix symmetric but for few rows, whatever is in contact, and definite?
fn is_nearly_symmetric(scheme: &Scheme) -> bool {
    let problem = scheme.problem;
    let by_faces = scheme.conditions.iter().all(|c| c.row.is_some());
    problem.floating.is_none() && (by_faces || problem.method().law.replaces_rows())
}

/// Iterations of Newton's method times those of each step, and of its last one, as measured: they
/// hardly depend on the mesh.
const ITERATIONS: f64 = 60.0;
/// Vectors that an iteration holds.
const VECTORS: usize = 30;

fn choice(scheme: &Scheme) -> Choice {
    let problem = scheme.problem;
    let (dofs, cells) = (problem.space.dofs, problem.stiffness.count());
    let local = problem.stiffness.size();
    // Each cell ties each of its dofs to each other; on the diagonal they meet.
    let entries = cells * local * (local - 1) + dofs;
    // Two sweeps, a residual and a product; the hierarchy below takes about half as much again.
    let flops = ITERATIONS * 6.0 * entries as f64;
    // The matrix beside the entries it is summed from; the hierarchy; the vectors.
    let bytes = entries * (12 + 16 + 8) + dofs * 8 * VECTORS;
    Choice {
        solver: Solver::Iterative,
        precision: Precision::F64,
        entries,
        flops,
        predicted_mb: bytes as f64 / 1e6,
    }
}

fn not_converged(steps: usize) -> Error {
    Error::Solver {
        what: format!("the iterative solver did not converge in {steps} iterations"),
        remedy: "use --linear multifrontal, or check the mesh for cells of extreme shape".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Discretisation, Iteration, Method, Problem, Stop, solve_by};
    use crate::linear::Settings;
    use crate::scene::Scene;

    fn with(solver: Solver) -> Settings {
        Settings {
            solver,
            ..Settings::default()
        }
    }

    /// And needs fewer steps than from nothing, as it starts from the contact set of P1.
    #[test]
    fn it_agrees_with_the_direct_solver() {
        let (mut steps, mut direct_steps) = (0, 0);
        for (scene, n) in [
            ("one-zone", 20),
            ("five-zones", 33),
            ("plate", 16),
            ("transition-1.5", 17),
        ] {
            let scene = Scene::find(scene).unwrap();
            let mesh = scene.triangulation(Some(n)).unwrap();
            for method in ["cr", "cr-vi", "cr-fc", "p1-vi"] {
                let method: Method = method.parse().unwrap();
                let problem =
                    Problem::new(&scene, &mesh, &Discretisation::of(&scene, method)).unwrap();
                let solve = |solver| {
                    let report = |_, _| Ok(());
                    let settings = with(solver);
                    let newton = Iteration::Newton;
                    solve_by(&problem, newton, Stop::default(), settings, report).unwrap()
                };
                let (found, direct) = (solve(Solver::Iterative), solve(Solver::Multifrontal));
                assert!(
                    found.converged,
                    "{} {method}: {:?}",
                    scene.name(),
                    found.increments
                );
                assert_eq!(found.linear.solver, Solver::Iterative);
                steps += found.increments.len();
                direct_steps += direct.increments.len();
                let scale = direct.u.iter().fold(0.0, |s: f64, u| s.max(u.abs()));
                let pairs = found.u.iter().zip(&direct.u);
                let far = pairs.fold(0.0, |s: f64, (a, b)| s.max((a - b).abs()));
                assert!(
                    far < 1e-11 * scale,
                    "{} {method}: {far:e} of {scale}",
                    scene.name()
                );
            }
        }
        assert!(4 * steps < 3 * direct_steps, "{steps} of {direct_steps}");
    }

    /// EᵀAE is the P1 matrix: what the preconditioner rests on.
    #[test]
    fn p1_is_embedded_exactly() {
        let scene = Scene::find("plate").unwrap();
        let mesh = scene.triangulation(Some(16)).unwrap();
        for method in ["cr", "p2"] {
            let problem = Problem::new(
                &scene,
                &mesh,
                &Discretisation::of(&scene, method.parse().unwrap()),
            )
            .unwrap();
            let values = VertexValues::new(&problem.space);
            let p1 = Stiffness::new(&Space::new(&mesh, &P1));
            let v: Vec<f64> = (0..mesh.points.len())
                .map(|k| ((3 * k) as f64).sin())
                .collect();
            let of_v: Vec<f64> = (0..problem.space.dofs as u32)
                .map(|dof| {
                    values
                        .of(dof)
                        .map(|(vertex, value)| value * v[vertex as usize])
                        .sum()
                })
                .collect();
            let (energy, embedded) = (p1.energy(&v), problem.stiffness.energy(&of_v));
            assert!(
                (energy - embedded).abs() < 1e-12 * energy,
                "{method}: {energy} {embedded}"
            );
        }
    }

    #[test]
    fn a_law_that_it_cannot_reduce_is_refused_in_words() {
        let scene = Scene::find("one-zone").unwrap();
        let mesh = scene.triangulation(Some(4)).unwrap();
        for method in ["p2", "cr(1,1)", "penalty"] {
            let problem = Problem::new(
                &scene,
                &mesh,
                &Discretisation::of(&scene, method.parse().unwrap()),
            )
            .unwrap();
            let refused = Krylov::new(Scheme::new(&problem))
                .err()
                .unwrap()
                .to_string();
            assert!(
                refused.contains(method) && refused.contains("--linear"),
                "{refused}"
            );
            assert!(Krylov::predicted(&Scheme::new(&problem)).is_none());
        }
    }
}
