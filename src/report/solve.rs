//! The report of `solve`.

use serde::Serialize;

use super::certified::{Certified, percent_above};
use super::html;
use super::model::{Block, Cell, Report, Story, Todo, count, joined, short, table};
use crate::engine::{self, Case, Explanation};
use crate::run::RESIDUAL_TOLERANCE;
use crate::text::number::{number, place, size, trimmed, whole};
use crate::text::{Text, at_least, at_most, text};
use faceoff_fem::adapt::{Step, Way};
use faceoff_fem::certify::Certificate;
use faceoff_fem::contact::{
    ContactSet, Doubt, Ended, Errors, Iteration, Problem, doubt, load_has_no_trace, quantities,
};
use faceoff_fem::known::Truth;
use faceoff_fem::linear::Choice;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Triangulation;

/// The answer, for scripts.
#[derive(Serialize)]
pub struct Answer {
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
    /// Newton's steps at other γ before the last of these, if this γ was reached by continuation.
    #[serde(skip_serializing_if = "Option::is_none")]
    continuation: Option<usize>,
    increments: Vec<f64>,
    /// The number of contact conditions that changed their status in each step; `None` if the engine does not report it.
    #[serde(skip_serializing_if = "Option::is_none")]
    active_set_changes: Option<Vec<usize>>,
    /// The scheme's residual after each step, relative to its largest terms.
    #[serde(skip_serializing_if = "Option::is_none")]
    residuals: Option<Vec<f64>>,
    /// Did the iteration reach its tolerance?
    pub converged: bool,
    /// increment, rounding, not-reached or undetermined
    #[serde(skip_serializing_if = "Option::is_none")]
    ended: Option<Ended>,
    /// The step that the answer comes from.
    step: usize,
    /// Backward error in the scheme.
    residual: f64,
    /// The condition for uniqueness of the solution that is not shown to hold; `None` if uniqueness is shown.
    #[serde(skip_serializing_if = "Option::is_none")]
    uniqueness: Option<Doubt>,
    grad_norm_sq: f64,
    l2_norm: f64,
    contact_flux: f64,
    contact_residual: f64,
    contact_set: ContactSet,
    /// If u is known for the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<Errors>,
    /// Is it known but too expensive here?
    #[serde(skip)]
    is_error_left_out: bool,
    /// Bounds of its error, if they are known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certificate: Option<Certified>,
    /// How it was solved, if that was requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub explanation: Option<Explanation>,
    /// The adaptive meshes up to an accuracy, and why they ended.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meshes: Option<Vec<Step>>,
    /// The solver of the linear systems, and its predicted cost; for the Rust engine.
    #[serde(skip_serializing_if = "Option::is_none")]
    linear: Option<Choice>,
    seconds: Seconds,
    peak_rss_mb: f64,
}

/// Wall-clock seconds; null if an engine does not report them.
#[derive(Serialize)]
pub struct Seconds {
    pub mesh: f64,
    pub assembly: Option<f64>,
    pub factor: Option<f64>,
    pub iterate: Option<f64>,
    /// From u on the contact cells to u everywhere.
    pub expand: Option<f64>,
    pub total: f64,
}

/// Errors with respect to the mesh-free solution take far longer than solving; `orders` computes them on finer meshes.
const MOST_CELLS: usize = 150_000;

impl Answer {
    /// The answer of an engine to a case, with the seconds for its mesh and its assembly.
    ///
    /// # Errors
    /// An exact solution that is not finite, or not known on this mesh.
    pub fn new(
        case: &Case,
        iteration: Iteration,
        (engine, version): (&str, &str),
        answer: &engine::Answer,
        (mesh, assembly, total): (f64, f64, f64),
    ) -> Result<Self> {
        let (space, method) = (&case.problem.space, case.problem.method());
        let own = engine == engine::OWN;
        let phase = |name: &str| answer.seconds.iter().find(|(n, _)| n == name).map(|p| p.1);
        let values = quantities(&case.problem, &answer.u);
        let truth = Truth::of(case.scene())?;
        let is_costly = |truth: &Truth| {
            matches!(truth, Truth::MeshFree(_)) && space.mesh.cell_count() > MOST_CELLS
        };
        let is_error_left_out = truth.as_ref().is_some_and(is_costly);
        let error = truth
            .filter(|truth| !is_costly(truth))
            .filter(|_| values.grad_norm_sq.is_finite())
            .map(|truth| truth.errors(&case.problem, &answer.u))
            .transpose()?;
        let history = answer.history.as_ref();
        Ok(Answer {
            scene: case.scene().name().to_owned(),
            method: method.to_string(),
            engine: engine.to_owned(),
            version: version.to_owned(),
            n: case.n,
            faces: space.mesh.face_count(),
            cells: space.mesh.cell_count(),
            dofs: space.dofs,
            gamma0: case.problem.discretisation.gamma0(),
            iteration: iteration.to_string(),
            iterations: answer.increments.len(),
            continuation: history.map(|h| h.on_the_way).filter(|steps| *steps > 0),
            increments: answer.increments.clone(),
            active_set_changes: history.map(|h| h.changes.clone()),
            residuals: history.map(|h| h.residuals.clone()),
            converged: answer.converged,
            ended: history.map(|h| h.ended),
            step: answer.step,
            linear: history.map(|h| h.linear),
            residual: answer.residual,
            uniqueness: doubt(&case.problem),
            grad_norm_sq: values.grad_norm_sq,
            l2_norm: values.l2_norm,
            contact_flux: values.contact_flux,
            contact_residual: values.contact_residual,
            contact_set: values.contact_set,
            error,
            is_error_left_out,
            certificate: None,
            explanation: None,
            meshes: None,
            seconds: Seconds {
                mesh: mesh + phase("read").unwrap_or(0.0) + phase("mesh").unwrap_or(0.0),
                assembly: match own {
                    true => Some(assembly),
                    false => phase("assemble").map(|s| s + phase("space").unwrap_or(0.0)),
                },
                factor: phase("factor"),
                iterate: phase("iterate").or(phase("solve")),
                expand: phase("expand"),
                total,
            },
            peak_rss_mb: engine::peak_memory_mb(!own),
        })
    }

    /// Is it a valid answer?
    pub fn is_finite(&self) -> bool {
        self.grad_norm_sq.is_finite()
    }

    /// Why there may be other solutions of the same scheme.
    pub fn doubt(&self, mesh: &Triangulation) -> Option<Text> {
        let on = |face: usize| {
            let at = place(&mesh.face_midpoint(face)[..mesh.dim]);
            text!("face {} at {at}", format!("{:?}", mesh.face(face)))
        };
        let why = match self.uniqueness? {
            Doubt::GammaTooSmall { face, factor, .. } => text!(
                "on this mesh Proposition 4.2 holds for gamma0 above {}, and it is {} (first on {}): raise gamma0, or take \
                 `midpoint` for the rule on the contact side, which has one for every gamma0",
                at_most(factor * self.gamma0, 3),
                short(self.gamma0),
                on(face)
            ),
            Doubt::GammaTooLarge { face, factor, .. } => text!(
                "on this mesh there is one for gamma0 below {}, and it is {} (first on {}): lower gamma0, or take theta1 = 1",
                at_least(factor * self.gamma0, 3),
                short(self.gamma0),
                on(face)
            ),
            Doubt::NoTheorem => text!("no condition is known for {self.method}"),
            Doubt::Floating => {
                "a part of the domain is held by nothing, and its load is balanced".into()
            }
        };
        Some(text!("the scheme may have several solutions: {why}"))
    }

    /// Does the scheme's residual confirm the convergence that another code reports? A code whose factorisation failed may
    /// take the last step for zero.
    pub fn solves(&self, tolerance: f64) -> bool {
        self.residuals.is_some() || self.residual <= tolerance.max(RESIDUAL_TOLERANCE)
    }

    /// The fault of an answer that does not.
    pub fn contradiction(&self) -> String {
        format!(
            "{} says that it converged, but its answer leaves a backward error of {:.1e} in the scheme; this is no solution: \
             keep the job folder with --keep and look at log.txt, in which a lack of memory may show",
            self.engine, self.residual
        )
    }

    /// The fault of an answer that was not reached.
    pub fn complaint(&self, tolerance: f64) -> String {
        if self.ended == Some(Ended::Undetermined) {
            return format!(
                "{} solves the scheme up to a backward error of {}, but its matrix is singular to working precision, so that \
                 rounding decides what u is; this is no solution: use cells of less extreme shape, or a smaller gamma0",
                self.engine,
                short(self.residual)
            );
        }
        let which = match &self.residuals {
            Some(_) => format!("the best iterate by residual, that of step {}", self.step),
            None => "its last iterate".to_owned(),
        };
        format!(
            "{} did not reach the tolerance {tolerance:e} in {} iterations; this is {which}, not a solution",
            self.engine, self.iterations
        )
    }
}

/// The assumption of Theorem 5.1 on f, if it does not hold: only discontinuous elements need it.
pub fn no_trace(problem: &Problem) -> Option<Text> {
    (problem.space.element.on().faces && load_has_no_trace(problem)).then(|| text!("f grows without bound towards Γ_C, which (2.10) of the paper excludes: Theorem 5.1 does not bound the error here; take p1 or p2, which need no such f"))
}

/// The report of an answer: u of a case, with its certificate if there is one.
///
/// # Errors
/// Only those of a broken installation.
pub fn solve<'a>(
    a: &'a Answer,
    case: &'a Case,
    u: &'a [f64],
    certificate: Option<&'a Certificate>,
) -> Result<Report<'a>> {
    let rounding = match a.ended {
        Some(Ended::Rounding) => ", to rounding: no smaller increments are to be had",
        _ => "",
    };
    let reached = match a.converged {
        true => "reached",
        false => "not reached",
    };
    let on_the_way = a.continuation.map_or(String::new(), |steps| {
        format!(" and {} at other γ", count(steps, "step"))
    });
    let headline = format!(
        "{reached} in {}{on_the_way}, backward error {}{rounding}",
        count(a.iterations, "iteration"),
        short(a.residual)
    );
    let about = engine::case_label(case);
    let mut report = Report::new("solve", &format!("faceoff solve: {about}"), headline, a)?;
    report.engines.push((a.engine.clone(), a.version.clone()));
    let mesh = case.problem.space.mesh;
    report.digests.push(("the mesh".into(), mesh.digest()));
    let sizes = format!("{} cells, {} faces, {} dofs", a.cells, a.faces, a.dofs);
    let value = |value: f64| Text::from(number(value, 6));
    let mut facts: Vec<(Text, Text)> = vec![
        ("by".into(), format!("{} {}", a.engine, a.version).into()),
        ("mesh".into(), sizes.into()),
        ("‖∇u‖²".into(), value(a.grad_norm_sq)),
        ("‖u‖".into(), value(a.l2_norm)),
        (text!("flux on Γ_C"), value(a.contact_flux)),
        ("‖u-ψ+[P]₊‖_C".into(), value(a.contact_residual)),
        ("contact on".into(), contact(&a.contact_set).into()),
    ];
    let error = match (a.is_error_left_out, a.error) {
        (true, _) => Some(text!(
            "not computed on more than {} cells; `faceoff orders` does",
            MOST_CELLS
        )),
        (_, Some(Errors { h1, l2 })) => Some(text!("{} in ∇u, {} in u", short(h1), short(l2))),
        _ => None,
    };
    facts.extend(error.map(|error| ("relative error".into(), error)));
    if let Some(certificate) = &a.certificate {
        facts.push(("certified".into(), certificate.sentence().into()));
        facts.extend(certificate.facts());
    }
    let taken = format!("{:.3} s, {:.0} MB", a.seconds.total, a.peak_rss_mb);
    facts.push(("taken".into(), taken.into()));
    let proved = a.certificate.as_ref();
    let proved = proved.map(|c| text!(" Proved: {}.", c.brief()));
    let more = (!a.converged).then(|| {
        let steps = 4 * a.iterations.max(25);
        let again = format!("faceoff {} --max-iterations {steps}", engine::typed());
        Todo::new("Allow it more steps:", [again])
    });
    let pictures = about.clone();
    let u_drawn = Block::drawn(move || html::solution(&case.problem, u, &pictures));
    let newton = Block::drawn(move || {
        let increments = [(a.engine.as_str(), a.increments.as_slice())];
        let caption =
            text!("**The iteration.** Relative broken H¹ norm of the increment of each step");
        html::newton(&increments, &[], None, caption)
    });
    let caption = "The meshes on the way to the accuracy";
    let steps = table!(caption, a.meshes.iter().flatten(), |step|
        "mesh" => words_of(step.way),
        "n" => step.n,
        "cells" => step.cells,
        "certified to" => Cell::number(step.relative, percent_above(step.relative)),
        "seconds" => Cell::fixed(step.seconds, 2),
    );
    let warnings = [a.doubt(mesh), no_trace(&case.problem)];
    let mut page: Vec<Block> = warnings.into_iter().flatten().map(Block::text).collect();
    page.extend((!steps.rows.is_empty()).then(|| steps.into()));
    page.push(Block::drawn(move || {
        let put = html::Put::new(&a.engine, &case.problem, u, None);
        html::along_one(put, RESIDUAL_TOLERANCE, false)
    }));
    let terminal = vec![Block::text(about), Block::Facts(facts.clone())];
    let mut rest = vec![Block::Terminal(terminal)];
    let lines = a.explanation.iter().flat_map(Explanation::lines);
    rest.extend(lines.map(Block::text));
    rest.push(Block::Page(page));
    let taken = count(a.iterations, "step");
    report.story = Story {
        claim: match a.converged {
            true => text!("{a.scene} is **solved** by {a.method} in {taken}"),
            false => text!("{a.scene} is **not solved**: the tolerance is not reached in {taken}"),
        },
        rests_on: text!(
            "{} unknowns, a residual of **{}**; contact on {}.{proved}",
            whole(a.dofs),
            size(a.residual),
            contact(&a.contact_set)
        ),
        picture: vec![Block::Beside(vec![
            ("c4 half", vec![u_drawn]),
            ("c4 half", vec![newton]),
            ("c4", vec![Block::Facts(facts)]),
        ])],
        next: more.into_iter().collect(),
        rest,
    };
    report.files.push(Box::new(move |folder| {
        let path = folder.join(format!("{}.vtu", a.scene));
        super::write_solution(&path, case, u, &a.engine, &a.version, certificate)
    }));
    Ok(report)
}

/// The generator of a mesh.
pub fn words_of(way: Way) -> &'static str {
    match way {
        Way::Uniform => "uniform",
        Way::Adaptive => "adaptive",
    }
}

fn contact(set: &ContactSet) -> String {
    match set {
        ContactSet::Zones(zones) if !zones.faces.is_empty() => format!(
            "an area of {:.6} in {} on {}",
            zones.area,
            count(zones.zones, "zone"),
            count(zones.faces.len(), "face")
        ),
        ContactSet::Runs(runs) if !runs.is_empty() => {
            let end = |x: f64| trimmed(&number(x, 6));
            let run = |[from, to]: &[f64; 2]| format!("[{}, {}]", end(*from), end(*to));
            joined(runs.iter().map(run), " ")
        }
        _ => "nothing".into(),
    }
}
