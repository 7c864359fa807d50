//! A scene with what is known of its solution.

use std::sync::Arc;

use faceoff_fem::known::Truth;
use faceoff_fem::scene::Scene;
use faceoff_mesh::error::Result;

/// A scene, and its truth.
#[derive(Clone)]
pub struct Subject {
    /// The name or the path that it was found by.
    pub argument: String,
    /// The problem.
    pub scene: Scene,
    /// Does its mesh lie where the user had to allow it?
    pub is_trusted: bool,
    /// Where it is known; else only bounds of the error are to be had.
    pub truth: Option<Arc<Truth>>,
}

impl Subject {
    /// A scene that was found by a name or a path.
    ///
    /// # Errors
    /// Those of [`Truth::of`].
    pub fn new(argument: &str, scene: Scene, is_trusted: bool) -> Result<Self> {
        Ok(Subject {
            argument: argument.to_owned(),
            truth: Truth::of(&scene)?.map(Arc::new),
            scene,
            is_trusted,
        })
    }
}
