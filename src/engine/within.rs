//! A code in another system: in a container, or in a folder that has another release of Debian.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The command prefix that runs a command in another system, in which `{job}` is the job folder; empty: it runs here.
#[derive(Debug, Clone, Default)]
pub(super) struct Within(pub Vec<String>);

impl Within {
    pub fn is_here(&self) -> bool {
        self.0.is_empty()
    }

    /// The program that is found here, or the name of the one that is there.
    pub fn program(&self, here: impl FnOnce() -> Option<PathBuf>, there: &str) -> Option<PathBuf> {
        match self.is_here() {
            true => here(),
            false => Some(there.into()),
        }
    }

    /// The command that runs `command` there, with the variables that are set for it.
    pub fn enclose(&self, command: Command, folder: &Path) -> Command {
        let [first, rest @ ..] = &self.0[..] else {
            return command;
        };
        let job = folder.to_string_lossy();
        let mut enclosed = Command::new(first);
        enclosed.args(rest.iter().map(|word| word.replace("{job}", &job)));
        // A container has none of this process's variables.
        enclosed.arg("env");
        for (name, value) in command.get_envs() {
            let mut set = OsString::from(name);
            set.push("=");
            set.push(value.unwrap_or_default());
            enclosed.arg(set);
        }
        enclosed.arg(command.get_program()).args(command.get_args());
        enclosed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_goes_there_with_its_variables() {
        let within = Within(["podman", "-v", "{job}:{job}"].map(str::to_owned).to_vec());
        let mut command = Command::new("python3");
        command.args(["-B", "a b"]).env("LC_ALL", "C");
        let enclosed = within.enclose(command, Path::new("/tmp/x"));
        let words: Vec<_> = enclosed.get_args().map(|w| w.to_string_lossy()).collect();
        assert_eq!(enclosed.get_program(), "podman");
        let expected = [
            "-v",
            "/tmp/x:/tmp/x",
            "env",
            "LC_ALL=C",
            "python3",
            "-B",
            "a b",
        ];
        assert_eq!(words, expected);
    }
}
