//! A folder for one report: it is filled under a temporary name, then moved file by file.

use std::fs;
use std::io::Write as _;
use std::path::{Component, Path};

use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::file;

/// Refuses a folder that a report would be mixed with: it must be missing, empty, or contain an earlier report, which
/// `is_earlier` recognises.
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
        return refuse("is not a folder");
    }
    let mut entries = fs::read_dir(folder).map_err(Error::io(folder, "read"))?;
    if entries.next().is_some() && !is_earlier(folder) {
        return refuse("is not empty and holds no earlier report");
    }
    Ok(())
}

/// Lets `fill` write into a temporary folder, and moves its files into `folder`.
///
/// # Errors
/// Errors of `fill`, and files that cannot be moved. An unfinished report leaves no files.
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

/// [`write_folder`] for a report: files of an earlier one are removed, except a history; foreign files are kept.
///
/// # Errors
/// Those of [`write_folder`]; files that cannot be removed.
pub fn write_report(folder: &Path, fill: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    write_folder(folder, |beside| {
        fill(beside)?;
        let new = names(beside)?;
        let path = beside.join(LIST);
        let lasts = |name: &String| name.ends_with(".jsonl");
        let lines: Vec<&str> = new
            .iter()
            .filter(|n| !lasts(n))
            .map(String::as_str)
            .collect();
        fs::write(&path, lines.join("\n") + "\n").map_err(Error::io(&path, "write"))?;
        remove(folder, &new)
    })
}

/// Adds the folder of a page to the list of files of the report that it belongs to.
///
/// # Errors
/// A list that cannot be written.
pub fn list(folder: &Path, name: &str) -> Result<()> {
    let path = folder.join(LIST);
    let file = fs::OpenOptions::new().append(true).open(&path);
    let written = file.and_then(|mut file| writeln!(file, "{name}"));
    written.map_err(Error::io(&path, "write"))
}

/// Removes the files of an earlier report, except those with these names, and the folders of pages with their files.
fn remove(folder: &Path, but: &[String]) -> Result<()> {
    // A report of an earlier version has no list.
    let Ok(earlier) = file::text(&folder.join(LIST)) else {
        return Ok(());
    };
    let is_name = |name: &&str| {
        let mut parts = Path::new(name).components();
        matches!(
            (parts.next(), parts.next()),
            (Some(Component::Normal(_)), None)
        )
    };
    let is_old = |name: &&str| but.iter().all(|new| new != name);
    for name in earlier.lines().filter(is_name).filter(is_old) {
        let path = folder.join(name);
        let Ok(found) = fs::symlink_metadata(&path) else {
            continue;
        };
        if found.is_dir() {
            remove(&path, &[])?;
            // Foreign files stay.
            let _ = fs::remove_file(path.join(LIST)).and_then(|()| fs::remove_dir(&path));
        } else {
            fs::remove_file(&path).map_err(Error::io(&path, "remove"))?;
        }
    }
    Ok(())
}

/// The names of the files of a report, one per line, in its folder.
const LIST: &str = ".faceoff-report";

/// The names of all entries of a folder, sorted.
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
