//! Engines: the codes that solve the problem. Each gets the same cases and returns the dofs of
//! the same spaces; everything that is compared is derived from those dofs in one place.

mod bounds;
mod depends;
mod explain;
mod fenicsx;
mod file;
mod freefem;
mod install;
mod job;
mod left;
mod machine;
mod process;
mod program;
mod quoted;
mod rust;
mod sandbox;
mod script;
mod seccomp;
mod shown;
mod version;
mod within;
mod written;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde_json::{Value, json};

pub use explain::Explanation;
pub use fenicsx::python_with;
pub use file::{EngineFile, parsed};
pub use freefem::lacks_plugins;
pub use install::{Installation, install, meshio_python, plan};
pub use job::{binary, case_label, label, raw_values, to_dofs};
pub use left::{Back, Facets, Left, Written};
pub use machine::{HighWater, Machine, held_memory, peak_memory_mb};
pub use quoted::{quoted, typed};
pub use script::{Form, How, Script, Task, copy, fill};
pub use version::doubt;
pub use written::{Source, with};

use faceoff_fem::contact::{Built, Ended, Iteration, Method, Problem, Solution, Stop};
use faceoff_fem::linear::{self, Choice};
use faceoff_fem::scene::Scene;
use faceoff_mesh::error::{Error, Result, meant};

/// One problem for the engines.
pub struct Case<'a> {
    /// The refinement, if the scene has one.
    pub n: Option<usize>,
    /// The discrete problem that they must solve.
    pub problem: Problem<'a>,
}

impl<'a> Case<'a> {
    /// The scene that is solved.
    pub fn scene(&self) -> &'a Scene {
        self.problem.scene
    }
}

/// The settings that every engine must share.
#[derive(Debug, Clone)]
pub struct Settings {
    /// When an iteration ends.
    pub stop: Stop,
    /// For the Rust engine; the companions use Newton's method.
    pub iteration: Iteration,
    /// For the Rust engine; the companions have their own.
    pub linear: linear::Settings,
    /// For dolfinx, which can distribute the mesh.
    pub launch: Launch,
    /// The time limit of one process.
    pub time_limit: Duration,
    /// Whether other codes are run in a sandbox.
    pub sandbox: bool,
    /// Where job folders are kept; None: they are removed.
    pub keep: Option<PathBuf>,
}

/// Whether programs run in a sandbox, or not at all.
static NEEDS_SANDBOX: AtomicBool = AtomicBool::new(false);

/// From now on every program that solves something runs in a sandbox or not at all, for every command.
pub fn require_sandbox() {
    NEEDS_SANDBOX.store(true, Ordering::Relaxed);
}

fn needs_sandbox() -> bool {
    NEEDS_SANDBOX.load(Ordering::Relaxed)
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            stop: Stop::default(),
            iteration: Iteration::Newton,
            linear: linear::Settings::default(),
            launch: Launch::Alone,
            time_limit: Duration::from_secs(3600),
            sandbox: needs_sandbox(),
            keep: None,
        }
    }
}

/// How a code that can distribute the mesh is started.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Launch {
    /// As one process.
    #[default]
    Alone,
    /// As this number of processes, by `mpirun`.
    Ranks(usize),
    /// By a command like `srun -n 64`, which sets the number of processes; at least one word.
    By(Vec<String>),
}

/// An engine's answer to one case.
#[derive(Debug, Clone)]
pub struct Answer {
    /// u_h at all dofs of the case's space.
    pub u: Vec<f64>,
    /// The relative increment of each step.
    pub increments: Vec<f64>,
    /// Whether the engine reports that its iteration reached the tolerance.
    pub converged: bool,
    /// The step that u comes from; not the last one if the iteration did not converge and another was better.
    pub step: usize,
    /// Why it ended, and the changes and residuals of each step, for the Rust engine.
    pub history: Option<History>,
    /// Seconds by phase, as the engine reports them: read or mesh, assembly, factor, iterate, …
    pub seconds: Vec<(String, f64)>,
    /// How far u is from solving the scheme, recomputed here; see [`Problem::backward_error`].
    pub residual: f64,
}

impl Answer {
    /// The answer of the Rust engine.
    pub fn new(solution: Solution) -> Self {
        Answer {
            residual: solution.backward_error,
            u: solution.u,
            increments: solution.increments,
            converged: solution.converged,
            step: solution.step,
            history: Some(History {
                ended: solution.ended,
                changes: solution.changes,
                residuals: solution.residuals,
                linear: solution.linear,
                built: solution.built,
                on_the_way: solution.on_the_way,
            }),
            seconds: vec![
                ("factor".into(), solution.seconds.factor),
                ("iterate".into(), solution.seconds.iterate),
                ("expand".into(), solution.seconds.expand),
            ],
        }
    }
}

/// Data that the Rust engine reports about its iteration besides the increments.
#[derive(Debug, Clone)]
pub struct History {
    /// Why it ended.
    pub ended: Ended,
    /// See [`faceoff_fem::contact::Solution`].
    pub changes: Vec<usize>,
    /// See [`faceoff_fem::contact::Solution`].
    pub residuals: Vec<f64>,
    /// The solver of the linear systems.
    pub linear: Choice,
    /// The systems that were built for it.
    pub built: Built,
    /// Steps at other γ on the way to this one.
    pub on_the_way: usize,
}

/// An engine's answers to all cases.
#[derive(Debug, Clone)]
pub struct Run {
    /// As it reports it.
    pub version: String,
    /// In the order of the cases.
    pub answers: Vec<Answer>,
}

/// Is notified of the progress of a run; called from several threads.
pub trait Progress: Sync {
    /// `case` counts from 0; `increment` is the relative increment of this iteration.
    fn step(&self, engine: &str, case: usize, iteration: usize, increment: f64) {
        let _ = (engine, case, iteration, increment);
    }

    /// All cases of an engine are done.
    fn done(&self, engine: &str) {
        let _ = engine;
    }

    /// `share` of everything is done, and `what` comes next.
    fn next(&self, what: &str, share: f64) {
        let _ = (what, share);
    }
}

/// Nobody listens.
pub struct Silent;

impl Progress for Silent {}

/// A code that solves cases.
pub trait Engine: Sync {
    /// Its name on the command line and in reports.
    fn name(&self) -> &str;

    /// The version, found by running the code.
    ///
    /// # Errors
    /// A code that is not there or does not run, with the command that brings it.
    fn probe(&self) -> Result<String>;

    /// Whether the code is installed. Cheaper than [`Engine::probe`], and not a proof that it runs.
    fn is_installed(&self) -> bool;

    /// Whether it is the solver of this program, which reports more than the protocol and must always answer.
    fn is_own(&self) -> bool {
        false
    }

    /// Whether it can run as several processes with a partitioned mesh.
    fn distributes(&self) -> bool {
        false
    }

    /// The dependencies of its answers besides cases and settings: its program, and the version of it.
    ///
    /// # Errors
    /// The errors of [`Engine::probe`].
    fn identity(&self) -> Result<Value> {
        Ok(json!({ "version": self.probe()? }))
    }

    /// Whether the code refuses a job in a protocol that is not its own. Engines without one do not get such a job.
    ///
    /// # Errors
    /// A job that cannot be written, an interruption.
    fn refuses_other_protocols(&self, case: &Case, settings: &Settings) -> Result<bool> {
        let _ = (case, settings);
        Ok(true)
    }

    /// Whether the code has this method. All have the family (2.4).
    ///
    /// # Errors
    /// A method that it does not have.
    fn accepts(&self, method: &Method) -> Result<()> {
        accepts_family(self.name(), method)
    }

    /// Solves all cases in one go. An answer counts only with every value there and finite.
    ///
    /// # Errors
    /// A code that is missing, fails, exceeds its time, or answers something that does not count.
    fn run(&self, cases: &[&Case], settings: &Settings, progress: &dyn Progress) -> Result<Run>;
}

/// Refuses what is not of the family (2.4) for `engine`.
fn accepts_family(engine: &str, method: &Method) -> Result<()> {
    if method.is_nitsche() {
        return Ok(());
    }
    Err(Error::engine(
        engine,
        format!("it has Nitsche's method, the family (2.4) and cr-fc, and {method} is not of it"),
        "solve it with --engine rust, the only engine with the classical methods",
    ))
}

/// The value of a mutex, even if a thread that held it panicked.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Each once, in the order in which they come first.
pub fn unique<T: PartialEq>(all: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for one in all {
        if !found.contains(&one) {
            found.push(one);
        }
    }
    found
}

/// A short digest of bytes.
pub fn digest(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex()[..16].to_owned()
}

/// All pairs of numbers below `count`, each once.
pub fn pairs(count: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..count).flat_map(move |a| (a + 1..count).map(move |b| (a, b)))
}

/// The digest of a companion's scripts, by name and text, or of the copies in a folder.
fn digest_of(companion: &[(&str, &str)], scripts: Option<&Path>) -> Result<String> {
    let mut all = Vec::new();
    for (name, text) in companion {
        match scripts.map(|folder| folder.join(name)) {
            None => all.extend_from_slice(text.as_bytes()),
            Some(path) => all.extend(faceoff_mesh::file::read(&path)?),
        }
    }
    Ok(digest(&all))
}

/// Writes a companion's scripts, or the copies of them in a folder, into another.
fn put_scripts(companion: &[(&str, &str)], scripts: Option<&Path>, into: &Path) -> Result<()> {
    for (name, text) in companion {
        let path = into.join(name);
        match scripts {
            None => std::fs::write(&path, text).map_err(Error::io(&path, "write"))?,
            Some(scripts) => faceoff_mesh::file::copy_beneath(scripts, name, &path)?,
        }
    }
    Ok(())
}

/// The folder of this program in one that a variable names, or else in this one at home.
fn own_folder(variable: &str, at_home: &str) -> Option<PathBuf> {
    let named = std::env::var_os(variable).map(PathBuf::from);
    let home = || Some(PathBuf::from(std::env::var_os("HOME")?).join(at_home));
    Some(named.or_else(home)?.join("faceoff"))
}

/// The name of the solver of this program.
pub const OWN: &str = "rust";

/// The engines' names, in the order of comparison.
pub const NAMES: [&str; 3] = [OWN, "freefem", "fenicsx"];

/// The engine that a table of the file at `path` describes.
///
/// # Errors
/// A table that is not valid.
pub fn release(of: EngineFile, path: &Path) -> Result<Box<dyn Engine>> {
    Ok(Box::new(file::described(of, path)?))
}

/// Finds an engine by name, or by the path of a TOML file that describes one.
///
/// # Errors
/// A name that is neither, or a file that is not valid.
pub fn find(name: &str) -> Result<Box<dyn Engine>> {
    match name {
        OWN => Ok(Box::new(rust::Rust)),
        "freefem" => Ok(Box::new(program::Program::freefem())),
        "fenicsx" => Ok(Box::new(program::Program::fenicsx())),
        path if path.ends_with(".toml") => Ok(Box::new(file::read(path.as_ref())?)),
        _ => Err(Error::usage(
            format!("there is no engine `{name}`"),
            format!(
                "{}use {}, or a TOML file that describes one",
                meant(name, NAMES),
                NAMES.join(", ")
            ),
        )),
    }
}
