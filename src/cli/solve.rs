//! `faceoff solve`.

use std::time::Instant;

use super::accuracy;
use super::args::Solve;
use super::progress::watched;
use super::verify::{check_launch, settings};
use super::{DISAGREE, DONE, FAILED, engines};
use crate::engine::{self, Case, Explanation};
use crate::report::console::note;
use crate::report::{self, Answer, Output, deliver};
use faceoff_fem::certify::certify;
use faceoff_fem::contact::{Discretisation, Iteration, Method, Problem};
use faceoff_fem::linear::Settings;
use faceoff_fem::scene::MeshSource;
use faceoff_mesh::error::{Error, Result};

pub(super) fn run(arguments: &Solve, to: &Output) -> Result<u8> {
    let quiet = to.quiet;
    let mut scene = arguments.trust.scene(&arguments.scene)?;
    let usual = if arguments.accuracy.is_some() {
        Method::cr_fc()
    } else {
        Method::cr()
    };
    let method = arguments.method.unwrap_or(usual);
    if let Some(path) = &arguments.mesh {
        scene = scene.with_source(MeshSource::File {
            path: path.to_owned(),
            n: None,
            dim: scene.source().dim(),
        })?;
    }
    let mut discretisation = Discretisation::of(&scene, method);
    if let Some(gamma0) = arguments.gamma0 {
        if !method.is_nitsche() {
            return Err(Error::usage(
                format!("gamma0 belongs to Nitsche's method, not to {}", method),
                "leave it out; penalty and multiplier take theirs as in \"penalty(0.01)\"",
            ));
        }
        if !(gamma0 > 0.0 && gamma0.is_finite()) {
            return Err(Error::usage(
                format!("gamma0 = {gamma0} is not positive"),
                "the method needs gamma0 > 0 (default: 100)",
            ));
        }
        discretisation.gamma0 = gamma0;
    }
    if arguments.iteration != Iteration::Newton && arguments.engine != engine::OWN {
        return Err(Error::usage(
            format!("engine {} iterates by Newton only", arguments.engine),
            "use --engine rust for the fixed points",
        ));
    }
    let linear = Settings {
        solver: arguments.linear,
        precision: arguments.precision,
    };
    if linear != Settings::default() && arguments.engine != engine::OWN {
        return Err(Error::usage(
            format!("engine {} has a linear solver of its own", arguments.engine),
            "use --linear and --precision with --engine rust only",
        ));
    }
    if arguments.running.install {
        engines::install(&[arguments.engine.as_str()], quiet)?;
    }
    let engine = engine::find(&arguments.engine)?;
    engine.accepts(&method)?;
    if !engine.is_installed() {
        engine.probe()?;
    }
    let settings = settings(&arguments.running, arguments.iteration, linear);
    check_launch(&settings, &[&*engine])?;
    if let Some(out) = &arguments.out {
        report::check_vtu_path(out)?;
    }

    if let Some(accuracy) = arguments.accuracy {
        return accuracy::run(arguments, to, &scene, discretisation, accuracy);
    }

    let clock = Instant::now();
    let n = arguments.n.map(|n| n as usize).or(scene.source().n());
    let mesh = scene.triangulation(n)?;
    let seconds_mesh = clock.elapsed().as_secs_f64();
    let assembly_clock = Instant::now();
    let problem = Problem::new(&scene, &mesh, &discretisation)?;
    let seconds_problem = assembly_clock.elapsed().as_secs_f64();
    let case = Case { n, problem };
    let name = format!("{} {}", scene.name(), method);
    let mut run = watched(&[engine.name()], vec![(name, 1)], quiet, |progress| {
        engine.run(&[&case], &settings, progress)
    })?;
    if let Some(doubt) = engine::doubt(engine.name(), &run.version) {
        note!("faceoff: warning: {doubt}");
    }
    let total = clock.elapsed().as_secs_f64();
    let Some(answer) = run.answers.pop() else {
        return Err(Error::engine(
            engine.name(),
            "it gave no answer",
            "report this",
        ));
    };

    let certificate = arguments
        .certify
        .map(|_| certify(&case.problem, &answer.u))
        .transpose()?;
    let seconds = (seconds_mesh, seconds_problem, total);
    let of = (engine.name(), run.version.as_str());
    let mut told = Answer::new(&case, settings.iteration, of, &answer, seconds)?;
    told.certificate = arguments
        .certify
        .zip(certificate.as_ref())
        .map(|(target, certificate)| report::Certified::new(target, certificate));
    if arguments.explain {
        let mut explanation = Explanation::new(&case, &answer);
        explanation.certificate = certificate.is_some();
        told.explanation = Some(explanation);
    }
    if let Some(out) = &arguments.out {
        let certificate = certificate.as_ref();
        report::write_solution(
            out,
            &case,
            &answer.u,
            engine.name(),
            &run.version,
            certificate,
        )?;
    }
    deliver(
        &report::solve(&told, &case, &answer.u, certificate.as_ref())?,
        to,
    )?;
    Ok(finish(arguments, &told))
}

/// The exit code of an answer; says what it lacks.
pub(super) fn finish(arguments: &Solve, told: &Answer) -> u8 {
    if !told.is_finite() {
        note!("faceoff: the result is not finite");
        return FAILED;
    }
    if !told.converged {
        note!("faceoff: {}", told.complaint(arguments.running.tolerance));
        return DISAGREE;
    }
    if !told.solves(arguments.running.tolerance) {
        note!("faceoff: {}", told.contradiction());
        return DISAGREE;
    }
    DONE
}
