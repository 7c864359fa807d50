//! Long calls: without the GIL, in a thread of their own, while the caller's thread looks for Ctrl-C.

use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use faceoff::cli::STACK;
use faceoff_mesh::cancel::{self, Cause};
use faceoff_mesh::error::{Error, Result};
use pyo3::prelude::*;

use crate::error::raised;

const POLL: Duration = Duration::from_millis(50);

/// How many calls run in this process: the end of a run is one state for all of them.
static RUNNING: Mutex<usize> = Mutex::new(0);

struct Running;

impl Running {
    fn lock() -> MutexGuard<'static, usize> {
        RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn new() -> Self {
        *Running::lock() += 1;
        Running
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let mut running = Running::lock();
        *running -= 1;
        if *running == 0 {
            cancel::go_on();
        }
    }
}

/// What `work` returns; Ctrl-C ends it, and every other call that runs.
pub fn run<T: Send>(py: Python<'_>, work: impl FnOnce() -> Result<T> + Send) -> PyResult<T> {
    let mut interrupted = None;
    let done = py.detach(|| {
        let _running = Running::new();
        let (tell, told) = mpsc::channel();
        thread::scope(|scope| {
            let work = move || {
                let done = work();
                // Nobody but the caller hears it, who waits.
                let _ = tell.send(());
                done
            };
            let thread = thread::Builder::new()
                .stack_size(STACK)
                .spawn_scoped(scope, work);
            let thread = thread.map_err(|e| {
                let remedy = "close other programs, or allow more processes (ulimit -u)";
                Error::usage(format!("no thread can be started: {e}"), remedy)
            })?;
            while told.recv_timeout(POLL) == Err(RecvTimeoutError::Timeout) {
                if let Err(signal) = Python::attach(|py| py.check_signals()) {
                    cancel::end(Cause::Signal);
                    interrupted = Some(signal);
                }
            }
            thread.join().unwrap_or_else(|_| {
                Err(Error::Solver {
                    what: "a defect of faceoff itself ended the call".into(),
                    remedy: "report this, with the lines above".into(),
                })
            })
        })
    });
    match interrupted {
        Some(signal) => Err(signal),
        None => done.map_err(|e| raised(py, &e)),
    }
}
