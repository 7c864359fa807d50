//! Extrapolation: the largest problem that fits into the machine's memory, and a model of weak scaling.
//!
//! R ranks with the dofs of one machine each solve a problem of R times the size. With work ~ dofs^p and memory ~
//! dofs^q, shared evenly over a network without cost,
//!
//! ```text
//! time ~ R^(p-1),   memory of a rank ~ R^(q-1),   efficiency R^(1-p)
//! ```
//!
//! A factorisation by nested dissection tends to p = 3/2, q = 1 in 2D and to p = 2, q = 4/3 in 3D (A. George, SIAM J. Numer.
//! Anal. 10, 1973), multigrid to p = q = 1: the model shows limits that no network removes, before a cluster is used.

use serde::Serialize;

use super::rates::{COSTS, Rates};
use super::row::{Row, Varied};

/// Ranks for which the model is reported.
pub const RANKS: [u32; 4] = [4, 16, 64, 256];

/// No machine has more ranks.
const OUT_OF_REACH: f64 = 1e6;

/// The extrapolation from the fits of one engine and method.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scaling {
    /// The name of the scene.
    pub scene: String,
    /// The name of the engine.
    pub engine: String,
    /// The name of the method.
    pub method: String,
    /// The coarsest mesh in the fit of time; the finest measured mesh is the other end.
    pub from_dofs: usize,
    /// The finest mesh that was measured.
    pub dofs: usize,
    /// The median on that mesh.
    pub seconds: f64,
    /// Peak memory on that mesh.
    pub memory_mb: f64,
    /// Dofs that fit into this machine's memory.
    pub most_dofs: Option<f64>,
    /// The predicted time for them in seconds.
    pub most_seconds: Option<f64>,
    /// Seconds on 4, 16, 64 and 256 ranks, each with the dofs of the finest mesh.
    pub rank_seconds: [f64; 4],
    /// Memory of each of those ranks.
    pub rank_memory_mb: [f64; 4],
    /// Ranks at which the efficiency is one half; `None` if the time is not seen to grow faster than the dofs, or if that number is out of range.
    pub half_efficient: Option<f64>,
}

/// For every track with a fit of time and memory. `memory_mb` is that of the machine.
pub fn scaling(rows: &[Row], rates: &[Rates], memory_mb: Option<f64>) -> Vec<Scaling> {
    rates
        .iter()
        .filter_map(|r| {
            let (time, memory) = (r.seconds?, r.memory?);
            let track = rows.iter().filter(|row| {
                row.varied == Varied::Mesh && row.track() == (&r.scene, &r.engine, &r.method)
            });
            let mut track: Vec<&Row> = track.filter(|row| row.converged).collect();
            track.sort_by_key(|row| row.dofs);
            let finest = *track.last()?;
            let from_dofs = track[track.len().saturating_sub(COSTS)].dofs;
            let now = finest.memory_mb?;
            // A sublinear fit is start-up, and one above the exponent of a factorisation in 3D is noise.
            let p = time.exponent.clamp(1.0, 2.0);
            let q = memory.exponent.clamp(1.0, 4.0 / 3.0);
            let half = time.excludes(1.0).then(|| 2.0_f64.powf(1.0 / (p - 1.0)));
            let most = memory_mb.map(|all| finest.dofs as f64 * (all / now).max(1.0).powf(1.0 / q));
            let growth = |ranks: u32, exponent: f64| f64::from(ranks).powf(exponent - 1.0);
            Some(Scaling {
                scene: r.scene.clone(),
                engine: r.engine.clone(),
                method: r.method.clone(),
                from_dofs,
                dofs: finest.dofs,
                seconds: finest.seconds.median,
                memory_mb: now,
                most_dofs: most,
                most_seconds: most
                    .map(|most| finest.seconds.median * (most / finest.dofs as f64).powf(p)),
                rank_seconds: RANKS.map(|ranks| finest.seconds.median * growth(ranks, p)),
                rank_memory_mb: RANKS.map(|ranks| now * growth(ranks, q)),
                half_efficient: half.filter(|ranks| *ranks < OUT_OF_REACH),
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaigns::study::rates::rates;
    use crate::campaigns::study::row::sample;

    fn row(dofs: usize, seconds: f64, memory_mb: f64) -> Row {
        Row {
            dofs,
            memory_mb: Some(memory_mb),
            ..sample(Varied::Mesh, 0.1, seconds)
        }
    }

    /// Time like dofs^1.5 and memory like dofs: 100 times the memory holds 100 times the dofs in 1000 times the time, and the time
    /// of 4 ranks is twice that of one.
    #[test]
    fn powers_are_followed() {
        let of = |k: usize| row(1000 * k, (k as f64).powf(1.5), 10.0 * k as f64);
        let rows = [1, 2, 4, 8].map(of);
        let found = scaling(&rows, &rates(&rows), Some(8000.0));
        let [s] = &found[..] else { panic!("{found:?}") };
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9 * b;
        assert_eq!((s.dofs, s.memory_mb), (8000, 80.0));
        assert!(near(s.most_dofs.unwrap(), 800_000.0));
        assert!(near(s.most_seconds.unwrap(), 1000.0 * s.seconds));
        assert!(near(s.rank_seconds[0], 2.0 * s.seconds));
        assert!(near(s.rank_memory_mb[3], 80.0));
        assert!(near(s.half_efficient.unwrap(), 4.0));
    }

    /// Memory that seems to grow faster than that of any factorisation is noise.
    #[test]
    fn exponents_are_those_that_there_are() {
        let rows = [1, 2, 4, 8].map(|k| row(1000 * k, (k as f64).powf(0.5), (k * k) as f64));
        let found = scaling(&rows, &rates(&rows), None);
        assert_eq!(found[0].rank_seconds, [8.0_f64.sqrt(); 4]);
        let growth = found[0].rank_memory_mb[2] / found[0].memory_mb;
        assert!((growth - 4.0).abs() < 1e-9, "64 ranks: {growth}");
    }

    #[test]
    fn nothing_is_told_from_noise() {
        let rows = [(1, 0.031), (2, 0.024), (4, 0.035), (8, 0.022)];
        let rows = rows.map(|(k, seconds)| row(1000 * k, seconds, 10.0 * k as f64));
        let rates = rates(&rows);
        assert!(rates[0].seconds.is_none() && rates[0].memory.is_some());
        assert_eq!(scaling(&rows, &rates, Some(8000.0)), []);
    }

    #[test]
    fn linear_work_keeps_its_time_on_any_number_of_ranks() {
        let rows = [1, 2, 4, 8].map(|k| row(1000 * k, 0.5 + k as f64, 1.0 + k as f64));
        let found = scaling(&rows, &rates(&rows), None);
        assert_eq!(found[0].rank_seconds, [8.5; 4]);
        assert_eq!((found[0].half_efficient, found[0].most_dofs), (None, None));
    }
}
