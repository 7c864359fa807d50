//! The γ₀ that explains an answer best.

use super::search::{Search, distance};
use crate::run::Variation;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::FaceFields;

/// Starts, relative to the γ₀ that was asked for: least squares find the nearest minimum only.
const STARTS: [f64; 5] = [1.0, 1e-2, 1e2, 1e-4, 1e4];
/// Towards 0 and infinity the answer no longer depends on γ, and many would fit.
const FAR: f64 = 1e5;
const STEPS: usize = 8;
/// Of the difference quotient in log γ₀.
const STEP: f64 = 1e-4;

/// γ₀ and the difference that it leaves; none where no other γ₀ comes nearer.
///
/// Least squares of the face means in log γ₀ by Gauss and Newton, with the derivative by differences.
///
/// # Errors
/// An interruption.
pub(super) fn fit(search: &Search, answer: &FaceFields) -> Result<Option<(f64, f64)>> {
    let asked = search.setup().discretisation.gamma0;
    let mut best: Option<(f64, f64)> = None;
    for start in STARTS {
        let mut gamma0 = start * asked;
        for _ in 0..STEPS {
            let at = |gamma0: f64| -> Result<Option<FaceFields>> {
                search.rust(&search.setup().with(&Variation::Gamma0(gamma0))?)
            };
            let (Some(here), Some(beside)) = (at(gamma0)?, at(gamma0 * (1.0 + STEP))?) else {
                break;
            };
            let left = distance(&here, answer);
            if best.is_none_or(|(_, other)| left < other) {
                best = Some((gamma0, left));
            }
            let means = |f: &FaceFields| f.column("mean").map(|c| c.values.clone());
            let (Some(x), Some(y), Some(z)) = (means(&here), means(&beside), means(answer)) else {
                break;
            };
            let (mut above, mut below) = (0.0, 0.0);
            for ((x, y), z) in x.iter().zip(y).zip(z) {
                let slope = (y - x) / STEP;
                above += slope * (z - x);
                below += slope * slope;
            }
            let change = (above / below).clamp(-0.9, 10.0);
            gamma0 *= 1.0 + change;
            let is_far = !(asked / FAR..=asked * FAR).contains(&gamma0);
            if is_far || !change.is_finite() || change.abs() < 1e-15 {
                break;
            }
        }
        if best.is_some_and(|(_, left)| left <= search.tolerance()) {
            break;
        }
    }
    // The γ₀ that was asked for is no other.
    Ok(best.filter(|(gamma0, _)| *gamma0 != asked))
}
