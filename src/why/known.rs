//! What shows only beside the solution: right values at other places, a few wrong ones, and one that is not quite there.

use super::place::Spot;
use super::search::Search;
use super::{Aspect, Explanation, Rank};
use crate::text::{Number, Text, text};
use faceoff_fem::contact::Term;
use faceoff_mesh::error::Result;

/// Values are the same up to this, relative to the largest difference.
const SAME: f64 = 1e-6;
/// What is farther from the solution than this, relative to its largest value, is no iteration stopped early.
const NEARLY: f64 = 1e-2;

/// Solves, and compares; none where the Rust engine has no solution.
///
/// # Errors
/// An interruption.
pub(super) fn explain(search: &Search) -> Result<Option<Explanation>> {
    let Some(solution) = search.solution()? else {
        return Ok(None);
    };
    let (u, known) = (search.u, &solution.u);
    let largest = known.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
    let apart = |dof: usize| (u[dof] - known[dof]).abs();
    let farthest = (0..u.len()).map(apart).fold(0.0, f64::max);
    let same = (SAME * farthest).max(4.0 * search.limit * largest);
    let off: Vec<usize> = (0..u.len()).filter(|dof| apart(*dof) > same).collect();
    let spot = |dof: &usize| Spot::of_dof(&search.problem, *dof, search.errors[*dof]);
    let sorted = |values: &[f64]| {
        let mut sorted: Vec<f64> = off.iter().map(|dof| values[*dof]).collect();
        sorted.sort_by(f64::total_cmp);
        sorted
    };
    let pairs = sorted(u).into_iter().zip(sorted(known));
    let is_permuted = off.len() > 1 && pairs.into_iter().all(|(a, b)| (a - b).abs() <= same);
    let few = off.len() <= 3.max(u.len() / 50);
    let mut mended = u.to_vec();
    off.iter().for_each(|dof| mended[*dof] = known[*dof]);
    let left = search.problem.backward_error(&mended).0;
    if !off.is_empty() && (is_permuted || few) && left <= search.limit {
        let at: Vec<Spot> = off.iter().map(spot).collect();
        let count = off.len();
        let (aspect, brief, between) = match (is_permuted, &off[..]) {
            (true, _) => {
                let of = text!("{} of {} values", count, u.len());
                let brief = text!("its values are permuted: {} stand at other places", of);
                (Aspect::Order, brief, ", ")
            }
            (_, [one]) => {
                let [is, right] = [u, &known[..]].map(|of| Number::exact(of[*one]));
                let brief = text!("one value is off: {}, not {}", is, right);
                (Aspect::U, brief, ", on ")
            }
            _ => {
                let brief = text!("{} values are off, all others right", count);
                (Aspect::U, brief, ": on ")
            }
        };
        let more = text!("{}{}", between, Spot::list(&at));
        return Ok(Some(Explanation {
            at,
            ..Explanation::new(aspect, brief, Rank::Values, left).more(more)
        }));
    }
    if !(farthest <= NEARLY * largest) {
        return Ok(None);
    }
    let suspects = search.suspects();
    let or = if suspects.contains(&Term::Load) && !search.setup.scene.data().f.is_zero() {
        text!(", or f is integrated by a rule that is not known here")
    } else if suspects.contains(&Term::Contact) {
        text!(", or something on Γ_C differs in a way that is not known here")
    } else {
        Text::default()
    };
    let brief = text!(
        "no change of the scheme explains it; it is {} of max|u| away from the solution",
        Number::new(farthest / largest, 2)
    );
    let more = text!(", as after an iteration that stopped early{}", or);
    let found = Explanation::new(Aspect::Iteration, brief, Rank::Values, search.residual);
    Ok(Some(found.more(more)))
}
