//! Observed exponents: between neighbours, and by least squares in logarithms with a confidence interval.

use serde::Serialize;

use faceoff_mesh::error::{Error, Result};

/// The number of finest levels in a fit: coarser ones are not asymptotic.
const FINEST: usize = 3;

/// y ≈ constant · x^exponent
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Fit {
    /// The order, if x is h and y an error.
    pub exponent: f64,
    /// y at x = 1.
    pub constant: f64,
    /// Standard error of the exponent; `None` for two points.
    pub spread: Option<f64>,
    /// The number of points in the fit.
    pub points: usize,
}

/// Student's t at 97.5 %, for 1, 2, … degrees of freedom; the last value is an upper bound beyond.
const STUDENT: [f64; 10] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228,
];

impl Fit {
    /// Half of the 95 % confidence interval of the exponent, if the logarithms scatter about a line independently; `None` for
    /// fewer than three points.
    pub fn room(&self) -> Option<f64> {
        // For three points and more, since there is a spread.
        let degrees = self.points.saturating_sub(3).min(STUDENT.len() - 1);
        Some(STUDENT[degrees] * self.spread?)
    }

    /// Does that interval exclude a value? With two points it excludes none.
    pub fn excludes(&self, exponent: f64) -> bool {
        let room = self.room();
        room.is_some_and(|room| (self.exponent - exponent).abs() > room)
    }

    /// Over the last three points (x, y), or two.
    pub fn of_finest(points: &[(f64, f64)]) -> Option<Self> {
        Fit::new(&points[points.len().saturating_sub(FINEST)..])
    }

    /// Over all points (x, y) that have logarithms; `None` if there are fewer than two.
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

/// The exponent between two points (x, y).
pub(super) fn between([(x, y), (z, w)]: [(f64, f64); 2]) -> f64 {
    (y / w).ln() / (x / z).ln()
}

/// The p in an interval with hᵖ - iᵖ = ratio (iᵖ - jᵖ), for h > i > j; its upper end if no p in it is large enough, and `None` if
/// all are too large or the ratio is not a number.
pub(super) fn power([h, i, j]: [f64; 3], ratio: f64, least: f64, most: f64) -> Option<f64> {
    let of = |p: f64| ((h / j).powf(p) - (i / j).powf(p)) / ((i / j).powf(p) - 1.0);
    let (mut low, mut high) = (least, most);
    if !(ratio >= of(low)) {
        return None;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if of(middle) < ratio {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(low)
}

/// An order of convergence in h.
#[derive(Debug, Serialize)]
pub struct Order {
    /// Between each mesh and the next.
    pub steps: Vec<f64>,
    /// By least squares over all meshes.
    pub fit: Option<Fit>,
    /// Half of the 95 % confidence interval of the order, if the errors scatter about a power of h independently; `None` for
    /// fewer than three errors.
    pub interval: Option<[f64; 2]>,
}

impl Order {
    /// From errors at decreasing h.
    pub fn new(errors: &[(f64, f64)]) -> Self {
        let fit = Fit::new(errors);
        let about = |fit: Fit| {
            fit.room()
                .map(|room| [fit.exponent - room, fit.exponent + room])
        };
        Order {
            steps: errors
                .windows(2)
                .map(|of| between([of[0], of[1]]))
                .collect(),
            fit,
            interval: fit.and_then(about),
        }
    }
}

/// Observed orders of convergence on meshes of n = 16, 32, ….
#[derive(Debug, Clone, Serialize)]
pub struct Observed {
    /// Between each mesh and the next. The position of a transition in its cell changes from mesh to mesh, and these orders with it.
    pub steps: Vec<f64>,
    /// By least squares over the last three meshes, or two; `None` for fewer.
    pub fit: Option<f64>,
}

impl Observed {
    /// From the errors at ascending n.
    pub fn new(errors: impl IntoIterator<Item = (usize, f64)>) -> Self {
        let errors = errors.into_iter().map(|(n, e)| (n as f64, e));
        let errors: Vec<(f64, f64)> = errors.collect();
        // ln(eₖ/eₖ₊₁) / ln(nₖ₊₁/nₖ)
        let step = |of: &[(f64, f64)]| between([(of[1].0, of[0].1), (of[0].0, of[1].1)]);
        Observed {
            steps: errors.windows(2).map(step).collect(),
            fit: Fit::of_finest(&errors).map(|fit| -fit.exponent),
        }
    }
}

/// Refuses meshes that do not give an order.
///
/// # Errors
/// A single mesh, or meshes that do not become finer.
pub fn check_meshes(n: &[usize]) -> Result<()> {
    if n.len() < 2 {
        return Err(Error::usage(
            "a single mesh has no order of convergence",
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

    #[test]
    fn orders_and_their_intervals() {
        let of = |errors: [f64; 4]| {
            let h = [0.5, 0.25, 0.125, 0.0625];
            Order::new(&[0, 1, 2, 3].map(|k| (h[k], errors[k])))
        };
        let exact = of([4.0, 1.0, 0.25, 0.0625]);
        assert_eq!(exact.steps, [2.0; 3]);
        let [low, high] = exact.interval.unwrap();
        assert!(low <= 2.0 && high >= 2.0 && high - low < 1e-12);
        // ln e = (0, -1, -1, -2) ln 2 over ln h = (0, -1, -2, -3) ln 2: slope 0.6, squares left 0.2 over 2 · 5.
        let scattered = of([1.0, 0.5, 0.5, 0.25]);
        let [low, high] = scattered.interval.unwrap();
        let room = 4.303 * (0.2_f64 / 2.0 / 5.0).sqrt();
        assert!((low - (0.6 - room)).abs() < 1e-12 && (high - (0.6 + room)).abs() < 1e-12);
        assert!(Order::new(&[(0.5, 1.0), (0.25, 0.5)]).interval.is_none());
    }
}
