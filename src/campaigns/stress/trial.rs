//! A problem at an extreme, and the moderate one for comparison.

use std::sync::Arc;

use crate::engine::Settings;
use crate::run::{Setup, Variation};
use crate::text::{Number, Text};
use faceoff_fem::contact::Method;
use faceoff_fem::scene::{Expression, Scene};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::{Mesh, Triangulation};

/// A scene on a mesh that may not be solvable.
#[derive(Clone)]
pub struct Place {
    pub scene: Scene,
    name: String,
    pub mesh: Mesh,
    /// The extreme setting of the discretisation.
    pub variation: Option<Variation>,
}

/// One extreme.
pub struct Trial {
    /// The family of the extreme.
    pub family: &'static str,
    /// The extreme value.
    pub value: Text,
    /// The problem to solve.
    pub extreme: Place,
    /// The original problem, in whose units the answer is judged, with the exact solution: the same cells in the same order. `None`:
    /// the extreme problem.
    pub home: Option<Place>,
    /// u of the extreme problem is this times u of the original.
    pub scale: f64,
    /// The moderate problem whose error is the reference; `None`: the original.
    pub reference: Option<Place>,
    /// The method that solves the reference, if it differs.
    pub reference_method: Option<Method>,
    /// An error is accepted up to this many times that of the reference.
    pub room: f64,
    /// There is no solution: the only right answer is a refusal.
    pub must_refuse: bool,
    /// The extreme belongs to the method, whose exact discrete solution may have any error.
    pub is_parameter: bool,
    /// Takes seconds.
    pub is_heavy: bool,
}

/// 10^exponent in a sentence.
pub fn ten(exponent: i32) -> Number {
    // The digits of the power itself, which a product of tens may miss.
    Number::power(format!("1e{exponent}").parse().unwrap_or(f64::NAN))
}

impl Trial {
    /// A trial that is judged in its own units and compared with `reference`.
    pub fn new(family: &'static str, value: impl Into<Text>, extreme: Place) -> Self {
        Trial {
            family,
            value: value.into(),
            extreme,
            home: None,
            scale: 1.0,
            reference: None,
            reference_method: None,
            room: 1.1,
            must_refuse: false,
            is_parameter: false,
            is_heavy: false,
        }
    }

    /// The problem that the answer is compared with.
    pub fn reference(&self) -> &Place {
        let other = self.reference.as_ref().or(self.home.as_ref());
        other.unwrap_or(&self.extreme)
    }
}

impl Place {
    /// A scene on its own mesh.
    ///
    /// # Errors
    /// An n that the mesh cannot have.
    pub fn of(scene: &Scene, n: Option<usize>) -> Result<Self> {
        let (name, mesh) = scene.mesh(n)?;
        Ok(Place::on(scene.clone(), &name, mesh))
    }

    /// A scene on any mesh.
    pub fn on(scene: Scene, name: &str, mesh: Mesh) -> Self {
        Place {
            scene,
            name: name.to_owned(),
            mesh,
            variation: None,
        }
    }

    /// Everything that the answer depends on.
    ///
    /// # Errors
    /// A mesh on which the problem cannot be solved.
    pub fn setup(&self, method: Method, settings: &Settings) -> Result<Setup> {
        let mesh = Arc::new(Triangulation::new(&self.name, &self.mesh)?);
        Setup::on(mesh, &self.scene, None, method, settings).varied(self.variation.as_ref())
    }
}

/// An expression by modifying the text of another.
pub fn rewritten(of: &Expression, change: impl Fn(&str) -> String) -> Result<Expression> {
    let text = change(of.text());
    Expression::parse(&text).map_err(|e| Error::Scene {
        scene: "stress".into(),
        place: format!("character {}", e.column),
        what: format!("{} in `{text}`", e.what),
        remedy: "give a scene with shorter formulas".into(),
    })
}
