//! The answers of a run, kept as a baseline for machines that do not have its engines.

use std::path::Path;

use super::folder::{check_folder, write_folder};
use crate::campaigns::verify::{VerifyOutcome, VerifyRequest};
use crate::engine::{self, BASELINE, Kept, record};
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
    request: &VerifyRequest,
    outcome: &VerifyOutcome,
) -> Result<()> {
    if !outcome.verdict.passes() {
        return Err(Error::usage(
            "nothing was recorded, as the codes do not agree",
            "a baseline holds only what all codes answer alike: settle the difference first",
        ));
    }
    let mut cases = Vec::new();
    for case in &outcome.cases {
        let of = case.setup.case()?;
        let others = case.engines.iter().filter(|e| e.engine != engine::OWN);
        let kept = others.map(|e| Kept::new(&e.engine, &e.version, &of, &e.answer));
        let kept = kept.map(Kept::without_times).collect();
        cases.push((of, kept));
    }
    write_folder(folder, |beside| {
        record(beside, recipe, &request.settings, cases)
    })
}
