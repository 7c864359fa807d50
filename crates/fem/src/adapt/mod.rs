//! An accuracy instead of a mesh: solve, certify, refine where the certificate is large, until the relative bound is
//! below what was asked for.

mod candidate;
mod plan;
#[cfg(test)]
mod tests;

use std::time::Instant;

use serde::Serialize;

use crate::certify::{Certificate, Target, certify, examine};
use crate::contact::{Discretisation, Iteration, Problem, Solution, Stop, solve_by};
use crate::linear::Settings;
use crate::scene::Scene;
use candidate::{Candidate, first_n, needed_n, next_n, order};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::memory;
use faceoff_mesh::mesh::Triangulation;
use plan::Spread;

/// The requested accuracy.
#[derive(Debug, Clone)]
pub struct Wish {
    /// The scheme on every mesh.
    pub discretisation: Discretisation,
    /// Whose error is to be that small.
    pub target: Target,
    /// Relative bound of the error in the energy norm, in (0, 1).
    pub accuracy: f64,
    /// When the iteration on each mesh ends.
    pub stop: Stop,
    /// The solver of the linear systems.
    pub linear: Settings,
    /// One way only; none: whichever is predicted to be cheaper.
    pub way: Option<Way>,
}

/// How a mesh was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Way {
    /// The scene's own, at some n.
    Uniform,
    /// Bisected where the bound is large.
    Adaptive,
}

impl std::str::FromStr for Way {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "uniform" => Ok(Way::Uniform),
            "adaptive" => Ok(Way::Adaptive),
            _ => Err("use uniform or adaptive".into()),
        }
    }
}

/// One mesh on the way.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Step {
    /// How its mesh was made.
    pub way: Way,
    /// Of a uniform mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub n: Option<usize>,
    /// Of that mesh.
    pub cells: usize,
    /// Of the space, those on Γ_D among them.
    pub dofs: usize,
    /// The certified relative bound.
    pub relative: f64,
    /// How many times fewer cells an adapted mesh would take for the same bound.
    pub saving: f64,
    /// For mesh, solution and certificate.
    pub seconds: f64,
}

/// The next step.
#[derive(Debug, Clone, Copy)]
pub struct Next {
    /// How its mesh is made.
    pub way: Way,
    /// Predicted: cells of that mesh, beyond which others may follow.
    pub cells: f64,
    /// Predicted: seconds that it takes.
    pub seconds: f64,
}

/// Whether the accuracy was reached.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// The relative bound is at most the accuracy.
    Reached,
    /// Why not.
    NotReached(String),
}

/// The mesh with the smallest relative bound, and what was found on it.
pub struct Reached {
    /// The one that the bound is for.
    pub mesh: Triangulation,
    /// How it was made.
    pub way: Way,
    /// Of a uniform mesh.
    pub n: Option<usize>,
    /// u_h on it.
    pub solution: Solution,
    /// The bounds of its error.
    pub certificate: Certificate,
    /// Every mesh that was solved on, in order.
    pub steps: Vec<Step>,
    /// Whether the accuracy was reached.
    pub outcome: Outcome,
}

/// Adapting pays where it is predicted to save more than this factor of cells: it solves on several meshes, and
/// on those that no generator orders.
const WORTH: f64 = 3.5;
/// Predictions aim at this part of the accuracy.
const AIM: f64 = 0.95;
/// Bisections of a triangle from one mesh to the next, and the factor of a uniform n. While the bound is above [`COARSE`] no
/// rate can be seen.
const MOST: u8 = 6;
const FURTHEST: f64 = 4.0;
const COARSE: f64 = 0.1;
/// An adapted mesh aims at no less than this part of the square of the last bound: what is singular is then resolved
/// on meshes that are still small.
const STRIDE: f64 = 0.16;
/// Where an adapted mesh needs no more than this many times the cells of an available uniform one, the first mesh is a
/// better start.
const TOO_FINE: f64 = 4.0;
/// Meshes that do not lower the bound to this part end it when two follow each other.
const PROGRESS: f64 = 0.97;
/// No more meshes than that.
const MESHES: usize = 60;
/// The least memory per dof, with mesh, solution and certificate: 700 bytes with `cr` and 850 with `p2` on squares.
const BYTES: f64 = 700.0;

/// Refines until the relative bound is below the accuracy. `progress` is called with each mesh and what comes
/// next; an error it returns ends the run.
///
/// # Errors
/// A scene without a certificate; a start that cannot be solved; what `progress` returns. An accuracy that
/// cannot be reached is not an error, nor is the end of the run after the first mesh: the best is returned with the reason.
pub fn reach(
    scene: &Scene,
    wish: &Wish,
    mut progress: impl FnMut(&Step, Option<&Next>) -> Result<()>,
) -> Result<Reached> {
    let mut steps: Vec<Step> = Vec::new();
    let mut best: Option<(Candidate, Solution, Certificate)> = None;
    let first = first_n(scene);
    let mut candidate = Candidate::uniform(scene, first)?;
    if wish.way == Some(Way::Adaptive) {
        candidate = candidate.turned()?;
    }
    let mut stalls = 0;
    let outcome = loop {
        let clock = Instant::now();
        let solved = solved(scene, wish, &candidate.mesh);
        let (solution, certificate) = match solved {
            Ok(solved) => solved,
            // What the first mesh does not allow is an error; later it is where the way ends, with the best so far.
            Err(other) if best.is_some() => break Outcome::NotReached(other.to_string()),
            Err(other) => return Err(other),
        };
        let relative = certificate.relative(wish.target);
        let measures: Vec<f64> = (0..candidate.mesh.cell_count())
            .map(|cell| candidate.mesh.measure(cell))
            .collect();
        let spread = Spread::new(&certificate.local, &measures);
        steps.push(Step {
            way: candidate.way,
            n: candidate.n,
            cells: candidate.mesh.cell_count(),
            dofs: solution.u.len(),
            relative,
            saving: spread.saving,
            seconds: candidate.seconds + clock.elapsed().as_secs_f64(),
        });
        let step = &steps[steps.len() - 1];
        if relative <= wish.accuracy {
            progress(step, None)?;
            best = Some((candidate, solution, certificate));
            break Outcome::Reached;
        }
        let before = best.as_ref();
        let is_best = before.is_none_or(|(.., best)| relative < best.relative(wish.target));
        stalls = match &steps[..] {
            [.., last, this] if last.way == this.way && relative > PROGRESS * last.relative => {
                stalls + 1
            }
            _ => 0,
        };
        if stalls > 1 || steps.len() == MESHES {
            progress(step, None)?;
            let why = dominant(&certificate);
            if is_best {
                best = Some((candidate, solution, certificate));
            }
            break Outcome::NotReached(why);
        }
        let square: f64 = certificate.local.iter().sum();
        let goal = (AIM * wish.accuracy / relative).powi(2) * square;
        let way = wish
            .way
            .unwrap_or_else(|| choose(&candidate.mesh, wish, &steps));
        let needed = spread.sum.powi(2) / goal;
        let goal = goal.max(square * STRIDE);
        let cells = match way {
            Way::Adaptive => spread.sum.powi(2) / goal,
            Way::Uniform => {
                step.cells as f64
                    * (next_n(wish, &steps) as f64 / step.n.unwrap_or(1) as f64)
                        .powi(candidate.mesh.dim as i32)
            }
        };
        progress(step, Some(&Next::new(way, cells, step)))?;
        let clock = Instant::now();
        let made = match way {
            Way::Uniform => Candidate::uniform_from(scene, next_n(wish, &steps)),
            Way::Adaptive
                if step.way == Way::Uniform
                    && needed < TOO_FINE * step.cells as f64
                    && step.n != first =>
            {
                Candidate::uniform(scene, first).and_then(Candidate::turned)
            }
            Way::Adaptive => {
                let bytes = BYTES * cells * solution.u.len() as f64 / step.cells as f64;
                memory::require(bytes, &format!("an adapted mesh of {cells:.0} cells"))
                    .and_then(|()| candidate.adapted(&certificate.local, spread, goal))
            }
        };
        if is_best {
            best = Some((candidate, solution, certificate));
        }
        candidate = match made {
            Ok(made) => made,
            Err(other) => break Outcome::NotReached(other.to_string()),
        };
        candidate.seconds = clock.elapsed().as_secs_f64();
    };
    let Some((candidate, solution, certificate)) = best else {
        return Err(Error::Solver {
            what: "no mesh was solved on".into(),
            remedy: "report this".into(),
        });
    };
    Ok(Reached {
        mesh: candidate.mesh,
        way: candidate.way,
        n: candidate.n,
        solution,
        certificate,
        steps,
        outcome,
    })
}

fn solved(scene: &Scene, wish: &Wish, mesh: &Triangulation) -> Result<(Solution, Certificate)> {
    let problem = Problem::new(scene, mesh, &wish.discretisation)?;
    let go_on = |_, _| Ok(());
    let solution = solve_by(&problem, Iteration::Newton, wish.stop, wish.linear, go_on)?;
    if wish.target != Target::ContactForce {
        let certificate = certify(&problem, &solution.u)?;
        return Ok((solution, certificate));
    }
    let certificate = examine(&problem, &solution.u)?;
    if certificate.of(wish.target)[1].is_finite() {
        return Ok((solution, certificate));
    }
    Err(Error::Certificate {
        because: "the contact force has no interval where Γ_C meets Γ_D, as no bound of ∇u tells their shares apart".into(),
        remedy: "leave a free part of the boundary between both, or ask for g, v or u_h".into(),
    })
}

/// The parts of a bound that do not decrease.
fn dominant(certificate: &Certificate) -> String {
    let parts = certificate.parts;
    if parts.unknown > 0.5 * certificate.g {
        return "what is not known of the data inside cells, where they jump or have peaks, outweighs all else".into();
    }
    if parts.oscillation > parts.misfit {
        return "the oscillation of the data, which no flux balances, outweighs all else".into();
    }
    "finer meshes do not lower the bound any more: what is left is rounding, or a singularity of the solution".into()
}

impl Next {
    fn new(way: Way, cells: f64, last: &Step) -> Self {
        // The cost of a factor in 2D.
        let seconds = last.seconds * (cells / last.cells as f64).powf(1.15);
        Next {
            way,
            cells,
            seconds,
        }
    }
}

/// Bisection where it is predicted to save enough at the mesh that is needed, as the saving has grown so far.
fn choose(mesh: &Triangulation, wish: &Wish, steps: &[Step]) -> Way {
    let last = &steps[steps.len() - 1];
    if mesh.dim == 3 {
        return Way::Uniform;
    }
    if last.way == Way::Adaptive {
        return Way::Adaptive;
    }
    let Some(n) = last.n else {
        return Way::Adaptive;
    };
    // What is singular, or data that the mesh does not resolve.
    if order(steps).is_some_and(|order| order < 1.0) {
        return Way::Adaptive;
    }
    let mut saving = last.saving;
    if let [.., before, _] = steps
        && let Some(coarser) = before.n
    {
        let growth = (last.saving / before.saving).ln() / (n as f64 / coarser as f64).ln();
        saving *= (needed_n(wish, steps) / n as f64).powf(growth.max(0.0));
    }
    if saving > WORTH {
        Way::Adaptive
    } else {
        Way::Uniform
    }
}
