//! Divides the elimination tree into a part that is eliminated once, and a part that is eliminated again for each contact set.
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

/// The unknowns of each part that are complete in it and not in its halves, and those that it shares with the rest.
pub(super) struct Counts {
    pub eliminated: Vec<u32>,
    pub kept: Vec<u32>,
    pub border: Vec<u32>,
}

impl Counts {
    /// Zero counts for a given number of parts.
    pub fn new(parts: usize) -> Self {
        let [eliminated, kept, border] = [(); 3].map(|()| vec![0; parts]);
        Counts {
            eliminated,
            kept,
            border,
        }
    }
}

/// The number of factorisations in Newton's method, as measured; between them low-rank corrections suffice.
pub(super) const STEPS: f64 = 5.0;
/// The cost of a front in multiplications and additions: a constant, and a number per entry.
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

/// The additional cost of a front with a given number of unknowns.
pub(super) fn overhead(size: f64) -> f64 {
    FRONT + ENTRY * size * size
}

/// Which parts are open. `near` are those with kept unknowns, ascending: no other one is open, nor does what it costs matter.
/// `above` is the part above each.
pub(super) fn open(tree: &Tree, counts: &Counts, near: &[u32], above: &[u32]) -> Vec<bool> {
    let parts = tree.parts.len();
    let (mut carry, mut best) = (vec![0.0; parts], vec![0.0; parts]);
    let (mut kept, mut open) = (vec![0.0; parts], vec![false; parts]);
    for k in near.iter().map(|&k| k as usize) {
        let [p, q, b] =
            [&counts.eliminated, &counts.kept, &counts.border].map(|of| f64::from(of[k]));
        let mut anew = f64::INFINITY;
        kept[k] = q;
        if let Some(left) = tree.parts[k].left() {
            kept[k] += kept[left] + kept[k - 1];
            carry[k] = carry[left] + carry[k - 1];
            anew = best[left] + best[k - 1] + STEPS * (lu(p + q, b) + overhead(p + q + b));
        }
        let w = kept[k];
        carry[k] += cholesky(p, b + w) + overhead(p + b + w);
        best[k] = carry[k] + STEPS * (lu(w, b) + overhead(w + b));
        open[k] = anew < best[k];
        best[k] = best[k].min(anew);
    }
    // What is below a part that is not open is not either.
    for k in near.iter().rev().map(|&k| k as usize) {
        open[k] &= open.get(above[k] as usize).is_none_or(|open| *open);
    }
    open
}
