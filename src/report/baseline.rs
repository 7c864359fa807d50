//! The answers of a run, kept as a baseline for machines that do not have its engines.

use std::path::Path;

use super::folder::{check_folder, write_folder};
use crate::engine::{BASELINE, Case, Kept, record};
use crate::verify::{Outcome, Request};
use faceoff_fem::contact::Problem;
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Result};

/// Refuses a folder that a baseline would be mixed into.
///
/// # Errors
/// A file, or a folder with other things.
pub fn check_baseline_folder(folder: &Path) -> Result<()> {
    check_folder(folder, |folder| folder.join(BASELINE).is_file())
}

/// Writes what every engine but ours answered.
///
/// # Errors
/// A run whose codes do not agree, and files that cannot be written.
pub fn write_baseline(
    folder: &Path,
    recipe: &str,
    request: &Request,
    outcome: &Outcome,
) -> Result<()> {
    if outcome.verdict != Verdict::Agree {
        return Err(Error::usage(
            "nothing was recorded, as the codes do not agree",
            "a baseline holds only what all codes answer alike: settle the difference first",
        ));
    }
    let found: Vec<_> = outcome
        .cases
        .iter()
        .filter_map(|case| {
            let scene = request.scenes.iter().find(|s| s.name == case.scene)?;
            let method = request
                .methods
                .iter()
                .find(|m| m.to_string() == case.method)?;
            Some((case, scene, method))
        })
        .collect();
    let meshes = found
        .iter()
        .map(|(case, scene, _)| scene.triangulation(case.n))
        .collect::<Result<Vec<_>>>()?;
    let mut cases = Vec::new();
    for ((case, scene, method), mesh) in found.into_iter().zip(&meshes) {
        let problem = Problem::new(scene, mesh, *method)?;
        let others = case.engines.iter().filter(|e| e.engine != "rust");
        let kept = others.map(|e| Kept {
            engine: &e.engine,
            version: &e.version,
            increments: &e.increments,
            residual: e.residual,
            u: &e.u,
        });
        let n = case.n;
        cases.push((Case { scene, n, problem }, kept.collect()));
    }
    write_folder(folder, |beside| {
        record(beside, recipe, &request.settings, &cases)
    })
}
