//! A user's program that solves a problem on a mesh and writes files: the command with its placeholders, and the
//! results of running it.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant, SystemTime};

use serde_json::{Value, json};

use super::bounds::Bounds;
use super::depends;
use super::fenicsx;
use super::left::{Left, Written};
use super::process;
use super::program::Folder;
use super::sandbox::{self, Allowed};
use super::written::Source;
use faceoff_judge::systems::System;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::file;
use faceoff_mesh::io::{self, Format, Options, msh};
use faceoff_mesh::mesh::Mesh;

/// The resolution of dates on some file systems.
const DATED: Duration = Duration::from_secs(2);

/// The variables that OpenMP and the linear algebra libraries read.
const THREADS: [&str; 4] = [
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
];

/// A code: how it is called, and what it reads and writes.
#[derive(Debug, Clone)]
pub struct Script {
    /// As reports call it.
    pub name: String,
    /// Words with placeholders: `{mesh}`, `{out}`, `{n}`, those of parameters, and `{script}` where one is written.
    pub command: Vec<String>,
    /// The script, where it is written from a form; it runs in the folder of its run instead of `home`.
    pub source: Option<Source>,
    /// Where it runs, and where relative words are meant to be.
    pub home: PathBuf,
    /// None if it makes its own mesh.
    pub mesh: Option<Form>,
    /// Files that it writes into `{out}`.
    pub results: Vec<String>,
    /// A table of names and numbers.
    pub numbers: Option<String>,
    /// The matrix, the right-hand side and the table of dofs of its linear system.
    pub system: Option<[String; 3]>,
}

/// The form in which a code gets the mesh.
#[derive(Debug, Clone, Copy)]
pub struct Form {
    format: Format,
    version: msh::Version,
    suffix: &'static str,
}

/// The input of a code.
#[derive(Debug, Clone, Copy)]
pub struct Task<'a> {
    /// None if every code makes its own.
    pub mesh: Option<&'a Mesh>,
    /// The refinement, where there are several.
    pub n: Option<usize>,
    /// By name, as commands get them.
    pub parameters: &'a BTreeMap<String, String>,
}

impl Form {
    /// The form of this name: that of a format, or `msh2` for version 2.2 of Gmsh's.
    pub fn of_name(name: &str) -> Option<Self> {
        let (known, version) = match name {
            "msh" => ("msh", msh::Version::V41),
            "msh2" => ("msh", msh::Version::V22),
            other => (other, msh::Version::default()),
        };
        let format = Format::of_name(known)?;
        let suffix = match format {
            // FreeFEM's meshes share Gmsh's suffix.
            Format::Native(native) => native.suffixes.first().copied().unwrap_or("msh"),
            Format::Meshio(name) => name,
        };
        Some(Form {
            format,
            version,
            suffix,
        })
    }

    /// Writes a mesh into a folder; groups and names are what a code needs, and what else a format cannot hold it does not.
    fn write(&self, folder: &Path, mesh: &Mesh) -> Result<PathBuf> {
        let path = folder.join(format!("mesh.{}", self.suffix));
        let options = Options {
            format: Some(self.format),
            msh_version: self.version,
            lossy: true,
            python: super::meshio_python(),
            ..Options::default()
        };
        io::write(&path, mesh, &options)?;
        Ok(path)
    }
}

/// Substitutes values for `{names}` in a word; `{{` is a brace. The error is a message about an unknown name.
pub fn fill(word: &str, value: impl Fn(&str) -> Option<String>) -> Result<String, String> {
    let mut filled = String::new();
    let mut rest = word;
    while let Some(at) = rest.find('{') {
        filled += &rest[..at];
        rest = &rest[at + 1..];
        if let Some(after) = rest.strip_prefix('{') {
            filled.push('{');
            rest = after;
            continue;
        }
        let end = rest.find('}').ok_or_else(|| {
            format!("`{word}` has a brace without its end: write {{{{ for a brace")
        })?;
        let name = &rest[..end];
        filled += &value(name).ok_or_else(|| format!("`{{{name}}}` in `{word}` is not known"))?;
        rest = &rest[end + 1..];
    }
    Ok(filled + rest)
}

impl Script {
    /// Whether its command contains `{out}`. Only files there are known to be from this code and this run.
    pub fn has_out(&self) -> bool {
        let has_out = |word: &String| {
            let is_asked = Cell::new(false);
            let value = |name: &str| {
                is_asked.set(is_asked.get() || name == "out");
                Some(String::new())
            };
            fill(word, value).is_ok() && is_asked.get()
        };
        self.command.iter().any(has_out)
    }

    /// Runs the code on a mesh, in a separate folder, which `keep` keeps, and reads its results.
    ///
    /// # Errors
    /// A code that fails, that takes too long, or that does not write what it should; a mesh that its format cannot hold.
    pub fn run(&self, task: &Task, how: &How) -> Result<Left> {
        let refuse = |what: String, remedy: &str| Error::engine(&self.name, what, remedy);
        let folder = Folder::new(how.keep.as_deref(), &how.kept)?;
        let at = &folder.path;
        let out = at.join("out");
        std::fs::create_dir_all(&out).map_err(Error::io(&out, "make"))?;
        // By the clock of the file system, which may be another machine's.
        let begun = std::fs::metadata(&out).and_then(|found| found.modified());
        let begun = begun.map_err(Error::io(&out, "look at"))?;
        let mesh = match (&self.mesh, task.mesh) {
            (Some(form), Some(mesh)) => Some(form.write(at, mesh)?),
            _ => None,
        };
        let written = self.source.as_ref();
        let written = written.map(|source| source.write(&self.name, at, task.parameters));
        let written = written.transpose()?;
        let home = if written.is_some() { at } else { &self.home };
        let value = |name: &str| match name {
            "mesh" => mesh.as_ref().map(|path| path.display().to_string()),
            "out" => Some(out.display().to_string()),
            "n" => task.n.map(|n| n.to_string()),
            "script" if written.is_some() => {
                written.as_ref().map(|path| path.display().to_string())
            }
            other => task.parameters.get(other).cloned(),
        };
        let words: Vec<String> = self
            .command
            .iter()
            .map(|word| fill(word, value))
            .collect::<Result<_, _>>()
            .map_err(|what| refuse(what, "name a parameter, {mesh}, {out} or {n}"))?;
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]).current_dir(home);
        if written.is_some() {
            // UFL's names of forms depend on it, by which dolfinx finds what it has compiled.
            command.env("PYTHONHASHSEED", "0");
            fenicsx::as_single(&mut command);
        }
        let plugins = super::freefem::plugins(&words);
        command.envs(plugins.map(|[name, path]| (name, path)));
        for name in THREADS {
            // As other engines: threads of a library wait for work in a loop, which takes longer than most of these scripts.
            let is_ours = written.is_some() && std::env::var_os(name).is_none();
            if let Some(threads) = how.threads.or(is_ours.then_some(1)) {
                command.env(name, threads.to_string());
            }
        }
        let program = at.join("command.txt");
        io::save(&program, [by_hand(home, &words).as_bytes()])?;
        let bounds = how.sandbox.then(|| Bounds::new(at));
        if how.sandbox {
            let allowed = Allowed {
                read: vec![home.clone()],
                ..Allowed::default()
            };
            command = sandbox::enclose(&command, at, &allowed)?;
        }
        let clock = Instant::now();
        process::run(&self.name, &command, at, how.time_limit, bounds, |_| {}).map_err(
            |error| match error {
                Error::Engine { what, .. } => {
                    let remedy = match how.keep {
                        Some(_) => format!("run it by hand: {}", by_hand(home, &words)),
                        None => "keep its folder by --keep DIR, whose command.txt runs it by hand"
                            .to_owned(),
                    };
                    refuse(what, &remedy)
                }
                other => other,
            },
        )?;
        let seconds = clock.elapsed().as_secs_f64();
        if !std::fs::symlink_metadata(&out).is_ok_and(|found| found.is_dir()) {
            let what = "it has put something else where its folder {out} was";
            return Err(refuse(what.into(), "let it write into {out}"));
        }
        if let Some(old) = older(&out, begun) {
            let name = old.strip_prefix(&out).unwrap_or(&old).display();
            let what = format!("{name} is older than this run, which has not written it");
            let remedy =
                "let it write its results anew, or copy them without their dates if they are right";
            return Err(refuse(what, remedy));
        }
        let mut left = self.left(&out, seconds)?;
        match &how.into {
            // What is kept is judged, so that it is not there twice.
            Some(into) => {
                copy(&out, into)?;
                left.results = self.results(into)?;
            }
            None => left._folder = Some(folder),
        }
        Ok(left)
    }

    /// An answer of this program, in the files that another one would have written: in a folder that [`How::into`] names, in one that is kept,
    /// or in one that ends with the answer.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn leave(
        &self,
        how: &How,
        keep: Option<&Path>,
        seconds: f64,
        write: impl FnOnce(&Path) -> Result<()>,
    ) -> Result<Left> {
        let make = |path: &Path| std::fs::create_dir_all(path).map_err(Error::io(path, "make"));
        if let Some(into) = &how.into {
            make(into)?;
            write(into)?;
            return self.left(into, seconds);
        }
        let folder = Folder::new(keep, &how.kept)?;
        let out = folder.path.join("out");
        make(&out)?;
        write(&out)?;
        Ok(Left {
            _folder: Some(folder),
            ..self.left(&out, seconds)?
        })
    }

    /// The contents of the folder that it wrote into.
    ///
    /// # Errors
    /// Files that are not there, or cannot be read.
    pub fn left(&self, place: &Path, seconds: f64) -> Result<Left> {
        let results = self.results(place)?;
        let numbers = match &self.numbers {
            Some(name) => self.read_numbers(place, name)?,
            None => BTreeMap::new(),
        };
        let system = self.system.as_ref();
        let system = system
            .map(|files| self.read_system(place, files))
            .transpose()?;
        Ok(Left {
            results,
            numbers,
            system,
            numberless: None,
            on_facets: BTreeMap::new(),
            seconds,
            _folder: None,
        })
    }

    /// The dependencies of its answer besides its task: the command, its program, the files that it names, and what these may load.
    ///
    /// # Errors
    /// A file or folder that cannot be read, or more of them than can be looked at.
    pub fn identity(&self) -> Result<Value> {
        if let Some(source) = &self.source {
            return source.identity(&self.name, &self.command);
        }
        Ok(json!({
            "command": self.command,
            "mesh": self.mesh.as_ref().map(|form| form.suffix),
            "results": self.results,
            "numbers": self.numbers,
            "system": self.system,
            "depends": depends::digests(&self.command, &self.home)?,
        }))
    }

    /// A file that it has written into its folder, which was empty.
    fn written(&self, place: &Path, name: &str) -> Result<PathBuf> {
        let refuse = |what: String, remedy: &str| Error::engine(&self.name, what, remedy);
        let opened = file::open_beneath(place, name);
        let is_missing = |e: &std::io::Error| e.kind() == std::io::ErrorKind::NotFound;
        if opened.as_ref().is_err_and(is_missing) {
            let mut names: Vec<String> = std::fs::read_dir(place)
                .into_iter()
                .flatten()
                .flatten()
                .map(|entry| entry.file_name().to_string_lossy().into_owned())
                .collect();
            names.sort();
            let there = match &names[..] {
                [] => ", nor anything else".to_owned(),
                names => format!(", but {}", names[..names.len().min(8)].join(", ")),
            };
            return Err(refuse(
                format!("it ended well and has not written {name}{there}"),
                "let it write into {out}, or correct `result`",
            ));
        }
        if let Err(e) = opened {
            let remedy = "let it write a file into {out}";
            return Err(refuse(format!("{name}: {e}"), remedy));
        }
        Ok(place.join(name))
    }

    /// A pattern whose files are not links, which would lead to what it has not written.
    fn unlinked(&self, pattern: PathBuf) -> Result<PathBuf> {
        let name = pattern.file_name().unwrap_or_default().to_string_lossy();
        let entries = pattern.parent().and_then(|folder| folder.read_dir().ok());
        for entry in entries.into_iter().flatten().flatten() {
            let known = entry.file_name();
            let is_link = entry.file_type().is_ok_and(|kind| kind.is_symlink());
            if is_link && io::matches(&name, &known.to_string_lossy()) {
                let what = format!("{} is a link", known.display());
                return Err(Error::engine(
                    &self.name,
                    what,
                    "let it write a file into {out}",
                ));
            }
        }
        Ok(pattern)
    }

    /// The files that it had to write; a name may be a pattern of numbered files.
    fn results(&self, place: &Path) -> Result<Vec<Written>> {
        let open = |name: &String| {
            let is_pattern = io::is_pattern(&place.join(name));
            let path = match file::beneath(place, name).filter(|_| is_pattern) {
                Some(pattern) => self.unlinked(pattern)?,
                None => self.written(place, name)?,
            };
            Written::open(&path, format!("{name} of {}", self.name))
        };
        self.results.iter().map(open).collect()
    }

    /// A linear system that it has written.
    fn read_system(&self, place: &Path, [matrix, load, dofs]: &[String; 3]) -> Result<System> {
        let matrix = io::read_matrix(&self.written(place, matrix)?)?;
        let load = io::read_vector(&self.written(place, load)?)?;
        let dofs = io::read_dofs(&self.written(place, dofs)?)?;
        System::new(&self.name, matrix, load, dofs)
    }

    /// Lines of a name and a number, with a comma between them.
    fn read_numbers(&self, place: &Path, name: &str) -> Result<BTreeMap<String, f64>> {
        let path = self.written(place, name)?;
        let mut numbers = BTreeMap::new();
        let text = file::text(&path)?;
        for (line, text) in text.lines().enumerate() {
            let refuse = |what: String| refuse_line(&self.name, name, line + 1, what);
            let text = text.trim();
            if text.is_empty() || text.starts_with('#') || line == 0 && text == "name,value" {
                continue;
            }
            let (name, value) = text
                .split_once(',')
                .ok_or_else(|| refuse(format!("`{text}` is not a name and a number")))?;
            let value: f64 = value
                .trim()
                .parse()
                .map_err(|_| refuse(format!("`{}` is not a number", value.trim())))?;
            if numbers.insert(name.trim().to_owned(), value).is_some() {
                return Err(refuse(format!("{} occurs twice", name.trim())));
            }
        }
        Ok(numbers)
    }
}

/// A file in a folder, or in those in it, that was last written before a time.
fn older(folder: &Path, begun: SystemTime) -> Option<PathBuf> {
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let Ok(found) = entry.metadata() else {
                continue;
            };
            if found.is_dir() {
                folders.push(entry.path());
                continue;
            }
            // A date after the beginning is not a duration before it.
            let before = found.modified().map(|at| begun.duration_since(at));
            if before.is_ok_and(|before| before.is_ok_and(|by| by > DATED)) {
                return Some(entry.path());
            }
        }
    }
    None
}

fn refuse_line(code: &str, file: &str, line: usize, what: String) -> Error {
    Error::engine(
        code,
        format!("{file}, line {line}: {what}"),
        "write lines like `drag,5.57`",
    )
}

/// Copies all regular files of a folder and of those in it. No link is followed, neither there nor to there.
///
/// # Errors
/// Files that cannot be read or written, and links.
pub fn copy(from: &Path, to: &Path) -> Result<()> {
    let is_link =
        |path: &Path| std::fs::symlink_metadata(path).is_ok_and(|found| found.is_symlink());
    let refuse = |path: &Path| {
        let what = format!("{} is a link, which might lead anywhere", path.display());
        Error::usage(what, "put the file or the folder itself there")
    };
    if let Some(path) = [from, to].into_iter().find(|path| is_link(path)) {
        return Err(refuse(path));
    }
    std::fs::create_dir_all(to).map_err(Error::io(to, "make"))?;
    for entry in std::fs::read_dir(from).map_err(Error::io(from, "read"))? {
        let entry = entry.map_err(Error::io(from, "read"))?;
        let (path, target) = (entry.path(), to.join(entry.file_name()));
        let kind = entry.file_type().map_err(Error::io(&path, "read"))?;
        if kind.is_dir() {
            copy(&path, &target)?;
        } else if kind.is_file() {
            if is_link(&target) {
                return Err(refuse(&target));
            }
            file::copy_beneath(from, entry.file_name(), &target)?;
        } else if kind.is_symlink() {
            return Err(refuse(&path));
        }
    }
    Ok(())
}

/// How a code is run.
#[derive(Debug, Clone)]
pub struct How {
    /// Copies what it writes to here.
    pub into: Option<PathBuf>,
    /// The number of threads, for programs that read the usual variables.
    pub threads: Option<usize>,
    /// Keeps the folder of each run.
    pub keep: Option<PathBuf>,
    /// The name of this run's folder there.
    pub kept: String,
    /// Longest time that it may take.
    pub time_limit: Duration,
    /// Whether it is run in a sandbox.
    pub sandbox: bool,
}

/// The command line.
fn by_hand(home: &Path, words: &[String]) -> String {
    let quoted = |word: &String| {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,+:{}@%".contains(c);
        match !word.is_empty() && word.chars().all(is_plain) {
            true => word.clone(),
            false => format!("'{}'", word.replace('\'', r"'\''")),
        }
    };
    let plugins = super::freefem::plugins(words);
    let plugins = plugins.map_or(String::new(), |[name, path]| format!("{name}='{path}' "));
    let words: Vec<String> = words.iter().map(quoted).collect();
    format!(
        "cd {} && {plugins}{}",
        quoted(&home.display().to_string()),
        words.join(" ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn placeholders_are_filled_or_named() {
        let value = |name: &str| (name == "E").then(|| "2.1e11".to_owned());
        assert_eq!(fill("-E={E}{{x}", value).unwrap(), "-E=2.1e11{x}");
        assert_eq!(fill("plain", value).unwrap(), "plain");
        assert!(fill("{nu}", value).unwrap_err().contains("`{nu}`"));
        assert!(fill("a{E", value).unwrap_err().contains("without its end"));
    }

    #[test]
    fn what_is_typed_by_hand_is_quoted() {
        let words = ["a b", "it's", "-n", ""].map(str::to_owned);
        let line = by_hand(Path::new("/x"), &words);
        assert_eq!(line, r"cd /x && 'a b' 'it'\''s' -n ''");
    }
}
