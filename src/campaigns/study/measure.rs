//! Measures one setting: repeats it for its time, and evaluates the error and the certificate.

use std::time::{Duration, Instant};

use super::campaign::identity;
use super::row::{Row, Times, Varied};
use super::subject::Subject;
use crate::engine::{self, Engine, HighWater, Settings, Silent, peak_memory_mb};
use crate::run::{Evaluated, Setup, Variation, certificate, consistent};
use faceoff_fem::certify::{Target, certify};
use faceoff_fem::contact::{Method, Problem};
use faceoff_fem::known::Truth;
use faceoff_mesh::error::{Error, Result};

/// The maximal number of repetitions, and the least total time of a short measurement.
const REPEATS: usize = 7;
const LONG_ENOUGH: f64 = 0.3;

/// A problem with its solver.
pub struct Setting<'a> {
    /// With its γ₀ and its rules.
    pub subject: &'a Subject,
    pub engine: &'a dyn Engine,
    pub method: Method,
    pub n: Option<usize>,
    pub varied: Varied,
    /// The setting that is varied.
    pub variation: Option<Variation>,
    pub settings: Settings,
}

impl Setting<'_> {
    fn setup(&self) -> Result<Setup> {
        let setup = Setup::new(&self.subject.scene, self.n, self.method, &self.settings)?;
        setup.varied(self.variation.as_ref())
    }

    /// Everything that defines it, except the engine's program.
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
            "{} {} {} {:?} {} {:?} {stop:?} {iteration} {linear:?} {launch:?}",
            identity(self.subject)?,
            self.engine.name(),
            self.method,
            self.n,
            self.varied,
            self.variation
        ))
    }

    pub fn title(&self) -> String {
        let n = self.n.map_or(String::new(), |n| format!(", n = {n}"));
        format!(
            "{}, {} {}{n}, {}",
            self.subject.scene.name(),
            self.engine.name(),
            self.method,
            self.varied
        )
    }
}

/// One measurement; a companion's process may take at most `limit` seconds.
///
/// # Errors
/// Errors of the scene, the engine and the known solution.
pub fn measure(setting: &Setting, limit: f64) -> Result<Row> {
    let own = setting.engine.is_own();
    let limit = Duration::try_from_secs_f64(limit).unwrap_or(setting.settings.time_limit);
    // The system reports the maximum over all children, and for each at least the memory of this process when it started it.
    let before = peak_memory_mb(true).max(peak_memory_mb(false));
    let (mut times, mut start_ups) = (Vec::new(), Vec::new());
    let water = HighWater::begin().filter(|_| own);
    let mut memory = None;
    let begun = Instant::now();
    loop {
        let clock = Instant::now();
        let mut setup = setting.setup()?;
        setup.settings.time_limit = setup.settings.time_limit.min(limit);
        let case = setup.case()?;
        let started = Instant::now();
        let run = setting.engine.run(&[&case], &setup.settings, &Silent)?;
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
            // A smaller value is not visible.
            memory = Some(peak_memory_mb(true)).filter(|peak| *peak > before);
        }
        let (name, truth) = (setting.engine.name(), setting.subject.truth.as_deref());
        let row = evaluated(&case.problem, name, &answer, truth)?;
        let bound = certificate(certify(&case.problem, &answer.u))?.ok();
        if let Some(bound) = &bound {
            consistent(row.h1, bound)?;
        }
        let bound = bound.map(|c| c.relative(Target::UH));
        return Ok(Row {
            varied: setting.varied,
            n: setting.n,
            tolerance: setup.settings.stop.increment,
            converged: row.converged && is_solved(row.residual, &setup.settings),
            certified: bound.filter(|bound| bound.is_finite()),
            seconds: Times::new(times),
            start_up: (!own).then(|| Times::new(start_ups).median),
            memory_mb: memory,
            ..row
        });
    }
}

/// Does an answer that is reported as converged solve its scheme, as far as its increments were requested to be small?
fn is_solved(residual: f64, settings: &Settings) -> bool {
    residual <= (1e3 * settings.stop.increment).max(1e-9)
}

/// The evaluation of an answer: everything except its time and memory, and the bound of its error.
///
/// # Errors
/// A known solution that is not finite.
pub fn evaluated(
    problem: &Problem,
    engine: &str,
    answer: &engine::Answer,
    truth: Option<&Truth>,
) -> Result<Row> {
    let (space, linear) = (&problem.space, answer.history.as_ref().map(|h| h.linear));
    let of = Evaluated::new(problem, &answer.u, truth)?;
    Ok(Row {
        scene: problem.scene.name().to_owned(),
        engine: engine.to_owned(),
        method: problem.method().to_string(),
        varied: Varied::Mesh,
        n: None,
        accuracy: None,
        cells: space.mesh.cell_count(),
        dofs: space.dofs,
        tolerance: 0.0,
        gamma0: problem.discretisation.gamma0(),
        load_quadrature: problem.cell_rule.name.to_owned(),
        contact_quadrature: problem.face_rule.name.to_owned(),
        linear: linear.map_or(String::new(), |l| l.solver.to_string()),
        precision: linear.map_or(String::new(), |l| l.precision.to_string()),
        steps: answer.increments.len(),
        converged: answer.converged,
        residual: answer.residual,
        h1: of.errors.map(|e| e.h1),
        l2: of.errors.map(|e| e.l2),
        certified: None,
        contact_residual: of.quantities.contact_residual,
        contact_flux: of.quantities.contact_flux,
        seconds: Times::new(vec![]),
        start_up: None,
        memory_mb: None,
    })
}
