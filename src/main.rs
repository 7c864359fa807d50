//! The `faceoff` program; everything it does is in the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    // The first interruption ends engines with their children and removes temporary folders; a
    // second one does not wait. Where no handler can be set, the first one ends the program.
    let _ = ctrlc::set_handler(|| {
        if faceoff_mesh::cancel::interrupt() {
            #[allow(clippy::exit, reason = "the user insists")]
            std::process::exit(2);
        }
    });
    faceoff::cli::main()
}
