//! `faceoff stress`.

use super::args::Stress;
use super::engines;
use super::progress::watched;
use super::verify::settings;
use super::{DISAGREE, DONE};
use crate::campaigns::stress::{StressRequest, stress};
use crate::report::{self, Output, deliver};
use faceoff_fem::contact::Iteration;
use faceoff_fem::linear;
use faceoff_mesh::error::Result;

pub(super) fn run(arguments: &Stress, to: &Output) -> Result<u8> {
    let request = StressRequest {
        scenes: arguments.trust.scenes(&arguments.scenes)?,
        families: arguments.families.clone(),
        methods: arguments.methods.0.clone(),
        engines: engines::find_all(&arguments.engines, &arguments.running, to.quiet)?,
        settings: settings(
            &arguments.running,
            Iteration::Newton,
            linear::Settings::default(),
        ),
        is_brief: false,
    };
    let outcome = watched(&[], vec![], to.quiet, |progress| stress(&request, progress))?;
    deliver(&report::stress(&outcome)?, to)?;
    let wrong = outcome.entries.iter().any(|cell| cell.verdict.is_wrong());
    Ok(if wrong { DISAGREE } else { DONE })
}
