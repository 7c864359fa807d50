//! The paper requires γ₀ "large enough": the range of γ₀ for which the scheme can be solved, the number of steps, and the γ₀ with
//! the least error.

use serde::Serialize;

use super::advice::Norm;
use super::row::{Row, Varied, tracks};
use crate::run::Fit;

/// An error that exceeds the least by less than this fraction is equivalent.
const AS_GOOD: f64 = 0.1;
/// Excess errors in this range show how the excess grows.
const EXCESS: std::ops::Range<f64> = 2e-3..3.0;

/// One method on one mesh over all γ₀.
#[derive(Debug, Clone, Serialize)]
pub struct Gammas {
    /// The name of the scene.
    pub scene: String,
    /// The name of the method.
    pub method: String,
    /// The refinement.
    pub n: usize,
    /// The number of values of γ₀.
    pub tried: usize,
    /// The number of those whose iteration reached its tolerance.
    pub solved: usize,
    /// The fewest and the most steps among those that were solved.
    pub steps: [usize; 2],
    /// For the error in the energy norm, or its bound if u is unknown.
    pub energy: Option<Safe>,
    /// For the error in L², if u is known.
    pub l2: Option<Safe>,
}

/// The γ₀ with the least error.
#[derive(Debug, Clone, Serialize)]
pub struct Safe {
    /// The least error.
    pub least: f64,
    /// The lower end of the interval of γ₀ around it in which no error is larger by a tenth.
    pub from: f64,
    /// The upper end.
    pub to: f64,
    /// The exponent of the excess error for γ₀ below the best; `None` if it is not seen to grow.
    pub below: Option<Fit>,
    /// The same for γ₀ above it.
    pub above: Option<Fit>,
}

/// For every track whose γ₀ was varied, on its finest mesh.
pub fn gammas(rows: &[Row]) -> Vec<Gammas> {
    let of = |mut track: Vec<&Row>| {
        let n = track.iter().filter_map(|r| r.n).max()?;
        track.retain(|r| r.n == Some(n));
        track.sort_by(|a, b| a.gamma0.total_cmp(&b.gamma0));
        let solved: Vec<&Row> = track.iter().copied().filter(|r| r.converged).collect();
        let steps = solved.iter().map(|r| r.steps);
        Some(Gammas {
            scene: track[0].scene.clone(),
            method: track[0].method.clone(),
            n,
            tried: track.len(),
            solved: solved.len(),
            steps: [steps.clone().min().unwrap_or(0), steps.max().unwrap_or(0)],
            energy: safe(&solved, Norm::Energy),
            l2: safe(&solved, Norm::L2),
        })
    };
    let tracks = tracks(rows, Varied::Gamma0).into_iter();
    tracks.filter_map(of).collect()
}

/// `rows` by ascending γ₀.
fn safe(rows: &[&Row], norm: Norm) -> Option<Safe> {
    let points = rows.iter().map(|r| Some((r.gamma0, r.error(norm)?)));
    let points: Vec<(f64, f64)> = points.collect::<Option<_>>()?;
    let (best, &(_, least)) = points
        .iter()
        .enumerate()
        .min_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
    let is_good = |(_, error): &(f64, f64)| *error <= (1.0 + AS_GOOD) * least;
    let (before, after) = points.split_at(best);
    let before = before.iter().rev().take_while(|p| is_good(p)).count();
    let after = after.iter().take_while(|p| is_good(p)).count();
    let excess = |points: &[(f64, f64)], away: f64| {
        let points = points.iter().map(|(gamma0, e)| (*gamma0, e - least));
        let seen = points.filter(|(_, e)| EXCESS.contains(&(e / least)));
        let fit = Fit::new(&seen.collect::<Vec<_>>());
        fit.filter(|fit| fit.exponent * away > 0.0 && fit.excludes(0.0))
    };
    Some(Safe {
        least,
        from: points[best - before].0,
        to: points[best + after - 1].0,
        below: excess(&points[..best], -1.0),
        above: excess(&points[best + 1..], 1.0),
    })
}

#[cfg(test)]
mod tests {
    use super::super::row::sample;
    use super::*;

    /// e = 1 + 0.5/γ₀ + 1e-6 γ₀: the least is near 1000, and within a tenth of it e is from 10 to 1e5.
    #[test]
    fn the_range_and_its_constants_are_found() {
        let of = |k: i32| {
            let gamma0 = 10.0_f64.powi(k);
            let error = 1.0 + 0.5 / gamma0 + 1e-6 * gamma0;
            Row {
                gamma0,
                ..sample(Varied::Gamma0, error, 1.0)
            }
        };
        let mut rows: Vec<Row> = (-3..=8).map(of).collect();
        rows[0].converged = false;
        let found = gammas(&rows);
        assert_eq!(found.len(), 1);
        let g = &found[0];
        assert_eq!((g.tried, g.solved, g.steps, g.n), (12, 11, [3, 3], 8));
        assert!(g.l2.is_none());
        let safe = g.energy.as_ref().unwrap();
        assert_eq!((safe.from, safe.to), (10.0, 1e5));
        assert!((safe.least - 1.0015).abs() < 1e-12);
        let below = safe.below.unwrap();
        assert!((below.exponent + 1.0).abs() < 0.1 && (below.constant - 0.5).abs() < 0.1);
    }

    /// Errors that fluctuate do not grow, nor do those that fall away from the least.
    #[test]
    fn growth_is_told_where_it_is_seen() {
        let of = |k: i32| {
            let flicker = if k % 2 == 0 { 0.01 } else { 0.02 };
            let error = if k == 0 { 1.0 } else { 1.0 + flicker };
            let gamma0 = 10.0_f64.powi(k);
            Row {
                gamma0,
                ..sample(Varied::Gamma0, error, 1.0)
            }
        };
        let rows: Vec<Row> = (-6..=6).map(of).collect();
        let safe = gammas(&rows)[0].energy.clone().unwrap();
        assert_eq!((safe.below, safe.above), (None, None));
        assert_eq!((safe.from, safe.to), (1e-6, 1e6));
    }
}
