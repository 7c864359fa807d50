//! What `faceoff solve` tells: for scripts, and for people.

use super::tell::tell;
use serde::Serialize;

use crate::engine::{self, Case, Explanation};
use crate::report;
use crate::run::RESIDUAL_TOLERANCE;
use faceoff_fem::adapt::Step;
use faceoff_fem::contact::{ContactSet, Ended, Errors, Iteration, quantities};
use faceoff_fem::known::Truth;
use faceoff_fem::linear::Choice;
use faceoff_mesh::error::Result;

/// The answer, as scripts read it.
#[derive(Serialize)]
pub(super) struct Answer {
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
    pub converged: bool,
    /// increment, rounding, not-reached or undetermined
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
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certificate: Option<report::Certified>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub explanation: Option<Explanation>,
    /// The meshes on the way to an accuracy, and how they ended.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meshes: Option<Vec<Step>>,
    /// What solved the linear systems, and what it was predicted to take; of the Rust engine.
    #[serde(skip_serializing_if = "Option::is_none")]
    linear: Option<Choice>,
    seconds: Seconds,
    peak_rss_mb: f64,
}

/// Wall-clock seconds; null where an engine does not tell.
#[derive(Serialize)]
pub(super) struct Seconds {
    pub mesh: f64,
    pub assembly: Option<f64>,
    pub factor: Option<f64>,
    pub iterate: Option<f64>,
    /// From u on the contact cells to u everywhere.
    pub expand: Option<f64>,
    pub total: f64,
}

impl Answer {
    /// What an engine answered to a case, and the seconds for its mesh and its assembly.
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
        let own = engine == "rust";
        let phase = |name: &str| answer.seconds.iter().find(|(n, _)| n == name).map(|p| p.1);
        let values = quantities(&case.problem, &answer.u);
        let error = Truth::of(case.scene())?
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
            increments: answer.increments.clone(),
            active_set_changes: history.map(|h| h.changes.clone()),
            residuals: history.map(|h| h.residuals.clone()),
            converged: answer.converged,
            ended: history.map(|h| h.ended),
            step: answer.step,
            linear: history.map(|h| h.linear),
            residual: answer.residual,
            grad_norm_sq: values.grad_norm_sq,
            l2_norm: values.l2_norm,
            contact_flux: values.contact_flux,
            contact_residual: values.contact_residual,
            contact_set: values.contact_set,
            error,
            certificate: None,
            explanation: None,
            meshes: None,
            seconds: Seconds {
                mesh: if own {
                    mesh
                } else {
                    mesh + phase("read").unwrap_or(0.0) + phase("mesh").unwrap_or(0.0)
                },
                assembly: if own {
                    Some(assembly)
                } else {
                    phase("assemble").map(|s| s + phase("space").unwrap_or(0.0))
                },
                factor: phase("factor"),
                iterate: phase("iterate").or(phase("solve")),
                expand: phase("expand"),
                total,
            },
            peak_rss_mb: engine::peak_memory_mb(!own),
        })
    }

    pub fn is_finite(&self) -> bool {
        self.grad_norm_sq.is_finite()
    }

    /// Does the scheme's residual bear out what another code says of its convergence? One whose factorisation failed may
    /// take a step of nothing for the last one.
    pub fn solves(&self, tolerance: f64) -> bool {
        self.residuals.is_some() || self.residual <= tolerance.max(RESIDUAL_TOLERANCE)
    }

    /// What is wrong with one that does not.
    pub fn contradiction(&self) -> String {
        format!(
            "{} says that it converged, but its answer leaves a backward error of {:.1e} in the scheme; this is no solution: \
             keep the job folder with --keep and look at log.txt, in which a lack of memory may show",
            self.engine, self.residual
        )
    }

    /// What is wrong with an answer that was not reached.
    pub fn complaint(&self, tolerance: f64) -> String {
        if self.ended == Some(Ended::Undetermined) {
            return format!(
                "{} solves the scheme up to a backward error of {:.1e}, but its matrix is singular to working precision, so that \
                 rounding decides what u is; this is no solution: use cells of less extreme shape, or a smaller gamma0",
                self.engine, self.residual
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

pub(super) fn print(a: &Answer) {
    let n = a.n.map_or(String::new(), |n| format!(", n = {n}"));
    tell!(
        "{} by {} {} ({}){n}",
        a.scene,
        a.engine,
        a.version,
        a.method
    );
    tell!("  cells {}, faces {}, dofs {}", a.cells, a.faces, a.dofs);
    let rounding = match a.ended {
        Some(Ended::Rounding) => ", to rounding: no smaller increments are to be had",
        _ => "",
    };
    tell!(
        "  {} iterations, backward error {:.1e}{rounding}",
        a.iterations,
        a.residual
    );
    tell!("  ‖∇u‖²           {:.15e}", a.grad_norm_sq);
    tell!("  ‖u‖             {:.15e}", a.l2_norm);
    tell!("  flux on Γ_C     {:.15e}", a.contact_flux);
    tell!("  ‖u-ψ+[P]₊‖_C    {:.15e}", a.contact_residual);
    tell!("  contact on      {}", contact(&a.contact_set));
    if let Some(Errors { h1, l2 }) = a.error {
        tell!("  relative error  {h1:.3e} in ∇u, {l2:.3e} in u");
    }
    if let Some(c) = &a.certificate {
        tell!("  {}", c.sentence());
    }
    tell!("  {:.3} s, {:.0} MB", a.seconds.total, a.peak_rss_mb);
    for line in a.explanation.iter().flat_map(Explanation::lines) {
        tell!("  {line}");
    }
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
