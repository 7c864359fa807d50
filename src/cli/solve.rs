//! `faceoff solve`.

use std::time::Instant;

use serde::Serialize;

use super::args::Solve;
use super::progress::Bars;
use super::verify::settings;
use super::{DISAGREE, DONE, FAILED, engines};
use crate::contact::{ContactSet, Ended, Errors, Iteration, Problem, errors, quantities};
use crate::engine::{self, Case, Progress, Silent};
use crate::error::{Error, Result};
use crate::linear::{Choice, Settings};
use crate::report;
use crate::scene::Scene;

/// The answer, as scripts read it.
#[derive(Serialize)]
struct Answer {
    scene: String,
    method: String,
    engine: String,
    version: String,
    n: Option<usize>,
    faces: usize,
    cells: usize,
    dofs: usize,
    gamma0: f64,
    iteration: String,
    iterations: usize,
    increments: Vec<f64>,
    /// Contact conditions that changed their status after each step; where the engine tells.
    #[serde(skip_serializing_if = "Option::is_none")]
    active_set_changes: Option<Vec<usize>>,
    /// The scheme's residual after each step, relative to its largest terms.
    #[serde(skip_serializing_if = "Option::is_none")]
    residuals: Option<Vec<f64>>,
    converged: bool,
    /// increment, rounding or not-reached
    #[serde(skip_serializing_if = "Option::is_none")]
    ended: Option<Ended>,
    /// The step that the answer comes from.
    step: usize,
    /// Backward error of the scheme.
    residual: f64,
    grad_norm_sq: f64,
    l2_norm: f64,
    contact_flux: f64,
    contact_residual: f64,
    contact_set: ContactSet,
    /// Where the scene knows u.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<Errors>,
    /// What solved the linear systems, and what it was predicted to take; of the Rust engine.
    #[serde(skip_serializing_if = "Option::is_none")]
    linear: Option<Choice>,
    seconds: Seconds,
    peak_rss_mb: f64,
}

/// Wall-clock seconds; null where an engine does not tell.
#[derive(Serialize)]
struct Seconds {
    mesh: f64,
    assembly: Option<f64>,
    factor: Option<f64>,
    iterate: Option<f64>,
    /// From u on the contact cells to u everywhere.
    expand: Option<f64>,
    total: f64,
}

pub(super) fn run(arguments: &Solve) -> Result<u8> {
    let quiet = arguments.output.quiet;
    let mut scene = Scene::find(&arguments.scene)?;
    if let Some(path) = &arguments.mesh {
        scene.use_mesh(path);
    }
    if let Some(gamma0) = arguments.gamma0 {
        if !arguments.method.is_nitsche() {
            return Err(Error::usage(
                format!(
                    "gamma0 belongs to Nitsche's method, not to {}",
                    arguments.method
                ),
                "leave it away; penalty and multiplier take theirs as in \"penalty(0.01)\"",
            ));
        }
        if !(gamma0 > 0.0 && gamma0.is_finite()) {
            return Err(Error::usage(
                format!("gamma0 = {gamma0} is not positive"),
                "the method needs gamma0 > 0 (default: 100)",
            ));
        }
        scene.gamma0 = gamma0;
    }
    if arguments.iteration != Iteration::Newton && arguments.engine != "rust" {
        return Err(Error::usage(
            format!("engine {} iterates by Newton only", arguments.engine),
            "use --engine rust for the fixed points",
        ));
    }
    let linear = Settings {
        solver: arguments.linear,
        precision: arguments.precision,
    };
    if linear != Settings::default() && arguments.engine != "rust" {
        return Err(Error::usage(
            format!("engine {} has a linear solver of its own", arguments.engine),
            "use --linear and --precision with --engine rust only",
        ));
    }
    if arguments.running.install {
        engines::install(&[arguments.engine.as_str()], quiet)?;
    }
    let engine = engine::find(&arguments.engine)?;
    engine.accepts(&arguments.method)?;
    if !engine.is_installed() {
        engine.probe()?;
    }
    if let Some(out) = &arguments.out {
        report::check_vtu_path(out)?;
    }

    let clock = Instant::now();
    let n = arguments.n.map(|n| n as usize).or(scene.mesh.n());
    let mesh = scene.triangulation(n)?;
    let seconds_mesh = clock.elapsed().as_secs_f64();
    let assembly_clock = Instant::now();
    let problem = Problem::new(&scene, &mesh, arguments.method)?;
    let seconds_problem = assembly_clock.elapsed().as_secs_f64();
    let case = Case {
        scene: &scene,
        n,
        problem,
    };
    let name = format!("{} {}", scene.name, arguments.method);
    let bars = Bars::new(&[engine.name()], vec![(name, 1)], quiet);
    let listener: &dyn Progress = bars.as_ref().map_or(&Silent, |bars| bars);
    let settings = settings(&arguments.running, arguments.iteration, linear);
    let run = engine.run(std::slice::from_ref(&case), &settings, listener);
    if let Some(bars) = &bars {
        bars.clear();
    }
    let mut run = run?;
    let total = clock.elapsed().as_secs_f64();
    let Some(answer) = run.answers.pop() else {
        return Err(Error::engine(
            engine.name(),
            "it gave no answer",
            "report this",
        ));
    };

    let own = engine.name() == "rust";
    let phase = |name: &str| answer.seconds.iter().find(|(n, _)| n == name).map(|p| p.1);
    let values = quantities(&case.problem, &answer.u);
    let finite = values.grad_norm_sq.is_finite();
    let exact = scene.exact.as_ref().filter(|_| finite);
    let error = exact
        .map(|exact| errors(&case.problem.space, &answer.u, exact))
        .transpose()?;
    let told = Answer {
        scene: scene.name.clone(),
        method: arguments.method.to_string(),
        engine: engine.name().to_owned(),
        version: run.version,
        n,
        faces: mesh.face_count(),
        cells: mesh.cell_count(),
        dofs: case.problem.space.dofs,
        gamma0: arguments.method.gamma0(scene.gamma0),
        iteration: settings.iteration.to_string(),
        iterations: answer.increments.len(),
        increments: answer.increments.clone(),
        active_set_changes: answer.history.as_ref().map(|h| h.changes.clone()),
        residuals: answer.history.as_ref().map(|h| h.residuals.clone()),
        converged: answer.converged,
        ended: answer.history.as_ref().map(|h| h.ended),
        step: answer.step,
        linear: answer.history.as_ref().map(|h| h.linear),
        residual: answer.residual,
        grad_norm_sq: values.grad_norm_sq,
        l2_norm: values.l2_norm,
        contact_flux: values.contact_flux,
        contact_residual: values.contact_residual,
        contact_set: values.contact_set,
        error,
        seconds: Seconds {
            mesh: seconds_mesh
                + if own {
                    0.0
                } else {
                    phase("read").unwrap_or(0.0) + phase("mesh").unwrap_or(0.0)
                },
            assembly: if own {
                Some(seconds_problem)
            } else {
                phase("assemble").map(|s| s + phase("space").unwrap_or(0.0))
            },
            factor: phase("factor"),
            iterate: phase("iterate").or(phase("solve")),
            expand: phase("expand"),
            total,
        },
        peak_rss_mb: engine::peak_memory_mb(!own),
    };
    if let Some(out) = &arguments.out {
        report::write_solution(out, &case, &answer.u, engine.name(), &told.version)?;
    }
    report::write_json(arguments.output.json.as_deref(), &told)?;
    if !quiet && !report::is_stdout(arguments.output.json.as_deref()) {
        print_answer(&told);
    }
    if !finite {
        eprintln!("faceoff: the result is not finite");
        return Ok(FAILED);
    }
    if !told.converged {
        let which = match &told.residuals {
            Some(_) => format!("the best iterate by residual, that of step {}", told.step),
            None => "its last iterate".to_owned(),
        };
        eprintln!(
            "faceoff: {} did not reach the tolerance {:e} in {} iterations; this is {which}, not a solution",
            told.engine, settings.stop.increment, told.iterations
        );
        return Ok(DISAGREE);
    }
    Ok(DONE)
}

fn print_answer(a: &Answer) {
    let n = a.n.map_or(String::new(), |n| format!(", n = {n}"));
    println!(
        "{} by {} {} ({}){n}",
        a.scene, a.engine, a.version, a.method
    );
    println!("  cells {}, faces {}, dofs {}", a.cells, a.faces, a.dofs);
    let rounding = match a.ended {
        Some(Ended::Rounding) => ", to rounding: no smaller increments are to be had",
        _ => "",
    };
    println!(
        "  {} iterations, backward error {:.1e}{rounding}",
        a.iterations, a.residual
    );
    println!("  ‖∇u‖²           {:.15e}", a.grad_norm_sq);
    println!("  ‖u‖             {:.15e}", a.l2_norm);
    println!("  flux on Γ_C     {:.15e}", a.contact_flux);
    println!("  ‖u-ψ+[P]₊‖_C    {:.15e}", a.contact_residual);
    println!("  contact on      {}", contact(&a.contact_set));
    if let Some(Errors { h1, l2 }) = a.error {
        println!("  relative error  {h1:.3e} in ∇u, {l2:.3e} in u");
    }
    println!("  {:.3} s, {:.0} MB", a.seconds.total, a.peak_rss_mb);
}

fn contact(set: &ContactSet) -> String {
    match set {
        ContactSet::Zones(zones) if !zones.faces.is_empty() => format!(
            "an area of {:.6} in {} zones on {} faces",
            zones.area,
            zones.zones,
            zones.faces.len()
        ),
        ContactSet::Runs(runs) if !runs.is_empty() => {
            let run = |[from, to]: &[f64; 2]| format!("[{from:.6}, {to:.6}]");
            runs.iter().map(run).collect::<Vec<_>>().join(" ")
        }
        _ => "nothing".into(),
    }
}
