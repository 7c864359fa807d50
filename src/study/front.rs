//! The Pareto front: rows that nothing beats in both time and error.

use super::Norm;
use super::row::{Row, Varied};

/// Indices of the rows that are converged, judged, and beaten by no other of their scene: none is at most as slow and at
/// most as wrong, and better in one.
pub fn front(rows: &[Row]) -> Vec<usize> {
    let place = |row: &Row| {
        let counts = row.converged && row.varied != Varied::Gamma0;
        let error = row.error(Norm::Energy).filter(|_| counts)?;
        Some((row.seconds.median, error))
    };
    (0..rows.len())
        .filter(|&k| {
            let Some((time, error)) = place(&rows[k]) else {
                return false;
            };
            !rows.iter().any(|other| {
                other.scene == rows[k].scene
                    && place(other)
                        .is_some_and(|(t, e)| t <= time && e <= error && (t < time || e < error))
            })
        })
        .collect()
}
