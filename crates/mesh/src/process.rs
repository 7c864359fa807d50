//! Runs a program with a time limit and interruption; none of its children is left behind. What only Unix has (signals, a watcher
//! that outlives this process, marks) is left out elsewhere: there a program is killed with its children, and not asked to end.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

#[cfg(unix)]
use nix::{
    sys::signal::{Signal, kill},
    unistd::Pid,
};
use process_wrap::std::CommandWrap;

use crate::cancel;
use crate::error::{Error, Result};
use crate::said::Said;

/// How often a running program is polled.
const POLL: Duration = Duration::from_millis(5);

/// How long a program may take to end when asked to, before it is killed. Its children die with
/// it; those of `mpirun`, which are in separate groups, only if it is not killed.
#[cfg(unix)]
const GRACE: Duration = Duration::from_millis(500);

/// For how long a program's streams are read after its end while nothing comes, and at most: what it left behind out of
/// reach may hold them open for ever.
const QUIET: Duration = Duration::from_millis(300);
const LINGER: Duration = Duration::from_secs(2);

/// Starts a watcher and becomes the program. The watcher reads a pipe that nobody writes to: it
/// breaks when faceoff has ended, even if killed, and then the watcher ends the whole group. It must
/// not be a child of the program, which may wait for all of its children. The log is opened before the program
/// can put something else in its place.
const WATCHED: &str = r#"exec 3<&0 </dev/null 4>>"$0"
( (
  trap '' HUP INT TERM
  read -r _ <&3
  echo 'error faceoff itself was ended, and this program with it' >&4
  kill -TERM 0; sleep 2; kill -KILL 0
) >/dev/null 2>&1 & )
exec 3<&- 4>&-
exec "$@""#;

/// The reason why a program gave no result; the caller adds what to do about it.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// It was interrupted, or its log cannot be written.
    #[error(transparent)]
    Ours(#[from] Error),
    /// The system does not start it: it does not exist, or there is no permission.
    #[error("`{program}` cannot be started: {why}")]
    NotStarted {
        /// As it was called.
        program: String,
        /// The system's reason.
        why: String,
    },
    /// It was ended after this time.
    #[error("it did not end within {:.1} s and was killed", .0.as_secs_f64())]
    OutOfTime(Duration),
    /// It took more of something than one program may, and was ended.
    #[error("it {0} and was killed")]
    TooMuch(String),
    /// The system does not report how it ended.
    #[error("its process was lost: {0}")]
    Lost(std::io::Error),
    /// Usually for lack of memory.
    #[error("`{program}` was killed from outside{said}")]
    Killed {
        /// As it was called.
        program: String,
        /// The contents of its log, after `: `; empty if there are none.
        said: String,
    },
    /// `said`: `: ` and the lines of its log about the failure.
    #[error("`{program}` failed ({status}){said}")]
    Failed {
        /// As it was called.
        program: String,
        /// Its exit code, or the signal that ended it.
        status: ExitStatus,
        /// The contents of its log, after `: `; empty if there are none.
        said: String,
    },
}

/// Runs `command` in its own process group, in its current directory if it has one and else in `folder`, keeps its output in
/// `folder/log.txt`, and passes each line of its standard output to `line`. The group ends with this process.
///
/// # Errors
/// A program that cannot be started, exits other than with 0, or exceeds the time limit; an interruption.
pub fn run(
    command: &Command,
    folder: &Path,
    time_limit: Duration,
    line: impl FnMut(&str),
) -> Result<(), Failure> {
    run_within(command, folder, time_limit, |_| Ok(()), line)
}

/// [`run`], with `look` called repeatedly, with the program's number: whether it may go on; if not, it returns what the
/// program did.
///
/// # Errors
/// The errors of [`run`], and [`Failure::TooMuch`].
pub fn run_within(
    command: &Command,
    folder: &Path,
    time_limit: Duration,
    mut look: impl FnMut(u32) -> Result<(), String>,
    mut line: impl FnMut(&str),
) -> Result<(), Failure> {
    let log_path = folder.join("log.txt");
    let log = new_log(&log_path).map_err(Error::io(&log_path, "write"))?;
    let program = command.get_program().to_string_lossy().into_owned();
    let not_started = |why: String| Failure::NotStarted {
        program: program.clone(),
        why,
    };
    if find_in_path(command.get_program()).is_none() {
        return Err(not_started("there is no such program".into()));
    }
    let place = command.get_current_dir().unwrap_or(folder).to_owned();
    let mut command = watched(
        command,
        &std::path::absolute(&log_path).unwrap_or(log_path.clone()),
    );
    let mark = mark();
    command
        .env(MARK, &mark)
        .current_dir(place)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut command = CommandWrap::from(command);
    #[cfg(unix)]
    command.wrap(process_wrap::std::ProcessGroup::leader());
    #[cfg(windows)]
    command.wrap(process_wrap::std::JobObject);
    let mut child = command.spawn().map_err(|e| not_started(e.to_string()))?;
    tracing::info!(program, folder = %folder.display(), "started");
    // Open until the group has ended: it shows the watcher that this process is alive.
    let _alive = child.stdin().take();
    let said = match (child.stdout().take(), child.stderr().take()) {
        (Some(output), Some(errors)) => Said::new(output, errors, log),
        _ => Err(std::io::Error::other("it has no output")),
    };
    let mut said = match said {
        Ok(said) => said,
        Err(e) => {
            let _ = child.start_kill();
            let _ = child.wait();
            return Err(not_started(format!("no thread for its output: {e}")));
        }
    };
    let end = Instant::now() + time_limit;
    let mut looked = Instant::now();
    let status = loop {
        if !said.hear(POLL, &mut line) {
            std::thread::sleep(POLL);
        }
        if looked.elapsed() < POLL {
            continue;
        }
        looked = Instant::now();
        match child.try_wait() {
            Ok(Some(status)) => break Ok(status),
            Ok(None) if looked >= end => break Err(Failure::OutOfTime(time_limit)),
            Ok(None) => {}
            Err(e) => break Err(Failure::Lost(e)),
        }
        if let Err(e) = cancel::check() {
            break Err(e.into());
        }
        if let Err(what) = look(child.id()) {
            break Err(Failure::TooMuch(what));
        }
    };
    // Also after a regular end: children that outlive the program would hold its output open.
    #[cfg(unix)]
    if matches!(status, Err(ref why) if !matches!(why, Failure::TooMuch(_))) {
        let _ = child.signal(Signal::SIGTERM as i32);
        let end = Instant::now() + GRACE;
        while Instant::now() < end && matches!(child.try_wait(), Ok(None)) {
            if !said.hear(POLL, &mut line) {
                std::thread::sleep(POLL);
            }
        }
    }
    let _ = child.start_kill();
    if status.is_err() {
        let _ = child.wait();
    }
    #[cfg(unix)]
    end_marked(&mark);
    said.end(QUIET, LINGER, &mut line);
    let status = status?;
    tracing::info!(program, %status, "ended");
    if status.success() {
        return Ok(());
    }
    let said = said.quote();
    Err(if was_killed(status) {
        Failure::Killed { program, said }
    } else {
        Failure::Failed {
            program,
            status,
            said,
        }
    })
}

/// A log instead of what was there, also where that is a link.
fn new_log(path: &Path) -> std::io::Result<File> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(e),
        _ => {}
    }
    File::options().append(true).create_new(true).open(path)
}

/// The variable by which everything that a program started is known, whatever group or session it has moved to.
const MARK: &str = "FACEOFF_JOB";

/// A different value for each program.
fn mark() -> String {
    static NEXT: AtomicUsize = AtomicUsize::new(0);
    let number = NEXT.fetch_add(1, Ordering::Relaxed);
    format!("{}-{number}", std::process::id())
}

#[cfg(unix)]
fn was_killed(status: ExitStatus) -> bool {
    std::os::unix::process::ExitStatusExt::signal(&status) == Some(Signal::SIGKILL as i32)
}

#[cfg(not(unix))]
fn was_killed(_: ExitStatus) -> bool {
    false
}

/// Kills every process that carries a mark; those of others cannot be looked into.
#[cfg(unix)]
fn end_marked(mark: &str) {
    let carried = format!("{MARK}={mark}");
    for entry in fs::read_dir("/proc").into_iter().flatten().flatten() {
        let name = entry.file_name();
        let Some(id) = name.to_str().and_then(|name| name.parse::<i32>().ok()) else {
            continue;
        };
        let environment = fs::read(entry.path().join("environ")).unwrap_or_default();
        if environment
            .split(|byte| *byte == 0)
            .any(|v| v == carried.as_bytes())
        {
            // It may have ended by itself.
            let _ = kill(Pid::from_raw(id), Signal::SIGKILL);
        }
    }
}

/// A program by name or path, as a shell finds it.
pub fn find_in_path(name: impl AsRef<Path>) -> Option<PathBuf> {
    let name = name.as_ref();
    if name.components().count() > 1 {
        return name.is_file().then(|| name.to_owned());
    }
    let path = std::env::var_os("PATH")?;
    let file = format!("{}{}", name.display(), std::env::consts::EXE_SUFFIX);
    std::env::split_paths(&path)
        .flat_map(|folder| [folder.join(name), folder.join(&file)])
        .find(|file| file.is_file())
}

/// The command with a watcher next to it, which writes its end to the log.
fn watched(command: &Command, log: &Path) -> Command {
    let program = command.get_program();
    let mut shell;
    if cfg!(unix) {
        shell = Command::new("/bin/sh");
        shell.args(["-c", WATCHED]).arg(log).arg(program);
    } else {
        shell = Command::new(program);
    }
    shell.args(command.get_args());
    for (name, value) in command.get_envs() {
        match value {
            Some(value) => shell.env(name, value),
            None => shell.env_remove(name),
        };
    }
    shell
}
