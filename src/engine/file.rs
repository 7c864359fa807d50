//! An engine as a TOML file, so that a further code, or a changed copy of a companion script,
//! can be added without a line of Rust:
//!
//! ```toml
//! name = "my-code"
//! command = ["python3", "solve.py"]   # runs in the job folder; files next to this one are found
//! ```
//!
//! ```toml
//! name = "freefem-changed"
//! companion = "freefem"               # or "fenicsx"
//! scripts = "copy"                    # folder, next to this file, with signorini.edp and nitsche.idp
//! ```
//!
//! ```toml
//! name = "freefem-13"                 # the release that another system has
//! companion = "freefem"
//! within = ["bwrap", "--bind", "/srv/debian13", "/", "--dev", "/dev", "--bind", "{job}", "{job}", "--chdir", "{job}"]
//! ```

use std::path::Path;

use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::program::{Kind, Program};
use super::within::Within;
use faceoff_mesh::error::{Error, Place, Result};

/// The contents of an engine file, or of one release in a matrix file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EngineFile {
    name: String,
    command: Option<Vec<String>>,
    companion: Option<String>,
    scripts: Option<String>,
    /// Words before the command, by which it runs in another system; `{job}` is the job folder.
    within: Option<Vec<String>>,
}

impl EngineFile {
    /// The program that runs, by the first word, or the folder of changed scripts that a companion runs.
    pub fn program(&self) -> Option<&str> {
        let first = [&self.within, &self.command].map(|words| words.as_ref()?.first());
        let scripts = self.scripts.as_ref().or(self.companion.as_ref());
        first
            .into_iter()
            .flatten()
            .next()
            .or(scripts)
            .map(String::as_str)
    }
}

const REMEDY: &str =
    "give `name`, and `command`, or `companion` and where it differs `scripts` or `within`";

pub(super) fn read(path: &Path) -> Result<Program> {
    described(parsed(path, REMEDY)?, path)
}

/// A TOML file.
///
/// # Errors
/// A file that cannot be read, or that is not an engine file.
pub fn parsed<T: DeserializeOwned>(path: &Path, remedy: &str) -> Result<T> {
    let text = faceoff_mesh::file::text(path)?;
    toml::from_str(&text).map_err(|e| {
        let line = e
            .span()
            .map_or(1, |span| 1 + text[..span.start].matches('\n').count());
        Error::file(
            path,
            Place::Line(line),
            e.message().replace('\n', " "),
            remedy,
        )
    })
}

/// The engine that the file at `path` describes.
///
/// # Errors
/// An invalid name, or a file without a program to run.
pub(super) fn described(file: EngineFile, path: &Path) -> Result<Program> {
    let refuse = |place: Place, what: String| Error::file(path, place, what, REMEDY);
    let valid = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
    if file.name.is_empty() || !file.name.chars().all(valid) {
        let what = "cannot name an engine (letters, digits, `-`, `_`)";
        return Err(refuse(Place::Whole, format!("`{}` {what}", file.name)));
    }
    if super::NAMES.contains(&file.name.as_str()) {
        let what = "is the name of an engine that is built in";
        return Err(refuse(Place::Whole, format!("`{}` {what}", file.name)));
    }
    let home = path.parent().unwrap_or(Path::new("")).to_owned();
    let kind = match (file.command, file.companion.as_deref(), file.scripts) {
        (Some(command), None, None) if !command.is_empty() => Kind::Other {
            command,
            folder: home,
        },
        // An unchanged companion in this system is built in.
        (None, Some(companion @ ("freefem" | "fenicsx")), scripts)
            if scripts.is_some() || file.within.is_some() =>
        {
            let scripts = scripts.map(|scripts| home.join(scripts));
            match companion {
                "freefem" => Kind::FreeFem { scripts },
                _ => Kind::Fenicsx { scripts },
            }
        }
        _ => return Err(refuse(Place::Whole, "it does not say what to run".into())),
    };
    let within = file.within.unwrap_or_default();
    if !within.is_empty() && !within.iter().any(|word| word.contains("{job}")) {
        let what = "`within` does not name {job}, the folder that the command must see";
        return Err(refuse(Place::Whole, format!("{}: {what}", file.name)));
    }
    // Querying its version runs its command.
    if !within.is_empty() && super::needs_sandbox() {
        let what = format!("{} runs within another system already", file.name);
        return Err(Error::usage(what, "leave --sandbox out"));
    }
    Ok(Program {
        name: file.name,
        kind,
        within: Within(within),
    })
}
