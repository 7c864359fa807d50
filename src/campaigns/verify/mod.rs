//! The main campaign: all engines on all scenes, with a verdict on every pair.

mod cross;
#[cfg(test)]
mod diagnose_tests;
mod settle;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use serde::Serialize;

use crate::engine::{
    self, Answer, Case, Engine, Explanation, Progress, Settings, Silent, label, unique,
};
use crate::run::{
    Answers, Failure, RESIDUAL_TOLERANCE, ROUNDING, Runner, Setup, Written, tolerance,
};
use crate::why::{Again, Diagnosis, Findings, examine};
use faceoff_fem::contact::{Method, face_fields};
use faceoff_fem::scene::Scene;
use faceoff_judge::{FieldVerdict, Verdict, judge};
use faceoff_mesh::error::{Error, Result, distinct};
use faceoff_mesh::field::FaceFields;

pub use cross::{CrossOutcome, Judged, STANDS_OUT, Source, telling};
pub use settle::Settled;

/// The cases and engines to verify.
pub struct VerifyRequest<'a> {
    /// Each is solved by every method.
    pub scenes: Vec<Scene>,
    /// The methods for each scene.
    pub methods: Vec<Method>,
    /// Refinements; empty: those of each scene.
    pub n: Vec<usize>,
    /// At least two, with different names.
    pub engines: Vec<&'a dyn Engine>,
    /// The settings of every engine.
    pub settings: Settings,
    /// Where answers are stored as they come, and read from.
    pub journal: Option<PathBuf>,
}

impl VerifyRequest<'_> {
    /// The refinements of a scene: its own, or the requested ones if it can be refined.
    pub fn levels(&self, scene: &Scene) -> Vec<Option<usize>> {
        match scene.source().n() {
            Some(_) if !self.n.is_empty() => self.n.iter().map(|&n| Some(n)).collect(),
            own => vec![own],
        }
    }
}

/// The result of a run.
#[derive(Debug, Serialize)]
pub struct VerifyOutcome {
    /// The worst verdict of all.
    pub verdict: Verdict,
    /// By scene, then refinement, then method.
    pub cases: Vec<CaseOutcome>,
    /// Methods compared with each other, by certified bounds.
    pub cross: Vec<CrossOutcome>,
    /// Engines without a valid answer, and why.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<Failure>,
}

/// One scene, method and mesh.
#[derive(Debug, Serialize)]
pub struct CaseOutcome {
    /// The name of the scene.
    pub scene: String,
    /// The name of the method.
    pub method: String,
    /// The refinement, if the scene has one.
    pub n: Option<usize>,
    /// The number of faces of the mesh, interior and boundary.
    pub faces: usize,
    /// The number of cells.
    pub cells: usize,
    /// The number of dofs of the space, including those on Γ_D.
    pub dofs: usize,
    /// The number of faces on Γ_C.
    pub contact_faces: usize,
    /// BLAKE3 of the mesh that every engine got, in hexadecimal.
    pub mesh_digest: String,
    /// The worst verdict of engines and pairs.
    pub verdict: Verdict,
    /// The engines that answered.
    pub engines: Vec<EngineOutcome>,
    /// Every field of every two of them.
    pub pairs: Vec<PairOutcome>,
    /// Pairs whose answers both solve the scheme and differ by more than the fixed tolerance.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub settled: Vec<Settled>,
    /// The fields that were compared, one set per engine.
    #[serde(skip)]
    pub setup: Setup,
    /// The answer of each engine, in the order of `engines`.
    #[serde(skip)]
    pub fields: Vec<FaceFields>,
    /// How the Rust engine solved it, if it did.
    #[serde(skip)]
    pub explanation: Option<Explanation>,
}

/// One engine's answer to a case.
#[derive(Debug, Serialize)]
pub struct EngineOutcome {
    /// The name of the engine.
    pub engine: String,
    /// The version that it reports.
    pub version: String,
    /// The number of steps that it took.
    pub iterations: usize,
    /// The relative increment of each step.
    pub increments: Vec<f64>,
    /// Does it report that its iteration reached the tolerance?
    pub converged: bool,
    /// Seconds that the engine spent on the case, all phases together.
    pub seconds: f64,
    /// Seconds by phase, as the engine reports them.
    pub phases: BTreeMap<String, f64>,
    /// Backward error, recomputed here.
    pub residual: f64,
    /// The row with the largest backward error.
    pub residual_at: Option<Vec<f64>>,
    /// Are all of its dofs finite?
    pub finite: bool,
    /// Does it solve the scheme?
    pub verdict: Verdict,
    /// The fault of an answer that does not solve the scheme.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub findings: Option<Findings>,
    /// u_h, with all data that the engine reports.
    #[serde(skip)]
    pub answer: Arc<Answer>,
}

/// One field of one pair of engines.
#[derive(Debug, Serialize)]
pub struct PairOutcome {
    /// The first engine.
    pub a: String,
    /// The second.
    pub b: String,
    /// The difference in this field.
    #[serde(flatten)]
    pub field: FieldVerdict,
}

impl VerifyOutcome {
    /// The case and the answer that show best what is wrong: one that something explains, with the fewest rows that fail.
    pub fn culprit(&self) -> Option<(&CaseOutcome, &EngineOutcome)> {
        let cases = self.cases.iter();
        let all = cases.flat_map(|case| case.engines.iter().map(move |engine| (case, engine)));
        let failed = all.filter(|(_, engine)| !engine.verdict.passes());
        failed.min_by_key(|(_, engine)| {
            let found = engine.findings.as_ref();
            let unexplained = found.is_none_or(|found| !found.is_of_scheme());
            (unexplained, found.map_or(usize::MAX, |found| found.failing))
        })
    }

    /// Every answer of every case.
    pub fn answers(&self) -> impl Iterator<Item = &EngineOutcome> + Clone {
        self.cases.iter().flat_map(|case| &case.engines)
    }

    /// Every field of every two answers of every case.
    pub fn pairs(&self) -> impl Iterator<Item = &PairOutcome> + Clone {
        self.cases.iter().flat_map(|case| &case.pairs)
    }

    /// The engines that answered at least one case.
    pub fn engines(&self) -> Vec<&str> {
        unique(self.answers().map(|e| &*e.engine))
    }

    /// Those with an answer that does not solve its scheme.
    pub fn at_fault(&self) -> Vec<&str> {
        let answers = self.answers();
        unique(answers.filter(|e| !e.verdict.passes()).map(|e| &*e.engine))
    }

    /// The first case whose answers differ although each solves the scheme.
    pub fn differing(&self) -> Option<&CaseOutcome> {
        let mut cases = self.cases.iter();
        cases.find(|case| !case.verdict.passes() && !case.pairs.is_empty())
    }
}

impl CaseOutcome {
    /// `one-zone, cr, n = 16`
    pub fn label(&self) -> String {
        label(&self.scene, &self.method, self.n)
    }

    /// The engine to compare with the one at fault: the first that is right.
    pub fn reference(&self, fault: &[&str]) -> Option<&EngineOutcome> {
        self.engines.iter().find(|e| !fault.contains(&&*e.engine))
    }
}

/// Runs every engine on every case and judges.
///
/// # Errors
/// Scenes that are not valid on their meshes; a method that an engine does not have; an interruption. An engine that fails is not an error
/// but makes the verdict undetermined.
pub fn verify(request: &VerifyRequest, progress: &dyn Progress) -> Result<VerifyOutcome> {
    let names = request.engines.iter().map(|engine| engine.name());
    distinct(names, "engine", "compare different codes")?;
    if request.engines.len() < 2 {
        return Err(Error::usage(
            "one engine alone cannot be verified",
            "name at least two with --engines",
        ));
    }
    for engine in &request.engines {
        for method in &request.methods {
            engine.accepts(method)?;
        }
    }
    let setups = setups(request)?;
    let cases = setups.iter().map(Setup::case).collect::<Result<Vec<_>>>()?;
    let cases: Vec<&Case> = cases.iter().collect();
    let mut runner = Runner::new(&request.settings, progress);
    if let Some(journal) = &request.journal {
        runner = runner.resuming(journal)?;
    }
    let (answered, failures) = runner.side_by_side(&request.engines, &cases)?;

    let mut outcomes = Vec::with_capacity(cases.len());
    for (index, case) in cases.iter().enumerate() {
        outcomes.push(judge_case(index, case, &setups[index], &answered)?);
    }
    explain(request, &mut outcomes)?;
    let cross = cross::judge_methods(&cases, &outcomes)?;
    let verdicts = outcomes
        .iter()
        .map(|c| c.verdict)
        .chain(cross.iter().filter_map(|c| Some(c.judged?.verdict)))
        .chain(failures.iter().map(|_| Verdict::Undetermined));
    Ok(VerifyOutcome {
        verdict: Verdict::of_all(verdicts),
        cases: outcomes,
        cross,
        failures,
    })
}

/// Every scene on each of its meshes by every method.
fn setups(request: &VerifyRequest) -> Result<Vec<Setup>> {
    let mut setups = Vec::new();
    for scene in &request.scenes {
        for n in request.levels(scene) {
            let mesh = Arc::new(scene.triangulation(n)?);
            let of = |method: &Method| {
                Setup::on(Arc::clone(&mesh), scene, n, *method, &request.settings)
            };
            setups.extend(request.methods.iter().map(of));
        }
    }
    Ok(setups)
}

/// Why codes differ, for every pair of every case that disagrees without a change of the scheme that explains it: both run
/// again.
///
/// # Errors
/// An interruption. Runs that a change makes impossible are left out.
pub fn diagnose(request: &VerifyRequest, outcome: &VerifyOutcome) -> Result<Vec<Diagnosis>> {
    let settings = unkept(&request.settings);
    let runner = Runner::new(&settings, &Silent);
    let mut found = Vec::new();
    let cases = outcome.cases.iter();
    for case in cases.filter(|c| c.verdict == Verdict::Disagree) {
        let mut setup = case.setup.clone();
        setup.settings.keep = None;
        let disagree = |p: &&PairOutcome| p.field.verdict == Verdict::Disagree;
        let pairs = case.pairs.iter().filter(disagree);
        for pair in unique(pairs.map(|pair| [&*pair.a, &*pair.b])) {
            let engine = |name: &str| request.engines.iter().find(|e| e.name() == name);
            let answer = |name: &str| case.engines.iter().find(|e| e.engine == name);
            let ([Some(a), Some(b)], [Some(of_a), Some(of_b)]) =
                (pair.map(engine), pair.map(answer))
            else {
                continue;
            };
            let explained =
                |of: &EngineOutcome| of.findings.as_ref().is_some_and(Findings::is_of_scheme);
            if explained(of_a) || explained(of_b) {
                continue;
            }
            let answers = [(pair[0], &of_a.answer.u[..]), (pair[1], &of_b.answer.u[..])];
            found.push(Again::new(&runner, &setup, answers)?.diagnosis([*a, *b])?);
        }
    }
    Ok(found)
}

/// Settings for additional runs.
fn unkept(settings: &Settings) -> Settings {
    Settings {
        keep: None,
        ..settings.clone()
    }
}

/// Substitutes the answers that do not solve their scheme into it, and searches for the cause.
fn explain(request: &VerifyRequest, cases: &mut [CaseOutcome]) -> Result<()> {
    let settings = unkept(&request.settings);
    let runner = Runner::new(&settings, &Silent);
    for case in cases {
        let mut setup = case.setup.clone();
        setup.settings.keep = None;
        for of in &mut case.engines {
            if of.finite && !(of.residual <= RESIDUAL_TOLERANCE) {
                let u = &of.answer.u;
                of.findings = Some(examine(&runner, &setup, u, Written::of(u))?);
            }
        }
    }
    Ok(())
}

fn judge_case(
    index: usize,
    case: &Case,
    setup: &Setup,
    answered: &[Answers],
) -> Result<CaseOutcome> {
    let problem = &case.problem;
    let mesh = problem.space.mesh;
    let engines: Vec<EngineOutcome> = answered
        .iter()
        .filter_map(|run| {
            let answer = run.of(index)?;
            Some(EngineOutcome {
                engine: run.engine.clone(),
                version: run.version.clone(),
                iterations: answer.increments.len(),
                increments: answer.increments.clone(),
                converged: answer.converged,
                // From 0, since the empty sum is -0.
                seconds: answer.seconds.iter().fold(0.0, |sum, (_, s)| sum + s),
                phases: answer.seconds.iter().cloned().collect(),
                residual: answer.residual,
                residual_at: problem
                    .backward_error(&answer.u)
                    .1
                    .map(|dof| problem.space.point(dof)[..mesh.dim].to_vec()),
                finite: answer.u.iter().all(|v| v.is_finite()),
                verdict: match (answer.residual <= RESIDUAL_TOLERANCE, answer.converged) {
                    (true, true) => Verdict::Agree,
                    // It solves the scheme, and reports that it does not.
                    (true, false) => Verdict::Undetermined,
                    (false, _) => Verdict::Disagree,
                },
                findings: None,
                answer: Arc::clone(answer),
            })
        })
        .collect();
    let fields = engines.iter();
    let fields = fields.map(|e| face_fields(problem, &e.answer.u, &e.engine));
    let fields: Vec<FaceFields> = fields.collect();
    let (mut pairs, mut settled) = (Vec::new(), Vec::new());
    for (i, k) in engine::pairs(engines.len()) {
        let both = [i, k];
        let [a, b] = both.map(|k| &fields[k]);
        let mut judged = judge(a, b, tolerance(&problem.method()))?;
        let both_solve = both.iter().all(|k| engines[*k].residual <= ROUNDING);
        if both_solve && judged.iter().any(|f| f.verdict == Verdict::Disagree) {
            let of = both.map(|k| (&fields[k], &engines[k].answer.u[..]));
            settled.extend(settle::settle(problem, of, &mut judged)?);
        }
        pairs.extend(judged.into_iter().map(|field| PairOutcome {
            a: a.source.clone(),
            b: b.source.clone(),
            field,
        }));
    }
    let of_pairs = pairs.iter().map(|p| p.field.verdict).max();
    let of_engines = engines.iter().map(|e| e.verdict).max();
    let verdict = of_pairs.map_or(Verdict::Undetermined, |v| v.max(of_engines.unwrap_or(v)));
    let mut answers = answered.iter().filter_map(|run| run.of(index));
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
        setup: setup.clone(),
        engines,
        pairs,
        settled,
        fields,
    })
}
