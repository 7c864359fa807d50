//! Files that only list others: ParaView's `.pvd`, which names a `.vtu` or `.pvtu` for each time, and a `.pvtu`, which
//! names its pieces.

use std::collections::HashSet;
use std::hash::Hash;
use std::path::{Path, PathBuf};

use super::{bytes, pattern, xml};
use crate::error::{Error, Result};
use crate::file;

/// The deepest nesting: a `.pvd` lists a `.pvtu`, which lists pieces.
const DEPTH: usize = 3;

/// The suffixes of files that list pieces.
const PIECES: [&str; 5] = ["pvtu", "pvtp", "pvti", "pvtr", "pvts"];

pub(super) fn is_pvd(path: &Path) -> bool {
    has_suffix(path, "pvd")
}

pub(super) fn has_suffix(path: &Path, suffix: &str) -> bool {
    path.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case(suffix))
}

/// A time, and the files that make up the result then.
type Listed = (f64, Vec<PathBuf>);

/// The files that a `.pvd` names, by their times, ascending, and whether it states any time.
///
/// # Errors
/// A list that cannot be read, or whose times are not numbers.
pub(super) fn by_time(path: &Path) -> Result<(Vec<Listed>, bool)> {
    let bytes = bytes::read(path).map_err(Error::io(path, "read"))?;
    let mut entries = Vec::new();
    let listed = entries_of(path, &bytes)?;
    let is_timed = listed.iter().any(|(time, _)| time.is_some());
    for (time, file) in listed {
        // Without times, the order is all there is.
        let time = match time {
            None => entries.len() as f64,
            Some(text) => text
                .trim()
                .parse()
                .ok()
                .filter(|t: &f64| t.is_finite())
                .ok_or_else(|| {
                    let remedy = "write the list again, or give a .vtu file that it lists";
                    Error::whole(path, format!("{text:?} is not a time"), remedy)
                })?,
        };
        entries.push((time, file));
    }
    entries.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut times: Vec<(f64, Vec<PathBuf>)> = Vec::new();
    for (time, file) in entries {
        match times.last_mut() {
            Some((last, files)) if *last == time => files.push(file),
            _ => times.push((time, vec![file])),
        }
    }
    times.iter_mut().for_each(|(_, files)| keep_once(files));
    Ok((times, is_timed))
}

/// The one file that a `.pvd` names.
///
/// # Errors
/// Not XML; a list of no file, or of several, from which the user must choose.
pub(super) fn only_file(path: &Path, bytes: &[u8]) -> Result<PathBuf> {
    let files = listed(path, bytes)?;
    if let [one] = &files[..] {
        return Ok(one.clone());
    }
    let names: Vec<String> = files
        .iter()
        .take(3)
        .map(|f| f.display().to_string())
        .collect();
    let more = if files.len() > 3 { ", …" } else { "" };
    let what = format!("it lists {} files: {}{more}", files.len(), names.join(", "));
    let remedy = "give one of them: a comparison is of one time";
    Err(Error::whole(path, what, remedy))
}

/// The files that hold the data of `path`, each once: itself, or those it lists, or those whose names it is a pattern of.
/// dolfinx 0.5 lists a piece once for each kind of function in it.
///
/// # Errors
/// A list that cannot be read.
pub fn sources(path: &Path) -> Result<Vec<PathBuf>> {
    let mut found = match pattern::is_pattern(path) {
        true => pattern::files(path)?,
        false => vec![path.to_owned()],
    };
    for _ in 0..DEPTH {
        let mut next = Vec::new();
        for file in found {
            if is_pvd(&file) || PIECES.iter().any(|suffix| has_suffix(&file, suffix)) {
                let bytes = bytes::read(&file).map_err(Error::io(&file, "read"))?;
                next.extend(listed(&file, &bytes)?);
            } else {
                next.push(file);
            }
        }
        keep_once(&mut next);
        found = next;
    }
    Ok(found)
}

/// Keeps the first of equal items.
fn keep_once<K: Clone + Eq + Hash>(items: &mut Vec<K>) {
    let mut seen = HashSet::new();
    items.retain(|item| seen.insert(item.clone()));
}

/// `file` of each `<DataSet>` and `Source` of each `<Piece>`, in the folder of `path` or below.
fn listed(path: &Path, bytes: &[u8]) -> Result<Vec<PathBuf>> {
    let entries = entries_of(path, bytes)?;
    Ok(entries.into_iter().map(|(_, file)| file).collect())
}

/// The same with the time of each, as it is written.
fn entries_of(path: &Path, bytes: &[u8]) -> Result<Vec<(Option<String>, PathBuf)>> {
    let refuse = |what: String| {
        let remedy = "write the list again, or give a .vtu file that it lists";
        Error::whole(path, what, remedy)
    };
    let text = std::str::from_utf8(bytes).map_err(|_| refuse("the XML is not UTF-8".into()))?;
    let tree = xml::parse(text).map_err(|(_, what)| refuse(what))?;
    let mut files = Vec::new();
    for element in &tree.elements {
        let key = match element.name.as_str() {
            "DataSet" => "file",
            "Piece" => "Source",
            _ => continue,
        };
        let name = element.exact(key);
        let name = name.ok_or_else(|| refuse("an entry does not name its file".into()))?;
        let file = file::beneath(&path.with_file_name(""), name);
        let outside = || {
            refuse(format!(
                "{name:?} is not in the folder of this file or below it"
            ))
        };
        let time = element.exact("timestep").map(str::to_owned);
        files.push((time, file.ok_or_else(outside)?));
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    const HEAD: &str = "<VTKFile type=\"Collection\"><Collection>";

    #[test]
    fn a_list_is_followed_to_the_files_with_the_values() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let pvd = format!(
            "{HEAD}<DataSet timestep=\"0\" part=\"0\" file=\"a&amp;.pvtu\"/></Collection></VTKFile>"
        );
        std::fs::write(at("a.pvd"), &pvd).unwrap();
        let piece = |name: &str| format!("<Piece Source=\"{name}\"/>");
        let pieces = ["p0.vtu", "sub/p1.vtu", "p0.vtu"].map(piece).concat();
        std::fs::write(at("a&.pvtu"), format!("<VTKFile>{pieces}</VTKFile>")).unwrap();
        assert_eq!(
            only_file(&at("a.pvd"), pvd.as_bytes()).unwrap(),
            at("a&.pvtu")
        );
        assert_eq!(
            sources(&at("a.pvd")).unwrap(),
            [at("p0.vtu"), at("sub/p1.vtu")]
        );
        assert_eq!(sources(&at("x.vtu")).unwrap(), [at("x.vtu")]);
        assert!(sources(&at("none.pvd")).is_err());
    }

    thread_local! {
        static COMPARED: Cell<usize> = const { Cell::new(0) };
    }

    /// A name that counts how often it is compared.
    #[derive(Debug, Clone)]
    struct Counted(usize);

    impl Hash for Counted {
        fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
            self.0.hash(state);
        }
    }

    impl PartialEq for Counted {
        fn eq(&self, other: &Self) -> bool {
            COMPARED.set(COMPARED.get() + 1);
            self.0 == other.0
        }
    }

    impl Eq for Counted {}

    /// Twice the entries take twice the work, and not four times as if each were compared with all others.
    #[test]
    fn the_work_for_a_list_grows_like_the_list() {
        let work = |count: usize| {
            COMPARED.set(0);
            let mut names: Vec<Counted> = (0..2 * count).map(|k| Counted(k / 2)).collect();
            keep_once(&mut names);
            assert_eq!(names.len(), count);
            COMPARED.get()
        };
        let [few, many] = [2_000, 4_000].map(work);
        assert!(
            many < 3 * few,
            "{many} comparisons for 4000 entries, {few} for 2000"
        );
    }

    #[test]
    fn a_list_that_is_no_one_file_is_refused() {
        let entry = |name: &str| format!("<DataSet file=\"{name}\"/>");
        for (entries, part) in [
            (String::new(), "it lists 0 files"),
            (entry("a.vtu") + &entry("b.vtu"), "it lists 2 files: "),
            (entry("../a.vtu"), "not in the folder of this file"),
            (entry("/etc/a.vtu"), "not in the folder of this file"),
            ("<DataSet/>".into(), "does not name its file"),
            ("<DataSet".into(), "not well-formed"),
        ] {
            let error = only_file(Path::new("l.pvd"), format!("{HEAD}{entries}").as_bytes());
            let error = error.unwrap_err().to_string();
            assert!(error.contains(part), "{entries}: {error}");
        }
    }
}
