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
mod verify;

use std::process::ExitCode;

use clap::Parser;

use crate::error::Result;
use args::{Arguments, Command};

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
    match run(arguments) {
        Ok(code) => ExitCode::from(code),
        Err(e) => {
            eprintln!("faceoff: {e}");
            ExitCode::from(FAILED)
        }
    }
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
