//! What the tests share: running the program, and reading what it says.
#![allow(dead_code, reason = "each test file uses its own part")]

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Output, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde_json::Value;

pub mod warm;

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

/// Runs a line of shell on a terminal. Where no terminals are mounted, as in a bare chroot, they are, for this line alone.
pub fn on_terminal(at: &Path, line: &str, no_color: &str) -> Ran {
    let mut command = Command::new("sh");
    command.current_dir(at).env("TERM", "xterm");
    command.env("NO_COLOR", no_color);
    let mounted = "[ -e /dev/pts/ptmx ] && exec \"$@\"
        exec unshare --mount --propagation unchanged sh -c '
            mount --make-private /dev 2>/dev/null
            mount -t devpts devpts /dev/pts && exec \"$@\"' sh \"$@\"";
    command.args(["-c", mounted, "sh", "script", "-qec", line, "/dev/null"]);
    told(command.output().unwrap())
}

impl Ran {
    /// The JSON on standard output.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|e| panic!("no JSON ({e}): {}\n{}", self.stdout, self.stderr))
    }
}

/// Waits for what must come, however busy the machine is.
pub fn until(condition: impl Fn() -> bool, what: &str) {
    let patience = Instant::now() + Duration::from_secs(900);
    while !condition() {
        assert!(Instant::now() < patience, "waited in vain until {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Waits until a run catches SIGINT, and sends it.
pub fn interrupt(child: &Child) {
    let status = format!("/proc/{}/status", child.id());
    let listens = || {
        let status = std::fs::read_to_string(&status).unwrap_or_default();
        let mut caught = status.lines().filter_map(|l| l.strip_prefix("SigCgt:"));
        let mask = caught.next().unwrap_or("0").trim();
        u64::from_str_radix(mask, 16).expect("a mask") & 0b10 != 0
    };
    until(listens, "it catches SIGINT");
    let pid = child.id().to_string();
    let sent = Command::new("kill").args(["-INT", &pid]).status();
    assert!(sent.expect("kill is there").success());
}

/// Holds a file against a schema of the repository.
pub fn assert_valid(kind: &str, schema: &str, file: &Path) {
    let wrong = validated(kind, schema, file);
    assert_eq!(wrong, "", "{}", file.display());
}

/// What the validator says is wrong in a file: nothing, or the kind of error and why.
pub fn validated(kind: &str, schema: &str, file: &Path) -> String {
    static VALIDATOR: Mutex<Option<(Child, BufReader<ChildStdout>)>> = Mutex::new(None);
    let mut held = VALIDATOR.lock().unwrap_or_else(PoisonError::into_inner);
    let (process, told) = held.get_or_insert_with(|| {
        let mut process = Command::new(source("target/python/bin/python3"))
            .arg(source("tests/schemas.py"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("a Python with jsonschema and lxml: use tests/run");
        let told = BufReader::new(process.stdout.take().expect("a pipe"));
        (process, told)
    });
    let (schema, file) = (source(schema), file.display());
    let input = process.stdin.as_mut().expect("a pipe");
    writeln!(input, "{kind}\t{}\t{file}", schema.display()).expect("it waits for files");
    let mut line = String::new();
    let length = told.read_line(&mut line).expect("an answer");
    assert!(length > 0, "the validator ended at {file}");
    line.trim_end().to_owned()
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

/// Runs a script with dolfinx in `folder`, which it writes results to.
pub fn dolfinx(folder: &Path, script: &str, words: &[&str]) {
    run_dolfinx(&write(folder, "write.py", script), words);
}

/// Runs a script of dolfinx in its folder.
pub fn run_dolfinx(script: &Path, words: &[&str]) {
    let modules = warm::modules("dolfinx").expect("it has some");
    let ran = warm::run(Path::new("/usr/bin/python3"), modules, script, words);
    assert!(ran.0, "{}: {}", script.display(), ran.1.concat());
}

/// The built-in scene `name` with `from` replaced by `to`, as a file in `folder`.
pub fn scene(folder: &Path, name: &str, from: &str, to: &str) -> String {
    let text =
        std::fs::read_to_string(source(&format!("crates/fem/src/scene/builtin/{name}.toml")))
            .expect("a built-in scene");
    assert!(text.contains(from), "{name} does not have `{from}`");
    // What is known of u is not known of a changed scene.
    let plain = text.split("[exact]").next().unwrap_or(&text);
    write(folder, "scene.toml", &plain.replace(from, to));
    "scene.toml".into()
}

/// An engine file for a copy of a companion in which `from`, which must occur once, is `to`.
pub fn changed_companion(folder: &Path, companion: &str, from: &str, to: &str) -> String {
    companion_with(folder, companion, &[(from, to)])
}

/// The same with several changes.
pub fn companion_with(folder: &Path, companion: &str, changes: &[(&str, &str)]) -> String {
    let home = match companion {
        "freefem" => source("freefem"),
        _ => source("fenicsx"),
    };
    let copy = folder.join("copy");
    std::fs::create_dir_all(&copy).expect("a folder");
    let mut places = vec![0; changes.len()];
    for entry in std::fs::read_dir(home).expect("the companion") {
        let path = entry.expect("an entry").path();
        // The programs of the paper stand alone.
        let is_paper = path
            .file_stem()
            .is_some_and(|stem| stem.to_string_lossy().starts_with("paper"));
        if path.is_file() && !is_paper {
            let mut text = std::fs::read_to_string(&path).expect("a script");
            for (count, (from, to)) in places.iter_mut().zip(changes) {
                *count += text.matches(from).count();
                text = text.replace(from, to);
            }
            let name = path.file_name().expect("a file has a name");
            std::fs::write(copy.join(name), text).expect("a copy");
        }
    }
    for (count, (from, _)) in places.iter().zip(changes) {
        assert_eq!(*count, 1, "`{from}` in the {companion} companion");
    }
    write(
        folder,
        "changed.toml",
        &format!("name = \"changed\"\ncompanion = \"{companion}\"\nscripts = \"copy\"\n"),
    );
    "changed.toml".into()
}

/// Random tests see the same values on every day and machine; `FACEOFF_SEED` asks for others (see tests/run).
pub fn test_config(cases: u32) -> proptest::test_runner::Config {
    let seed = std::env::var("FACEOFF_SEED").map_or(2017, |seed| {
        seed.parse().expect("FACEOFF_SEED is a whole number")
    });
    proptest::test_runner::Config {
        cases,
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(seed),
        ..proptest::test_runner::Config::default()
    }
}

/// Whether this is one of the cases that have their turn in every run; with `tests/run --all` every case has.
pub fn is_in_turn(k: usize, of: usize) -> bool {
    times() > 1 || k.is_multiple_of(of)
}

/// The cases of a list that have their turn where the first of them is the k-th.
pub fn in_turn<T>(
    k: usize,
    of: usize,
    all: impl IntoIterator<Item = T>,
) -> impl Iterator<Item = T> {
    let numbered = (k..).zip(all);
    numbered.filter_map(move |(k, case)| is_in_turn(k, of).then_some(case))
}

/// How many times as many random cases as usual `FACEOFF_SCENES` asks for, as `tests/run --all` does.
pub fn times() -> usize {
    std::env::var("FACEOFF_SCENES").map_or(1, |times| {
        times.parse().expect("FACEOFF_SCENES is a whole number")
    })
}
