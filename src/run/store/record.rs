//! A record: the answers of codes when they agreed, in one file with the command to record it again. Files of an answer are in a folder next to it.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Entry, first_difference};
use crate::engine::unique;
use faceoff_mesh::error::{Error, Place, Result};
use faceoff_mesh::file;

/// The name of the file in a record's folder.
pub const BASELINE: &str = "baseline.json";

/// The current version.
const SCHEMA: &str = "faceoff/baseline/3";

/// Recorded answers.
#[derive(Debug, Serialize, Deserialize)]
pub struct Record {
    schema: String,
    /// The version of the program that recorded it.
    faceoff: String,
    /// The command that records it again.
    recipe: String,
    /// Inputs of all answers.
    pub(super) of: Value,
    pub(super) entries: Vec<Entry>,
    #[serde(skip)]
    pub(super) folder: PathBuf,
}

/// The reason for a missing answer.
pub(super) enum Lack {
    /// There is no entry for this engine and case.
    Question,
    /// There are only entries of other engines.
    Answer,
    /// The problem was different: a message on the difference.
    Other(String),
}

/// Only reads the version of the schema.
#[derive(Deserialize)]
struct Versioned {
    schema: String,
}

impl Record {
    /// A record without answers; `recipe` is the command that makes it again.
    pub fn new(recipe: &str, of: Value) -> Self {
        Record {
            schema: SCHEMA.into(),
            faceoff: env!("CARGO_PKG_VERSION").into(),
            recipe: recipe.into(),
            of,
            entries: Vec::new(),
            folder: PathBuf::new(),
        }
    }

    /// Adds an answer.
    pub fn add(&mut self, [by, at]: [&str; 2], asked: Value, found: &impl Serialize) {
        self.entries.push(Entry {
            by: by.to_owned(),
            at: at.to_owned(),
            asked,
            found: serde_json::to_value(found).unwrap_or_default(),
            wrote: Default::default(),
        });
    }

    /// Writes it into `folder`, which must exist.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let path = folder.join(BASELINE);
        let text = serde_json::to_string_pretty(self)
            .map_err(|e| Error::file(&path, Place::Whole, e.to_string(), "report this"))?;
        fs::write(&path, text + "\n").map_err(Error::io(&path, "write"))
    }

    /// Reads the record of a folder.
    ///
    /// # Errors
    /// A missing or invalid record.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(BASELINE);
        let refuse = |what: String| {
            let remedy = "name a folder that `faceoff verify --record` of this version wrote, or record it again";
            Error::file(&path, Place::Whole, what, remedy)
        };
        let inside = file::beneath(folder, BASELINE).ok_or_else(|| {
            let remedy = "put the baseline itself into the folder";
            let what = "it is a link to a file outside its folder";
            Error::file(&path, Place::Whole, what, remedy)
        })?;
        let text = file::text(&inside)?;
        let no_baseline = |e: serde_json::Error| refuse(format!("it is not a baseline: {e}"));
        let Versioned { schema } = serde_json::from_str(&text).map_err(no_baseline)?;
        if schema != SCHEMA {
            return Err(refuse(format!("it is `{schema}`, not `{SCHEMA}`")));
        }
        let mut record: Record = serde_json::from_str(&text).map_err(no_baseline)?;
        if record.entries.is_empty() {
            return Err(refuse("it holds no answer".into()));
        }
        record.folder = folder.to_owned();
        Ok(record)
    }

    /// The engines whose answers it contains.
    pub fn players(&self) -> Vec<&str> {
        unique(self.entries.iter().map(|entry| &*entry.by))
    }

    /// The recorded answer for the current inputs.
    pub(super) fn find(&self, [by, at]: [&str; 2], asked: &Value) -> Result<&Value, Lack> {
        let mut question = self.entries.iter().filter(|entry| entry.at == at);
        let own = question.clone().find(|entry| entry.by == by);
        let found = own.or_else(|| question.next()).ok_or(Lack::Question)?;
        match first_difference("", &found.asked, asked) {
            Some(what) => Err(Lack::Other(what)),
            None => own.map(|own| &own.found).ok_or(Lack::Answer),
        }
    }

    /// The error for an answer that cannot be used.
    pub(super) fn refuse(&self, by: &str, what: String) -> Error {
        let remedy = format!("run what was recorded, or record it again: {}", self.recipe);
        Error::engine(by, what, remedy)
    }
}
