//! The parts of the user's folders that a sandboxed program sees: as little as it needs, and never a home or shared folders.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use super::process::find_in_path;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::file;

/// Folders that belong to the system and contain nothing about its users.
const OF_SYSTEM: [&str; 9] = [
    "/usr",
    "/bin",
    "/sbin",
    "/lib",
    "/lib32",
    "/lib64",
    "/libx32",
    "/nix/store",
    "/gnu/store",
];

/// Shared folders, in which others keep sockets and secrets.
const SHARED: [&str; 15] = [
    "/boot", "/dev", "/dev/shm", "/etc", "/home", "/media", "/mnt", "/opt", "/proc", "/run",
    "/srv", "/sys", "/tmp", "/var", "/var/tmp",
];

/// Python's own folders below its prefix: a prefix like ~/.local contains more.
const OF_PYTHON: [&str; 4] = ["bin", "include", "lib", "lib64"];

/// The folders, with links resolved, and the folders that are searched for programs.
#[derive(Debug, Default)]
pub(super) struct Shown {
    paths: Vec<PathBuf>,
    search: Vec<PathBuf>,
}

/// Whether it is part of the system, which is there anyway, with links resolved.
pub(super) fn is_of_system(real: &Path) -> bool {
    OF_SYSTEM.iter().any(|place| real.starts_with(place))
}

/// The path of a folder, with links resolved; an empty name is the current folder.
///
/// # Errors
/// A folder that does not exist.
pub(super) fn real(path: &Path) -> Result<PathBuf> {
    let here = match path.as_os_str().is_empty() {
        true => Path::new("."),
        false => path,
    };
    here.canonicalize().map_err(Error::io(here, "find"))
}

impl Shown {
    /// Shows a folder with all that is below.
    ///
    /// # Errors
    /// A folder that does not exist, or that would show private data.
    pub fn folder(&mut self, path: &Path) -> Result<()> {
        let real = real(path)?;
        if let Some(why) = exposes(&real) {
            let what = format!(
                "a sandboxed program would see all of {}, which is {why}",
                real.display()
            );
            let remedy = "put its files into a separate folder, or trust it and omit --sandbox";
            return Err(Error::usage(what, remedy));
        }
        self.add(real);
        Ok(())
    }

    fn add(&mut self, real: PathBuf) {
        if !is_of_system(&real) && !self.covers(&real) {
            self.paths.push(real);
        }
    }

    fn covers(&self, real: &Path) -> bool {
        self.paths.iter().any(|path| real.starts_with(path))
    }

    /// Shows a program, which is called from `place`: the folder it is in, of a Python its libraries too. Returns it as it
    /// has to be called.
    ///
    /// # Errors
    /// No such program; a folder that would show private data.
    pub fn program(&mut self, name: &Path, place: Option<&Path>) -> Result<PathBuf> {
        let missing = || {
            let what = format!("there is no program `{}`", name.display());
            Error::usage(what, "name one that can be started, or the path of one")
        };
        let found = match (name.components().count() > 1, place) {
            (true, Some(place)) => place.join(name),
            (true, None) => name.to_owned(),
            (false, _) => find_in_path(name).ok_or_else(missing)?,
        };
        // A Python of an environment knows by the name under which it is called where it is, so that its own link stays.
        let folder = found.parent().filter(|path| !path.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        let folder = folder.canonicalize().map_err(|_| missing())?;
        let here = folder.join(found.file_name().ok_or_else(missing)?);
        let real = here.canonicalize().map_err(|_| missing())?;
        if !is_program(&real) {
            return Err(missing());
        }
        for file in [&here, &real] {
            let Some(own) = file.parent() else { continue };
            match of_python(own) {
                Some(paths) => {
                    for path in paths {
                        self.folder(&path)?;
                    }
                }
                None if is_of_system(file) || self.covers(file) => {}
                None => self.folder(own)?,
            }
        }
        self.search.push(folder);
        Ok(here)
    }

    /// All that is shown, the outer ones first.
    pub fn paths(&self) -> Vec<&Path> {
        let mut paths: Vec<&Path> = self.paths.iter().map(PathBuf::as_path).collect();
        paths.sort();
        paths
    }

    /// Folders below that are hidden: Git's folders, in whose settings services keep tokens, and the folders of
    /// other jobs next to this one, with the answers of other codes.
    pub fn hidden(&self, job: &Path) -> Vec<PathBuf> {
        let gits = self.paths.iter().map(|path| path.join(".git"));
        let mut hidden: Vec<PathBuf> = gits
            .filter(|path| path.is_dir() && !path.is_symlink())
            .collect();
        if let Some(Ok(jobs)) = job.parent().map(Path::canonicalize) {
            let is_inside = self
                .paths
                .iter()
                .any(|path| jobs.starts_with(path) && jobs != *path);
            let holds_one = self.paths.iter().any(|path| path.starts_with(&jobs));
            if is_inside && !holds_one {
                hidden.push(jobs);
            }
        }
        hidden
    }

    /// The folders that are searched for programs: those of the shown ones, and the system folders in the user's path.
    pub fn search_path(&self) -> OsString {
        let users = std::env::var_os("PATH").unwrap_or_default();
        let users = std::env::split_paths(&users).filter(|path| is_of_system(path));
        let usual = ["/usr/bin", "/bin"].map(PathBuf::from);
        let all = self.search.iter().cloned().chain(users).chain(usual);
        std::env::join_paths(super::unique(all)).unwrap_or("/usr/bin:/bin".into())
    }
}

#[cfg(unix)]
fn is_program(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt as _;
    fs::metadata(path).is_ok_and(|found| found.is_file() && found.permissions().mode() & 0o111 != 0)
}

#[cfg(not(unix))]
fn is_program(path: &Path) -> bool {
    path.is_file()
}

/// Why a folder must not be shown, if it must not.
fn exposes(real: &Path) -> Option<String> {
    if real.parent().is_none() {
        return Some("everything".into());
    }
    let home = std::env::var_os("HOME").map(PathBuf::from);
    let home = home.and_then(|home| home.canonicalize().ok());
    if home.is_some_and(|home| home.parent().is_some() && home.starts_with(real)) {
        return Some("your home, or holds it".into());
    }
    // The homes of people; those of services are folders of the system.
    let users = file::text(Path::new("/etc/passwd")).unwrap_or_default();
    let is_home = users.lines().any(|line| {
        let fields: Vec<&str> = line.split(':').collect();
        let [_, _, id, _, _, home, ..] = fields[..] else {
            return false;
        };
        let is_person = id.parse::<u32>().is_ok_and(|id| id == 0 || id >= 1000);
        is_person && home.len() > 1 && Path::new(home).starts_with(real)
    });
    if is_home {
        return Some("somebody's home, or holds it".into());
    }
    let is_shared = SHARED.iter().any(|place| real == Path::new(place));
    let temporary = std::env::temp_dir().canonicalize();
    if is_shared || temporary.is_ok_and(|temporary| temporary == real) {
        return Some("shared by all".into());
    }
    let of_kernel = ["/proc", "/sys"]
        .iter()
        .any(|place| real.starts_with(place));
    of_kernel.then(|| "not a folder of files".into())
}

/// The folders that a Python with its program in the folder `own` needs: its environment, if it is of one, and the Python that it is made
/// from. The file that names it may be untrusted: it counts only if a Python is there. None if it is not a Python's.
fn of_python(own: &Path) -> Option<Vec<PathBuf>> {
    let prefix = own.parent()?;
    let mut needed = Vec::new();
    let environment = prefix.join("pyvenv.cfg");
    if let Ok(text) = file::text(&environment) {
        needed.push(prefix.to_owned());
        let base = text.lines().find_map(|line| {
            let (key, value) = line.split_once('=')?;
            (key.trim() == "home").then(|| PathBuf::from(value.trim()))
        });
        let base = base.and_then(|bin| bin.canonicalize().ok());
        needed.extend(
            base.and_then(|bin| base_python(bin.parent()?))
                .into_iter()
                .flatten(),
        );
    } else {
        needed.extend(base_python(prefix)?);
    }
    Some(needed)
}

/// The folders of a Python that is installed here.
fn base_python(prefix: &Path) -> Option<Vec<PathBuf>> {
    if is_of_system(prefix) {
        return Some(Vec::new());
    }
    let libraries = ["lib", "lib64"].map(|name| prefix.join(name));
    let entries = libraries.iter().flat_map(fs::read_dir).flatten().flatten();
    let is_python = |path: PathBuf| {
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        name.starts_with("python3") && path.join("os.py").is_file()
    };
    if !entries.map(|entry| entry.path()).any(is_python) {
        return None;
    }
    // A distribution for numerics has libraries and data of more than Python.
    if prefix.join("conda-meta").is_dir() {
        return Some(vec![prefix.to_owned()]);
    }
    let all = OF_PYTHON.map(|name| prefix.join(name));
    Some(all.into_iter().filter(|path| path.is_dir()).collect())
}
