//! Engines of a record, each of which replaces one that is not installed.

use std::sync::Arc;

use serde_json::{Value, json};

use super::record::Lack;
use super::{Kept, Record, first_difference, identity};
use crate::engine::{Answer, Case, Engine, Progress, Run, Settings, case_label, digest};
use faceoff_fem::contact::Method;
use faceoff_mesh::error::{Error, Result};

impl Record {
    /// A record of answers under these settings.
    pub fn of_settings(recipe: &str, settings: &Settings) -> Self {
        Record::new(recipe, of_settings(settings))
    }

    /// Adds the answer of an engine to a case; the entry does not depend on the machine or the time.
    pub fn add_answer(&mut self, [engine, version]: [&str; 2], case: &Case, answer: &Answer) {
        let kept = Kept::new(version, case, answer).without_times();
        self.add([engine, &case_label(case)], identity(case), &kept);
    }

    /// One engine for each that answered, named `freefem (recorded)`.
    pub fn engines(self) -> Vec<Box<dyn Engine>> {
        let names: Vec<String> = self.players().into_iter().map(str::to_owned).collect();
        let record = Arc::new(self);
        let engine = |of: String| -> Box<dyn Engine> {
            Box::new(Recorded {
                name: format!("{of} (recorded)"),
                of,
                record: Arc::clone(&record),
            })
        };
        names.into_iter().map(engine).collect()
    }
}

struct Recorded {
    name: String,
    of: String,
    record: Arc<Record>,
}

impl Engine for Recorded {
    fn name(&self) -> &str {
        &self.name
    }

    fn probe(&self) -> Result<String> {
        let own = self.record.entries.iter().find(|entry| entry.by == self.of);
        let version = own.and_then(|own| own.found["version"].as_str());
        Ok(version.unwrap_or_default().to_owned())
    }

    fn is_installed(&self) -> bool {
        true
    }

    fn accepts(&self, _: &Method) -> Result<()> {
        Ok(())
    }

    fn identity(&self) -> Result<Value> {
        let answers = serde_json::to_vec(&self.record.entries).unwrap_or_default();
        Ok(json!({ "record": digest(&answers) }))
    }

    fn run(&self, cases: &[&Case], settings: &Settings, progress: &dyn Progress) -> Result<Run> {
        let asked = of_settings(settings);
        if let Some(what) = first_difference("", &self.record.of, &asked) {
            return Err(self.refuse(format!("it was recorded with other settings: {what}")));
        }
        let answers = cases.iter().map(|case| self.answer(case));
        let answers = answers.collect::<Result<_>>()?;
        progress.done(&self.name);
        Ok(Run {
            version: self.probe()?,
            answers,
        })
    }
}

impl Recorded {
    fn refuse(&self, what: String) -> Error {
        self.record.refuse(&self.name, what)
    }

    fn answer(&self, case: &Case) -> Result<Answer> {
        let label = case_label(case);
        let found = self.record.find([&self.of, &label], &identity(case));
        let found = found.map_err(|lack| {
            self.refuse(match lack {
                Lack::Question => format!("the baseline does not hold {label}"),
                Lack::Answer => format!("its answer to {label} was not recorded"),
                Lack::Other(what) => {
                    format!("{label} is another problem than was recorded: {what}")
                }
            })
        })?;
        let kept: Result<Kept, _> = serde_json::from_value(found.clone());
        let answer = kept
            .map_err(|e| e.to_string())
            .and_then(|kept| kept.answer(case));
        answer.map_err(|what| self.refuse(format!("of {label}, {what}")))
    }
}

fn of_settings(settings: &Settings) -> Value {
    json!({
        "increment": settings.stop.increment,
        "max_iterations": settings.stop.max_iterations,
    })
}
