//! JSON to a file or to standard output, and text to a file.

use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use serde::Serialize;

use crate::error::{Error, Place, Result};

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
    replace(path, text.as_bytes())
}

/// Writes a text to `path`, beside and then renamed.
///
/// # Errors
/// A file that cannot be written.
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    replace(path, text.as_bytes())
}

/// Writes a file whole or not at all.
fn replace(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    // As readable as any file that a program makes; a temporary one is for its owner only.
    let mut file = tempfile::Builder::new()
        .permissions(PermissionsExt::from_mode(0o666))
        .tempfile_in(folder)
        .map_err(Error::io(path, "write"))?;
    file.write_all(bytes).map_err(Error::io(path, "write"))?;
    file.persist(path)
        .map_err(|e| Error::io(path, "write")(e.error))?;
    Ok(())
}
