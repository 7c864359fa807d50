//! `faceoff verify`.

use std::collections::BTreeSet;
use std::path::Path;

use super::args::{Running, Verify};
use super::progress::watched;
use super::{DONE, FAILED, code, engines};
use crate::campaigns::face_off::{self, Cost, FaceOffOutcome, FaceOffs};
use crate::campaigns::study::duration;
use crate::campaigns::verify::{VerifyRequest, diagnose, verify};
use crate::engine::{self, Engine, Launch, Settings, quoted, typed};
use crate::report::console::note;
use crate::report::{self, Output, Verified, deliver};
use crate::run::{Code, FaceOff, Failure, Point, Record, Store, is_elastic, is_face_off};
use faceoff_fem::contact::{Method, Stop};
use faceoff_fem::scene::Scene;
use faceoff_form::image::Image;
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Result, distinct};

pub(super) fn run(arguments: &Verify, is_verbose: bool, to: &Output) -> Result<u8> {
    if arguments
        .scenes
        .iter()
        .any(|name| is_face_off(name.as_ref()))
    {
        return of_file(arguments, to);
    }
    if !arguments.set.is_empty() {
        let what = "--set is for parameters of face-off files and forms, and scenes have none";
        return Err(Error::usage(what, "leave it out"));
    }
    if arguments.symmetries {
        let what = "--symmetries is for face-off files and forms";
        return Err(Error::usage(
            what,
            "leave it out; `faceoff stress` moves scenes",
        ));
    }
    let scenes = match &arguments.scenes[..] {
        [] => Scene::builtin_names().map(str::to_owned).collect(),
        asked => asked.to_vec(),
    };
    let scenes = arguments.trust.scenes(&scenes)?;
    distinct(&arguments.n, "n", "give different refinements")?;
    let (mut engines, missing) = present(arguments)?;
    if let Some(folder) = &arguments.against {
        engines.extend(Record::read(folder)?.engines());
    }
    if let Some(folder) = &arguments.record {
        report::check_baseline_folder(folder)?;
    }
    let request = VerifyRequest {
        scenes,
        methods: arguments.methods.0.clone(),
        n: arguments.n.iter().map(|&n| n as usize).collect(),
        engines: engines.iter().map(|engine| &**engine).collect(),
        settings: settings(&arguments.running),
        journal: arguments.resume.clone(),
    };
    check_launch(&request.settings, &request.engines)?;
    let names: Vec<&str> = request.engines.iter().map(|e| e.name()).collect();
    let outcome = watched(&names, work(&request), to.quiet, |progress| {
        verify(&request, progress)
    })?;

    let diagnoses = match arguments.diagnose {
        true => diagnose(&request, &outcome)?,
        false => Vec::new(),
    };
    let report = report::verify(Verified {
        outcome: &outcome,
        diagnoses: &diagnoses,
        missing: &missing,
        explain: arguments.explain,
        verbose: is_verbose,
    })?;
    deliver(&report, to)?;
    let answered = outcome.answers();
    let doubts = answered.filter_map(|of| engine::doubt(&of.engine, &of.version));
    for doubt in doubts.collect::<BTreeSet<_>>() {
        note!("faceoff: warning: {doubt}");
    }
    for failure in &outcome.failures {
        note!("faceoff: {}", failure.message);
    }
    let recorded = recorded(arguments, outcome.verdict, |_, recipe| {
        report::baseline(recipe, &request.settings, &outcome)
    })?;
    Ok(code(outcome.verdict).max(recorded))
}

/// Users' codes of a face-off file, or those of a form; there may be several scenes of elasticity, each with several methods.
fn of_file(arguments: &Verify, to: &Output) -> Result<u8> {
    let is_elastic = |name: &String| is_elastic(name.as_ref());
    let are_elastic = arguments.scenes.iter().all(is_elastic);
    if let ([_, name, ..], false) = (&arguments.scenes[..], are_elastic) {
        let alone = match arguments.scenes.iter().find(|name| !is_elastic(name)) {
            Some(other) if arguments.scenes.iter().any(is_elastic) => {
                let what = format!("{other} is no scene of elasticity, and others here are");
                return Err(Error::usage(what, "verify them apart"));
            }
            _ => name,
        };
        let what = format!(
            "a face-off file cannot be verified together with others, and {alone} is given too"
        );
        return Err(Error::usage(what, "give one such file at a time"));
    }
    distinct(&arguments.scenes, "scene", "give different scenes")?;
    let methods = match are_elastic {
        true => &arguments.methods.0[..],
        false => &[Method::cr()],
    };
    let all = arguments.scenes.iter();
    let all = all.flat_map(|name| methods.iter().map(move |method| (name, *method)));
    let all: Vec<(&String, Method)> = all.collect();
    if let [(name, method)] = &all[..] {
        let (outcome, recorded) = of_one(arguments, name, method, to)?;
        deliver(&report::face_off(&outcome)?, to)?;
        tell(&outcome);
        return Ok(code(outcome.verdict).max(recorded));
    }
    let of_one_alone = [
        ("--record", arguments.record.is_some()),
        ("--against", arguments.against.is_some()),
        ("--resume", arguments.resume.is_some()),
    ];
    if let Some((option, _)) = of_one_alone.iter().find(|(_, is_given)| *is_given) {
        let what = format!("{option} is of one scene of elasticity by one method");
        return Err(Error::usage(
            what,
            "name one scene, and one method by --methods",
        ));
    }
    let outcomes = all
        .into_iter()
        .map(|(name, method)| Ok(of_one(arguments, name, &method, to)?.0))
        .collect::<Result<Vec<_>>>()?;
    let all = FaceOffs::new(outcomes);
    deliver(&report::face_offs(&all)?, to)?;
    all.face_offs.iter().for_each(tell);
    Ok(code(all.verdict))
}

/// The findings and failures of a face-off that its report on the terminal leaves out.
fn tell(outcome: &FaceOffOutcome) {
    let findings = outcome.diagnosis.iter().flat_map(|d| &d.findings);
    let of_images = outcome.symmetries.iter().flat_map(|of| &of.findings);
    for finding in findings.chain(of_images) {
        note!("faceoff: {finding}");
    }
    let mut told = BTreeSet::new();
    for run in &outcome.runs {
        // What keeps a code from running on one mesh most often does on all.
        if let Some(failure) = run.failure.as_ref().filter(|_| told.insert(&run.code)) {
            note!("faceoff: {failure}");
        }
    }
}

/// One file; a scene of elasticity by a method. With the exit code of recording it.
fn of_one(
    arguments: &Verify,
    name: &str,
    method: &Method,
    to: &Output,
) -> Result<(FaceOffOutcome, u8)> {
    let running = &arguments.running;
    let is_given = [
        ("--explain", arguments.explain),
        ("--ranks", running.ranks != 1),
        ("--launcher", running.launcher.is_some()),
        ("--install", running.install),
    ];
    let refuse = |option: &str| {
        let what = format!("{option} is for scenes, and {name} is a face-off file");
        Error::usage(what, "leave it out: the file says which codes there are")
    };
    if let Some((option, _)) = is_given.iter().find(|(_, given)| *given) {
        return Err(refuse(option));
    }
    distinct(&arguments.n, "n", "give different refinements")?;
    let mut of = FaceOff::read_by(name.as_ref(), method, &arguments.engines)?;
    let mut missing = Vec::new();
    if arguments.allow_missing && of.form.is_none() {
        return Err(refuse("--allow-missing"));
    }
    // Of the codes for scenes of elasticity, FreeFEM lacks what some scenes in space need: who names it gets an error.
    let is_chosen_here = arguments.engines.is_empty() && is_elastic(name.as_ref());
    if arguments.allow_missing || is_chosen_here {
        let asked =
            |name: &String| arguments.engines.is_empty() || arguments.engines.contains(name);
        let found = of.without_missing(!arguments.allow_missing).into_iter();
        missing.extend(found.filter(|(code, _)| asked(code)).map(|(code, why)| {
            let message = format!("{code} is missing and was left out: {why}");
            note!("faceoff: {message}");
            Failure {
                engine: code,
                message,
            }
        }));
    }
    if !arguments.set.is_empty() {
        let point: Point = arguments.set.iter().cloned().collect();
        if point.len() < arguments.set.len() {
            return Err(Error::usage(
                "--set names a parameter twice",
                "name it once",
            ));
        }
        of = of.at(&point)?;
    }
    if !arguments.n.is_empty() {
        of = of.with_n(arguments.n.iter().map(|&n| n as usize).collect())?;
    }
    let is_live = |code: &&Code| {
        arguments.engines.is_empty() || arguments.engines.iter().any(|name| name == code.name())
    };
    let programs = of.codes.iter().filter(is_live).filter_map(Code::program);
    may_start("verify", name.as_ref(), arguments.run, programs)?;
    let record = arguments.against.as_deref().map(Record::read).transpose()?;
    let sweep = of.sweep.take();
    let kept = [
        ("--record", arguments.record.is_some()),
        ("--against", record.is_some()),
    ];
    if let (Some(sweep), Some((option, _))) = (&sweep, kept.iter().find(|(_, is)| *is)) {
        let what = format!(
            "{option} is of one point, and {name} has a sweep over {}",
            sweep.names.join(", ")
        );
        return Err(Error::usage(
            what,
            "fix each of them by --set NAME=VALUE, or by --n",
        ));
    }
    if let Some(folder) = &arguments.record {
        report::check_baseline_folder(folder)?;
    }
    // The record is the kept answers.
    let is_kept = arguments.resume.is_some() || arguments.record.is_some();
    let open = || Store::open(arguments.resume.as_deref(), &of.name);
    let store = is_kept.then(open).transpose()?;
    let is_missing = |name: &&String| missing.iter().any(|of| of.engine == **name);
    let codes = arguments.engines.iter().filter(|name| !is_missing(name));
    let how = face_off::Running {
        alone: false,
        codes: codes.cloned().collect(),
        keep: running.keep.clone(),
        time_limit: Settings::default().time_limit,
        sandbox: Settings::default().sandbox,
        store: store.as_ref(),
        against: record.as_ref(),
        diagnose: arguments.diagnose,
        symmetries: match arguments.symmetries {
            true => Image::ALL.to_vec(),
            false => Vec::new(),
        },
    };
    let command = |point: &Point| typed_at(arguments, name, point);
    let mut told_cost = |cost: Cost| {
        if !to.quiet {
            note!("faceoff: {}", words_of(cost));
        }
    };
    let mut outcome = watched(&[], vec![], to.quiet, |progress| match &sweep {
        Some(sweep) => face_off::swept(&of, sweep, &how, progress, &mut told_cost, &command),
        None => face_off::face_off(&of, &how, progress),
    })?;
    outcome.missing = missing;
    let recorded = store.as_ref().map(|store| {
        recorded(arguments, outcome.verdict, |beside, recipe| {
            store.record(beside, recipe, &outcome.asked())
        })
    });
    let recorded = recorded.transpose()?.unwrap_or(DONE);
    Ok((outcome, recorded))
}

/// A message about the cost of a sweep.
fn words_of(cost: Cost) -> String {
    match cost.seconds {
        None => format!(
            "the sweep has {} points: {} runs of codes",
            cost.points, cost.runs
        ),
        Some(left) => format!("the rest of the sweep takes about {}", duration(left)),
    }
}

/// The command that runs one point of a sweep.
fn typed_at(arguments: &Verify, name: &str, point: &Point) -> String {
    let mut words = vec!["faceoff".to_owned(), "verify".into()];
    words.extend(arguments.run.then(|| "--run".into()));
    words.extend(arguments.allow_missing.then(|| "--allow-missing".into()));
    if !arguments.engines.is_empty() {
        words.extend(["--engines".into(), arguments.engines.join(",")]);
    }
    words.push(name.to_owned());
    let fixed = arguments.set.iter().map(|(name, value)| (name, value));
    let of_all = arguments
        .n
        .iter()
        .map(u32::to_string)
        .collect::<Vec<_>>()
        .join(",");
    let n = point
        .get("n")
        .cloned()
        .or(Some(of_all).filter(|n| !n.is_empty()));
    for (name, value) in fixed.chain(point).filter(|(name, _)| *name != "n") {
        words.extend(["--set".into(), format!("{name}={value}")]);
    }
    words.extend(n.into_iter().flat_map(|n| ["--n".to_owned(), n]));
    quoted(words)
}

/// Refuses a file that starts programs, unless the user allows it: its author would run commands with the user's rights.
///
/// # Errors
/// A file with programs, by their names.
pub(super) fn may_start<'a>(
    command: &str,
    file: &Path,
    is_allowed: bool,
    programs: impl Iterator<Item = &'a str>,
) -> Result<()> {
    let programs = engine::unique(programs);
    if is_allowed || programs.is_empty() {
        return Ok(());
    }
    let file = file.display();
    let what = format!("{file} starts programs: {}", programs.join(", "));
    let remedy =
        format!("if you trust it: faceoff {command} --run {file}; if not, add --sandbox as well");
    Err(Error::usage(what, remedy))
}

/// Writes the record that `make` makes, with the command that makes it again, if all agree: it contains the answers on which all codes agree. The
/// exit code is only about that.
fn recorded(
    arguments: &Verify,
    verdict: Verdict,
    make: impl FnOnce(&Path, &str) -> Result<Record>,
) -> Result<u8> {
    let Some(folder) = &arguments.record else {
        return Ok(DONE);
    };
    if verdict.passes() {
        let recipe = format!("faceoff {}", typed());
        report::write_record(folder, |beside| make(beside, &recipe))?;
        return Ok(DONE);
    }
    note!("faceoff: nothing was recorded, as the codes do not agree; settle the difference first");
    Ok(FAILED)
}

/// Installed engines, and missing ones.
type Present = (Vec<Box<dyn Engine>>, Vec<Failure>);

/// The requested engines, and those left out. Missing ones are installed, left out or refused, according to the options.
fn present(arguments: &Verify) -> Result<Present> {
    let mut names: Vec<&str> = arguments.engines.iter().map(String::as_str).collect();
    if names.is_empty() {
        let all = match arguments.against {
            Some(_) => &engine::NAMES[..1],
            None => &engine::NAMES,
        };
        names.extend(all);
    }
    if arguments.running.install {
        engines::install(&names, arguments.output.quiet)?;
    }
    let (mut present, mut missing) = (Vec::new(), Vec::new());
    for name in names {
        let engine = engine::find(name)?;
        if engine.is_installed() {
            present.push(engine);
        } else if arguments.allow_missing {
            note!("faceoff: engine {name} is missing and left out");
            missing.push(Failure {
                engine: name.to_owned(),
                message: format!("engine {name} is missing and was left out"),
            });
        } else {
            // The probe's error names what is missing and the command that installs it.
            engine.probe()?;
            present.push(engine);
        }
    }
    Ok((present, missing))
}

/// The settings of the engines: Newton's method, and the automatic linear solver.
pub(super) fn settings(running: &Running) -> Settings {
    Settings {
        stop: Stop {
            increment: running.tolerance,
            max_iterations: running.max_iterations as usize,
        },
        launch: match (&running.launcher, running.ranks) {
            (Some(words), _) => Launch::By(words.0.clone()),
            (None, 1) => Launch::Alone,
            (None, ranks) => Launch::Ranks(ranks as usize),
        },
        keep: running.keep.clone(),
        ..Settings::default()
    }
}

/// Refuses several processes if no engine can be distributed.
pub(super) fn check_launch(settings: &Settings, engines: &[&dyn Engine]) -> Result<()> {
    if settings.launch == Launch::Alone || engines.iter().any(|e| e.distributes()) {
        return Ok(());
    }
    Err(Error::usage(
        "no engine here runs as several processes",
        "use --ranks and --launcher with the engine fenicsx",
    ))
}

/// The name of each case and its share of the work, in the order in which engines get them.
fn work(request: &VerifyRequest) -> Vec<(String, u64)> {
    let mut cases = Vec::new();
    for scene in &request.scenes {
        for n in request.levels(scene) {
            let n = n.unwrap_or(16);
            for method in &request.methods {
                let weight = (n * n * method.element.degree()).max(1) as u64;
                cases.push((format!("{} {method} n = {n}", scene.name()), weight));
            }
        }
    }
    cases
}
