//! How many iterations the nonlinear problems take: semismooth Newton, and each splitting of a fixed point.
//!
//! The paper iterates a fixed point and reports its counts; it states neither γ₀ nor the splitting nor the start. Each
//! splitting here runs from u = 0 with a γ with which it converges.

use serde::{Serialize, Serializer};

use super::TOL;
use faceoff_fem::contact::{Discretisation, Iteration, Method, Problem, Splitting, Stop, solve};
use faceoff_fem::scene::Scene;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Triangulation;

/// Iterations end here without a result; the paper's longest took 127.
pub const CAP: usize = 300;

/// γ on Γ_C.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gamma {
    /// γ = γ₀ h
    Scaled(f64),
    /// γ whatever h.
    Fixed(f64),
}

/// An iteration and the γ that it is run with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scheme {
    pub iteration: Iteration,
    pub gamma: Gamma,
}

/// Semismooth Newton, then every splitting. `gamma0` is the scene's.
pub fn schemes(gamma0: f64) -> [Scheme; 5] {
    let scheme = |iteration, gamma| Scheme { iteration, gamma };
    let fixed = |splitting, gamma| scheme(Iteration::FixedPoint(splitting), gamma);
    [
        scheme(Iteration::Newton, Gamma::Scaled(gamma0)),
        // Converges for γ₀ < 1 only.
        fixed(Splitting::LaggedP, Gamma::Scaled(0.5)),
        // Converges for γ > 0.28 or so, whatever h.
        fixed(Splitting::LaggedGap, Gamma::Fixed(1.0)),
        fixed(Splitting::Relaxed, Gamma::Scaled(gamma0)),
        fixed(Splitting::FluxNew, Gamma::Fixed(0.1)),
    ]
}

/// How many iterations one scheme took on each mesh.
#[derive(Debug, Clone, Serialize)]
pub struct Count {
    /// Example, by the name of its scene.
    pub example: String,
    /// `cr` or `p2`.
    pub method: String,
    #[serde(serialize_with = "as_text")]
    pub iteration: Iteration,
    /// γ in words.
    pub gamma: String,
    pub n: Vec<usize>,
    /// None where [`TOL`] was not reached in [`CAP`] iterations.
    pub iterations: Vec<Option<usize>>,
}

fn as_text<S: Serializer>(
    iteration: &Iteration,
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    serializer.collect_str(iteration)
}

impl std::fmt::Display for Gamma {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Gamma::Scaled(gamma0) => write!(f, "{gamma0} h"),
            Gamma::Fixed(gamma) => write!(f, "{gamma}"),
        }
    }
}

/// The iterations of `scheme` until the relative H¹ norm of the increment is below [`TOL`], from u = 0.
///
/// # Errors
/// What `progress` returns, or a matrix that cannot be factorised.
pub fn count(
    scene: &Scene,
    mesh: &Triangulation,
    method: Method,
    scheme: Scheme,
    progress: impl FnMut(usize, f64) -> Result<()>,
) -> Result<Option<usize>> {
    let mut discretisation = Discretisation::of(scene, method);
    discretisation.gamma0 = match scheme.gamma {
        Gamma::Scaled(gamma0) => gamma0,
        Gamma::Fixed(gamma) => gamma / mesh.geometry(0).diameter,
    };
    let problem = Problem::new(scene, mesh, &discretisation)?;
    let stop = Stop {
        increment: TOL,
        max_iterations: CAP,
    };
    let solution = solve(&problem, scheme.iteration, stop, progress)?;
    Ok(solution.converged.then_some(solution.increments.len()))
}
