//! Codes whose scripts are written from a weak form: which program runs them here, and what a run gets.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::digest;
use super::fenicsx::python_with;
use super::process::find_in_path;
use faceoff_form::Problem;
use faceoff_form::codes::Code;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::{file, io};

/// A form with these values of its parameters.
pub fn with(problem: &Problem, parameters: &BTreeMap<String, String>) -> Problem {
    let mut problem = problem.clone();
    for parameter in &mut problem.parameters {
        let given = parameters.get(&parameter.name);
        if let Some(value) = given.and_then(|text| text.parse().ok()) {
            parameter.value = value;
        }
    }
    problem
}

/// A script that a code's table of spellings makes of a form.
#[derive(Debug, Clone)]
pub struct Source {
    problem: Problem,
    code: &'static Code,
}

impl Source {
    /// # Errors
    /// In words: what the code lacks for this form.
    pub fn new(problem: &Problem, code: &'static Code) -> Result<Self, String> {
        code.script(problem)?;
        Ok(Source {
            problem: problem.clone(),
            code,
        })
    }

    /// The words of the command that runs the script here, with placeholders.
    ///
    /// # Errors
    /// In words: the program or the module of Python that is not installed.
    pub fn command(&self) -> Result<Vec<String>, String> {
        let usual = self.code.command;
        let program = usual.first().copied().unwrap_or_default();
        let found = if program.ends_with("python3") {
            let module = match self.code.name {
                "scikit-fem" => "skfem",
                other => other,
            };
            python_with(module).ok_or_else(|| format!("no Python here has {module}"))?
        } else {
            find_in_path(program).ok_or_else(|| format!("{program} is not installed"))?
        };
        let mut words = vec![found.display().to_string().replace('{', "{{")];
        words.extend(usual.iter().skip(1).map(|word| (*word).to_owned()));
        words.extend(["{script}", "{mesh}"].map(str::to_owned));
        words.push(format!("{{out}}/{}", self.result()));
        Ok(words)
    }

    /// The file with all unknowns that the script writes.
    pub fn result(&self) -> String {
        format!("{}.vtu", self.problem.name)
    }

    /// The script with these values of the parameters.
    fn text(&self, name: &str, parameters: &BTreeMap<String, String>) -> Result<String> {
        let script = self.code.script(&with(&self.problem, parameters));
        script.map_err(|what| Error::engine(name, what, "take another space or code"))
    }

    /// Writes the script into a folder, and returns its path.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(super) fn write(
        &self,
        name: &str,
        folder: &Path,
        parameters: &BTreeMap<String, String>,
    ) -> Result<PathBuf> {
        let path = folder.join(self.code.file(&self.problem));
        io::save(&path, [self.text(name, parameters)?.as_bytes()])?;
        Ok(path)
    }

    /// What an answer depends on besides mesh and parameters: the script and the program.
    pub(super) fn identity(&self, name: &str, command: &[String]) -> Result<Value> {
        let program = command.first().map(PathBuf::from).unwrap_or_default();
        Ok(json!({
            "command": command,
            "script": digest(self.text(name, &BTreeMap::new())?.as_bytes()),
            "program": digest(&file::read(&program)?),
        }))
    }
}
