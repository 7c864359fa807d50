//! `faceoff stress`.

use super::args::Stress;
use super::engines;
use super::progress::Bar;
use super::verify::settings;
use super::{DISAGREE, DONE};
use crate::engine;
use crate::report::{self, Output, deliver};
use crate::stress::{Request, stress};
use faceoff_fem::contact::Iteration;
use faceoff_fem::linear;
use faceoff_mesh::error::{Error, Result};

pub(super) fn run(arguments: &Stress, to: &Output) -> Result<u8> {
    let scenes = arguments
        .scenes
        .iter()
        .map(|name| arguments.trust.scene(name));
    let request = Request {
        scenes: scenes.collect::<Result<_>>()?,
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
    let bar = Bar::new(to.quiet);
    let outcome = stress(&request, &|what, share| {
        bar.tell(what, share);
        if engine::interrupted() {
            return Err(Error::Interrupted);
        }
        Ok(())
    });
    bar.clear();
    let outcome = outcome?;
    deliver(&report::stress(&outcome)?, to)?;
    let wrong = outcome.cells.iter().any(|cell| cell.verdict.is_wrong());
    Ok(if wrong { DISAGREE } else { DONE })
}
