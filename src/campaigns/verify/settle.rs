//! Answers that solve the scheme and differ: because rounding moves them that far, or because the scheme has several solutions.

use serde::Serialize;

use faceoff_fem::contact::{Conditioning, Problem, Several, several};
use faceoff_fem::linear::Settings;
use faceoff_judge::{FieldVerdict, Verdict, judge_conditioned};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::FaceFields;

/// If rounding moves u by a larger fraction, it dominates u.
const SETTLED: f64 = 1e-3;

/// The finding on two answers that both solve the scheme and differ by more than the fixed tolerance.
#[derive(Debug, Serialize)]
pub struct Settled {
    /// The first engine.
    pub a: String,
    /// The second.
    pub b: String,
    /// The effect of rounding on the solution.
    #[serde(flatten)]
    pub conditioning: Conditioning,
    /// They are two solutions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub several: Option<Several>,
}

/// Judges again the fields of two answers that solve the scheme, if they disagree. `None` if no linear system can be solved
/// that would decide.
///
/// # Errors
/// An interruption.
pub(super) fn settle(
    problem: &Problem,
    [a, b]: [(&FaceFields, &[f64]); 2],
    judged: &mut [FieldVerdict],
) -> Result<Option<Settled>> {
    let disagrees = |field: &FieldVerdict| field.verdict == Verdict::Disagree;
    let answers = [a.1, b.1];
    let Ok(conditioning) = Conditioning::new(problem, answers, Settings::default()) else {
        return cancel::check().map(|()| None);
    };
    judge_conditioned(a.0, b.0, judged, &conditioning.by_face(problem))?;
    let conditioned = judged
        .iter_mut()
        .filter(|f| f.verdict == Verdict::Conditioned);
    for field in conditioned.filter(|f| f.max_rel > SETTLED) {
        field.verdict = Verdict::Undetermined;
        field.reason = Some("rounding decides what u is".into());
    }
    let mut found = None;
    if judged.iter().any(disagrees) {
        found = several(problem, answers, Settings::default())?;
        if found.is_some() {
            let fields = judged.iter_mut().filter(|f| disagrees(f));
            fields.for_each(|field| field.verdict = Verdict::Several);
        }
    }
    Ok(Some(Settled {
        a: a.0.source.clone(),
        b: b.0.source.clone(),
        conditioning,
        several: found,
    }))
}
