//! The files of two folders, by name.

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::io::{self, Format, matches};

/// The largest depth of nested folders.
const DEPTH: usize = 32;

/// The files that are compared.
pub(super) struct Files {
    /// Each file below the folders, and whether each of them has it.
    pub files: BTreeMap<PathBuf, [bool; 2]>,
    /// Possible results that cannot be read, with the reason.
    pub unread: Vec<(PathBuf, String)>,
    /// The files that are not compared.
    pub notes: Vec<String>,
}

/// All files of either folder that match a pattern of `include`, by their name or their path below the folder, and none of
/// `exclude`. Without `include`: all that can be results, but for those that a list among them names.
pub(super) fn files(a: &Path, b: &Path, include: &[String], exclude: &[String]) -> Result<Files> {
    let mut found = Files {
        files: BTreeMap::new(),
        unread: Vec::new(),
        notes: Vec::new(),
    };
    for (k, folder) in [a, b].into_iter().enumerate() {
        let (mut all, mut unread) = (Vec::new(), Vec::new());
        walk(folder, Path::new(""), 0, &mut all, &mut unread)?;
        let named = |patterns: &[String], path: &Path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            patterns
                .iter()
                .any(|p| matches(p, &name) || matches(p, &path.to_string_lossy()))
        };
        unread.retain(|(path, _)| !named(exclude, path));
        found.unread.append(&mut unread);
        all.retain(|path| !named(exclude, path) && (include.is_empty() || named(include, path)));
        if include.is_empty() {
            let (results, others): (Vec<_>, Vec<_>) =
                all.into_iter().partition(|path| can_be_result(path));
            if !others.is_empty() {
                let names: Vec<String> = others
                    .iter()
                    .take(3)
                    .map(|p| p.display().to_string())
                    .collect();
                let more = if others.len() > 3 { ", …" } else { "" };
                let note = format!(
                    "{} files in {} are not results, judging by their suffix: {}{more}",
                    others.len(),
                    folder.display(),
                    names.join(", ")
                );
                found.notes.push(note);
            }
            let mut listed = HashSet::new();
            for path in &results {
                let file = folder.join(path);
                // Errors in a list are reported where it is read.
                let sources = io::sources(&file).unwrap_or_default();
                listed.extend(sources.into_iter().filter(|source| *source != file));
            }
            all = results
                .into_iter()
                .filter(|path| !listed.contains(&folder.join(path)))
                .collect();
        }
        for path in all {
            found.files.entry(path).or_default()[k] = true;
        }
    }
    Ok(found)
}

fn can_be_result(path: &Path) -> bool {
    let suffix = path.extension().unwrap_or_default().to_ascii_lowercase();
    let known = ["csv", "sol", "pvd", "pvtu"];
    known.iter().any(|known| suffix == **known) || Format::of_suffix(path).is_some()
}

/// Adds the regular files below `folder`, by their path from there. Folders behind links are not entered, as they may lead in
/// circles, or out: they are unread, and so is anything that is neither a file nor a folder.
fn walk(
    folder: &Path,
    below: &Path,
    depth: usize,
    all: &mut Vec<PathBuf>,
    unread: &mut Vec<(PathBuf, String)>,
) -> Result<()> {
    let here = folder.join(below);
    for entry in std::fs::read_dir(&here).map_err(Error::io(&here, "list"))? {
        cancel::check()?;
        let entry = entry.map_err(Error::io(&here, "list"))?;
        let path = below.join(entry.file_name());
        let kind = entry.file_type().map_err(Error::io(&here, "list"))?;
        if kind.is_dir() {
            if depth == DEPTH {
                let what = format!("{} has folders in folders beyond {DEPTH}", folder.display());
                return Err(Error::usage(what, "compare the inner folders"));
            }
            walk(folder, &path, depth + 1, all, unread)?;
        } else if entry.path().is_file() {
            all.push(path);
        } else {
            let what = match (kind.is_symlink(), entry.path().is_dir()) {
                (true, true) => {
                    "is a link to a folder, which is not followed: compare what it leads to"
                }
                (true, false) => "is a link that leads to no file",
                (false, _) => "is neither a file nor a folder",
            };
            let why = format!(
                "{} {what}, or leave it out with --exclude",
                entry.path().display()
            );
            unread.push((path, why));
        }
    }
    Ok(())
}
