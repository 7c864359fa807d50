//! A sandbox for codes of strangers, by bubblewrap: no network, no processes and variables of the user, nothing of the user's
//! folders to read, and the job folder alone to write in.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::process::find_in_path;
use faceoff_mesh::error::{Error, Result};

/// What a sandboxed program may use besides the system and its job folder.
#[derive(Debug, Default)]
pub(super) struct Allowed {
    pub read: Vec<PathBuf>,
    pub write: Vec<PathBuf>,
}

/// The command that runs `command` in a sandbox, in `folder`.
///
/// # Errors
/// A system without bubblewrap.
pub(super) fn enclose(command: &Command, folder: &Path, allowed: &Allowed) -> Result<Command> {
    let bubblewrap = find_in_path("bwrap").ok_or_else(|| {
        let remedy =
            "on Debian `apt-get install bubblewrap`, or trust the engines and leave --sandbox out";
        Error::usage("there is no bubblewrap (bwrap) for --sandbox", remedy)
    })?;
    let program = Path::new(command.get_program());
    let program = find_in_path(program).unwrap_or_else(|| program.to_owned());
    let mut enclosed = Command::new(bubblewrap);
    enclosed.args(["--unshare-all", "--die-with-parent", "--ro-bind", "/", "/"]);
    enclosed.args(["--proc", "/proc", "--dev", "/dev"]);
    // What others may keep secrets in is empty there.
    let home = std::env::var_os("HOME").map(PathBuf::from);
    let hidden = ["/tmp", "/var/tmp", "/run", "/home", "/root"].map(PathBuf::from);
    let hidden: Vec<PathBuf> = hidden.into_iter().chain(home).collect();
    for place in hidden
        .iter()
        .filter(|place| place.is_dir() && place.parent().is_some())
    {
        enclosed.arg("--tmpfs").arg(place);
    }
    // An environment of Python in the user's folders: the folder that holds its `bin`, where links lead, too.
    let real = program.canonicalize().unwrap_or_else(|_| program.clone());
    let prefixes = [&program, &real].map(|p| p.ancestors().nth(2).map(Path::to_owned));
    let read = allowed
        .read
        .iter()
        .cloned()
        .chain(prefixes.into_iter().flatten());
    let is_hidden = |path: &PathBuf| {
        hidden
            .iter()
            .any(|place| path.starts_with(place) && path != place)
    };
    for path in read.filter(is_hidden) {
        enclosed.arg("--ro-bind").args([&path, &path]);
    }
    for path in allowed.write.iter().map(PathBuf::as_path).chain([folder]) {
        enclosed.arg("--bind-try").args([path, path]);
    }
    let place = command.get_current_dir().unwrap_or(folder);
    enclosed.arg("--chdir").arg(place).arg("--clearenv");
    let path = std::env::var_os("PATH").unwrap_or_else(|| "/usr/bin:/bin".into());
    enclosed.arg("--setenv").arg("PATH").arg(path);
    enclosed.arg("--setenv").arg("HOME").arg(folder);
    for (name, value) in command.get_envs() {
        if let Some(value) = value {
            enclosed.arg("--setenv").arg(name).arg(value);
        }
    }
    enclosed.arg("--").arg(program).args(command.get_args());
    Ok(enclosed)
}
