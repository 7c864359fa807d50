//! The way to a γ far from h, where Newton's method cycles: from the solution at γ₀ = 1 to that at the γ₀ asked for, each the
//! start of the next, after the path-following of M. Hintermüller, K. Kunisch, SIAM J. Optim. 17, 2006.
//!
//! γ₀ changes by a factor, at first 10³, whose square is tried next where Newton's method ended, and its root where it did not.

use super::active_set::{ActiveSet, Per};
use super::form::Problem;
use super::iteration::Iteration;
use super::law::{Law, Multiplier};
use super::scheme::Scheme;
use super::system::{System, Weights, largest};
use faceoff_mesh::error::{Error, Result};

/// Steps of Newton's method for one γ: where it ends it hardly ever takes more.
pub(super) const DOZEN: usize = 12;
/// The first change of γ₀, and the one that is too small to be worth it.
const FIRST: f64 = 1e3;
const LAST: f64 = 1.05;

/// u that solves the scheme, up to rounding in its statuses; none where no path leads there. `steps` counts those of
/// Newton's method at every γ, each reported to `progress` as case 0.
///
/// # Errors
/// What `progress` returns, and an interruption.
pub(super) fn follow(
    problem: &Problem,
    scheme: &mut dyn System,
    start: &[f64],
    steps: &mut usize,
    progress: &mut dyn FnMut(usize, f64) -> Result<()>,
) -> Result<Option<Vec<f64>>> {
    let asked = problem.discretisation.gamma0();
    let mut at = match problem.method().law {
        // Its own, below what it is stable for.
        Law::Multiplier(_) => Multiplier::USUAL,
        _ => 1.0,
    };
    if at == asked {
        return Ok(None);
    }
    let mut newton_at = |gamma0: f64, start: &[f64]| {
        scheme.put_conditions(Scheme::at(problem, gamma0 / asked).conditions.into_owned());
        let step = |laws: &[Weights], r: &[f64]| scheme.step(laws, r);
        let found = newton(&*scheme, step, start, DOZEN, steps, progress);
        tracing::debug!(gamma0, found = matches!(found, Ok(Some(_))), "continuation");
        found
    };
    let mut found = newton_at(at, start);
    let mut factor = FIRST;
    while let Ok(Some(u)) = &found {
        if at == asked {
            return found;
        }
        let next = if asked > at {
            (at * factor).min(asked)
        } else {
            (at / factor).max(asked)
        };
        match newton_at(next, u) {
            Ok(None) if factor.sqrt() > LAST => factor = factor.sqrt(),
            ended => {
                (at, factor, found) = (next, factor * factor, ended);
            }
        }
    }
    scheme.put_conditions(Scheme::new(problem).conditions.into_owned());
    found
}

/// Newton's method, whose linear systems `step` solves: u where no status changes any more, none where it does not come
/// there in `most` steps.
///
/// # Errors
/// What `progress` returns, and an interruption.
pub(super) fn newton(
    scheme: &dyn System,
    step: impl Fn(&[Weights], &[f64]) -> Result<Vec<f64>>,
    start: &[f64],
    most: usize,
    steps: &mut usize,
    progress: &mut dyn FnMut(usize, f64) -> Result<()>,
) -> Result<Option<Vec<f64>>> {
    let mut u = start.to_vec();
    let mut set = ActiveSet::new(scheme, &u, Per::Condition);
    for _ in 0..most {
        let laws = set.laws(scheme, Iteration::Newton);
        let step = match step(&laws, &scheme.linear_residual(&laws, &u)) {
            Ok(step) => step,
            Err(Error::Solver { .. }) => return Ok(None),
            Err(other) => return Err(other),
        };
        u.iter_mut().zip(&step).for_each(|(u, d)| *u += d);
        *steps += 1;
        progress(0, largest(&step) / largest(&u))?;
        if set.pivot(scheme, &u) == 0 && !set.is_partial() {
            return Ok(u.iter().all(|u| u.is_finite()).then_some(u));
        }
    }
    Ok(None)
}
