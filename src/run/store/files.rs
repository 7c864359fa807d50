//! Answers that are files: those that a code of a face-off file wrote, with one folder per run next to the journal or the record.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::record::Lack;
use super::{Journal, Record};
use crate::engine::{Left, copy, digest};
use crate::run::face_off::{Code, Level};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::file::{self, Temporary};

/// Runs that are stored as they come, each with the files that its code wrote.
pub struct Store {
    folder: PathBuf,
    journal: Journal,
    _temporary: Option<Temporary>,
}

/// One run.
#[derive(Debug, Serialize, Deserialize)]
struct Kept {
    /// The time; 0 in a record, which does not depend on it.
    seconds: f64,
    /// Digests of its files, by their paths in the run's folder.
    digests: BTreeMap<String, String>,
}

/// `freefem-n16`
fn place(code: &str, level: &Level) -> String {
    code.to_owned() + &level.suffix()
}

impl Store {
    /// Stores in a folder, which is created if needed; `None`: in a temporary folder.
    ///
    /// # Errors
    /// A folder with other contents, one of another face-off file, or one that another run uses.
    pub fn open(folder: Option<&Path>, name: &str) -> Result<Self> {
        let temporary = folder.is_none().then(Temporary::new).transpose()?;
        let own = temporary.as_ref().map(Temporary::path);
        let folder = folder.or(own).unwrap_or(Path::new("."));
        if folder.is_file() {
            let what = format!("{} is a file", folder.display());
            let remedy = "name a folder, which holds what codes write";
            return Err(Error::usage(what, remedy));
        }
        Ok(Store {
            journal: Journal::open(folder, &json!({ "face-off": name }))?,
            folder: folder.to_owned(),
            _temporary: temporary,
        })
    }

    /// The answer of a code to a problem: the stored one, if its files are unchanged, or that which `run` writes to a folder, which
    /// is stored.
    ///
    /// # Errors
    /// The stored run had a different setup; a journal that cannot be written. Inner error: why the code does not answer.
    pub fn once(
        &self,
        code: &Code,
        level: &Level,
        problem: &Value,
        run: impl FnOnce(PathBuf) -> Result<Left>,
    ) -> Result<Result<Left>> {
        let place = self.folder.join(place(code.name(), level));
        let usable = |kept: Kept| {
            let is_same = digests(&place).is_ok_and(|found| found == kept.digests);
            is_same.then(|| code.left(&place, kept.seconds).ok())?
        };
        let of = [code.name(), &level.words()];
        self.journal.once(
            of,
            || code.identity(),
            problem,
            usable,
            || {
                // From a run that was interrupted.
                if place.is_dir() {
                    fs::remove_dir_all(&place).map_err(Error::io(&place, "remove"))?;
                }
                let left = run(place.clone())?;
                let (seconds, digests) = (left.seconds, digests(&place)?);
                Ok((left, Kept { seconds, digests }))
            },
        )
    }

    /// The runs of these codes and levels, with their inputs, as a record whose files are copied into `folder`.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn record(
        &self,
        folder: &Path,
        recipe: &str,
        runs: &[(String, Level, Value)],
    ) -> Result<Record> {
        let mut record = Record::new(recipe, json!({}));
        for (code, level, problem) in runs {
            let place = place(code, level);
            let to = folder.join(&place);
            copy(&self.folder.join(&place), &to)?;
            let (seconds, digests) = (0.0, digests(&to)?);
            let kept = Kept { seconds, digests };
            record.add([code, &level.words()], problem.clone(), &kept);
        }
        Ok(record)
    }
}

impl Record {
    /// The recorded results of a code.
    ///
    /// # Errors
    /// A level that was not recorded, a different problem, files that have changed since.
    pub fn left(&self, code: &Code, level: &Level, problem: &Value) -> Result<Left> {
        let (place, at) = (place(code.name(), level), level.words());
        let refuse = |what: String| self.refuse(&format!("{} (recorded)", code.name()), what);
        let found = self.find([code.name(), &at], problem).map_err(|lack| {
            refuse(match lack {
                Lack::Other(what) => format!("it was another problem: {what}"),
                _ if at.is_empty() => "its answer without refinement was not recorded".into(),
                _ => format!("{at} was not recorded"),
            })
        })?;
        let kept: Kept = serde_json::from_value(found.clone())
            .map_err(|e| refuse(format!("it is not a record of a face-off: {e}")))?;
        let inside = file::beneath(&self.folder, &place)
            .ok_or_else(|| refuse(format!("{place} lies outside of its folder")))?;
        if digests(&inside)? != kept.digests {
            return Err(refuse(format!("files in {place} have changed since")));
        }
        code.left(&inside, 0.0)
    }
}

/// The digests of all regular files in a folder and its subfolders, by their relative paths.
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
