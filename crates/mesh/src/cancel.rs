//! The end of a run before its time: one state for the process, set by a signal or by a limit of time or memory, and polled
//! by everything that takes long.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::error::{Error, Result};

/// Why a run has to end.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Cause {
    #[error("interrupted; engines were ended and nothing was left half-written")]
    Signal,
    #[error("it did not end within the {} s of --time-limit; allow more, or ask for less: coarser meshes, fewer cases", .0.as_secs_f64())]
    Time(Duration),
    #[error(
        "it takes {used} MB of memory, and {most} MB may be taken; allow more with --memory, or use coarser meshes"
    )]
    Memory { used: u64, most: u64 },
}

static CAUSE: OnceLock<Cause> = OnceLock::new();

/// Is there a result already?
static IS_HEARD: AtomicBool = AtomicBool::new(false);

/// When the time of the run is over.
static DEADLINE: OnceLock<Instant> = OnceLock::new();

/// Asks everything that runs to end, programs with their children. Returns whether that was asked before.
pub fn end(cause: Cause) -> bool {
    let was_asked = CAUSE.set(cause).is_err();
    if was_asked {
        // Who asks twice does not wait for a result.
        IS_HEARD.store(false, Ordering::Relaxed);
    }
    was_asked
}

/// Why the run has to end, if it has to.
pub fn cause() -> Option<Cause> {
    CAUSE.get().copied()
}

/// Says that the command has a result that it writes when it is asked to end: it is given time for that, until it is asked
/// again.
pub fn hear() {
    IS_HEARD.store(true, Ordering::Relaxed);
}

/// Does the command write what it has when it is asked to end?
pub fn is_heard() -> bool {
    IS_HEARD.load(Ordering::Relaxed)
}

/// For loops that take long: costs no more than reading a word.
///
/// # Errors
/// [`Error::Ended`] after [`end`] was called.
#[inline]
pub fn check() -> Result<()> {
    CAUSE
        .get()
        .map_or(Ok(()), |cause| Err(Error::Ended(*cause)))
}

/// Says when the time of this run is over, so that each program that it starts can be given a share; the first time counts.
pub fn set_deadline(deadline: Instant) {
    let _ = DEADLINE.set(deadline);
}

/// What one program may take of the time that is left: nine tenths, so that the rest can still be judged without it.
pub fn share_of_time() -> Option<Duration> {
    let left = DEADLINE.get()?.saturating_duration_since(Instant::now());
    Some(left.mul_f64(0.9))
}
