//! The arguments of `engines`: what is here, what to install, and the checks of a code.

use clap::{Args, Subcommand};

use super::{Output, Verdicts};

#[derive(Args)]
pub(in crate::cli) struct Engines {
    #[command(subcommand)]
    pub action: Option<EnginesAction>,
    #[command(flatten)]
    pub output: Output,
}

/// Everything that `engines install` can install.
pub(in crate::cli) const INSTALLED: [&str; 3] = ["freefem", "fenicsx", "meshio"];

#[derive(Subcommand)]
pub(in crate::cli) enum EnginesAction {
    /// Install missing codes: FreeFEM and dolfinx by apt, meshio into a private environment
    Install {
        /// The codes to install [default: all]
        #[arg(value_parser = INSTALLED)]
        what: Vec<String>,
    },
    /// Run a code on small cases with known answers, and report its errors
    ///
    /// Exit code: 0 all correct, 1 something is wrong, 2 something has no answer.
    Check {
        /// A TOML file that describes an engine, or the name of one that is built in
        #[arg(value_name = "FILE")]
        engine: String,
        /// Only the checks whose subject contains this, as in "Γ_N" or "3D"
        #[arg(
            long,
            value_name = "TEXT",
            default_value = "",
            hide_default_value = true
        )]
        about: String,
        #[command(flatten)]
        verdicts: Verdicts,
        #[command(flatten)]
        output: Output,
    },
}
