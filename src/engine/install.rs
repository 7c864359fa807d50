//! Installs missing codes: Debian's packages for FreeFEM and dolfinx, and meshio in a private
//! Python environment. Every command is printed before it runs.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::within::Within;
use super::{fenicsx, freefem, process, quoted};
use faceoff_mesh::error::{Error, Result};

/// Something that an engine or a format needs, and the commands that install it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Installation {
    /// The missing program.
    pub what: String,
    /// To be run one after the other, as a user would type them.
    pub commands: Vec<Vec<String>>,
}

impl Installation {
    /// The commands as a user would type them.
    pub fn typed(&self) -> Vec<String> {
        self.commands.iter().map(quoted).collect()
    }
}

/// The programs that the named engines (and `meshio`) lack here. Nothing is changed.
pub fn plan(names: &[&str]) -> Vec<Installation> {
    let mut packages: Vec<&str> = Vec::new();
    let mut what: Vec<&str> = Vec::new();
    if names.contains(&"freefem") && freefem::program(&Within::default()).is_none() {
        packages.push("freefem++");
        what.push("FreeFEM");
    }
    if names.contains(&"fenicsx") && fenicsx::python(&Within::default()).is_none() {
        packages.push("python3-dolfinx");
        what.push("dolfinx");
    }
    let meshio = names.contains(&"meshio") && meshio_python().is_none();
    if meshio && !fenicsx::has_module(Path::new("/usr/bin/python3"), "ensurepip") {
        packages.push("python3-venv");
        what.push("Python's venv");
    }
    let mut plan = Vec::new();
    if !packages.is_empty() {
        // What these packages recommend nearly doubles the download (513 MB instead of 292): LLVM, Sphinx, debuggers.
        let mut install = vec!["apt-get", "install", "-y", "--no-install-recommends"];
        install.extend(&packages);
        plan.push(Installation {
            what: what.join(", "),
            commands: vec![words(&["apt-get", "update"]), words(&install)],
        });
    }
    if meshio && let Some(home) = environment() {
        let home = home.to_string_lossy().into_owned();
        let pip = format!("{home}/bin/pip");
        plan.push(Installation {
            what: "meshio, in a separate Python environment".into(),
            commands: vec![
                words(&["/usr/bin/python3", "-m", "venv", &home]),
                words(&[&pip, "install", "--quiet", "meshio[all]"]),
            ],
        });
    }
    plan
}

/// The Python of the private environment, if meshio is in it.
pub fn meshio_python() -> Option<PathBuf> {
    let named = std::env::var_os("FACEOFF_MESHIO_PYTHON").map(PathBuf::from);
    let named = named.filter(|python| fenicsx::has_module(python, "meshio"));
    named.or_else(|| {
        let python = environment()?.join("bin/python3");
        let has_meshio = is_in_environment(&python, "meshio");
        has_meshio
            .unwrap_or_else(|| fenicsx::has_module(&python, "meshio"))
            .then_some(python)
    })
}

/// Whether a module is in the environment of this Python, by its files: every command that reads a file asks, and a Python that answers takes
/// longer to start than most files to read. `None` where the interpreter does not have its version in its name.
fn is_in_environment(python: &Path, module: &str) -> Option<bool> {
    let interpreter = std::fs::canonicalize(python).ok()?;
    let version = interpreter.file_name()?.to_str()?;
    version.strip_prefix("python3.")?;
    let packages = python
        .parent()?
        .parent()?
        .join("lib")
        .join(version)
        .join("site-packages");
    Some(packages.join(module).join("__init__.py").is_file())
}

/// Where the private environment is, or would be.
fn environment() -> Option<PathBuf> {
    Some(super::own_folder("XDG_DATA_HOME", ".local/share")?.join("python"))
}

/// Carries out a plan; `say` gets each command before it runs.
///
/// # Errors
/// A system without apt, a user without root, a command that fails: with the commands to type.
pub fn install(plan: &[Installation], mut say: impl FnMut(&str)) -> Result<()> {
    for installation in plan {
        let typed = installation.typed();
        let refuse = |why: String| {
            Error::usage(
                format!("{} cannot be installed here: {why}", installation.what),
                format!("as root on Debian, type `{}`", typed.join(" && ")),
            )
        };
        say(&format!("installing {}", installation.what));
        for words in &installation.commands {
            let with_apt = words[0] == "apt-get";
            if with_apt && process::find_in_path("apt-get").is_none() {
                return Err(refuse("this system has no apt-get".into()));
            }
            let mut line: Vec<&str> = Vec::new();
            if with_apt && !is_root() {
                // -n: rather fail than wait for a password in the middle of a script.
                line.extend(["sudo", "-n"]);
            }
            line.extend(words.iter().map(String::as_str));
            say(&format!("  {}", quoted(&line)));
            let output = Command::new(line[0])
                .args(&line[1..])
                .env("DEBIAN_FRONTEND", "noninteractive")
                .stdin(Stdio::null())
                .output()
                .map_err(|e| refuse(format!("`{}` cannot be started: {e}", line[0])))?;
            if !output.status.success() {
                let told = String::from_utf8_lossy(&output.stderr);
                let last = told.lines().rev().find(|l| !l.trim().is_empty());
                return Err(refuse(format!(
                    "`{}` failed: {}",
                    quoted(&line),
                    last.unwrap_or("it said nothing").trim()
                )));
            }
        }
        fenicsx::forget();
    }
    Ok(())
}

fn is_root() -> bool {
    Command::new("id")
        .arg("-u")
        .output()
        .is_ok_and(|output| output.stdout.trim_ascii() == b"0")
}

fn words(words: &[&str]) -> Vec<String> {
    words.iter().map(|&w| w.to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_module_is_found_by_its_files_and_not_in_another_pythons() {
        let folder = tempfile::tempdir().unwrap();
        let at = |path: &str| folder.path().join(path);
        let write = |path: &str| {
            fs::create_dir_all(at(path).parent().unwrap()).unwrap();
            fs::write(at(path), "").unwrap();
        };
        let python = at("env/bin/python3");
        assert_eq!(is_in_environment(&python, "meshio"), None);
        write("usr/python3.11");
        write("env/bin/activate");
        std::os::unix::fs::symlink(at("usr/python3.11"), &python).unwrap();
        assert_eq!(is_in_environment(&python, "meshio"), Some(false));
        // As after an upgrade of the system, which leaves the packages of the version before.
        write("env/lib/python3.9/site-packages/meshio/__init__.py");
        assert_eq!(is_in_environment(&python, "meshio"), Some(false));
        write("env/lib/python3.11/site-packages/meshio/__init__.py");
        assert_eq!(is_in_environment(&python, "meshio"), Some(true));
    }
}
