//! Programs of engines: how they fail, as errors of the engine.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use super::bounds::Bounds;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
pub(super) use faceoff_mesh::process::find_in_path;
use faceoff_mesh::process::{self, Failure};

/// [`process::run_within`] for an engine, with limits where it is in a sandbox.
///
/// # Errors
/// The errors of [`process::run_within`].
pub(super) fn run(
    engine: &str,
    command: &Command,
    folder: &Path,
    time_limit: Duration,
    mut bounds: Option<Bounds>,
    line: impl FnMut(&str),
) -> Result<()> {
    let time_limit = cancel::share_of_time().map_or(time_limit, |share| share.min(time_limit));
    let look = |id| bounds.as_mut().map_or(Ok(()), |bounds| bounds.look(id));
    process::run_within(command, folder, time_limit, look, line).map_err(|failure| {
        let remedy = match failure {
            Failure::Ours(error) => return error,
            Failure::NotStarted { .. } => "run `faceoff engines` to see what is missing",
            Failure::OutOfTime(_) => "give it more time with --time-limit, or coarser meshes",
            Failure::TooMuch(_) => "let it take less, or trust it and leave --sandbox out",
            Failure::Lost(_) => "run again",
            Failure::Killed { .. } => {
                "if nobody did it, there was not enough memory (see `dmesg`): use coarser meshes or another machine"
            }
            Failure::Failed { .. } => {
                "run `faceoff engines` to check the installation, or keep the job folder with --keep"
            }
        };
        Error::engine(engine, failure.to_string(), remedy)
    })
}
