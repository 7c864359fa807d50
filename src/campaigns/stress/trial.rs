//! A problem at an extreme, and the moderate one it is judged by.

use std::sync::Arc;

use crate::engine::Settings;
use crate::run::{Setup, Variation};
use crate::text::{Number, Text};
use faceoff_fem::contact::Method;
use faceoff_fem::scene::{Expression, Scene};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::{Mesh, Triangulation};

/// A scene on a mesh, of which nobody knows yet whether it can be solved on.
#[derive(Clone)]
pub struct Place {
    pub scene: Scene,
    name: String,
    pub mesh: Mesh,
    /// What of the discretisation is extreme.
    pub variation: Option<Variation>,
}

/// One extreme.
pub struct Trial {
    /// What is extreme.
    pub family: &'static str,
    /// How extreme.
    pub value: Text,
    /// What is solved.
    pub extreme: Place,
    /// The problem in whose units the answer is judged, with the exact solution: the same cells in the same order. None:
    /// the extreme itself.
    pub home: Option<Place>,
    /// u of the extreme is this times u at home.
    pub scale: f64,
    /// The moderate problem whose error the extreme's is compared with; none: home.
    pub reference: Option<Place>,
    /// The method that solves the reference, where it is not the same.
    pub reference_method: Option<Method>,
    /// An error up to so many times the reference's is as good.
    pub room: f64,
    /// There is no solution: the only right answer is a refusal.
    pub must_refuse: bool,
    /// The extreme belongs to the method: its exact discrete solution has whatever error it has.
    pub is_parameter: bool,
    /// Takes seconds.
    pub is_heavy: bool,
}

/// 10^exponent in a sentence.
pub fn ten(exponent: i32) -> Number {
    // Its digits are those of the power itself, which a product of tens may miss.
    Number::power(format!("1e{exponent}").parse().unwrap_or(f64::NAN))
}

impl Trial {
    /// A trial that is judged by itself and compared with `reference`.
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

    /// What the answer is held against.
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

    /// Everything that its answer depends on.
    ///
    /// # Errors
    /// A mesh that no problem can be solved on.
    pub fn setup(&self, method: Method, settings: &Settings) -> Result<Setup> {
        let mesh = Arc::new(Triangulation::new(&self.name, &self.mesh)?);
        Setup::on(mesh, &self.scene, None, method, settings).varied(self.variation.as_ref())
    }
}

/// An expression from the text of another, changed.
pub fn rewritten(of: &Expression, change: impl Fn(&str) -> String) -> Result<Expression> {
    let text = change(of.text());
    Expression::parse(&text).map_err(|e| Error::Scene {
        scene: "stress".into(),
        place: format!("character {}", e.column),
        what: format!("{} in `{text}`", e.what),
        remedy: "give a scene with shorter formulas".into(),
    })
}
