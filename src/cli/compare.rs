//! `faceoff compare`.

use std::path::Path;

use super::args::Compare;
use super::code;
use crate::engine::meshio_python;
use crate::report::console::note;
use crate::report::{self, Output, deliver};
use faceoff_fem::scene::{Bounds, Comparing, Scene};
use faceoff_judge::{
    GivenTolerances, PartialTolerance, Settings, Tolerances, at_midpoints, compare_results,
    refuse_copies,
};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::Results;
use faceoff_mesh::file;
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
        let bytes = file::read(path)?;
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
    at_midpoints(&mut of_a, &mut of_b)?;
    if !arguments.only.is_empty() {
        for side in [&mut of_a, &mut of_b] {
            let others = side.keep_only(&arguments.only);
            if !others.is_empty() && !to.quiet {
                note!("faceoff: {}: left out {}", side.source, others.join(", "));
            }
        }
    }
    // A scene is of several files: what none of these two has may be in others.
    let is_here = |name: &str| of_a.has(name) || of_b.has(name);
    let is_given = |name: &str| arguments.field.iter().any(|(known, _)| known == name);
    let all = &mut tolerances.of_field;
    all.retain(|(name, _)| is_here(name) || is_given(name));
    let settings = Settings {
        tolerances,
        map: arguments.map,
        alone: arguments.uncovered,
        progress: None,
    };
    let comparison = compare_results(&of_a, &of_b, &settings)?;
    if let Some(out) = &arguments.out {
        report::write_differences(out, &of_a, &comparison)?;
    }
    deliver(&report::compare(&comparison, &of_a)?, to)?;
    Ok(code(comparison.verdict))
}

/// Of the scene, and before it of the options.
fn tolerances(options: &Compare, scene: Option<&Comparing>) -> Tolerances {
    let (rtol, atol) = (options.rtol, options.atol);
    let options = GivenTolerances {
        of_all: PartialTolerance { rtol, atol },
        of_field: options.field.clone(),
    };
    let of = |&Bounds { rtol, atol }: &Bounds| PartialTolerance { rtol, atol };
    let of_scene = |scene: &Comparing| {
        let fields = scene.of_field.iter();
        GivenTolerances {
            of_all: of(&scene.of_all),
            of_field: fields.map(|(name, b)| (name.clone(), of(b))).collect(),
        }
    };
    let scene = scene.map(of_scene).unwrap_or_default();
    Tolerances::of_sources(&[scene, options])
}

/// What a scene allows; one that allows nothing of its own was not meant.
fn scene_bounds(scene: Option<&Scene>) -> Result<Option<&Comparing>> {
    let Some(scene) = scene else { return Ok(None) };
    let bounds = scene.compare().ok_or_else(|| Error::Scene {
        scene: scene.name().to_owned(),
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
