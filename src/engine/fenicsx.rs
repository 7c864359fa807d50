//! FEniCSx: its job form, its command, its private cache, its version.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::job::{self, Files};
use super::process::find_in_path;
use super::within::Within;
use super::{Case, Launch, Settings, lock, version};
use faceoff_fem::scene::Expression;
use faceoff_form::codes::{CODES, Code};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::file;

/// The companion: the script that is run, and what it imports.
const SCRIPTS: [(&str, &str); 4] = [
    ("signorini.py", include_str!("../../fenicsx/signorini.py")),
    ("nitsche.py", include_str!("../../fenicsx/nitsche.py")),
    ("job.py", include_str!("../../fenicsx/job.py")),
    ("compat.py", include_str!("../../fenicsx/compat.py")),
];

/// A Python that has dolfinx.
pub(super) fn python(within: &Within) -> Option<PathBuf> {
    within.program(|| python_with("dolfinx"), "python3")
}

/// A Python that has a module: the one that the user names, Debian's, or the first in the path.
pub fn python_with(module: &str) -> Option<PathBuf> {
    let named = std::env::var_os("FACEOFF_PYTHON").map(PathBuf::from);
    let debian = Some(PathBuf::from("/usr/bin/python3"));
    let all = [named, debian, find_in_path("python3")].into_iter();
    all.flatten().find(|python| has_module(python, module))
}

/// Whether this Python can import the module.
pub(super) fn has_module(python: &Path, module: &str) -> bool {
    origin(python, module).is_some()
}

/// The folder of a module that this Python imports, if its files are in one.
pub(super) fn folder_of(python: &Path, module: &str) -> Option<PathBuf> {
    let origin = PathBuf::from(origin(python, module)?);
    let folder = origin.parent().filter(|_| origin.is_absolute())?;
    Some(folder.to_owned())
}

/// The file of each module that a Python was asked for, if it can import it.
type Found = BTreeMap<(PathBuf, String), Option<String>>;

fn found() -> MutexGuard<'static, Found> {
    static FOUND: Mutex<Found> = Mutex::new(BTreeMap::new());
    FOUND.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Lets every module be looked for again, after something was installed.
pub(super) fn forget() {
    found().clear();
}

/// The file of a module that this Python can import. Looks for it without loading it, and in the root folder, as Python takes modules
/// from the folder where it is started, which may be untrusted. The modules of all codes are looked for together and once, since each
/// answer starts a process.
fn origin(python: &Path, module: &str) -> Option<String> {
    let asked = (python.to_owned(), module.to_owned());
    if let Some(known) = found().get(&asked) {
        return known.clone();
    }
    let mut names: Vec<&str> = CODES.iter().filter_map(Code::module).collect();
    names.extend(["slepc4py", module]);
    let question = "import sys, importlib.util as of\nfor name in sys.argv[1:]: print(getattr(of.find_spec(name), 'origin', ''))";
    let output = Command::new(python)
        .args(["-c", question])
        .args(&names)
        .current_dir("/")
        .stdin(std::process::Stdio::null())
        .output();
    let output = output.ok().filter(|output| output.status.success())?;
    let told = String::from_utf8(output.stdout).ok()?;
    // What a Python says at its start comes before.
    let origins = told.lines().rev();
    let mut found = found();
    for (name, origin) in names.iter().rev().zip(origins) {
        let origin = Some(origin.to_owned()).filter(|origin| !origin.is_empty());
        found.insert((python.to_owned(), (*name).to_owned()), origin);
    }
    found.get(&asked)?.clone()
}

fn missing() -> Error {
    Error::engine(
        "fenicsx",
        "no Python here has dolfinx",
        "run `faceoff engines install`, or on Debian `apt-get install python3-dolfinx`, or name a Python that has it in FACEOFF_PYTHON",
    )
}

/// The digest of the script that is run and of the modules that it imports.
pub(super) fn digest(scripts: Option<&Path>) -> Result<String> {
    super::digest_of(&SCRIPTS, scripts)
}

/// Runs the companion in the job folder.
pub(super) fn command(
    folder: &Path,
    scripts: Option<&Path>,
    launch: &Launch,
    within: &Within,
) -> Result<Command> {
    let home = match scripts {
        Some(scripts) if within.is_here() => {
            std::path::absolute(scripts).map_err(Error::io(scripts, "find"))?
        }
        // Another system sees only the job folder.
        _ => {
            let home = folder.join("engine");
            fs::create_dir_all(&home).map_err(Error::io(&home, "make"))?;
            super::put_scripts(&SCRIPTS, scripts, &home)?;
            home
        }
    };
    let python = python(within).ok_or_else(missing)?;
    let script = home.join(SCRIPTS[0].0);
    // The files that MPI puts there would outlive a killed process.
    let temporary = folder.join("tmp");
    fs::create_dir_all(&temporary).map_err(Error::io(&temporary, "make"))?;
    let mut command = match launch {
        Launch::Alone => {
            let mut command = Command::new(python);
            command.arg("-B").arg(script).env("TMPDIR", &temporary);
            as_single(&mut command);
            command
        }
        Launch::Ranks(ranks) => {
            let mpirun = within.program(|| find_in_path("mpirun"), "mpirun");
            let mut command = Command::new(mpirun.ok_or_else(no_mpirun)?);
            let ranks = ranks.to_string();
            command.args(["-n", &ranks]).env("TMPDIR", &temporary);
            distribute(&mut command, &python, &script, &ranks);
            // A rank that waits would otherwise spin, and take the core from one that works or compiles: the ranks are
            // not the only processes, as other engines run at the same time.
            set(&mut command, "OMPI_MCA_mpi_yield_when_idle", "1");
            command
        }
        Launch::By(words) => {
            let mut command = Command::new(&words[0]);
            command.args(&words[1..]);
            distribute(&mut command, &python, &script, "several");
            command
        }
    };
    command
        .env("LC_ALL", "C.UTF-8")
        // Without it every process compiles every form again.
        .env("PYTHONHASHSEED", "0")
        .env("OMP_NUM_THREADS", "1")
        .env("OPENBLAS_NUM_THREADS", "1")
        .env(
            "XDG_CACHE_HOME",
            match within.is_here() {
                true => cache(folder),
                false => folder.join("cache"),
            },
        );
    if std::env::var_os("HOME").is_none() {
        // dolfinx requires it even if it does not need it.
        command.env("HOME", folder);
    }
    // The time in seconds that another process may take to compile the same form; dolfinx's default of ten fails on a busy machine.
    for name in ["dolfinx_jit_parameters.json", "dolfinx_jit_options.json"] {
        let path = folder.join(name);
        fs::write(&path, "{\"timeout\": 60}\n").map_err(Error::io(&path, "write"))?;
    }
    Ok(within.enclose(command, folder))
}

/// Sets a variable that the user has not set.
fn set(command: &mut Command, name: &str, value: &str) {
    if std::env::var_os(name).is_none() {
        command.env(name, value);
    }
}

/// Lets Open MPI start a single process as one: otherwise it starts a daemon and looks for networks as well, which takes as long as
/// importing dolfinx. All processes that start so would share a folder, which one may remove as another enters it; they need none.
pub(super) fn as_single(command: &mut Command) {
    set(command, "OMPI_MCA_ess_singleton_isolated", "1");
    set(command, SESSION_FOLDERS, "0");
    set(command, "OMPI_MCA_pml", "ob1");
}

/// Whether Open MPI makes folders for its processes.
const SESSION_FOLDERS: &str = "OMPI_MCA_orte_create_session_dirs";

/// The command for a launcher of MPI processes, and the variables that let Open MPI run it.
fn distribute(command: &mut Command, python: &Path, script: &Path, ranks: &str) {
    command
        .arg(python)
        // With mpi4py's own main an exception on one rank ends all; without it the others wait.
        .args(["-B", "-m", "mpi4py"])
        .arg(script)
        .args(["--ranks", ranks])
        // mpirun starts nothing without them.
        .env(SESSION_FOLDERS, "1");
    // Open MPI refuses to start for root, and more processes than cores, and it binds those of
    // different jobs to the same cores. The first names are of version 4, the last of 5.
    for (name, value) in [
        ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
        ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
        ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
        ("OMPI_MCA_hwloc_base_binding_policy", "none"),
        ("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe"),
        ("PRTE_MCA_hwloc_default_binding_policy", "none"),
    ] {
        set(command, name, value);
    }
}

fn no_mpirun() -> Error {
    Error::engine(
        "fenicsx",
        "there is no mpirun to start several ranks",
        "on Debian `apt-get install openmpi-bin`, or name what starts them in --launcher",
    )
}

/// Imports dolfinx in a separate process.
pub(super) fn probe(within: &Within) -> Result<String> {
    let python = python(within).ok_or_else(missing)?;
    let folder = file::Temporary::new()?;
    let question = "import dolfinx, dolfinx.fem.petsc; print('version', dolfinx.__version__)";
    let mut command = Command::new(python);
    command.args(["-c", question]);
    as_single(&mut command);
    let command = within.enclose(command, folder.path());
    let told = version::told("fenicsx", &command, folder.path(), 120)?;
    let what = "dolfinx does not report its version";
    let version = told.ok_or_else(|| Error::engine("fenicsx", what, "reinstall it"))?;
    version::accept("fenicsx", &version)?;
    Ok(version)
}

/// Sandboxed programs have a separate cache, in this subfolder of the other: no other program loads its files.
pub(super) const OF_SANDBOXES: &str = "sandbox";

/// Where FFCx keeps forms in a cache.
const FORMS: [&str; 2] = ["fenics", "sandbox/fenics"];

/// The cache of compiled forms of this process.
static CACHE: Mutex<Cache> = Mutex::new(Cache::Unknown);

enum Cache {
    /// It has not been used yet.
    Unknown,
    /// Shared by all runs, for as long as this process lives.
    Shared(PathBuf, File),
    /// Where there is no place for one, or it was found to be broken: each job folder has its own.
    OfJob,
}

/// A private cache of compiled forms, shared by all runs. A compilation that was killed leaves a
/// source file behind for which every later process waits forever; so a run that is the only
/// one removes such files first. If there is no place for a cache, the job folder is used.
pub(super) fn cache(folder: &Path) -> PathBuf {
    let mut held = lock(&CACHE);
    if matches!(*held, Cache::Unknown) {
        *held = share().map_or(Cache::OfJob, |(path, lock)| Cache::Shared(path, lock));
    }
    match &*held {
        Cache::Shared(path, _) => path.clone(),
        _ => folder.join("cache"),
    }
}

fn share() -> Option<(PathBuf, File)> {
    let path = std::path::absolute(super::own_folder("XDG_CACHE_HOME", ".cache")?).ok()?;
    fs::create_dir_all(&path).ok()?;
    let lock = File::create(path.join("lock")).ok()?;
    if lock.try_lock().is_ok() {
        for forms in FORMS {
            remove_unfinished(&path.join(forms));
        }
        lock.unlock().ok()?;
    }
    lock.lock_shared().ok()?;
    // A read-only cache is useless.
    tempfile::tempfile_in(&path).ok()?;
    Some((path, lock))
}

/// After a failure: if the output in `folder` attributes it to the shared cache, or the process crashed, which a
/// broken library does, that cache is given up, for good if nobody else uses it. Then another try has a chance.
pub(super) fn give_up_cache(folder: &Path, failure: &Error) -> bool {
    let mut held = lock(&CACHE);
    let Cache::Shared(path, lock) = &*held else {
        return false;
    };
    let forms = FORMS.map(|forms| path.join(forms));
    let log = file::read_beneath(folder, "log.txt", 64 << 20).unwrap_or_default();
    let told = format!("{} {failure}", String::from_utf8_lossy(&log));
    let [ours, of_sandboxes] = forms.each_ref().map(|forms| forms.to_string_lossy());
    // As the system, mpirun and PETSc report a crash.
    let signs = [
        "SIGSEGV",
        "SIGBUS",
        "Segmentation",
        "Bus error",
        "Caught signal",
        &ours,
        &of_sandboxes,
    ];
    if !signs.iter().any(|sign| told.contains(sign)) {
        return false;
    }
    tracing::warn!(cache = %path.display(), "broken, and given up");
    let removed = || {
        let is_gone = |forms: &PathBuf| fs::remove_dir_all(forms).is_ok() || !forms.exists();
        forms.iter().all(is_gone)
    };
    let mended = lock.try_lock().is_ok() && removed() && lock.lock_shared().is_ok();
    if !mended {
        *held = Cache::OfJob;
    }
    true
}

/// Removes all files of forms that were not compiled to the end: FFCx waits until there is `FORM.c.cached`, and then
/// takes it for granted that there is a library.
fn remove_unfinished(forms: &Path) {
    let Ok(entries) = fs::read_dir(forms) else {
        return;
    };
    let mut files: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for path in entries.flatten().map(|entry| entry.path()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let stem = name.split('.').next().unwrap_or_default().to_owned();
        files.entry(stem).or_default().push(path);
    }
    for of_form in files.values() {
        let has = |suffix: &str, least: u64| {
            let mut found = of_form
                .iter()
                .filter(|p| p.to_string_lossy().ends_with(suffix));
            found.any(|p| fs::metadata(p).is_ok_and(|of| of.len() >= least))
        };
        if !(has(".c", 0) && has(".c.cached", 0) && has(".so", 1)) {
            for path in of_form {
                // A file that cannot be removed costs time later, and causes a message then.
                let _ = fs::remove_file(path);
            }
        }
    }
}

/// Writes job.json, and the mesh and γ of each case as raw little-endian arrays.
pub(super) fn write_job(
    engine: &str,
    folder: &Path,
    cases: &[&Case],
    settings: &Settings,
    syntax: impl Fn(&Expression) -> String,
) -> Result<()> {
    job::write(engine, folder, cases, settings, syntax, |case, id| {
        let problem = &case.problem;
        let mesh = problem.space.mesh;
        let write = |name: &str, bytes: Vec<u8>| -> Result<String> {
            let path = folder.join(id).join(name);
            fs::write(&path, bytes).map_err(Error::io(&path, "write"))?;
            Ok(format!("{id}/{name}"))
        };
        let integers = |values: &mut dyn Iterator<Item = i64>| -> Vec<u8> {
            values.flat_map(i64::to_le_bytes).collect()
        };
        let reals = |values: &mut dyn Iterator<Item = f64>| -> Vec<u8> {
            values.flat_map(f64::to_le_bytes).collect()
        };
        let boundary: Vec<_> = problem
            .parts
            .iter()
            .enumerate()
            .filter_map(|(face, part)| part.map(|part| (face, part as i64)))
            .collect();
        let gamma = job::gamma_by_cell(problem)?;
        let ids = |vertices: &[u32]| -> Vec<i64> { vertices.iter().map(|&v| v.into()).collect() };
        Ok(Files {
            mesh: serde_json::json!({
                "points": write("points.f64", reals(
                    &mut mesh.points.iter().flat_map(|p| p[..mesh.dim].to_vec()),
                ))?,
                "cells": write("cells.i64", integers(
                    &mut (0..mesh.cell_count()).flat_map(|c| ids(mesh.cell(c))),
                ))?,
                "boundary": write("boundary.i64", integers(
                    &mut boundary.iter().flat_map(|(face, _)| ids(mesh.face(*face))),
                ))?,
                "labels": write("labels.i64", integers(&mut boundary.iter().map(|b| b.1)))?,
            }),
            gamma: serde_json::json!({
                "cells": write("gamma_cells.i64", integers(&mut gamma.keys().map(|&c| c as i64)))?,
                "values": write("gamma.f64", reals(&mut gamma.values().copied()))?,
            }),
        })
    })
}
