//! `faceoff compare`.

use std::path::Path;

use super::args::Compare;
use super::{DISAGREE, DONE, FAILED};
use crate::compare::{Comparison, Tolerances, Verdict, compare_results};
use crate::engine::meshio_python;
use crate::error::{Error, Result};
use crate::io;
use crate::report;

pub(super) fn run(arguments: &Compare) -> Result<u8> {
    let comparison = compare(arguments);
    let told = &arguments.told;
    if let Err(e) = &comparison {
        let name = format!("{} – {}", arguments.a.display(), arguments.b.display());
        report::write_failed_junit(told.junit.as_deref(), &name, e)?;
        report::write_badge(told.badge.as_deref(), Verdict::Undetermined)?;
    }
    let comparison = comparison?;
    report::write_comparison_junit(told.junit.as_deref(), &comparison)?;
    report::write_badge(told.badge.as_deref(), comparison.verdict)?;
    let json = arguments.output.json.as_deref();
    report::write_json(json, &report::document("compare", &comparison))?;
    if !arguments.output.quiet && !report::is_stdout(json) {
        print!("{}", report::comparison_table(&comparison));
    }
    report::annotate_comparison(&comparison, report::is_stdout(json))?;
    Ok(match comparison.verdict {
        Verdict::Agree => DONE,
        Verdict::Disagree => DISAGREE,
        Verdict::Undetermined => FAILED,
    })
}

fn compare(arguments: &Compare) -> Result<Comparison> {
    let (a, b) = (arguments.a.as_path(), arguments.b.as_path());
    let refuse = |what: &str, remedy: &str| Error::Compare {
        a: a.display().to_string(),
        b: b.display().to_string(),
        what: what.to_owned(),
        remedy: remedy.to_owned(),
    };
    if is_same_file(a, b)? {
        return Err(refuse(
            "they are one file, and a file against itself proves nothing",
            "name two results",
        ));
    }
    let read = |path: &Path| std::fs::read(path).map_err(Error::io(path, "read"));
    let (bytes_a, bytes_b) = (read(a)?, read(b)?);
    if bytes_a == bytes_b && !arguments.allow_identical {
        return Err(refuse(
            "they are the same byte for byte, as a file and its copy are, which proves nothing",
            "name two results; if both were computed, say --allow-identical",
        ));
    }
    let python = meshio_python();
    // Each file's bytes go before the next is read into fields.
    let mut of_a = io::read_results(a, &bytes_a, python.as_deref())?;
    drop(bytes_a);
    let mut of_b = io::read_results(b, &bytes_b, python.as_deref())?;
    drop(bytes_b);
    // A table of places beside fields on cells: the places are the cells' midpoints.
    let is_table = |r: &crate::field::Results| r.width == 0 && !r.points.is_empty();
    if is_table(&of_a) && of_b.on_points.is_empty() && of_b.width > 0 {
        of_b = of_b.centroids();
    } else if is_table(&of_b) && of_a.on_points.is_empty() && of_a.width > 0 {
        of_a = of_a.centroids();
    }
    if !arguments.only.is_empty() {
        for side in [&mut of_a, &mut of_b] {
            let others = side.keep_only(&arguments.only);
            if !others.is_empty() && !arguments.output.quiet {
                eprintln!("faceoff: {}: left out {}", side.source, others.join(", "));
            }
        }
    }
    let tolerances = Tolerances {
        of_all: arguments.tolerance(),
        of_field: arguments.fields(),
    };
    let comparison = compare_results(&of_a, &of_b, arguments.map.map(Into::into), &tolerances)?;
    if let Some(out) = &arguments.out {
        report::write_differences(out, &of_a, &comparison)?;
    }
    Ok(comparison)
}

/// By path, by a link of either kind, or by another way to it.
fn is_same_file(a: &Path, b: &Path) -> Result<bool> {
    let whole = |path: &Path| path.canonicalize().map_err(Error::io(path, "read"));
    if whole(a)? == whole(b)? {
        return Ok(true);
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let inode = |path: &Path| {
            let found = path.metadata().map_err(Error::io(path, "read"))?;
            Ok::<_, Error>((found.dev(), found.ino()))
        };
        Ok(inode(a)? == inode(b)?)
    }
    #[cfg(not(unix))]
    Ok(false)
}
