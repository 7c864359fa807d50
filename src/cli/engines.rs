//! `faceoff engines`: the installed codes, and the commands that install the others.

use std::path::PathBuf;

use serde::Serialize;

use super::args::{Engines, EnginesAction, INSTALLED, Running};
use super::{DONE, FAILED, code};
use crate::campaigns::conformance::{Finding, check_count, conformance};
use crate::engine::{self, Engine, Installation, Settings};
use crate::report::console::{note, tell};
use crate::report::model::{Block, Report, Suite, Table, TestCase, cells, count, short};
use crate::report::{Output, deliver};
use crate::text::{Text, text};
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Result, distinct};
use faceoff_mesh::io;

#[derive(Serialize)]
struct EngineState {
    engine: String,
    version: Option<String>,
    /// The warning for a version that was not tested, or that finds no plugins.
    doubt: Option<String>,
    problem: Option<String>,
}

#[derive(Serialize)]
struct Here {
    engines: Vec<EngineState>,
    /// Formats that are not read here go through it; no engine, so that nothing fails where it is missing.
    meshio: Meshio,
}

#[derive(Serialize)]
struct Meshio {
    python: Option<PathBuf>,
    problem: Option<String>,
}

impl Meshio {
    fn find() -> Self {
        let python = engine::meshio_python();
        let ours = || io::NATIVE.iter().map(|format| format.title);
        let lacks = || format!("formats beyond {}", ours().collect::<Vec<_>>().join(", "));
        let problem = python.is_none().then(lacks);
        Meshio { python, problem }
    }
}

/// The result of `engines check`.
#[derive(Serialize)]
struct Checked {
    engine: String,
    version: Option<String>,
    verdict: Verdict,
    /// The subject of the checks that were run, if not of all.
    #[serde(skip_serializing_if = "str::is_empty")]
    about: String,
    findings: Vec<Finding>,
    /// The warning for a version that was not tested, or that finds no plugins.
    #[serde(skip_serializing_if = "Option::is_none")]
    doubt: Option<String>,
}

/// The warning for a code that is installed and passes all checks.
fn doubt(name: &str, version: Option<&str>) -> Result<Option<String>> {
    let doubt = version.and_then(|version| engine::doubt(name, version));
    let lacks = match (name, version) {
        ("freefem", Some(_)) => engine::lacks_plugins()?,
        _ => None,
    };
    let remarks: Vec<String> = doubt.into_iter().chain(lacks).collect();
    Ok((!remarks.is_empty()).then(|| remarks.join("; ")))
}

pub(super) fn run(arguments: &Engines, to: &Output) -> Result<u8> {
    let mut wanted: Vec<&str> = INSTALLED.to_vec();
    match &arguments.action {
        None => {}
        Some(EnginesAction::Install { what }) => {
            if !what.is_empty() {
                wanted = what.iter().map(String::as_str).collect();
            }
            install(&wanted, to.quiet)?;
        }
        Some(EnginesAction::Check { engine, about, .. }) => return check(engine, about, to),
    }
    let mut states = Vec::new();
    for name in engine::NAMES {
        let probed = engine::find(name)?.probe();
        states.push(EngineState {
            engine: name.to_owned(),
            doubt: doubt(name, probed.as_deref().ok())?,
            problem: probed.as_ref().err().map(ToString::to_string),
            version: probed.ok(),
        });
    }
    let lacks = |s: &EngineState| s.problem.is_some() && wanted.contains(&&*s.engine);
    let is_missing = states.iter().any(lacks);
    let here = Here {
        engines: states,
        meshio: Meshio::find(),
    };
    deliver(&state(&here)?, to)?;
    Ok(if is_missing { FAILED } else { DONE })
}

/// The installed programs.
fn state(here: &Here) -> Result<Report<'_>> {
    let missing = here.engines.iter().filter(|s| s.problem.is_some()).count();
    let headline = match missing {
        0 => "all engines are here".to_owned(),
        _ => format!("{} missing", count(missing, "engine")),
    };
    let question = "faceoff engines: which codes are here?";
    let mut report = Report::new("engines", question, headline, here)?;
    let mut rows: Vec<_> = here
        .engines
        .iter()
        .map(|s| {
            let problem = s.problem.as_ref().map(|p| format!("missing: {p}"));
            cells![
                &s.engine,
                s.version.as_ref(),
                problem.or(s.doubt.clone()).map(|what| Text::message(&what))
            ]
        })
        .collect();
    let Meshio { python, problem } = &here.meshio;
    let python = python.as_ref().map(|python| python.display().to_string());
    let problem = problem.as_ref().map(|what| format!("missing: {what}"));
    rows.push(cells![
        "meshio",
        "",
        problem.or(python).map(|what| Text::message(&what))
    ]);
    let head = ["engine", "version", "remark"];
    report
        .story
        .rest
        .push(Table::new("", head).with(rows).into());
    let plan = engine::plan(&INSTALLED);
    if !plan.is_empty() {
        let lines = plan.iter().flat_map(Installation::typed);
        report
            .story
            .rest
            .push(Block::text(text!("`faceoff engines install` would type:")));
        report.story.rest.push(Block::Commands(lines.collect()));
    }
    Ok(report)
}

/// Runs a code on the cases that it must solve.
fn check(name: &str, about: &str, to: &Output) -> Result<u8> {
    let engine = engine::find(name)?;
    if !engine.is_installed() {
        engine.probe()?;
    }
    let settings = Settings::default();
    let mut done = 0;
    let findings = conformance(&*engine, &settings, about, |finding| {
        done += 1;
        if to.speaks() {
            tell!("{}", line(finding, done, check_count(about)));
        }
    })?;
    let version = engine.probe().ok();
    let checked = Checked {
        engine: engine.name().to_owned(),
        doubt: doubt(engine.name(), version.as_deref())?,
        version,
        about: about.to_owned(),
        verdict: Verdict::of_all(findings.iter().map(|f| f.verdict)),
        findings,
    };
    deliver(&conforms(&checked)?, to)?;
    Ok(code(checked.verdict))
}

/// The result of a check; the terminal has printed it line by line.
fn conforms(checked: &Checked) -> Result<Report<'_>> {
    let count = |verdict| {
        checked
            .findings
            .iter()
            .filter(|f| f.verdict == verdict)
            .count()
    };
    let of = match &*checked.about {
        "" => String::new(),
        about => format!(", checks of \"{about}\" only"),
    };
    let headline = format!(
        "{}{of}: {} right, {} wrong, {} without an answer",
        checked.engine,
        count(Verdict::Agree),
        count(Verdict::Disagree),
        count(Verdict::Undetermined)
    );
    let question = "faceoff engines check: does a code do what the protocol asks?";
    let mut report = Report::new("engines check", question, headline, checked)?;
    report.verdict = Some((checked.verdict, right(checked.verdict)));
    let version = checked.version.clone().unwrap_or_default();
    report.engines.push((checked.engine.clone(), version));
    report
        .notes
        .extend(checked.doubt.as_deref().map(Text::message));
    let remark = checked.doubt.iter().map(|what| ("remark", what.clone()));
    report
        .story
        .rest
        .push(Block::Terminal(vec![Block::facts(remark)]));
    let rows = checked.findings.iter().map(|f| {
        cells![
            Text::message(&f.about),
            f.method.as_ref(),
            f.verdict,
            f.difference,
            f.why.as_ref()
        ]
    });
    let head = ["check", "method", "verdict", "difference", "why"];
    let table = Table::new("Small cases with known answers", head).with(rows);
    report.story.rest.push(Block::Page(vec![table.into()]));
    let cases = checked.findings.iter().map(|f| TestCase {
        class: checked.engine.clone(),
        name: titled(f),
        title: None,
        seconds: 0.0,
        verdict: f.verdict,
        message: f.why.as_ref().map(Text::to_string).unwrap_or_default(),
    });
    let cases = cases.collect();
    report.suites.push(Suite {
        name: checked.engine.clone(),
        properties: Vec::new(),
        cases,
    });
    Ok(report)
}

fn right(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Agree | Verdict::Conditioned => "right",
        Verdict::Several | Verdict::Disagree => "wrong",
        Verdict::Undetermined => "no answer",
    }
}

fn titled(finding: &Finding) -> String {
    let method = finding.method.as_ref();
    finding.about.clone() + &method.map_or(String::new(), |m| format!(", {m}"))
}

fn line(finding: &Finding, number: usize, all: usize) -> String {
    let verdict = match finding.verdict {
        Verdict::Disagree => "WRONG",
        other => right(other),
    };
    let difference = finding
        .difference
        .map_or(String::new(), |d| format!(" {}", short(d)));
    let why = finding
        .why
        .as_ref()
        .map_or(String::new(), |why| format!(": {why}"));
    format!(
        "{number:>2}/{all} {verdict:<9}{difference:<9} {}{why}",
        titled(finding)
    )
}

/// Installs what the named engines lack, printing each command.
pub(super) fn install(names: &[&str], quiet: bool) -> Result<()> {
    engine::install(&engine::plan(names), |line| {
        if !quiet {
            note!("{line}");
        }
    })
}

/// The engines of these names, each once, all of them installed.
///
/// # Errors
/// A name twice or unknown; an engine that is missing, with the command that installs it.
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
            // The probe's error names what is missing and the command that installs it.
            engine.probe()?;
        }
        found.push(engine);
    }
    let names = found.iter().map(|engine| engine.name());
    distinct(names, "engine", "name each once")?;
    Ok(found)
}
