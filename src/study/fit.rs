//! Exponents of what was measured, by least squares in logarithms, with their spread.

use serde::Serialize;

use super::row::{Row, Varied};

/// Rows from the finest mesh back that enter a fit: coarser ones are not asymptotic yet.
const FINEST: usize = 4;

/// An exponent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Fit {
    pub exponent: f64,
    /// y at x = 1.
    pub constant: f64,
    /// The standard error of the exponent: what the points' scatter about the line leaves open.
    pub spread: f64,
    pub points: usize,
}

impl Fit {
    /// y ~ x^exponent through points with x, y > 0, at least three of them.
    pub fn new(points: &[(f64, f64)]) -> Option<Self> {
        let logs: Vec<(f64, f64)> = points
            .iter()
            .filter(|(x, y)| *x > 0.0 && *y > 0.0 && y.is_finite())
            .map(|(x, y)| (x.ln(), y.ln()))
            .collect();
        if logs.len() < 3 {
            return None;
        }
        let count = logs.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / count;
        let (x, y) = (mean(|p| p.0), mean(|p| p.1));
        let xx: f64 = logs.iter().map(|p| (p.0 - x).powi(2)).sum();
        let xy: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
        let exponent = xy / xx;
        let left: f64 = logs
            .iter()
            .map(|p| (p.1 - y - exponent * (p.0 - x)).powi(2))
            .sum();
        (xx > 0.0).then(|| Fit {
            exponent,
            constant: (y - exponent * x).exp(),
            spread: (left / (count - 2.0) / xx).sqrt(),
            points: logs.len(),
        })
    }
}

/// How errors, time and memory of one engine and method change with the mesh.
#[derive(Debug, Clone, Serialize)]
pub struct Rates {
    pub scene: String,
    pub engine: String,
    pub method: String,
    /// Errors over 1/n.
    pub h1: Option<Fit>,
    pub l2: Option<Fit>,
    /// Over the number of dofs.
    pub seconds: Option<Fit>,
    pub memory: Option<Fit>,
}

/// The rates of every track over its uniform meshes.
pub fn rates(rows: &[Row]) -> Vec<Rates> {
    let mut found: Vec<Rates> = Vec::new();
    for row in rows.iter().filter(|row| row.varied == Varied::Mesh) {
        if found
            .iter()
            .any(|r| (&*r.scene, &*r.engine, &*r.method) == row.track())
        {
            continue;
        }
        let track: Vec<&Row> = rows
            .iter()
            .filter(|r| r.varied == Varied::Mesh && r.track() == row.track() && r.converged)
            .collect();
        let last = &track[track.len().saturating_sub(FINEST)..];
        let over = |x: fn(&Row) -> Option<f64>, y: fn(&Row) -> Option<f64>| {
            let points = last.iter().filter_map(|r| Some((x(r)?, y(r)?)));
            Fit::new(&points.collect::<Vec<_>>())
        };
        let h: fn(&Row) -> Option<f64> = |r| Some(1.0 / r.n? as f64);
        let dofs: fn(&Row) -> Option<f64> = |r| Some(r.dofs as f64);
        found.push(Rates {
            scene: row.scene.clone(),
            engine: row.engine.clone(),
            method: row.method.clone(),
            h1: over(h, |r| r.h1.or(r.certified)),
            l2: over(h, |r| r.l2),
            seconds: over(dofs, |r| Some(r.seconds.median)),
            memory: over(dofs, |r| r.memory_mb),
        });
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_and_their_spread() {
        let exact: Vec<_> = [1.0, 2.0, 4.0, 8.0]
            .map(|x: f64| (x, 3.0 * x.powf(1.5)))
            .to_vec();
        let fit = Fit::new(&exact).unwrap();
        assert!((fit.exponent - 1.5).abs() < 1e-14 && fit.spread < 1e-14);
        assert!((fit.constant - 3.0).abs() < 1e-13);
        // ln y = 0, 1, 0 over ln x = -1, 0, 1: slope 0, residuals -1/3, 2/3, -1/3.
        let e = std::f64::consts::E;
        let fit = Fit::new(&[(1.0 / e, 1.0), (1.0, e), (e, 1.0)]).unwrap();
        assert!(fit.exponent.abs() < 1e-14);
        assert!((fit.spread - (2.0_f64 / 3.0 / 2.0).sqrt()).abs() < 1e-14);
        assert_eq!(Fit::new(&exact[..2]), None);
    }
}
