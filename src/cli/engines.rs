//! `faceoff engines`: what is here, and what brings the rest.

use serde::Serialize;

use super::args::{Engines, EnginesAction, Running};
use super::{DONE, FAILED};
use crate::engine::{self, Engine, Installation};
use crate::error::{Error, Result};
use crate::report;

#[derive(Serialize)]
struct EngineState {
    engine: String,
    version: Option<String>,
    problem: Option<String>,
}

/// Everything that `engines install` knows how to bring.
const ALL: [&str; 3] = ["freefem", "fenicsx", "meshio"];

pub(super) fn run(arguments: &Engines) -> Result<u8> {
    let quiet = arguments.output.quiet;
    if matches!(arguments.action, Some(EnginesAction::Install)) {
        install(&ALL, quiet)?;
    }
    let mut states = Vec::new();
    for name in engine::NAMES {
        let probed = engine::find(name)?.probe();
        states.push(EngineState {
            engine: name.to_owned(),
            problem: probed.as_ref().err().map(ToString::to_string),
            version: probed.ok(),
        });
    }
    let plan = engine::plan(&ALL);
    let missing = states.iter().any(|s| s.problem.is_some());
    report::write_json(arguments.output.json.as_deref(), &states)?;
    if !quiet && !report::is_stdout(arguments.output.json.as_deref()) {
        for state in &states {
            match (&state.version, &state.problem) {
                (Some(version), _) => println!("{:<8} {version}", state.engine),
                (None, problem) => {
                    println!(
                        "{:<8} missing: {}",
                        state.engine,
                        problem.as_deref().unwrap_or("")
                    );
                }
            }
        }
        match engine::meshio_python() {
            Some(python) => println!("{:<8} {}", "meshio", python.display()),
            None => println!(
                "{:<8} missing: formats beyond MSH, VTU, FreeFEM and Medit",
                "meshio"
            ),
        }
        if !plan.is_empty() {
            println!("\n`faceoff engines install` would type:");
            for line in plan.iter().flat_map(Installation::typed) {
                println!("  {line}");
            }
        }
    }
    Ok(if missing { FAILED } else { DONE })
}

/// Brings what the named engines lack, saying each command.
pub(super) fn install(names: &[&str], quiet: bool) -> Result<()> {
    engine::install(&engine::plan(names), |line| {
        if !quiet {
            eprintln!("{line}");
        }
    })
}

/// The engines of these names, each once, all of them there.
///
/// # Errors
/// A name twice or unknown; an engine that is missing, with the command that brings it.
pub(super) fn find_all(
    names: &[String],
    running: &Running,
    quiet: bool,
) -> Result<Vec<Box<dyn Engine>>> {
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    if running.install {
        install(&names, quiet)?;
    }
    let mut found: Vec<Box<dyn Engine>> = Vec::new();
    for name in names {
        let engine = engine::find(name)?;
        if found.iter().any(|other| other.name() == engine.name()) {
            return Err(Error::usage(
                format!("engine `{}` is named twice", engine.name()),
                "name each once",
            ));
        }
        if !engine.is_installed() {
            // The probe knows what is missing and the command that brings it.
            engine.probe()?;
        }
        found.push(engine);
    }
    Ok(found)
}
