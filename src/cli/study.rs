//! `faceoff study`.

use std::process::{Command, Stdio};

use super::args::Study;
use super::engines;
use super::progress::watched;
use super::verify::settings;
use super::{DISAGREE, DONE};
use crate::campaigns::study::{Followed, StudyRequest, Subject, Varied, study};
use crate::engine::{self, quoted};
use crate::report::{self, Output, deliver};
use faceoff_fem::contact::Iteration;
use faceoff_fem::linear;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};

pub(super) fn run(arguments: &Study, to: &Output) -> Result<u8> {
    let scenes = arguments.trust.scenes(&arguments.scenes)?;
    let subjects = arguments.scenes.iter().zip(scenes);
    let is_trusted = arguments.trust.allow_outside;
    let subjects = subjects.map(|(name, scene)| Subject::new(name, scene, is_trusted));
    let request = StudyRequest {
        subjects: subjects.collect::<Result<_>>()?,
        methods: arguments.methods.0.clone(),
        engines: engines::find_all(&arguments.engines, &arguments.running, to.quiet)?,
        budget: arguments.budget,
        settings: settings(
            &arguments.running,
            Iteration::Newton,
            linear::Settings::default(),
        ),
        finest: arguments.finest.map_or(usize::MAX, |n| n as usize),
        journal: arguments.resume.clone(),
        follow: Some(Box::new(follow)),
    };
    let outcome = watched(&[], vec![], to.quiet, |progress| study(&request, progress))?;
    for left in &outcome.left_out {
        tracing::info!(what = left.what, why = left.why, "left out");
    }
    if outcome.rows.is_empty() {
        let why = outcome.left_out.first();
        return Err(Error::usage(
            format!(
                "nothing was measured: {}",
                why.map_or("no engine has these methods".to_owned(), |w| w.why.clone())
            ),
            "give a larger --budget, other scenes or other methods",
        ));
    }
    deliver(&report::study(&outcome)?, to)?;
    // An extreme γ₀ that is not solved is a result.
    let mut usual = outcome.rows.iter().filter(|r| r.varied != Varied::Gamma0);
    let converged = usual.all(|row| row.converged);
    Ok(if converged { DONE } else { DISAGREE })
}

/// Runs this program with these words, as a user would.
fn follow(words: &[String]) -> Result<Followed> {
    let failed = |why: String| {
        let words = quoted(words);
        Error::engine(
            engine::OWN,
            format!("`faceoff {words}` {why}"),
            "type it to see more",
        )
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
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(failed(format!(
            "ended with {}: {}",
            output.status,
            said.trim()
        )));
    }
    let told: serde_json::Value =
        serde_json::from_slice(&output.stdout).map_err(|e| failed(format!("told no JSON: {e}")))?;
    let number = |value: &serde_json::Value| {
        let number = value.as_f64();
        number.ok_or_else(|| failed("did not tell its time and memory".into()))
    };
    Ok(Followed {
        seconds: number(&told["seconds"]["total"])?,
        memory_mb: number(&told["peak_rss_mb"])?,
    })
}
