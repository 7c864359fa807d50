//! The command line: raw arguments become one valid request, and the request an exit code.

mod args;
mod campaigns;
mod compare;
mod engines;
mod mesh;
mod progress;
mod solve;
mod verify;
mod words;

use std::process::ExitCode;

use clap::Parser;

use crate::report::console::{self, note};
use args::{Arguments, Command};
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Result};

/// 0: agree, or done.
const DONE: u8 = 0;
/// 1: disagree, or not reached.
const DISAGREE: u8 = 1;
/// 2: could not judge: bad input, a code missing, crashed or out of time.
const FAILED: u8 = 2;

/// Parses the arguments of the process, does what they say, and returns its exit code.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_env_filter(tracing_subscriber::EnvFilter::from_env("FACEOFF_LOG"))
        .init();
    match run(&arguments).and_then(|code| console::check().map(|()| code)) {
        Ok(code) => ExitCode::from(code),
        Err(e) => {
            complain(&e.to_string());
            ExitCode::from(FAILED)
        }
    }
}

/// A message on standard error. It may quote what a stranger wrote, which must not reach a terminal as commands.
fn complain(message: &str) {
    let plain: String = message
        .chars()
        .map(|c| match c {
            '\n' => c,
            '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => '\u{fffd}',
            _ if c.is_control() => '\u{fffd}',
            _ => c,
        })
        .collect();
    note!("faceoff: {plain}");
}

/// Runs a command; one that ends early says so wherever something reads, but for an interruption.
fn run(arguments: &Arguments) -> Result<u8> {
    let output = arguments.command.output();
    let to = &output;
    let done = output.check().and_then(|()| match &arguments.command {
        Command::Verify(arguments) => verify::run(arguments, to),
        Command::Compare(arguments) => compare::run(arguments, to),
        Command::Solve(arguments) => solve::run(arguments, to),
        Command::Orders(arguments) => campaigns::orders(arguments, to),
        Command::Paper(arguments) => campaigns::paper(arguments, to),
        Command::Study(arguments) => campaigns::study(arguments, to),
        Command::Stress(arguments) => campaigns::stress(arguments, to),
        Command::Mesh(arguments) => mesh::run(arguments, to),
        Command::Engines(arguments) => engines::run(arguments, to),
    });
    if let Err(e) = &done
        && !matches!(e, Error::Interrupted)
        && let Err(other) = output.fail(e)
        && other.to_string() != e.to_string()
    {
        complain(&other.to_string());
    }
    done
}

/// The exit code of a verdict.
fn code(verdict: Verdict) -> u8 {
    match verdict {
        Verdict::Agree => DONE,
        Verdict::Disagree => DISAGREE,
        Verdict::Undetermined => FAILED,
    }
}
