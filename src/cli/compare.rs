//! `faceoff compare`, of files and of results in memory.

use std::path::{Path, PathBuf};

use super::args::{Command, Compare};
use super::folders;
use super::progress::watched;
use super::words::OfField;
use super::{code, parse};
use crate::engine::meshio_python;
use crate::report::console::note;
use crate::report::model::Report;
use crate::report::{self, Output, deliver};
use faceoff_fem::scene::{Bounds, Comparing, Scene};
use faceoff_judge::{
    Comparison, Comparisons, GivenTolerances, Pairing, Part, PartialTolerance, Settings, Times,
    Tolerances, Verdict, are_identical, at_midpoints, compare_results, derive, interpolate,
    pair_times, project,
};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::Results;
use faceoff_mesh::io::{Series, matches};

pub(super) fn run(arguments: &Compare, to: &Output) -> Result<u8> {
    let sides = [&arguments.a, &arguments.b].map(|path| Side::Path(path.clone()));
    let tell = |what: String| {
        if !to.quiet {
            note!("faceoff: {what}");
        }
    };
    let found = Request::new(arguments, &sides, to.quiet, &tell)?.found(sides)?;
    deliver(&found.report()?, to)?;
    Ok(code(found.verdict()))
}

/// The two sides of a comparison.
pub enum Side {
    /// A file, a folder, or a pattern of files.
    Path(PathBuf),
    /// A result in memory.
    Here(Box<Results>),
}

/// `faceoff compare` for any results, with `options` as on the command line; what was left out is reported.
///
/// # Errors
/// The errors of the command.
pub fn compare(options: &[String], sides: [Side; 2], tell: &dyn Fn(String)) -> Result<Found> {
    let paths = sides.each_ref().map(|side| match side {
        Side::Path(path) => path.as_os_str().to_owned(),
        Side::Here(results) => results.source.clone().into(),
    });
    let words = ["compare".into()]
        .into_iter()
        .chain(options.iter().map(Into::into));
    let arguments = parse(words.chain(["--".into()]).chain(paths))?;
    match &arguments.command {
        Command::Compare(arguments) => Request::new(arguments, &sides, true, tell)?.found(sides),
        _ => Err(Error::usage("this is not a comparison", "give two results")),
    }
}

/// The options of the comparison.
struct Request<'a> {
    arguments: &'a Compare,
    tolerances: Tolerances,
    python: Option<PathBuf>,
    /// The mesh of tables by vertices.
    mesh: Option<Results>,
    quiet: bool,
    tell: &'a dyn Fn(String),
}

/// The result of comparing two results.
pub enum Found {
    /// With the result of the first.
    One(Box<Comparison>, Box<Results>),
    /// One part per time, or per file.
    Many(Comparisons),
}

impl Found {
    /// The verdict of the comparison, or the worst of all.
    pub fn verdict(&self) -> Verdict {
        match self {
            Found::One(comparison, _) => comparison.verdict,
            Found::Many(all) => all.verdict,
        }
    }

    /// # Errors
    /// Only those of a broken installation.
    pub fn report(&self) -> Result<Report<'_>> {
        match self {
            Found::One(comparison, of_a) => report::compare(comparison, of_a),
            Found::Many(all) => report::compare_many(all),
        }
    }
}

impl<'a> Request<'a> {
    fn new(
        arguments: &'a Compare,
        sides: &[Side; 2],
        quiet: bool,
        tell: &'a dyn Fn(String),
    ) -> Result<Self> {
        let scene = arguments.scene.as_deref();
        let scene = scene.map(|name| arguments.trust.scene(name)).transpose()?;
        for out in arguments.out.iter().chain(&arguments.project) {
            report::check_vtu_path(out)?;
        }
        let reads = sides.iter().any(|side| matches!(side, Side::Path(_)));
        let python = reads.then(meshio_python).flatten();
        let mesh = arguments
            .mesh
            .as_deref()
            .map(|path| Series::open(path)?.read(0, python.as_deref()));
        Ok(Request {
            arguments,
            tolerances: tolerances(arguments, scene_bounds(scene.as_ref())?),
            mesh: mesh.transpose()?,
            python,
            quiet,
            tell,
        })
    }

    fn found(&self, sides: [Side; 2]) -> Result<Found> {
        match sides {
            [Side::Path(a), Side::Path(b)] if a.is_dir() || b.is_dir() => {
                self.folders(&a, &b).map(Found::Many)
            }
            [Side::Path(a), Side::Path(b)] => self.files(&a, &b),
            [a, b] => {
                let series = |side| match side {
                    Side::Path(path) => Series::open(&path),
                    Side::Here(results) => Ok(Series::here(*results)),
                };
                self.series([series(a)?, series(b)?], false)
            }
        }
    }

    /// Two files, or two files with several times.
    fn files(&self, a: &Path, b: &Path) -> Result<Found> {
        let identical = are_identical(a, b)?;
        self.series([Series::open(a)?, Series::open(b)?], identical)
    }

    fn series(&self, mut sides: [Series; 2], identical: bool) -> Result<Found> {
        let [a, b] = sides.each_ref().map(|side| side.path().to_owned());
        if let Some([i, j]) = self.chosen(&sides)? {
            let [of_a, of_b] = &mut sides;
            let of_a = of_a.read(i, self.python.as_deref())?;
            let of_b = of_b.read(j, self.python.as_deref())?;
            let (comparison, of_a) = self.results(of_a, of_b, true, identical)?;
            return Ok(Found::One(Box::new(comparison), Box::new(of_a)));
        }
        if self.arguments.out.is_some() || self.arguments.project.is_some() {
            let what = "--out and --project write one time, and these are results of several";
            return Err(Error::usage(what, "choose one with --time or --times last"));
        }
        let times = [0, 1].map(|k: usize| {
            sides[k]
                .times
                .iter()
                .flatten()
                .copied()
                .collect::<Vec<f64>>()
        });
        let pairs = pair_times(&times[0], &times[1], &self.matched());
        let [named_a, named_b] = [&a, &b].map(|path| path.display().to_string());
        let mut all = Comparisons::new(named_a, named_b);
        let count = times[1].len();
        let unused = count - pairs.iter().filter_map(Pairing::of_second).count();
        if unused > 0 {
            all.notes.push(format!(
                "{unused} of the {count} times of {} lie between times of {} and were only interpolated from",
                b.display(), a.display()
            ));
        }
        for pair in pairs {
            let (time, found) = match pair {
                Pairing::Alone(side, k) => {
                    let (has, lacks) = (sides[side].name(k), [&b, &a][side].display());
                    let reason = format!("{lacks} has no such time, {has} has");
                    (times[side][k], Err(reason))
                }
                Pairing::Both(i, j) => {
                    let found = self.step(&mut sides, i, [j, j], 0.0, identical)?;
                    (times[0][i], found)
                }
                Pairing::Between(i, j, w) => {
                    let found = self.step(&mut sides, i, [j, j + 1], w, false)?;
                    (times[0][i], found)
                }
            };
            match found {
                Ok((comparison, of_a)) => {
                    let part = Part::compared(String::new(), Some(time), comparison);
                    all.add(part, Some(Box::new(of_a)));
                }
                Err(reason) => all.add(Part::failed(String::new(), Some(time), reason), None),
            }
        }
        Ok(Found::Many(all))
    }

    /// The i-th result of the first side against the second side, interpolated between two of its times; an error at one time does not
    /// prevent others from being judged.
    fn step(
        &self,
        [a, b]: &mut [Series; 2],
        i: usize,
        [j, k]: [usize; 2],
        w: f64,
        identical: bool,
    ) -> Result<Result<(Comparison, Results), String>> {
        let python = self.python.as_deref();
        let mut compared = || -> Result<(Comparison, Results)> {
            let of_b = match j == k {
                true => b.read(j, python)?,
                false => interpolate(&b.read(j, python)?, &b.read(k, python)?, w)?,
            };
            self.results(a.read(i, python)?, of_b, false, identical)
        };
        told(compared())
    }

    /// The one result of each side that is judged; None if all times are judged.
    fn chosen(&self, sides: &[Series; 2]) -> Result<Option<[usize; 2]>> {
        let last = self.arguments.times == "last";
        let counts = [0, 1].map(|k: usize| sides[k].times.len());
        let asked = |side: &Series| -> Result<usize> {
            let (Some(time), true) = (self.arguments.time, side.times[0].is_some()) else {
                return Ok(side.times.len() - 1);
            };
            let far = |k: &usize| (side.times[*k].unwrap_or_default() - time).abs();
            let near = (0..side.times.len()).min_by(|i, j| far(i).total_cmp(&far(j)));
            let tolerance = self.time_tolerance(time);
            near.filter(|k| far(k) <= tolerance).ok_or_else(|| {
                let known: Vec<String> = side
                    .times
                    .iter()
                    .flatten()
                    .take(5)
                    .map(f64::to_string)
                    .collect();
                let more = if side.times.len() > 5 { ", …" } else { "" };
                let what = format!(
                    "{} has no time {time}: it has {}{more}",
                    side.path().display(),
                    known.join(", ")
                );
                Error::usage(
                    what,
                    "name one of its times, or allow more with --time-tolerance",
                )
            })
        };
        if let (Some(time), [None, None]) = (
            self.arguments.time,
            sides.each_ref().map(|side| side.times[0]),
        ) {
            let what = format!("time {time} was asked for, and neither result has a time");
            return Err(Error::usage(what, "leave out --time"));
        }
        if self.arguments.time.is_some() || last {
            let [i, j] = [asked(&sides[0])?, asked(&sides[1])?];
            if let (true, Some(s), Some(t)) = (last, sides[0].times[i], sides[1].times[j])
                && (s - t).abs() > self.time_tolerance(s.abs().max(t.abs()))
            {
                let what = format!("the last times are {s} and {t}");
                let remedy = "name a time that both have, or allow more with --time-tolerance";
                return Err(Error::usage(what, remedy));
            }
            return Ok(Some([i, j]));
        }
        if counts == [1, 1] {
            let is_one = match [sides[0].times[0], sides[1].times[0]] {
                [Some(s), Some(t)] => pair_times(&[s], &[t], &self.matched()).len() == 1,
                _ => true,
            };
            if is_one {
                return Ok(Some([0, 0]));
            }
        }
        let alone = sides.iter().position(|side| side.times[0].is_none());
        match alone {
            None => Ok(None),
            Some(k) => {
                let (one, other) = (&sides[k], &sides[1 - k]);
                let what = format!(
                    "{} is of no time, and {} has {} times",
                    one.path().display(),
                    other.path().display(),
                    counts[1 - k]
                );
                Err(Error::usage(what, "choose one with --time or --times last"))
            }
        }
    }

    /// How times are matched.
    fn matched(&self) -> Times {
        Times {
            tolerance: self.arguments.time_tolerance,
            interpolate: self.arguments.interpolate,
        }
    }

    /// The tolerance for a time that somebody types, or that files store with few digits.
    fn time_tolerance(&self, time: f64) -> f64 {
        self.arguments.time_tolerance.unwrap_or(1e-6 * time.abs())
    }

    /// Two results; returns the first as it was judged. Output files are written here.
    fn results(
        &self,
        mut of_a: Results,
        mut of_b: Results,
        writes: bool,
        identical: bool,
    ) -> Result<(Comparison, Results)> {
        let arguments = self.arguments;
        let mesh = self.mesh.as_ref();
        pair(&mut of_b, &mut of_a, &arguments.pair, mesh)?;
        for side in [&mut of_a, &mut of_b] {
            let others = arguments.dim.map_or(0, |dim| side.keep_dimension(dim));
            if others > 0 {
                let source = &side.source;
                (self.tell)(format!(
                    "{source}: left out {others} cells of other dimensions"
                ));
            }
        }
        // What belongs to no cell is left out only where it would keep two meshes from being the same.
        if of_a.point_count() != of_b.point_count() {
            for side in [&mut of_a, &mut of_b] {
                let orphans = side.leave_out_orphans();
                if orphans > 0 {
                    let source = &side.source;
                    (self.tell)(format!(
                        "{source}: left out {orphans} points that are in no cell"
                    ));
                }
            }
        }
        at_midpoints(&mut of_a, &mut of_b)?;
        let is_left_out = |name: &str| arguments.except.iter().any(|p| matches(p, name));
        let is_asked = |name: &str| {
            arguments.only.is_empty() || arguments.only.iter().any(|p| matches(p, name))
        };
        for side in [&mut of_a, &mut of_b] {
            for name in &arguments.only {
                let _is_known = side.has(name) || derive(side, name, mesh)?;
            }
        }
        // In folders, other files may have it; a field that was paired has the other name.
        let is_known = |name: &&String| {
            let is_paired = arguments.pair.iter().any(|(_, other)| other == *name);
            is_paired
                || [&of_a, &of_b].iter().any(|side| {
                    side.has(name)
                        || side.unread.iter().any(|part| matches(name, &part.name))
                        || side.groups.iter().any(|group| {
                            matches(name, &group.tag.to_string())
                                || group.name.as_ref().is_some_and(|of| matches(name, of))
                        })
                })
        };
        let mut asked = arguments.only.iter().filter(|_| !arguments.a.is_dir());
        if let Some(name) = asked.find(|name| !is_known(name)) {
            let [a, b] = [&of_a.source, &of_b.source];
            let what = format!("{a} has no field `{name}`, nor has {b}");
            return Err(Error::usage(what, "name a field that one of them has"));
        }
        for side in [&mut of_a, &mut of_b] {
            let others = side.keep_only(|name| is_asked(name) && !is_left_out(name));
            if !others.is_empty() {
                (self.tell)(format!("{}: left out {}", side.source, others.join(", ")));
            }
        }
        // A scene is for several files: fields that neither of these two has may be in others.
        let mut tolerances = self.tolerances.clone();
        let is_here = |name: &str| of_a.has(name) || of_b.has(name);
        let is_given = |name: &str| arguments.field.iter().any(|of| of.name == name);
        let all = &mut tolerances.of_field;
        all.retain(|(name, _)| is_here(name) || is_given(name));
        let what = "laying the meshes over each other";
        let mut comparison = watched(&[], vec![], self.quiet, |bars| {
            let settings = Settings {
                tolerances,
                map: arguments.map,
                alone: arguments.uncovered,
                up_to: given(&arguments.field, |of| {
                    (!of.up_to.is_empty()).then(|| of.up_to.clone())
                }),
                nan_equal: arguments.nan_equal.clone(),
                near: arguments.place_tolerance,
                identical,
                progress: Some(&|share| bars.next(what, share)),
            };
            compare_results(&of_a, &of_b, &settings)
        })?;
        if let Some(out) = arguments.out.as_ref().filter(|_| writes) {
            report::write_differences(out, &of_a, &comparison)?;
        }
        if let Some(out) = arguments.project.as_ref().filter(|_| writes) {
            let projection = watched(&[], vec![], self.quiet, |bars| {
                project(&of_a, &of_b, &|share| bars.next("projecting", share))
            })?;
            report::write_projection(out, &projection, &of_a.source)?;
            report::projected(&projection)
                .into_iter()
                .for_each(self.tell);
        }
        // The owner of a borrowed array may change it as soon as this returns; the report is read later.
        for kept in comparison
            .found
            .as_deref_mut()
            .into_iter()
            .chain([&mut of_a])
        {
            kept.own();
        }
        Ok((comparison, of_a))
    }

    /// The files of two folders, by name.
    fn folders(&self, a: &Path, b: &Path) -> Result<Comparisons> {
        for (side, other) in [(a, b), (b, a)] {
            if !side.is_dir() {
                let what = format!(
                    "{} is a folder, and {} is not",
                    other.display(),
                    side.display()
                );
                return Err(Error::usage(what, "give two folders, or two files"));
            }
        }
        let arguments = self.arguments;
        if arguments.out.is_some() || arguments.project.is_some() {
            let what = "--out and --project write one result, and these are folders";
            return Err(Error::usage(what, "give two files"));
        }
        let found = folders::files(a, b, &arguments.include, &arguments.exclude)?;
        let [named_a, named_b] = [a, b].map(|path| path.display().to_string());
        let mut all = Comparisons {
            notes: found.notes,
            ..Comparisons::new(named_a, named_b)
        };
        for (name, why) in found.unread {
            all.add(Part::failed(name.display().to_string(), None, why), None);
        }
        for (name, there) in &found.files {
            let title = name.display().to_string();
            if let Some(without) = [a, b]
                .iter()
                .zip(there)
                .find_map(|(side, there)| (!there).then_some(side))
            {
                let reason = format!("{} does not have it", without.display());
                all.add(Part::failed(title, None, reason), None);
                continue;
            }
            match told(self.files(&a.join(name), &b.join(name)))? {
                Err(reason) => all.add(Part::failed(title, None, reason), None),
                Ok(Found::One(comparison, of_a)) => {
                    all.add(Part::compared(title, None, *comparison), Some(of_a));
                }
                Ok(Found::Many(times)) => {
                    let notes = times.notes.iter().map(|note| format!("{title}: {note}"));
                    all.notes.extend(notes);
                    let mut farthest = times.farthest;
                    for (k, part) in times.parts.into_iter().enumerate() {
                        let of_a = farthest.take_if(|(farthest, _)| *farthest == k);
                        let name = title.clone();
                        all.add(Part { name, ..part }, of_a.map(|(_, of_a)| of_a));
                    }
                }
            }
        }
        if all.parts.is_empty() {
            let what = format!(
                "neither {} nor {} has a result to compare",
                a.display(),
                b.display()
            );
            return Err(Error::usage(
                what,
                "name others with --include, as in --include '*.vtu'",
            ));
        }
        Ok(all)
    }
}

/// The error message of one of several comparisons; the end of a run ends all.
fn told<T>(found: Result<T>) -> Result<Result<T, String>> {
    match found {
        Ok(found) => Ok(Ok(found)),
        Err(Error::Ended(cause)) => Err(Error::Ended(cause)),
        Err(error) => Ok(Err(error.to_string())),
    }
}

/// The tolerances of the scene, overridden by those of the options.
fn tolerances(options: &Compare, scene: Option<&Comparing>) -> Tolerances {
    let (rtol, atol) = (options.rtol, options.atol);
    let options = GivenTolerances {
        of_all: PartialTolerance { rtol, atol },
        of_field: given(&options.field, |of| Some(of.tolerance)),
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

/// The settings of fields, by their names.
fn given<T>(fields: &[OfField], what: impl Fn(&OfField) -> Option<T>) -> Vec<(String, T)> {
    let known = fields.iter();
    known
        .filter_map(|of| Some((of.name.clone(), what(of)?)))
        .collect()
}

/// The tolerances of a scene; a scene without tolerances is an error.
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

/// Gives fields of the second file the names that the first has for them; either may be a component or a magnitude.
fn pair(
    b: &mut Results,
    a: &mut Results,
    pairs: &[(String, String)],
    mesh: Option<&Results>,
) -> Result<()> {
    for (name, other) in pairs {
        let missing = |source: &str, field: &str| {
            let what = format!("{source} has no field `{field}`");
            Error::usage(what, "give --pair the names of a field in either file")
        };
        if !a.has(name) && !derive(a, name, mesh)? {
            return Err(missing(&a.source, name));
        }
        let known = b.has(other) || derive(b, other, mesh)?;
        if !known || !b.rename(other, name) {
            return Err(missing(&b.source, other));
        }
    }
    Ok(())
}
