//! Compares the fields in two result files of any codes, on the same mesh or on others.
//!
//!     cargo run --example compare_results -- a.vtu b.vtu

use std::path::Path;
use std::process::ExitCode;

use faceoff_judge::{Comparison, Settings, Verdict, are_identical, compare_results};
use faceoff_mesh::field::Results;
use faceoff_mesh::{Error, Result, io};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [a, b] = &arguments[..] else {
        eprintln!("usage: compare_results A B");
        return ExitCode::from(2);
    };
    match compare(a.as_ref(), b.as_ref()) {
        Ok(comparison) => {
            for field in &comparison.fields {
                let judged = &field.field;
                println!(
                    "{}: {:?}, {:e}",
                    judged.field, judged.verdict, judged.max_rel
                );
            }
            ExitCode::from(match comparison.verdict {
                Verdict::Agree | Verdict::Conditioned => 0,
                Verdict::Several | Verdict::Disagree => 1,
                Verdict::Undetermined => 2,
            })
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn compare(a: &Path, b: &Path) -> Result<Comparison> {
    are_identical(a, b)?;
    let (a, b) = (read(a)?, read(b)?);
    compare_results(&a, &b, &Settings::default())
}

fn read(path: &Path) -> Result<Results> {
    let bytes = std::fs::read(path).map_err(Error::io(path, "read"))?;
    io::read_results(path, &bytes, None)
}
