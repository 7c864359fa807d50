//! `faceoff compare`.

use std::path::{Path, PathBuf};

use super::args::Compare;
use super::code;
use crate::engine::meshio_python;
use crate::report::console::note;
use crate::report::{self, Output, deliver};
use faceoff_fem::scene::{Bounds, Comparing, Scene};
use faceoff_judge::{Tolerance, Tolerances, compare_results};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::Results;
use faceoff_mesh::io;

pub(super) fn run(arguments: &Compare, to: &Output) -> Result<u8> {
    let (a, b) = (arguments.a.as_path(), arguments.b.as_path());
    refuse_copies(a, b, arguments.allow_identical)?;
    let scene = arguments.scene.as_deref();
    let scene = scene.map(|name| arguments.trust.scene(name)).transpose()?;
    let mut tolerances = tolerances(arguments, scene_bounds(scene.as_ref())?);
    if let Some(out) = &arguments.out {
        report::check_vtu_path(out)?;
    }
    let python = meshio_python();
    // Each file's bytes go before the next is read into fields.
    let read = |path: &Path| -> Result<Results> {
        let bytes = std::fs::read(path).map_err(Error::io(path, "read"))?;
        io::read_results(path, &bytes, python.as_deref())
    };
    let (mut of_a, mut of_b) = (read(a)?, read(b)?);
    pair(&mut of_b, &of_a, &arguments.pair)?;
    for side in [&mut of_a, &mut of_b] {
        let others = arguments.dim.map_or(0, |dim| side.keep_dimension(dim));
        if others > 0 && !to.quiet {
            let source = &side.source;
            note!("faceoff: {source}: left out {others} cells of other dimensions");
        }
    }
    // A table of places beside fields on cells: the places are the cells' midpoints.
    let is_table = |r: &Results| r.width == 0 && !r.points.is_empty();
    if is_table(&of_a) && of_b.on_points.is_empty() && of_b.width > 0 {
        of_b = of_b.centroids();
    } else if is_table(&of_b) && of_a.on_points.is_empty() && of_a.width > 0 {
        of_a = of_a.centroids();
    }
    if !arguments.only.is_empty() {
        for side in [&mut of_a, &mut of_b] {
            let others = side.keep_only(&arguments.only);
            if !others.is_empty() && !to.quiet {
                note!("faceoff: {}: left out {}", side.source, others.join(", "));
            }
        }
    }
    // A scene is of several files: what none of these two has may be in others.
    let (here, options) = (
        |name: &str| of_a.has(name) || of_b.has(name),
        &arguments.field,
    );
    tolerances
        .of_field
        .retain(|(name, _)| here(name) || options.iter().any(|f| f.name == *name));
    let comparison = compare_results(&of_a, &of_b, arguments.map.map(Into::into), &tolerances)?;
    if let Some(out) = &arguments.out {
        report::write_differences(out, &of_a, &comparison)?;
    }
    deliver(&report::compare(&comparison, &of_a)?, to)?;
    Ok(code(comparison.verdict))
}

/// The relative tolerance of a comparison that is given none.
const RTOL: f64 = 1e-9;

/// The tolerances: of a field before those of all, and options before the scene.
fn tolerances(options: &Compare, scene: Option<&Comparing>) -> Tolerances {
    let scene_wide = scene.map(|s| s.of_all);
    let all = |key: fn(&Bounds) -> Option<f64>, option: Option<f64>| {
        option.or_else(|| scene_wide.as_ref().and_then(key))
    };
    let of_all = Tolerance {
        rtol: all(|b| b.rtol, options.rtol).unwrap_or(RTOL),
        atol: all(|b| b.atol, options.atol).unwrap_or(0.0),
    };
    let of_scene = scene.map(|s| &s.of_field).into_iter().flatten();
    let of_scene = of_scene.map(|(name, b)| (name, b.rtol, b.atol));
    let of_options = options.field.iter().map(|f| (&f.name, f.rtol, f.atol));
    let mut of_field: Vec<(String, Tolerance)> = Vec::new();
    for (name, rtol, atol) in of_scene.chain(of_options) {
        let known = of_field.iter().rfind(|(other, _)| other == name);
        let below = known.map_or(of_all, |(_, tolerance)| *tolerance);
        let tolerance = Tolerance {
            rtol: rtol.unwrap_or(below.rtol),
            atol: atol.unwrap_or(below.atol),
        };
        of_field.push((name.clone(), tolerance));
    }
    Tolerances { of_all, of_field }
}

/// A file against itself, under whatever name, or against a copy of it.
fn refuse_copies(a: &Path, b: &Path, identical_is_allowed: bool) -> Result<()> {
    let refuse = |what: &str, remedy: &str| {
        Err(Error::Compare {
            a: a.display().to_string(),
            b: b.display().to_string(),
            what: what.to_owned(),
            remedy: remedy.to_owned(),
        })
    };
    // Lists may name the same file, or be names of it.
    let (sources_a, sources_b) = (io::sources(a)?, io::sources(b)?);
    for of_a in &sources_a {
        for of_b in &sources_b {
            if is_same_file(of_a, of_b)? {
                return refuse(
                    "they are one file, and a file against itself proves nothing",
                    "name two results",
                );
            }
        }
    }
    let equal = |(a, b): (&PathBuf, &PathBuf)| -> Result<bool> {
        let read = |path: &Path| std::fs::read(path).map_err(Error::io(path, "read"));
        let size = |path: &Path| path.metadata().map(|m| m.len()).ok();
        Ok(size(a) == size(b) && read(a)? == read(b)?)
    };
    let mut copies = sources_a.len() == sources_b.len() && !sources_a.is_empty();
    for pair in sources_a.iter().zip(&sources_b) {
        copies = copies && equal(pair)?;
    }
    if copies && !identical_is_allowed {
        return refuse(
            "they are the same byte for byte, as a file and its copy are, which proves nothing",
            "name two results; if both were computed, say --allow-identical",
        );
    }
    Ok(())
}

/// What a scene allows; one that allows nothing of its own was not meant.
fn scene_bounds(scene: Option<&Scene>) -> Result<Option<&Comparing>> {
    let Some(scene) = scene else { return Ok(None) };
    let bounds = scene.compare.as_ref().ok_or_else(|| Error::Scene {
        scene: scene.name.clone(),
        place: "compare".into(),
        what: "it gives no tolerances".into(),
        remedy: "write [compare] with rtol, atol, or fields, or leave out --scene".into(),
    });
    bounds.map(Some)
}

/// Gives fields of the second file the names that the first has for them.
fn pair(b: &mut Results, a: &Results, pairs: &[(String, String)]) -> Result<()> {
    for (name, other) in pairs {
        let missing = |source: &str, field: &str| {
            let what = format!("{source} has no field `{field}`");
            Error::usage(what, "give --pair the names of a field in either file")
        };
        if !a.has(name) {
            return Err(missing(&a.source, name));
        }
        if !b.rename(other, name) {
            return Err(missing(&b.source, other));
        }
    }
    Ok(())
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

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::super::args::{Arguments, Command};
    use super::*;

    #[test]
    fn the_nearest_tolerance_counts() {
        let told = |words: &[&str], scene: Option<&Comparing>| {
            let words = [&["faceoff", "compare", "a", "b"], words].concat();
            let Ok(Arguments {
                command: Command::Compare(compare),
            }) = Arguments::try_parse_from(words)
            else {
                panic!("these are words of compare")
            };
            let tolerances = tolerances(&compare, scene);
            let of = |name: &str| {
                let own = tolerances.of_field.iter().rfind(|(n, _)| n == name);
                let Tolerance { rtol, atol } = own.map_or(tolerances.of_all, |(_, t)| *t);
                (rtol, atol)
            };
            [of("u"), of("v")]
        };
        let bounds = |rtol, atol| Bounds { rtol, atol };
        let scene = Comparing {
            of_all: bounds(Some(1e-3), None),
            of_field: [("u".to_owned(), bounds(None, Some(1e-4)))].into(),
        };
        let scene = Some(&scene);
        assert_eq!(told(&[], None), [(1e-9, 0.0); 2]);
        assert_eq!(told(&["--rtol", "1"], None), [(1.0, 0.0); 2]);
        assert_eq!(told(&[], scene), [(1e-3, 1e-4), (1e-3, 0.0)]);
        assert_eq!(
            told(&["--rtol", "1", "--atol", "2"], scene),
            [(1.0, 1e-4), (1.0, 2.0)]
        );
        assert_eq!(
            told(&["--field", "u:rtol=5", "--field", "v:atol=6"], scene),
            [(5.0, 1e-4), (1e-3, 6.0)]
        );
    }
}
