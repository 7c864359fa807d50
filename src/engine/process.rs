//! Programs of engines: how they fail, as errors of the engine.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
pub(super) use faceoff_mesh::process::find_in_path;
use faceoff_mesh::process::{self, Failure};

/// [`process::run`] for an engine.
///
/// # Errors
/// Those of [`process::run`].
pub(super) fn run(
    engine: &str,
    command: &Command,
    folder: &Path,
    time_limit: Duration,
    line: impl FnMut(&str) + Send,
) -> Result<()> {
    let time_limit = cancel::share_of_time().map_or(time_limit, |share| share.min(time_limit));
    process::run(command, folder, time_limit, line).map_err(|failure| {
        let remedy = match failure {
            Failure::Ours(error) => return error,
            Failure::NotStarted { .. } => "run `faceoff engines` to see what is missing",
            Failure::OutOfTime(_) => "give it more time with --time-limit, or coarser meshes",
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
