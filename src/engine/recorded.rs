//! Answers that were kept: a baseline stands in for the engines that gave them, where those are not installed.
//!
//! ```text
//! baseline.json           who answered what, on which mesh, scene and settings, and how to record it again
//! case-0.freefem.f64, …   dofs as engines write them: little-endian binary64, cells × local dofs
//! ```

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::{Answer, Case, Engine, Progress, Run, Settings, job};
use faceoff_fem::contact::Method;
use faceoff_mesh::error::{Error, Place, Result};

/// The file of a baseline's folder that says what is there.
pub const BASELINE: &str = "baseline.json";

/// Its version.
const SCHEMA: &str = "faceoff/baseline/1";

/// What `baseline.json` holds.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Baseline {
    schema: String,
    /// The version of the program that recorded it.
    faceoff: String,
    /// The command that records it again.
    recipe: String,
    settings: Value,
    cases: Vec<RecordedCase>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct RecordedCase {
    /// Scene, method, mesh and everything else that the scheme is made of.
    problem: Value,
    answers: Vec<RecordedAnswer>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct RecordedAnswer {
    engine: String,
    version: String,
    converged: bool,
    increments: Vec<Option<f64>>,
    /// Backward error when it was recorded.
    residual: f64,
    /// Beside `baseline.json`.
    dofs: String,
    /// Of that file.
    digest: String,
}

/// An answer that is to be kept.
pub struct Kept<'a> {
    pub engine: &'a str,
    pub version: &'a str,
    pub increments: &'a [f64],
    pub residual: f64,
    pub u: &'a [f64],
}

/// Writes a baseline into `folder`, which is there.
///
/// # Errors
/// Files that cannot be written.
pub fn record(
    folder: &Path,
    recipe: &str,
    settings: &Settings,
    cases: &[(Case, Vec<Kept>)],
) -> Result<()> {
    let mut recorded = Vec::new();
    for (index, (case, answers)) in cases.iter().enumerate() {
        let space = &case.problem.space;
        let mut of_case = Vec::new();
        for kept in answers {
            let dofs = format!("case-{index}.{}.f64", kept.engine);
            let cells = 0..space.mesh.cell_count();
            let values = cells
                .flat_map(|cell| space.cell_dofs(cell))
                .map(|dof| kept.u[*dof as usize]);
            let bytes: Vec<u8> = values.flat_map(f64::to_le_bytes).collect();
            let path = folder.join(&dofs);
            std::fs::write(&path, &bytes).map_err(Error::io(&path, "write"))?;
            of_case.push(RecordedAnswer {
                engine: kept.engine.into(),
                version: kept.version.into(),
                converged: true,
                increments: kept.increments.iter().map(|i| Some(*i)).collect(),
                residual: kept.residual,
                dofs,
                digest: digest(&bytes),
            });
        }
        recorded.push(RecordedCase {
            problem: problem(case),
            answers: of_case,
        });
    }
    let baseline = Baseline {
        schema: SCHEMA.into(),
        faceoff: env!("CARGO_PKG_VERSION").into(),
        recipe: recipe.into(),
        settings: of_settings(settings),
        cases: recorded,
    };
    let path = folder.join(BASELINE);
    let text = serde_json::to_string_pretty(&baseline)
        .map_err(|e| Error::file(&path, Place::Whole, e.to_string(), "report this"))?;
    std::fs::write(&path, text + "\n").map_err(Error::io(&path, "write"))
}

impl Baseline {
    /// Reads the baseline of a folder, and stands its engines up.
    ///
    /// # Errors
    /// No baseline there, or one that is not as it must be.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(BASELINE);
        let text = std::fs::read_to_string(&path).map_err(Error::io(&path, "read"))?;
        let refuse = |what: String| {
            let remedy = "name a folder that `faceoff verify --record` wrote";
            Error::file(&path, Place::Whole, what, remedy)
        };
        let baseline: Baseline =
            serde_json::from_str(&text).map_err(|e| refuse(format!("it is no baseline: {e}")))?;
        if baseline.schema != SCHEMA {
            return Err(refuse(format!(
                "it is `{}`, not `{SCHEMA}`",
                baseline.schema
            )));
        }
        if baseline.cases.iter().all(|case| case.answers.is_empty()) {
            return Err(refuse("it holds no answer".into()));
        }
        Ok(baseline)
    }

    /// One engine for each that answered, named `freefem (recorded)`.
    pub fn engines(self, folder: &Path) -> Vec<Box<dyn Engine>> {
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
                folder: folder.to_owned(),
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
    folder: PathBuf,
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

    fn run(&self, cases: &[Case], settings: &Settings, progress: &dyn Progress) -> Result<Run> {
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
        let asked = problem(case);
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
        let told = recorded.answers.iter().find(|a| a.engine == self.engine);
        let Some(told) = told else {
            return Err(self.refuse(format!("its answer to {label} was not recorded")));
        };
        let fault = |what: String| self.refuse(format!("{} of {label}: {what}", told.dofs));
        let space = &case.problem.space;
        let expected = space.mesh.cell_count() * space.local_dofs;
        let values = job::read_values(&self.folder, &told.dofs, expected, space.local_dofs)
            .map_err(fault)?;
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        if digest(&bytes) != told.digest {
            return Err(fault("it has changed since it was recorded".into()));
        }
        let u = job::to_dofs(&case.problem, &values).map_err(fault)?;
        Ok(Answer {
            residual: case.problem.backward_error(&u).0,
            u,
            increments: told
                .increments
                .iter()
                .map(|i| i.unwrap_or(f64::NAN))
                .collect(),
            converged: told.converged,
            step: told.increments.len(),
            history: None,
            seconds: Vec::new(),
        })
    }
}

pub(super) fn digest(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex()[..16].to_owned()
}

fn of_settings(settings: &Settings) -> Value {
    json!({
        "increment": settings.stop.increment,
        "max_iterations": settings.stop.max_iterations,
    })
}

/// Everything that the scheme is made of.
pub(super) fn problem(case: &Case) -> Value {
    let (scene, problem) = (case.scene(), &case.problem);
    let discretisation = &problem.discretisation;
    let parts = format!("{:?}", problem.parts);
    json!({
        "scene": scene.name(),
        "method": problem.method().to_string(),
        "n": case.n,
        "mesh digest": problem.space.mesh.digest(),
        "parts of the boundary, digest": digest(parts.as_bytes()),
        "dofs": problem.space.dofs,
        "gamma0": discretisation.gamma0,
        "h": format!("{:?}", discretisation.h).to_lowercase(),
        "quadrature": [problem.cell_rule.name, problem.face_rule.name],
        "f": scene.data().f.text(),
        "g": scene.data().g.text(),
        "t": scene.data().t.text(),
        "psi": scene.data().psi.text(),
    })
}

/// The first key whose values differ, with both.
pub(super) fn first_difference(at: &str, recorded: &Value, asked: &Value) -> Option<String> {
    if let (Value::Object(of_recorded), Value::Object(of_asked)) = (recorded, asked) {
        let keys = of_recorded.keys().chain(of_asked.keys());
        return keys
            .into_iter()
            .find_map(|key| first_difference(key, &recorded[key], &asked[key]));
    }
    (recorded != asked).then(|| format!("{at} was {recorded} and is {asked}"))
}
