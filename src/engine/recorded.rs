//! Answers that were recorded: a baseline stands in for the engines that gave them, where those are not installed.

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::kept::{Kept, first_difference, identity};
use super::{Answer, Case, Engine, Progress, Run, Settings, job};
use faceoff_fem::contact::Method;
use faceoff_mesh::error::{Error, Place, Result};
use faceoff_mesh::file;

/// The file of a baseline's folder: who answered what, on which mesh, scene and settings, and how to record it again.
pub const BASELINE: &str = "baseline.json";

/// Its version.
const SCHEMA: &str = "faceoff/baseline/2";

/// Answers that were recorded, as `baseline.json` has them.
#[derive(Debug, Serialize, Deserialize)]
pub struct Baseline {
    schema: String,
    /// The version of the program that recorded it.
    faceoff: String,
    /// The command that records it again.
    recipe: String,
    settings: Value,
    cases: Vec<RecordedCase>,
}

#[derive(Debug, Serialize, Deserialize)]
struct RecordedCase {
    problem: Value,
    answers: Vec<Kept>,
}

/// Only what the schema says of itself.
#[derive(Deserialize)]
struct Versioned {
    schema: String,
}

/// Writes a baseline into `folder`, which exists.
///
/// # Errors
/// A file that cannot be written.
pub fn record(
    folder: &Path,
    recipe: &str,
    settings: &Settings,
    cases: Vec<(Case, Vec<Kept>)>,
) -> Result<()> {
    let baseline = Baseline {
        schema: SCHEMA.into(),
        faceoff: env!("CARGO_PKG_VERSION").into(),
        recipe: recipe.into(),
        settings: of_settings(settings),
        cases: cases
            .into_iter()
            .map(|(case, answers)| RecordedCase {
                problem: identity(&case),
                answers,
            })
            .collect(),
    };
    let path = folder.join(BASELINE);
    let text = serde_json::to_string_pretty(&baseline)
        .map_err(|e| Error::file(&path, Place::Whole, e.to_string(), "report this"))?;
    std::fs::write(&path, text + "\n").map_err(Error::io(&path, "write"))
}

impl Baseline {
    /// Reads the baseline of a folder.
    ///
    /// # Errors
    /// No baseline there, or one that is not as it must be.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(BASELINE);
        let text = match file::beneath(folder, BASELINE) {
            Some(path) => file::text(&path)?,
            None => {
                let remedy = "put the baseline itself into the folder";
                let what = "it is a link to a file outside its folder";
                return Err(Error::file(&path, Place::Whole, what, remedy));
            }
        };
        let refuse = |what: String| {
            let remedy = "name a folder that `faceoff verify --record` of this version wrote, or record it again";
            Error::file(&path, Place::Whole, what, remedy)
        };
        let no_baseline = |e: serde_json::Error| refuse(format!("it is no baseline: {e}"));
        let Versioned { schema } = serde_json::from_str(&text).map_err(no_baseline)?;
        if schema != SCHEMA {
            return Err(refuse(format!("it is `{schema}`, not `{SCHEMA}`")));
        }
        let baseline: Baseline = serde_json::from_str(&text).map_err(no_baseline)?;
        if baseline.cases.iter().all(|case| case.answers.is_empty()) {
            return Err(refuse("it holds no answer".into()));
        }
        Ok(baseline)
    }

    /// One engine for each that answered, named `freefem (recorded)`.
    pub fn engines(self) -> Vec<Box<dyn Engine>> {
        let mut names: Vec<String> = Vec::new();
        for answer in self.cases.iter().flat_map(|case| &case.answers) {
            if !names.contains(&answer.engine) {
                names.push(answer.engine.clone());
            }
        }
        let baseline = Arc::new(self);
        let engines = names.into_iter().map(|engine| {
            let recorded = Recorded {
                name: format!("{engine} (recorded)"),
                engine,
                baseline: Arc::clone(&baseline),
            };
            Box::new(recorded) as Box<dyn Engine>
        });
        engines.collect()
    }
}

/// An engine of a baseline.
struct Recorded {
    name: String,
    engine: String,
    baseline: Arc<Baseline>,
}

impl Engine for Recorded {
    fn name(&self) -> &str {
        &self.name
    }

    fn probe(&self) -> Result<String> {
        let mut answers = self.baseline.cases.iter().flat_map(|case| &case.answers);
        let own = answers.find(|answer| answer.engine == self.engine);
        Ok(own.map_or(String::new(), |answer| answer.version.clone()))
    }

    fn is_installed(&self) -> bool {
        true
    }

    fn accepts(&self, _: &Method) -> Result<()> {
        Ok(())
    }

    fn run(&self, cases: &[&Case], settings: &Settings, progress: &dyn Progress) -> Result<Run> {
        let asked = of_settings(settings);
        if let Some(what) = first_difference("", &self.baseline.settings, &asked) {
            return Err(self.refuse(format!("it was recorded with other settings: {what}")));
        }
        let answers = cases
            .iter()
            .map(|case| self.answer(case))
            .collect::<Result<_>>()?;
        progress.done(&self.name);
        Ok(Run {
            version: self.probe()?,
            answers,
        })
    }
}

impl Recorded {
    fn refuse(&self, what: String) -> Error {
        let remedy = format!(
            "run what was recorded, or record it again: {}",
            self.baseline.recipe
        );
        Error::engine(&self.name, what, remedy)
    }

    fn answer(&self, case: &Case) -> Result<Answer> {
        let label = job::case_label(case);
        let asked = identity(case);
        let same = |recorded: &&RecordedCase| {
            ["scene", "method", "n"]
                .iter()
                .all(|key| recorded.problem[key] == asked[key])
        };
        let Some(recorded) = self.baseline.cases.iter().find(same) else {
            return Err(self.refuse(format!("the baseline does not hold {label}")));
        };
        if let Some(what) = first_difference("", &recorded.problem, &asked) {
            return Err(self.refuse(format!(
                "{label} is another problem than was recorded: {what}"
            )));
        }
        let kept = recorded.answers.iter().find(|a| a.engine == self.engine);
        let Some(kept) = kept else {
            return Err(self.refuse(format!("its answer to {label} was not recorded")));
        };
        kept.answer(case)
            .map_err(|what| self.refuse(format!("of {label}, {what}")))
    }
}

fn of_settings(settings: &Settings) -> Value {
    json!({
        "increment": settings.stop.increment,
        "max_iterations": settings.stop.max_iterations,
    })
}
