//! The answers of a run, kept as a baseline for machines that do not have its engines.

use std::path::Path;

use super::folder::{check_folder, names, write_folder};
use crate::campaigns::face_off::FaceOffOutcome;
use crate::campaigns::verify::{VerifyOutcome, VerifyRequest};
use crate::engine::{self, BASELINE, Kept, record};
use crate::run::Store;
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
/// Files that cannot be written.
pub fn write_baseline(
    folder: &Path,
    recipe: &str,
    request: &VerifyRequest,
    outcome: &VerifyOutcome,
) -> Result<()> {
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

/// Writes what every code of a face-off answered, as files of its own.
///
/// # Errors
/// Files that cannot be written.
pub fn write_record(
    folder: &Path,
    recipe: &str,
    store: &Store,
    outcome: &FaceOffOutcome,
) -> Result<()> {
    write_folder(folder, |beside| {
        store.record(beside, (&outcome.name, recipe), &outcome.asked())?;
        // Those of an earlier record cannot be moved onto.
        for name in names(beside)? {
            let old = folder.join(name);
            if old.is_dir() {
                std::fs::remove_dir_all(&old).map_err(Error::io(&old, "remove"))?;
            }
        }
        Ok(())
    })
}
