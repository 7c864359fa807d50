//! The runs: P2 on the fine mesh and its coarser ones, CR on the series of meshes by every engine, with the errors of both.

use serde::Serialize;

use super::fine::Fine;
use super::fine_study::{FineOutcome, run_fine};
use super::iterations::{CAP, Count, Scheme, Search, count, schemes, search, steps_to};
use super::patterns::PATTERNS;
use super::request::PaperRequest;
use super::statements::{Statement, statements};
use super::sweep::{Variant, sweep};
use super::theory::{Theory, theory};
use super::work::{Listener, Part, Work};
use super::{Example, TOL};
use crate::engine::{Answer, Case, Progress};
use crate::run::{Answers, Failure, Observed, Runner, check_meshes};
use faceoff_fem::contact::{Discretisation, Errors, Method, Problem, quantities};
use faceoff_fem::known::{distance, transitions};
use faceoff_mesh::error::{Error, Result};

/// The result of a run.
#[derive(Debug, Serialize)]
pub struct PaperOutcome {
    /// γ₀ of γ = γ₀ h for every solution whose error is reported.
    pub gamma0: f64,
    /// Meshes for CR, ascending.
    pub n: Vec<usize>,
    /// n of the mesh of the P2 reference.
    pub fine: usize,
    /// In the order of the request.
    pub examples: Vec<ExampleOutcome>,
    /// The counts of Newton's method and of each splitting.
    pub counts: Vec<Count>,
    /// The search for the paper's counts; `None` if no mesh is the paper's.
    pub search: Option<Search>,
    /// Lemma 3.1, (4.2) and Proposition 4.2 as numbers.
    pub theory: Theory,
    /// The statements of the paper.
    pub statements: Vec<Statement>,
    /// Did every Newton iteration reach its tolerance?
    pub converged: bool,
    /// Engines without a valid answer, and why.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<Failure>,
}

/// One example.
#[derive(Debug, Serialize)]
pub struct ExampleOutcome {
    /// The name of its scene.
    pub name: String,
    /// The title in the report.
    pub title: String,
    /// The section of the paper.
    pub section: &'static str,
    /// N of (6.2).
    pub zones: Option<u32>,
    /// The load, as a formula.
    pub f: String,
    /// The contact intervals of u on y = 0, ascending.
    pub contact_set: Vec<[f64; 2]>,
    /// Where contact begins or ends inside Γ_C.
    pub transitions: Vec<f64>,
    /// ‖∇u‖²
    pub grad_norm_sq: f64,
    /// ‖u‖
    pub l2_norm: f64,
    /// <∂ₙu, 1>_C
    pub contact_flux: f64,
    /// γ₀ of the series.
    pub gamma0: f64,
    /// The paper's reference.
    pub fine: FineOutcome,
    /// CR, one per engine.
    pub series: Vec<Series>,
    /// CR on both meshes with several γ₀, and the conforming method.
    pub variants: Vec<Variant>,
}

/// CR over the meshes by one engine.
#[derive(Debug, Serialize)]
pub struct Series {
    /// The name of the engine.
    pub engine: String,
    /// The version that it reports.
    pub version: String,
    /// By ascending n.
    pub levels: Vec<SeriesLevel>,
    /// Orders of the errors with respect to the mesh-free reference.
    pub h1: Observed,
    /// The same in L².
    pub l2: Observed,
    /// Orders of the errors with respect to P2 on the fine mesh.
    pub h1_to_fine: Observed,
    /// The same in L².
    pub l2_to_fine: Observed,
    /// The order of ‖u_h + [P(u_h)]₊‖ on Γ_C.
    pub residual: Observed,
    /// The order of the same times γ^(-1/2).
    pub weighted_residual: Observed,
}

/// CR on one mesh.
#[derive(Debug, Clone, Serialize)]
pub struct SeriesLevel {
    /// The mesh has 2n² cells.
    pub n: usize,
    /// √2/n, the diameter of the cells.
    pub h: f64,
    /// The number of faces, including those on Γ_D.
    pub dofs: usize,
    /// Steps of Newton's method until the increment was below the paper's tolerance.
    pub steps: Option<usize>,
    /// Did the iteration reach its tolerance?
    pub converged: bool,
    /// With respect to the mesh-free reference.
    pub errors: Errors,
    /// With respect to P2 on the fine mesh.
    pub errors_to_fine: Errors,
    /// ‖u_h + [P(u_h)]₊‖ on Γ_C.
    pub residual: f64,
    /// The same times γ^(-1/2).
    pub weighted_residual: f64,
    /// ‖u-u_h‖₁ₕ = ‖∇(u-u_h)‖_h + ‖u-u_h‖, relative to the norm of u: the norm of (5.12).
    pub norm_1h: f64,
}

/// Runs everything.
///
/// Meshes that do not give an order, errors of the solver, an interruption. A companion that fails is recorded in the outcome.
/// Meshes that give no order, what solving refuses, an interruption. A companion that fails is noted in the outcome.
pub fn study(request: &PaperRequest, progress: &dyn Progress) -> Result<PaperOutcome> {
    check(request)?;
    let gamma0 = request.examples[0].scene.gamma0();
    let work = Work::new(request, progress);
    // All examples have the same domain and boundary.
    let square = |n: usize| Ok((n, request.examples[0].scene.triangulation(Some(n))?));
    let squares = |all: &[usize]| all.iter().map(|&n| square(n)).collect::<Result<Vec<_>>>();
    let fine = [4, 2, 1].map(|part| request.fine / part);
    let (fine_meshes, meshes) = rayon::join(|| squares(&fine), || squares(&request.n));
    let (fine_meshes, meshes) = (fine_meshes?, meshes?);

    let mut cases = Vec::new();
    for example in &request.examples {
        for (n, mesh) in &meshes {
            let discretisation = Discretisation::of(&example.scene, Method::cr());
            cases.push(Case {
                n: Some(*n),
                problem: Problem::new(&example.scene, mesh, &discretisation)?,
            });
        }
    }
    let all: Vec<&Case> = cases.iter().collect();
    let (fines, (runs, counts)) = rayon::join(
        || {
            let examples = request.examples.iter();
            let fines = examples.map(|e| run_fine(e, &fine_meshes, &work));
            fines.collect::<Result<Vec<_>>>()
        },
        || {
            let runs = run_engines(request, &all, &work);
            (runs, run_counts(request, gamma0, &work))
        },
    );
    let (fines, (counts, search)) = (fines?, counts?);
    let (runs, failures) = runs?;

    let mut examples = Vec::new();
    for (index, (example, (solved, fine))) in request.examples.iter().zip(fines).enumerate() {
        let of_example = index * meshes.len()..(index + 1) * meshes.len();
        let mut series = Vec::new();
        for run in &runs {
            let mut levels = Vec::new();
            for k in of_example.clone() {
                work.next(&format!("errors of {}, {}", example.title(), run.engine))?;
                // These runs are complete.
                let answer = run.of(k);
                levels.extend(answer.map(|a| level(&cases[k], a, example, &solved)));
                work.finish(Part::Errors.cost(request.n[k - of_example.start]));
            }
            series.push(Series::new(run, levels));
        }
        let check = || work.next(&format!("{}, other meshes and γ₀", example.title()));
        let variants = sweep(example, &request.n, gamma0, check)?;
        let cost: f64 = request.n.iter().map(|&n| Part::Sweep.cost(n)).sum();
        work.finish(cost);
        examples.push(outcome(example, fine, series, variants));
    }
    let theory = theory(&request.examples[0].scene, request.n[0], gamma0)?;
    let statements = statements(&examples, &counts, search.as_ref(), request);
    let newton = examples.iter().all(|e| {
        let levels = e.series.iter().flat_map(|s| &s.levels);
        e.fine.converged && levels.into_iter().all(|l| l.converged)
    });
    Ok(PaperOutcome {
        gamma0,
        n: request.n.clone(),
        fine: request.fine,
        examples,
        counts,
        search,
        theory,
        statements,
        converged: newton,
        failures,
    })
}

fn check(request: &PaperRequest) -> Result<()> {
    check_meshes(&request.n)?;
    if request.fine == 0 || !request.fine.is_multiple_of(4) {
        return Err(Error::usage(
            format!("a fine mesh of n = {} cannot be halved twice", request.fine),
            "give a multiple of 4, as in --fine 500",
        ));
    }
    Ok(())
}

/// The Rust engine must answer; a companion that does not is recorded as a failure in the outcome.
fn run_engines(
    request: &PaperRequest,
    cases: &[&Case],
    work: &Work,
) -> Result<(Vec<Answers>, Vec<Failure>)> {
    let (mut runs, mut failures) = (Vec::new(), Vec::new());
    let listener = Listener { cases, work };
    let runner = Runner::new(&request.settings, &listener);
    for engine in &request.engines {
        let run = runner.answers(&**engine, cases);
        let part = Part::of_engine(engine.is_own());
        let finished = request.n.iter().map(|&n| part.cost(n));
        work.finish(finished.sum::<f64>() * request.examples.len() as f64);
        if engine.is_own() {
            runs.push(run?);
        } else {
            runs.extend(Failure::or(engine.name(), run, &mut failures)?);
        }
    }
    Ok((runs, failures))
}

/// The paper reports counts for 6.1 only. All schemes on both meshes, the nearest splitting on P2, and the search.
fn run_counts(
    request: &PaperRequest,
    gamma0: f64,
    work: &Work,
) -> Result<(Vec<Count>, Option<Search>)> {
    let example = &request.examples[0];
    let of_cr = schemes(gamma0).map(|scheme| (Method::cr(), scheme));
    // The paper's reference is P2, and the nearest splitting is the last scheme.
    let of_p2 = of_cr.last().map(|(_, scheme)| (Method::p2(), *scheme));
    let mut counts = Vec::new();
    for pattern in PATTERNS {
        for (method, scheme) in of_cr.into_iter().chain(of_p2) {
            let Scheme { iteration, gamma } = scheme;
            let is_fine = |n: &usize| method == Method::p2() && *n > FINEST_P2;
            let meshes = request.n.iter().filter(|n| !is_fine(n));
            let (mut n, mut iterations, mut backward_errors) = (vec![], vec![], vec![]);
            for &of in meshes {
                let tell = |step: usize, _| {
                    let title = example.title();
                    work.next(&format!(
                        "{title}, {method}, {iteration}, n = {of}, step {step}"
                    ))
                };
                let mesh = pattern.mesh(of)?;
                let (found, error) = count(&example.scene, &mesh, method, scheme, CAP, tell)?;
                n.push(of);
                iterations.push(found);
                backward_errors.push(error);
                work.finish(Part::Count.cost(of));
            }
            counts.push(Count {
                example: example.scene.name().to_owned(),
                method: method.to_string(),
                iteration,
                gamma: gamma.to_string(),
                mesh: pattern,
                n,
                iterations,
                backward_errors,
            });
        }
    }
    let check = || work.next(&format!("{}, the search for γ₀", example.title()));
    let found = search(&example.scene, &request.n, check)?;
    Ok((counts, found))
}

/// Each step of a fixed point takes a separate factorisation, and on P2 there are four dofs per contact face.
const FINEST_P2: usize = 64;

fn level(case: &Case, answer: &Answer, example: &Example, fine: &Fine) -> SeriesLevel {
    let problem = &case.problem;
    let of = quantities(problem, &answer.u);
    let errors = distance(&problem.space, &answer.u, &example.truth);
    let norms = [example.truth.grad_norm_sq.sqrt(), example.truth.l2_norm];
    SeriesLevel {
        n: case.n.unwrap_or(0),
        h: problem.space.mesh.geometry(0).diameter,
        dofs: problem.space.dofs,
        steps: steps_to(TOL, &answer.increments),
        converged: answer.converged,
        errors,
        errors_to_fine: distance(&problem.space, &answer.u, fine),
        residual: of.contact_residual,
        weighted_residual: of.weighted_residual,
        norm_1h: (errors.h1 * norms[0] + errors.l2 * norms[1]) / (norms[0] + norms[1]),
    }
}

impl Series {
    fn new(run: &Answers, levels: Vec<SeriesLevel>) -> Self {
        let of = |value: fn(&SeriesLevel) -> f64| {
            Observed::new(levels.iter().map(|level| (level.n, value(level))))
        };
        Series {
            engine: run.engine.clone(),
            version: run.version.clone(),
            h1: of(|l| l.errors.h1),
            l2: of(|l| l.errors.l2),
            h1_to_fine: of(|l| l.errors_to_fine.h1),
            l2_to_fine: of(|l| l.errors_to_fine.l2),
            residual: of(|l| l.residual),
            weighted_residual: of(|l| l.weighted_residual),
            levels,
        }
    }
}

fn outcome(
    example: &Example,
    fine: FineOutcome,
    series: Vec<Series>,
    variants: Vec<Variant>,
) -> ExampleOutcome {
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
        gamma0: example.scene.gamma0(),
        fine,
        series,
        variants,
    }
}
