//! `faceoff hunt`: random forms in every code.

use std::path::Path;

use super::args::Hunt;
use super::code;
use super::progress::watched;
use crate::campaigns::hunt::{HuntOutcome, HuntRequest, LIBRARIES, hunt};
use crate::engine::OWN;
use crate::report::console::note;
use crate::report::{self, Output, deliver};
use faceoff_form::codes::CODES;
use faceoff_mesh::error::{Error, Result, distinct, meant};
use faceoff_mesh::io::{self, Options};
use faceoff_mesh::{cancel, file};

/// What is done.
const STATE: &str = "hunt.json";
/// The codes of a hunt with forms, where none are named.
const FORMS: [&str; 4] = [OWN, "freefem", "dolfinx", "scikit-fem"];

pub(super) fn run(arguments: &Hunt, to: &Output) -> Result<u8> {
    let mut engines = arguments.engines.clone();
    if engines.is_empty() {
        let default = match arguments.files {
            true => &LIBRARIES,
            false => &FORMS,
        };
        engines = default.map(str::to_owned).to_vec();
    }
    let names = || {
        let libraries = LIBRARIES.into_iter().filter(|_| arguments.files);
        let codes = CODES.iter().filter(|_| !arguments.files);
        let own = std::iter::once(OWN).filter(|_| !arguments.files);
        libraries.chain(own.chain(codes.map(|code| code.name)))
    };
    for name in &engines {
        if !names().any(|known| known == name) {
            let known = names().collect::<Vec<_>>().join(", ");
            let remedy = format!("{}known are {known}", meant(name, names()));
            return Err(Error::usage(
                match arguments.files {
                    true => format!("no library `{name}` writes or reads files here"),
                    false => format!("no scripts are written for a code `{name}`"),
                },
                remedy,
            ));
        }
    }
    distinct(&engines, "code", "name each code once")?;
    let before = match (&arguments.out, arguments.resume) {
        (Some(folder), true) => {
            let path = folder.join(STATE);
            let seed = arguments.seed.to_string();
            let asked = [&*engines.join(","), &*seed];
            let before = HuntOutcome::read(&path, &file::text(&path)?, asked)?;
            if before.files != arguments.files {
                let what = format!("{} is of another hunt", path.display());
                let remedy =
                    "go on with --files if it was of files, and without if it was of forms";
                return Err(Error::usage(what, remedy));
            }
            Some(before)
        }
        (Some(folder), false) if folder.join(STATE).exists() => {
            let what = format!("{} has a hunt already", folder.display());
            return Err(Error::usage(
                what,
                "go on with it by --resume, or take another folder",
            ));
        }
        _ => None,
    };
    let request = HuntRequest {
        engines,
        files: arguments.files,
        seed: arguments.seed,
        count: arguments.count.map(|count| count as usize),
        patience: arguments.patience,
        before,
    };
    // It ends with what it has found.
    cancel::hear();
    let mut told = request
        .before
        .as_ref()
        .map_or(0, |before| before.findings.len());
    let outcome = watched(&[], vec![], to.quiet, |progress| {
        hunt(&request, progress, &mut |outcome| {
            for finding in outcome.findings.iter().skip(told) {
                if !to.quiet {
                    note!(
                        "problem {}: {} {}: {}",
                        finding.first,
                        finding.code,
                        finding.kind.words(),
                        finding.words
                    );
                }
            }
            told = outcome.findings.len();
            match &arguments.out {
                Some(folder) => keep(folder, outcome),
                None => Ok(()),
            }
        })
    })?;
    deliver(&report::hunt(&outcome, arguments.out.as_deref())?, to)?;
    Ok(code(outcome.verdict()))
}

/// Writes what is done, and each finding.
fn keep(folder: &Path, outcome: &HuntOutcome) -> Result<()> {
    let make = |path: &Path| std::fs::create_dir_all(path).map_err(Error::io(path, "make"));
    make(folder)?;
    for (k, finding) in outcome.findings.iter().enumerate() {
        let place = folder.join(finding.name(k));
        if place.join(&finding.file).exists() {
            continue;
        }
        make(&place)?;
        if let Some(mesh) = &finding.grid {
            io::write(&place.join("mesh.msh"), mesh, &Options::default())?;
        }
        io::save(&place.join(&finding.file), [finding.form.as_bytes()])?;
    }
    let text = serde_json::to_string_pretty(outcome)
        .map_err(|e| Error::usage(format!("the hunt cannot be JSON: {e}"), "report this"))?;
    io::save(&folder.join(STATE), [text.as_bytes()])
}
