//! Running a program to its end, or to ours: time limit, interruption, no child left behind.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use nix::sys::resource::{UsageWho, getrusage};
use process_wrap::std::{CommandWrap, ProcessGroup};

use crate::error::{Error, Result};

/// How often a running program is looked at.
const POLL: Duration = Duration::from_millis(5);

/// How long a program that was told to end may take, before it is killed. Its children die with
/// it; those of `mpirun`, which are in groups of their own, only if it is not killed.
const GRACE: Duration = Duration::from_secs(2);

/// SIGTERM, whose number POSIX fixes.
const TERMINATE: i32 = 15;

/// Lines of the log that a message quotes.
const QUOTED: usize = 6;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Asks everything that runs to end: programs are killed with their children.
pub fn interrupt() {
    INTERRUPTED.store(true, Ordering::SeqCst);
}

/// Was [`interrupt`] called?
pub fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::SeqCst)
}

/// Peak resident memory in MB: of this process, or of the largest program it ran.
pub fn peak_memory_mb(children: bool) -> f64 {
    let who = if children {
        UsageWho::RUSAGE_CHILDREN
    } else {
        UsageWho::RUSAGE_SELF
    };
    // Linux counts in KiB.
    getrusage(who).map_or(f64::NAN, |usage| usage.max_rss() as f64 / 1024.0)
}

/// Runs `command` in its own process group in `folder`, keeps all it says in `folder/log.txt`,
/// and passes each line of its standard output to `line`.
///
/// # Errors
/// A program that cannot be started, exits other than with 0, or exceeds the time limit.
pub(super) fn run(
    engine: &str,
    mut command: Command,
    folder: &Path,
    time_limit: Duration,
    line: impl FnMut(&str) + Send,
) -> Result<()> {
    let log_path = folder.join("log.txt");
    let log = File::create(&log_path).map_err(Error::io(&log_path, "write"))?;
    let for_stderr = log.try_clone().map_err(Error::io(&log_path, "write"))?;
    let program = command.get_program().to_string_lossy().into_owned();
    command
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::from(for_stderr));
    let mut child = CommandWrap::from(command)
        .wrap(ProcessGroup::leader())
        .spawn()
        .map_err(|e| {
            Error::engine(
                engine,
                format!("`{program}` cannot be started: {e}"),
                "run `faceoff engines` to see what is missing",
            )
        })?;
    tracing::info!(engine, program, folder = %folder.display(), "started");
    let output = child.stdout().take();
    let status = std::thread::scope(|scope| {
        let reader = scope.spawn(move || copy_lines(output, log, line));
        let end = Instant::now() + time_limit;
        let status = loop {
            match child.try_wait() {
                Ok(Some(status)) => break Ok(status),
                Ok(None) if interrupted() => break Err(Error::Interrupted),
                Ok(None) if Instant::now() >= end => {
                    break Err(Error::engine(
                        engine,
                        format!(
                            "it did not end within {} s and was killed",
                            time_limit.as_secs_f64()
                        ),
                        "give it more time with --time-limit, or coarser meshes",
                    ));
                }
                Ok(None) => std::thread::sleep(POLL),
                Err(e) => {
                    break Err(Error::engine(
                        engine,
                        format!("its process was lost: {e}"),
                        "run again",
                    ));
                }
            }
        };
        // Also after a regular end: children that outlive the program would hold its output open.
        if status.is_err() {
            let _ = child.signal(TERMINATE);
            let end = Instant::now() + GRACE;
            while Instant::now() < end && matches!(child.try_wait(), Ok(None)) {
                std::thread::sleep(POLL);
            }
        }
        let _ = child.start_kill();
        if status.is_err() {
            let _ = child.wait();
        }
        let _ = reader.join();
        status
    })?;
    tracing::info!(engine, %status, "ended");
    if status.success() {
        return Ok(());
    }
    Err(Error::engine(
        engine,
        format!("`{program}` failed ({status}){}", quote(&log_path)),
        "run `faceoff engines` to check the installation, or keep the job folder with --keep",
    ))
}

fn copy_lines(
    output: Option<std::process::ChildStdout>,
    mut log: File,
    mut line: impl FnMut(&str),
) {
    let Some(output) = output else { return };
    let mut reader = BufReader::new(output);
    let mut buffer = Vec::new();
    while matches!(reader.read_until(b'\n', &mut buffer), Ok(count) if count > 0) {
        // The log is for people; a full disk must not stop the engine's answer.
        let _ = log.write_all(&buffer);
        line(String::from_utf8_lossy(&buffer).trim_end());
        buffer.clear();
    }
}

/// What a log says of a failure, for a message: the lines `error …`, or else its last ones.
fn quote(log: &Path) -> String {
    let bytes = std::fs::read(log).unwrap_or_default();
    let text = String::from_utf8_lossy(&bytes);
    let lines: Vec<&str> = text
        .lines()
        .map(str::trim)
        .filter(|line| !line.trim_matches('-').is_empty() && !line.starts_with("progress "))
        .collect();
    let errors: Vec<&str> = lines
        .iter()
        .filter_map(|line| line.strip_prefix("error "))
        .collect();
    let lines = if errors.is_empty() { lines } else { errors };
    if lines.is_empty() {
        return ", and it said nothing".into();
    }
    let last = &lines[lines.len().saturating_sub(QUOTED)..];
    let mut quoted = last.join(" | ");
    if quoted.len() > 900 {
        let start = (quoted.len() - 900..quoted.len())
            .find(|&k| quoted.is_char_boundary(k))
            .unwrap_or(0);
        quoted = format!("…{}", &quoted[start..]);
    }
    format!(": {quoted}")
}
