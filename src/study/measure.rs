//! One setting, measured: repeated for its time, judged by the truth and by the certificate.

use std::time::{Duration, Instant};

use super::campaign::identity;
use super::row::{Row, Times, Varied};
use super::subject::Subject;
use crate::engine::{self, Case, Engine, HighWater, Settings, Silent, peak_memory_mb};
use faceoff_fem::certify::{Target, certify};
use faceoff_fem::contact::{Discretisation, Problem, quantities};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Triangulation;

/// Most repetitions of one measurement, and the least time over which a short one is repeated.
const REPEATS: usize = 7;
const LONG_ENOUGH: f64 = 0.3;

/// What is solved, and how.
pub struct Setting<'a> {
    pub subject: &'a Subject,
    pub engine: &'a dyn Engine,
    pub discretisation: Discretisation,
    pub n: Option<usize>,
    pub varied: Varied,
    pub settings: Settings,
}

impl Setting<'_> {
    /// All that makes it what it is, but for the engine's version.
    ///
    /// # Errors
    /// A mesh file that cannot be read.
    pub fn key(&self) -> Result<String> {
        let Settings {
            stop,
            iteration,
            linear,
            launch,
            ..
        } = &self.settings;
        Ok(format!(
            "{} {} {:?} {:?} {} {stop:?} {iteration} {linear:?} {launch:?}",
            identity(self.subject)?,
            self.engine.name(),
            self.discretisation,
            self.n,
            self.varied
        ))
    }

    pub fn title(&self) -> String {
        let n = self.n.map_or(String::new(), |n| format!(", n = {n}"));
        format!(
            "{}, {} {}{n}, {}",
            self.subject.scene.name(),
            self.engine.name(),
            self.discretisation.method,
            self.varied
        )
    }
}

/// One measurement; a companion's process may not take longer than `limit` seconds.
///
/// # Errors
/// What the scene, the engine and the truth refuse.
pub fn measure(setting: &Setting, limit: f64) -> Result<Row> {
    let own = setting.engine.name() == "rust";
    let scene = &setting.subject.scene;
    let mut settings = setting.settings.clone();
    let limit = Duration::try_from_secs_f64(limit).unwrap_or(settings.time_limit);
    settings.time_limit = settings.time_limit.min(limit);
    // The system tells the largest of all children, and of each no less than what this process held when it started it.
    let before = peak_memory_mb(true).max(peak_memory_mb(false));
    let (mut times, mut start_ups) = (Vec::new(), Vec::new());
    let water = HighWater::begin().filter(|_| own);
    let mut memory = None;
    let begun = Instant::now();
    loop {
        let clock = Instant::now();
        let mesh = scene.triangulation(setting.n)?;
        let case = Case {
            n: setting.n,
            problem: Problem::new(scene, &mesh, &setting.discretisation)?,
        };
        let started = Instant::now();
        let cases = std::slice::from_ref(&case);
        let run = setting.engine.run(cases, &settings, &Silent)?;
        let outside = started.elapsed().as_secs_f64();
        let answer = run.answers.into_iter().next().ok_or_else(|| {
            Error::engine(setting.engine.name(), "it gave no answer", "report this")
        })?;
        if own {
            times.push(clock.elapsed().as_secs_f64());
            memory = memory.or_else(|| water.as_ref()?.megabytes());
        } else {
            let phases: f64 = answer.seconds.iter().map(|(_, s)| s).sum();
            times.push(phases);
            start_ups.push((outside - phases).max(0.0));
        }
        let spent = begun.elapsed().as_secs_f64();
        if times.len() < REPEATS && spent < LONG_ENOUGH {
            continue;
        }
        if !own {
            // A smaller one is not seen.
            memory = Some(peak_memory_mb(true)).filter(|peak| *peak > before);
        }
        let mut row = evaluate(setting, &case, &answer)?;
        row.seconds = Times::new(times);
        row.start_up = (!own).then(|| Times::new(start_ups).median);
        row.memory_mb = memory;
        return Ok(row);
    }
}

/// All that is not time.
fn evaluate(setting: &Setting, case: &Case, answer: &engine::Answer) -> Result<Row> {
    let problem = &case.problem;
    let mut row = described(problem, setting.engine.name());
    let of = setting.subject.errors(problem, &answer.u)?;
    let values = quantities(problem, &answer.u);
    let certificate = certify(problem, &answer.u);
    let certificate = match certificate {
        Ok(certificate) => Some(certificate.relative(Target::UH)),
        Err(Error::Certificate { .. }) => None,
        Err(other) => return Err(other),
    };
    row.varied = setting.varied;
    row.n = setting.n;
    row.tolerance = setting.settings.stop.increment;
    if let Some(history) = &answer.history {
        row.linear = history.linear.solver.to_string();
        row.precision = history.linear.precision.to_string();
    }
    row.steps = answer.increments.len();
    row.converged = answer.converged;
    row.residual = answer.residual;
    row.h1 = of.map(|e| e.h1);
    row.l2 = of.map(|e| e.l2);
    row.certified = certificate.filter(|bound| bound.is_finite());
    row.contact_residual = values.contact_residual;
    row.contact_flux = values.contact_flux;
    Ok(row)
}

/// What is known without solving.
pub fn described(problem: &Problem, engine: &str) -> Row {
    let mesh: &Triangulation = problem.space.mesh;
    Row {
        scene: problem.scene.name().to_owned(),
        engine: engine.to_owned(),
        method: problem.method().to_string(),
        varied: Varied::Mesh,
        n: None,
        accuracy: None,
        cells: mesh.cell_count(),
        dofs: problem.space.dofs,
        tolerance: 0.0,
        gamma0: problem.discretisation.gamma0(),
        load_quadrature: problem.cell_rule.name.into(),
        contact_quadrature: problem.face_rule.name.into(),
        linear: String::new(),
        precision: String::new(),
        steps: 0,
        converged: false,
        residual: f64::NAN,
        h1: None,
        l2: None,
        certified: None,
        contact_residual: f64::NAN,
        contact_flux: f64::NAN,
        seconds: Times::new(vec![]),
        start_up: None,
        memory_mb: None,
    }
}
