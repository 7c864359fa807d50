//! The benefit of a setting: the cheapest value that costs no accuracy.

use serde::Serialize;

use super::NORMS;
use super::row::{Row, Varied, tracks};

/// Errors that differ by less than this fraction are equal.
pub const HARMLESS: f64 = 0.01;

/// One setting over its values, of one method on one mesh.
#[derive(Debug, Clone, Serialize)]
pub struct Waste {
    /// The name of the scene.
    pub scene: String,
    /// The name of the method.
    pub method: String,
    /// The refinement.
    pub n: usize,
    /// The setting.
    pub varied: Varied,
    /// The loosest tolerance, or the rule with fewest points, whose errors equal those of the most exact within 1 %.
    pub enough: String,
    /// The most exact value that was measured.
    pub most_exact: String,
    /// The ratio of its time to that of `enough`.
    pub time_ratio: f64,
    /// The interval of that ratio over the repetitions: from fastest over slowest to slowest over fastest.
    #[serde(skip)]
    pub time_range: [f64; 2],
    /// The relative increase of the error with the worst value.
    pub worst_change: f64,
}

/// For tolerances and rules, by track. The rows of a track are ordered from loose to exact.
pub fn waste(rows: &[Row]) -> Vec<Waste> {
    let kinds = [
        Varied::Tolerance,
        Varied::ContactQuadrature,
        Varied::LoadQuadrature,
    ];
    let of = |track: Vec<&Row>| {
        let (row, exact) = (track.first()?, track.last()?);
        let change = |r: &Row| {
            let norms = NORMS.into_iter();
            let changes = norms.filter_map(|norm| Some(r.error(norm)? / exact.error(norm)? - 1.0));
            changes.fold(0.0, f64::max)
        };
        // All from `enough` on are equivalent, so that one value that is good by chance does not count.
        let harmful = track.iter().rposition(|r| !(change(r) < HARMLESS));
        let enough = track[harmful.map_or(0, |k| k + 1).min(track.len() - 1)];
        Some(Waste {
            scene: row.scene.clone(),
            method: row.method.clone(),
            n: row.n?,
            varied: row.varied,
            enough: value(enough),
            most_exact: value(exact),
            time_ratio: exact.seconds.median / enough.seconds.median,
            time_range: [
                exact.seconds.least / enough.seconds.most,
                exact.seconds.most / enough.seconds.least,
            ],
            worst_change: track.iter().map(|r| change(r)).fold(0.0, f64::max),
        })
    };
    let tracks = kinds.into_iter().flat_map(|varied| tracks(rows, varied));
    tracks.filter_map(of).collect()
}

/// The value of the varied setting of a row.
pub fn value(row: &Row) -> String {
    match row.varied {
        Varied::Tolerance => format!("{:e}", row.tolerance),
        Varied::ContactQuadrature => row.contact_quadrature.clone(),
        Varied::LoadQuadrature => row.load_quadrature.clone(),
        Varied::Linear => format!("{} {}", row.linear, row.precision),
        Varied::Gamma0 => format!("{:e}", row.gamma0),
        Varied::Mesh | Varied::Target => row.n.map_or(String::new(), |n| n.to_string()),
        Varied::Adaptive => row.accuracy.map_or(String::new(), |a| format!("{a:e}")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::row::sample;
    use super::*;

    #[test]
    fn enough_is_what_stays_enough() {
        // 1e-2 is accurate by chance, 1e-3 is not, and from 1e-4 on the error stays the same.
        let errors = [
            (1e-2, 0.1),
            (1e-3, 0.2),
            (1e-4, 0.1005),
            (1e-5, 0.0999),
            (1e-6, 0.1),
        ];
        let rows: Vec<Row> = errors
            .map(|(tolerance, error)| Row {
                tolerance,
                ..sample(Varied::Tolerance, error, -f64::log10(tolerance))
            })
            .into();
        let found = waste(&rows);
        assert_eq!(found.len(), 1);
        assert_eq!((&*found[0].enough, &*found[0].most_exact), ("1e-4", "1e-6"));
        assert!((found[0].time_ratio - 1.5).abs() < 1e-14);
        assert!((found[0].worst_change - 1.0).abs() < 1e-14);
    }
}
