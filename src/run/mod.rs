//! Runs cases through engines: each case once, all cases of an engine in one batch, and none that a journal or this run has
//! answered already.

pub mod convergence;
mod evaluated;
mod face_off;
pub mod foreign;
pub mod function;
mod store;
mod variation;
mod written;

use std::collections::HashMap;
use std::path::Path;
use std::sync::{Arc, Mutex};

use serde::Serialize;
use serde_json::{Value, json};

pub use convergence::{Fit, Observed, check_meshes};
pub use evaluated::{Evaluated, certificate, consistent};
pub use face_off::{
    Asked, Code, DT, FaceOff, FormFile, Judged, Label, Level, Point, Same, Spectrum, Sweep,
    is_elastic, is_face_off, place, rounded, words,
};
pub use store::{BASELINE, Journal, Record, Store};
pub use variation::{Datum, Setup, Variation, reverse_cells, reverse_points};
pub use written::Written;

use crate::engine::{Answer, Case, Engine, Progress, Run, Settings, case_label, lock};
use faceoff_fem::contact::Method;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use store::{Kept, identity};

/// A result whose backward error exceeds this solves another scheme: rounding leaves 1e-15,
/// and a relative change of γ by 1e-6 gives 3e-11 or more.
pub const RESIDUAL_TOLERANCE: f64 = 1e-12;

/// The bound of a residual from rounding: up to 5e-14 was measured on random scenes with thin domains and extreme γ₀. Only below it does
/// conditioning excuse a difference.
pub const ROUNDING: f64 = 1e-13;

/// For the same scheme in different codes: |a - b| ≤ tolerance · max|u|. The measured agreement of codes with the same
/// rules is 7e-16 for `cr` and 4e-14 for `p2`; with a quadrature rule of one degree less it is 1e-4.
pub fn tolerance(method: &Method) -> f64 {
    if method.element.degree() == 1 {
        1e-12
    } else {
        1e-11
    }
}

/// An engine without valid answers, and why.
#[derive(Debug, Clone, Serialize)]
pub struct Failure {
    /// The name of the engine.
    pub engine: String,
    /// The error message.
    pub message: String,
}

/// The answers of one engine, in the order of the cases; `None` for those it did not give.
#[derive(Debug, Clone)]
pub struct Answers {
    /// The name of the engine.
    pub engine: String,
    /// The version that it reports.
    pub version: String,
    answers: Vec<Option<Arc<Answer>>>,
}

/// Runs cases, and caches their answers.
pub struct Runner<'a> {
    /// The settings of every run.
    pub settings: &'a Settings,
    /// Is notified of what runs.
    pub progress: &'a dyn Progress,
    journal: Option<Journal>,
    /// The cache, by everything that an answer, or a refusal, depends on.
    known: Mutex<HashMap<String, Result<Arc<Answer>, String>>>,
    /// The number of jobs that each engine got, and the version that answered.
    jobs: Mutex<HashMap<String, (usize, String)>>,
}

impl<'a> Runner<'a> {
    /// A runner with an empty cache.
    pub fn new(settings: &'a Settings, progress: &'a dyn Progress) -> Self {
        Runner {
            settings,
            progress,
            journal: None,
            known: Mutex::default(),
            jobs: Mutex::default(),
        }
    }

    /// Stores each answer in a journal as it comes, and takes existing answers from it.
    ///
    /// # Errors
    /// A journal that cannot be used; see [`Journal::open`].
    pub fn resuming(mut self, journal: &Path) -> Result<Self> {
        let of = json!({
            "faceoff": env!("CARGO_PKG_VERSION"),
            "settings": of_settings(self.settings),
        });
        self.journal = Some(Journal::open(journal, &of)?);
        Ok(self)
    }

    /// Runs all engines at the same time, each in a separate thread. An engine that fails, or whose answers the journal rejects, does not
    /// end the others; a case that the solver of this program refuses does not end its other ones.
    ///
    /// # Errors
    /// An interruption.
    pub fn side_by_side(
        &self,
        engines: &[&dyn Engine],
        cases: &[&Case],
    ) -> Result<(Vec<Answers>, Vec<Failure>)> {
        let lost = |engine: &dyn Engine, why: String| {
            Error::engine(engine.name(), why, "close other programs, or report this")
        };
        let runs: Vec<Result<(Answers, Vec<Failure>)>> = std::thread::scope(|scope| {
            let mut handles = Vec::with_capacity(engines.len());
            for engine in engines {
                let thread = std::thread::Builder::new();
                handles.push(thread.spawn_scoped(scope, || match engine.is_own() {
                    true => self.apart(*engine, cases),
                    false => Ok((self.answers(*engine, cases)?, Vec::new())),
                }));
            }
            let ended = handles.into_iter().zip(engines).map(|(handle, engine)| {
                handle
                    .map_err(|e| lost(*engine, format!("it has no thread: {e}")))?
                    .join()
                    .unwrap_or_else(|_| Err(lost(*engine, "its thread ended early".into())))
            });
            ended.collect()
        });
        let (mut answered, mut failures) = (Vec::new(), Vec::new());
        for (engine, run) in engines.iter().zip(runs) {
            if let Some((answers, refused)) = Failure::or(engine.name(), run, &mut failures)? {
                answered.push(answers);
                failures.extend(refused);
            }
        }
        Ok((answered, failures))
    }

    /// Each case separately: a refusal of one does not affect the others.
    fn apart(&self, engine: &dyn Engine, cases: &[&Case]) -> Result<(Answers, Vec<Failure>)> {
        let mut failures = Vec::new();
        let mut answers = Vec::with_capacity(cases.len());
        for (case, found) in cases.iter().zip(self.each(engine, cases, self.settings)?) {
            answers.push(found.as_ref().ok().cloned());
            failures.extend(found.err().map(|why| Failure {
                engine: engine.name().to_owned(),
                message: format!("{}: {why}", case_label(case)),
            }));
        }
        self.progress.done(engine.name());
        Ok((self.answered(engine, answers), failures))
    }

    /// The answers of one engine: in one batch, or, if a journal stores them, one after the other.
    ///
    /// # Errors
    /// Refusals of the engine, an interruption, a journal that cannot be used.
    pub fn answers(&self, engine: &dyn Engine, cases: &[&Case]) -> Result<Answers> {
        let found = self.run(engine, cases, self.settings, 0)?.into_iter();
        self.progress.done(engine.name());
        Ok(self.answered(engine, found.map(|answer| Some(Arc::new(answer))).collect()))
    }

    fn answered(&self, engine: &dyn Engine, answers: Vec<Option<Arc<Answer>>>) -> Answers {
        let version = lock(&self.jobs)
            .get(engine.name())
            .map(|(_, version)| version.clone());
        Answers {
            engine: engine.name().to_owned(),
            version: version.unwrap_or_default(),
            answers,
        }
    }

    /// The answers of an engine to all cases under some settings: in one batch, and if that fails one after the other, so
    /// that a refusal of one case does not affect the others. Equal cases are computed once.
    ///
    /// # Errors
    /// An interruption. A refusal is an answer.
    pub fn each(
        &self,
        engine: &dyn Engine,
        cases: &[&Case],
        settings: &Settings,
    ) -> Result<Vec<Result<Arc<Answer>, String>>> {
        let of = of_settings(settings);
        let key = |case: &&Case| format!("{} {} {of}", engine.name(), identity(case));
        let keys: Vec<String> = cases.iter().map(key).collect();
        let mut new: Vec<usize> = Vec::new();
        for k in 0..cases.len() {
            let is_known = lock(&self.known).contains_key(&keys[k]);
            if !is_known && new.iter().all(|other| keys[*other] != keys[k]) {
                new.push(k);
            }
        }
        // A batch saves starting a program.
        let batches: Vec<Vec<usize>> = match engine.is_own() {
            true => new.iter().map(|k| vec![*k]).collect(),
            false => vec![new.clone()],
        };
        let alone = new.into_iter().map(|k| vec![k]);
        for batch in batches.into_iter().chain(alone) {
            if batch
                .iter()
                .all(|k| lock(&self.known).contains_key(&keys[*k]))
            {
                continue;
            }
            let of_batch: Vec<&Case> = batch.iter().map(|k| cases[*k]).collect();
            let found = match self.run(engine, &of_batch, settings, batch[0]) {
                Err(Error::Ended(cause)) => return Err(Error::Ended(cause)),
                Err(_) if batch.len() > 1 => continue,
                Err(e) => vec![Err(e.to_string())],
                Ok(answers) => answers
                    .into_iter()
                    .map(|answer| Ok(Arc::new(answer)))
                    .collect(),
            };
            let found = batch.iter().map(|k| keys[*k].clone()).zip(found);
            lock(&self.known).extend(found);
        }
        let known = lock(&self.known);
        let lost = || Err(format!("{} gave no answer", engine.name()));
        Ok(keys
            .iter()
            .map(|key| known.get(key).cloned().unwrap_or_else(lost))
            .collect())
    }

    /// The answers of an engine, if `first` cases came before these: in one job, or, if a journal stores them, in one job each.
    fn run(
        &self,
        engine: &dyn Engine,
        cases: &[&Case],
        settings: &Settings,
        first: usize,
    ) -> Result<Vec<Answer>> {
        let run = match &self.journal {
            None => self.job(engine, cases, settings, first)?,
            Some(journal) => {
                let mut all = Run {
                    version: String::new(),
                    answers: Vec::with_capacity(cases.len()),
                };
                for (k, case) in cases.iter().enumerate() {
                    cancel::check()?;
                    let usable = |kept: Kept| Some((kept.answer(case).ok()?, kept.version));
                    let run = || {
                        let mut run = self.job(engine, &[case], settings, first + k)?;
                        let kept = Kept::new(&run.version, case, &run.answers[0]);
                        Ok(((run.answers.remove(0), run.version), kept))
                    };
                    let (of, program) = ([engine.name(), &case_label(case)], || engine.identity());
                    let found = journal.once(of, program, &identity(case), usable, run)??;
                    all.answers.push(found.0);
                    all.version = found.1;
                }
                all
            }
        };
        lock(&self.jobs)
            .entry(engine.name().to_owned())
            .or_default()
            .1 = run.version;
        Ok(run.answers)
    }

    /// The version of an engine: the one that answered, or else the one found by running it.
    ///
    /// # Errors
    /// Those of [`Engine::probe`].
    pub fn version(&self, engine: &dyn Engine) -> Result<String> {
        let jobs = lock(&self.jobs);
        match jobs.get(engine.name()) {
            Some((_, version)) if !version.is_empty() => Ok(version.clone()),
            _ => engine.probe(),
        }
    }

    /// One job; `first` cases came before its cases.
    fn job(
        &self,
        engine: &dyn Engine,
        cases: &[&Case],
        settings: &Settings,
        first: usize,
    ) -> Result<Run> {
        let mut settings = settings.clone();
        let job = {
            let mut jobs = lock(&self.jobs);
            let (job, _) = jobs.entry(engine.name().to_owned()).or_default();
            *job += 1;
            *job
        };
        // Each job is kept in a separate folder.
        if job > 1 {
            settings.keep = settings.keep.map(|keep| keep.join(format!("job-{job}")));
        }
        let progress = Shifted {
            progress: self.progress,
            first,
        };
        let run = engine.run(cases, &settings, &progress)?;
        if run.answers.len() == cases.len() {
            return Ok(run);
        }
        let what = format!(
            "it gave {} answers to {} cases",
            run.answers.len(),
            cases.len()
        );
        Err(Error::engine(engine.name(), what, "report this"))
    }
}

impl Answers {
    /// The answer to a case.
    pub fn of(&self, case: usize) -> Option<&Arc<Answer>> {
        self.answers.get(case)?.as_ref()
    }
}

impl Failure {
    /// The value; if there is none, the error is recorded, unless it ends the whole run.
    ///
    /// # Errors
    /// An interruption.
    pub fn or<T>(engine: &str, found: Result<T>, failures: &mut Vec<Failure>) -> Result<Option<T>> {
        match found {
            Ok(found) => Ok(Some(found)),
            Err(Error::Ended(cause)) => Err(Error::Ended(cause)),
            Err(e) => {
                failures.push(Failure {
                    engine: engine.to_owned(),
                    message: e.to_string(),
                });
                Ok(None)
            }
        }
    }
}

/// Counts cases from an offset.
struct Shifted<'a> {
    progress: &'a dyn Progress,
    first: usize,
}

impl Progress for Shifted<'_> {
    fn step(&self, engine: &str, case: usize, iteration: usize, increment: f64) {
        self.progress
            .step(engine, self.first + case, iteration, increment);
    }
}

/// Everything that an answer depends on except the program and the problem.
fn of_settings(settings: &Settings) -> Value {
    json!({
        "increment": settings.stop.increment,
        "max_iterations": settings.stop.max_iterations,
        "iteration": settings.iteration.to_string(),
        "linear": format!("{:?}", settings.linear),
        "launch": format!("{:?}", settings.launch),
    })
}

/// Whether a test takes the k-th case of its list: every `of`-th, so that each kind has its turn, and all in `tests/run --all`.
#[cfg(test)]
pub(crate) fn is_in_turn(k: usize, of: usize) -> bool {
    k.is_multiple_of(of) || std::env::var_os("FACEOFF_SCENES").is_some()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::{self, Progress, Silent};
    use faceoff_fem::scene::Scene;

    /// The solver of this program, failing on one mesh.
    struct Refusing(Box<dyn Engine>);

    impl Engine for Refusing {
        fn name(&self) -> &str {
            self.0.name()
        }

        fn probe(&self) -> Result<String> {
            self.0.probe()
        }

        fn is_installed(&self) -> bool {
            true
        }

        fn is_own(&self) -> bool {
            true
        }

        fn run(
            &self,
            cases: &[&Case],
            settings: &Settings,
            progress: &dyn Progress,
        ) -> Result<Run> {
            if cases.iter().any(|case| case.n == Some(3)) {
                return Err(Error::Solver {
                    what: "it is singular".into(),
                    remedy: "take another".into(),
                });
            }
            self.0.run(cases, settings, progress)
        }
    }

    #[test]
    fn what_is_refused_of_one_case_costs_no_other_its_answer() {
        let settings = Settings::default();
        let scene = Scene::find("one-zone").unwrap();
        let setups =
            [2, 3, 4].map(|n| Setup::new(&scene, Some(n), Method::cr(), &settings).unwrap());
        let cases = setups.each_ref().map(|setup| setup.case().unwrap());
        let engine = Refusing(engine::find(engine::OWN).unwrap());
        let engines: [&dyn Engine; 1] = [&engine];
        let runner = Runner::new(&settings, &Silent);
        let (answered, failures) = runner.side_by_side(&engines, &cases.each_ref()).unwrap();
        let has_answer = [0, 1, 2].map(|k| answered[0].of(k).is_some());
        assert_eq!(has_answer, [true, false, true]);
        let message = "one-zone, cr, n = 3: solver: it is singular; take another";
        assert_eq!(failures.len(), 1);
        assert_eq!(failures[0].message, message);
    }
}
