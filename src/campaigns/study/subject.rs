//! A scene with its known solution.

use std::sync::Arc;

use faceoff_fem::known::Truth;
use faceoff_fem::scene::Scene;
use faceoff_mesh::error::Result;

/// A scene, and what is known about its solution.
#[derive(Clone)]
pub struct Subject {
    /// The name or the path under which it was found.
    pub argument: String,
    /// The problem.
    pub scene: Scene,
    /// Is its mesh outside of the allowed folder, with the user's permission?
    pub is_trusted: bool,
    /// The solution, if it is known; otherwise there are only bounds of the error.
    pub truth: Option<Arc<Truth>>,
}

impl Subject {
    /// Finds a scene by its name or path.
    ///
    /// # Errors
    /// Errors of [`Truth::of`].
    pub fn new(argument: &str, scene: Scene, is_trusted: bool) -> Result<Self> {
        Ok(Subject {
            argument: argument.to_owned(),
            truth: Truth::of(&scene)?.map(Arc::new),
            scene,
            is_trusted,
        })
    }
}
