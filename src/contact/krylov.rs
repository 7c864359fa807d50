//! Newton's steps without a factorisation, for meshes beyond it.
//!
//! For Crouzeix–Raviart with θ₂ = 0, and for the variational inequality, the contact terms of all
//! rows of a contact cell are multiples of one functional X_F, and what is left of the row of F
//! itself cancels: (∇u, ∇φ_F) = <∂ₙu, φ_F>_F. With t_i = θ₂γ⁻¹g(φ_i) + θ₁q'(φ_i), taking t_G/t_F
//! times the row of F from the rows of the other faces G leaves
//!
//! ```text
//! rows G:  (∇δ, ∇φ_G) = -R_G + (t_G/t_F) R_F
//! row F:   s X_F'(δ) = -s R_F / t_F,   X_F' = Σ_k w_k (α_k g_k + β_k γ q_k')
//! ```
//!
//! which with the scale s = (γ Σ wβ/|F| + Σ wα/A_FF)⁻¹ is the symmetric stiffness matrix, with
//! Dirichlet values on faces wholly in contact, but for the faces partly in contact. P1 ⊂ CR
//! preconditions it, P1 functions being held at the vertices of faces wholly in contact. The hierarchy
//! is built anew only when the set of these changes.

use std::cell::{Cell, RefCell};

use super::Problem;
use super::conditions::Condition;
use super::method::Law;
use super::scheme::{Scheme, Weights};
use crate::assembly::Stiffness;
use crate::element::{P1, Space};
use crate::error::{Error, Result};
use crate::linear::{
    Choice, Elements, Embedded, KrylovStop, Precision, Role, Rows, Solver, Symmetric,
    conjugate_gradients, gmres, norm,
};
use crate::scene::Part;

/// Most iterations for one step of Newton's method.
const STEPS: usize = 400;
/// What a step leaves of its residual while many conditions change, while a few do, and at last.
const COARSE: f64 = 1e-2;
const MEDIUM: f64 = 1e-4;
const FINE: f64 = 1e-10;

/// Vectors of this scheme hold all dofs.
pub(super) struct Krylov<'a> {
    problem: &'a Problem<'a>,
    /// Free number of each dof, none on Γ_D, and the dof of each free number.
    free: Vec<Option<u32>>,
    dof_of: Vec<u32>,
    /// P1 by cells; which vertices are on Γ_D.
    coarse: Stiffness<'a>,
    held: Vec<bool>,
    state: RefCell<State>,
    /// ‖u‖₂ of the last residual.
    size: Cell<f64>,
}

/// What is kept from step to step.
struct State {
    /// A on the free dofs, with the rows of contact faces as the last step had them.
    matrix: Rows,
    laws: Vec<Weights>,
    /// The contact faces wholly in contact, and the preconditioner for them.
    closed: Vec<bool>,
    embedded: Option<Embedded>,
}

impl<'a> Krylov<'a> {
    /// What iterating is predicted to take; none for what it does not do.
    pub fn predicted(problem: &Problem) -> Option<Choice> {
        is_reducible(problem).then(|| choice(problem))
    }

    /// # Errors
    /// A method whose contact rows cannot be reduced as above; nothing free; a part of the domain that Γ_D
    /// does not hold.
    pub fn new(problem: &'a Problem<'a>) -> Result<Self> {
        let space = &problem.space;
        if !is_reducible(problem) {
            return Err(Error::usage(
                format!(
                    "iterations do not solve {} on this scene: they take Crouzeix–Raviart with θ₂ = 0, cr-fc and cr-vi, \
                     methods without contact faces, and domains that Γ_D holds",
                    problem.method
                ),
                "use --linear auto",
            ));
        }
        let mut free = vec![None; space.dofs];
        let mut dof_of = Vec::with_capacity(space.dofs);
        let mut roles = vec![Role::Fixed; space.dofs];
        for (dof, _) in (0..).zip(&problem.dirichlet).filter(|(_, g)| g.is_none()) {
            free[dof] = Some(dof_of.len() as u32);
            dof_of.push(dof as u32);
            roles[dof] = Role::Eliminated;
        }
        if dof_of.is_empty() {
            return Err(Error::Solver {
                what: "Γ_D holds every dof, so there is nothing to solve".into(),
                remedy: "refine the mesh".into(),
            });
        }
        let mesh = space.mesh;
        let mut held = vec![false; mesh.points.len()];
        for (face, part) in problem.parts.iter().enumerate() {
            if *part == Some(Part::Dirichlet) {
                for &vertex in mesh.face(face) {
                    held[vertex as usize] = true;
                }
            }
        }
        Ok(Krylov {
            coarse: Stiffness::new(&Space::new(mesh, &P1)),
            state: RefCell::new(State {
                matrix: Rows::from(&Symmetric::new(&problem.stiffness, &roles)?),
                laws: Vec::new(),
                closed: Vec::new(),
                embedded: None,
            }),
            problem,
            free,
            dof_of,
            held,
            size: Cell::new(0.0),
        })
    }

    /// Writes the row of a contact face and takes it out of the right-hand side of the others.
    /// Is the face wholly in contact?
    fn reduce(
        &self,
        face: usize,
        conditions: &[Condition],
        laws: &[Weights],
        matrix: &mut Rows,
        b: &mut [f64],
    ) -> bool {
        let (mut functional, mut stiff) = (Vec::new(), 0.0);
        let (mut open, mut shut) = (0.0, 0.0);
        let Some(row) = self.free[face] else {
            return true;
        };
        let first = &conditions[0];
        let local = |c: &Condition| c.dofs.iter().position(|&d| d as usize == face);
        let own = local(first).expect("invariant: a condition sees the dof of its face");
        for (condition, &[alpha, beta]) in conditions.iter().zip(laws) {
            open += condition.weight * beta;
            shut += condition.weight * alpha;
            stiff += condition.weight * condition.flux[own];
            for (i, &dof) in condition.dofs.iter().enumerate() {
                let flux = condition.gamma * condition.flux[i];
                let value = alpha * condition.displacement[i] + beta * flux;
                functional.push((dof, condition.weight * value));
            }
        }
        let measure: f64 = conditions.iter().map(|c| c.weight).sum();
        let scale = 1.0 / (first.gamma * open / measure + shut / stiff);
        let right = b[row as usize] / first.test(own);
        for (i, &dof) in first.dofs.iter().enumerate() {
            if let Some(other) = self.free[dof as usize].filter(|&other| other != row) {
                b[other as usize] -= first.test(i) * right;
            }
        }
        b[row as usize] = scale * right;
        let columns = matrix.row_columns(row as usize).to_vec();
        let values = matrix.row_values_mut(row as usize);
        values.fill(0.0);
        for (dof, value) in functional {
            let column = self.free[dof as usize].and_then(|c| columns.iter().position(|&k| k == c));
            if let Some(k) = column {
                values[k] += scale * value;
            }
        }
        open == 0.0
    }

    /// P1 functions that vanish on Γ_D and on the faces wholly in contact.
    fn embedded(&self, closed: &[bool]) -> Result<Embedded> {
        let problem = self.problem;
        let mesh = problem.space.mesh;
        let mut held = self.held.clone();
        for (face, _) in problem.contact.iter().zip(closed).filter(|(_, c)| **c) {
            for &vertex in mesh.face(face.face) {
                held[vertex as usize] = true;
            }
        }
        let mut number = vec![None; held.len()];
        let mut roles = vec![Role::Fixed; held.len()];
        let mut count = 0;
        for vertex in (0..held.len()).filter(|&vertex| !held[vertex]) {
            number[vertex] = Some(count);
            roles[vertex] = Role::Eliminated;
            count += 1;
        }
        let mut embedding = Rows::empty(count as usize);
        let values = VertexValues::new(&problem.space);
        for &dof in &self.dof_of {
            let of_dof = values.of(dof).filter_map(|(vertex, value)| {
                number[vertex as usize].map(|column| (column, value))
            });
            embedding.push(of_dof);
        }
        let coarse = Rows::from(&Symmetric::new(&self.coarse, &roles)?);
        Embedded::new(embedding, coarse).ok_or_else(|| Error::Solver {
            what: "the P1 matrix on this mesh does not coarsen (cells of extreme shape, or a part that nothing holds)".into(),
            remedy: "use --linear multifrontal".into(),
        })
    }
}

impl Scheme for Krylov<'_> {
    fn conditions(&self) -> &[Condition] {
        &self.problem.conditions
    }

    fn floating(&self) -> Option<&[Option<u32>]> {
        None
    }

    fn choice(&self) -> Choice {
        choice(self.problem)
    }

    fn points(&self) -> Vec<usize> {
        let faces = self.problem.contact.iter();
        faces.map(|face| face.points.len()).collect()
    }

    fn start(&self) -> Vec<f64> {
        self.problem.start()
    }

    fn residual(&self, u: &[f64]) -> Vec<f64> {
        self.size.set(norm(u));
        let mut r = self.problem.residual(u);
        for (r, free) in r.iter_mut().zip(&self.free) {
            if free.is_none() {
                *r = 0.0;
            }
        }
        r
    }

    fn scale(&self) -> [f64; 2] {
        let load = self.problem.load.iter();
        let load = load.fold(0.0, |m: f64, b| m.max(b.abs()));
        [self.state.borrow().matrix.norm(), load]
    }

    fn norm(&self, delta: &[f64]) -> f64 {
        self.problem.stiffness.energy(delta).max(0.0).sqrt()
    }

    fn size(&self, u: &[f64]) -> f64 {
        self.norm(u)
    }

    /// While conditions change, δ is only as exact as that deserves.
    fn step(&self, laws: &[Weights], r: &[f64]) -> Result<Vec<f64>> {
        let problem = self.problem;
        let mut state = self.state.borrow_mut();
        let state = &mut *state;
        let mut b: Vec<f64> = self.dof_of.iter().map(|&d| -r[d as usize]).collect();
        // Below this lies the rounding of A u: no step is worth it.
        let rounding = 2.0 * f64::EPSILON * state.matrix.norm() * self.size.get();
        let each = match problem.contact.len() {
            0 => 0,
            faces => problem.conditions.len() / faces,
        };
        let mut closed = vec![false; problem.contact.len()];
        for (k, face) in problem.contact.iter().enumerate() {
            let own = each * k..each * (k + 1);
            let conditions = &problem.conditions[own.clone()];
            closed[k] = self.reduce(face.face, conditions, &laws[own], &mut state.matrix, &mut b);
        }
        let changes = if state.laws.is_empty() {
            laws.len()
        } else {
            laws.iter().zip(&state.laws).filter(|(a, b)| a != b).count()
        };
        if state.embedded.is_none() || state.closed != closed {
            state.embedded = Some(self.embedded(&closed)?);
        }
        state.laws = laws.to_vec();
        state.closed = closed;
        let wanted = match changes {
            0 => FINE,
            few if few <= problem.conditions.len() / 50 + each => MEDIUM,
            _ => COARSE,
        };
        let stop = KrylovStop {
            residual: (wanted * norm(&b)).max(rounding),
            steps: STEPS,
        };
        let State {
            matrix, embedded, ..
        } = state;
        let Some(embedded) = embedded else {
            return Err(not_converged(0));
        };
        let inverse: Vec<f64> = matrix.diagonal().iter().map(|d| 1.0 / d).collect();
        let mut delta = vec![0.0; b.len()];
        let apply = |x: &[f64], y: &mut [f64]| matrix.times(x, y);
        let precondition = |r: &[f64], z: &mut [f64]| embedded.apply(matrix, &inverse, r, z);
        let ended = if problem.contact.is_empty() {
            conjugate_gradients(apply, precondition, &b, &mut delta, stop)
        } else {
            gmres(apply, precondition, &b, &mut delta, stop)
        };
        tracing::debug!(changes, ?ended, "linear iteration");
        if ended.steps == STEPS || delta.iter().any(|d| !d.is_finite()) {
            return Err(not_converged(ended.steps));
        }
        let mut all = vec![0.0; problem.space.dofs];
        for (&dof, d) in self.dof_of.iter().zip(&delta) {
            all[dof as usize] = *d;
        }
        Ok(all)
    }

    fn complete(&self, u: &[f64]) -> Vec<f64> {
        u.to_vec()
    }

    fn refine(&self, laws: &[Weights], u: &mut [f64]) -> Result<f64> {
        let delta = self.step(laws, &self.residual(u))?;
        let largest = |v: &[f64]| v.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        for (u, d) in u.iter_mut().zip(&delta) {
            *u += d;
        }
        let size = largest(u);
        Ok(if size > 0.0 {
            largest(&delta) / size
        } else {
            0.0
        })
    }
}

/// The values of P1's basis functions at the dofs.
struct VertexValues<'a> {
    space: &'a Space<'a>,
    /// A cell and local number of each dof.
    place: Vec<(u32, u8)>,
}

impl<'a> VertexValues<'a> {
    fn new(space: &'a Space<'a>) -> Self {
        let mut place = vec![(0, 0); space.dofs];
        for cell in 0..space.mesh.cell_count() {
            for (local, &dof) in (0..).zip(space.cell_dofs(cell)) {
                place[dof as usize] = (cell as u32, local);
            }
        }
        VertexValues { space, place }
    }

    fn of(&self, dof: u32) -> impl Iterator<Item = (u32, f64)> + '_ {
        let (cell, local) = self.place[dof as usize];
        let node = self.space.nodes[local as usize];
        let vertices = self.space.mesh.cell(cell as usize);
        let values = vertices.iter().copied().zip(node);
        values.filter(|(_, value)| *value != 0.0)
    }
}

/// Does the reduction above hold?
fn is_reducible(problem: &Problem) -> bool {
    let on_faces = problem.space.element.on().faces;
    let law = match problem.method.law {
        Law::Nitsche { theta1, theta2 } => theta1 != 0 && theta2 == 0,
        Law::Variational | Law::FluxCorrected => true,
        Law::Penalty { .. } | Law::Multiplier { .. } => false,
    };
    problem.floating.is_none() && (problem.contact.is_empty() || (on_faces && law))
}

/// Iterations of Newton's method times those of each step, and of its last one, as measured: they
/// hardly depend on the mesh.
const ITERATIONS: f64 = 60.0;
/// Vectors that an iteration holds.
const VECTORS: usize = 30;

fn choice(problem: &Problem) -> Choice {
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
    use crate::contact::{Iteration, Method, Stop, solve_by};
    use crate::linear::Settings;
    use crate::scene::Scene;

    fn with(solver: Solver) -> Settings {
        Settings {
            solver,
            ..Settings::default()
        }
    }

    #[test]
    fn it_agrees_with_the_direct_solver() {
        for (scene, n) in [
            ("one-zone", 20),
            ("five-zones", 33),
            ("plate", 16),
            ("transition-1.5", 17),
        ] {
            let scene = Scene::find(scene).unwrap();
            let mesh = scene.triangulation(Some(n)).unwrap();
            for method in ["cr", "cr(-1,0)", "cr-vi", "cr-fc"] {
                let method: Method = method.parse().unwrap();
                let problem = Problem::new(&scene, &mesh, method).unwrap();
                let solve = |solver| {
                    let told = |_, _| Ok(());
                    let settings = with(solver);
                    let newton = Iteration::Newton;
                    solve_by(&problem, newton, Stop::default(), settings, told).unwrap()
                };
                let (found, direct) = (solve(Solver::Iterative), solve(Solver::Multifrontal));
                assert!(
                    found.converged,
                    "{} {method}: {:?}",
                    scene.name, found.increments
                );
                assert_eq!(found.linear.solver, Solver::Iterative);
                let scale = direct.u.iter().fold(0.0, |s: f64, u| s.max(u.abs()));
                let pairs = found.u.iter().zip(&direct.u);
                let far = pairs.fold(0.0, |s: f64, (a, b)| s.max((a - b).abs()));
                assert!(
                    far < 1e-11 * scale,
                    "{} {method}: {far:e} of {scale}",
                    scene.name
                );
            }
        }
    }

    /// EᵀAE is the P1 matrix: what the preconditioner rests on.
    #[test]
    fn p1_is_embedded_exactly() {
        let scene = Scene::find("plate").unwrap();
        let mesh = scene.triangulation(Some(16)).unwrap();
        for method in ["cr", "p2"] {
            let problem = Problem::new(&scene, &mesh, method.parse().unwrap()).unwrap();
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
            let problem = Problem::new(&scene, &mesh, method.parse().unwrap()).unwrap();
            let refused = Krylov::new(&problem).err().unwrap().to_string();
            assert!(
                refused.contains(method) && refused.contains("--linear"),
                "{refused}"
            );
            assert!(Krylov::predicted(&problem).is_none());
        }
    }
}
