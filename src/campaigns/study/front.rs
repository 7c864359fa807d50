//! The Pareto front of time and error.

use super::Norm;
use super::row::{Row, Varied};

/// Indices of the rows that are converged, judged, and not dominated by another row of their scene: none is at most as slow and has at most
/// the error in the energy norm, and is better in one.
pub fn front(rows: &[Row]) -> Vec<usize> {
    front_in(rows, Norm::Energy)
}

/// The same in any norm.
pub fn front_in(rows: &[Row], norm: Norm) -> Vec<usize> {
    let place = |row: &Row| {
        // Extremes are not meant to be good, and advised commands measure time differently.
        let counts = row.converged && !matches!(row.varied, Varied::Gamma0 | Varied::Target);
        let error = row.error(norm).filter(|_| counts)?;
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

#[cfg(test)]
mod tests {
    use super::super::row::sample;
    use super::*;

    #[test]
    fn what_is_beaten_in_both_is_not_on_the_front() {
        let points = [
            (0.1, 1.0),
            (0.05, 2.0),
            (0.06, 2.0),
            (0.2, 1.0),
            (0.04, 1.9),
            (0.01, 9.0),
        ];
        let mut rows: Vec<Row> = points.map(|(e, t)| sample(Varied::Mesh, e, t)).into();
        assert_eq!(front(&rows), [0, 4, 5]);
        // Unconverged rows and other scenes do not count.
        rows[0].converged = false;
        rows[4].scene = "other".into();
        assert_eq!(front(&rows), [1, 3, 4, 5]);
    }
}
