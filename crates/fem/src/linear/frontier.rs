//! What of the tree of elimination is done once, and what again for each set of statuses in contact.
//!
//! Below the *frontier* kept unknowns are carried upwards in every front, and the others are eliminated once; what arrives is
//! dense, and grows with the square of all that is kept below. Above it parts are *open*: all that is complete in them, kept
//! or not, is eliminated anew by [`super::lu`]. With p_I and p_K unknowns complete in a part S, b on its border and w_S kept
//! ones complete in S and below, the cheapest frontier follows from the leaves upwards:
//!
//! ```text
//! carry(S) = carry(L) + carry(R) + c(p_I, b + w_S)
//! best(S)  = min(carry(S) + k c'(w_S, b),  best(L) + best(R) + k c'(p_I + p_K, b))
//! ```
//!
//! where L and R are its halves, k factorisations are needed, and c and c' are the costs of a front by Cholesky and by LU.
//! On a square the whole is the frontier, on a strip every part of about its width.

use super::bisection::Tree;

/// What is complete in a part and not in its halves, and what it shares with the rest.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Count {
    pub eliminated: u32,
    pub kept: u32,
    pub border: u32,
}

/// So many factorisations Newton's method takes, as measured; between them corrections of low rank do.
pub(super) const STEPS: f64 = 5.0;
/// A front costs so many multiplications and additions whatever its size, and so many more for each entry.
const FRONT: f64 = 2000.0;
const ENTRY: f64 = 4.0;

/// Multiplications and additions of a front by Cholesky.
pub(super) fn cholesky(p: f64, b: f64) -> f64 {
    p * p * p / 3.0 + p * p * b + p * b * b
}

/// The same by LU, with the pivots' inverse times their border kept.
pub(super) fn lu(p: f64, b: f64) -> f64 {
    2.0 * cholesky(p, b)
}

/// What a front of so many unknowns costs besides.
pub(super) fn overhead(size: f64) -> f64 {
    FRONT + ENTRY * size * size
}

const NONE: u32 = u32::MAX;

/// The part of the frontier that each part is in; none of open ones.
pub(super) fn frontier(tree: &Tree, counts: &[Count], is_whole: bool) -> Vec<Option<u32>> {
    let parts = tree.parts.len();
    let (mut carry, mut best) = (vec![0.0; parts], vec![0.0; parts]);
    let (mut kept, mut open) = (vec![0.0; parts], vec![false; parts]);
    let mut above = vec![NONE; parts];
    for (k, part) in tree.parts.iter().enumerate() {
        let [p, q, b] = [counts[k].eliminated, counts[k].kept, counts[k].border].map(f64::from);
        let mut anew = f64::INFINITY;
        kept[k] = q;
        if let Some(left) = part.left() {
            (above[left], above[k - 1]) = (k as u32, k as u32);
            kept[k] += kept[left] + kept[k - 1];
            carry[k] = carry[left] + carry[k - 1];
            anew = best[left] + best[k - 1] + STEPS * (lu(p + q, b) + overhead(p + q + b));
        }
        let w = kept[k];
        carry[k] += cholesky(p, b + w) + overhead(p + b + w);
        best[k] = carry[k];
        if w > 0.0 && !is_whole {
            best[k] += STEPS * (lu(w, b) + overhead(w + b));
            open[k] = anew < best[k];
            best[k] = best[k].min(anew);
        }
    }
    let mut within = vec![None; parts];
    for k in (0..parts).rev() {
        within[k] = match above[k] {
            parent if parent != NONE && within[parent as usize].is_some() => {
                within[parent as usize]
            }
            _ => (!open[k]).then_some(k as u32),
        };
    }
    within
}
