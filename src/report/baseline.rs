//! The answers of a run, stored as a baseline for machines without its engines.

use std::path::Path;

use super::folder::{check_folder, names, write_folder};
use crate::campaigns::verify::VerifyOutcome;
use crate::engine::{OWN, Settings};
use crate::run::{BASELINE, Record};
use faceoff_mesh::error::{Error, Result};

/// Refuses a folder with other contents, which a baseline would be mixed with.
///
/// # Errors
/// A file, or a folder with other things.
pub fn check_baseline_folder(folder: &Path) -> Result<()> {
    check_folder(folder, |folder| folder.join(BASELINE).is_file())
}

/// The answers of all engines except ours.
///
/// # Errors
/// Only those of cases that could not be solved either.
pub fn baseline(recipe: &str, settings: &Settings, outcome: &VerifyOutcome) -> Result<Record> {
    let mut record = Record::of_settings(recipe, settings);
    for of in &outcome.cases {
        let case = of.setup.case()?;
        for engine in of.engines.iter().filter(|of| of.engine != OWN) {
            let by = [&*engine.engine, &*engine.version];
            record.add_answer(by, &case, &engine.answer);
        }
    }
    Ok(record)
}

/// Writes the record that `make` returns into a folder, together with its files.
///
/// # Errors
/// Errors of `make`; files that cannot be written.
pub fn write_record(folder: &Path, make: impl FnOnce(&Path) -> Result<Record>) -> Result<()> {
    write_folder(folder, |beside| {
        make(beside)?.write(beside)?;
        // A folder cannot be moved onto one of an earlier record.
        for name in names(beside)? {
            let old = folder.join(name);
            if old.is_dir() {
                std::fs::remove_dir_all(&old).map_err(Error::io(&old, "remove"))?;
            }
        }
        Ok(())
    })
}
