//! One contact condition, and its terms in residuals and matrices.

use super::face::Trace;

/// One k of the form that all laws have, see `law`.
#[derive(Clone)]
pub struct Condition {
    /// w_k, a measure: length in 2D, area in 3D.
    pub weight: f64,
    /// γ_k, a length.
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
    pub(super) thetas: [f64; 2],
    /// The one row that has it all, where the scheme is solved by faces.
    pub(super) row: Option<Row>,
}

/// A row that has the whole law of a contact face; see `scheme`.
#[derive(Clone, Copy)]
pub(super) struct Row {
    /// The indices in the condition's dofs.
    pub local: usize,
    /// h_F
    pub height: f64,
    /// How many conditions share the row.
    pub points: usize,
}

impl Condition {
    /// u - ψ and the flux of a dof vector at this point.
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
    pub(super) fn for_each_entry(&self, law: [f64; 2], mut visit: impl FnMut(u32, u32, f64)) {
        self.for_each_local_entry(law, |i, j, value| {
            visit(self.dofs[i], self.dofs[j], value);
        });
    }

    /// The same with places in `dofs` for rows and columns.
    pub(super) fn for_each_local_entry(
        &self,
        [alpha, beta]: [f64; 2],
        mut visit: impl FnMut(usize, usize, f64),
    ) {
        for j in 0..self.dofs.len() {
            let law = alpha * self.displacement[j] + beta * self.gamma * self.flux[j];
            for i in 0..self.dofs.len() {
                let value = law * self.test(i) - self.flux[j] * self.flux_test(i);
                visit(i, j, self.weight * value);
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

    /// The test functional of -q: g(φ_j), j counted in `dofs`.
    pub fn flux_test(&self, j: usize) -> f64 {
        match self.row {
            Some(row) => f64::from(u8::from(row.local == j)),
            None => self.displacement[j],
        }
    }

    /// The test functional of the law: θ₂ γ⁻¹ g(φ_j) + θ₁ q'(φ_j), j counted in `dofs`.
    pub fn test(&self, j: usize) -> f64 {
        if self.row.is_some() {
            return self.flux_test(j);
        }
        let [theta1, theta2] = self.thetas;
        theta2 / self.gamma * self.displacement[j] + theta1 * self.flux[j]
    }
}
