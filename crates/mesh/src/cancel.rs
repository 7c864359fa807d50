//! The end of a run before its time: one state for the process, set by a signal or by a limit of time or memory, and polled
//! by everything that takes long.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use crate::error::{Error, Result};

/// Why a run has to end.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Cause {
    /// Ctrl-C, or another signal that ends programs.
    #[error("interrupted; engines were ended and nothing was left half-written")]
    Signal,
    /// The limit of time, which is over.
    #[error("it did not end within the {} s of --time-limit; allow more, or ask for less: coarser meshes, fewer cases", .0.as_secs_f64())]
    Time(Duration),
    /// The limit of memory.
    #[error(
        "it takes {used} MB of memory, and {most} MB may be taken; allow more with --memory, or use coarser meshes"
    )]
    Memory {
        /// The memory that the run uses, in MB.
        used: u64,
        /// The memory that it may use, in MB.
        most: u64,
    },
}

static CAUSE: Mutex<Option<Cause>> = Mutex::new(None);

/// Whether there is a cause. A word that is read in every loop.
static IS_ASKED: AtomicBool = AtomicBool::new(false);

/// Whether there is already a result.
static IS_HEARD: AtomicBool = AtomicBool::new(false);

/// When the time of the run is over.
static DEADLINE: OnceLock<Instant> = OnceLock::new();

/// Asks everything that runs to end, programs with their children. Returns whether that was asked before.
pub fn end(cause: Cause) -> bool {
    let mut first = lock();
    let was_asked = first.is_some();
    if was_asked {
        // Who asks twice does not wait for a result.
        IS_HEARD.store(false, Ordering::Relaxed);
    }
    first.get_or_insert(cause);
    IS_ASKED.store(true, Ordering::Release);
    was_asked
}

/// Lets a process go on whose run was ended, once nothing of that run is left.
pub fn go_on() {
    *lock() = None;
    IS_ASKED.store(false, Ordering::Release);
}

fn lock() -> MutexGuard<'static, Option<Cause>> {
    CAUSE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Why the run has to end, if it has to.
pub fn cause() -> Option<Cause> {
    match IS_ASKED.load(Ordering::Acquire) {
        true => *lock(),
        false => None,
    }
}

/// Declares that the command has a result that it writes when it is stopped: it is given time for that, until it is stopped
/// again.
pub fn hear() {
    IS_HEARD.store(true, Ordering::Relaxed);
}

/// Whether the command writes its result so far when it is stopped.
pub fn is_heard() -> bool {
    IS_HEARD.load(Ordering::Relaxed)
}

/// For loops that take long: costs no more than reading a word.
///
/// # Errors
/// [`Error::Ended`] after [`end`] was called.
#[inline]
pub fn check() -> Result<()> {
    cause().map_or(Ok(()), |cause| Err(Error::Ended(cause)))
}

/// Sets the time at which this run ends, so that each program that it starts can be given a share; the first time counts.
pub fn set_deadline(deadline: Instant) {
    let _ = DEADLINE.set(deadline);
}

/// The share of the remaining time that one program may take: nine tenths, so that the rest can still be judged without it.
pub fn share_of_time() -> Option<Duration> {
    let left = DEADLINE.get()?.saturating_duration_since(Instant::now());
    Some(left.mul_f64(0.9))
}
