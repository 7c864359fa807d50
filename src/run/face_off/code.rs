//! A code of a face-off: a program of the user's own, or one that speaks the protocol of engines and solves a scene.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use serde_json::{Value, json};

use crate::engine::{Engine, How, Left, NAMES, Script, Settings, Silent, Task};
use crate::run::{Setup, function};
use faceoff_fem::contact::Method;
use faceoff_fem::scene::Scene;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::file::Temporary;
use faceoff_mesh::io::vtu;
use faceoff_mesh::mesh::Triangulation;

/// Who answers.
pub enum Code {
    /// A program of the user's own.
    Script(Script),
    /// An engine that solves a scene.
    Protocol(Box<Protocol>),
}

/// An engine, and the scheme that it gets.
pub struct Protocol {
    /// What it is called, and what it leaves: its field is `u`.
    files: Script,
    engine: Box<dyn Engine>,
    scene: Scene,
    method: Method,
}

/// The file of its field.
const FIELD: &str = "u.vtu";

impl Code {
    /// As the file of the face-off calls it.
    pub fn name(&self) -> &str {
        &self.files().name
    }

    /// What it is called, and the files that it leaves.
    pub fn files(&self) -> &Script {
        match self {
            Code::Script(script) => script,
            Code::Protocol(protocol) => &protocol.files,
        }
    }

    /// The program that the file starts by it: the first word of a command, or an engine that a file describes; none of an engine
    /// of ours.
    pub fn program(&self) -> Option<&str> {
        match self {
            Code::Script(script) => script.command.first().map(String::as_str),
            Code::Protocol(of) => Some(of.engine.name()).filter(|name| !NAMES.contains(name)),
        }
    }

    /// Does it get the mesh of the face-off, rather than make its own?
    pub fn takes_mesh(&self) -> bool {
        match self {
            Code::Script(script) => script.mesh.is_some(),
            Code::Protocol(_) => true,
        }
    }

    /// What it answers.
    ///
    /// # Errors
    /// A code that fails, that takes too long, or that does not write what it should; a mesh that its format cannot hold, or
    /// on which its scene cannot be solved.
    pub fn run(&self, task: &Task, how: &How) -> Result<Left> {
        match self {
            Code::Script(script) => script.run(task, how),
            Code::Protocol(protocol) => protocol.run(task, how),
        }
    }

    /// What it answered, in a folder that [`How::into`] named.
    ///
    /// # Errors
    /// Files that are not there or cannot be read.
    pub fn left(&self, folder: &Path, seconds: f64) -> Result<Left> {
        self.files().left(folder, seconds)
    }

    /// What its answer depends on besides its task.
    ///
    /// # Errors
    /// Programs that cannot be asked, and scripts that cannot be read.
    pub fn identity(&self) -> Result<Value> {
        match self {
            Code::Script(script) => script.identity(),
            Code::Protocol(of) => Ok(json!({
                "engine": of.engine.identity()?,
                "scene": format!("{:?}", of.scene),
                "method": of.method.to_string(),
            })),
        }
    }
}

impl Protocol {
    /// An engine by the name that it has in the face-off.
    pub fn new(name: &str, engine: Box<dyn Engine>, scene: Scene, method: Method) -> Self {
        let files = Script {
            name: name.to_owned(),
            command: Vec::new(),
            home: ".".into(),
            mesh: None,
            results: vec![FIELD.to_owned()],
            numbers: None,
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
        let beside;
        let folder = match &how.into {
            Some(into) => {
                std::fs::create_dir_all(into).map_err(Error::io(into, "make"))?;
                into
            }
            None => {
                beside = Temporary::new()?;
                beside.path()
            }
        };
        let (mesh, field) = function::broken(&case.problem, "u", &answer.u);
        let encoding = vtu::Encoding::Base64(vtu::Compressor::Zlib);
        vtu::write(&folder.join(FIELD), &mesh, &[field], &[], encoding)?;
        self.files.left(folder, seconds)
    }
}
