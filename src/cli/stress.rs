//! `faceoff stress`.

use super::args::Stress;
use super::engines;
use super::progress::Bar;
use super::tell::output;
use super::verify::settings;
use super::{DISAGREE, DONE};
use crate::report;
use crate::stress::{self, Request, stress};
use faceoff_fem::contact::Iteration;
use faceoff_fem::linear;
use faceoff_fem::scene::Scene;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;

/// The file by which an earlier report is known.
const RESULT: &str = "stress.json";

pub(super) fn run(arguments: &Stress) -> Result<u8> {
    let quiet = arguments.output.quiet;
    let json = arguments.output.json.as_deref();
    let scenes = arguments.scenes.iter().map(|name| Scene::find(name));
    let request = Request {
        scenes: scenes.collect::<Result<_>>()?,
        families: arguments.families.clone(),
        methods: arguments.methods.0.clone(),
        engines: engines::find_all(&arguments.engines, &arguments.running, quiet)?,
        settings: settings(
            &arguments.running,
            Iteration::Newton,
            linear::Settings::default(),
        ),
        is_brief: false,
    };
    if let Some(folder) = &arguments.report {
        report::check_report_folder(folder, RESULT)?;
    }
    let bar = Bar::new(quiet);
    let outcome = stress(&request, &|what, share| {
        bar.tell(what, share);
        cancel::check()
    });
    bar.clear();
    let outcome = outcome?;
    if let Some(folder) = &arguments.report {
        report::write_report_folder(folder, |folder| {
            stress::draw(&outcome, folder)?;
            report::write_text(&folder.join("report.md"), &stress::report(&outcome))?;
            report::write_text(&folder.join("map.csv"), &stress::csv(&outcome))?;
            report::write_json(Some(&folder.join(RESULT)), &outcome)
        })?;
    }
    report::write_json(json, &outcome)?;
    if !quiet && !report::is_stdout(json) {
        output(format_args!("{}", stress::table(&outcome)));
    }
    let wrong = outcome.cells.iter().any(|cell| cell.verdict.is_wrong());
    Ok(if wrong { DISAGREE } else { DONE })
}
