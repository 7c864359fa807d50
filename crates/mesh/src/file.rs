//! The boundary to files that others wrote: whatever the program reads is opened here. It is a regular file of a size that
//! memory can hold, never a pipe or a device, and the files that a file names are below the folder of that file. It also makes
//! private folders.

use std::fs::{self, File};
use std::io::{self, Read};
#[cfg(unix)]
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::TempDir;

use crate::error::{Error, Result};
use crate::memory;

/// The length of a small file, in bytes.
const SMALL: u64 = 1 << 20;

/// Opens a regular file; a symbolic link is followed.
///
/// # Errors
/// The errors of the file system; a folder, pipe or device, which might never end; more than memory can hold.
pub fn open(path: &Path) -> io::Result<File> {
    // Opening a pipe waits for one who writes.
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::other("it is not a regular file"));
    }
    let file = open_now(path)?;
    if !file.metadata()?.is_file() {
        return Err(io::Error::other("it is not a regular file"));
    }
    let length = file.metadata()?.len();
    if length > most(length) {
        let what = format!("it has {length} bytes, more than memory can hold");
        return Err(io::Error::other(what));
    }
    Ok(file)
}

/// The most bytes that may be read from a file of this length: what memory can hold. For a small file the system is not asked, which takes
/// longer than to read it.
fn most(length: u64) -> u64 {
    match length {
        1..=SMALL => 2 * SMALL,
        _ => memory::available().unwrap_or(u64::MAX),
    }
}

/// Opens without waiting, should a pipe have taken the place of a file.
fn open_now(path: &Path) -> io::Result<File> {
    let mut options = File::options();
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt as _;
        options.custom_flags(nix::fcntl::OFlag::O_NONBLOCK.bits());
    }
    options.read(true).open(path)
}

/// All bytes of a regular file.
///
/// # Errors
/// The errors of [`open`].
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let read = || {
        let file = open(path)?;
        // Files of the system have a different length than they report.
        let most = most(file.metadata()?.len());
        whole(file, most)
    };
    read().map_err(Error::io(path, "read"))
}

/// All bytes of a file, at most `most`.
fn whole(mut file: File, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    (&mut file).take(most).read_to_end(&mut bytes)?;
    match file.read(&mut [0])? {
        0 => Ok(bytes),
        _ => Err(io::Error::other(format!("it has more than {most} bytes"))),
    }
}

/// A regular file of text.
///
/// # Errors
/// The errors of [`open`]; bytes that are not UTF-8.
pub fn text(path: &Path) -> Result<String> {
    String::from_utf8(read(path)?)
        .map_err(|e| Error::io(path, "read")(io::Error::other(format!("it is not UTF-8: {e}"))))
}

/// The file that an untrusted file in `folder` calls `name`: in its folder or below, with links resolved. None for any other.
/// Whether it is there is not asked.
pub fn beneath(folder: &Path, name: &str) -> Option<PathBuf> {
    let inside = |part| matches!(part, Component::Normal(_) | Component::CurDir);
    if name.is_empty() || !Path::new(name).components().all(inside) {
        return None;
    }
    let path = folder.join(name);
    let root = match folder.as_os_str().is_empty() {
        true => Path::new("."),
        false => folder,
    };
    match (root.canonicalize(), path.canonicalize()) {
        (Ok(root), Ok(file)) if !file.starts_with(&root) => None,
        _ => Some(path),
    }
}

/// Opens a regular file that a program left below `folder`, where no part of `name` may be a link: what the program put in
/// the place of a folder leads nowhere. `folder` itself is ours.
///
/// # Errors
/// The errors of the file system; a name that leads out of the folder, a link, and anything but a regular file.
pub fn open_beneath(folder: &Path, name: impl AsRef<Path>) -> io::Result<File> {
    let name = name.as_ref();
    let inside = |part| matches!(part, Component::Normal(_) | Component::CurDir);
    if name.as_os_str().is_empty() || !name.components().all(inside) {
        return Err(io::Error::other("it is outside its folder"));
    }
    let file = open_unlinked(folder, name)?;
    if !file.metadata()?.is_file() {
        return Err(io::Error::other("it is not a regular file"));
    }
    Ok(file)
}

#[cfg(unix)]
fn open_unlinked(folder: &Path, name: &Path) -> io::Result<File> {
    use nix::errno::Errno;
    use nix::fcntl::{OFlag, openat};
    use nix::sys::stat::Mode;
    let mut parts = name
        .components()
        .filter(|part| matches!(part, Component::Normal(_)))
        .peekable();
    let mut at = File::open(folder)?;
    while let Some(part) = parts.next() {
        // Opening a pipe waits for a writer by default.
        let of_kind = match parts.peek() {
            Some(_) => OFlag::O_DIRECTORY,
            None => OFlag::O_NONBLOCK | OFlag::O_NOCTTY,
        };
        let flags = OFlag::O_RDONLY | OFlag::O_CLOEXEC | OFlag::O_NOFOLLOW | of_kind;
        let opened = openat(&at, part.as_os_str(), flags, Mode::empty());
        at = File::from(opened.map_err(|e| match e {
            Errno::ELOOP => io::Error::other("it is a link, or is reached through one"),
            Errno::ENOTDIR => io::Error::other("what should be its folder is a link or a file"),
            Errno::ENXIO => io::Error::other("it is not a regular file"),
            other => other.into(),
        })?);
    }
    Ok(at)
}

#[cfg(not(unix))]
fn open_unlinked(folder: &Path, name: &Path) -> io::Result<File> {
    let mut path = folder.to_owned();
    for part in name.components() {
        path.push(part);
        if fs::symlink_metadata(&path)?.is_symlink() {
            return Err(io::Error::other("it is a link, or is reached through one"));
        }
    }
    File::open(path)
}

/// All bytes of the file that [`open_beneath`] opens, at most `most`.
///
/// # Errors
/// The errors of [`open_beneath`]; a larger file.
pub fn read_beneath(folder: &Path, name: &str, most: u64) -> Result<Vec<u8>> {
    let path = folder.join(name);
    let failed = Error::io(&path, "read");
    let read = || {
        let file = open_beneath(folder, name)?;
        let most = memory::available().map_or(most, |there| there.min(most));
        whole(file, most)
    };
    read().map_err(failed)
}

/// Copies what [`open_beneath`] opens.
///
/// # Errors
/// The errors of [`open_beneath`]; a file that cannot be written.
pub fn copy_beneath(folder: &Path, name: impl AsRef<Path>, to: &Path) -> Result<()> {
    let from = folder.join(name.as_ref());
    let mut source = open_beneath(folder, name).map_err(Error::io(&from, "copy"))?;
    let mut made = File::create(to).map_err(Error::io(to, "write"))?;
    io::copy(&mut source, &mut made).map_err(Error::io(&from, "copy"))?;
    Ok(())
}

/// Bytes that can still be written where this is.
#[cfg(unix)]
pub fn room(path: &Path) -> Option<u64> {
    let found = nix::sys::statvfs::statvfs(path).ok()?;
    Some(found.blocks_available() as u64 * found.fragment_size() as u64)
}

/// Bytes that can still be written where this is.
#[cfg(not(unix))]
pub fn room(_: &Path) -> Option<u64> {
    None
}

/// A folder for the time of its use, which nobody else may enter.
#[derive(Debug)]
pub struct Temporary {
    folder: TempDir,
    /// Locked as long as it is used; without a lock, a killed process left the folder behind. Elsewhere folders
    /// cannot be locked, and are left to the system.
    #[cfg(unix)]
    _lock: File,
}

/// Those of this process, which [`abandon`] removes.
static IN_USE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes the temporary folders of a process that ends without waiting for what works in them.
pub fn abandon() {
    let in_use = IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
    for folder in in_use.iter() {
        // The process ends whether this can be done or not.
        let _ = fs::remove_dir_all(folder);
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let mut in_use = IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
        in_use.retain(|folder| folder != self.folder.path());
    }
}

/// The prefix of temporary folders: not a name that somebody would give a folder of results.
const PREFIX: &str = ".faceoff-temporary-";

/// A folder that is younger may not have its lock yet.
#[cfg(unix)]
const YOUNG: std::time::Duration = std::time::Duration::from_secs(60);

impl Temporary {
    /// A new one. The first one of a process also removes what processes that were killed left behind.
    ///
    /// # Errors
    /// The errors of the file system.
    pub fn new() -> Result<Self> {
        let place = std::env::temp_dir();
        let made = || {
            let mut builder = tempfile::Builder::new();
            #[cfg(unix)]
            builder.permissions(fs::Permissions::from_mode(0o700));
            let folder = builder.prefix(PREFIX).tempdir_in(&place)?;
            #[cfg(unix)]
            let _lock = File::open(folder.path())?;
            #[cfg(unix)]
            _lock.lock()?;
            Ok(Temporary {
                folder,
                #[cfg(unix)]
                _lock,
            })
        };
        let new = made().map_err(Error::io(&place, "make a folder in"))?;
        let mut in_use = IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
        in_use.push(new.path().to_owned());
        #[cfg(unix)]
        {
            static SWEPT: std::sync::Once = std::sync::Once::new();
            // What cannot be removed is not a reason to do nothing.
            SWEPT.call_once(|| drop(sweep(&place, new.path())));
        }
        Ok(new)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// Removes temporary folders of the owner of `like` in which no process is.
#[cfg(unix)]
fn sweep(place: &Path, like: &Path) -> io::Result<()> {
    let owner = fs::metadata(like)?.uid();
    for entry in fs::read_dir(place)? {
        let entry = entry?;
        // Of what others left in the same place only the names are looked at.
        if !entry.file_name().to_string_lossy().starts_with(PREFIX) {
            continue;
        }
        let path = entry.path();
        let found = fs::symlink_metadata(&path)?;
        let age = found.modified()?.elapsed().unwrap_or_default();
        let may_be = found.is_dir() && found.uid() == owner;
        if may_be && age > YOUNG && File::open(&path)?.try_lock().is_ok() {
            fs::remove_dir_all(&path)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::SystemTime;

    #[test]
    fn what_a_killed_process_left_is_removed_and_nothing_else() {
        let place = tempfile::tempdir().unwrap();
        let old = SystemTime::now() - 2 * YOUNG;
        let made = |name: &str, modified: SystemTime| {
            let path = place.path().join(name);
            fs::create_dir(&path).unwrap();
            fs::write(path.join("file"), "").unwrap();
            let folder = File::open(&path).unwrap();
            folder.set_modified(modified).unwrap();
            (path, folder)
        };
        let (left, _) = made(".faceoff-temporary-left", old);
        let (young, _) = made(".faceoff-temporary-young", SystemTime::now());
        let (other, _) = made("faceoff-report", old);
        let (held, folder) = made(".faceoff-temporary-held", old);
        folder.lock().unwrap();
        sweep(place.path(), &held).unwrap();
        assert!(!left.exists());
        assert!(young.exists() && other.exists() && held.exists());
        let new = Temporary::new().unwrap();
        let mode = fs::metadata(new.path()).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o700);
    }

    #[test]
    fn devices_pipes_and_folders_are_no_files() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        for path in [Path::new("/dev/zero"), folder.path(), &pipe] {
            let refused = read(path).unwrap_err().to_string();
            assert!(refused.contains("not a regular file"), "{refused}");
        }
        let path = folder.path().join("text");
        fs::write(&path, "words").unwrap();
        assert_eq!(text(&path).unwrap(), "words");
        fs::write(&path, [0xff]).unwrap();
        assert!(text(&path).unwrap_err().to_string().contains("UTF-8"));
    }

    #[test]
    fn what_a_program_left_is_read_and_no_link_of_it() {
        let folder = tempfile::tempdir().unwrap();
        let job = folder.path().join("job");
        fs::create_dir_all(job.join("out/below")).unwrap();
        fs::create_dir(folder.path().join("secret")).unwrap();
        for file in ["secret/a", "job/out/a", "job/out/below/a"] {
            fs::write(folder.path().join(file), "words").unwrap();
        }
        let link = |to: &str, name: &str| std::os::unix::fs::symlink(to, job.join(name)).unwrap();
        link("../../secret/a", "out/leaf");
        link("a", "out/inner");
        link("../secret", "elsewhere");
        link("/dev/zero", "out/zero");
        let made = std::process::Command::new("mkfifo")
            .arg(job.join("out/pipe"))
            .status();
        assert!(made.unwrap().success());
        for name in ["out/a", "./out/below/a"] {
            assert_eq!(read_beneath(&job, name, 5).unwrap(), b"words");
        }
        let refused = |name: &str, most| read_beneath(&job, name, most).unwrap_err().to_string();
        assert!(refused("out/a", 4).contains("more than 4 bytes"));
        for (name, said) in [
            ("out/leaf", "link"),
            ("out/inner", "link"),
            ("out/zero", "link"),
            ("elsewhere/a", "link"),
            ("out/pipe", "not a regular file"),
            ("out/below", "not a regular file"),
            ("out/../../secret/a", "outside"),
            ("/etc/passwd", "outside"),
            ("", "outside"),
        ] {
            assert!(
                refused(name, 99).contains(said),
                "{name}: {}",
                refused(name, 99)
            );
        }
    }

    #[test]
    fn what_lies_outside_is_refused_also_behind_a_link() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("inner");
        fs::create_dir(&inner).unwrap();
        for file in ["mine", "inner/a"] {
            fs::write(folder.path().join(file), "").unwrap();
        }
        std::os::unix::fs::symlink("../mine", inner.join("link")).unwrap();
        std::os::unix::fs::symlink("a", inner.join("own")).unwrap();
        for name in ["a", "own", "./a", "none"] {
            assert_eq!(beneath(&inner, name), Some(inner.join(name)));
        }
        for name in ["", "link", "../mine", "../inner/a", "/proc/self/environ"] {
            assert_eq!(beneath(&inner, name), None, "{name}");
        }
    }
}
