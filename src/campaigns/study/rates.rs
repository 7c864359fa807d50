//! Exponents of what was measured, by least squares in logarithms, with their spread.

use serde::Serialize;

use super::row::{Row, Varied, tracks};
use crate::run::Fit;

/// How errors, time and memory of one engine and method change with the mesh.
#[derive(Debug, Clone, Serialize)]
pub struct Rates {
    /// Its name.
    pub scene: String,
    /// Its name.
    pub engine: String,
    /// Its name.
    pub method: String,
    /// Errors over 1/n.
    pub h1: Option<Fit>,
    /// The same in L², where u is known.
    pub l2: Option<Fit>,
    /// Over the number of dofs; none where noise hides it.
    pub seconds: Option<Fit>,
    /// Peak memory over the number of dofs; none where noise hides it.
    pub memory: Option<Fit>,
}

/// Time and memory of small meshes are start-up and noise: growth is told where it is seen, by two standard errors, and known to
/// a quarter.
fn is_seen(fit: &Fit) -> bool {
    let seen = |spread: f64| spread < 0.25 && fit.exponent > 2.0 * spread;
    fit.spread.is_some_and(seen)
}

/// The rates of every track over its uniform meshes.
pub fn rates(rows: &[Row]) -> Vec<Rates> {
    let of = |track: Vec<&Row>| {
        let solved = || track.iter().filter(|r| r.converged);
        let over = |x: fn(&Row) -> Option<f64>, y: fn(&Row) -> Option<f64>| {
            let points = solved().filter_map(|r| Some((x(r)?, y(r)?)));
            Fit::of_finest(&points.collect::<Vec<_>>()).filter(|fit| fit.spread.is_some())
        };
        let h: fn(&Row) -> Option<f64> = |r| Some(1.0 / r.n? as f64);
        let dofs: fn(&Row) -> Option<f64> = |r| Some(r.dofs as f64);
        let row = track[0];
        Rates {
            scene: row.scene.clone(),
            engine: row.engine.clone(),
            method: row.method.clone(),
            h1: over(h, |r| r.h1.or(r.certified)),
            l2: over(h, |r| r.l2),
            seconds: over(dofs, |r| Some(r.seconds.median)).filter(is_seen),
            memory: over(dofs, |r| r.memory_mb).filter(is_seen),
        }
    };
    tracks(rows, Varied::Mesh).into_iter().map(of).collect()
}
