//! A folder that holds one report: filled beside, then put in place file by file.

use std::fs;
use std::path::Path;

use faceoff_mesh::error::{Error, Result};

/// Refuses a folder that a report would be mixed into: it must be missing, empty, or hold an earlier report, by which
/// `is_earlier` knows it.
///
/// # Errors
/// A file, or a folder with other things.
pub fn check_folder(folder: &Path, is_earlier: impl Fn(&Path) -> bool) -> Result<()> {
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
        return refuse("is no folder");
    }
    let mut entries = fs::read_dir(folder).map_err(Error::io(folder, "read"))?;
    if entries.next().is_some() && !is_earlier(folder) {
        return refuse("is not empty and holds no earlier report");
    }
    Ok(())
}

/// Lets `fill` write into a new folder beside, and moves its files into `folder`.
///
/// # Errors
/// What `fill` returns, and files that cannot be moved. Nothing is left of a report that was not finished.
pub fn write_folder(folder: &Path, fill: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    fs::create_dir_all(folder).map_err(Error::io(folder, "make"))?;
    let beside = tempfile::Builder::new()
        .prefix(".faceoff-")
        .tempdir_in(folder)
        .map_err(Error::io(folder, "write in"))?;
    fill(beside.path())?;
    for name in names(beside.path())? {
        let target = folder.join(&name);
        fs::rename(beside.path().join(&name), &target).map_err(Error::io(&target, "write"))?;
    }
    Ok(())
}

/// What is in a folder, sorted.
///
/// # Errors
/// A folder that cannot be read.
pub fn names(folder: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(Error::io(folder, "read"))? {
        let entry = entry.map_err(Error::io(folder, "read"))?;
        names.push(entry.file_name().to_string_lossy().into_owned());
    }
    names.sort();
    Ok(names)
}
