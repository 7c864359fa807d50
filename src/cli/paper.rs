//! `faceoff paper`.

use super::args::Paper;
use super::progress::Bar;
use super::tell::{note, output};
use super::verify::settings;
use super::{DISAGREE, DONE, FAILED, engines};
use crate::engine::Engine;
use crate::paper::{self, Example, References, Request};
use crate::report;
use faceoff_fem::contact::Iteration;
use faceoff_fem::linear;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;

/// The file by which an earlier report is known.
const RESULT: &str = "paper.json";

pub(super) fn run(arguments: &Paper) -> Result<u8> {
    let quiet = arguments.output.quiet;
    let json = arguments.output.json.as_deref();
    let shown = !quiet && !report::is_stdout(json);
    if arguments.reference {
        let references = References::new(&arguments.zones)?;
        report::write_json(json, &references)?;
        if shown {
            output(format_args!("{}", paper::references_text(&references)));
        }
        return Ok(DONE);
    }
    let request = Request {
        examples: examples(&arguments.zones)?,
        n: arguments.n.iter().map(|&n| n as usize).collect(),
        fine: arguments.fine as usize,
        engines: codes(arguments)?,
        settings: settings(
            &arguments.running,
            Iteration::Newton,
            linear::Settings::default(),
        ),
    };
    if let Some(folder) = &arguments.report {
        report::check_report_folder(folder, RESULT)?;
    }
    let bar = Bar::new(quiet);
    let outcome = paper::study(&request, &|what, share| {
        bar.tell(what, share);
        cancel::check()
    });
    bar.clear();
    let outcome = outcome?;
    if let Some(folder) = &arguments.report {
        report::write_report_folder(folder, |folder| {
            for figure in paper::FIGURES {
                paper::draw(figure, &outcome, folder)?;
            }
            report::write_text(&folder.join("report.md"), &paper::report(&outcome))?;
            report::write_json(Some(&folder.join(RESULT)), &outcome)
        })?;
    }
    report::write_json(json, &outcome)?;
    if shown {
        output(format_args!("{}", paper::tables(&outcome)));
    }
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

/// 6.1, then 6.2 with the paper's N and those asked for, rising.
fn examples(zones: &[u32]) -> Result<Vec<Example>> {
    let mut all: Vec<u32> = paper::ZONES.iter().chain(zones).copied().collect();
    all.sort_unstable();
    all.dedup();
    let many = all.into_iter().map(Example::zones);
    std::iter::once(Example::one_zone()).chain(many).collect()
}

/// The Rust engine, and those asked for.
fn codes(arguments: &Paper) -> Result<Vec<Box<dyn Engine>>> {
    let mut names = vec!["rust".to_owned()];
    let asked = arguments.engines.iter().filter(|name| *name != "rust");
    names.extend(asked.cloned());
    engines::find_all(&names, &arguments.running, arguments.output.quiet)
}
