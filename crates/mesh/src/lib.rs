//! Meshes of finite elements, fields on them, and the files that hold both.
//!
//! A file of any format that is known becomes a [`Mesh`] and its fields, and a mesh becomes a file again, with its groups,
//! names and numbers; what a format cannot hold is an error or, on request, a warning each.

pub mod cancel;
pub mod error;
pub mod field;
pub mod io;
pub mod mesh;
pub mod process;

pub use error::{Error, Place, Result};
pub use mesh::Mesh;

/// Random tests see the same values on every day and machine; `FACEOFF_SEED` asks for others (see tests/run).
#[cfg(test)]
fn test_config(cases: u32) -> proptest::test_runner::Config {
    let seed = std::env::var("FACEOFF_SEED").map_or(2017, |seed| {
        seed.parse().expect("FACEOFF_SEED is a whole number")
    });
    proptest::test_runner::Config {
        cases,
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(seed),
        ..proptest::test_runner::Config::default()
    }
}
