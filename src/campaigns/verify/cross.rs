//! Different schemes for the same problem: methods judged by certified bounds of their errors.
//!
//! ‖∇(u_a - u_b)‖ ≤ bound_a + bound_b holds for any two fields whose bounds are guaranteed, whether right or wrong:
//! a distance beyond the sum would prove the bounds wrong. A wrong field is recognised by
//! a large bound. So a field that does not solve its scheme is compared with the proven best bound of constants on the cells: a right field
//! of these methods exceeds that by a factor of at most 2 on the scenes whose solution is known. One that solves its scheme may exceed it
//! as well if the method is inaccurate, as the penalty-free law is for a small γ.

use std::borrow::Cow;

use serde::Serialize;

use crate::engine::{self, Case};
use crate::run::certificate as refusal;
use faceoff_fem::certify::{Certificate, PreparedData, Target, certify_with, distance};
use faceoff_judge::Verdict;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;

use super::{CaseOutcome, EngineOutcome};

/// If a bound exceeds that of constants on the cells by this factor, the field is less accurate than the mesh allows.
pub const STANDS_OUT: f64 = 4.0;

/// Two methods, each by some engine, on one scene and mesh.
#[derive(Debug, Serialize)]
pub struct CrossOutcome {
    /// The name of the scene.
    pub scene: String,
    /// The refinement, if the scene has one.
    pub n: Option<usize>,
    /// The first.
    pub a: Source,
    /// The second.
    pub b: Source,
    /// `None` if there is no certificate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub judged: Option<Judged>,
    /// Why there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub no_certificate: Option<String>,
}

/// An engine with a method.
#[derive(Debug, Clone, Serialize)]
pub struct Source {
    /// The name of the engine.
    pub engine: String,
    /// The name of the method.
    pub method: String,
}

/// Energy norms, broken over the cells.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Judged {
    /// ‖∇(u_a - u_b)‖
    pub distance: f64,
    /// Bounds of ‖∇(u - u_a)‖ and ‖∇(u - u_b)‖.
    pub bounds: [f64; 2],
    /// Their sum minus the distance.
    pub slack: f64,
    /// The bound of constants on the cells, the best for any field on this mesh.
    pub best: f64,
    /// ‖∇u‖ is at least this.
    pub gradient: f64,
    /// They disagree if the distance exceeds the sum of the bounds, or if one that does not solve its scheme has a
    /// bound beyond [`STANDS_OUT`] times `best`.
    pub verdict: Verdict,
}

/// For each scene, mesh and pair of methods, the pair of engines to show first, and the number of
/// pairs: codes with the same scheme agree to many digits.
pub fn telling(cross: &[CrossOutcome]) -> Vec<(&CrossOutcome, usize)> {
    let same = |a: &CrossOutcome, b: &CrossOutcome| {
        let methods = |c: &CrossOutcome| [c.a.method.clone(), c.b.method.clone()];
        a.scene == b.scene && a.n == b.n && methods(a) == methods(b)
    };
    let worse = |c: &CrossOutcome| match &c.judged {
        Some(j) if j.verdict == Verdict::Disagree => f64::INFINITY,
        Some(j) => -j.slack,
        None => f64::MAX,
    };
    let worst = |pairs: &'_ [CrossOutcome]| -> Option<usize> {
        (0..pairs.len()).max_by(|&a, &b| worse(&pairs[a]).total_cmp(&worse(&pairs[b])))
    };
    cross
        .chunk_by(same)
        .filter_map(|pairs| Some((&pairs[worst(pairs)?], pairs.len())))
        .collect()
}

/// A case with a certificate, or the reason why not, for each engine.
struct Certified<'a> {
    case: &'a Case<'a>,
    of_engines: Vec<(&'a EngineOutcome, Result<Certificate, String>)>,
}

/// All pairs of different methods on the same scene and mesh, over all engines.
///
/// # Errors
/// Errors of the linear solver. If there is no certificate, the outcome states why.
pub(super) fn judge_methods(
    cases: &[&Case],
    outcomes: &[CaseOutcome],
) -> Result<Vec<CrossOutcome>> {
    let mut cross = Vec::new();
    let same_mesh = |a: &Case, b: &Case| a.scene().name() == b.scene().name() && a.n == b.n;
    let mut from = 0;
    while from < cases.len() {
        let of_mesh = cases[from..]
            .iter()
            .take_while(|case| same_mesh(case, cases[from]))
            .count();
        if of_mesh > 1 {
            let data = refusal(PreparedData::new(&cases[from].problem))?;
            let certified = cases[from..from + of_mesh]
                .iter()
                .zip(&outcomes[from..])
                .map(|(case, outcome)| certified(case, outcome, data.as_ref()))
                .collect::<Result<Vec<_>>>()?;
            for (a, b) in engine::pairs(certified.len()) {
                cross.extend(pairs(&certified[a], &certified[b], &certified));
            }
        }
        from += of_mesh;
    }
    Ok(cross)
}

fn certified<'a>(
    case: &'a Case<'a>,
    outcome: &'a CaseOutcome,
    data: Result<&PreparedData, &String>,
) -> Result<Certified<'a>> {
    let of_engines = outcome
        .engines
        .iter()
        .map(|engine| {
            cancel::check()?;
            let certificate = match data {
                Ok(data) => {
                    let data = Cow::Borrowed(data);
                    refusal(certify_with(&case.problem, &engine.answer.u, data))?
                }
                Err(because) => Err(because.clone()),
            };
            Ok((engine, certificate))
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(Certified { case, of_engines })
}

fn pairs(a: &Certified, b: &Certified, all: &[Certified]) -> Vec<CrossOutcome> {
    let certificates = all.iter().flat_map(|c| &c.of_engines);
    let best = certificates
        .filter_map(|(_, certificate)| certificate.as_ref().ok())
        .fold((f64::INFINITY, 0.0_f64), |(bound, gradient), c| {
            (bound.min(c.constants), gradient.max(c.gradient[0]))
        });
    let mut outcomes = Vec::new();
    for (engine_a, of_a) in &a.of_engines {
        for (engine_b, of_b) in &b.of_engines {
            let source = |engine: &EngineOutcome, of: &Certified| Source {
                engine: engine.engine.clone(),
                method: of.case.problem.method().to_string(),
            };
            let (judged, no_certificate) = match (of_a, of_b) {
                (Ok(of_a), Ok(of_b)) => {
                    let spaces = [&a.case.problem.space, &b.case.problem.space];
                    let distance = distance(spaces, [&engine_a.answer.u, &engine_b.answer.u]);
                    let bounds = [of_a, of_b].map(|c| c.of(Target::UH)[1]);
                    let solve = [engine_a, engine_b].map(|e| e.verdict.passes());
                    (Some(judge(distance, bounds, solve, best)), None)
                }
                (Err(because), _) | (_, Err(because)) => (None, Some(because.clone())),
            };
            outcomes.push(CrossOutcome {
                scene: a.case.scene().name().to_owned(),
                n: a.case.n,
                a: source(engine_a, a),
                b: source(engine_b, b),
                judged,
                no_certificate,
            });
        }
    }
    outcomes
}

fn judge(
    distance: f64,
    bounds: [f64; 2],
    solve: [bool; 2],
    (best, gradient): (f64, f64),
) -> Judged {
    let slack = bounds[0] + bounds[1] - distance;
    // Rounding between two equal fields on a mesh whose space contains the solution.
    let rounding = 1e-10 * gradient;
    let as_good = |bound: f64| bound <= STANDS_OUT * best + rounding;
    let stand = (bounds.iter().zip(solve)).all(|(bound, solves)| solves || as_good(*bound));
    Judged {
        distance,
        bounds,
        slack,
        best,
        gradient,
        verdict: match slack >= -rounding && stand {
            true => Verdict::Agree,
            false => Verdict::Disagree,
        },
    }
}
