//! JSON to a file or to standard output, and text to a file.

use std::io::Write;
use std::path::Path;

use serde::Serialize;
use serde_json::json;

use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Place, Result};
use faceoff_mesh::io::save;

/// The version of the JSON that `verify` and `compare` write; `schema/` beside this file has its schemas.
const VERSION: u32 = 1;

/// A result with what it is and who made it.
#[derive(Serialize)]
pub struct Document<'a, T> {
    /// `faceoff/verify/1`: the name of the schema.
    schema: String,
    /// The program's version.
    faceoff: &'static str,
    #[serde(flatten)]
    result: &'a T,
}

/// The result of a command as its JSON.
pub fn document<'a, T: Serialize>(command: &str, result: &'a T) -> Document<'a, T> {
    Document {
        schema: format!("faceoff/{command}/{VERSION}"),
        faceoff: env!("CARGO_PKG_VERSION"),
        result,
    }
}

/// The JSON of a command that ended before anything was judged.
pub fn failure(command: &str, error: &Error) -> impl Serialize {
    json!({
        "schema": format!("faceoff/{command}/{VERSION}"),
        "faceoff": env!("CARGO_PKG_VERSION"),
        "verdict": Verdict::Undetermined,
        "error": error.to_string(),
    })
}

/// Does `-` mean that the result itself goes to standard output?
pub fn is_stdout(path: Option<&Path>) -> bool {
    path.is_some_and(|path| path.as_os_str() == "-")
}

/// Writes `value` to `path`, beside and then renamed; to standard output for `-`.
///
/// # Errors
/// A file that cannot be written.
pub fn write_json(path: Option<&Path>, value: &impl Serialize) -> Result<()> {
    let Some(path) = path else { return Ok(()) };
    let mut text = serde_json::to_string_pretty(value).map_err(|e| {
        Error::file(
            path,
            Place::Whole,
            format!("no JSON can be made: {e}"),
            "report this",
        )
    })?;
    text.push('\n');
    if is_stdout(Some(path)) {
        let mut out = std::io::stdout().lock();
        return out
            .write_all(text.as_bytes())
            .and_then(|()| out.flush())
            .map_err(Error::io(path, "write"));
    }
    save(path, [text.as_bytes()])
}

/// Writes a text to `path`, beside and then renamed.
///
/// # Errors
/// A file that cannot be written.
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    save(path, [text.as_bytes()])
}
