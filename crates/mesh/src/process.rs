//! Runs a program with a time limit and interruption; none of its children is left behind. What Unix alone has (signals, a watcher
//! that outlives this process, marks) is left out elsewhere: there a program is killed with its children, and not asked to end.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
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

/// How often a running program is polled.
const POLL: Duration = Duration::from_millis(5);

/// How long a program may take to end when asked to, before it is killed. Its children die with
/// it; those of `mpirun`, which are in groups of their own, only if it is not killed.
#[cfg(unix)]
const GRACE: Duration = Duration::from_millis(500);

/// Starts a watcher and becomes the program. The watcher reads a pipe that nobody writes to: it
/// breaks when faceoff has ended, even if killed, and then the watcher ends the whole group. It must
/// not be a child of the program, which may wait for all of its children.
const WATCHED: &str = r#"exec 3<&0 </dev/null
( (
  trap '' HUP INT TERM
  read -r _ <&3
  echo 'error faceoff itself was ended, and this program with it' >>"$0"
  kill -TERM 0; sleep 2; kill -KILL 0
) >/dev/null 2>&1 & )
exec 3<&-
exec "$@""#;

/// Longer lines are read in parts.
const LONGEST_LINE: u64 = 1 << 16;

/// Lines of the log that a message quotes.
const QUOTED: usize = 6;

/// Why a program gave no result, in words; what to do about it is for the caller to say.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// It was interrupted, or its log cannot be written.
    #[error(transparent)]
    Ours(#[from] Error),
    /// The system does not start it: there is none, or no right to.
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
    /// The system does not say how it ended.
    #[error("its process was lost: {0}")]
    Lost(std::io::Error),
    /// Usually for lack of memory.
    #[error("`{program}` was killed from outside{said}")]
    Killed {
        /// As it was called.
        program: String,
        /// What its log says, after `: `; empty where that is nothing.
        said: String,
    },
    /// `said`: `: ` and what its log says of the failure.
    #[error("`{program}` failed ({status}){said}")]
    Failed {
        /// As it was called.
        program: String,
        /// Its exit code, or the signal that ended it.
        status: ExitStatus,
        /// What its log says, after `: `; empty where that is nothing.
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
    line: impl FnMut(&str) + Send,
) -> Result<(), Failure> {
    let log_path = folder.join("log.txt");
    let log = File::create(&log_path).map_err(Error::io(&log_path, "write"))?;
    let for_stderr = log.try_clone().map_err(Error::io(&log_path, "write"))?;
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
        .stderr(Stdio::from(for_stderr));
    let mut command = CommandWrap::from(command);
    #[cfg(unix)]
    command.wrap(process_wrap::std::ProcessGroup::leader());
    #[cfg(windows)]
    command.wrap(process_wrap::std::JobObject);
    let mut child = command.spawn().map_err(|e| not_started(e.to_string()))?;
    tracing::info!(program, folder = %folder.display(), "started");
    // Held until the group has ended: it shows the watcher that this process is alive.
    let _alive = child.stdin().take();
    let output = child.stdout().take();
    let status = std::thread::scope(|scope| {
        let reader = match std::thread::Builder::new()
            .spawn_scoped(scope, move || copy_lines(output, log, line))
        {
            Ok(reader) => reader,
            Err(e) => {
                let _ = child.start_kill();
                let _ = child.wait();
                return Err(not_started(format!("no thread for its output: {e}")));
            }
        };
        let end = Instant::now() + time_limit;
        let status = loop {
            match child.try_wait() {
                Ok(Some(status)) => break Ok(status),
                Ok(None) if Instant::now() >= end => break Err(Failure::OutOfTime(time_limit)),
                Ok(None) => {}
                Err(e) => break Err(Failure::Lost(e)),
            }
            if let Err(e) = cancel::check() {
                break Err(e.into());
            }
            std::thread::sleep(POLL);
        };
        // Also after a regular end: children that outlive the program would hold its output open.
        #[cfg(unix)]
        if status.is_err() {
            let _ = child.signal(Signal::SIGTERM as i32);
            let end = Instant::now() + GRACE;
            while Instant::now() < end && matches!(child.try_wait(), Ok(None)) {
                std::thread::sleep(POLL);
            }
        }
        let _ = child.start_kill();
        if status.is_err() {
            let _ = child.wait();
        }
        #[cfg(unix)]
        end_marked(&mark);
        let _ = reader.join();
        status
    })?;
    tracing::info!(program, %status, "ended");
    if status.success() {
        return Ok(());
    }
    let said = quote(&log_path);
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

/// The variable by which everything that a program started is known, whatever group or session it has moved to.
const MARK: &str = "FACEOFF_JOB";

/// A value of its own for each program.
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
    for entry in std::fs::read_dir("/proc").into_iter().flatten().flatten() {
        let name = entry.file_name();
        let Some(id) = name.to_str().and_then(|name| name.parse::<i32>().ok()) else {
            continue;
        };
        let environment = std::fs::read(entry.path().join("environ")).unwrap_or_default();
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

/// The command with a watcher beside it, which tells its end in the log.
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

fn copy_lines(
    output: Option<std::process::ChildStdout>,
    mut log: File,
    mut line: impl FnMut(&str),
) {
    let Some(output) = output else { return };
    let mut reader = BufReader::new(output);
    let mut buffer = Vec::new();
    let mut next = |buffer: &mut Vec<u8>| {
        let mut part = reader.by_ref().take(LONGEST_LINE);
        matches!(part.read_until(b'\n', buffer), Ok(count) if count > 0)
    };
    while next(&mut buffer) {
        // The log is for people; a full disk must not stop the program's answer.
        let _ = log.write_all(&buffer);
        line(String::from_utf8_lossy(&buffer).trim_end());
        buffer.clear();
    }
}

/// What a log says of a failure: its lines that begin with `error `, or else its last ones.
fn quote(log: &Path) -> String {
    let bytes = std::fs::read(log).unwrap_or_default();
    let text = String::from_utf8_lossy(&bytes);
    let lines: Vec<&str> = text
        .lines()
        .map(str::trim)
        // Horizontal rules of mpirun, and Python's markers below a line.
        .filter(|line| !line.trim_matches(['-', '^', '~']).is_empty())
        .filter(|line| !line.starts_with("progress "))
        .collect();
    let mut errors: Vec<&str> = Vec::new();
    for (k, line) in lines.iter().enumerate() {
        errors.extend(line.strip_prefix("error "));
        // FreeFEM says where in a line of its own.
        if k > 0 && lines[k - 1].starts_with("error ") && line.starts_with("line number") {
            errors.push(line);
        }
    }
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
