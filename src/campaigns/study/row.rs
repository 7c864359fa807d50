//! One measurement.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::Norm;
use crate::engine::unique;

/// What a row varies; all other settings are the defaults.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Varied {
    /// Uniform meshes.
    Mesh,
    /// A mesh and a tolerance chosen for a target error.
    Target,
    /// Meshes refined where the bound is large: the time is for all intermediate meshes, with their certificates.
    Adaptive,
    /// The stopping tolerance of the iteration.
    Tolerance,
    /// The rule on Γ_C and Γ_N.
    ContactQuadrature,
    /// The rule for (f, v).
    LoadQuadrature,
    /// Solver and precision.
    Linear,
    /// γ₀ of γ = γ₀ h.
    Gamma0,
}

/// One engine and method on one mesh with one setting.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Row {
    /// The name of the scene.
    pub scene: String,
    /// The name of the engine.
    pub engine: String,
    /// The name of the method.
    pub method: String,
    /// The series that this row belongs to.
    pub varied: Varied,
    /// The n of a uniform mesh.
    pub n: Option<usize>,
    /// The certified accuracy requested for an adapted mesh.
    pub accuracy: Option<f64>,
    /// The number of cells.
    pub cells: usize,
    /// The number of dofs of the space, including those on Γ_D.
    pub dofs: usize,
    /// The relative increment at which the iteration stops.
    pub tolerance: f64,
    /// γ₀ of γ = γ₀ h.
    pub gamma0: f64,
    /// The name of the rule for (f, v).
    pub load_quadrature: String,
    /// The name of the rule on Γ_C and Γ_N.
    pub contact_quadrature: String,
    /// The solver of the linear systems; empty if the engine does not report it.
    pub linear: String,
    /// The precision of the factorisation; empty likewise.
    pub precision: String,
    /// Steps of the iteration.
    pub steps: usize,
    /// Did the iteration reach its tolerance?
    pub converged: bool,
    /// Backward error in the scheme.
    pub residual: f64,
    /// ‖∇(u-u_h)‖_h / ‖∇u‖, if u is known.
    pub h1: Option<f64>,
    /// ‖u-u_h‖ / ‖u‖, if u is known.
    pub l2: Option<f64>,
    /// The guaranteed bound of `h1`, if there is one.
    pub certified: Option<f64>,
    /// ‖u_h - ψ + [P(u_h)]₊‖ on Γ_C.
    pub contact_residual: f64,
    /// <∂ₙu_h, 1>_C
    pub contact_flux: f64,
    /// Time for mesh, assembly and solution, without start-up.
    pub seconds: Times,
    /// For a separate process: from start to end, minus `seconds`.
    pub start_up: Option<f64>,
    /// Peak memory in addition to that held before; for a separate process all of it. `None` if it is unknown.
    pub memory_mb: Option<f64>,
}

/// Seconds over repetitions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Times {
    /// The median; for an even number the mean of the middle two.
    pub median: f64,
    /// The shortest.
    pub least: f64,
    /// The longest.
    pub most: f64,
    /// The number of repetitions.
    pub repeats: usize,
}

impl Times {
    /// From at least one time.
    pub fn new(mut times: Vec<f64>) -> Self {
        times.sort_by(f64::total_cmp);
        let at = |k: usize| times.get(k).copied().unwrap_or(f64::NAN);
        let count = times.len();
        let upper = at(count / 2);
        Times {
            median: if count.is_multiple_of(2) && count > 0 {
                0.5 * (at(count / 2 - 1) + upper)
            } else {
                upper
            },
            least: at(0),
            most: at(count.saturating_sub(1)),
            repeats: count,
        }
    }
}

impl Row {
    /// The relative error in a norm: the true one, or in the energy norm the bound if u is unknown.
    pub fn error(&self, norm: Norm) -> Option<f64> {
        match norm {
            Norm::Energy => self.h1.or(self.certified),
            Norm::L2 => self.l2,
        }
    }

    /// Scene, engine and method: one line of a plot.
    pub fn track(&self) -> (&str, &str, &str) {
        (&self.scene, &self.engine, &self.method)
    }
}

/// The rows that vary one thing, by scene, engine and method.
pub fn tracks(rows: &[Row], varied: Varied) -> Vec<Vec<&Row>> {
    let all = || rows.iter().filter(|row| row.varied == varied);
    let tracks = unique(all().map(Row::track)).into_iter();
    let of = |track| all().filter(|row| row.track() == track).collect();
    tracks.map(of).collect()
}

/// The name in JSON.
impl fmt::Display for Varied {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// A row of one scene, for tests of functions of rows.
#[cfg(test)]
pub fn sample(varied: Varied, error: f64, seconds: f64) -> Row {
    Row {
        scene: "s".into(),
        engine: "rust".into(),
        method: "cr".into(),
        varied,
        n: Some(8),
        accuracy: None,
        cells: 128,
        dofs: 208,
        tolerance: 1e-12,
        gamma0: 100.0,
        load_quadrature: "radon-7".into(),
        contact_quadrature: "gauss-5".into(),
        linear: "multifrontal".into(),
        precision: "f64".into(),
        steps: 3,
        converged: true,
        residual: 1e-16,
        h1: Some(error),
        l2: None,
        certified: None,
        contact_residual: 0.0,
        contact_flux: 0.0,
        seconds: Times::new(vec![seconds]),
        start_up: None,
        memory_mb: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_summed_up() {
        let times = Times::new(vec![3.0, 1.0, 2.0, 10.0]);
        assert_eq!((times.median, times.least, times.most), (2.5, 1.0, 10.0));
        assert_eq!(Times::new(vec![3.0, 1.0, 2.0]).median, 2.0);
    }
}
