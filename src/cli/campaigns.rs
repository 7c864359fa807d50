//! `faceoff orders`, `paper`, `study` and `stress`.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use super::args::{Orders, Paper, Stress, Study};
use super::progress::watched;
use super::verify::settings;
use super::{DISAGREE, DONE, FAILED, elastic, engines};
use crate::campaigns::orders::{Reach, orders as observed};
use crate::campaigns::paper::{self, Example, PaperRequest, References};
use crate::campaigns::stress::{self, Behaviour, StressRequest};
use crate::campaigns::study::{self, Followed, StudyRequest, Subject, Varied};
use crate::engine::{self, Engine, Settings, meshio_python, quoted};
use crate::report::console::note;
use crate::report::{self, Output, deliver};
use crate::run::convergence::{Against, convergence};
use faceoff_fem::scene::expression::ParseError;
use faceoff_fem::scene::{Expression, Scene};
use faceoff_judge::derive;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::Results;
use faceoff_mesh::io::Series;

pub(super) fn orders(arguments: &Orders, to: &Output) -> Result<u8> {
    if !arguments.results.is_empty() {
        return orders_of_results(arguments, to);
    }
    let names = match &arguments.scenes[..] {
        [] => Scene::exact_names().into_iter().map(Into::into).collect(),
        asked => asked.to_vec(),
    };
    if elastic::are_elastic(&names)? {
        return elastic::orders(arguments, &names, to);
    }
    if !arguments.set.is_empty() {
        let what = "--set is for parameters of scenes of elasticity, and the others have none";
        return Err(Error::usage(what, "leave it out"));
    }
    let scenes = arguments.trust.scenes(&names)?;
    let n: Vec<usize> = arguments.n.iter().map(|&n| n as usize).collect();
    let methods = &arguments.methods.0;
    let settings = Settings::default();
    let all = watched(&[], vec![], to.quiet, |progress| {
        observed(&scenes, methods, &n, &settings, progress)
    })?;
    deliver(&report::orders(&all)?, to)?;
    let converged = all.iter().all(|o| o.levels.iter().all(|l| l.converged));
    let mut reached = all.iter().flat_map(|o| [o.h1_verdict, o.l2_verdict]);
    let below = reached.any(|reach| reach == Some(Reach::Below));
    Ok(if converged && !below { DONE } else { DISAGREE })
}

/// Of files, whatever code they are of.
fn orders_of_results(arguments: &Orders, to: &Output) -> Result<u8> {
    let python = meshio_python();
    let read = |path: &PathBuf| -> Result<Results> {
        let mut series = Series::open(path)?;
        if series.times.len() > 1 {
            let what = format!("{} has {} times", path.display(), series.times.len());
            return Err(Error::usage(what, "give results of one time"));
        }
        let mut results = series.read(0, python.as_deref())?;
        for name in &arguments.only {
            if !results.has(name) && !derive(&mut results, name, None)? {
                let what = format!("{} has no field `{name}`", path.display());
                return Err(Error::usage(what, "name one that all results have"));
            }
        }
        let is_asked = |name: &str| {
            arguments.only.is_empty() || arguments.only.iter().any(|only| only == name)
        };
        if let Some(part) = results.unread.iter().find(|part| is_asked(&part.name)) {
            let what = format!("{} was not read completely: {part}", path.display());
            return Err(Error::usage(what, "name the fields to judge by --only"));
        }
        Ok(results)
    };
    let results = arguments
        .results
        .iter()
        .map(read)
        .collect::<Result<Vec<_>>>()?;
    let formula = |text: &String| {
        let wrong = |e: ParseError| {
            Error::usage(
                format!("--exact {text:?}, character {}: {}", e.column, e.what),
                "give a formula in x, y, z",
            )
        };
        Expression::parse(text).map_err(wrong)
    };
    let against = match (&arguments.reference, &arguments.exact[..]) {
        (Some(path), _) => Against::Reference(Box::new(read(path)?)),
        (_, []) => Against::Next,
        (_, formulas) => Against::Exact(formulas.iter().map(formula).collect::<Result<_>>()?),
    };
    let all = watched(&[], vec![], to.quiet, |bars| {
        let progress = |share| bars.next("laying the meshes over each other", share);
        convergence(&results, &arguments.only, &against, &progress)
    })?;
    deliver(&report::convergence(&all)?, to)?;
    Ok(DONE)
}

pub(super) fn paper(arguments: &Paper, to: &Output) -> Result<u8> {
    if arguments.reference {
        let references = References::new(&arguments.zones)?;
        deliver(&report::references(&references)?, to)?;
        return Ok(DONE);
    }
    let request = PaperRequest {
        examples: examples(&arguments.zones)?,
        n: arguments.n.iter().map(|&n| n as usize).collect(),
        fine: arguments.fine as usize,
        engines: codes(arguments)?,
        settings: settings(&arguments.running),
    };
    let outcome = watched(&[], vec![], to.quiet, |progress| {
        paper::study(&request, progress)
    })?;
    deliver(&report::paper(&outcome)?, to)?;
    for failure in &outcome.failures {
        note!("faceoff: {}", failure.message);
    }
    Ok(if !outcome.failures.is_empty() {
        FAILED
    } else if outcome.converged {
        DONE
    } else {
        note!("faceoff: not every iteration of Newton reached its tolerance");
        DISAGREE
    })
}

/// 6.1, then 6.2 with the paper's N and the requested ones, increasing.
fn examples(zones: &[u32]) -> Result<Vec<Example>> {
    let mut all: Vec<u32> = paper::ZONES.iter().chain(zones).copied().collect();
    all.sort_unstable();
    all.dedup();
    let many = all.into_iter().map(Example::zones);
    std::iter::once(Example::one_zone()).chain(many).collect()
}

/// The Rust engine, and the requested ones.
fn codes(arguments: &Paper) -> Result<Vec<Box<dyn Engine>>> {
    let mut names = vec![engine::OWN.to_owned()];
    let asked = arguments.engines.iter().filter(|name| *name != engine::OWN);
    names.extend(asked.cloned());
    engines::find_all(&names, &arguments.running, arguments.output.quiet)
}

pub(super) fn study(arguments: &Study, to: &Output) -> Result<u8> {
    if elastic::are_elastic(&arguments.scenes)? {
        return elastic::study(arguments, to);
    }
    let scenes = arguments.trust.scenes(&arguments.scenes)?;
    let subjects = arguments.scenes.iter().zip(scenes);
    let is_trusted = arguments.trust.allow_outside;
    let subjects = subjects.map(|(name, scene)| Subject::new(name, scene, is_trusted));
    let request = StudyRequest {
        subjects: subjects.collect::<Result<_>>()?,
        methods: arguments.methods.0.clone(),
        engines: engines::find_all(&arguments.engines, &arguments.running, to.quiet)?,
        budget: arguments.budget,
        settings: settings(&arguments.running),
        finest: arguments.finest.map_or(usize::MAX, |n| n as usize),
        journal: arguments.resume.clone(),
        follow: Some(Box::new(follow)),
    };
    let outcome = watched(&[], vec![], to.quiet, |progress| {
        study::study(&request, progress)
    })?;
    for left in &outcome.left_out {
        tracing::info!(what = left.what, why = left.why, "left out");
    }
    if outcome.rows.is_empty() {
        let why = outcome.left_out.first();
        let why = why.map_or("no engine has these methods", |left| &left.why);
        return Err(Error::usage(
            format!("nothing was measured: {why}"),
            "give a larger --budget, other scenes or other methods",
        ));
    }
    deliver(&report::study(&outcome)?, to)?;
    // An extreme γ₀ that is not solved is a result.
    let mut usual = outcome.rows.iter().filter(|r| r.varied != Varied::Gamma0);
    let converged = usual.all(|row| row.converged);
    Ok(if converged { DONE } else { DISAGREE })
}

/// Runs this program with these arguments, as a user would.
fn follow(words: &[String]) -> Result<Followed> {
    let failed = |why: String| {
        let what = format!("`faceoff {}` {why}", quoted(words));
        Error::engine(engine::OWN, what, "type it to see more")
    };
    let program = std::env::current_exe().map_err(|e| failed(format!("is not found: {e}")))?;
    let output = Command::new(program)
        .args(words)
        .args(["--quiet", "--json", "-"])
        .stdin(Stdio::null())
        .output()
        .map_err(|e| failed(format!("cannot be started: {e}")))?;
    cancel::check()?;
    if !output.status.success() {
        let (status, said) = (output.status, String::from_utf8_lossy(&output.stderr));
        return Err(failed(format!("ended with {status}: {}", said.trim())));
    }
    let told: serde_json::Value = serde_json::from_slice(&output.stdout)
        .map_err(|e| failed(format!("printed no JSON: {e}")))?;
    let number = |value: &serde_json::Value| {
        let number = value.as_f64();
        number.ok_or_else(|| failed("did not report its time and memory".into()))
    };
    Ok(Followed {
        seconds: number(&told["seconds"]["total"])?,
        memory_mb: number(&told["peak_rss_mb"])?,
    })
}

pub(super) fn stress(arguments: &Stress, to: &Output) -> Result<u8> {
    if elastic::are_elastic(&arguments.scenes)? {
        return elastic::stress(arguments, to);
    }
    let request = StressRequest {
        scenes: arguments.trust.scenes(&arguments.scenes)?,
        families: arguments.families.clone(),
        methods: arguments.methods.0.clone(),
        engines: engines::find_all(&arguments.engines, &arguments.running, to.quiet)?,
        settings: settings(&arguments.running),
        is_brief: false,
    };
    let outcome = watched(&[], vec![], to.quiet, |progress| {
        stress::stress(&request, progress)
    })?;
    deliver(&report::stress(&outcome)?, to)?;
    let mut verdicts = outcome.entries.iter().map(|cell| &cell.verdict);
    if verdicts.clone().any(Behaviour::is_wrong) {
        return Ok(DISAGREE);
    }
    // If everything was refused, nothing was judged.
    let is_refused = |verdict| matches!(verdict, &Behaviour::Refuses { .. });
    Ok(if verdicts.all(is_refused) {
        FAILED
    } else {
        DONE
    })
}
