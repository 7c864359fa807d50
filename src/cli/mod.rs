//! The command line: raw arguments become one valid request, and the request an exit code.

mod args;
mod campaigns;
mod certify;
pub mod compare;
mod elastic;
mod engines;
mod folders;
mod help;
mod hunt;
mod init;
mod judge;
mod matrix;
pub mod mesh;
mod new;
mod progress;
mod scenes;
mod shell;
mod solve;
mod verify;
mod words;
mod write;

use std::ffi::OsString;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use clap::{FromArgMatches as _, Parser as _};
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;

use crate::engine::{self, held_memory};
use crate::report::console::{self, note};
use args::{Arguments, Command, Limits};
use faceoff_judge::Verdict;
use faceoff_mesh::cancel::{self, Cause};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::{file, memory};

/// 0: agree, or done.
const DONE: u8 = 0;
/// 1: disagree, or not reached.
const DISAGREE: u8 = 1;
/// 2: could not judge: bad input, a code missing, crashed or beyond its time limit.
const FAILED: u8 = 2;

/// Code that polls for the end of a run stops by itself within this time; the rest ends with the process.
const GRACE: Duration = Duration::from_millis(600);
/// Code with a result gets this time to reach its next poll and to write it; a second signal ends it at once.
const WRITING: Duration = Duration::from_secs(60);

/// The intervals at which the limits are checked: time, and memory, which takes longer to measure.
const POLL: [Duration; 2] = [Duration::from_millis(20), Duration::from_millis(200)];

/// A thread's memory for calls; formulas may be nested deeply.
pub const STACK: usize = 64 << 20;

/// Runs the command in the arguments of a process, the first of which is its name, and returns the exit code: within a second after
/// a signal or a limit, whatever it was doing. The process must then end.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    // If no handler can be set, an interruption ends the program immediately.
    let _ = ctrlc::set_handler(|| {
        cancel::end(Cause::Signal);
    });
    // Never freed: the process ends while its command may still look at them.
    let arguments: &'static Arguments = Box::leak(Box::new(parsed(arguments)));
    log(arguments.limits.verbose);
    let (done, ended) = mpsc::channel();
    let begun = Instant::now();
    let limit = arguments.limits.time_limit;
    if let Some(deadline) = limit.and_then(|limit| begun.checked_add(limit)) {
        cancel::set_deadline(deadline);
    }
    if let Some(most) = arguments.limits.memory {
        memory::set_limit(most);
    }
    let most = memory::available().map(|there| there + memory::held());
    let work = move || {
        let code = run(arguments).and_then(|code| console::check().map(|()| code));
        let _ = done.send(code);
    };
    let thread = threads().and_then(|()| {
        let thread = std::thread::Builder::new().stack_size(STACK);
        thread.spawn(work).map_err(|e| e.to_string())
    });
    let code = match thread {
        Ok(_) => wait(&ended, &arguments.limits, begun, most),
        Err(e) => Err(Error::usage(
            format!("no thread can be started: {e}"),
            "close other programs, or allow more processes (ulimit -u)",
        )),
    };
    let code = code.unwrap_or_else(|e| {
        // The command is not notified: it will deliver nothing more.
        arguments.command.output().give_up(&e);
        file::abandon();
        Err(e)
    });
    code.unwrap_or_else(|e| {
        note!("faceoff: {e}");
        FAILED
    })
}

/// The arguments of the process; where they are wrong, or help is asked for, it ends here.
fn parsed(words: impl IntoIterator<Item = OsString>) -> Arguments {
    let words: Vec<OsString> = words.into_iter().collect();
    let is_short = words.iter().any(|word| word == "-h");
    let matches = help::command(is_short).get_matches_from(words);
    Arguments::from_arg_matches(&matches).unwrap_or_else(|e| e.exit())
}

/// The arguments of a command that does not come from the arguments of the process.
fn parse(words: impl Iterator<Item = OsString>) -> Result<Arguments> {
    Arguments::try_parse_from(std::iter::once("faceoff".into()).chain(words)).map_err(|e| {
        let what = e.to_string();
        let what = what.strip_prefix("error: ").unwrap_or(&what);
        let what = what.split("\n\n").next().unwrap_or(what).trim();
        Error::usage(what, "see what `faceoff COMMAND --help` says of the option")
    })
}

/// Logs to standard error at the level of `FACEOFF_LOG`, or else that of the number of `-v`.
fn log(verbose: u8) {
    let asked = std::env::var("FACEOFF_LOG").unwrap_or_else(|_| {
        let level = ["error", "error", "info", "debug"][usize::from(verbose.min(3))];
        level.to_owned()
    });
    let told: Targets = asked.parse().unwrap_or_else(|e| {
        note!("faceoff: FACEOFF_LOG is `{asked}`: {e}; give info, debug, or a part as in faceoff_fem::linear=debug");
        Targets::new().with_default(LevelFilter::ERROR)
    });
    let to_stderr = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(console::has_colours(&std::io::stderr()));
    tracing_subscriber::registry()
        .with(to_stderr)
        .with(told)
        .init();
}

/// Starts the threads that compute, as many as there are processors, or one if no more are allowed.
fn threads() -> Result<(), String> {
    let start = |count: usize| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(count)
            .build_global()
    };
    start(0).or_else(|_| start(1)).map_err(|e| e.to_string())
}

/// The result of the command.
///
/// # Errors
/// A command that did not stop on request.
fn wait(
    ended: &mpsc::Receiver<Result<u8>>,
    limits: &Limits,
    begun: Instant,
    most: Option<u64>,
) -> Result<Result<u8>> {
    let (mut asked, mut looked) = (None, begun);
    loop {
        match ended.recv_timeout(POLL[0]) {
            Ok(code) => return Ok(code),
            Err(mpsc::RecvTimeoutError::Timeout) => {}
            Err(mpsc::RecvTimeoutError::Disconnected) => {
                return Err(Error::Solver {
                    what: "a defect of faceoff itself ended the command".into(),
                    remedy: "report this, with the lines above".into(),
                });
            }
        }
        if let Some(cause) = cancel::cause() {
            // Memory does not wait.
            let may_wait = cancel::is_heard() && !matches!(cause, Cause::Memory { .. });
            let grace = if may_wait { WRITING } else { GRACE };
            if asked.get_or_insert_with(Instant::now).elapsed() >= grace {
                return Err(cause.into());
            }
            continue;
        }
        if let Some(limit) = limits.time_limit.filter(|limit| begun.elapsed() >= *limit) {
            cancel::end(Cause::Time(limit));
        }
        if looked.elapsed() >= POLL[1] {
            looked = Instant::now();
            let used = held_memory();
            if let Some(most) = most.filter(|most| used > *most) {
                cancel::end(Cause::Memory {
                    used: used / 1_000_000,
                    most: most / 1_000_000,
                });
            }
        }
    }
}

/// Runs a command; one that ends early records this in all of its outputs.
fn run(arguments: &Arguments) -> Result<u8> {
    let output = arguments.command.output();
    let to = &output;
    let is_verbose = arguments.limits.verbose > 0;
    let begun = output.begin().and_then(|()| sandbox(&arguments.limits));
    let done = begun.and_then(|()| match &arguments.command {
        Command::Verify(arguments) => verify::run(arguments, is_verbose, to),
        Command::Write(arguments) => write::run(arguments),
        Command::New(arguments) => new::run(arguments),
        Command::Compare(arguments) => compare::run(arguments, to),
        Command::Certify(arguments) => certify::run(arguments, to),
        Command::Judge(arguments) => judge::run(arguments, to),
        Command::Solve(arguments) => solve::run(arguments, to),
        Command::Orders(arguments) => campaigns::orders(arguments, to),
        Command::Paper(arguments) => campaigns::paper(arguments, to),
        Command::Study(arguments) => campaigns::study(arguments, to),
        Command::Stress(arguments) => campaigns::stress(arguments, to),
        Command::Matrix(arguments) => matrix::run(arguments, to),
        Command::Hunt(arguments) => hunt::run(arguments, to),
        Command::Mesh(arguments) => mesh::run(arguments, to),
        Command::Init(arguments) => init::run(arguments),
        Command::Scenes(_) => scenes::run(to),
        Command::Engines(arguments) => engines::run(arguments, to),
        Command::Completions(arguments) => shell::completions(arguments),
        Command::Man(arguments) => shell::man(arguments),
    });
    if let Err(e) = &done
        && let Err(other) = output.fail(e)
        && other.to_string() != e.to_string()
    {
        note!("faceoff: {other}");
    }
    done
}

/// Restricts other codes to a sandbox, if the user or the environment requires it.
fn sandbox(limits: &Limits) -> Result<()> {
    let asked = std::env::var_os("FACEOFF_SANDBOX").unwrap_or_default();
    if !asked.is_empty() && asked != "require" {
        let what = format!("FACEOFF_SANDBOX is `{}`", asked.display());
        return Err(Error::usage(what, "set it to `require`, or unset it"));
    }
    if limits.sandbox || !asked.is_empty() {
        engine::require_sandbox();
    }
    Ok(())
}

/// The exit code of a verdict.
fn code(verdict: Verdict) -> u8 {
    match verdict {
        Verdict::Agree | Verdict::Conditioned => DONE,
        Verdict::Several | Verdict::Disagree => DISAGREE,
        Verdict::Undetermined => FAILED,
    }
}
