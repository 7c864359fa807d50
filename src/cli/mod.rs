//! The command line: raw arguments become one valid request, and the request an exit code.

mod accuracy;
mod answer;
mod args;
mod compare;
mod engines;
pub mod mesh;
mod mesh_commands;
mod orders;
mod paper;
mod progress;
mod solve;
mod stress;
mod study;
mod tell;
mod verify;
mod words;

use std::process::ExitCode;

use clap::Parser;

use crate::report;
use args::{Arguments, Command, Output, Told};
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Result};
use tell::note;

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
    match run(arguments).and_then(|code| tell::check().map(|()| code)) {
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

fn run(arguments: Arguments) -> Result<u8> {
    match arguments.command {
        Command::Verify(arguments) => verify::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Solve(arguments) => solve::run(&arguments),
        Command::Orders(arguments) => orders::run(&arguments),
        Command::Paper(arguments) => paper::run(&arguments),
        Command::Study(arguments) => study::run(&arguments),
        Command::Stress(arguments) => stress::run(&arguments),
        Command::Mesh(arguments) => mesh_commands::run(&arguments),
        Command::Engines(arguments) => engines::run(&arguments),
    }
}

/// Tells whoever reads what a run writes that it ended before anything was judged: a result of an earlier run must not
/// stand there as this one's.
fn tell_failure(
    command: &str,
    name: &str,
    error: &Error,
    told: &Told,
    output: &Output,
) -> Result<()> {
    let json = output.json.as_deref();
    report::write_json(json, &report::failure(command, error))?;
    report::write_failed_junit(told.junit.as_deref(), name, error)?;
    report::write_badge(told.badge.as_deref(), Verdict::Undetermined)?;
    report::annotate_failure(name, error, report::is_stdout(json))
}
