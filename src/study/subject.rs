//! A scene with what is known of its solution.

use faceoff_fem::contact::{Errors, Problem};
use faceoff_fem::known::Truth;
use faceoff_fem::scene::Scene;
use faceoff_mesh::error::Result;

/// A scene, and its truth.
#[derive(Clone)]
pub struct Subject {
    /// The name or the path that it was found by.
    pub argument: String,
    pub scene: Scene,
    /// None: only bounds of the error are to be had.
    truth: Option<Truth>,
}

impl Subject {
    /// A scene by a built-in's name or by the path of a TOML file.
    ///
    /// # Errors
    /// Those of [`Scene::find`].
    pub fn find(name: &str) -> Result<Self> {
        let scene = Scene::find(name)?;
        Ok(Subject {
            argument: name.to_owned(),
            truth: Truth::of(&scene)?,
            scene,
        })
    }

    /// The errors of u; none where the solution is not known.
    ///
    /// # Errors
    /// An exact solution that is not finite, or not known on this mesh.
    pub fn errors(&self, problem: &Problem, u: &[f64]) -> Result<Option<Errors>> {
        let errors = |truth: &Truth| truth.errors(problem, u);
        self.truth.as_ref().map(errors).transpose()
    }
}
