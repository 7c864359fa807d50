//! Bytes of a file in the making, and how they get to the disk: beside, then by rename, so that no file is ever half there.

use std::io::Write;
use std::path::Path;

use rayon::prelude::*;

use crate::error::{Error, Result};

/// A file in the making.
#[derive(Default)]
pub struct Out {
    /// What comes before `bytes`.
    parts: Vec<Vec<u8>>,
    pub bytes: Vec<u8>,
}

/// Rows that one thread fills in one go.
const ROWS: usize = 1 << 12;

impl Out {
    pub fn with_capacity(bytes: usize) -> Self {
        Out {
            parts: Vec::new(),
            bytes: Vec::with_capacity(bytes),
        }
    }

    /// Rows of `size` bytes, each of which `fill` makes of zeros, on all cores.
    pub fn rows(&mut self, count: usize, size: usize, fill: impl Fn(usize, &mut [u8]) + Sync) {
        let mut rows = vec![0; count * size];
        let chunks = rows.par_chunks_mut(ROWS * size).enumerate();
        chunks.for_each(|(chunk, rows)| {
            for (index, row) in (ROWS * chunk..).zip(rows.chunks_exact_mut(size)) {
                fill(index, row);
            }
        });
        self.part(rows);
    }

    /// Bytes that need not be copied.
    pub fn part(&mut self, part: Vec<u8>) {
        self.parts.push(std::mem::take(&mut self.bytes));
        self.parts.push(part);
    }

    /// All bytes in one piece.
    pub fn into_bytes(mut self) -> Vec<u8> {
        self.parts.push(self.bytes);
        self.parts.retain(|part| !part.is_empty());
        match self.parts.as_mut_slice() {
            [part] => std::mem::take(part),
            parts => parts.concat(),
        }
    }

    pub fn text(&mut self, text: &str) -> &mut Self {
        self.bytes.extend_from_slice(text.as_bytes());
        self
    }

    /// A whole number and a blank.
    #[inline]
    pub fn int(&mut self, value: impl itoa::Integer) -> &mut Self {
        self.bytes
            .extend_from_slice(itoa::Buffer::new().format(value).as_bytes());
        self.bytes.push(b' ');
        self
    }

    /// The shortest decimal that reads back as this number, and a blank.
    #[inline]
    pub fn float(&mut self, value: f64) -> &mut Self {
        if value.is_finite() {
            // Whole numbers lose the ".0", which no reader needs.
            let mut buffer = zmij::Buffer::new();
            let text = buffer.format_finite(value);
            self.bytes
                .extend_from_slice(text.strip_suffix(".0").unwrap_or(text).as_bytes());
        } else {
            self.text(if value.is_nan() {
                "nan"
            } else if value > 0.0 {
                "inf"
            } else {
                "-inf"
            });
        }
        self.bytes.push(b' ');
        self
    }

    /// Ends the line; a blank before the end is taken back.
    #[inline]
    pub fn end(&mut self) -> &mut Self {
        match self.bytes.last_mut() {
            Some(last) if *last == b' ' => *last = b'\n',
            _ => self.bytes.push(b'\n'),
        }
        self
    }

    /// Writes beside `path`, then renames.
    ///
    /// # Errors
    /// [`Error::Io`]; the old file is then still there.
    pub fn save(&self, path: &Path) -> Result<()> {
        let last = std::iter::once(self.bytes.as_slice());
        save(path, self.parts.iter().map(Vec::as_slice).chain(last))
    }
}

/// Writes the parts, one after the other, beside `path`, then renames. A link stays, and what it leads to is replaced;
/// a device or a pipe is written to.
///
/// # Errors
/// [`Error::Io`]; the old file is then still there.
pub fn save<'a>(path: &Path, parts: impl IntoIterator<Item = &'a [u8]>) -> Result<()> {
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    if is_special(&target) {
        let mut file = std::fs::OpenOptions::new()
            .write(true)
            .open(&target)
            .map_err(Error::io(path, "write"))?;
        for part in parts {
            file.write_all(part).map_err(Error::io(path, "write"))?;
        }
        return Ok(());
    }
    let folder = target
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As any new file has them: the user's mask takes away what is too much.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder
        .prefix(".faceoff-")
        .tempfile_in(folder)
        // The kind alone: the whole names the temporary file, which is nobody's business.
        .map_err(|error| Error::io(path, "write")(error.kind().into()))?;
    for part in parts {
        file.write_all(part).map_err(Error::io(path, "write"))?;
    }
    file.persist(&target)
        .map_err(|error| Error::io(path, "replace")(error.error))?;
    Ok(())
}

/// Whether something is there that is no file, which a rename must not replace.
pub fn is_special(path: &Path) -> bool {
    path.metadata().is_ok_and(|found| !found.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pipes_and_links_are_not_replaced() {
        let folder = tempfile::tempdir().expect("a folder");
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.expect("mkfifo runs").success());
        let other_end = pipe.clone();
        let reader = std::thread::spawn(move || std::fs::read(other_end));
        save(&pipe, [b"through ".as_slice(), b"it"]).expect("written");
        assert!(is_special(&pipe));
        let read = reader.join().expect("no panic").expect("read");
        assert_eq!(read, b"through it");
        assert!(save(folder.path(), [b"".as_slice()]).is_err());

        #[cfg(unix)]
        {
            let (file, link) = (folder.path().join("file"), folder.path().join("link"));
            std::fs::write(&file, "old").expect("written");
            std::os::unix::fs::symlink("file", &link).expect("a link");
            save(&link, [b"new".as_slice()]).expect("written");
            assert!(link.is_symlink());
            assert_eq!(std::fs::read(&file).expect("read"), b"new");
        }
    }

    #[test]
    fn numbers_read_back() {
        for value in [
            0.0,
            -0.0,
            1.0,
            0.1,
            1e-300,
            -1.7976931348623157e308,
            5e-324,
            1e22,
            123456789.125,
        ] {
            let mut out = Out::default();
            out.float(value);
            let text = String::from_utf8(out.bytes).expect("ASCII");
            let back: f64 = text.trim().parse().expect("a number");
            assert_eq!(back.to_bits(), value.to_bits(), "{text}");
        }
    }
}
