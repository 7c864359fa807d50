//! Stress tests: problems whose solution is known, taken to extremes, and the answers of each engine and method.

mod bodies;
mod judge;
mod scaling;
mod shapes;
mod states;
mod trial;
#[cfg(test)]
mod unit_tests;

use serde::Serialize;

pub use judge::{Behaviour, Entry};
pub use trial::Trial;

use crate::engine::{Engine, Progress, Settings};
use crate::run::Runner;
use faceoff_fem::contact::Method;
use faceoff_fem::scene::Scene;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};

/// The trials to run.
pub struct StressRequest {
    /// Scenes with an exact solution, whose data, domain and γ₀ are taken to extremes.
    pub scenes: Vec<Scene>,
    /// The families; empty: all.
    pub families: Vec<String>,
    /// The methods for each extreme.
    pub methods: Vec<Method>,
    /// The engines for each.
    pub engines: Vec<Box<dyn Engine>>,
    /// The settings of every solve.
    pub settings: Settings,
    /// Whether to leave out slow trials.
    pub is_brief: bool,
}

/// The map of results.
#[derive(Debug, Serialize)]
pub struct StressOutcome {
    /// Engine and version.
    pub engines: Vec<(String, String)>,
    /// By engine, family, value and method, in the order of the trials.
    #[serde(rename = "cells")]
    pub entries: Vec<Entry>,
}

/// Takes every scene and built-in problem to its extremes with every engine and method.
///
/// # Errors
/// A scene whose solution is not known; an unknown family; an engine that is not installed; an interruption. Refusals
/// and wrong answers of an engine are part of the outcome.
pub fn stress(request: &StressRequest, progress: &dyn Progress) -> Result<StressOutcome> {
    let trials = trials(request)?;
    let runner = Runner::new(&request.settings, progress);
    let (mut engines, mut entries) = (Vec::new(), Vec::new());
    let all = request.engines.len() * request.methods.len();
    for (index, engine) in request.engines.iter().enumerate() {
        let mut by_method = Vec::new();
        for (k, method) in request.methods.iter().enumerate() {
            if engine.accepts(method).is_err() {
                continue;
            }
            cancel::check()?;
            let share = (index * request.methods.len() + k) as f64 / all as f64;
            progress.next(&format!("{} {method}", engine.name()), share);
            by_method.push(judge::judge(&runner, &**engine, *method, &trials)?.into_iter());
        }
        engines.push((engine.name().to_owned(), runner.version(&**engine)?));
        // By trial, then by method.
        for _ in &trials {
            entries.extend(by_method.iter_mut().filter_map(Iterator::next));
        }
    }
    Ok(StressOutcome { engines, entries })
}

/// All trials of the requested families.
fn trials(request: &StressRequest) -> Result<Vec<Trial>> {
    let mut all = Vec::new();
    for scene in &request.scenes {
        if scene.exact().is_none() {
            return Err(Error::Scene {
                scene: scene.name().to_owned(),
                place: "exact".into(),
                what: "its solution is not known, so the error at an extreme cannot be measured"
                    .into(),
                remedy: "give u under [exact], or one of the built-in scenes that have it".into(),
            });
        }
        all.extend(scaling::trials(scene)?);
    }
    all.extend(shapes::trials()?);
    all.extend(shapes::sizes()?);
    all.extend(states::trials()?);
    all.extend(bodies::trials()?);
    let mut names: Vec<&str> = all.iter().map(|trial| trial.family).collect();
    names.dedup();
    let unknown = |family: &&String| !names.contains(&family.as_str());
    if let Some(family) = request.families.iter().find(unknown) {
        names.sort_unstable();
        names.dedup();
        return Err(Error::usage(
            format!("there is no family `{family}`"),
            format!("use {}", names.join(", ")),
        ));
    }
    let asked =
        |family: &str| request.families.is_empty() || request.families.iter().any(|f| f == family);
    all.retain(|trial| asked(trial.family) && !(request.is_brief && trial.is_heavy));
    Ok(all)
}
