//! A folder that holds one report: filled beside, then put in place file by file.

use std::fs;
use std::path::Path;

use faceoff_mesh::error::{Error, Result};

/// Refuses a folder that a report would be mixed into: it must be missing, empty, or hold `marker`, an earlier
/// report's own file.
///
/// # Errors
/// A file, or a folder with other things.
pub fn check_report_folder(folder: &Path, marker: &str) -> Result<()> {
    if !folder.exists() {
        return Ok(());
    }
    let refuse = |what: &str| {
        Err(Error::usage(
            format!("{} {what}", folder.display()),
            "name another folder; nothing was touched",
        ))
    };
    if !folder.is_dir() {
        return refuse("is there and is no folder");
    }
    let mut entries = fs::read_dir(folder).map_err(Error::io(folder, "read"))?;
    if entries.next().is_some() && !folder.join(marker).is_file() {
        return refuse("is not empty and holds no earlier report");
    }
    Ok(())
}

/// Lets `fill` write into a new folder beside, and moves its files into `folder`.
///
/// # Errors
/// What `fill` returns, and files that cannot be moved. Nothing is left of a report that was not finished.
pub fn write_report_folder(folder: &Path, fill: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    fs::create_dir_all(folder).map_err(Error::io(folder, "make"))?;
    let beside = tempfile::Builder::new()
        .prefix(".faceoff-")
        .tempdir_in(folder)
        .map_err(Error::io(folder, "write in"))?;
    fill(beside.path())?;
    for entry in fs::read_dir(beside.path()).map_err(Error::io(beside.path(), "read"))? {
        let entry = entry.map_err(Error::io(beside.path(), "read"))?;
        let target = folder.join(entry.file_name());
        fs::rename(entry.path(), &target).map_err(Error::io(&target, "write"))?;
    }
    Ok(())
}
