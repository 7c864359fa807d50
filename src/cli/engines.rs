//! `faceoff engines`: what is here, and what brings the rest.

use std::time::Duration;

use serde::Serialize;

use super::args::{Engines, EnginesAction, Output, Running};
use super::tell::{note, tell};
use super::{DISAGREE, DONE, FAILED};
use crate::engine::{self, Engine, Installation, Launch, Settings};
use crate::report;
use crate::verify::{Finding, check_count, conformance};
use faceoff_fem::contact::{Iteration, Stop};
use faceoff_fem::linear;
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Result, distinct};

#[derive(Serialize)]
struct EngineState {
    engine: String,
    version: Option<String>,
    /// What is to be said of a version that was not tested.
    doubt: Option<String>,
    problem: Option<String>,
}

/// Everything that `engines install` knows how to bring.
const ALL: [&str; 3] = ["freefem", "fenicsx", "meshio"];

pub(super) fn run(arguments: &Engines) -> Result<u8> {
    let quiet = arguments.output.quiet;
    match &arguments.action {
        None => {}
        Some(EnginesAction::Install) => install(&ALL, quiet)?,
        Some(EnginesAction::Check {
            engine,
            time_limit,
            output,
        }) => return check(engine, *time_limit, output),
    }
    let mut states = Vec::new();
    for name in engine::NAMES {
        let probed = engine::find(name)?.probe();
        let version = probed.as_ref().ok();
        states.push(EngineState {
            engine: name.to_owned(),
            doubt: version.and_then(|version| engine::doubt(name, version)),
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
                (Some(version), _) => {
                    tell!("{:<8} {version}", state.engine);
                    if let Some(doubt) = &state.doubt {
                        tell!("{:<8} {doubt}", "");
                    }
                }
                (None, problem) => {
                    tell!(
                        "{:<8} missing: {}",
                        state.engine,
                        problem.as_deref().unwrap_or("")
                    );
                }
            }
        }
        match engine::meshio_python() {
            Some(python) => tell!("{:<8} {}", "meshio", python.display()),
            None => tell!(
                "{:<8} missing: formats beyond MSH, VTU, FreeFEM and Medit",
                "meshio"
            ),
        }
        if !plan.is_empty() {
            tell!("\n`faceoff engines install` would type:");
            for line in plan.iter().flat_map(Installation::typed) {
                tell!("  {line}");
            }
        }
    }
    Ok(if missing { FAILED } else { DONE })
}

/// Runs a code through what it must be able to do.
fn check(name: &str, time_limit: Duration, output: &Output) -> Result<u8> {
    let engine = engine::find(name)?;
    if !engine.is_installed() {
        engine.probe()?;
    }
    let settings = Settings {
        stop: Stop::default(),
        iteration: Iteration::Newton,
        linear: linear::Settings::default(),
        launch: Launch::Alone,
        time_limit,
        keep: None,
    };
    let json = output.json.as_deref();
    let is_told = !output.quiet && !report::is_stdout(json);
    let mut done = 0;
    let findings = conformance(&*engine, &settings, |finding| {
        done += 1;
        if is_told {
            tell!("{}", line(finding, done));
        }
    })?;
    report::write_json(json, &findings)?;
    let count = |verdict| findings.iter().filter(|f| f.verdict == verdict).count();
    if is_told {
        tell!(
            "{}: {} right, {} wrong, {} without an answer",
            engine.name(),
            count(Verdict::Agree),
            count(Verdict::Disagree),
            count(Verdict::Undetermined)
        );
    }
    Ok(
        match (count(Verdict::Disagree), count(Verdict::Undetermined)) {
            (0, 0) => DONE,
            (0, _) => FAILED,
            _ => DISAGREE,
        },
    )
}

fn line(finding: &Finding, number: usize) -> String {
    let verdict = match finding.verdict {
        Verdict::Agree => "right",
        Verdict::Disagree => "WRONG",
        Verdict::Undetermined => "no answer",
    };
    let method = finding
        .method
        .as_ref()
        .map_or(String::new(), |m| format!(", {m}"));
    let difference = finding
        .difference
        .map_or(String::new(), |d| format!(" {d:.1e}"));
    let why = finding
        .why
        .as_ref()
        .map_or(String::new(), |why| format!(": {why}"));
    let all = check_count();
    format!(
        "{number:>2}/{all} {verdict:<9}{difference:<8} {}{method}{why}",
        finding.about
    )
}

/// Brings what the named engines lack, saying each command.
pub(super) fn install(names: &[&str], quiet: bool) -> Result<()> {
    engine::install(&engine::plan(names), |line| {
        if !quiet {
            note!("{line}");
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
        if !engine.is_installed() {
            // The probe knows what is missing and the command that brings it.
            engine.probe()?;
        }
        found.push(engine);
    }
    let names = found.iter().map(|engine| engine.name());
    distinct(names, "engine", "name each once")?;
    Ok(found)
}
