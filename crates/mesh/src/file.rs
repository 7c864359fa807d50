//! The boundary to files that others wrote: whatever the program reads is opened here. It is a regular file of a size that
//! memory can hold, never a pipe or a device, and what a file names lies below the folder of that file.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

use crate::error::{Error, Result};
use crate::memory;

/// Opens a regular file; a symbolic link is followed.
///
/// # Errors
/// Those of the file system; a folder, pipe or device, which might never end; more than memory can hold.
pub fn open(path: &Path) -> io::Result<File> {
    // Opening a pipe waits for one who writes.
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::other("it is no regular file"));
    }
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    if memory::available().is_some_and(|there| length > there) {
        let what = format!("it has {length} bytes, more than memory can hold");
        return Err(io::Error::other(what));
    }
    Ok(file)
}

/// All bytes of a regular file.
///
/// # Errors
/// Those of [`open`].
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let file = open(path).map_err(Error::io(path, "read"))?;
    let mut bytes = Vec::new();
    let most = memory::available().unwrap_or(u64::MAX);
    // Files of the system have another length than they say.
    file.take(most)
        .read_to_end(&mut bytes)
        .map_err(Error::io(path, "read"))?;
    Ok(bytes)
}

/// A regular file of text.
///
/// # Errors
/// Those of [`open`]; bytes that are not UTF-8.
pub fn text(path: &Path) -> Result<String> {
    String::from_utf8(read(path)?)
        .map_err(|e| Error::io(path, "read")(io::Error::other(format!("it is not UTF-8: {e}"))))
}

/// The file that a stranger's file in `folder` calls `name`: beside it or below, also where links lead. None for any other.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_pipes_and_folders_are_no_files() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        for path in [Path::new("/dev/zero"), folder.path(), &pipe] {
            let refused = read(path).unwrap_err().to_string();
            assert!(refused.contains("no regular file"), "{refused}");
        }
        let path = folder.path().join("text");
        fs::write(&path, "words").unwrap();
        assert_eq!(text(&path).unwrap(), "words");
        fs::write(&path, [0xff]).unwrap();
        assert!(text(&path).unwrap_err().to_string().contains("UTF-8"));
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
