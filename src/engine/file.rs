//! An engine as a TOML file, so that a further code, or a changed copy of a companion script,
//! joins without a line of Rust:
//!
//! ```toml
//! name = "my-code"
//! command = ["python3", "solve.py"]   # runs in the job folder; files beside this one are found
//! ```
//!
//! ```toml
//! name = "freefem-changed"
//! companion = "freefem"               # or "fenicsx"
//! scripts = "copy"                    # folder, beside this file, with signorini.edp and nitsche.idp
//! ```

use std::path::Path;

use serde::Deserialize;

use super::program::{Kind, Program};
use faceoff_mesh::error::{Error, Place, Result};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EngineFile {
    name: String,
    command: Option<Vec<String>>,
    companion: Option<String>,
    scripts: Option<String>,
}

pub(super) fn read(path: &Path) -> Result<Program> {
    let text = faceoff_mesh::file::text(path)?;
    let remedy = "give `name` and either `command`, or `companion` and `scripts`";
    let refuse = |place: Place, what: String| Error::file(path, place, what, remedy);
    let file: EngineFile = toml::from_str(&text).map_err(|e| {
        let line = e
            .span()
            .map_or(1, |span| 1 + text[..span.start].matches('\n').count());
        refuse(Place::Line(line), e.message().replace('\n', " "))
    })?;
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
        (None, Some(companion @ ("freefem" | "fenicsx")), Some(scripts)) => {
            let scripts = Some(home.join(scripts));
            match companion {
                "freefem" => Kind::FreeFem { scripts },
                _ => Kind::Fenicsx { scripts },
            }
        }
        _ => return Err(refuse(Place::Whole, "it does not say what to run".into())),
    };
    Ok(Program {
        name: file.name,
        kind,
    })
}
