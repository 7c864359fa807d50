//! The cost of accuracy: measures every engine and method on finer and finer meshes and with varied settings,
//! and gives advice that was measured as advised.

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

/// The measurements to make.
pub struct StudyRequest {
    /// Scenes.
    pub subjects: Vec<Subject>,
    /// The methods for each scene.
    pub methods: Vec<Method>,
    /// The engines for each.
    pub engines: Vec<Box<dyn Engine>>,
    /// Wall-clock time for everything: nothing is begun that is predicted to exceed it.
    pub budget: Duration,
    /// The finest uniform meshes have this n.
    pub finest: usize,
    /// The settings of every solve that does not vary them.
    pub settings: Settings,
    /// Where measurements are stored as they are made, and read from.
    pub journal: Option<PathBuf>,
    /// Runs an advised command; `None`: advice has the times of this process.
    pub follow: Option<Box<Follow>>,
}

/// All measurements, and the conclusions.
#[derive(Debug, Serialize)]
pub struct StudyOutcome {
    /// The machine.
    pub machine: Machine,
    /// Engine and version.
    pub engines: Vec<(String, String)>,
    /// The time budget in seconds.
    pub budget: f64,
    /// The time spent in seconds.
    pub spent: f64,
    /// Every measurement, in the order that they were made.
    pub rows: Vec<Row>,
    /// Indices of the rows that no other row beats in both time and error.
    pub front: Vec<usize>,
    /// One for each scene, engine and method.
    pub rates: Vec<Rates>,
    /// Fits of time and memory, where they exist.
    pub scaling: Vec<Scaling>,
    /// For every setting that was varied.
    pub waste: Vec<Waste>,
    /// For every track whose γ₀ was varied.
    pub gammas: Vec<Gammas>,
    /// By scene, norm and error.
    pub advice: Vec<Advice>,
    /// Requested measurements that were not made, and why.
    pub left_out: Vec<LeftOut>,
}

/// Something that was not measured.
#[derive(Debug, Clone, Serialize)]
pub struct LeftOut {
    /// The measurement.
    pub what: String,
    /// Why it was not.
    pub why: String,
}
