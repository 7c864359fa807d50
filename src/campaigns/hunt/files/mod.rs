//! Random meshes in files: each library writes them, every library reads them, and what was drawn decides.

mod drawn;

use std::collections::BTreeMap;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};

use super::trial::{Kind, Suspect, plain};
use super::{Finding, HuntOutcome, HuntRequest, OR, numbers, smaller};
use crate::engine::{OWN, python_with};
use drawn::{Drawn, FORMATS, Format};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::file::Temporary;
use faceoff_mesh::io::{self, Options, msh};
use faceoff_mesh::process::{self, Failure};

/// The libraries that write and read files.
pub const LIBRARIES: [&str; 4] = [OWN, "meshio", "vtk", "gmsh"];
const SCRIPT: &str = include_str!("libraries.py");
/// Tasks of one process at most, by which its time is limited.
const TASKS: u32 = 16;

/// What came of a task.
#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Came {
    Done(Option<Drawn>),
    /// With a message, which is as it should be.
    Refused(IgnoredAny),
    Crash(String),
    Hang(String),
}

#[derive(Debug, Clone, Serialize)]
struct Task {
    library: String,
    does: &'static str,
    path: PathBuf,
    format: &'static str,
}

/// Refuses libraries that are not installed: what they do not write and read would pass.
///
/// # Errors
/// A library that no Python here has.
pub fn installed(libraries: &[String]) -> Result<()> {
    for library in libraries.iter().filter(|of| *of != OWN) {
        if python_with(library).is_none() {
            return Err(Error::usage(
                format!("no Python here has {library}"),
                format!(
                    "install it with `pip install {library}`, name a Python that has it in FACEOFF_PYTHON, or leave it out of --engines"
                ),
            ));
        }
    }
    Ok(())
}

/// The problem of this number: one mesh in one format; returns the number of meshes so far.
pub fn problem(request: &HuntRequest, number: usize, outcome: &mut HuntOutcome) -> Result<usize> {
    let mut random = numbers(request.seed, number);
    let format = &FORMATS[random.below(FORMATS.len())];
    let drawn = Drawn::new(&mut random, format);
    let suspects = match trial(&drawn, format, &request.engines, request.patience)? {
        Some(suspects) => suspects,
        None => {
            outcome.refused += 1;
            return Ok(number + 1);
        }
    };
    if suspects.is_empty() {
        outcome.agree += 1;
    }
    for suspect in suspects {
        keep(request, (&drawn, format, number), &suspect, outcome)?;
    }
    Ok(number + 1)
}

/// Makes a case smaller, and keeps it if its cause is new.
fn keep(
    request: &HuntRequest,
    (drawn, format, number): (&Drawn, &'static Format, usize),
    suspect: &Suspect,
    outcome: &mut HuntOutcome,
) -> Result<()> {
    let is =
        |of: &Finding, by: &Suspect| of.code == by.code && Some(&of.cause) == by.cause.as_ref();
    if let Some(known) = outcome.findings.iter_mut().find(|of| is(of, suspect)) {
        known.times += 1;
        return Ok(());
    }
    let same = |of: &Suspect| of.code == suspect.code && of.cause == suspect.cause;
    let wrong = |drawn: &Drawn| {
        let found = trial(drawn, format, &request.engines, request.patience)?;
        Ok(found.unwrap_or_default().into_iter().find(same))
    };
    let (smallest, last, tried) = smaller(drawn, suspect, Drawn::simpler, &wrong)?;
    let form = serde_json::to_string(&smallest)
        .map_err(|e| Error::usage(format!("the mesh cannot be JSON: {e}"), "report this"))?;
    outcome.findings.push(Finding {
        code: last.code,
        kind: last.kind,
        cause: last.cause.unwrap_or_default(),
        words: last.words,
        form,
        file: "case.json".to_owned(),
        grid: None,
        mesh: smallest.words(),
        first: number + 1,
        form_number: number + 1,
        times: 1,
        tried,
    });
    Ok(())
}

/// What is wrong with the files of this mesh; `None` if no reader has read one.
fn trial(
    drawn: &Drawn,
    format: &'static Format,
    libraries: &[String],
    patience: Duration,
) -> Result<Option<Vec<Suspect>>> {
    let folder = Temporary::new()?;
    let known = |of: &&String| format.libraries.contains(&of.as_str());
    let libraries: Vec<&String> = libraries.iter().filter(known).collect();
    let task = |library: &str, does, by: &str| Task {
        library: library.to_owned(),
        does,
        path: folder.path().join(by).with_extension(format.suffix),
        format: if library == "meshio" {
            format.meshio
        } else {
            format.name
        },
    };
    let writes: Vec<Task> = libraries.iter().map(|of| task(of, "write", of)).collect();
    let written = run(drawn, format, &writes, patience)?;
    let mut suspects = Vec::new();
    let mut add = |code: &str, kind, role: &str, what: &str, words: String| {
        let suspect = Suspect {
            code: code.to_owned(),
            kind,
            cause: Some(format!("{}, {role}: {what}", format.name)),
            words,
        };
        suspects.push(suspect);
    };
    let mut reads = Vec::new();
    for (task_of, came) in writes.iter().zip(&written) {
        let writer = &task_of.library;
        match came {
            Came::Done(_) => reads.extend(libraries.iter().map(|of| task(of, "read", writer))),
            Came::Refused(_) => {}
            Came::Crash(why) => {
                let words = format!("{writer} fails where it writes {}: {why}", format.name);
                add(writer, Kind::Crashes, "writing", &plain(why), words);
            }
            Came::Hang(why) => {
                let words = format!("{writer} hangs where it writes {}: {why}", format.name);
                add(writer, Kind::Hangs, "writing", "hangs", words);
            }
        }
    }
    let read = run(drawn, format, &reads, patience)?;
    let mut has_read = false;
    for writer in &libraries {
        let path = task(writer, "read", writer).path;
        let mut right: Vec<&str> = Vec::new();
        let mut wrong: Vec<(&str, Kind, String)> = Vec::new();
        for (task, came) in reads
            .iter()
            .zip(&read)
            .filter(|(task, _)| task.path == path)
        {
            let reader = task.library.as_str();
            let sees = [reader != "gmsh", reader != "vtk"];
            match came {
                Came::Done(Some(read)) => match drawn.change(read, format, sees) {
                    None => right.push(reader),
                    Some(change) => wrong.push((reader, Kind::Wrong, change)),
                },
                Came::Crash(why) => wrong.push((reader, Kind::Crashes, plain(why))),
                Came::Hang(_) => wrong.push((reader, Kind::Hangs, "hangs".to_owned())),
                Came::Done(None) => {
                    let what = "cells of a type that was not drawn".to_owned();
                    wrong.push((reader, Kind::Wrong, what));
                }
                Came::Refused(_) => {}
            }
        }
        has_read |= !right.is_empty() || !wrong.is_empty();
        let others = wrong.iter().filter(|(reader, ..)| reader != writer).count();
        let is_by_itself = right.iter().all(|reader| reader == writer);
        for (reader, kind, what) in &wrong {
            let tale = format!(
                "in {} that {writer} wrote and {reader} read: {what}",
                format.name
            );
            let tale = format!(
                "{tale}; {}",
                match right.is_empty() {
                    true => "no library reads what was drawn".to_owned(),
                    false => format!("{} read what was drawn", right.join(" and ")),
                }
            );
            if !is_by_itself {
                add(reader, *kind, "reading", what, tale);
            } else if others > 1 || right.is_empty() && others < wrong.len() {
                // The writer does not read its own file as drawn, or several others differ from it.
                add(writer, *kind, "writing", what, tale);
            } else {
                let tale = format!("{tale}; no third library decides");
                let code = format!("{writer}{OR}{reader}");
                add(&code, *kind, "writing or reading", what, tale);
            }
        }
    }
    suspects.sort_by(|a, b| (&a.code, &a.cause).cmp(&(&b.code, &b.cause)));
    suspects.dedup_by(|a, b| a.code == b.code && a.cause == b.cause);
    // A writer that crashes is a finding without a reader.
    Ok((has_read || !suspects.is_empty()).then_some(suspects))
}

/// What comes of each task: ours here, the others in the Python that has the library.
fn run(drawn: &Drawn, format: &Format, tasks: &[Task], patience: Duration) -> Result<Vec<Came>> {
    let mut came = vec![Came::Refused(IgnoredAny); tasks.len()];
    let mut of_python: BTreeMap<PathBuf, Vec<usize>> = BTreeMap::new();
    for (k, task) in tasks.iter().enumerate() {
        if task.library == OWN {
            came[k] = own(drawn, format, task)?;
        } else if let Some(python) = python_with(&task.library) {
            of_python.entry(python).or_default().push(k);
        }
    }
    for (python, chosen) in of_python {
        let tasks: Vec<&Task> = chosen.iter().map(|&k| &tasks[k]).collect();
        for (k, of) in chosen.iter().zip(script(drawn, &python, &tasks, patience)?) {
            came[*k] = of;
        }
    }
    Ok(came)
}

/// Our own library; a panic is caught as a crash.
fn own(drawn: &Drawn, format: &Format, task: &Task) -> Result<Came> {
    let does = || -> Result<Option<Drawn>> {
        if task.does == "read" {
            return Ok(Drawn::of(&io::read(&task.path)?));
        }
        let unknown = || Error::usage("a type of cells is unknown", "draw others");
        let mesh = drawn.mesh().ok_or_else(unknown)?;
        let options = Options {
            format: io::Format::of_name(format.native),
            msh_version: match format.name {
                "msh41" => msh::Version::V41,
                _ => msh::Version::V22,
            },
            ..Options::default()
        };
        io::write(&task.path, &mesh, &options)?;
        Ok(None)
    };
    Ok(match catch_unwind(does) {
        Err(_) => Came::Crash("a panic".to_owned()),
        Ok(Ok(of)) => Came::Done(of),
        Ok(Err(error @ Error::Ended(_))) => return Err(error),
        Ok(Err(_)) => Came::Refused(IgnoredAny),
    })
}

/// Runs tasks in a Python.
fn script(drawn: &Drawn, python: &Path, tasks: &[&Task], patience: Duration) -> Result<Vec<Came>> {
    let folder = Temporary::new()?;
    let [job, out] = ["job.json", "out.json"].map(|name| folder.path().join(name));
    let asked = serde_json::json!({"case": drawn, "tasks": tasks, "limit": patience.as_secs_f64()});
    io::save(&job, [asked.to_string().as_bytes()])?;
    let mut command = Command::new(python);
    command.args(["-I", "-c", SCRIPT]).args([&job, &out]);
    let limit = patience * TASKS + Duration::from_secs(60);
    process::run(&command, folder.path(), limit, |_| {}).map_err(|failure| match failure {
        Failure::Ours(error) => error,
        other => Error::engine(
            "hunt --files",
            other.to_string(),
            "check that this Python runs, or leave the library out of --engines",
        ),
    })?;
    let text = std::fs::read_to_string(&out).map_err(Error::io(&out, "read"))?;
    let unread = |e: serde_json::Error| Error::whole(&out, e.to_string(), "report this");
    serde_json::from_str(&text).map_err(unread)
}
