//! The `faceoff` program; everything it does is in the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    // Where no handler can be set, an interruption ends the program as it is.
    let _ = ctrlc::set_handler(|| {
        faceoff_mesh::cancel::end(faceoff_mesh::cancel::Cause::Signal);
    });
    faceoff::cli::main()
}
