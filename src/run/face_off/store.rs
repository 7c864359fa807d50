//! What codes left, kept in a folder: an interrupted run goes on from it, and later runs are judged against it.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::{Code, Label, Level};
use crate::engine::{BASELINE, Left, digest, first_difference};
use crate::run::Journal;
use faceoff_mesh::error::{Error, Place, Result};
use faceoff_mesh::file::{self, Temporary};

/// The version of a record.
const SCHEMA: &str = "faceoff/face-off-record/1";

/// Runs that are kept as they come, each with the files that its code wrote.
pub struct Store {
    folder: PathBuf,
    journal: Journal,
    _temporary: Option<Temporary>,
}

/// One run in a journal.
#[derive(Debug, Serialize, Deserialize)]
struct Kept {
    seconds: f64,
    /// By their paths in the run's folder.
    digests: BTreeMap<String, String>,
}

/// What codes answered when they agreed: `baseline.json`, and beside it a folder for each run.
#[derive(Debug, Serialize, Deserialize)]
pub struct Record {
    schema: String,
    faceoff: String,
    name: String,
    /// The command that records it again.
    recipe: String,
    runs: Vec<Recorded>,
    #[serde(skip)]
    folder: PathBuf,
}

#[derive(Debug, Serialize, Deserialize)]
struct Recorded {
    code: String,
    n: Option<usize>,
    /// Where a parameter is a list.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    value: Option<(String, String)>,
    problem: Value,
    digests: BTreeMap<String, String>,
}

/// `freefem-n16`
fn label(code: &str, level: &Level) -> String {
    code.to_owned() + &level.suffix()
}

impl Store {
    /// In a folder, which is made where it is not there; without one in a folder that ends with this run.
    ///
    /// # Errors
    /// A folder with something else, one of another face-off, or one that another run uses.
    pub fn open(folder: Option<&Path>, name: &str) -> Result<Self> {
        let temporary = folder.is_none().then(Temporary::new).transpose()?;
        let folder = match (folder, &temporary) {
            (Some(folder), _) => folder.to_owned(),
            (None, Some(temporary)) => temporary.path().to_owned(),
            (None, None) => PathBuf::new(),
        };
        if folder.is_file() {
            let what = format!("{} is a file", folder.display());
            return Err(Error::usage(
                what,
                "name a folder, which holds what codes write",
            ));
        }
        Ok(Store {
            journal: Journal::open(&folder, &json!({ "face-off": name }))?,
            folder,
            _temporary: temporary,
        })
    }

    /// Where a run's files go; what is there of a run that was cut short is removed.
    ///
    /// # Errors
    /// Files that cannot be removed.
    pub fn place(&self, code: &str, level: &Level) -> Result<PathBuf> {
        let place = self.folder.join(label(code, level));
        if place.is_dir() {
            fs::remove_dir_all(&place).map_err(Error::io(&place, "remove"))?;
        }
        Ok(place)
    }

    /// What a code answered to what is asked, if it was kept and its files are what they were.
    ///
    /// # Errors
    /// Something else was asked when this was begun.
    pub fn find(&self, code: &Code, level: &Level, asked: &Value) -> Result<Option<Left>> {
        let label = label(code.name(), level);
        let Some(kept) = self.journal.find::<Kept>(&label, asked)? else {
            return Ok(None);
        };
        let place = self.folder.join(label);
        let is_same = digests(&place).is_ok_and(|found| found == kept.digests);
        Ok(is_same
            .then(|| code.left(&place, kept.seconds).ok())
            .flatten())
    }

    /// Keeps a run whose files are in their place, with what was asked as it stood before it and after.
    ///
    /// # Errors
    /// A journal that cannot be written.
    pub fn keep(&self, code: &str, level: &Level, asked: [&Value; 2], seconds: f64) -> Result<()> {
        let label = label(code, level);
        let digests = digests(&self.folder.join(&label))?;
        self.journal
            .keep_run(&label, asked, &Kept { seconds, digests })
    }

    /// Writes the runs of these codes and levels, with what each was asked, as a record into a folder.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn record(
        &self,
        folder: &Path,
        (name, recipe): (&str, &str),
        runs: &[(String, Level, Value)],
    ) -> Result<()> {
        let mut recorded = Vec::with_capacity(runs.len());
        for (code, level, problem) in runs {
            let label = label(code, level);
            let to = folder.join(&label);
            crate::engine::copy(&self.folder.join(&label), &to)?;
            recorded.push(Recorded {
                code: code.clone(),
                n: level.n,
                value: level.value.clone(),
                problem: problem.clone(),
                digests: digests(&to)?,
            });
        }
        let record = Record {
            schema: SCHEMA.into(),
            faceoff: env!("CARGO_PKG_VERSION").into(),
            name: name.into(),
            recipe: recipe.into(),
            runs: recorded,
            folder: PathBuf::new(),
        };
        let path = folder.join(BASELINE);
        let text = serde_json::to_string_pretty(&record)
            .map_err(|e| Error::file(&path, Place::Whole, e.to_string(), "report this"))?;
        fs::write(&path, text + "\n").map_err(Error::io(&path, "write"))
    }
}

impl Record {
    /// Reads the record in a folder.
    ///
    /// # Errors
    /// No record there, or one that is not as it must be.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(BASELINE);
        let refuse = |what: String| {
            let remedy = "name a folder that `faceoff verify --record` wrote";
            Error::file(&path, Place::Whole, what, remedy)
        };
        let inside = file::beneath(folder, BASELINE)
            .ok_or_else(|| refuse("it is a link to a file outside its folder".into()))?;
        let text = file::text(&inside)?;
        let mut record: Record = serde_json::from_str(&text)
            .map_err(|e| refuse(format!("it is no record of a face-off: {e}")))?;
        if record.schema != SCHEMA {
            return Err(refuse(format!("it is `{}`, not `{SCHEMA}`", record.schema)));
        }
        if record.runs.is_empty() {
            return Err(refuse("it holds no run".into()));
        }
        record.folder = folder.to_owned();
        Ok(record)
    }

    /// Codes that were recorded.
    pub fn codes(&self) -> Vec<&str> {
        crate::engine::unique(self.runs.iter().map(|run| &*run.code))
    }

    /// What a code answered when it was recorded.
    ///
    /// # Errors
    /// A level that was not, another problem than was recorded, files that have changed since.
    pub fn left(&self, code: &Code, level: &Level, problem: &Value) -> Result<Left> {
        let (name, label) = (code.name(), label(code.name(), level));
        let refuse = |what: String| {
            let remedy = format!("run what was recorded, or record it again: {}", self.recipe);
            Error::engine(format!("{name} (recorded)"), what, remedy)
        };
        let is_asked =
            |run: &&Recorded| run.code == name && run.n == level.n && run.value == level.value;
        let found = self.runs.iter().find(is_asked);
        let found = found.ok_or_else(|| match &level.label {
            Label::Only => refuse("its answer without refinement was not recorded".into()),
            label => refuse(format!("{label} was not recorded")),
        })?;
        if let Some(what) = first_difference("", &found.problem, problem) {
            return Err(refuse(format!("it was another problem: {what}")));
        }
        let place = file::beneath(&self.folder, &label)
            .ok_or_else(|| refuse(format!("{label} lies outside of its folder")))?;
        if digests(&place)? != found.digests {
            return Err(refuse(format!("files in {label} have changed since")));
        }
        code.left(&place, 0.0)
    }
}

/// Of all regular files of a folder and of those in it, by their paths in it.
fn digests(folder: &Path) -> Result<BTreeMap<String, String>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![(folder.to_owned(), String::new())];
    while let Some((at, prefix)) = folders.pop() {
        for entry in fs::read_dir(&at).map_err(Error::io(&at, "read"))? {
            let entry = entry.map_err(Error::io(&at, "read"))?;
            let (path, name) = (entry.path(), entry.file_name());
            let name = format!("{prefix}{}", name.to_string_lossy());
            let kind = entry.file_type().map_err(Error::io(&path, "read"))?;
            if kind.is_dir() {
                folders.push((path, format!("{name}/")));
            } else if kind.is_file() {
                found.insert(name, digest(&file::read(&path)?));
            }
        }
    }
    Ok(found)
}
