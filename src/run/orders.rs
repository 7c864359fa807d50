//! Exponents of what was measured: between neighbours, and by least squares in logarithms with their spread.

use serde::Serialize;

use faceoff_mesh::error::{Error, Result};

/// Fits are over the last so many: coarser ones are not asymptotic.
const FINEST: usize = 3;

/// y ≈ constant · x^exponent
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Fit {
    /// The order, where x is h and y an error.
    pub exponent: f64,
    /// y at x = 1.
    pub constant: f64,
    /// Standard error of the exponent; none of two points.
    pub spread: Option<f64>,
    /// How many it is the fit of.
    pub points: usize,
}

/// Student's t for 95 % on both sides, by degrees of freedom from 1; about 2 beyond.
const STUDENT: [f64; 10] = [
    12.71, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228,
];

impl Fit {
    /// Does the interval of 95 % about the exponent leave out a value? Two points leave out none.
    pub fn excludes(&self, exponent: f64) -> bool {
        let degrees = self.points.saturating_sub(2);
        let t = degrees
            .checked_sub(1)
            .map(|k| STUDENT.get(k).unwrap_or(&2.2));
        let half = t.zip(self.spread).map(|(t, spread)| t * spread);
        half.is_some_and(|half| (self.exponent - exponent).abs() > half)
    }

    /// Over the last three points (x, y), or two.
    pub fn of_finest(points: &[(f64, f64)]) -> Option<Self> {
        Fit::new(&points[points.len().saturating_sub(FINEST)..])
    }

    /// Over all points (x, y) that have logarithms; none of fewer than two.
    pub fn new(points: &[(f64, f64)]) -> Option<Self> {
        let logs: Vec<(f64, f64)> = points
            .iter()
            .filter(|(x, y)| *x > 0.0 && *y > 0.0 && y.is_finite())
            .map(|(x, y)| (x.ln(), y.ln()))
            .collect();
        if logs.len() < 2 {
            return None;
        }
        let count = logs.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / count;
        let (x, y) = (mean(|p| p.0), mean(|p| p.1));
        let xx: f64 = logs.iter().map(|p| (p.0 - x).powi(2)).sum();
        let xy: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
        let exponent = xy / xx;
        let left = logs
            .iter()
            .map(|p| (p.1 - y - exponent * (p.0 - x)).powi(2));
        let left: f64 = left.sum();
        (xx > 0.0).then(|| Fit {
            exponent,
            constant: (y - exponent * x).exp(),
            spread: (logs.len() > 2).then(|| (left / (count - 2.0) / xx).sqrt()),
            points: logs.len(),
        })
    }
}

/// Orders of convergence that were observed.
#[derive(Debug, Clone, Serialize)]
pub struct Observed {
    /// Between each mesh and the next. Where a transition lies in its cell changes from mesh to mesh, and these with it.
    pub steps: Vec<f64>,
    /// By least squares over the last three meshes, or two; none of fewer.
    pub fit: Option<f64>,
}

impl Observed {
    /// From the errors at ascending n.
    pub fn new(errors: &[(usize, f64)]) -> Self {
        let points: Vec<_> = errors.iter().map(|&(n, e)| (n as f64, e)).collect();
        Observed {
            steps: observed_orders(errors),
            fit: Fit::of_finest(&points).map(|fit| -fit.exponent),
        }
    }
}

/// ln(eₖ/eₖ₊₁) / ln(nₖ₊₁/nₖ) of errors at ascending n.
pub fn observed_orders(errors: &[(usize, f64)]) -> Vec<f64> {
    let order = |pair: &[(usize, f64)]| {
        let [(n0, e0), (n1, e1)] = [pair[0], pair[1]];
        (e0 / e1).ln() / (n1 as f64 / n0 as f64).ln()
    };
    errors.windows(2).map(order).collect()
}

/// Refuses meshes that give no order.
///
/// # Errors
/// One mesh alone, or meshes that do not rise.
pub fn check_meshes(n: &[usize]) -> Result<()> {
    if n.len() < 2 {
        return Err(Error::usage(
            "one mesh alone has no order of convergence",
            "give at least two, three for a fit, as in --n 16,32,64",
        ));
    }
    if !n.windows(2).all(|pair| pair[0] < pair[1]) {
        let list: Vec<String> = n.iter().map(ToString::to_string).collect();
        return Err(Error::usage(
            format!("the meshes n = {} do not rise", list.join(", ")),
            "give each once, the coarsest first",
        ));
    }
    Ok(())
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
        assert!((fit.exponent - 1.5).abs() < 1e-14 && fit.spread.unwrap() < 1e-14);
        assert!((fit.constant - 3.0).abs() < 1e-13);
        // ln y = 0, 1, 0 over ln x = -1, 0, 1: slope 0, residuals -1/3, 2/3, -1/3.
        let e = std::f64::consts::E;
        let fit = Fit::new(&[(1.0 / e, 1.0), (1.0, e), (e, 1.0)]).unwrap();
        assert!(fit.exponent.abs() < 1e-14);
        assert!((fit.spread.unwrap() - (2.0_f64 / 3.0 / 2.0).sqrt()).abs() < 1e-14);
        assert_eq!(Fit::new(&exact[..2]).unwrap().spread, None);
        assert_eq!(Fit::new(&exact[..1]), None);
    }
}
