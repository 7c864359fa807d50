//! Files are written next to their target and then renamed, so that none is ever incomplete. Bytes are written while the
//! next ones are made, since holding a whole file in memory costs more time than writing it.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::parallel;
use tempfile::NamedTempFile;

use crate::cancel;
use crate::error::{Error, Result};

/// A file that is being written.
#[derive(Default)]
pub struct Out {
    /// Bytes that have not been written yet; all of them, if there is no file.
    pub bytes: Vec<u8>,
    file: Option<Beside>,
    /// The first error, after which nothing more is written.
    failed: Option<io::Error>,
}

/// A temporary file and its target.
struct Beside {
    file: NamedTempFile,
    target: PathBuf,
    written: u64,
    /// Up to where the file system has room; `None` where it is not asked for any.
    room: Option<u64>,
    /// How long the file will be at least.
    expected: u64,
}

impl Beside {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let end = self.written + bytes.len() as u64;
        if bytes.len() >= SHARE && self.room.is_some_and(|room| room < end) {
            self.make_room(end);
        }
        self.file.write_all(bytes)?;
        self.written = end;
        Ok(())
    }

    /// Has the file system find room for all that is expected, or else up to beyond `end`: where it has to look for some at each
    /// page, that takes twice the time of writing.
    #[cfg(target_os = "linux")]
    fn make_room(&mut self, end: u64) {
        use nix::fcntl::{FallocateFlags, fallocate};
        let room = match self.expected > end {
            true => self.expected,
            false => end + ROOM,
        };
        let written = self.written as i64;
        let mode = FallocateFlags::FALLOC_FL_KEEP_SIZE;
        let made = fallocate(self.file.as_file(), mode, written, room as i64 - written);
        // Not all file systems can; a full one reports this when it is written to.
        self.room = made.is_ok().then_some(room);
    }

    #[cfg(not(target_os = "linux"))]
    fn make_room(&mut self, _: u64) {
        self.room = None;
    }

    /// Gives back the room that was not needed.
    fn end(&self) -> io::Result<()> {
        match self.room {
            Some(room) if room > self.written => self.file.as_file().set_len(self.written),
            _ => Ok(()),
        }
    }
}

/// Bytes that are collected before they are written.
const BATCH: usize = 1 << 20;
/// Bytes that one thread makes at a time.
const SHARE: usize = 1 << 16;
/// Up to this many bytes, the room for rows is allocated at once.
const EXPECTED: usize = 8 << 20;
/// Bytes requested from the file system beyond those that are written.
#[cfg(target_os = "linux")]
const ROOM: u64 = 8 << 20;

impl Out {
    /// A file that [`Out::save`] moves to `path`. If `path` is a link, its target is replaced; a device or a pipe is
    /// written to once all bytes are made.
    ///
    /// # Errors
    /// [`Error::Io`]: no file can be created next to it.
    pub fn to(path: &Path) -> Result<Self> {
        let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        if is_special(&target) {
            return Ok(Out::default());
        }
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // The permissions of any new file: the umask applies.
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let file = builder
            .prefix(".faceoff-")
            .tempfile_in(folder_of(&target))
            // Only the kind of the error: its text names the temporary file.
            .map_err(|error| Error::io(path, "write")(error.kind().into()))?;
        // What replaces a file is on the disk before the rename (ext4 sees to that), unless there was room for it.
        let room = (!target.exists()).then_some(0);
        Ok(Out {
            bytes: Vec::with_capacity(BATCH + SHARE),
            file: Some(Beside {
                file,
                target,
                written: 0,
                room,
                expected: 0,
            }),
            failed: None,
        })
    }

    /// Announces how many more bytes will be appended at least: finding room for all at once takes less time.
    pub fn expect(&mut self, more: usize) {
        if let Some(file) = &mut self.file {
            file.expected = file
                .expected
                .max(file.written + (self.bytes.len() + more) as u64);
        }
    }

    /// Appends rows of `size` bytes, made on all cores: `fill` gets the index of a first row and zeros to fill.
    pub fn rows(&mut self, count: usize, size: usize, fill: impl Fn(usize, &mut [u8]) + Sync) {
        let share = (SHARE / size.max(1)).max(1);
        let fill = |first: usize, rows: &mut [u8]| {
            rows.fill(0);
            fill(first, rows);
        };
        let make = |first: usize, rows: &mut [u8]| {
            // A few rows take less time than waking the other cores.
            if rows.len() <= SHARE {
                return fill(first, rows);
            }
            let shares = rows.chunks_mut(share * size).enumerate();
            parallel::map(shares, |(index, rows)| fill(first + index * share, rows));
        };
        if self.file.is_none() || count * size <= SHARE {
            let start = self.bytes.len();
            self.bytes.resize(start + count * size, 0);
            make(0, self.bytes.split_at_mut(start).1);
            return self.pass_on();
        }
        if count * size >= EXPECTED {
            self.expect(count * size);
        }
        // While one batch is written the next is made.
        let batch = (BATCH / size.max(1)).max(share);
        let mut next = Vec::new();
        for first in (0..count).step_by(batch) {
            let rows = batch.min(count - first);
            let ((), made) = rayon::join(
                || self.send(),
                || {
                    // Its contents are left, which takes no time.
                    let mut bytes = std::mem::take(&mut next);
                    bytes.resize(rows * size, 0);
                    make(first, &mut bytes);
                    bytes
                },
            );
            next = std::mem::replace(&mut self.bytes, made);
        }
        self.pass_on();
    }

    /// Appends bytes.
    pub fn append(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
        self.pass_on();
    }

    /// Writes the collected bytes if they make a batch.
    #[inline]
    pub fn pass_on(&mut self) {
        if self.bytes.len() >= BATCH {
            self.flush();
        }
    }

    fn flush(&mut self) {
        if self.file.is_some() {
            self.send();
            self.bytes.clear();
        }
    }

    /// Writes the collected bytes, which stay.
    fn send(&mut self) {
        if let (Some(beside), None) = (&mut self.file, &self.failed) {
            self.failed = beside.write(&self.bytes).err();
        }
    }

    pub fn text(&mut self, text: &str) -> &mut Self {
        self.bytes.extend_from_slice(text.as_bytes());
        self
    }

    /// Appends an integer and a blank.
    #[inline]
    pub fn int(&mut self, value: impl itoa::Integer) -> &mut Self {
        self.bytes
            .extend_from_slice(itoa::Buffer::new().format(value).as_bytes());
        self.bytes.push(b' ');
        self
    }

    /// Appends the shortest decimal that reads back as this number, and a blank.
    #[inline]
    pub fn float(&mut self, value: f64) -> &mut Self {
        if value.is_finite() {
            // No reader needs the ".0" of integers.
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

    /// Ends the line, without a blank before its end.
    #[inline]
    pub fn end(&mut self) -> &mut Self {
        match self.bytes.last_mut() {
            Some(last) if *last == b' ' => *last = b'\n',
            _ => self.bytes.push(b'\n'),
        }
        self.pass_on();
        self
    }

    /// Completes the file and moves it to `path`, the one that it was begun with.
    ///
    /// # Errors
    /// [`Error::Io`], an interruption; an old file is kept then.
    pub fn save(self, path: &Path) -> Result<()> {
        cancel::check()?;
        self.complete(path)
    }

    /// [`Out::save`], also after the end of the run, which results report.
    fn complete(mut self, path: &Path) -> Result<()> {
        self.flush();
        if let Some(error) = self.failed {
            return Err(Error::io(path, "write")(error));
        }
        match self.file {
            Some(beside) => {
                beside.end().map_err(Error::io(path, "write"))?;
                let moved = beside.file.persist(&beside.target).map(drop);
                moved.map_err(|error| Error::io(path, "replace")(error.error))
            }
            None => {
                let file = std::fs::OpenOptions::new().write(true).open(path);
                file.and_then(|mut file| file.write_all(&self.bytes))
                    .map_err(Error::io(path, "write"))
            }
        }
    }
}

/// Writes the parts, one after the other, next to `path`, then renames.
///
/// # Errors
/// [`Error::Io`]; an old file is kept then.
pub fn save<'a>(path: &Path, parts: impl IntoIterator<Item = &'a [u8]>) -> Result<()> {
    let mut out = Out::to(path)?;
    parts.into_iter().for_each(|part| out.append(part));
    out.complete(path)
}

/// The folder that a file is in.
pub fn folder_of(path: &Path) -> &Path {
    let parent = path.parent();
    let named = parent.filter(|folder| !folder.as_os_str().is_empty());
    named.unwrap_or(Path::new("."))
}

/// Whether the path is something other than a regular file, which a rename must not replace.
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

    /// Bytes, texts and rows, few or many, are written in order, with or without a file.
    #[test]
    fn all_bytes_arrive_in_order() {
        let fill = |out: &mut Out| {
            let mut expected = Vec::new();
            for (turn, count) in [1, SHARE / 12 + 1, 3, 5 * BATCH / 12 + 7, 0, BATCH]
                .into_iter()
                .enumerate()
            {
                // The last byte is not filled.
                let row = |index: usize| {
                    std::array::from_fn(|k| (turn * 31 + index * 7) as u8 * u8::from(k < 11))
                };
                out.text("begin").append(&[turn as u8; 40]);
                out.rows(count, 12, |first, rows| {
                    for (index, bytes) in (first..).zip(rows.chunks_exact_mut(12)) {
                        let row: [u8; 12] = row(index);
                        bytes[..11].copy_from_slice(&row[..11]);
                    }
                });
                expected.extend(b"begin");
                expected.extend([turn as u8; 40]);
                expected.extend((0..count).flat_map(row));
            }
            expected
        };
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        let mut out = Out::to(&path).expect("begun");
        let expected = fill(&mut out);
        assert!(!path.exists());
        out.save(&path).expect("saved");
        assert!(std::fs::read(&path).expect("there") == expected);
        #[cfg(unix)]
        {
            use std::os::unix::fs::MetadataExt;
            // The room that was not needed is given back.
            let held = 512 * path.metadata().expect("there").blocks();
            assert!(held < expected.len() as u64 + (1 << 20), "{held}");
        }
        let mut out = Out::default();
        fill(&mut out);
        assert!(out.bytes == expected);
        // A file that is not saved leaves nothing behind.
        drop(Out::to(&path).map(|mut out| fill(&mut out)));
        assert_eq!(
            std::fs::read_dir(folder.path()).expect("a folder").count(),
            1
        );
        assert!(std::fs::read(&path).expect("there") == expected);
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
