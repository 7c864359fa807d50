//! The runs: P2 on the fine mesh and its coarser ones, CR on the series of meshes by every engine, the errors of both.

use serde::Serialize;

use super::fine::Fine;
use super::fine_study::{FineOutcome, run_fine};
use super::iterations::{Count, Scheme, count, schemes};
use super::statements::{Statement, statements};
use super::work::{Listener, Work, cost};
use super::{Example, TOL};
use crate::engine::{Case, Engine, Run, Settings};
use crate::orders::{Observed, check_meshes};
use crate::verify::Failure;
use faceoff_fem::contact::{Discretisation, Errors, Method, Problem, quantities};
use faceoff_fem::known::{distance, transitions};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Triangulation;

/// What is to be run.
pub struct Request {
    /// 6.1 first.
    pub examples: Vec<Example>,
    /// Meshes for CR, rising.
    pub n: Vec<usize>,
    /// The mesh of the P2 reference, a multiple of 4: half and a quarter of it are solved as well.
    pub fine: usize,
    /// The codes that solve with CR.
    pub engines: Vec<Box<dyn Engine>>,
    pub settings: Settings,
}

/// Is told what is being done and how much of everything is finished, from several threads; may end the run.
pub type Watch<'a> = dyn Fn(&str, f64) -> Result<()> + Sync + 'a;

/// Everything that was found.
#[derive(Debug, Serialize)]
pub struct Outcome {
    /// γ = γ₀ h of every solution whose error is told.
    pub gamma0: f64,
    pub n: Vec<usize>,
    pub fine: usize,
    pub examples: Vec<ExampleOutcome>,
    pub counts: Vec<Count>,
    pub statements: Vec<Statement>,
    /// Did every iteration of Newton reach its tolerance?
    pub converged: bool,
    /// Engines that gave no answer that counts, and why.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<Failure>,
}

/// One example.
#[derive(Debug, Serialize)]
pub struct ExampleOutcome {
    pub name: String,
    pub title: String,
    pub section: &'static str,
    /// N of (6.2).
    pub zones: Option<u32>,
    pub f: String,
    pub contact_set: Vec<[f64; 2]>,
    /// Where contact begins or ends inside Γ_C.
    pub transitions: Vec<f64>,
    pub grad_norm_sq: f64,
    pub l2_norm: f64,
    pub contact_flux: f64,
    /// The paper's reference.
    pub fine: FineOutcome,
    /// CR, one of each engine.
    pub series: Vec<Series>,
}

/// CR over the meshes by one engine.
#[derive(Debug, Serialize)]
pub struct Series {
    pub engine: String,
    pub version: String,
    pub levels: Vec<Level>,
    /// Orders of the errors to the mesh-free reference.
    pub h1: Observed,
    pub l2: Observed,
    /// Of the errors to P2 on the fine mesh.
    pub h1_to_fine: Observed,
    pub l2_to_fine: Observed,
    pub residual: Observed,
}

/// CR on one mesh.
#[derive(Debug, Clone, Serialize)]
pub struct Level {
    pub n: usize,
    /// √2/n, the diameter of the cells.
    pub h: f64,
    pub dofs: usize,
    /// Steps of Newton until the increment was below the paper's tolerance.
    pub steps: Option<usize>,
    pub converged: bool,
    /// To the mesh-free reference.
    pub errors: Errors,
    /// To P2 on the fine mesh.
    pub errors_to_fine: Errors,
    /// ‖u_h + [P(u_h)]₊‖ on Γ_C.
    pub residual: f64,
}

/// Runs everything.
///
/// # Errors
/// Meshes that give no order, what solving refuses, an interruption. A companion that fails is told in the outcome.
pub fn study(request: &Request, watch: &Watch) -> Result<Outcome> {
    check(request)?;
    let gamma0 = request.examples[0].scene.gamma0();
    let work = Work::new(request, watch);
    // All examples have one domain with one boundary.
    let square = |n: usize| Ok((n, request.examples[0].scene.triangulation(Some(n))?));
    let (fine_meshes, meshes) = rayon::join(
        || {
            [4, 2, 1]
                .map(|part| square(request.fine / part))
                .into_iter()
                .collect()
        },
        || request.n.iter().map(|&n| square(n)).collect(),
    );
    let (fine_meshes, meshes): (Result<Vec<_>>, Result<Vec<_>>) = (fine_meshes, meshes);
    let (fine_meshes, meshes) = (fine_meshes?, meshes?);

    let mut cases = Vec::new();
    for example in &request.examples {
        let cr = Discretisation::of(&example.scene, Method::cr());
        for (n, mesh) in &meshes {
            cases.push(Case {
                n: Some(*n),
                problem: Problem::new(&example.scene, mesh, &cr)?,
            });
        }
    }
    let (fines, (runs, counts)) = rayon::join(
        || {
            let fines = request
                .examples
                .iter()
                .map(|e| run_fine(e, &fine_meshes, &work));
            fines.collect::<Result<Vec<_>>>()
        },
        || {
            (
                run_engines(request, &cases, &work),
                run_counts(request, &meshes, gamma0, &work),
            )
        },
    );
    let (fines, counts) = (fines?, counts?);
    let (runs, failures) = runs?;

    let mut examples = Vec::new();
    for (index, (example, (solved, fine))) in request.examples.iter().zip(fines).enumerate() {
        let of_example = index * meshes.len()..(index + 1) * meshes.len();
        let reference = solved.known();
        let mut series = Vec::new();
        for (engine, run) in &runs {
            let mut levels = Vec::new();
            for k in of_example.clone() {
                work.tell(&format!("errors of {}, {engine}", example.title()))?;
                levels.push(level(&cases[k], run, k, example, &reference));
                work.finish(cost::errors(request.n[k - of_example.start]));
            }
            series.push(Series::new(engine, &run.version, levels));
        }
        examples.push(outcome(example, fine, series));
    }
    let statements = statements(&examples, &counts, request);
    let newton = examples.iter().all(|e| {
        let levels = e.series.iter().flat_map(|s| &s.levels);
        e.fine.converged && levels.into_iter().all(|l| l.converged)
    });
    Ok(Outcome {
        gamma0,
        n: request.n.clone(),
        fine: request.fine,
        examples,
        counts,
        statements,
        converged: newton,
        failures,
    })
}

fn check(request: &Request) -> Result<()> {
    check_meshes(&request.n)?;
    if request.fine == 0 || !request.fine.is_multiple_of(4) {
        return Err(Error::usage(
            format!("a fine mesh of n = {} cannot be halved twice", request.fine),
            "give a multiple of 4, as in --fine 500",
        ));
    }
    let names: Vec<&str> = request.engines.iter().map(|e| e.name()).collect();
    for (k, name) in names.iter().enumerate() {
        if names[..k].contains(name) {
            return Err(Error::usage(
                format!("engine `{name}` is named twice"),
                "name each once",
            ));
        }
    }
    Ok(())
}

/// Counted from 1; none if never.
pub(super) fn steps_to(tolerance: f64, increments: &[f64]) -> Option<usize> {
    let first = increments.iter().position(|i| *i < tolerance);
    first.map(|k| k + 1)
}

type Runs = (Vec<(String, Run)>, Vec<Failure>);

/// The Rust engine must answer; a companion that does not is told.
fn run_engines(request: &Request, cases: &[Case], work: &Work) -> Result<Runs> {
    let (mut runs, mut failures) = (Vec::new(), Vec::new());
    for engine in &request.engines {
        let name = engine.name().to_owned();
        let run = engine.run(cases, &request.settings, &Listener { cases, work });
        let finished: f64 = request.n.iter().map(|&n| cost::engine(&name, n)).sum();
        work.finish(finished * request.examples.len() as f64);
        match run {
            Ok(run) => runs.push((name, run)),
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(e) if name == "rust" => return Err(e),
            Err(e) => failures.push(Failure {
                engine: name,
                message: e.to_string(),
            }),
        }
    }
    Ok((runs, failures))
}

/// The paper tells its counts for 6.1 only.
fn run_counts(
    request: &Request,
    meshes: &[(usize, Triangulation)],
    gamma0: f64,
    work: &Work,
) -> Result<Vec<Count>> {
    let example = &request.examples[0];
    let mut counts = Vec::new();
    for scheme in schemes(gamma0) {
        let Scheme { iteration, gamma } = scheme;
        let mut iterations = Vec::new();
        for (n, mesh) in meshes {
            let tell = |step: usize, _| {
                work.tell(&format!(
                    "{}, {iteration}, n = {n}, step {step}",
                    example.title()
                ))
            };
            iterations.push(count(&example.scene, mesh, Method::cr(), scheme, tell)?);
            work.finish(cost::count(*n));
        }
        counts.push(Count {
            example: example.scene.name().to_owned(),
            method: Method::cr().to_string(),
            iteration,
            gamma: gamma.to_string(),
            n: request.n.clone(),
            iterations,
        });
    }
    Ok(counts)
}

fn level(case: &Case, run: &Run, index: usize, example: &Example, fine: &Fine) -> Level {
    let problem = &case.problem;
    let answer = &run.answers[index];
    Level {
        n: case.n.unwrap_or(0),
        h: problem.space.mesh.geometry(0).diameter,
        dofs: problem.space.dofs,
        steps: steps_to(TOL, &answer.increments),
        converged: answer.converged,
        errors: distance(&problem.space, &answer.u, &example.truth),
        errors_to_fine: distance(&problem.space, &answer.u, fine),
        residual: quantities(problem, &answer.u).contact_residual,
    }
}

impl Series {
    fn new(engine: &str, version: &str, levels: Vec<Level>) -> Self {
        let of = |value: fn(&Level) -> f64| {
            let pairs: Vec<_> = levels.iter().map(|l| (l.n, value(l))).collect();
            Observed::new(&pairs)
        };
        Series {
            engine: engine.to_owned(),
            version: version.to_owned(),
            h1: of(|l| l.errors.h1),
            l2: of(|l| l.errors.l2),
            h1_to_fine: of(|l| l.errors_to_fine.h1),
            l2_to_fine: of(|l| l.errors_to_fine.l2),
            residual: of(|l| l.residual),
            levels,
        }
    }
}

fn outcome(example: &Example, fine: FineOutcome, series: Vec<Series>) -> ExampleOutcome {
    let truth = &example.truth;
    ExampleOutcome {
        name: example.scene.name().to_owned(),
        title: example.title(),
        section: example.section,
        zones: example.zones,
        f: example.scene.data().f.text().to_owned(),
        contact_set: truth.contact_set.clone(),
        transitions: transitions(truth).collect(),
        grad_norm_sq: truth.grad_norm_sq,
        l2_norm: truth.l2_norm,
        contact_flux: truth.contact_flux,
        fine,
        series,
    }
}
