//! A code of a face-off file: a user's program, a script that is generated from a form, or a program that implements the protocol of engines
//! and solves a scene.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use serde_json::{Value, json};

use crate::engine::{Engine, How, Left, NAMES, Script, Settings, Silent, Task, digest, with};
use crate::run::{Setup, function};
use faceoff_fem::contact::Method;
use faceoff_fem::scene::Scene;
use faceoff_form::image::Motion;
use faceoff_form::{Problem, own};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::io::{self, vtu};
use faceoff_mesh::mesh::{Field, Mesh, Triangulation};

/// How a code gets its answer.
pub enum Code {
    /// A user's program, or a script that is generated from a form.
    Script(Script),
    /// A code that cannot solve the form here: it is not installed, or lacks a space or an integral.
    Missing(Missing),
    /// An engine that solves a scene.
    Protocol(Box<Protocol>),
    /// The solver of forms in this program.
    Own(Box<Own>),
}

/// A form that is solved by this program.
pub struct Own {
    files: Script,
    problem: Problem,
}

/// A code without an answer, and the reason.
pub struct Missing {
    files: Script,
    why: String,
    /// Does the code itself lack what the form needs, wherever it is installed?
    is_unable: bool,
}

/// An engine, and its scheme.
pub struct Protocol {
    /// Its name and its results: its field is `u`.
    files: Script,
    engine: Box<dyn Engine>,
    scene: Scene,
    method: Method,
}

/// The file of its field.
const FIELD: &str = "u.vtu";

impl Code {
    /// The name in the face-off file.
    pub fn name(&self) -> &str {
        &self.files().name
    }

    /// The name, and the files that it writes.
    pub fn files(&self) -> &Script {
        match self {
            Code::Script(script) => script,
            Code::Missing(missing) => &missing.files,
            Code::Protocol(protocol) => &protocol.files,
            Code::Own(own) => &own.files,
        }
    }

    /// The program that the file starts: the first word of a command, or an engine that a file describes; `None` for a built-in
    /// engine, and for a script that is generated from a form, which can only solve it.
    pub fn program(&self) -> Option<&str> {
        match self {
            Code::Script(Script {
                source: Some(_), ..
            })
            | Code::Missing(_)
            | Code::Own(_) => None,
            Code::Script(script) => script.command.first().map(String::as_str),
            Code::Protocol(of) => Some(of.engine.name()).filter(|name| !NAMES.contains(name)),
        }
    }

    /// Does it get the mesh of the problem, rather than make a separate one?
    pub fn takes_mesh(&self) -> bool {
        match self {
            Code::Script(script) => script.mesh.is_some(),
            Code::Missing(_) | Code::Protocol(_) | Code::Own(_) => true,
        }
    }

    /// A program whose command is in the file.
    pub(super) fn typed(&self) -> Option<&Script> {
        match self {
            Code::Script(script) if script.source.is_none() => Some(script),
            _ => None,
        }
    }

    /// Is it a program whose command is in the file?
    pub fn is_typed(&self) -> bool {
        self.typed().is_some()
    }

    /// Why it cannot answer, if that is known before it runs.
    pub fn missing(&self) -> Option<&str> {
        match self {
            Code::Missing(missing) => Some(&missing.why),
            _ => None,
        }
    }

    /// Does the code itself lack what the form needs, wherever it is installed?
    pub fn is_unable(&self) -> bool {
        matches!(self, Code::Missing(missing) if missing.is_unable)
    }

    /// Lets a code of a form write its linear system too.
    ///
    /// # Errors
    /// A message that says why it has none.
    pub(super) fn write_system(&mut self) -> Result<(), String> {
        match self {
            Code::Own(own) if own.problem.eigen.is_some() => {
                Err("an eigenproblem has two matrices, and no linear system".into())
            }
            Code::Own(own) if own.problem.time.is_some() => {
                Err("a form with steps in time has no one linear system".into())
            }
            Code::Own(own) => {
                own.write_system();
                Ok(())
            }
            Code::Script(script) => {
                if let Some(source) = &mut script.source {
                    script.system = Some(source.write_system()?);
                }
                Ok(())
            }
            Code::Missing(_) | Code::Protocol(_) => Ok(()),
        }
    }

    /// The same code for an image of its problem; none where there is none: of a scene, and of a script by hand unless its data are said to have that
    /// symmetry.
    ///
    /// # Errors
    /// A form whose image the code cannot solve.
    pub fn of_image(&self, motion: &Motion, has_symmetry: bool) -> Option<Result<Code>> {
        match self {
            Code::Own(own) => Some(Ok(Code::Own(Box::new(Own {
                files: Script {
                    system: None,
                    ..own.files.clone()
                },
                problem: motion.problem(&own.problem)?,
            })))),
            Code::Script(script) => match &script.source {
                Some(source) => Some(match source.of_image(motion)? {
                    Ok(source) => Ok(Code::Script(Script {
                        source: Some(source),
                        system: None,
                        ..script.clone()
                    })),
                    Err(why) => {
                        let remedy = "take another space or code";
                        Err(Error::engine(&script.name, why, remedy))
                    }
                }),
                None => (has_symmetry && script.mesh.is_some())
                    .then(|| Ok(Code::Script(script.clone()))),
            },
            Code::Missing(_) | Code::Protocol(_) => None,
        }
    }

    /// What it answers.
    ///
    /// # Errors
    /// A code that fails, that takes too long, or that does not write its results; a mesh that its format cannot hold, or
    /// on which its scene cannot be solved.
    pub fn run(&self, task: &Task, how: &How) -> Result<Left> {
        match self {
            Code::Script(script) => script.run(task, how),
            Code::Missing(missing) => Err(missing.error()),
            Code::Protocol(protocol) => protocol.run(task, how),
            Code::Own(own) => own.run(task, how),
        }
    }

    /// The answer in a folder that [`How::into`] named.
    ///
    /// # Errors
    /// Files that do not exist or cannot be read.
    pub fn left(&self, folder: &Path, seconds: f64) -> Result<Left> {
        self.files().left(folder, seconds)
    }

    /// The inputs of its answer in addition to the task.
    ///
    /// # Errors
    /// Programs that cannot be queried, and scripts that cannot be read.
    pub fn identity(&self) -> Result<Value> {
        match self {
            Code::Script(script) => script.identity(),
            Code::Missing(missing) => Err(missing.error()),
            Code::Protocol(of) => Ok(json!({
                "engine": of.engine.identity()?,
                "scene": format!("{:?}", of.scene),
                "method": of.method.to_string(),
            })),
            Code::Own(own) => Ok(json!({
                "version": env!("CARGO_PKG_VERSION"),
                "form": digest(format!("{:?}", own.problem).as_bytes()),
                "system": own.files.system,
            })),
        }
    }
}

impl Missing {
    pub fn new(files: Script, why: String, is_unable: bool) -> Self {
        Missing {
            files,
            why,
            is_unable,
        }
    }

    fn error(&self) -> Error {
        let remedy = "install or change what is missing, leave it out of `use`, or judge without it: --allow-missing";
        Error::engine(&self.files.name, &self.why, remedy)
    }
}

impl Protocol {
    /// An engine under its name in the face-off file.
    pub fn new(name: &str, engine: Box<dyn Engine>, scene: Scene, method: Method) -> Self {
        let files = Script {
            name: name.to_owned(),
            command: Vec::new(),
            source: None,
            home: ".".into(),
            mesh: None,
            results: vec![FIELD.to_owned()],
            numbers: None,
            system: None,
        };
        Protocol {
            files,
            engine,
            scene,
            method,
        }
    }

    fn run(&self, task: &Task, how: &How) -> Result<Left> {
        let mesh = Arc::new(match task.mesh {
            Some(mesh) => Triangulation::new(&self.files.name, mesh)?,
            None => self.scene.triangulation(task.n)?,
        });
        let settings = Settings {
            time_limit: how.time_limit,
            sandbox: how.sandbox,
            keep: how.keep.as_ref().map(|keep| keep.join(&how.kept)),
            ..Settings::default()
        };
        let setup = Setup::on(mesh, &self.scene, task.n, self.method, &settings);
        let case = setup.case()?;
        let clock = Instant::now();
        let mut run = self.engine.run(&[&case], &settings, &Silent)?;
        let seconds = clock.elapsed().as_secs_f64();
        let refuse = |what: &str, remedy: &str| Error::engine(&self.files.name, what, remedy);
        let answer = run.answers.pop();
        let answer = answer.ok_or_else(|| refuse("it gave no answer", "report this"))?;
        if !answer.converged {
            let remedy = "verify its scene, which says more: faceoff verify SCENE";
            return Err(refuse("its iteration did not converge", remedy));
        }
        let (mesh, field) = function::broken(&case.problem, "u", &answer.u);
        // The engine keeps a separate folder.
        let write = |folder: &Path| save(&self.files, &mesh, &[field], folder);
        self.files.leave(how, None, seconds, write)
    }
}

impl Own {
    /// A script for a form under its name in the face-off file.
    pub fn new(files: Script, problem: Problem) -> Self {
        Own { files, problem }
    }

    /// Lets it write its linear system too.
    pub fn write_system(&mut self) {
        self.files.system = Some(["A.mtx", "b.mtx", "dofs.csv"].map(str::to_owned));
    }

    fn run(&self, task: &Task, how: &How) -> Result<Left> {
        let mesh = task.mesh.ok_or_else(|| {
            Error::engine(
                &self.files.name,
                "it has no mesh",
                "add [mesh] with a file or a generator",
            )
        })?;
        let clock = Instant::now();
        let problem = with(&self.problem, task.parameters);
        if problem.eigen.is_some() {
            let (values, cells, fields) = own::Pencil::new(&problem, mesh)?.solve()?;
            let seconds = clock.elapsed().as_secs_f64();
            let write = |folder: &Path| {
                save(&self.files, &cells, &fields, folder)?;
                let Some(name) = &self.files.numbers else {
                    return Ok(());
                };
                let rows = (1..)
                    .zip(&values)
                    .map(|(k, x): (usize, _)| format!("lambda{k},{x}\n"));
                io::save(&folder.join(name), [rows.collect::<String>().as_bytes()])
            };
            return self.files.leave(how, how.keep.as_deref(), seconds, write);
        }
        let solution = own::solve(&problem, mesh)?;
        let seconds = clock.elapsed().as_secs_f64();
        let (cells, fields) = own::output(&solution.assembler, &solution.u);
        let write = |folder: &Path| {
            save(&self.files, &cells, &fields, folder)?;
            let Some([matrix, load, dofs]) = &self.files.system else {
                return Ok(());
            };
            let (a, b, mut table) = own::system(&problem, mesh)?;
            // The system at a state does not have the solution.
            table.values = problem.clone().is_linear().then(|| solution.u.clone());
            io::write_matrix(&folder.join(matrix), &a)?;
            io::write_vector(&folder.join(load), &b)?;
            io::write_dofs(&folder.join(dofs), &table)
        };
        self.files.leave(how, how.keep.as_deref(), seconds, write)
    }
}

/// Writes an answer to its file.
fn save(files: &Script, mesh: &Mesh, fields: &[Field], folder: &Path) -> Result<()> {
    let encoding = vtu::Encoding::Base64(vtu::Compressor::Zlib);
    vtu::write(&folder.join(&files.results[0]), mesh, fields, &[], encoding)
}
