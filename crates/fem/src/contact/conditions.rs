//! The contact condition as each law imposes it. All of them are one form,
//!
//! ```text
//! (∇u,∇v) - Σ_k w_k q_k(u) g_k(v) + Σ_k w_k max(g_k(u)-ψ_k, γ_k q_k(u)) (θ₂γ_k⁻¹ g_k(v) + θ₁ q_k'(v)) = L(v)
//! ```
//!
//! and differ in the functionals of displacement g_k and flux q_k, and in θ:
//!
//! ```text
//!              g_k                      q_k                                   θ
//! Nitsche      values at the rule's     ∂ₙ there                              any: this is (2.4)
//!              points on Γ_C
//! Corrected    the same                 ∂ₙ - L(φ_F)/|F| on F                  (1, 0)
//! Penalty      the same                 0                                     (0, 1)
//! Multiplier   means on faces           means of ∂ₙ                           (-1, 1): λ eliminated by
//!                                                                             λ = min(0, q - γ⁻¹(g-ψ))
//! Variational  dofs on Γ_C              ((∇u,∇φ_k) - L(φ_k)) / ∫_C φ_k,       (0, 1): row k becomes
//!                                       the flux that balances row k          max(g-ψ, γq) = 0
//! ```
//!
//! # Why the flux is corrected
//!
//! Take (3.2) on CR, and a cell κ with the set C of faces on Γ_C. ∇u is constant on κ, and φ_F has
//! the mean 1 on F and 0 on the other faces, so that (∇u,∇φ_F)_κ = |F| ∂ₙu, which the term
//! <∂ₙu,φ_F> takes away again. With M_G the mean of max(u-ψ, γ∂ₙu) on G what is left of row F is
//!
//! ```text
//! Σ_{G ∈ C} |G| M_G ∂ₙφ_F|_G = Σ_{G ∈ C} (∇φ_G,∇φ_F)_κ M_G = L(φ_F),   F ∈ C
//! ```
//!
//! and the Gram matrix of the ∇φ_G gives M_F = m_F of order h²f instead of 0. A free face so
//! carries the flux m_F/γ, which is of order h where γ = γ₀ h: first order in L², and no better.
//! What F carries in balance with its load is (after L. D. Marini, SIAM J. Numer. Anal. 22, 1985)
//!
//! ```text
//! λ_F = ((∇u,∇φ_F)_κ - L(φ_F)) / |F| = ∂ₙu - L(φ_F)/|F|,   L(φ_F) = (f,φ_F) + <t,φ_F>_N
//! ```
//!
//! With λ in the place of ∂ₙu the right-hand side of row F is L(φ_F) - L(φ_F) = 0. So M_F = 0:
//! at the midpoint u ≤ ψ, λ ≤ 0, (u-ψ)λ = 0, in which γ has no part; and in the rows of all other
//! faces G, where the terms on Γ_C are Σ_F |F| M_F ∂ₙφ_G|_F = 0, the plain (∇u,∇φ_G) = L(φ_G). The
//! equilibrated flux of Marini, in H(div), has the normal components λ_F on Γ_C without any change.

use std::collections::BTreeMap;

use super::form::{ContactFace, Trace};
use super::method::{Law, Method};
use crate::assembly::{Stiffness, value_at};
use crate::element::Space;
use crate::scene::Expression;
use faceoff_mesh::error::Result;

/// One k of the form above.
#[derive(Clone)]
pub struct Condition {
    pub weight: f64,
    pub gamma: f64,
    /// The dofs that the functionals see.
    pub dofs: Vec<u32>,
    /// g_k of each of those basis functions.
    pub displacement: Vec<f64>,
    /// q_k' of each.
    pub flux: Vec<f64>,
    /// q_k(0)
    pub flux_at_rest: f64,
    /// ψ_k
    pub psi: f64,
    /// θ₁ and θ₂
    thetas: [i8; 2],
    /// The one row that has it all, where the scheme is solved by faces.
    pub(super) row: Option<Row>,
}

/// A row that has the whole law of a contact face; see `scheme`.
#[derive(Clone, Copy)]
pub(super) struct Row {
    /// Of which of the condition's dofs.
    pub local: usize,
    /// h_F
    pub height: f64,
    /// How many conditions share the row.
    pub points: usize,
}

impl Condition {
    pub fn trace(&self, u: &[f64]) -> Trace {
        let (mut gap, mut flux) = (-self.psi, self.flux_at_rest);
        for (k, &dof) in self.dofs.iter().enumerate() {
            gap += self.displacement[k] * u[dof as usize];
            flux += self.flux[k] * u[dof as usize];
        }
        Trace::new(gap, flux, self.gamma)
    }

    /// Sums of the sizes of the terms of gap and flux.
    pub fn sizes(&self, u: &[f64]) -> [f64; 2] {
        let (mut gap, mut flux) = (self.psi.abs(), self.flux_at_rest.abs());
        for (k, &dof) in self.dofs.iter().enumerate() {
            gap += (self.displacement[k] * u[dof as usize]).abs();
            flux += (self.flux[k] * u[dof as usize]).abs();
        }
        [gap, flux]
    }

    /// The same condition where dofs have other numbers.
    pub(super) fn with_dofs(&self, number: impl Fn(u32) -> u32) -> Condition {
        Condition {
            dofs: self.dofs.iter().map(|&dof| number(dof)).collect(),
            displacement: self.displacement.clone(),
            flux: self.flux.clone(),
            ..*self
        }
    }

    /// Adds its terms of the scheme at u to a residual.
    pub(super) fn add_to(&self, u: &[f64], r: &mut [f64]) {
        let trace = self.trace(u);
        self.add(trace, trace.gap.max(self.gamma * trace.flux), r);
    }

    /// Adds its terms of the linear scheme with the law α (u-ψ) + β γ ∂ₙu at u to a residual.
    pub(super) fn add_law_to(&self, [alpha, beta]: [f64; 2], u: &[f64], r: &mut [f64]) {
        let trace = self.trace(u);
        self.add(trace, alpha * trace.gap + beta * self.gamma * trace.flux, r);
    }

    /// A row that has it all is nothing but the law, since -q only takes away what else there is.
    fn add(&self, trace: Trace, law: f64, r: &mut [f64]) {
        let flux = if self.row.is_some() { 0.0 } else { trace.flux };
        for (j, &dof) in self.dofs.iter().enumerate() {
            r[dof as usize] += self.weight * (law * self.test(j) - flux * self.flux_test(j));
        }
    }

    /// Adds its terms of that linear scheme at a direction.
    pub(super) fn add_linear_to(&self, [alpha, beta]: [f64; 2], delta: &[f64], r: &mut [f64]) {
        let (mut gap, mut flux) = (0.0, 0.0);
        for (k, &dof) in self.dofs.iter().enumerate() {
            gap += self.displacement[k] * delta[dof as usize];
            flux += self.flux[k] * delta[dof as usize];
        }
        let law = alpha * gap + beta * self.gamma * flux;
        for (j, &dof) in self.dofs.iter().enumerate() {
            r[dof as usize] += self.weight * (law * self.test(j) - flux * self.flux_test(j));
        }
    }

    /// The entries of that linear scheme: row, column, value.
    pub(super) fn for_each_entry(
        &self,
        [alpha, beta]: [f64; 2],
        mut visit: impl FnMut(u32, u32, f64),
    ) {
        for (j, &column) in self.dofs.iter().enumerate() {
            let law = alpha * self.displacement[j] + beta * self.gamma * self.flux[j];
            for (i, &row) in self.dofs.iter().enumerate() {
                let value = law * self.test(i) - self.flux[j] * self.flux_test(i);
                visit(row, column, self.weight * value);
            }
        }
    }

    /// The functional that the law is tested with, by (dof, value).
    pub(super) fn test_row(&self) -> Vec<(u32, f64)> {
        let dofs = self.dofs.iter().enumerate();
        dofs.map(|(j, &dof)| (dof, self.test(j))).collect()
    }

    /// w (α g + β γ q'), by (dof, value).
    pub(super) fn law_row(&self, [alpha, beta]: [f64; 2]) -> Vec<(u32, f64)> {
        let value = |j: usize| alpha * self.displacement[j] + beta * self.gamma * self.flux[j];
        let dofs = self.dofs.iter().enumerate();
        dofs.map(|(j, &dof)| (dof, self.weight * value(j)))
            .collect()
    }

    /// What -q is tested with: g(φ_j), j counted in `dofs`.
    pub fn flux_test(&self, j: usize) -> f64 {
        match self.row {
            Some(row) => f64::from(u8::from(row.local == j)),
            None => self.displacement[j],
        }
    }

    /// What the law is tested with: θ₂ γ⁻¹ g(φ_j) + θ₁ q'(φ_j), j counted in `dofs`.
    pub fn test(&self, j: usize) -> f64 {
        if self.row.is_some() {
            return self.flux_test(j);
        }
        let [theta1, theta2] = self.thetas.map(f64::from);
        theta2 / self.gamma * self.displacement[j] + theta1 * self.flux[j]
    }
}

/// The conditions of a method on its contact faces; `load` is L, `dirichlet` marks dofs on Γ_D.
///
/// # Errors
/// A value of ψ that is not finite.
pub(super) fn conditions(
    method: &Method,
    space: &Space,
    contact: &[ContactFace],
    psi: &Expression,
    stiffness: &Stiffness,
    load: &[f64],
    dirichlet: &[Option<f64>],
) -> Result<Vec<Condition>> {
    let thetas = method.law.thetas();
    Ok(match method.law {
        Law::Nitsche { .. } | Law::FluxCorrected => at_points(space, contact, thetas, 1.0),
        Law::Penalty { .. } => at_points(space, contact, thetas, 0.0),
        Law::Multiplier { .. } => contact
            .iter()
            .map(|face| on_average(space, face, thetas))
            .collect(),
        Law::Variational => at_dofs(space, contact, thetas, psi, stiffness, load, dirichlet)?,
    })
}

/// The traces at the rule's points, with the flux counted `times`.
fn at_points(
    space: &Space,
    contact: &[ContactFace],
    thetas: [i8; 2],
    times: f64,
) -> Vec<Condition> {
    let mut conditions = Vec::new();
    for face in contact {
        let dofs = space.cell_dofs(face.cell);
        conditions.extend(face.points.iter().map(|point| Condition {
            weight: point.weight,
            gamma: face.gamma,
            dofs: dofs.to_vec(),
            displacement: point.phi[..dofs.len()].to_vec(),
            flux: point.dn[..dofs.len()].iter().map(|dn| times * dn).collect(),
            flux_at_rest: times * point.flux_at_rest,
            psi: point.psi,
            thetas,
            row: None,
        }));
    }
    conditions
}

/// The means on a face.
fn on_average(space: &Space, face: &ContactFace, thetas: [i8; 2]) -> Condition {
    let dofs = space.cell_dofs(face.cell);
    let mut condition = Condition {
        weight: face.measure,
        gamma: face.gamma,
        dofs: dofs.to_vec(),
        displacement: vec![0.0; dofs.len()],
        flux: vec![0.0; dofs.len()],
        flux_at_rest: 0.0,
        psi: 0.0,
        thetas,
        row: None,
    };
    for point in &face.points {
        let share = point.weight / face.measure;
        for k in 0..dofs.len() {
            condition.displacement[k] += share * point.phi[k];
            condition.flux[k] += share * point.dn[k];
        }
        condition.psi += share * point.psi;
    }
    condition
}

/// A dof of degree 1 on Γ_C while its condition is put together.
#[derive(Default)]
struct Constraint {
    /// ∫_C φ
    mass: f64,
    /// Σ_F γ_F ∫_F φ
    gamma: f64,
    /// Its row of the stiffness matrix.
    row: BTreeMap<u32, f64>,
    psi: f64,
}

fn at_dofs(
    space: &Space,
    contact: &[ContactFace],
    thetas: [i8; 2],
    psi: &Expression,
    stiffness: &Stiffness,
    load: &[f64],
    dirichlet: &[Option<f64>],
) -> Result<Vec<Condition>> {
    let mut constraints: BTreeMap<u32, Constraint> = BTreeMap::new();
    for face in contact {
        let local = space.mesh.local_face(face.cell, face.face);
        let dofs: Vec<u32> = space.face_dofs(face.cell, local).collect();
        let mass = face.measure / dofs.len() as f64;
        for &dof in dofs
            .iter()
            .filter(|&&dof| dirichlet[dof as usize].is_none())
        {
            let constraint = constraints.entry(dof).or_default();
            constraint.mass += mass;
            constraint.gamma += mass * face.gamma;
            constraint.psi = if space.element.on().faces {
                let terms = face.points.iter().map(|p| p.weight * p.psi);
                terms.sum::<f64>() / face.measure
            } else {
                value_at(psi, "psi", space.point(dof as usize))?
            };
        }
    }
    stiffness.for_each(0..space.mesh.cell_count(), |row, column, value| {
        if let Some(constraint) = constraints.get_mut(&row) {
            *constraint.row.entry(column).or_default() += value;
        }
    });
    let condition = |(dof, c): (u32, Constraint)| Condition {
        weight: c.mass,
        gamma: c.gamma / c.mass,
        displacement: c
            .row
            .keys()
            .map(|&d| f64::from(u8::from(d == dof)))
            .collect(),
        flux: c.row.values().map(|a| a / c.mass).collect(),
        flux_at_rest: -load[dof as usize] / c.mass,
        dofs: c.row.into_keys().collect(),
        psi: c.psi,
        thetas,
        row: None,
    };
    Ok(constraints.into_iter().map(condition).collect())
}
