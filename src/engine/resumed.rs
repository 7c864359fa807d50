//! A long run that can be taken up again: each answer is kept as it comes, and taken from there the next time.
//!
//! ```text
//! rust/one-zone.cr.16.json   the problem, the settings and the program that the answer belongs to
//! rust/one-zone.cr.16.f64    u at all dofs of the space, little-endian binary64
//! ```

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::recorded::{digest, first_difference, problem};
use super::{Answer, Case, Engine, Progress, Run, Settings, interrupted, job};
use faceoff_fem::contact::Method;
use faceoff_mesh::error::{Error, Place, Result};

/// The version of the files.
const SCHEMA: &str = "faceoff/answer/1";

/// `engine`, which keeps its answers in a folder of its name in `folder`, and takes those that are there.
pub fn resumed(engine: Box<dyn Engine>, folder: &Path) -> Box<dyn Engine> {
    let folder = folder.join(engine.name());
    Box::new(Resumed { engine, folder })
}

struct Resumed {
    engine: Box<dyn Engine>,
    folder: PathBuf,
}

/// An answer that was kept.
#[derive(Serialize, Deserialize)]
struct Kept {
    schema: String,
    /// What the answer depends on besides the problem: who gave it, and how.
    from: Value,
    problem: Value,
    version: String,
    converged: bool,
    step: usize,
    increments: Vec<Option<f64>>,
    seconds: Vec<(String, f64)>,
    /// Of the file with the dofs.
    digest: String,
}

impl Engine for Resumed {
    fn name(&self) -> &str {
        self.engine.name()
    }

    fn probe(&self) -> Result<String> {
        self.engine.probe()
    }

    fn is_installed(&self) -> bool {
        self.engine.is_installed()
    }

    fn distributes(&self) -> bool {
        self.engine.distributes()
    }

    fn identity(&self) -> Result<Value> {
        self.engine.identity()
    }

    fn accepts(&self, method: &Method) -> Result<()> {
        self.engine.accepts(method)
    }

    fn run(&self, cases: &[Case], settings: &Settings, progress: &dyn Progress) -> Result<Run> {
        fs::create_dir_all(&self.folder).map_err(Error::io(&self.folder, "make"))?;
        // Held until the end.
        let lock = File::open(&self.folder).map_err(Error::io(&self.folder, "open"))?;
        if lock.try_lock().is_err() {
            return Err(self.refuse("is in use by another run"));
        }
        let from = json!({
            "faceoff": env!("CARGO_PKG_VERSION"),
            "program": self.engine.identity()?,
            "increment": settings.stop.increment,
            "max_iterations": settings.stop.max_iterations,
            "iteration": settings.iteration.to_string(),
            "linear": format!("{:?}", settings.linear),
            "launch": format!("{:?}", settings.launch),
        });
        let mut run = Run {
            version: String::new(),
            answers: Vec::with_capacity(cases.len()),
        };
        for (index, case) in cases.iter().enumerate() {
            if interrupted() {
                return Err(Error::Interrupted);
            }
            if let Some((version, answer)) = self.take(case, &from)? {
                run.version = version;
                run.answers.push(answer);
                continue;
            }
            let settings = Settings {
                keep: settings.keep.as_ref().map(|keep| keep.join(stem(case))),
                ..settings.clone()
            };
            let progress = Shifted { progress, index };
            let mut one = self
                .engine
                .run(std::slice::from_ref(case), &settings, &progress)?;
            let answer = one
                .answers
                .pop()
                .ok_or_else(|| Error::engine(self.name(), "it gave no answer", "report this"))?;
            self.keep(case, &from, &one.version, &answer)?;
            run.version = one.version;
            run.answers.push(answer);
        }
        progress.done(self.name());
        Ok(run)
    }
}

impl Resumed {
    fn refuse(&self, what: &str) -> Error {
        Error::usage(
            format!("{} {what}", self.folder.display()),
            "resume what was begun there as it was begun, or name another folder with --resume",
        )
    }

    /// The answer that is kept for a case, if there is a whole one.
    fn take(&self, case: &Case, from: &Value) -> Result<Option<(String, Answer)>> {
        let path = self.folder.join(stem(case) + ".json");
        let Ok(text) = fs::read_to_string(&path) else {
            return Ok(None);
        };
        let not_ours = |what: String| {
            let remedy = "name a folder that `faceoff verify --resume` made, or a new one";
            Error::file(&path, Place::Whole, what, remedy)
        };
        let kept: Kept = serde_json::from_str(&text)
            .map_err(|e| not_ours(format!("it is no answer that was kept: {e}")))?;
        if kept.schema != SCHEMA {
            return Err(not_ours(format!("it is `{}`, not `{SCHEMA}`", kept.schema)));
        }
        for (kept, asked) in [(&kept.from, from), (&kept.problem, &problem(case))] {
            if let Some(what) = first_difference("", kept, asked) {
                let label = job::case_label(case);
                return Err(self.refuse(&format!(
                    "was begun with something else: of {label}, {what}"
                )));
            }
        }
        let bytes = fs::read(path.with_extension("f64")).unwrap_or_default();
        let (values, rest) = bytes.as_chunks::<8>();
        let u: Vec<f64> = values.iter().map(|v| f64::from_le_bytes(*v)).collect();
        let whole = rest.is_empty() && u.len() == case.problem.space.dofs;
        if !whole || digest(&bytes) != kept.digest {
            // Somebody or something has changed it: it is computed again.
            tracing::warn!(file = %path.display(), "the dofs are not those that were kept");
            return Ok(None);
        }
        let answer = Answer {
            residual: case.problem.backward_error(&u).0,
            u,
            increments: kept
                .increments
                .iter()
                .map(|i| i.unwrap_or(f64::NAN))
                .collect(),
            converged: kept.converged,
            step: kept.step,
            history: None,
            seconds: kept.seconds,
        };
        Ok(Some((kept.version, answer)))
    }

    fn keep(&self, case: &Case, from: &Value, version: &str, answer: &Answer) -> Result<()> {
        let bytes: Vec<u8> = answer.u.iter().flat_map(|v| v.to_le_bytes()).collect();
        let finite = |i: &f64| i.is_finite().then_some(*i);
        let kept = Kept {
            schema: SCHEMA.into(),
            from: from.clone(),
            problem: problem(case),
            version: version.into(),
            converged: answer.converged,
            step: answer.step,
            increments: answer.increments.iter().map(finite).collect(),
            seconds: answer.seconds.clone(),
            digest: digest(&bytes),
        };
        let path = self.folder.join(stem(case) + ".json");
        let text = serde_json::to_string_pretty(&kept)
            .map_err(|e| Error::file(&path, Place::Whole, e.to_string(), "report this"))?;
        // What says that there is an answer comes last.
        self.write(&path.with_extension("f64"), &bytes)?;
        self.write(&path, text.as_bytes())
    }

    /// Writes beside and renames, so that the file is whole or not there.
    fn write(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        let mut part = tempfile::NamedTempFile::new_in(&self.folder)
            .map_err(Error::io(&self.folder, "write in"))?;
        part.write_all(bytes).map_err(Error::io(path, "write"))?;
        part.as_file()
            .sync_all()
            .map_err(Error::io(path, "write"))?;
        part.persist(path)
            .map_err(|e| Error::io(path, "write")(e.error))?;
        Ok(())
    }
}

/// Names the files of a case. Scenes of one run have different names, and names without a slash.
fn stem(case: &Case) -> String {
    let n = case.n.map_or("own".into(), |n| n.to_string());
    format!("{}.{}.{n}", case.scene().name(), case.problem.method())
}

/// Progress on one case of several.
struct Shifted<'a> {
    progress: &'a dyn Progress,
    index: usize,
}

impl Progress for Shifted<'_> {
    fn step(&self, engine: &str, case: usize, iteration: usize, increment: f64) {
        self.progress
            .step(engine, self.index + case, iteration, increment);
    }

    fn done(&self, _: &str) {}
}
