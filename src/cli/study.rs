//! `faceoff study`.

use super::args::Study;
use super::engines;
use super::progress::Bar;
use super::verify::settings;
use super::{DISAGREE, DONE};
use crate::contact::Iteration;
use crate::engine;
use crate::error::{Error, Result};
use crate::linear;
use crate::report;
use crate::study::{self, Request, Subject, study};

/// The file by which an earlier report is known.
const RESULT: &str = "study.json";

pub(super) fn run(arguments: &Study) -> Result<u8> {
    let quiet = arguments.output.quiet;
    let json = arguments.output.json.as_deref();
    let subjects = arguments.scenes.iter().map(|name| Subject::find(name));
    let request = Request {
        subjects: subjects.collect::<Result<_>>()?,
        methods: arguments.methods.0.clone(),
        engines: engines::find_all(&arguments.engines, &arguments.running, quiet)?,
        budget: arguments.budget,
        settings: settings(
            &arguments.running,
            Iteration::Newton,
            linear::Settings::default(),
        ),
    };
    check(&request)?;
    if let Some(folder) = &arguments.report {
        report::check_report_folder(folder, RESULT)?;
    }
    let bar = Bar::new(quiet);
    let outcome = study(&request, &|what, share| {
        bar.tell(what, share);
        if engine::interrupted() {
            return Err(Error::Interrupted);
        }
        Ok(())
    });
    bar.clear();
    let outcome = outcome?;
    if let Some(folder) = &arguments.report {
        report::write_report_folder(folder, |folder| {
            study::draw(&outcome, folder)?;
            report::write_text(&folder.join("report.md"), &study::report(&outcome))?;
            report::write_text(&folder.join("rows.csv"), &study::csv(&outcome.rows))?;
            report::write_json(Some(&folder.join(RESULT)), &outcome)
        })?;
    }
    report::write_json(json, &outcome)?;
    if !quiet && !report::is_stdout(json) {
        print!("{}", study::summary(&outcome));
    }
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
    let converged = outcome.rows.iter().all(|row| row.converged);
    Ok(if converged { DONE } else { DISAGREE })
}

fn check(request: &Request) -> Result<()> {
    for (k, subject) in request.subjects.iter().enumerate() {
        let name = &subject.scene.name;
        if request.subjects[..k].iter().any(|s| s.scene.name == *name) {
            return Err(Error::usage(
                format!("scene {name} is named twice"),
                "give scenes of different names",
            ));
        }
    }
    Ok(())
}
