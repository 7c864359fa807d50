//! `faceoff paper`.

use super::args::Paper;
use super::progress::watched;
use super::verify::settings;
use super::{DISAGREE, DONE, FAILED, engines};
use crate::campaigns::paper::{self, Example, PaperRequest, References};
use crate::engine::{self, Engine};
use crate::report::console::note;
use crate::report::{self, Output, deliver};
use faceoff_fem::contact::Iteration;
use faceoff_fem::linear;
use faceoff_mesh::error::Result;

pub(super) fn run(arguments: &Paper, to: &Output) -> Result<u8> {
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
        settings: settings(
            &arguments.running,
            Iteration::Newton,
            linear::Settings::default(),
        ),
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
    let mut names = vec![engine::OWN.to_owned()];
    let asked = arguments.engines.iter().filter(|name| *name != engine::OWN);
    names.extend(asked.cloned());
    engines::find_all(&names, &arguments.running, arguments.output.quiet)
}
