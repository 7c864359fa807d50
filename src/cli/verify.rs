//! `faceoff verify`.

use std::collections::BTreeSet;

use serde::Serialize;

use super::args::{Running, Verify};
use super::progress::Bars;
use super::tell::{note, output, tell};
use super::{DISAGREE, DONE, FAILED, complain, engines, tell_failure};
use crate::diagnose::{Diagnosis, diagnose};
use crate::engine::{
    self, Baseline, Engine, Explanation, Launch, Progress, Settings, Silent, resumed,
};
use crate::report;
use crate::verify::{CaseOutcome, Failure, Outcome, Request, verify};
use faceoff_fem::contact::{Iteration, Stop};
use faceoff_fem::linear;
use faceoff_fem::scene::Scene;
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Result};

pub(super) fn run(arguments: &Verify) -> Result<u8> {
    let code = judge(arguments);
    if let Err(e) = &code
        && !matches!(e, Error::Interrupted)
    {
        tell_failure("verify", "verify", e, &arguments.told, &arguments.output)?;
    }
    code
}

fn judge(arguments: &Verify) -> Result<u8> {
    let quiet = arguments.output.quiet;
    let scenes = if arguments.scenes.is_empty() {
        Scene::builtin_names()
            .map(Scene::find)
            .collect::<Result<Vec<_>>>()?
    } else {
        arguments
            .scenes
            .iter()
            .map(|name| arguments.trust.scene(name))
            .collect::<Result<Vec<_>>>()?
    };
    for (k, scene) in scenes.iter().enumerate() {
        if scenes[..k].iter().any(|other| other.name() == scene.name()) {
            return Err(Error::usage(
                format!("scene {} is named twice", scene.name()),
                "give scenes of different names",
            ));
        }
    }
    let (mut engines, missing) = present(arguments)?;
    if let Some(folder) = &arguments.resume {
        engines = engines.into_iter().map(|e| resumed(e, folder)).collect();
    }
    if let Some(folder) = &arguments.against {
        engines.extend(Baseline::read(folder)?.engines(folder));
    }
    if let Some(folder) = &arguments.record {
        report::check_baseline_folder(folder)?;
    }
    let request = Request {
        scenes,
        methods: arguments.methods.0.clone(),
        n: distinct(&arguments.n)?,
        engines,
        settings: settings(&arguments.running, Iteration::Newton, Default::default()),
    };
    let engines: Vec<&dyn Engine> = request.engines.iter().map(|e| &**e).collect();
    check_launch(&request.settings, &engines)?;
    if let Some(folder) = &arguments.report {
        report::prepare_folder(folder)?;
    }

    let outcome = {
        let names: Vec<&str> = request.engines.iter().map(|e| e.name()).collect();
        let bars = Bars::new(&names, work(&request), quiet);
        let listener: &dyn Progress = bars.as_ref().map_or(&Silent, |bars| bars);
        let outcome = verify(&request, listener);
        if let Some(bars) = &bars {
            bars.clear();
        }
        outcome?
    };

    let diagnoses = if arguments.diagnose {
        diagnose(&request, &outcome)?
    } else {
        Vec::new()
    };
    if let Some(folder) = &arguments.record {
        report::write_baseline(folder, &recipe(), &request, &outcome)?;
    }
    if let Some(folder) = &arguments.report {
        report::write_fields(folder, &request, &outcome)?;
        report::write_html(folder, &request, &outcome, &diagnoses, &missing)?;
    }
    let json = arguments.output.json.as_deref();
    let explained = if arguments.explain {
        explained(&outcome)
    } else {
        Vec::new()
    };
    let found = Found {
        outcome: &outcome,
        diagnoses: &diagnoses,
        explanations: &explained,
    };
    report::write_json(json, &report::document("verify", &found))?;
    report::write_junit(arguments.told.junit.as_deref(), &outcome, &missing)?;
    report::write_badge(arguments.told.badge.as_deref(), outcome.verdict)?;
    if !quiet && !report::is_stdout(json) {
        output(format_args!("{}", report::table(&outcome)));
        for told in &explained {
            let n = told.n.map_or(String::new(), |n| format!(", n = {n}"));
            tell!("{}, {}{n}:", told.scene, told.method);
            for line in told.explanation.lines() {
                tell!("  {line}");
            }
        }
        for found in &diagnoses {
            let n = found.n.map_or(String::new(), |n| format!(", n = {n}"));
            let (scene, method) = (&found.scene, &found.method);
            tell!(
                "{scene}, {method}{n}: {} – {}: {}",
                found.a,
                found.b,
                found.sentence()
            );
        }
    }
    let folder = arguments.report.as_deref();
    report::annotate(&outcome, &missing, folder, report::is_stdout(json))?;
    let answered = outcome.cases.iter().flat_map(|case| &case.engines);
    let doubts = answered.filter_map(|of| engine::doubt(&of.engine, &of.version));
    for doubt in doubts.collect::<BTreeSet<_>>() {
        note!("faceoff: warning: {doubt}");
    }
    for failure in &outcome.failures {
        complain(&failure.message);
    }
    Ok(match outcome.verdict {
        Verdict::Agree => DONE,
        Verdict::Disagree => DISAGREE,
        Verdict::Undetermined => FAILED,
    })
}

/// What was found, as JSON has it.
#[derive(Serialize)]
struct Found<'a> {
    #[serde(flatten)]
    outcome: &'a Outcome,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    diagnoses: &'a [Diagnosis],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    explanations: &'a [Explained<'a>],
}

/// How a case was solved.
#[derive(Serialize)]
struct Explained<'a> {
    scene: &'a str,
    method: &'a str,
    n: Option<usize>,
    #[serde(flatten)]
    explanation: Explanation,
}

/// Of every case that the Rust engine solved. A certificate is of all fields on a mesh, where methods are judged by it.
fn explained(outcome: &Outcome) -> Vec<Explained<'_>> {
    let of = |case: &'_ CaseOutcome| {
        let mut explanation = case.explanation.clone()?;
        explanation.certificate = outcome.cross.iter().any(|cross| {
            let is_its = cross.a.method == case.method || cross.b.method == case.method;
            cross.judged.is_some() && is_its && (&cross.scene, cross.n) == (&case.scene, case.n)
        });
        Some(explanation)
    };
    let cases = outcome.cases.iter();
    cases
        .filter_map(|case| {
            Some(Explained {
                scene: &case.scene,
                method: &case.method,
                n: case.n,
                explanation: of(case)?,
            })
        })
        .collect()
}

/// The command that this is, as one would type it.
fn recipe() -> String {
    let quoted = std::env::args().skip(1).map(|word| {
        let plain = |c: char| c.is_alphanumeric() || "-_.,/=".contains(c);
        if !word.is_empty() && word.chars().all(plain) {
            word
        } else {
            format!("'{}'", word.replace('\'', "'\\''"))
        }
    });
    let words: Vec<String> = quoted.collect();
    format!("faceoff {}", words.join(" "))
}

/// Engines that are there, and those that are not.
type Present = (Vec<Box<dyn Engine>>, Vec<Failure>);

/// The engines asked for, and those left out; what is missing is installed, left out or refused, as the user says.
fn present(arguments: &Verify) -> Result<Present> {
    let mut names: Vec<&str> = arguments.engines.iter().map(String::as_str).collect();
    if names.is_empty() {
        let all = if arguments.against.is_some() {
            &engine::NAMES[..1]
        } else {
            &engine::NAMES
        };
        names.extend(all);
    }
    if arguments.running.install {
        engines::install(&names, arguments.output.quiet)?;
    }
    let (mut present, mut missing) = (Vec::new(), Vec::new());
    for name in names {
        let engine = engine::find(name)?;
        if engine.is_installed() {
            present.push(engine);
        } else if arguments.allow_missing {
            note!("faceoff: engine {name} is missing and left out");
            missing.push(Failure {
                engine: name.to_owned(),
                message: format!("engine {name} is missing and was left out"),
            });
        } else {
            // The probe knows what is missing and the command that brings it.
            engine.probe()?;
            present.push(engine);
        }
    }
    Ok((present, missing))
}

pub(super) fn settings(
    running: &Running,
    iteration: Iteration,
    linear: linear::Settings,
) -> Settings {
    Settings {
        stop: Stop {
            increment: running.tolerance,
            max_iterations: running.max_iterations as usize,
        },
        iteration,
        linear,
        launch: match (&running.launcher, running.ranks) {
            (Some(words), _) => Launch::By(words.0.clone()),
            (None, 1) => Launch::Alone,
            (None, ranks) => Launch::Ranks(ranks as usize),
        },
        time_limit: running.time_limit,
        keep: running.keep.clone(),
    }
}

/// Refuses several processes where no engine can be distributed.
pub(super) fn check_launch(settings: &Settings, engines: &[&dyn Engine]) -> Result<()> {
    if settings.launch == Launch::Alone || engines.iter().any(|e| e.distributes()) {
        return Ok(());
    }
    Err(Error::usage(
        "no engine here runs as several processes",
        "use --ranks and --launcher with the engine fenicsx",
    ))
}

fn distinct(n: &[u32]) -> Result<Vec<usize>> {
    let mut seen: Vec<usize> = Vec::new();
    for &n in n {
        if seen.contains(&(n as usize)) {
            return Err(Error::usage(
                format!("n = {n} is named twice"),
                "give different refinements",
            ));
        }
        seen.push(n as usize);
    }
    Ok(seen)
}

/// What each case is called and its share of the work, in the order in which engines get them.
fn work(request: &Request) -> Vec<(String, u64)> {
    let mut cases = Vec::new();
    for scene in &request.scenes {
        let own = [scene.source().n().unwrap_or(16)];
        let levels: &[usize] = match scene.source().n() {
            Some(_) if !request.n.is_empty() => &request.n,
            _ => &own,
        };
        for n in levels {
            for method in &request.methods {
                let weight = (n * n * method.element.degree()).max(1) as u64;
                cases.push((format!("{} {method} n = {n}", scene.name()), weight));
            }
        }
    }
    cases
}
