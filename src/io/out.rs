//! Bytes of a file in the making, and how they get to the disk: beside, then by rename, so that no file is ever half there.

use std::io::Write;
use std::path::Path;

use crate::error::{Error, Result};

/// A file in the making.
#[derive(Default)]
pub struct Out {
    pub bytes: Vec<u8>,
}

impl Out {
    pub fn with_capacity(bytes: usize) -> Self {
        Out {
            bytes: Vec::with_capacity(bytes),
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
        save(path, &self.bytes)
    }
}

/// Writes beside `path`, then renames.
///
/// # Errors
/// [`Error::Io`]; the old file is then still there.
pub fn save(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = path
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
        .map_err(Error::io(path, "create"))?;
    file.write_all(bytes).map_err(Error::io(path, "write"))?;
    file.persist(path)
        .map_err(|error| Error::io(path, "replace")(error.error))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

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
