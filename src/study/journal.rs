//! Measurements in a file as they are made, one a line, so that a study that was ended goes on where it was.

use std::collections::HashMap;
use std::fmt;
use std::fs::{self, File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::row::Row;
use crate::engine::Machine;
use faceoff_mesh::error::{Error, Place, Result};

/// The file of one study.
pub struct Journal {
    path: PathBuf,
    file: File,
    known: HashMap<String, Entry>,
}

/// The first line: times of another machine or version are not comparable.
#[derive(Serialize, Deserialize, PartialEq, Debug)]
struct Header {
    faceoff: String,
    processor: String,
    threads: usize,
    optimised: bool,
}

/// What was measured of a setting. What was refused is tried again.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Entry {
    /// The setting.
    pub key: String,
    /// Seconds that it took, evaluation included.
    pub cost: f64,
    pub row: Row,
}

impl fmt::Display for Header {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let build = if self.optimised {
            ""
        } else {
            ", not optimised"
        };
        let (version, processor, threads) = (&self.faceoff, &self.processor, self.threads);
        write!(
            f,
            "faceoff {version} on {processor} ({threads} threads{build})"
        )
    }
}

impl Journal {
    /// Opens a file, or makes it. A last line that an interruption cut off is taken away.
    ///
    /// # Errors
    /// A file that cannot be read or written, is no journal, or is one of another machine or version.
    pub fn open(path: &Path) -> Result<Self> {
        let machine = Machine::here();
        let header = Header {
            faceoff: machine.version.to_owned(),
            processor: machine.processor,
            threads: machine.threads,
            optimised: machine.optimised,
        };
        let mut options = OpenOptions::new();
        let mut file = options
            .append(true)
            .create(true)
            .open(path)
            .map_err(Error::io(path, "write"))?;
        let text = fs::read_to_string(path).map_err(Error::io(path, "read"))?;
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let mut lines = text[..whole].lines().enumerate();
        let refuse = |line: usize, what: String, remedy: &str| {
            Error::file(path, Place::Line(line + 1), what, remedy)
        };
        match lines.next() {
            // Something is there, and not one line of it.
            None if !text.is_empty() && !text.starts_with('{') => {
                let what = "it is no journal of a study".to_owned();
                return Err(refuse(0, what, "name another file; nothing was touched"));
            }
            None => {
                truncate(&file, path, 0)?;
                write(&mut file, path, &header)?;
            }
            Some((line, first)) => {
                let found: Header = serde_json::from_str(first).map_err(|_| {
                    let what = "it is no journal of a study".to_owned();
                    refuse(line, what, "name another file; nothing was touched")
                })?;
                if found != header {
                    let what = format!("it was measured by {found}, and this is {header}");
                    return Err(refuse(line, what, "name another file"));
                }
                truncate(&file, path, whole)?;
            }
        }
        let mut known = HashMap::new();
        for (line, text) in lines {
            let entry: Entry = serde_json::from_str(text).map_err(|e| {
                refuse(
                    line,
                    format!("it is no measurement: {e}"),
                    "take the line away",
                )
            })?;
            known.insert(entry.key.clone(), entry);
        }
        Ok(Journal {
            path: path.to_owned(),
            file,
            known,
        })
    }

    /// What is known of a setting.
    pub fn find(&self, key: &str) -> Option<&Entry> {
        self.known.get(key)
    }

    /// Keeps a measurement.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn keep(&mut self, entry: &Entry) -> Result<()> {
        // JSON has no NaN: what would not be read again is measured again.
        let readable = serde_json::to_string(entry).map(|t| serde_json::from_str::<Entry>(&t));
        if matches!(readable, Ok(Ok(_))) {
            write(&mut self.file, &self.path, entry)?;
        }
        Ok(())
    }
}

fn truncate(file: &File, path: &Path, length: usize) -> Result<()> {
    file.set_len(length as u64)
        .map_err(Error::io(path, "write"))
}

/// One line at once.
fn write(file: &mut File, path: &Path, value: &impl Serialize) -> Result<()> {
    let mut line = serde_json::to_string(value).map_err(|e| {
        Error::file(
            path,
            Place::Whole,
            format!("no JSON can be made: {e}"),
            "report this",
        )
    })?;
    line.push('\n');
    file.write_all(line.as_bytes())
        .map_err(Error::io(path, "write"))
}

#[cfg(test)]
mod tests {
    use super::super::row::{Varied, sample};
    use super::*;

    fn entry(key: &str, residual: f64) -> Entry {
        let mut row = sample(Varied::Mesh, 0.125, 2.5);
        row.residual = residual;
        Entry {
            key: key.into(),
            cost: 3.0,
            row,
        }
    }

    #[test]
    fn what_was_kept_is_there_again_and_what_was_cut_off_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("j");
        let mut journal = Journal::open(&path).unwrap();
        journal.keep(&entry("a", 1e-16)).unwrap();
        journal.keep(&entry("b", f64::NAN)).unwrap();
        drop(journal);
        let text = fs::read_to_string(&path).unwrap();
        assert_eq!(text.lines().count(), 2);
        // Killed while it wrote.
        fs::write(&path, format!("{text}{{\"key\":\"c\",\"co")).unwrap();
        let mut again = Journal::open(&path).unwrap();
        let a = again.find("a").unwrap();
        assert_eq!(
            (a.cost, a.row.h1, a.row.seconds.median),
            (3.0, Some(0.125), 2.5)
        );
        assert!(again.find("b").is_none() && again.find("c").is_none());
        again.keep(&entry("c", 0.0)).unwrap();
        assert!(Journal::open(&path).unwrap().find("c").is_some());
    }

    #[test]
    fn other_files_are_refused_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("j");
        let foreign =
            r#"{"faceoff":"0.0.0","processor":"A","threads":1,"optimised":true}"#.to_owned() + "\n";
        for (text, sentence) in [
            ("mine", "no journal"),
            ("mine\nand mine", "no journal"),
            (&foreign, "measured by"),
        ] {
            fs::write(&path, text).unwrap();
            let refused = Journal::open(&path).err().unwrap().to_string();
            assert!(refused.contains(sentence), "{refused}");
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
        drop(Journal::open(&folder.path().join("new")).unwrap());
        let mut text = fs::read_to_string(folder.path().join("new")).unwrap();
        text += "{\"key\":\"a\"}\n";
        fs::write(&path, text).unwrap();
        let refused = Journal::open(&path).err().unwrap().to_string();
        assert!(refused.contains(":2: "), "{refused}");
    }
}
