//! FEniCSx: its job form, its command, its private cache, its version.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::time::Duration;

use super::freefem::find_in_path;
use super::job::{self, Files};
use super::{Case, Launch, Settings, process};
use crate::error::{Error, Result};
use crate::scene::Expression;

/// The companion: the script that is run, and what it imports.
const SCRIPTS: [(&str, &str); 3] = [
    ("signorini.py", include_str!("../../fenicsx/signorini.py")),
    ("job.py", include_str!("../../fenicsx/job.py")),
    ("compat.py", include_str!("../../fenicsx/compat.py")),
];

/// A Python that has dolfinx: the one the user names, Debian's, or the first in the path.
pub(super) fn python() -> Option<PathBuf> {
    let named = std::env::var_os("FACEOFF_PYTHON").map(PathBuf::from);
    let debian = Some(PathBuf::from("/usr/bin/python3"));
    [named, debian, find_in_path("python3")]
        .into_iter()
        .flatten()
        .find(|python| has_module(python, "dolfinx"))
}

/// Can this Python import the module? Looks for it without loading it.
pub(super) fn has_module(python: &Path, module: &str) -> bool {
    let question = format!(
        "import importlib.util, sys; sys.exit(importlib.util.find_spec('{module}') is None)"
    );
    Command::new(python)
        .args(["-c", &question])
        .stdin(std::process::Stdio::null())
        .output()
        .is_ok_and(|output| output.status.success())
}

fn missing() -> Error {
    Error::engine(
        "fenicsx",
        "no Python here has dolfinx",
        "run `faceoff engines install`, or on Debian `apt-get install python3-dolfinx`, or name a Python that has it in FACEOFF_PYTHON",
    )
}

/// Runs the companion in the job folder.
pub(super) fn command(folder: &Path, scripts: Option<&Path>, launch: &Launch) -> Result<Command> {
    let home = match scripts {
        Some(scripts) => std::path::absolute(scripts).map_err(Error::io(scripts, "find"))?,
        None => {
            let home = folder.join("engine");
            fs::create_dir_all(&home).map_err(Error::io(&home, "make"))?;
            for (name, text) in SCRIPTS {
                let path = home.join(name);
                fs::write(&path, text).map_err(Error::io(&path, "write"))?;
            }
            home
        }
    };
    let python = python().ok_or_else(missing)?;
    let script = home.join(SCRIPTS[0].0);
    let mut command = match launch {
        Launch::Alone => {
            let mut command = Command::new(python);
            command.arg("-B").arg(script);
            command
        }
        Launch::Ranks(ranks) => {
            let mut command = Command::new(find_in_path("mpirun").ok_or_else(no_mpirun)?);
            let ranks = ranks.to_string();
            command.args(["-n", &ranks]);
            distribute(&mut command, &python, &script, &ranks);
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
        .env("XDG_CACHE_HOME", cache(folder));
    Ok(command)
}

/// What a launcher of MPI processes is to run, and what lets Open MPI do so.
fn distribute(command: &mut Command, python: &Path, script: &Path, ranks: &str) {
    command
        .arg(python)
        // With mpi4py's own main an exception on one rank ends all; without it the others wait.
        .args(["-B", "-m", "mpi4py"])
        .arg(script)
        .args(["--ranks", ranks]);
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
        if std::env::var_os(name).is_none() {
            command.env(name, value);
        }
    }
}

fn no_mpirun() -> Error {
    Error::engine(
        "fenicsx",
        "there is no mpirun to start several ranks",
        "on Debian `apt-get install openmpi-bin`, or name what starts them in --launcher",
    )
}

/// Imports dolfinx in a process of its own.
pub(super) fn probe() -> Result<String> {
    let python = python().ok_or_else(missing)?;
    let folder = tempfile::tempdir().map_err(Error::io(&std::env::temp_dir(), "write to"))?;
    let mut version = None;
    let mut command = Command::new(python);
    command.args([
        "-c",
        "import dolfinx, dolfinx.fem.petsc; print('version', dolfinx.__version__)",
    ]);
    process::run(
        "fenicsx",
        command,
        folder.path(),
        Duration::from_secs(120),
        |line| {
            if let Some(told) = line.strip_prefix("version ") {
                version = Some(told.trim().to_owned());
            }
        },
    )?;
    version.ok_or_else(|| {
        Error::engine(
            "fenicsx",
            "dolfinx does not tell its version",
            "reinstall it",
        )
    })
}

/// The cache of compiled forms that this process shares, for as long as it lives.
static CACHE: Mutex<Option<(PathBuf, File)>> = Mutex::new(None);

/// A private cache of compiled forms, shared by all runs. A compilation that was killed leaves a
/// source file behind on which every later process waits in vain; so a run that finds itself
/// alone removes such files first. Where there is no place for a cache, the job folder serves.
fn cache(folder: &Path) -> PathBuf {
    let mut held = CACHE
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some((path, _)) = held.as_ref() {
        return path.clone();
    }
    let share = || -> Option<(PathBuf, File)> {
        let home = std::env::var_os("XDG_CACHE_HOME")
            .map(PathBuf::from)
            .or_else(|| std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".cache")))?;
        let path = home.join("faceoff");
        fs::create_dir_all(&path).ok()?;
        let lock = File::create(path.join("lock")).ok()?;
        if lock.try_lock().is_ok() {
            remove_orphans(&path.join("fenics"));
            lock.unlock().ok()?;
        }
        lock.lock_shared().ok()?;
        Some((path, lock))
    };
    match share() {
        Some((path, lock)) => held.insert((path, lock)).0.clone(),
        None => folder.join("cache"),
    }
}

/// Removes sources that were never compiled to the end.
fn remove_orphans(forms: &Path) {
    let Ok(entries) = fs::read_dir(forms) else {
        return;
    };
    let names: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    for source in names
        .iter()
        .filter(|p| p.extension().is_some_and(|e| e == "c"))
    {
        let stem = source.file_stem().unwrap_or_default().to_string_lossy();
        let compiled = names.iter().any(|p| {
            let name = p.file_name().unwrap_or_default().to_string_lossy();
            name.starts_with(&*stem) && name.ends_with(".so")
        });
        if !compiled {
            // What cannot be removed costs time later, and says so then.
            let _ = fs::remove_file(source);
        }
    }
}

/// Writes job.json, and the mesh and γ of each case as raw little-endian arrays.
pub(super) fn write_job(
    engine: &str,
    folder: &Path,
    cases: &[Case],
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
