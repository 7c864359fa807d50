//! Python processes that have loaded a code's library: to load it takes longer than to run most scripts.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::{Mutex, PoisonError};

/// A process that runs scripts one after the other, each in a child of its own. It ends with the tests, when its input does.
struct Warm {
    process: Child,
    told: BufReader<ChildStdout>,
}

/// Those that run nothing now, by modules.
static IDLE: Mutex<BTreeMap<&str, Vec<Warm>>> = Mutex::new(BTreeMap::new());

/// What is loaded for a code's scripts: the words of warm.py, with a space between.
pub fn modules(code: &str) -> Option<&'static str> {
    match code {
        "dolfinx" => Some("ffcx.codegeneration.jit +dolfinx.cpp"),
        "mfem" => Some("mfem.ser scipy.sparse.linalg"),
        "ngsolve" => Some("ngsolve"),
        "nutils" => Some("nutils.mesh"),
        "scikit-fem" => Some("skfem"),
        _ => None,
    }
}

/// Runs a script in its folder, with these words: whether it succeeds, and what it writes to standard output and standard error.
pub fn run(
    python: &Path,
    modules: &'static str,
    script: &Path,
    words: &[&str],
) -> (bool, [String; 2]) {
    let idle = || IDLE.lock().unwrap_or_else(PoisonError::into_inner);
    let taken = idle().entry(modules).or_default().pop();
    let mut warm = taken.unwrap_or_else(|| Warm::start(python, modules));
    let code = warm.run(script, words);
    idle().entry(modules).or_default().push(warm);
    let written = ["stdout", "stderr"].map(|name| {
        let bytes = std::fs::read(script.with_file_name(name)).expect("what it printed");
        String::from_utf8_lossy(&bytes).into_owned()
    });
    (code == "0", written)
}

impl Warm {
    fn start(python: &Path, modules: &str) -> Self {
        let mut command = Command::new(python);
        command.args(["-c", include_str!("warm.py")]);
        command.args(modules.split(' '));
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut process = command
            .spawn()
            .unwrap_or_else(|e| panic!("{}: {e}", python.display()));
        let told = BufReader::new(process.stdout.take().expect("a pipe"));
        Warm { process, told }
    }

    /// The exit code of a script.
    fn run(&mut self, script: &Path, words: &[&str]) -> String {
        let input = self.process.stdin.as_mut().expect("a pipe");
        let line = [&[&*script.to_string_lossy()], words].concat().join("\t");
        writeln!(input, "{line}").expect("it waits for scripts");
        let mut line = String::new();
        self.told.read_line(&mut line).expect("an exit code");
        line.trim_end().to_owned()
    }
}
