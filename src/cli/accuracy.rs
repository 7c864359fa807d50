//! `faceoff solve --accuracy`.

use std::time::Instant;

use super::DISAGREE;
use super::args::Solve;
use super::solve::finish;
use super::verify::settings;
use crate::engine::{self, Case, Explanation};
use crate::report::console::note;
use crate::report::model::percent;
use crate::report::{self, Answer, Certified, Output, deliver};
use faceoff_fem::adapt::{Next, Outcome, Step, Way, Wish, reach};
use faceoff_fem::certify::Target;
use faceoff_fem::contact::{Discretisation, Problem};
use faceoff_fem::linear::Settings;
use faceoff_fem::scene::Scene;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;

/// Refines until the bound is below the accuracy, telling each mesh and what is to come.
pub(super) fn run(
    arguments: &Solve,
    to: &Output,
    scene: &Scene,
    discretisation: Discretisation,
    accuracy: f64,
) -> Result<u8> {
    let linear = Settings {
        solver: arguments.linear,
        precision: arguments.precision,
    };
    let settings = settings(&arguments.running, arguments.iteration, linear);
    let target = arguments.certify.unwrap_or(Target::G);
    let wish = Wish {
        discretisation,
        target,
        accuracy,
        stop: settings.stop,
        linear,
        way: arguments.way,
    };
    let clock = Instant::now();
    let quiet = to.quiet;
    let reached = reach(scene, &wish, |step, next| {
        if !quiet {
            note!("{}", line(step, next));
        }
        cancel::check()
    })?;
    let total = clock.elapsed().as_secs_f64();
    let case = Case {
        n: reached.n,
        problem: Problem::new(scene, &reached.mesh, &wish.discretisation)?,
    };
    let answer = engine::Answer::new(reached.solution);
    let version = env!("CARGO_PKG_VERSION");
    let own = (engine::OWN, version);
    let mut told = Answer::new(&case, arguments.iteration, own, &answer, (0.0, 0.0, total))?;
    told.certificate = Some(Certified::new(target, &reached.certificate));
    told.meshes = Some(reached.steps);
    if arguments.explain {
        let mut explanation = Explanation::new(&case, &answer);
        explanation.certificate = true;
        told.explanation = Some(explanation);
    }
    if let Some(out) = &arguments.out {
        let certificate = Some(&reached.certificate);
        report::write_solution(out, &case, &answer.u, engine::OWN, version, certificate)?;
    }
    deliver(
        &report::solve(&told, &case, &answer.u, Some(&reached.certificate))?,
        to,
    )?;
    let code = finish(arguments, &told);
    if let Outcome::NotReached(why) = reached.outcome {
        note!(
            "faceoff: the accuracy {accuracy:e} was not reached, and this is the best that was certified: {why}"
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
        percent(step.relative),
        step.seconds
    );
    if let Some(next) = next {
        let way = match next.way {
            Way::Uniform => "uniform",
            Way::Adaptive => "adaptive",
        };
        line += &format!(
            "; about {:.0} cells to come, {way}, {:.1} s",
            next.cells, next.seconds
        );
    }
    line
}
