//! What breaks: problems whose solution is known, taken to extremes, and what each engine and method makes of them.

mod bodies;
mod judge;
mod scaling;
mod shapes;
mod states;
mod trial;
#[cfg(test)]
mod unit_tests;

use serde::Serialize;

pub use judge::{Cell, Verdict};
pub use trial::Trial;

use crate::engine::{Engine, Settings};
use faceoff_fem::contact::Method;
use faceoff_fem::scene::Scene;
use faceoff_mesh::error::{Error, Result};

/// What is to be tried.
pub struct Request {
    /// With an exact solution: those whose data, domain and γ₀ are taken to extremes.
    pub scenes: Vec<Scene>,
    /// None named: all.
    pub families: Vec<String>,
    pub methods: Vec<Method>,
    pub engines: Vec<Box<dyn Engine>>,
    pub settings: Settings,
    /// Without what takes seconds.
    pub is_brief: bool,
}

/// The map.
#[derive(Debug, Serialize)]
pub struct Outcome {
    /// Engine and version.
    pub engines: Vec<(String, String)>,
    /// By engine, family, value and method, in the order in which they were tried.
    pub cells: Vec<Cell>,
}

/// Is told what is tried next and the share that is done; may end the run.
pub type Watch<'a> = dyn Fn(&str, f64) -> Result<()> + 'a;

/// Tries everything.
///
/// # Errors
/// A scene without an exact solution, an unknown family, an engine that is not there, an interruption. What a trial
/// refuses is its verdict.
pub fn stress(request: &Request, watch: &Watch) -> Result<Outcome> {
    let trials = trials(request)?;
    let mut engines = Vec::new();
    let mut jobs = Vec::new();
    for engine in &request.engines {
        engines.push((engine.name().to_owned(), engine.probe()?));
        for trial in &trials {
            for method in &request.methods {
                if engine.accepts(method).is_ok() {
                    jobs.push((engine, trial, *method));
                }
            }
        }
    }
    let mut cells = Vec::new();
    for (k, (engine, trial, method)) in jobs.iter().enumerate() {
        let what = format!(
            "{} {method}, {} {}",
            engine.name(),
            trial.family,
            trial.value
        );
        watch(&what, k as f64 / jobs.len() as f64)?;
        cells.push(judge::judge(&***engine, trial, *method, &request.settings)?);
    }
    Ok(Outcome { engines, cells })
}

/// All trials of the families that are asked for.
fn trials(request: &Request) -> Result<Vec<Trial>> {
    let mut all = Vec::new();
    for scene in &request.scenes {
        if scene.exact.is_none() {
            return Err(Error::Scene {
                scene: scene.name.clone(),
                place: "exact".into(),
                what: "its solution is not known, so nothing tells what an extreme costs".into(),
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
