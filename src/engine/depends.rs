//! The dependencies of a program's answer: the program, the files that its command names, what these may import, and the data
//! in their folders that any of these mentions.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::digest;
use super::process::find_in_path;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::file;
use faceoff_mesh::io::matches;

/// Suffixes of files that interpreters and linkers load by a name without suffix or from a list of folders.
const LOADED: [&str; 30] = [
    "py", "pyx", "pxd", "pth", "so", "pyd", "dll", "dylib", "a", "o", "edp", "idp", "jl", "lua",
    "m", "r", "pl", "rb", "js", "sh", "f", "f90", "mod", "c", "cc", "cpp", "cu", "h", "hpp", "ufl",
];

/// Characters at which shells split.
const BETWEEN: &str = " \t\n\"'`;|&<>()=:,";

/// Longer data are not searched for the names of further data.
const SEARCHED: usize = 1 << 22;

/// Most files and folders below one folder of scripts.
const MOST: usize = 20_000;

/// Digests of files by their path: from `home` where they are below it.
#[derive(Debug, Serialize)]
pub(super) struct Digests {
    /// The program, what its command names, and what may be loaded.
    files: BTreeMap<String, String>,
    /// Files that any of these mentions, which a program may also write while it runs.
    beside: BTreeMap<String, String>,
}

/// The dependencies of the answer of this command, run in `home`.
pub(super) fn digests(command: &[String], home: &Path) -> Result<Digests> {
    let home = match home.as_os_str().is_empty() {
        true => Path::new("."),
        false => home,
    };
    let home = &home.canonicalize().map_err(Error::io(home, "find"))?;
    let mut found = Found {
        home,
        files: BTreeSet::new(),
        data: BTreeMap::new(),
        written: BTreeSet::new(),
        folders: BTreeSet::new(),
        walked: BTreeSet::new(),
        seen: 0,
    };
    if let Some(program) = command.first() {
        let is_path = program.contains('/');
        let program = if is_path {
            home.join(program)
        } else {
            program.into()
        };
        found.files.extend(find_in_path(program));
    }
    for word in command {
        found.named(word);
        // Files that a shell command writes are not inputs.
        let mut is_written = false;
        for part in word.split_inclusive(|c| BETWEEN.contains(c)) {
            let name = part.trim_end_matches(|c| BETWEEN.contains(c));
            if !name.is_empty() {
                if is_written {
                    found.written.insert(home.join(name));
                } else {
                    found.named(name);
                }
                is_written = false;
            }
            is_written |= part.ends_with('>');
        }
    }
    let scripts = found.files.iter().filter(|path| is_loaded(path));
    let mut roots: BTreeSet<PathBuf> = scripts
        .filter_map(|p| Some(p.parent()?.to_owned()))
        .collect();
    roots.append(&mut found.folders);
    roots.insert(home.to_owned());
    for root in roots {
        found.walk(&root)?;
    }
    let mut spoken = Spoken::default();
    command.iter().for_each(|word| spoken.add(word.as_bytes()));
    let (mut files, mut beside) = (BTreeMap::new(), BTreeMap::new());
    let mut left = std::mem::take(&mut found.files);
    let mut is_data = false;
    // Files first, then data repeatedly, as each may mention more.
    while !is_data || !left.is_empty() {
        for path in left {
            cancel::check()?;
            let path = path.canonicalize().unwrap_or(path);
            let name = path.strip_prefix(home).unwrap_or(&path);
            let name = name.display().to_string();
            // What the command names in another way is not data in its folder.
            if files.contains_key(&name) {
                continue;
            }
            let bytes = file::read(&path)?;
            let of_kind = if is_data { &mut beside } else { &mut files };
            of_kind.insert(name, digest(&bytes));
            // System programs mention everything.
            let is_theirs = found.walked.iter().any(|root| path.starts_with(root));
            if is_theirs && (is_loaded(&path) || bytes.len() <= SEARCHED) {
                spoken.add(&bytes);
            }
        }
        let others = std::mem::take(&mut found.data).into_iter();
        let (meant, rest): (BTreeMap<_, _>, _) =
            others.partition(|(path, root)| spoken.is_of(path, root));
        (found.data, is_data) = (rest, true);
        left = meant.into_keys().collect();
    }
    Ok(Digests { files, beside })
}

/// Words in commands, scripts and data that may be names of files: each whole word, and its suffix from a dot on.
#[derive(Default)]
struct Spoken(HashSet<Vec<u8>>);

impl Spoken {
    fn add(&mut self, text: &[u8]) {
        let is_between =
            |byte: &u8| !(byte.is_ascii_alphanumeric() || b"-_.".contains(byte) || *byte >= 0x80);
        for word in text.split(is_between) {
            let end = word
                .iter()
                .rposition(|byte| *byte != b'.')
                .map_or(0, |k| k + 1);
            let word = &word[..end];
            let dots = (0..word.len()).filter(|&k| k == 0 || word[k] == b'.');
            for from in dots {
                if !self.0.contains(&word[from..]) {
                    self.0.insert(word[from..].to_owned());
                }
            }
        }
    }

    /// Whether a file below a folder is mentioned: by its name, by its suffix, or by another folder that it is in.
    fn is_of(&self, path: &Path, root: &Path) -> bool {
        let below = path.strip_prefix(root).unwrap_or(path);
        let name = below.file_name().unwrap_or_default().as_encoded_bytes();
        let suffix = name
            .iter()
            .rposition(|byte| *byte == b'.')
            .map(|at| &name[at..]);
        let folders = below.parent().into_iter().flat_map(Path::components);
        let mut folders = folders.map(|part| part.as_os_str().as_encoded_bytes());
        self.0.contains(name)
            || suffix.is_some_and(|suffix| self.0.contains(suffix))
            || folders.any(|folder| self.0.contains(folder))
    }
}

struct Found<'a> {
    home: &'a Path,
    files: BTreeSet<PathBuf>,
    /// Others below the folders that were walked through, with these.
    data: BTreeMap<PathBuf, PathBuf>,
    /// Files that the command itself writes.
    written: BTreeSet<PathBuf>,
    /// Those that it names.
    folders: BTreeSet<PathBuf>,
    /// Those that were walked through.
    walked: BTreeSet<PathBuf>,
    /// The number of files seen there.
    seen: usize,
}

impl Found<'_> {
    /// A part of a command that may name a file; a placeholder in its name matches anything.
    fn named(&mut self, part: &str) {
        if part.is_empty() {
            return;
        }
        let path = self.home.join(part);
        if path.is_file() {
            self.files.insert(path);
        } else if path.is_dir() && Path::new(part).is_relative() {
            let real = path.canonicalize().unwrap_or(path);
            if !self.home.starts_with(&real) {
                self.folders.insert(real);
            }
        } else if let (Some(folder), Some(name)) = (path.parent(), path.file_name())
            && let Some(pattern) = pattern(&name.to_string_lossy())
        {
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            let files = entries
                .map(|entry| entry.path())
                .filter(|path| path.is_file());
            let is_meant = |path: &PathBuf| {
                path.file_name()
                    .is_some_and(|name| matches(&pattern, &name.to_string_lossy()))
            };
            self.files.extend(files.filter(is_meant));
        }
    }

    /// Adds the files in a folder and its subfolders, except those that this program keeps there.
    fn walk(&mut self, root: &Path) -> Result<()> {
        let mut folders = vec![root.to_owned()];
        while let Some(folder) = folders.pop() {
            let real = folder.canonicalize().map_err(Error::io(&folder, "find"))?;
            let is_ours = [
                "journal.jsonl",
                "baseline.json",
                "job.json",
                ".faceoff-report",
            ];
            if is_ours.iter().any(|name| folder.join(name).is_file()) || !self.walked.insert(real) {
                continue;
            }
            for entry in std::fs::read_dir(&folder).map_err(Error::io(&folder, "list"))? {
                cancel::check()?;
                self.seen += 1;
                if self.seen > MOST {
                    let what = format!(
                        "{} has more than {MOST} files, so that nobody can tell what a code there depends on",
                        root.display()
                    );
                    let remedy = "run it without --resume and --record, or from a separate folder";
                    return Err(Error::usage(what, remedy));
                }
                let entry = entry.map_err(Error::io(&folder, "list"))?;
                let (path, name) = (entry.path(), entry.file_name());
                if name.to_string_lossy().starts_with('.') || name == "__pycache__" {
                    continue;
                }
                if path.is_dir() {
                    folders.push(path);
                } else if path.is_file() {
                    if is_loaded(&path) {
                        self.files.insert(path);
                    } else if !self.written.contains(&path) {
                        self.data.insert(path, root.to_owned());
                    }
                }
            }
        }
        Ok(())
    }
}

/// Whether it is a file that others load: by its suffix, or as a library with a version after it.
fn is_loaded(path: &Path) -> bool {
    let name = path
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase();
    let suffix = name.rsplit_once('.').map_or("", |(_, suffix)| suffix);
    LOADED.contains(&suffix) || name.contains(".so.")
}

/// `u-*.csv` for `u-{n}.csv`; None if all of it is a placeholder, or nothing is.
fn pattern(name: &str) -> Option<String> {
    let (mut pattern, mut rest) = (String::new(), name);
    while let Some((before, after)) = rest.split_once('{') {
        let (_, after) = after.split_once('}')?;
        pattern = pattern + before + "*";
        rest = after;
    }
    pattern += rest;
    (pattern != name && !pattern.trim_matches('*').is_empty()).then_some(pattern)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn of(home: &Path, words: &[&str]) -> Vec<String> {
        let words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
        let Digests { files, beside } = digests(&words, home).unwrap();
        let all: BTreeSet<String> = files.into_keys().chain(beside.into_keys()).collect();
        all.into_iter().collect()
    }

    #[test]
    fn an_answer_depends_on_what_is_run_named_and_loaded() {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path().canonicalize().unwrap();
        let home = at.join("home");
        for name in [
            "home/solver",
            "home/u-8.csv",
            "home/u-16.csv",
            "home/v.csv",
            "home/a.py",
            "home/lib/core.py",
            "home/lib/x.so.1",
            "home/.git/b.py",
            "home/kept/journal.jsonl",
            "home/kept/c.py",
            "home/page/index.html",
            "shared/main.py",
            "shared/part/d.py",
            "shared/data.bin",
            "lib/e.idp",
        ] {
            let path = at.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, name).unwrap();
        }
        std::os::unix::fs::symlink(&home, home.join("lib/loop")).unwrap();
        let own = ["a.py", "lib/core.py", "lib/x.so.1"];
        assert_eq!(
            of(&home, &["./solver", "{out}", "{mesh}"]),
            [&own[..], &["solver"]].concat()
        );
        assert_eq!(
            of(&home, &["no-such", "--in=u-{n}.csv"]),
            [&own[..], &["u-16.csv", "u-8.csv", "v.csv"]].concat()
        );
        let shared = |name: &str| at.join("shared").join(name).display().to_string();
        let found = of(
            &home,
            &[
                "no-such",
                "-c",
                "cat ../shared/main.py;cat <v.csv >> u-8.csv",
            ],
        );
        let expected = [shared("main.py"), shared("part/d.py")];
        assert_eq!(found[..2], expected);
        assert_eq!(found[2..], [&own[..], &["u-16.csv", "v.csv"]].concat());
        let found = of(&home, &["no-such", "-I", "../lib", "../shared/data.bin"]);
        assert_eq!(found[0], at.join("lib/e.idp").display().to_string());
        assert_eq!(found[1], shared("data.bin"));
        let sh = of(&home, &["sh"]);
        assert!(sh[0].starts_with('/') && sh.len() == 4, "{sh:?}");
    }

    /// By name, by suffix, by folder, and by what the data themselves mention.
    #[test]
    fn an_answer_depends_on_the_data_that_a_script_speaks_of() {
        let folder = tempfile::tempdir().unwrap();
        let home = folder.path().canonicalize().unwrap();
        for (name, text) in [
            (
                "solve.py",
                "open('in.json'); open(f'{name}.f64'); walk('inputs/')",
            ),
            ("in.json", "{\"of\": \"deep.dat\"}"),
            ("deep.dat", ""),
            ("cr.f64", ""),
            ("inputs/more/7", ""),
            ("r.md", ""),
            ("log", ""),
            ("page/index.html", ""),
        ] {
            let path = home.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let found = of(&home, &["no-such", "solve.py", "{out}"]);
        assert_eq!(
            found,
            ["cr.f64", "deep.dat", "in.json", "inputs/more/7", "solve.py"]
        );
        // A file that a command names is not treated as one that it may write.
        let words = ["./log", "solve.py", "cr.f64"].map(str::to_owned);
        let found = digests(&words, &home).unwrap();
        assert!(
            found.files.keys().eq(["cr.f64", "log", "solve.py"]),
            "{found:?}"
        );
        assert!(
            found
                .beside
                .keys()
                .eq(["deep.dat", "in.json", "inputs/more/7"]),
            "{found:?}"
        );
    }

    #[test]
    fn what_is_too_large_or_cannot_be_read_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let home = folder.path();
        for k in 0..=MOST {
            fs::write(home.join(k.to_string()), "").unwrap();
        }
        let refused = digests(&["true".to_owned()], home).unwrap_err();
        assert!(refused.to_string().contains("has more than"), "{refused}");
    }
}
