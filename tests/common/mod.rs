//! What the tests share: running the program, and reading what it says.
#![allow(dead_code, reason = "each test file uses its own part")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// The program under test, in a folder of its own.
pub fn faceoff(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_faceoff"));
    command.current_dir(folder);
    command
}

pub struct Ran {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

/// Runs the program with these words.
pub fn run(folder: &Path, words: &[&str]) -> Ran {
    told(
        faceoff(folder)
            .args(words)
            .output()
            .expect("the program starts"),
    )
}

pub fn told(output: Output) -> Ran {
    Ran {
        code: output.status.code(),
        stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

impl Ran {
    /// The JSON on standard output.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|e| panic!("no JSON ({e}): {}\n{}", self.stdout, self.stderr))
    }
}

/// Holds a file against a schema of the repository.
pub fn assert_valid(kind: &str, schema: &str, file: &Path) {
    let python = std::env::var_os("FACEOFF_READERS").map(PathBuf::from);
    let python = python.unwrap_or_else(|| source("target/readers/bin/python3"));
    let ran = told(
        Command::new(python)
            .arg(source("tests/schemas.py"))
            .args([kind.as_ref(), source(schema).as_os_str(), file.as_os_str()])
            .output()
            .expect("a Python with jsonschema and lxml: use tests/run"),
    );
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
}

pub fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// A file of the repository.
pub fn source(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

pub fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().expect("a file has a folder")).expect("a folder");
    std::fs::write(&path, text).expect("a file");
    path
}

/// The built-in scene `name` with `from` replaced by `to`, as a file in `folder`.
pub fn scene(folder: &Path, name: &str, from: &str, to: &str) -> String {
    let text =
        std::fs::read_to_string(source(&format!("crates/fem/src/scene/builtin/{name}.toml")))
            .expect("a built-in scene");
    assert!(text.contains(from), "{name} does not have `{from}`");
    write(folder, "scene.toml", &text.replace(from, to));
    "scene.toml".into()
}

/// An engine file for a copy of a companion in which `from`, which must occur once, is `to`.
pub fn changed_companion(folder: &Path, companion: &str, from: &str, to: &str) -> String {
    let home = match companion {
        "freefem" => source("freefem"),
        _ => source("fenicsx"),
    };
    let copy = folder.join("copy");
    std::fs::create_dir_all(&copy).expect("a folder");
    let mut places = 0;
    for entry in std::fs::read_dir(home).expect("the companion") {
        let path = entry.expect("an entry").path();
        if path.is_file() {
            let text = std::fs::read_to_string(&path).expect("a script");
            places += text.matches(from).count();
            let name = path.file_name().expect("a file has a name");
            std::fs::write(copy.join(name), text.replace(from, to)).expect("a copy");
        }
    }
    assert_eq!(places, 1, "`{from}` in the {companion} companion");
    write(
        folder,
        "changed.toml",
        &format!("name = \"changed\"\ncompanion = \"{companion}\"\nscripts = \"copy\"\n"),
    );
    "changed.toml".into()
}
