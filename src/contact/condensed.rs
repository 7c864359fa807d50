//! The Newton matrix is the stiffness A plus terms on the dofs K of the contact cells only,
//! or wherever else a method's contact conditions reach.
//! A is symmetric positive definite and factored once, K eliminated last; with S the Schur
//! complement of A on K and N the contact terms, each step is a small dense system:
//!
//! ```text
//! (A + E N Eᵀ) δ = r  ⇔  (S + N) δ_K = S (A⁻¹ r)_K,  δ = A⁻¹ (r - E N δ_K)
//! ```

use std::cell::RefCell;

use super::Problem;
use super::conditions::Condition;
use crate::error::{Error, Result};
use crate::linear::{Cholesky, Dense, DenseLu, gmres, nested_dissection};

pub(super) struct Condensed {
    /// A on the free dofs.
    factor: Cholesky,
    /// S, and what was added to A to hold parts that Γ_D does not hold.
    schur: Dense,
    shift: Dense,
    /// Free number of each dof, none on Γ_D.
    free: Vec<Option<u32>>,
    /// Number in K of each of its dofs.
    kept: Vec<Option<u32>>,
    /// Free numbers of K, ascending.
    kept_free: Vec<u32>,
    /// The last dense factorisation: for an earlier contact set, but a good preconditioner.
    stale: RefCell<Option<DenseLu>>,
}

impl Condensed {
    pub fn new(problem: &Problem) -> Result<Self> {
        let space = &problem.space;
        let mut free = vec![None; space.dofs];
        let mut points = Vec::with_capacity(space.dofs);
        for (dof, g) in problem.dirichlet.iter().enumerate() {
            if g.is_none() {
                free[dof] = Some(points.len() as u32);
                points.push(space.points[dof]);
            }
        }
        if points.is_empty() {
            return Err(Error::Solver {
                what: "Γ_D holds every dof, so there is nothing to solve".into(),
                remedy: "refine the mesh".into(),
            });
        }
        let mut last = vec![false; points.len()];
        for face in &problem.contact {
            for &dof in space.cell_dofs(face.cell) {
                if let Some(k) = free[dof as usize] {
                    last[k as usize] = true;
                }
            }
        }
        for &dof in problem.conditions.iter().flat_map(|c| &c.dofs) {
            if let Some(k) = free[dof as usize] {
                last[k as usize] = true;
            }
        }
        let kept_free: Vec<u32> = (0..last.len() as u32)
            .filter(|&k| last[k as usize])
            .collect();
        let mut kept = vec![None; space.dofs];
        for (dof, k) in free.iter().enumerate() {
            if let Some(k) = k
                && last[*k as usize]
            {
                let position = kept_free.partition_point(|f| f < k);
                kept[dof] = Some(position as u32);
            }
        }

        let mut matrix = problem.stiffness.block(&free, points.len());
        let mut shift = Dense::zeros(kept_free.len());
        if !held_by_dirichlet(problem) {
            for face in &problem.contact {
                let dofs = space.cell_dofs(face.cell);
                for point in &face.points {
                    let weight = point.weight / face.measure;
                    for (i, &dof_i) in dofs.iter().enumerate() {
                        for (j, &dof_j) in dofs.iter().enumerate() {
                            let value = weight * point.phi[i] * point.phi[j];
                            let (di, dj) = (dof_i as usize, dof_j as usize);
                            if let (Some(p), Some(q)) = (free[di], free[dj])
                                && j <= i
                            {
                                matrix.add(p.max(q) as usize, p.min(q) as usize, value);
                            }
                            if let (Some(p), Some(q)) = (kept[di], kept[dj]) {
                                shift.add(p as usize, q as usize, value);
                            }
                        }
                    }
                }
            }
        }
        let order = nested_dissection(&points, &matrix.graph(), &last);
        let factor = Cholesky::factor(&matrix, &order)?;
        let schur = factor.schur_complement(kept_free.len());
        Ok(Condensed {
            factor,
            schur,
            shift,
            free,
            kept,
            kept_free,
            stale: RefCell::new(None),
        })
    }

    /// The contact terms of the matrix on K, where the law `u-ψ + [P]₊` is replaced by
    /// α (u-ψ) + β γ ∂ₙu with (α, β) chosen for each condition.
    pub fn contact_matrix(
        &self,
        conditions: &[Condition],
        mut choose: impl FnMut(&Condition) -> [f64; 2],
    ) -> Dense {
        let mut terms = Dense::zeros(self.kept_free.len());
        for condition in conditions {
            let [alpha, beta] = choose(condition);
            for (i, &dof_i) in condition.dofs.iter().enumerate() {
                let Some(p) = self.kept[dof_i as usize] else {
                    continue;
                };
                let (phi, test) = (condition.flux_test(i), condition.test(i));
                for (j, &dof_j) in condition.dofs.iter().enumerate() {
                    let Some(q) = self.kept[dof_j as usize] else {
                        continue;
                    };
                    let flux = condition.flux[j];
                    let law = alpha * condition.displacement[j] + beta * condition.gamma * flux;
                    let value = law * test - flux * phi;
                    terms.add(p as usize, q as usize, condition.weight * value);
                }
            }
        }
        terms.minus(&self.shift)
    }

    /// δ with (A + E N Eᵀ) δ = -R on the free dofs and 0 on Γ_D; all dofs.
    ///
    /// # Errors
    /// A singular matrix.
    pub fn step(&self, contact: &Dense, residual: &[f64]) -> Result<Vec<f64>> {
        let mut r = vec![0.0; self.factor.size()];
        for (value, k) in residual.iter().zip(&self.free) {
            if let Some(k) = k {
                r[*k as usize] = -value;
            }
        }
        if !self.kept_free.is_empty() {
            let mut y = r.clone();
            self.factor.solve(&mut y);
            let on_kept: Vec<f64> = self.kept_free.iter().map(|&k| y[k as usize]).collect();
            let delta = self.solve_kept(contact, &self.schur.times(&on_kept));
            for (&k, n) in self.kept_free.iter().zip(contact.times(&delta)) {
                r[k as usize] -= n;
            }
        }
        self.factor.solve(&mut r);
        if let Some(k) = r.iter().position(|d| !d.is_finite()) {
            return Err(Error::Solver {
                what: format!(
                    "the Newton matrix is singular (free dof {k} of the step is {})",
                    r[k]
                ),
                remedy: "check gamma0, the data, and what holds the domain".into(),
            });
        }
        Ok(self
            .free
            .iter()
            .map(|k| k.map_or(0.0, |k| r[k as usize]))
            .collect())
    }

    /// (S + N) δ_K = b: from step to step few faces change their status, so that the factorisation
    /// of an earlier step and some steps of GMRES do what a new factorisation would.
    fn solve_kept(&self, contact: &Dense, b: &[f64]) -> Vec<f64> {
        let mut stale = self.stale.borrow_mut();
        if let Some(lu) = stale.as_ref().filter(|_| b.len() > SMALL) {
            let apply = |x: &[f64]| -> Vec<f64> {
                let mut y = self.schur.times(x);
                for (y, n) in y.iter_mut().zip(contact.times(x)) {
                    *y += n;
                }
                y
            };
            let found = gmres(apply, |x| lu.solve(x), b, 1e-14, b.len() / 40);
            if let Some(delta) = found {
                return delta;
            }
        }
        stale.insert(self.schur.plus(contact).lu()).solve(b)
    }
}

/// Below this a new factorisation costs less than the search for a way around it.
const SMALL: usize = 400;

/// Does every connected part touch Γ_D, so that the stiffness alone is definite?
fn held_by_dirichlet(problem: &Problem) -> bool {
    let mesh = problem.space.mesh;
    let (part_of, count) = mesh.components();
    let mut held = vec![false; count];
    for (face, part) in problem.parts.iter().enumerate() {
        if *part == Some(crate::scene::Part::Dirichlet) {
            held[part_of[mesh.face_cells(face)[0] as usize] as usize] = true;
        }
    }
    held.iter().all(|h| *h)
}
