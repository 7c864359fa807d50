//! JSON documents, and texts to a file or to standard output.

use std::io::Write;
use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use super::console::misleads;
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::io::save;

/// The version of every schema; they are in the folder `schema/`.
const VERSION: u32 = 1;

/// A result with its schema and program.
#[derive(Serialize)]
struct Document<'a, T> {
    /// `faceoff/verify/1`: the name of the schema.
    schema: String,
    /// The program's version.
    faceoff: &'static str,
    #[serde(flatten)]
    result: &'a T,
}

/// A result and its verdict.
#[derive(Serialize)]
pub(super) struct Judged<'a, T> {
    /// The verdict.
    pub verdict: Verdict,
    /// The result.
    #[serde(flatten)]
    pub found: &'a T,
}

/// `verify`, `mesh-check`: the name of a command in schemas and files.
pub fn slug(command: &str) -> String {
    match command {
        "mesh convert" | "mesh make" | "mesh refine" => "mesh-written".into(),
        _ => command.replace(' ', "-"),
    }
}

/// The result of a command as JSON.
///
/// # Errors
/// A result that JSON cannot hold.
pub fn document(command: &str, result: &impl Serialize) -> Result<String> {
    let document = Document {
        schema: format!("faceoff/{}/{VERSION}", slug(command)),
        faceoff: env!("CARGO_PKG_VERSION"),
        result,
    };
    let text = serde_json::to_string_pretty(&document).map_err(|e| Error::Solver {
        what: format!("the result of {command} cannot be JSON: {e}"),
        remedy: "report this".into(),
    })?;
    Ok(visible(&text) + "\n")
}

/// A JSON text in which misleading characters are escaped by number, which programs read as the same text: they only occur in strings.
pub fn visible(json: &str) -> String {
    let mut text = String::with_capacity(json.len());
    for c in json.chars() {
        match misleads(c) {
            true => text += &format!("\\u{:04x}", u32::from(c)),
            false => text.push(c),
        }
    }
    text
}

/// Does `-` select standard output for the result?
pub fn is_stdout(path: Option<&Path>) -> bool {
    path.is_some_and(|path| path.as_os_str() == "-")
}

/// Writes a text to `path`, by a temporary file that is renamed; to standard output for `-`.
///
/// # Errors
/// A file that cannot be written.
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    if is_stdout(Some(path)) {
        let mut out = std::io::stdout().lock();
        let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
        return written.map_err(Error::io(path, "write"));
    }
    save(path, [text.as_bytes()])
}

/// Serialized values as CSV (RFC 4180): one per line, with the fields named in the head; numbers with all digits, and
/// empty fields for missing values.
pub fn csv(head: &str, rows: impl Iterator<Item = Value>) -> String {
    let text = |field: &Value| match field {
        Value::Null => String::new(),
        Value::Number(n) if n.is_f64() => format!("{:e}", n.as_f64().unwrap_or(f64::NAN)),
        Value::String(text) if text.contains([',', '"', '\n', '\r']) => {
            format!("\"{}\"", text.replace('"', "\"\""))
        }
        Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    let mut csv = head.to_owned() + "\n";
    for row in rows {
        let fields: Vec<String> = head.split(',').map(|name| text(&row[name])).collect();
        csv += &(fields.join(",") + "\n");
    }
    let shown = |c: char| if misleads(c) { '\u{fffd}' } else { c };
    csv.chars().map(shown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_with_a_comma_or_a_quote_is_quoted() {
        let row = serde_json::json!({ "c": "it \"is\"", "b": "p2(1,0)", "a": 1e-3, "d": 1 });
        let text = csv("a,b,c,d,e", [row].into_iter());
        assert_eq!(text, "a,b,c,d,e\n1e-3,\"p2(1,0)\",\"it \"\"is\"\"\",1,\n");
    }
}
