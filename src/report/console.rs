//! What people read on standard output and standard error.
//!
//! A reader may be gone before everything is written, as with `| head`. What it does not take is dropped: the verdict is the
//! exit code.

use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write};
use std::sync::Mutex;

use faceoff_mesh::error::{Error, Result};

/// Why something was lost, other than that nobody reads on: a full disk.
static LOST: Mutex<Option<io::Error>> = Mutex::new(None);

/// A line on standard output.
macro_rules! tell {
    ($($words:tt)*) => { $crate::report::console::output(format_args!("{}\n", format_args!($($words)*))) };
}

/// A line on standard error.
macro_rules! note {
    ($($words:tt)*) => { $crate::report::console::aside(format_args!($($words)*)) };
}

pub(crate) use {note, tell};

/// Text on standard output, as it stands.
pub fn output(text: Arguments) {
    let mut out = io::stdout().lock();
    if let Err(e) = out.write_fmt(text).and_then(|()| out.flush())
        && e.kind() != ErrorKind::BrokenPipe
        && let Ok(mut lost) = LOST.lock()
    {
        *lost = Some(e);
    }
}

pub fn aside(text: Arguments) {
    // Where standard error takes nothing nobody reads.
    let _ = writeln!(io::stderr(), "{text}");
}

/// Was all of it taken, or not wanted?
///
/// # Errors
/// Output that was lost.
pub fn check() -> Result<()> {
    let lost = LOST.lock().ok().and_then(|mut lost| lost.take());
    lost.map_or(Ok(()), |source| {
        Err(Error::Io {
            path: "standard output".into(),
            action: "write",
            source,
        })
    })
}
