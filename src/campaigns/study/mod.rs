//! What each digit costs: every engine and method on rising meshes, and every setting beside its neighbours, measured;
//! and advice that was measured as it is given.

mod adapted;
mod advice;
mod campaign;
mod front;
mod gamma;
mod measure;
mod rates;
mod row;
mod scaling;
mod settings;
mod subject;
mod targets;
mod waste;

use std::path::PathBuf;
use std::time::Duration;

use serde::Serialize;

pub use advice::{Advice, Alternative, NORMS, Norm, duration};
pub use campaign::study;
pub use front::front_in;
pub use gamma::{Gammas, Safe};
pub use rates::Rates;
pub use row::{Row, Times, Varied};
pub use scaling::Scaling;
pub use subject::Subject;
pub use targets::{Follow, Followed};
pub use waste::{HARMLESS, Waste, value};

use crate::engine::{Engine, Machine, Settings};
use faceoff_fem::contact::Method;

/// What is to be measured.
pub struct StudyRequest {
    /// Scenes.
    pub subjects: Vec<Subject>,
    /// By which each is solved.
    pub methods: Vec<Method>,
    /// With which each is solved.
    pub engines: Vec<Box<dyn Engine>>,
    /// Wall-clock time for everything: nothing is begun that is predicted to exceed it.
    pub budget: Duration,
    /// No finer uniform meshes than this n.
    pub finest: usize,
    /// Of every solve that does not vary them.
    pub settings: Settings,
    /// Where measurements are kept as they are made, and taken from.
    pub journal: Option<PathBuf>,
    /// What runs a command as it is advised; none: advice has the times of this process.
    pub follow: Option<Box<Follow>>,
}

/// Everything that was measured, and what follows from it.
#[derive(Debug, Serialize)]
pub struct StudyOutcome {
    /// Where it was measured.
    pub machine: Machine,
    /// Engine and version.
    pub engines: Vec<(String, String)>,
    /// Seconds that were allowed.
    pub budget: f64,
    /// Seconds that were spent.
    pub spent: f64,
    /// Every measurement, in the order that they were made.
    pub rows: Vec<Row>,
    /// Indices of the rows that no other row beats in both time and error.
    pub front: Vec<usize>,
    /// One for each scene, engine and method.
    pub rates: Vec<Rates>,
    /// Where time and memory have rates.
    pub scaling: Vec<Scaling>,
    /// Of every setting that was varied.
    pub waste: Vec<Waste>,
    /// Where γ₀ was varied.
    pub gammas: Vec<Gammas>,
    /// By scene, norm and error.
    pub advice: Vec<Advice>,
    /// What was asked for and not measured, and why.
    pub left_out: Vec<LeftOut>,
}

/// Something that was not measured.
#[derive(Debug, Clone, Serialize)]
pub struct LeftOut {
    /// What was to be measured.
    pub what: String,
    /// Why it was not.
    pub why: String,
}
