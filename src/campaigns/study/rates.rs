//! Exponents of measurements, by least squares in logarithms, with their confidence intervals.

use serde::Serialize;

use super::row::{Row, Varied, tracks};
use crate::run::Fit;

/// The dependence of errors, time and memory of one engine and method on the mesh.
#[derive(Debug, Clone, Serialize)]
pub struct Rates {
    /// The name of the scene.
    pub scene: String,
    /// The name of the engine.
    pub engine: String,
    /// The name of the method.
    pub method: String,
    /// Exponent of the error in 1/n.
    pub h1: Option<Fit>,
    /// The same in L², if u is known.
    pub l2: Option<Fit>,
    /// Exponent of time in the number of dofs; `None` if noise hides it.
    pub seconds: Option<Fit>,
    /// Exponent of peak memory in the number of dofs; `None` if noise hides it.
    pub memory: Option<Fit>,
}

/// The number of finest meshes to which time and memory are fitted: coarser ones are dominated by start-up.
pub(super) const COSTS: usize = 4;

/// Time and memory of small meshes are start-up and noise: a growth rate is reported only if it is visible, and known to a quarter.
fn is_seen(fit: &Fit) -> bool {
    fit.exponent > 0.0 && fit.excludes(0.0) && fit.spread.is_some_and(|spread| spread < 0.25)
}

/// The rates of every track over its uniform meshes.
pub fn rates(rows: &[Row]) -> Vec<Rates> {
    let of = |track: Vec<&Row>| {
        let solved = || track.iter().filter(|r| r.converged);
        let over = |x: fn(&Row) -> Option<f64>, y: fn(&Row) -> Option<f64>| {
            let points = solved().filter_map(|r| Some((x(r)?, y(r)?)));
            points.collect::<Vec<_>>()
        };
        let h: fn(&Row) -> Option<f64> = |r| Some(1.0 / r.n? as f64);
        let dofs: fn(&Row) -> Option<f64> = |r| Some(r.dofs as f64);
        let error = |y: fn(&Row) -> Option<f64>| {
            Fit::of_finest(&over(h, y)).filter(|fit| fit.spread.is_some())
        };
        let cost = |y: fn(&Row) -> Option<f64>| {
            let points = over(dofs, y);
            Fit::new(&points[points.len().saturating_sub(COSTS)..]).filter(is_seen)
        };
        let row = track[0];
        Rates {
            scene: row.scene.clone(),
            engine: row.engine.clone(),
            method: row.method.clone(),
            h1: error(|r| r.h1.or(r.certified)),
            l2: error(|r| r.l2),
            seconds: cost(|r| Some(r.seconds.median)),
            memory: cost(|r| r.memory_mb),
        }
    };
    tracks(rows, Varied::Mesh).into_iter().map(of).collect()
}
