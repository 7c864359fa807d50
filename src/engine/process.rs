//! Running a program to its end, or to ours: time limit, interruption, no child left behind.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use process_wrap::std::{CommandWrap, ProcessGroup};

use faceoff_mesh::error::{Error, Result};

/// How often a running program is looked at.
const POLL: Duration = Duration::from_millis(5);

/// How long a program that was told to end may take, before it is killed. Its children die with
/// it; those of `mpirun`, which are in groups of their own, only if it is not killed.
const GRACE: Duration = Duration::from_secs(2);

/// SIGKILL and SIGTERM, whose numbers POSIX fixes.
const KILL: i32 = 9;
const TERMINATE: i32 = 15;

/// Becomes the program, after it has set a watcher beside it. The watcher reads a pipe that nobody
/// writes to: it breaks when faceoff is gone, also when it was killed, and then the watcher ends the
/// whole group. It has to be no child of the program, which may wait for all of its own.
const WATCHED: &str = r#"exec 3<&0 </dev/null
( (
  trap '' HUP INT TERM
  read -r _ <&3
  echo 'error faceoff itself was ended, and this engine with it' >>log.txt
  kill -TERM 0; sleep 2; kill -KILL 0
) >/dev/null 2>&1 & )
exec 3<&-
exec "$@""#;

/// No line of a program is read further than this at once.
const LONGEST_LINE: u64 = 1 << 16;

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

/// Runs `command` in its own process group in `folder`, keeps all it says in `folder/log.txt`,
/// and passes each line of its standard output to `line`. The group ends with this process.
///
/// # Errors
/// A program that cannot be started, exits other than with 0, or exceeds the time limit.
pub(super) fn run(
    engine: &str,
    command: Command,
    folder: &Path,
    time_limit: Duration,
    line: impl FnMut(&str) + Send,
) -> Result<()> {
    let log_path = folder.join("log.txt");
    let log = File::create(&log_path).map_err(Error::io(&log_path, "write"))?;
    let for_stderr = log.try_clone().map_err(Error::io(&log_path, "write"))?;
    let program = command.get_program().to_string_lossy().into_owned();
    let not_started = |why: String| {
        Error::engine(
            engine,
            format!("`{program}` cannot be started: {why}"),
            "run `faceoff engines` to see what is missing",
        )
    };
    if find_in_path(command.get_program()).is_none() {
        return Err(not_started("there is no such program".into()));
    }
    let mut command = watched(&command);
    command
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::from(for_stderr));
    let mut child = CommandWrap::from(command)
        .wrap(ProcessGroup::leader())
        .spawn()
        .map_err(|e| not_started(e.to_string()))?;
    tracing::info!(engine, program, folder = %folder.display(), "started");
    // Held until the group has ended: the watcher's sign that this process is there.
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
                return Err(not_started(format!("nobody can listen to it: {e}")));
            }
        };
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
    Err(failure(engine, &program, status, &log_path))
}

/// A program by name or path, as a shell finds it.
pub(super) fn find_in_path(name: impl AsRef<Path>) -> Option<PathBuf> {
    let name = name.as_ref();
    if name.components().count() > 1 {
        return name.is_file().then(|| name.to_owned());
    }
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path)
        .map(|folder| folder.join(name))
        .find(|file| file.is_file())
}

/// The command with a watcher beside it.
fn watched(command: &Command) -> Command {
    let mut shell = Command::new("/bin/sh");
    shell
        .args(["-c", WATCHED, "sh"])
        .arg(command.get_program())
        .args(command.get_args());
    for (name, value) in command.get_envs() {
        match value {
            Some(value) => shell.env(name, value),
            None => shell.env_remove(name),
        };
    }
    shell
}

fn failure(engine: &str, program: &str, status: ExitStatus, log: &Path) -> Error {
    let said = quote(log);
    if status.signal() == Some(KILL) {
        return Error::engine(
            engine,
            format!("`{program}` was killed from outside{said}"),
            "if nobody did it, there was not enough memory (`dmesg` tells): use coarser meshes or another machine",
        );
    }
    Error::engine(
        engine,
        format!("`{program}` failed ({status}){said}"),
        "run `faceoff engines` to check the installation, or keep the job folder with --keep",
    )
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
        // Rules of mpirun, and Python's marks below a line.
        .filter(|line| !line.trim_matches(['-', '^', '~']).is_empty())
        .filter(|line| !line.starts_with("progress "))
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
