//! The number of iterations for the nonlinear problems: semismooth Newton, and each splitting of a fixed point.
//!
//! The paper iterates a fixed point "until the relative H¹-error of the increment is smaller than TOL" and reports its counts;
//! it states neither γ₀ nor the splitting nor the initial guess. Here each splitting starts from u = 0 and is counted by the paper's
//! criterion; in addition the backward error of the last iterate is reported, since that criterion does not bound it.

use rayon::prelude::*;
use serde::{Serialize, Serializer};

use super::patterns::{PATTERNS, Pattern};
use super::{ITERATIONS, MESHES, TOL};
use faceoff_fem::contact::{
    Discretisation, Iteration, Method, Problem, SPLITTINGS, Splitting, Stop, solve,
};
use faceoff_fem::scene::Scene;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Triangulation;

/// Iterations stop here without a result; the paper's longest took 127.
pub const CAP: usize = 300;

/// γ on Γ_C.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gamma {
    /// γ = γ₀ h
    Scaled(f64),
    /// γ is independent of h.
    Fixed(f64),
}

/// An iteration with its γ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scheme {
    pub iteration: Iteration,
    pub gamma: Gamma,
}

/// Semismooth Newton, then every splitting. `gamma0` is the scene's.
pub fn schemes(gamma0: f64) -> [Scheme; 6] {
    let scheme = |iteration, gamma| Scheme { iteration, gamma };
    let fixed = |splitting, gamma| scheme(Iteration::FixedPoint(splitting), gamma);
    [
        scheme(Iteration::Newton, Gamma::Scaled(gamma0)),
        // Converges for γ₀ < 1 only.
        fixed(Splitting::LaggedP, Gamma::Scaled(0.5)),
        // Converges for γ > 0.28 or so, for every h.
        fixed(Splitting::LaggedGap, Gamma::Fixed(1.0)),
        fixed(Splitting::Relaxed, Gamma::Scaled(gamma0)),
        fixed(Splitting::FluxNew, Gamma::Fixed(0.1)),
        // The nearest to the paper's counts; see [`Search`].
        fixed(Splitting::DisplacementNew, Gamma::Scaled(4.5)),
    ]
}

/// The number of iterations of one scheme on each mesh.
#[derive(Debug, Clone, Serialize)]
pub struct Count {
    /// The example, by the name of its scene.
    pub example: String,
    /// `cr` or `p2`.
    pub method: String,
    /// Newton's method, or a splitting of the fixed point.
    #[serde(serialize_with = "as_text")]
    pub iteration: Iteration,
    /// γ as text.
    pub gamma: String,
    /// The direction of the diagonals.
    pub mesh: Pattern,
    /// Ascending.
    pub n: Vec<usize>,
    /// Steps to the first increment below [`TOL`]; `None` if it takes more than [`CAP`].
    pub iterations: Vec<Option<usize>>,
    /// The backward error of the last iterate in the scheme.
    pub backward_errors: Vec<f64>,
}

fn as_text<T: std::fmt::Display, S: Serializer>(
    value: &T,
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    serializer.collect_str(value)
}

impl std::fmt::Display for Gamma {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Gamma::Scaled(gamma0) => write!(f, "{} h", Short(*gamma0)),
            Gamma::Fixed(gamma) => write!(f, "{}", Short(*gamma)),
        }
    }
}

/// Four digits, without trailing zeros.
struct Short(f64);

impl std::fmt::Display for Short {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = (3 - self.0.abs().log10().floor() as i32).max(0) as usize;
        let text = format!("{:.digits$}", self.0);
        let text = match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.'),
            false => &text,
        };
        f.write_str(text)
    }
}

/// The steps of `scheme` to the first increment below [`TOL`], from u = 0, and the backward error of the last iterate.
///
/// # Errors
/// Errors of `progress`, or a matrix that cannot be factorised.
pub fn count(
    scene: &Scene,
    mesh: &Triangulation,
    method: Method,
    scheme: Scheme,
    cap: usize,
    progress: impl FnMut(usize, f64) -> Result<()>,
) -> Result<(Option<usize>, f64)> {
    let mut discretisation = Discretisation::of(scene, method);
    discretisation.gamma0 = match scheme.gamma {
        Gamma::Scaled(gamma0) => gamma0,
        Gamma::Fixed(gamma) => gamma / mesh.geometry(0).diameter,
    };
    let problem = Problem::new(scene, mesh, &discretisation)?;
    let stop = Stop {
        increment: TOL,
        max_iterations: cap,
    };
    let solution = solve(&problem, scheme.iteration, stop, progress)?;
    // Only by the increment, as the paper counts.
    Ok((steps_to(TOL, &solution.increments), solution.backward_error))
}

/// One (splitting, γ, mesh) of a search.
#[derive(Debug, Clone, Serialize)]
pub struct Trial {
    /// The splitting.
    #[serde(serialize_with = "as_text")]
    pub iteration: Iteration,
    /// γ as text.
    pub gamma: String,
    /// The direction of the diagonals.
    pub mesh: Pattern,
    /// Steps to the first increment below [`TOL`], on each requested mesh that is the paper's.
    pub iterations: Vec<usize>,
    /// The largest |k - paper's| / paper's over the meshes.
    pub off: f64,
}

/// The search for the paper's counts.
#[derive(Debug, Serialize)]
pub struct Search {
    /// The requested meshes that are the paper's.
    pub n: Vec<usize>,
    /// The number of triples (splitting, γ, mesh) that were tried.
    pub tried: usize,
    /// The number of them that stayed within [`FAR`] on all meshes, by splitting.
    pub near: Vec<(String, usize)>,
    /// The nearest of these.
    pub nearest: Vec<Trial>,
}

/// A trial is abandoned if its deviation is larger.
pub const FAR: f64 = 0.25;
/// γ₀, or γ, from 10^-2 to 10^3: the number of values per decade.
const PER_DECADE: i32 = 16;
/// The number of trials in the report.
const SHOWN: usize = 6;

/// All splittings, both meshes, γ = γ₀ h and γ fixed, compared with the paper's counts of 6.1; `None` if no mesh is the paper's.
///
/// # Errors
/// Errors of `check`.
pub fn search(
    scene: &Scene,
    n: &[usize],
    check: impl Fn() -> Result<()> + Sync,
) -> Result<Option<Search>> {
    let known = MESHES.iter().zip(ITERATIONS);
    let known: Vec<(usize, usize)> = known
        .filter(|(m, _)| n.contains(m))
        .map(|(m, k)| (*m, k))
        .collect();
    if known.is_empty() {
        return Ok(None);
    }
    let meshes = PATTERNS.map(|pattern| {
        let all = known.par_iter().map(|(n, _)| pattern.mesh(*n));
        all.collect::<Result<Vec<_>>>()
    });
    let [own, other] = meshes;
    let meshes = [own?, other?];
    let mut values: Vec<f64> = (-2 * PER_DECADE..=3 * PER_DECADE)
        .map(|k| 10.0_f64.powf(f64::from(k) / f64::from(PER_DECADE)))
        .collect();
    values.push(4.5);
    let mut trials = Vec::new();
    for splitting in SPLITTINGS {
        for (k, pattern) in PATTERNS.into_iter().enumerate() {
            let gammas = values
                .iter()
                .flat_map(|&v| [Gamma::Scaled(v), Gamma::Fixed(v)]);
            trials.extend(gammas.map(|gamma| (splitting, k, pattern, gamma)));
        }
    }
    let run = |&(splitting, k, mesh, gamma): &(Splitting, usize, Pattern, Gamma)| {
        let iteration = Iteration::FixedPoint(splitting);
        let scheme = Scheme { iteration, gamma };
        let (mut iterations, mut off) = (Vec::new(), 0.0_f64);
        for (of, (_, stated)) in meshes[k].iter().zip(&known) {
            let stated = *stated as f64;
            let cap = ((1.0 + FAR) * stated) as usize + 1;
            // With a singular matrix the iteration does not reach the tolerance.
            let found = match count(scene, of, Method::cr(), scheme, cap, |_, _| check()) {
                Ok((Some(found), _)) => found,
                Ok((None, _)) | Err(Error::Solver { .. }) => return Ok(None),
                Err(other) => return Err(other),
            };
            off = off.max((found as f64 - stated).abs() / stated);
            if off > FAR {
                return Ok(None);
            }
            iterations.push(found);
        }
        Ok(Some(Trial {
            iteration,
            gamma: gamma.to_string(),
            mesh,
            iterations,
            off,
        }))
    };
    let found = trials.par_iter().map(run).collect::<Result<Vec<_>>>()?;
    let mut nearest: Vec<Trial> = found.into_iter().flatten().collect();
    nearest.sort_by(|a, b| a.off.total_cmp(&b.off));
    let near = SPLITTINGS.map(|splitting| {
        let iteration = Iteration::FixedPoint(splitting);
        let of_it = nearest.iter().filter(|trial| trial.iteration == iteration);
        (iteration.to_string(), of_it.count())
    });
    nearest.truncate(SHOWN);
    Ok(Some(Search {
        n: known.iter().map(|(n, _)| *n).collect(),
        tried: trials.len(),
        near: near.into(),
        nearest,
    }))
}

/// Counted from 1; `None` if never.
pub(super) fn steps_to(tolerance: f64, increments: &[f64]) -> Option<usize> {
    let first = increments.iter().position(|i| *i < tolerance);
    first.map(|k| k + 1)
}
