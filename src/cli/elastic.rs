//! `faceoff solve`, `orders`, `study` and `stress` of scenes of elasticity, each of which is a weak form.

use super::args::{Orders, Solve, Stress, Study};
use super::progress::watched;
use super::verify::may_start;
use super::{DONE, code};
use crate::campaigns::face_off::{self, Cost, FaceOffOutcome, FaceOffs};
use crate::engine::{Settings, quoted};
use crate::report::console::note;
use crate::report::{self, Output, deliver};
use crate::run::{Code, FaceOff, Point, is_elastic};
use faceoff_fem::contact::{Iteration, Method};
use faceoff_fem::linear::{Precision, Solver};
use faceoff_mesh::error::{Error, Result, distinct, meant};

/// A family of extremes: a parameter and its values, in the order in which they are tried.
type Family = (&'static str, &'static [&'static str]);

/// What `stress` takes to extremes, by the names of parameters.
const EXTREMES: [Family; 2] = [
    ("E", &["1e-10", "1e-5", "1", "1e5", "1e12"]),
    ("nu", &["0", "0.3", "0.49", "0.4999", "0.499999"]),
];
/// Coefficients of friction.
const FRICTION: Family = ("friction", &["0", "0.1", "1", "10"]);
/// Heights of bodies whose other sides are 1.
const THIN: (&str, [f64; 3]) = ("thin", [0.5, 0.1, 0.02]);

/// What `study` measures.
const MEASURED: [Family; 2] = [
    ("gamma0", &["0.01", "0.1", "1", "10", "100", "10000"]),
    ("beta", &["0.1", "1", "10", "100", "1000"]),
];

/// Are these scenes of elasticity, all of them?
///
/// # Errors
/// Some are, and others not; one twice.
pub(super) fn are_elastic(names: &[String]) -> Result<bool> {
    let (elastic, others): (Vec<&String>, Vec<_>) =
        names.iter().partition(|name| is_elastic(name.as_ref()));
    if let (false, Some(other)) = (elastic.is_empty(), others.first()) {
        let what = format!("{other} is no scene of elasticity, and others here are");
        return Err(Error::usage(what, "give them apart"));
    }
    if !elastic.is_empty() {
        distinct(names, "scene", "give different scenes")?;
    }
    Ok(!elastic.is_empty())
}

/// A scene by a method in these codes; where there is one code, something must be known.
fn read(command: &str, name: &str, method: &Method, codes: &[String]) -> Result<FaceOff> {
    let of = FaceOff::read_by(name.as_ref(), method, codes)?;
    let programs = of.codes.iter().filter_map(Code::program);
    may_start(command, name.as_ref(), false, programs)?;
    let mut asked = of.fields.iter().chain(&of.numbers);
    if of.codes.len() < 2 && asked.all(|asked| asked.exact.is_empty()) {
        let what = format!("nothing is known of the solution of {name}");
        return Err(Error::usage(
            what,
            "give [exact] u, another scene, or two codes by --engines",
        ));
    }
    Ok(of)
}

/// Against what is known, and each code against the others.
fn running() -> face_off::Running<'static> {
    face_off::Running {
        codes: Vec::new(),
        keep: None,
        time_limit: Settings::default().time_limit,
        sandbox: Settings::default().sandbox,
        store: None,
        against: None,
        diagnose: false,
        symmetries: Vec::new(),
        alone: true,
    }
}

/// A scene by one method in one code.
pub(super) fn solve(arguments: &Solve, to: &Output) -> Result<u8> {
    let given = [
        ("--mesh", arguments.mesh.is_some()),
        ("--iteration", arguments.iteration != Iteration::Newton),
        ("--linear", arguments.linear != Solver::default()),
        ("--precision", arguments.precision != Precision::default()),
        ("--accuracy", arguments.accuracy.is_some()),
        ("--certify", arguments.certify.is_some()),
        ("--explain", arguments.explain),
        ("--ranks", arguments.running.ranks != 1),
        ("--launcher", arguments.running.launcher.is_some()),
        ("--install", arguments.running.install),
    ];
    refuse("solve", &given)?;
    if let Some(out) = &arguments.out {
        report::check_vtu_path(out)?;
    }
    let method = arguments.method.unwrap_or_else(Method::cr);
    let name = &arguments.scene;
    let mut of = FaceOff::read_by(
        name.as_ref(),
        &method,
        std::slice::from_ref(&arguments.engine),
    )?;
    let programs = of.codes.iter().filter_map(Code::program);
    may_start("solve", name.as_ref(), false, programs)?;
    let gamma0 = arguments
        .gamma0
        .map(|value| ("gamma0".to_owned(), format!("{value:?}")));
    let point: Point = arguments.set.iter().cloned().chain(gamma0).collect();
    if !point.is_empty() {
        of = of.at(&point)?;
    }
    if let Some(n) = arguments.n {
        of = of.with_n(vec![n as usize])?;
    }
    let how = face_off::Running {
        keep: arguments.running.keep.clone(),
        ..running()
    };
    let found = watched(&[], vec![], to.quiet, |progress| {
        face_off::solved(&of, &how, progress)
    })?;
    if let Some(out) = &arguments.out {
        report::write_elastic(out, &found)?;
    }
    deliver(&report::solve_elastic(&found)?, to)?;
    Ok(DONE)
}

/// Errors and orders by our own solver.
pub(super) fn orders(arguments: &Orders, names: &[String], to: &Output) -> Result<u8> {
    let point: Point = arguments.set.iter().cloned().collect();
    let n: Vec<usize> = arguments.n.iter().map(|&n| n as usize).collect();
    distinct(&n, "n", "give different refinements")?;
    let mut outcomes = Vec::new();
    for name in names {
        for method in &arguments.methods.0 {
            let of = FaceOff::read_by(name.as_ref(), method, &["rust".to_owned()])?;
            if of.fields.iter().all(|asked| asked.exact.is_empty()) {
                let what = format!("nothing is known of the solution of {name}");
                return Err(Error::usage(what, "give [exact] u, or another scene"));
            }
            let of = match point.is_empty() {
                true => of,
                false => of.at(&point)?,
            };
            let mut of = of.with_n(n.clone())?;
            // Of one code they are nothing to compare.
            of.numbers.clear();
            outcomes.push(watched(&[], vec![], to.quiet, |progress| {
                face_off::face_off(&of, &running(), progress)
            })?);
        }
    }
    tell(outcomes, to)
}

fn tell(outcomes: Vec<FaceOffOutcome>, to: &Output) -> Result<u8> {
    let all = FaceOffs::new(outcomes);
    deliver(&report::face_offs(&all)?, to)?;
    for run in all.face_offs.iter().flat_map(|of| &of.runs) {
        if let Some(failure) = &run.failure {
            note!("faceoff: {failure}");
        }
    }
    Ok(code(all.verdict))
}

/// Each scene by each method along some families; of a family with several values, each in turn.
fn along(
    of: &FaceOff,
    name: &str,
    method: &Method,
    (parameter, values): (&str, &[&str]),
    to: &Output,
) -> Result<FaceOffOutcome> {
    let sweep = of.over(parameter, values)?;
    let codes: Vec<&str> = of.codes.iter().map(Code::name).collect();
    let command = |point: &Point| {
        let command = if codes.len() < 2 { "orders" } else { "verify" };
        let mut words = vec!["faceoff".to_owned(), command.into(), name.to_owned()];
        words.extend(["--methods".into(), method.to_string()]);
        if codes.len() > 1 {
            words.extend(["--engines".into(), codes.join(",")]);
        }
        for (name, value) in point {
            words.extend(match &**name {
                "n" => ["--n".to_owned(), value.clone()],
                _ => ["--set".to_owned(), format!("{name}={value}")],
            });
        }
        quoted(words)
    };
    let mut outcome = watched(&[], vec![], to.quiet, |progress| {
        let mut cost = |_: Cost| {};
        face_off::swept(of, &sweep, &running(), progress, &mut cost, &command)
    })?;
    outcome.name = format!("{} over {parameter}", outcome.name);
    Ok(outcome)
}

/// The effect of γ₀ and β on what is known of the solution.
pub(super) fn study(arguments: &Study, to: &Output) -> Result<u8> {
    let given = [
        ("--finest", arguments.finest.is_some()),
        ("--resume", arguments.resume.is_some()),
    ];
    refuse("study", &given)?;
    let mut outcomes = Vec::new();
    for name in &arguments.scenes {
        for method in methods(&arguments.methods.0)? {
            let of = read("study", name, method, &arguments.engines)?;
            for family in MEASURED {
                if of.parameters.contains_key(family.0) {
                    outcomes.push(along(&of, name, method, family, to)?);
                }
            }
        }
    }
    tell(outcomes, to)
}

/// Materials, friction and thin bodies at their extremes.
pub(super) fn stress(arguments: &Stress, to: &Output) -> Result<u8> {
    let names = || {
        EXTREMES
            .iter()
            .map(|(name, _)| *name)
            .chain([FRICTION.0, THIN.0])
    };
    if let Some(other) = arguments
        .families
        .iter()
        .find(|of| !names().any(|n| n == **of))
    {
        let what = format!("there is no family `{other}` of scenes of elasticity");
        let all = names().collect::<Vec<_>>().join(", ");
        return Err(Error::usage(
            what,
            format!("{}use {all}", meant(other, names())),
        ));
    }
    let is_asked = |family: &str| {
        arguments.families.is_empty() || arguments.families.iter().any(|of| of == family)
    };
    let mut outcomes = Vec::new();
    for name in &arguments.scenes {
        for method in methods(&arguments.methods.0)? {
            let of = read("stress", name, method, &arguments.engines)?;
            for family in EXTREMES.into_iter().filter(|(family, _)| is_asked(family)) {
                outcomes.push(along(&of, name, method, family, to)?);
            }
            let coefficient = of.friction().filter(|_| is_asked(FRICTION.0));
            if let Some(parameter) = coefficient {
                outcomes.push(along(&of, name, method, (&parameter, FRICTION.1), to)?);
            }
            if !(is_asked(THIN.0) && of.is_generated()) {
                continue;
            }
            for height in THIN.1 {
                let dim = of.form.as_ref().map_or(2, |form| form.dim);
                let size: Vec<f64> = (0..dim)
                    .map(|k| if k + 1 < dim { 1.0 } else { height })
                    .collect();
                let thin = of.sized(&size)?;
                let mut outcome = watched(&[], vec![], to.quiet, |progress| {
                    face_off::face_off(&thin, &running(), progress)
                })?;
                outcome.name = format!("{} of height {height}", outcome.name);
                outcomes.push(outcome);
            }
        }
    }
    if outcomes.is_empty() {
        let what = "none of these scenes has such a family";
        return Err(Error::usage(what, "leave --families out"));
    }
    tell(outcomes, to)
}

/// The methods among these that elasticity has; the others are for scenes of (1.1), whose commands name them all where none is named.
fn methods(all: &[Method]) -> Result<Vec<&Method>> {
    let found: Vec<&Method> = all
        .iter()
        .filter(|of| faceoff_form::elastic::has(of))
        .collect();
    match (&found[..], all) {
        ([], [first, ..]) => {
            let what = format!("{first} is no method for elasticity");
            Err(Error::usage(
                what,
                "take cr, p1, p2, or a member of the family (2.4)",
            ))
        }
        _ => Ok(found),
    }
}

/// Refuses options that are for scenes of (1.1).
fn refuse(command: &str, given: &[(&str, bool)]) -> Result<()> {
    match given.iter().find(|(_, is_given)| *is_given) {
        Some((option, _)) => {
            let what = format!("{command} {option} is not for scenes of elasticity");
            Err(Error::usage(what, "leave it out"))
        }
        None => Ok(()),
    }
}
