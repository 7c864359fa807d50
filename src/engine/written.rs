//! Codes whose scripts are written from a weak form: the program that runs them here, and the input of a run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::fenicsx::{folder_of, python_with};
use super::process::find_in_path;
use super::{depends, digest};
use faceoff_form::Problem;
use faceoff_form::codes::Code;
use faceoff_form::image::Motion;
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
    has_system: bool,
}

impl Source {
    /// # Errors
    /// A message about the feature that the code lacks for this form.
    pub fn new(problem: &Problem, code: &'static Code) -> Result<Self, String> {
        code.script(problem)?;
        Ok(Source {
            problem: problem.clone(),
            code,
            has_system: false,
        })
    }

    /// The same of an image of the form; none where there is none, or none in the text of the form.
    ///
    /// # Errors
    /// As [`Source::new`].
    pub fn of_image(&self, motion: &Motion) -> Option<Result<Self, String>> {
        if self.code.has_text() && !motion.is_still() {
            return None;
        }
        let image = motion.problem(&self.problem)?;
        Some(Source::new(&image, self.code))
    }

    /// Lets its script write its linear system too, into files of these names.
    ///
    /// # Errors
    /// The reason why there is no system, or the feature that the code lacks.
    pub fn write_system(&mut self) -> Result<[String; 3], String> {
        self.code.script_with_system(&self.problem)?;
        self.has_system = true;
        Ok(["A.mtx", "b.mtx", "dofs.csv"].map(str::to_owned))
    }

    /// The words of the command that runs the script here, with placeholders.
    ///
    /// # Errors
    /// A message about the program or the Python module that is not installed.
    pub fn command(&self) -> Result<Vec<String>, String> {
        let usual = self.code.command;
        let program = usual.first().copied().unwrap_or_default();
        let found = match self.code.module() {
            Some(module) => {
                python_with(module).ok_or_else(|| format!("no Python here has {module}"))?
            }
            None => find_in_path(program).ok_or_else(|| format!("{program} is not installed"))?,
        };
        if let Some(module) = self
            .solver()
            .filter(|module| folder_of(&found, module).is_none())
        {
            let python = found.display();
            return Err(format!(
                "{python} has no {module}, which solves eigenproblems"
            ));
        }
        let mut words = vec![found.display().to_string().replace('{', "{{")];
        words.extend(usual.iter().skip(1).map(|word| (*word).to_owned()));
        words.extend(["{script}", "{mesh}"].map(str::to_owned));
        words.push(format!("{{out}}/{}", self.result()));
        Ok(words)
    }

    /// The module that solves eigenproblems where the code's own does not.
    fn solver(&self) -> Option<&'static str> {
        let is_it = self.problem.eigen.is_some() && self.code.name == "dolfinx";
        is_it.then_some("slepc4py")
    }

    /// The file with all unknowns that the script writes.
    pub fn result(&self) -> String {
        format!("{}.vtu", self.problem.name)
    }

    /// The script with these values of the parameters.
    fn text(&self, name: &str, parameters: &BTreeMap<String, String>) -> Result<String> {
        let problem = with(&self.problem, parameters);
        let script = match self.has_system {
            true => self.code.script_with_system(&problem),
            false => self.code.script(&problem),
        };
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

    /// The dependencies of an answer besides mesh and parameters: the script, the program, and the files of the module that it imports.
    pub(super) fn identity(&self, name: &str, command: &[String]) -> Result<Value> {
        let program = command.first().map(PathBuf::from).unwrap_or_default();
        let of_module = |module: &str| {
            let folder = folder_of(&program, module).ok_or_else(|| {
                let what = format!("it has no {module} whose files can be found");
                Error::engine(name, what, "run it without --resume")
            })?;
            let files = json!(depends::digests(&[], &folder)?);
            Ok::<_, Error>(digest(files.to_string().as_bytes()))
        };
        let mut all = json!({
            "command": command,
            "script": digest(self.text(name, &BTreeMap::new())?.as_bytes()),
            "program": digest(&file::read(&program)?),
            "module": self.code.module().map(of_module).transpose()?,
        });
        if let Some(module) = self.solver() {
            all["solver"] = json!(of_module(module)?);
        }
        Ok(all)
    }
}
