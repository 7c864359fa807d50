//! The `faceoff` program; everything it does is in the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(faceoff::cli::main(std::env::args_os()))
}
