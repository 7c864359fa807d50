//! Cancellation: one flag for the process, set by a signal and polled by everything that takes long.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Asks everything that runs to end, programs with their children. Returns whether that was asked before.
pub fn interrupt() -> bool {
    INTERRUPTED.swap(true, Ordering::SeqCst)
}

/// For loops that take long: costs no more than reading a byte.
///
/// # Errors
/// [`Error::Interrupted`] after [`interrupt`] was called.
#[inline]
pub fn check() -> Result<()> {
    if INTERRUPTED.load(Ordering::Relaxed) {
        return Err(Error::Interrupted);
    }
    Ok(())
}
