//! The releases of the other codes that the companions support, and the warning for others.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use super::process;
use faceoff_mesh::error::{Error, Result};

/// A code with a companion.
struct Known {
    engine: &'static str,
    code: &'static str,
    /// Releases that all scenes were verified with.
    tested: &'static [[u32; 2]],
    /// Older ones lack features that the companion uses.
    oldest: [u32; 2],
    remedy: &'static str,
}

/// FreeFEM 3 has neither the language of the script nor its 3D elements. Debian's 4.11 reports 4.9.
/// Before 0.5, dolfinx had different names for most functions that the companion calls.
const KNOWN: [Known; 2] = [
    Known {
        engine: "freefem",
        code: "FreeFEM",
        tested: &[[4, 9], [4, 11], [4, 15]],
        oldest: [4, 0],
        remedy: "install 4.11 or later: Debian 12 has it",
    },
    Known {
        engine: "fenicsx",
        code: "dolfinx",
        tested: &[[0, 5], [0, 9]],
        oldest: [0, 5],
        remedy: "install 0.5 or later: Debian 12 has it; or name a Python that has it in FACEOFF_PYTHON",
    },
];

/// The text of a line `version …` that a command, run in `folder`, prints.
///
/// # Errors
/// A command that fails, or that takes longer than `seconds`.
pub(super) fn told(
    engine: &str,
    command: &Command,
    folder: &Path,
    seconds: u64,
) -> Result<Option<String>> {
    let mut version = None;
    let limit = Duration::from_secs(seconds);
    process::run(engine, command, folder, limit, None, |line| {
        if let Some(told) = line.strip_prefix("version ") {
            version = Some(told.trim().to_owned());
        }
    })?;
    Ok(version)
}

/// Refuses a release that is too old for the companion of `engine`.
///
/// # Errors
/// That release, and the remedy.
pub(super) fn accept(engine: &str, version: &str) -> Result<()> {
    match (known(engine), parse(version)) {
        (Some(of), Some(release)) if release < of.oldest => {
            let [major, minor] = of.oldest;
            Err(Error::engine(
                engine,
                format!(
                    "{} {version} is too old: the companion needs {major}.{minor}",
                    of.code
                ),
                of.remedy,
            ))
        }
        _ => Ok(()),
    }
}

/// A warning about a release of `engine` with which the companion was not tested; None for others, and for
/// engines that have no companion here.
pub fn doubt(engine: &str, version: &str) -> Option<String> {
    let of = known(engine)?;
    let tested: Vec<String> = of.tested.iter().map(|[a, b]| format!("{a}.{b}")).collect();
    let what = match parse(version) {
        Some(release) if of.tested.contains(&release) => return None,
        Some(_) => format!("{} {version} is not one of the releases", of.code),
        None => format!(
            "`{version}` is not a known version of {}, and not one",
            of.code
        ),
    };
    Some(format!(
        "{what} that the companion was tested with ({}); its answers are judged all the same",
        tested.join(", ")
    ))
}

fn known(engine: &str) -> Option<&'static Known> {
    KNOWN.iter().find(|known| known.engine == engine)
}

/// The first two numbers: 0.9 of 0.9.0.post1.
fn parse(version: &str) -> Option<[u32; 2]> {
    let mut numbers = version.split('.').map(|word| {
        let end = word
            .find(|c: char| !c.is_ascii_digit())
            .unwrap_or(word.len());
        word[..end].parse::<u32>().ok()
    });
    Some([numbers.next()??, numbers.next()??])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn releases_are_told_apart() {
        for (engine, version) in [
            ("freefem", "4.11"),
            ("freefem", "4.15"),
            ("fenicsx", "0.5.2"),
            ("fenicsx", "0.9.0.post1"),
            ("rust", "0.1.0"),
            ("mine", "unknown"),
        ] {
            assert_eq!(doubt(engine, version), None, "{engine} {version}");
            accept(engine, version).unwrap();
        }
        for (engine, version, said) in [
            ("freefem", "4.12", "(4.9, 4.11, 4.15)"),
            ("freefem", "4.1", "FreeFEM 4.1 is not one"),
            ("fenicsx", "0.11.0.dev0", "dolfinx 0.11.0.dev0 is not one"),
            ("fenicsx", "2019.2", "is not one"),
            ("fenicsx", "unknown", "not a known version of dolfinx"),
            ("freefem", "", "not a known version of FreeFEM"),
        ] {
            let doubt = doubt(engine, version).unwrap_or_default();
            assert!(doubt.contains(said), "{engine} {version}: {doubt}");
            accept(engine, version).unwrap();
        }
        for (engine, version) in [("freefem", "3.61"), ("fenicsx", "0.4.1")] {
            let refused = accept(engine, version).unwrap_err().to_string();
            assert!(refused.contains("too old"), "{refused}");
            assert!(refused.contains(version), "{refused}");
        }
    }
}
