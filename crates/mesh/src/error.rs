//! The one error type: every message states what is wrong, where, and what to do about it.

use std::collections::HashSet;
use std::fmt;
use std::path::{Path, PathBuf};

use crate::cancel::Cause;

/// The result of a function that may fail, with the only [`enum@Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Everything that can go wrong. The program answers each of these with exit code 2.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file that violates its format.
    #[error("{}{place}: {what}; {remedy}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: Place,
        /// What is wrong there.
        what: String,
        /// What to do about it.
        remedy: String,
    },

    /// The operating system refused a file or folder.
    #[error("{}: cannot {action}: {source}; check that the path exists and that you may use it", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The operation that failed, such as `read`.
        action: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },

    /// A mesh that was read, but on which the problem cannot be solved.
    #[error("mesh {mesh}: {what}; {remedy}")]
    Mesh {
        /// Its path or generator.
        mesh: String,
        /// What is wrong, and with which cell or point.
        what: String,
        /// What to do about it.
        remedy: String,
    },

    /// A scene that asks for something impossible or unknown.
    #[error("scene {scene}, {place}: {what}; {remedy}")]
    Scene {
        /// Its name or path.
        scene: String,
        /// The table and key.
        place: String,
        /// What is wrong there.
        what: String,
        /// What to do about it.
        remedy: String,
    },

    /// The solver could not finish.
    #[error("solver: {what}; {remedy}")]
    Solver {
        /// What is wrong.
        what: String,
        /// What to do about it.
        remedy: String,
    },

    /// An error that cannot be bounded.
    #[error("no certificate, because {because}; {remedy}")]
    Certificate {
        /// The assumption of the bound that is not satisfied.
        because: String,
        /// What to do about it.
        remedy: String,
    },

    /// Two results of this program that exclude each other: one of them is wrong, and neither may be reported.
    #[error("{what}; this is a fault of faceoff: please report it with the command")]
    Contradiction {
        /// Both, with their numbers.
        what: String,
    },

    /// An engine that is missing, failed, or answered something that does not count.
    #[error("engine {engine}: {what}; {remedy}")]
    Engine {
        /// Its name.
        engine: String,
        /// What it did or failed to do.
        what: String,
        /// What to do about it.
        remedy: String,
    },

    /// Two results that cannot be compared at all.
    #[error("comparison of {a} with {b}: {what}; {remedy}")]
    Compare {
        /// The one result.
        a: String,
        /// The other.
        b: String,
        /// Why they cannot be matched.
        what: String,
        /// What to do about it.
        remedy: String,
    },

    /// A command line that asks for something impossible.
    #[error("{what}; {remedy}")]
    Usage {
        /// What is wrong.
        what: String,
        /// What to do about it.
        remedy: String,
    },

    /// The run was ended: by the user, or at a limit that was set.
    #[error(transparent)]
    Ended(#[from] Cause),
}

/// Where in a file something is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    Whole,
    /// A line, counted from 1.
    Line(usize),
    /// A line and a character of it, both counted from 1.
    Column(usize, usize),
    /// A byte, counted from 0.
    Byte(u64),
    /// A line inside a named section.
    SectionLine(String, usize),
    /// A byte inside a named section.
    SectionByte(String, u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Whole => Ok(()),
            Place::Line(line) => write!(f, ":{line}"),
            Place::Column(line, column) => write!(f, ":{line}:{column}"),
            Place::Byte(byte) => write!(f, ", byte {byte}"),
            Place::SectionLine(section, line) => write!(f, ":{line}, {section}"),
            Place::SectionByte(section, byte) => write!(f, ", byte {byte}, {section}"),
        }
    }
}

impl Error {
    /// A file that violates its format: where, what, and what to do.
    pub fn file(
        path: &Path,
        place: Place,
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Error::File {
            path: path.to_owned(),
            place,
            what: what.into(),
            remedy: remedy.into(),
        }
    }

    /// [`Error::file`] about the file as a whole.
    pub fn whole(path: &Path, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Error::file(path, Place::Whole, what, remedy)
    }

    /// For `map_err` on file system operations: `Error::io(path, "read")`.
    pub fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Error::Io {
            path,
            action,
            source,
        }
    }

    /// Something impossible that was asked for, and what to do.
    pub fn usage(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Error::Usage {
            what: what.into(),
            remedy: remedy.into(),
        }
    }

    /// An engine whose answer does not count: what, and what to do.
    pub fn engine(
        engine: impl Into<String>,
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Error::Engine {
            engine: engine.into(),
            what: what.into(),
            remedy: remedy.into(),
        }
    }
}

/// Refuses a list that contains a name twice; `what` is the kind of name, as in ``engine `rust` is named twice``.
///
/// # Errors
/// [`Error::Usage`] with the first repeated name.
pub fn distinct<T: fmt::Display>(
    names: impl IntoIterator<Item = T>,
    what: &str,
    remedy: &str,
) -> Result<()> {
    let mut seen = HashSet::new();
    for name in names {
        let name = name.to_string();
        if seen.contains(&name) {
            return Err(Error::usage(
                format!("{what} `{name}` is named twice"),
                remedy,
            ));
        }
        seen.insert(name);
    }
    Ok(())
}

/// The beginning of a remedy: which of the known words was probably meant by one that is unknown. Empty where none is near.
pub fn meant<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let distance = |known: &'a str| (strsim::damerau_levenshtein(word, known), known);
    match known.into_iter().map(distance).min() {
        Some((distance, known)) if distance <= 1 + known.chars().count() / 4 => {
            format!("did you mean `{known}`? ")
        }
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_that_is_near_was_meant() {
        let known = ["freefem", "fenicsx", "cr"];
        assert_eq!(meant("freefen", known), "did you mean `freefem`? ");
        assert_eq!(meant("rc", known), "did you mean `cr`? ");
        assert_eq!(meant("comsol", known), "");
        assert_eq!(meant("comsol", []), "");
    }

    #[test]
    fn a_repeated_name_is_refused() {
        assert!(distinct([1, 2, 3], "n", "give others").is_ok());
        let error = distinct(["a", "b", "a"], "engine", "name each once").unwrap_err();
        assert_eq!(
            error.to_string(),
            "engine `a` is named twice; name each once"
        );
    }
}
