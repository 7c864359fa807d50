//! `faceoff solve`, by itself and until an accuracy.

use std::time::Instant;

use super::args::Solve;
use super::progress::watched;
use super::verify::{check_launch, settings};
use super::{DISAGREE, DONE, FAILED, elastic, engines};
use crate::engine::{self, Case, Explanation};
use crate::report::console::note;
use crate::report::percent_above;
use crate::report::{self, Answer, Certified, Output, deliver};
use crate::run::{consistent, is_elastic};
use faceoff_fem::adapt::{Next, Outcome, Step, Way, Wish, reach};
use faceoff_fem::certify::{Certificate, Target, examine};
use faceoff_fem::contact::{Discretisation, Iteration, Method, Problem};
use faceoff_fem::linear::Settings;
use faceoff_fem::scene::{MeshSource, Scene};
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};

/// A γ₀ that is given instead of the scene's.
pub(super) fn gamma0(method: &Method, gamma0: f64) -> Result<f64> {
    if !method.is_nitsche() {
        return Err(Error::usage(
            format!("gamma0 belongs to Nitsche's method, not to {method}"),
            "leave it out; penalty and multiplier take theirs as in \"penalty(0.01)\"",
        ));
    }
    if !(gamma0 > 0.0 && gamma0.is_finite()) {
        return Err(Error::usage(
            format!("gamma0 = {gamma0} is not positive"),
            "the method needs gamma0 > 0 (default: 100)",
        ));
    }
    Ok(gamma0)
}

pub(super) fn run(arguments: &Solve, to: &Output) -> Result<u8> {
    if is_elastic(arguments.scene.as_ref()) {
        return elastic::solve(arguments, to);
    }
    if let Some((name, _)) = arguments.set.first() {
        let what = format!(
            "--set is for parameters of scenes of elasticity, and {} has none",
            arguments.scene
        );
        return Err(Error::usage(what, format!("leave --set {name}=… out")));
    }
    let quiet = to.quiet;
    let mut scene = arguments.trust.scene(&arguments.scene)?;
    let usual = match arguments.accuracy {
        Some(_) => Method::cr_fc(),
        None => Method::cr(),
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
        discretisation.gamma0 = self::gamma0(&method, gamma0)?;
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
            format!("engine {} uses its own linear solver", arguments.engine),
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
    let settings = engine::Settings {
        iteration: arguments.iteration,
        linear,
        ..settings(&arguments.running)
    };
    check_launch(&settings, &[&*engine])?;
    if let Some(out) = &arguments.out {
        report::check_vtu_path(out)?;
    }

    if let Some(accuracy) = arguments.accuracy {
        let wish = Wish {
            discretisation,
            target: accuracy.target.or(arguments.certify).unwrap_or(Target::G),
            accuracy: accuracy.tolerance,
            stop: settings.stop,
            linear,
            way: arguments.way,
        };
        return refine(arguments, to, &scene, &wish);
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
    let lost = || Error::engine(engine.name(), "it gave no answer", "report this");
    let answer = run.answers.pop().ok_or_else(lost)?;
    let certificate = arguments.certify;
    let certificate = certificate.map(|_| examine(&case.problem, &answer.u));
    let certificate = certificate.transpose()?;
    let seconds = (seconds_mesh, seconds_problem, total);
    let of = (engine.name(), run.version.as_str());
    let told = Answer::new(&case, settings.iteration, of, &answer, seconds)?;
    finish(arguments, to, &case, (&answer, of), told, certificate)
}

/// Refines until the bound is below the accuracy, reporting each mesh and the next one.
fn refine(arguments: &Solve, to: &Output, scene: &Scene, wish: &Wish) -> Result<u8> {
    let clock = Instant::now();
    let reached = reach(scene, wish, |step, next| {
        if !to.quiet {
            note!("{}", line(step, next));
        }
        // From the first mesh on there is a result, which is worth waiting for.
        cancel::hear();
        Ok(())
    })?;
    let total = clock.elapsed().as_secs_f64();
    let case = Case {
        n: reached.n,
        problem: Problem::new(scene, &reached.mesh, &wish.discretisation)?,
    };
    let answer = engine::Answer::new(reached.solution);
    let own = (engine::OWN, env!("CARGO_PKG_VERSION"));
    let mut told = Answer::new(&case, arguments.iteration, own, &answer, (0.0, 0.0, total))?;
    told.meshes = Some(reached.steps);
    let certificate = Some(reached.certificate);
    let code = finish(arguments, to, &case, (&answer, own), told, certificate)?;
    if let Outcome::NotReached(why) = reached.outcome {
        note!(
            "faceoff: the accuracy {:e} was not reached, and this is the best that was certified: {why}",
            wish.accuracy
        );
        return Ok(code.max(DISAGREE));
    }
    Ok(code)
}

fn line(step: &Step, next: Option<&Next>) -> String {
    let mesh = match (step.way, step.n) {
        (Way::Uniform, Some(n)) => format!("n = {n}"),
        (Way::Uniform, None) => "the mesh itself".into(),
        (Way::Adaptive, _) => "adapted".into(),
    };
    let mut line = format!(
        "{mesh}: {} cells, certified to {}, {:.2} s",
        step.cells,
        percent_above(step.relative),
        step.seconds
    );
    if let Some(next) = next {
        let way = match next.way {
            Way::Uniform => "uniform",
            Way::Adaptive => "adaptive",
        };
        line += &format!(
            "; next about {:.0} cells, {way}, {:.1} s",
            next.cells, next.seconds
        );
    }
    line
}

/// Writes and delivers an answer of a code and its version; returns the exit code, and what the answer lacks.
fn finish(
    arguments: &Solve,
    to: &Output,
    case: &Case,
    (answer, (engine, version)): (&engine::Answer, (&str, &str)),
    mut told: Answer,
    certificate: Option<Certificate>,
) -> Result<u8> {
    let certificate = certificate.as_ref();
    let wished = arguments.accuracy.and_then(|accuracy| accuracy.target);
    let target = wished.or(arguments.certify).unwrap_or(Target::G);
    if let Some(certificate) = certificate {
        consistent(told.error.map(|error| error.h1), certificate)?;
    }
    told.certificate = certificate.map(|c| Certified::new(target, c));
    if arguments.explain {
        let mut explanation = Explanation::new(case, answer);
        explanation.certificate = certificate.is_some();
        told.explanation = Some(explanation);
    }
    if let Some(out) = &arguments.out {
        report::write_solution(out, case, &answer.u, engine, version, certificate)?;
    }
    deliver(&report::solve(&told, case, &answer.u, certificate)?, to)?;
    if let Some(why) = told.doubt(case.problem.space.mesh) {
        note!("faceoff: warning: {why}");
    }
    if let Some(why) = report::no_trace(&case.problem) {
        note!("faceoff: warning: {why}");
    }
    if !told.is_finite() {
        note!("faceoff: the result is not finite");
        return Ok(FAILED);
    }
    if !told.converged {
        note!("faceoff: {}", told.complaint(arguments.running.tolerance));
        return Ok(DISAGREE);
    }
    if !told.solves(arguments.running.tolerance) {
        note!("faceoff: {}", told.contradiction());
        return Ok(DISAGREE);
    }
    Ok(DONE)
}
