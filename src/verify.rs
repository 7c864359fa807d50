//! The main job: all engines on all scenes, every pair judged.

mod conformance;
mod cross;
mod suspects;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use serde::Serialize;

use crate::engine::{Case, Engine, Explanation, Progress, Run, Settings};
use faceoff_fem::contact::{Discretisation, Method, Problem, face_fields};
use faceoff_fem::scene::Scene;
use faceoff_judge::{FieldVerdict, Verdict, judge};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::FaceFields;
use faceoff_mesh::mesh::Triangulation;

pub use conformance::{Finding, check_count, conformance};
pub use cross::{CrossOutcome, Judged, STANDS_OUT, Source, telling};

/// A result whose backward error exceeds this solves another scheme: rounding leaves 1e-15,
/// and γ off by 1e-6 gives 3e-11 or more.
pub const RESIDUAL_TOLERANCE: f64 = 1e-12;

/// Same scheme, other code: |a - b| ≤ tolerance · max|u|. Measured agreement of codes on matched
/// rules is 7e-16 for `cr` and 4e-14 for `p2`; one quadrature rule apart it is 1e-4.
pub fn tolerance(method: &Method) -> f64 {
    if method.element.degree() == 1 {
        1e-12
    } else {
        1e-11
    }
}

/// What is to be verified.
pub struct Request {
    pub scenes: Vec<Scene>,
    pub methods: Vec<Method>,
    /// Refinements; none: each scene's own.
    pub n: Vec<usize>,
    pub engines: Vec<Box<dyn Engine>>,
    pub settings: Settings,
}

/// Everything that was found.
#[derive(Debug, Serialize)]
pub struct Outcome {
    pub verdict: Verdict,
    pub cases: Vec<CaseOutcome>,
    /// Methods against each other, by certified bounds.
    pub cross: Vec<CrossOutcome>,
    /// Engines that gave no answer that counts, and why.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<Failure>,
}

/// An engine that gave no answer that counts.
#[derive(Debug, Serialize)]
pub struct Failure {
    pub engine: String,
    pub message: String,
}

/// One scene, method and mesh.
#[derive(Debug, Serialize)]
pub struct CaseOutcome {
    pub scene: String,
    pub method: String,
    pub n: Option<usize>,
    pub faces: usize,
    pub cells: usize,
    pub dofs: usize,
    pub contact_faces: usize,
    pub mesh_digest: String,
    pub verdict: Verdict,
    pub engines: Vec<EngineOutcome>,
    pub pairs: Vec<PairOutcome>,
    /// The fields that were compared, one set an engine.
    #[serde(skip)]
    pub fields: Vec<FaceFields>,
    /// How the Rust engine solved it, where it did.
    #[serde(skip)]
    pub explanation: Option<Explanation>,
}

/// One engine's answer to a case.
#[derive(Debug, Serialize)]
pub struct EngineOutcome {
    pub engine: String,
    pub version: String,
    pub iterations: usize,
    /// The relative increment of each step.
    pub increments: Vec<f64>,
    pub converged: bool,
    /// Seconds that the engine spent on the case, all phases together.
    pub seconds: f64,
    pub phases: BTreeMap<String, f64>,
    /// Backward error, recomputed here.
    pub residual: f64,
    /// Where it is largest.
    pub residual_at: Option<Vec<f64>>,
    pub finite: bool,
    pub verdict: Verdict,
    #[serde(skip)]
    pub u: Vec<f64>,
}

/// One field of one pair of engines.
#[derive(Debug, Serialize)]
pub struct PairOutcome {
    pub a: String,
    pub b: String,
    #[serde(flatten)]
    pub field: FieldVerdict,
}

/// Runs every engine on every case and judges.
///
/// # Errors
/// Scenes that are not valid on their meshes; a method that an engine does not have; an interruption. An engine that fails is no error
/// but makes the verdict undetermined.
pub fn verify(request: &Request, progress: &dyn Progress) -> Result<Outcome> {
    check_names(&request.engines)?;
    for engine in &request.engines {
        for method in &request.methods {
            engine.accepts(method)?;
        }
    }
    let meshes = meshes(request)?;
    let cases = cases(request, &meshes)?;

    let runs: Vec<Result<Run>> = std::thread::scope(|scope| {
        let cases = &cases;
        let handles: Vec<_> = request
            .engines
            .iter()
            .map(|engine| {
                std::thread::Builder::new().spawn_scoped(scope, move || {
                    engine.run(cases, &request.settings, progress)
                })
            })
            .collect();
        let lost = |engine: &dyn Engine, why: String| {
            Error::engine(engine.name(), why, "close other programs, or report this")
        };
        handles
            .into_iter()
            .zip(&request.engines)
            .map(|(handle, engine)| {
                handle
                    .map_err(|e| lost(&**engine, format!("it has no thread: {e}")))?
                    .join()
                    .unwrap_or_else(|_| Err(lost(&**engine, "its thread ended early".into())))
            })
            .collect()
    });
    let mut failures = Vec::new();
    let mut answered: Vec<(&str, Run)> = Vec::new();
    for (engine, run) in request.engines.iter().zip(runs) {
        match run {
            Ok(run) => answered.push((engine.name(), run)),
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(e) => failures.push(Failure {
                engine: engine.name().to_owned(),
                message: e.to_string(),
            }),
        }
    }

    let mut outcomes = Vec::with_capacity(cases.len());
    for (index, case) in cases.iter().enumerate() {
        outcomes.push(judge_case(index, case, &answered)?);
    }
    let cross = cross::judge_methods(&cases, &outcomes)?;
    let verdicts = outcomes
        .iter()
        .map(|c| c.verdict)
        .chain(cross.iter().filter_map(|c| Some(c.judged?.verdict)))
        .chain(failures.iter().map(|_| Verdict::Undetermined));
    Ok(Outcome {
        verdict: verdicts.max().unwrap_or(Verdict::Undetermined),
        cases: outcomes,
        cross,
        failures,
    })
}

/// A code judged against itself proves nothing.
fn check_names(engines: &[Box<dyn Engine>]) -> Result<()> {
    for (k, engine) in engines.iter().enumerate() {
        if engines[..k].iter().any(|e| e.name() == engine.name()) {
            return Err(Error::usage(
                format!("engine `{}` is named twice", engine.name()),
                "compare different codes",
            ));
        }
    }
    if engines.len() < 2 {
        return Err(Error::usage(
            "one engine alone cannot be verified",
            "name at least two with --engines",
        ));
    }
    Ok(())
}

/// The meshes of each scene: those asked for with --n, or the scene's own.
fn meshes(request: &Request) -> Result<Vec<(usize, Option<usize>, Triangulation)>> {
    let mut meshes = Vec::new();
    for (index, scene) in request.scenes.iter().enumerate() {
        let levels: Vec<Option<usize>> = if request.n.is_empty() || scene.source().n().is_none() {
            vec![scene.source().n()]
        } else {
            request.n.iter().map(|&n| Some(n)).collect()
        };
        for n in levels {
            meshes.push((index, n, scene.triangulation(n)?));
        }
    }
    Ok(meshes)
}

fn cases<'a>(
    request: &'a Request,
    meshes: &'a [(usize, Option<usize>, Triangulation)],
) -> Result<Vec<Case<'a>>> {
    let mut cases = Vec::new();
    for (index, n, mesh) in meshes {
        let scene = &request.scenes[*index];
        for method in &request.methods {
            cases.push(Case {
                n: *n,
                problem: Problem::new(scene, mesh, &Discretisation::of(scene, *method))?,
            });
        }
    }
    Ok(cases)
}

fn judge_case(index: usize, case: &Case, answered: &[(&str, Run)]) -> Result<CaseOutcome> {
    let problem = &case.problem;
    let mesh = problem.space.mesh;
    let engines: Vec<EngineOutcome> = answered
        .iter()
        .map(|(name, run)| {
            let answer = &run.answers[index];
            let solves = answer.converged && answer.residual <= RESIDUAL_TOLERANCE;
            EngineOutcome {
                engine: (*name).to_owned(),
                version: run.version.clone(),
                iterations: answer.increments.len(),
                increments: answer.increments.clone(),
                converged: answer.converged,
                // From 0, as the sum of none is -0.
                seconds: answer.seconds.iter().fold(0.0, |sum, (_, s)| sum + s),
                phases: answer.seconds.iter().cloned().collect(),
                residual: answer.residual,
                residual_at: problem
                    .backward_error(&answer.u)
                    .1
                    .map(|dof| problem.space.point(dof)[..mesh.dim].to_vec()),
                finite: answer.u.iter().all(|v| v.is_finite()),
                verdict: if solves {
                    Verdict::Agree
                } else {
                    Verdict::Disagree
                },
                u: answer.u.clone(),
            }
        })
        .collect();
    let fields: Vec<FaceFields> = engines
        .iter()
        .map(|e| face_fields(problem, &e.u, &e.engine))
        .collect();
    let mut pairs = Vec::new();
    for (k, a) in fields.iter().enumerate() {
        for b in &fields[k + 1..] {
            for field in judge(a, b, tolerance(&problem.method()))? {
                pairs.push(PairOutcome {
                    a: a.source.clone(),
                    b: b.source.clone(),
                    field,
                });
            }
        }
    }
    let verdict = if pairs.is_empty() {
        Verdict::Undetermined
    } else {
        let of_pairs = pairs.iter().map(|p| p.field.verdict);
        let of_engines = engines.iter().map(|e| e.verdict);
        of_pairs
            .chain(of_engines)
            .max()
            .unwrap_or(Verdict::Undetermined)
    };
    let mut answers = answered.iter().map(|(_, run)| &run.answers[index]);
    let own = answers.find(|answer| answer.history.is_some());
    Ok(CaseOutcome {
        explanation: own.map(|answer| Explanation::new(case, answer)),
        scene: case.scene().name().to_owned(),
        method: problem.method().to_string(),
        n: case.n,
        faces: mesh.face_count(),
        cells: mesh.cell_count(),
        dofs: problem.space.dofs,
        contact_faces: problem.contact.len(),
        mesh_digest: mesh.digest(),
        verdict,
        engines,
        pairs,
        fields,
    })
}
