//! The limit of differences on finer and finer meshes: the a of a + b·hᵖ + c·h^q, with an interval.
//!
//! An order is not enough to show that two results converge to each other: on the given meshes the error of either may still be
//! larger than the difference of the limits. Three levels determine a, b and c once p and q are chosen. p is the theoretical order, or
//! the lower of the last two observed ones if both are higher; q is any exponent from p + 1/2 upwards. The interval of a is the range over
//! these choices, together with that of a + b·hᵖ if a p above the order fits all three levels, and of √(a² + b²·h²ᵖ) if
//! observed orders are below the theoretical one.
//!
//! A norm is not negative, but an a below zero counts like one above: the norm of A + E·hᵖ also falls faster than hᵖ if E is opposite
//! to A. So a limit outside of ± bound is never called zero.

use serde::Serialize;

use super::fit::{between, power};
use crate::text::{Number, Text, text};

/// Without a given tolerance, the limit must be below this fraction of the finest difference. Smaller limits cannot be distinguished from those of right codes:
/// a limit orthogonal to the error that is 35 % of the finest difference lowers an order of 2 to 1.9. A limit of 5 % of the
/// coarsest difference is above the bound from the third mesh on at order 2 or higher, and from the fifth on at order 1, if
/// each mesh has half the h of the one before.
const PART: f64 = 0.4;
/// Differences below this fraction of the solution are rounding.
const ROUNDING: f64 = 1e-12;
/// A limit is stated if its interval is narrower than this fraction of its lower end.
const SETTLED: f64 = 0.25;
/// If the differences of two codes fall faster than theory by more than this, they may be about to change sign.
const LIKE: f64 = 0.25;
/// The next exponent in the expansion exceeds the order by at least this.
const NEXT: f64 = 0.5;

/// The conclusion about the limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Found {
    /// Zero, up to the bound.
    Zero,
    /// Not zero.
    Apart,
    /// Undecided on these meshes.
    Unknown,
}

/// The limit of a difference, or of an error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Limit {
    /// The conclusion.
    pub found: Found,
    /// The interval that contains a; `None` if there are too few levels.
    pub interval: Option<[f64; 2]>,
    /// a must be within ± this to be zero.
    pub bound: f64,
    /// Is the bound a given tolerance, rather than a fraction of the finest difference?
    pub is_given: bool,
    /// The norm of the solution on the finest mesh.
    pub scale: f64,
}

impl Limit {
    /// From differences (h, d), coarsest first, with the theoretical order. `rtol` is relative to `scale`. Two levels are enough only if
    /// `theory_holds`: then the order is assumed, as for the error of one code against the exact solution.
    pub fn new(
        levels: &[(f64, f64)],
        theory: f64,
        scale: f64,
        rtol: Option<f64>,
        theory_holds: bool,
    ) -> Option<Self> {
        let finest = levels.last()?.1;
        let bound = rtol.map_or(PART * finest, |rtol| rtol * scale);
        let of = |found, interval| Limit {
            found,
            interval,
            bound,
            is_given: rtol.is_some(),
            scale,
        };
        if !levels.iter().all(|(h, d)| *h > 0.0 && d.is_finite()) || !(theory > 0.0) {
            return Some(of(Found::Unknown, None));
        }
        if finest <= ROUNDING * scale {
            return Some(of(Found::Zero, Some([0.0, finest])));
        }
        let interval = match levels {
            [.., one, two, three] => interval([*one, *two, *three], theory),
            [one, two] => {
                let a = richardson([*one, *two], theory);
                // An order above the theoretical one leaves nothing.
                let found = match theory_holds && a <= bound || rtol.is_some() && finest <= bound {
                    true => Found::Zero,
                    false => Found::Unknown,
                };
                return Some(of(found, Some([a, a]).filter(|_| theory_holds)));
            }
            _ => return Some(of(Found::Unknown, None)),
        };
        let [low, high] = interval;
        let last = match levels {
            [.., two, three] => between([*two, *three]),
            _ => f64::NAN,
        };
        let found = match (low, high) {
            _ if !theory_holds && last > theory + LIKE => Found::Unknown,
            _ if !low.is_finite() || !high.is_finite() => Found::Unknown,
            _ if low >= -bound && high <= bound => Found::Zero,
            _ if low > bound && high - low <= SETTLED * low => Found::Apart,
            _ => Found::Unknown,
        };
        Some(of(found, Some(interval)))
    }

    /// A clause to follow the name of what converges, such as `the differences in L²`.
    pub fn words(&self) -> Text {
        let [at_most, at_least] =
            [Number::at_most, Number::at_least].map(|bound| move |x: f64| bound(x / self.scale, 2));
        let bound = at_most(self.bound);
        let of_what = match self.is_given {
            true => "the tolerance".to_owned(),
            false => format!("{PART} of that on the finest mesh"),
        };
        match (self.found, self.interval) {
            (Found::Zero, _) => text!(
                "converges to 0 as far as a limit of {} of it ({}) can be seen",
                bound,
                of_what
            ),
            (Found::Apart, Some([low, high])) => text!(
                "does not converge to 0 but to between {} and {} of it",
                at_least(low),
                at_most(high)
            ),
            (_, Some([low, high])) if low >= -self.bound && high <= self.bound => text!(
                "falls faster than theory on these meshes, as on the way through 0, and what it converges to cannot be told; \
                 add finer meshes"
            ),
            (_, Some([low, high])) if low < high => text!(
                "cannot be shown to converge to 0 on these meshes: its limit is between {} and {} of it, where {} ({}) is \
                 allowed; add finer meshes",
                at_least(low.max(0.0)),
                at_most(high.max(-low)),
                bound,
                of_what
            ),
            _ => {
                text!("cannot be shown to converge to 0 on so few meshes: it takes at least three")
            }
        }
    }
}

/// The a of a + b·hᵖ through two levels.
fn richardson([(h1, d1), (h2, d2)]: [(f64, f64); 2], p: f64) -> f64 {
    d2 - (d1 - d2) / ((h1 / h2).powf(p) - 1.0)
}

/// The a of a + b·hᵖ + c·h^q through three levels.
fn of_two_terms(levels: [(f64, f64); 3], p: f64, q: f64) -> f64 {
    let h = levels[0].0;
    let [x, y] = [p, q].map(|p| levels.map(|level| (level.0 / h).powf(p)));
    let d = levels.map(|level| level.1);
    let step = |of: [f64; 3], k: usize| of[k] - of[k + 1];
    let determinant = step(x, 0) * step(y, 1) - step(x, 1) * step(y, 0);
    let b = (step(d, 0) * step(y, 1) - step(d, 1) * step(y, 0)) / determinant;
    let c = (step(x, 0) * step(d, 1) - step(x, 1) * step(d, 0)) / determinant;
    d[2] - b * x[2] - c * y[2]
}

/// The p > `least` for which a + b·hᵖ fits all three levels.
fn exponent(levels: [(f64, f64); 3], least: f64) -> Option<f64> {
    let [(h1, d1), (h2, d2), (h3, d3)] = levels;
    let most = 4.0 * least + 4.0;
    let found = power([h1, h2, h3], (d1 - d2) / (d2 - d3), least, most)?;
    // At the end of the range nothing was found.
    Some(found).filter(|p| *p < most * (1.0 - 1e-12))
}

fn interval(levels: [(f64, f64); 3], theory: f64) -> [f64; 2] {
    let step = |k: usize| between([levels[k], levels[k + 1]]);
    let p = theory.max(step(0).min(step(1)));
    let fine = [levels[1], levels[2]];
    let next = [p + NEXT, p + 1.0, 2.0 * p + NEXT, 4.0 * p + NEXT];
    let ends = next.map(|q| of_two_terms(levels, p, q)).into_iter();
    let ends = ends.chain([richardson(fine, p)]);
    let ends = ends.chain(exponent(levels, p).map(|p| richardson(fine, p)));
    // If the limit is orthogonal to E, the squares have the terms 1 and h²ᵖ, and orders fall below the theoretical one.
    let falls = step(1) < step(0).min(theory);
    let square = richardson(fine.map(|(h, d)| (h, d * d)), 2.0 * theory);
    let ends = ends.chain(falls.then(|| square.max(0.0).sqrt()));
    ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], a| {
        // NaN is not skipped.
        match a.is_nan() {
            true => [f64::NEG_INFINITY, f64::INFINITY],
            false => [low.min(a), high.max(a)],
        }
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    const H: [f64; 5] = [1.0, 0.5, 0.25, 0.125, 0.0625];

    fn of(d: &[f64], theory: f64) -> Limit {
        let levels: Vec<(f64, f64)> = H.into_iter().zip(d.iter().copied()).collect();
        Limit::new(&levels, theory, 1.0, None, false).unwrap()
    }

    /// Differences that fall with these orders from 1.
    fn falling(steps: &[f64]) -> Vec<f64> {
        let mut all = vec![1.0];
        for step in steps {
            all.push(all[all.len() - 1] * 0.5_f64.powf(*step));
        }
        all
    }

    /// Numbers in [0, 1) from a seed.
    pub(in crate::run::convergence) fn random(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    /// Plane stress instead of plane strain, on n = 2, 4, …, 32; the right codes; the obstacle; a cantilever; orders from below.
    #[test]
    fn limits_of_observed_orders() {
        let stress = [2.08, 1.62, 0.52, 0.12];
        let found = [2, 3, 4].map(|k| of(&falling(&stress[..k]), 2.0));
        assert_eq!(found[0].found, Found::Unknown, "{:?}", found[0]);
        assert_eq!(found[1].found, Found::Apart, "{:?}", found[1]);
        let [low, high] = found[2].interval.unwrap();
        // The last difference is 0.0494.
        assert!(found[2].found == Found::Apart && low > 0.047 && high < 0.0494);
        // They fall faster than theory, which may be a change of sign.
        assert_eq!(of(&falling(&[2.46, 3.02]), 2.0).found, Found::Unknown);
        assert_eq!(of(&falling(&[3.0, 3.0]), 2.0).found, Found::Unknown);
        let right: [(&[f64], f64); 8] = [
            (&[2.0, 2.0], 2.0),
            (&[1.88, 2.2, 2.07], 2.0),
            (&[0.96, 0.98, 0.99], 1.0),
            (&[3.18, 3.06], 3.0),
            (&[3.3, 3.1], 3.0),
            (&[2.17, 1.97], 2.0),
            (&[1.7, 1.85], 2.0),
            (&[0.8, 0.9], 1.0),
        ];
        for (steps, theory) in right {
            let found = of(&falling(steps), theory);
            assert_eq!(found.found, Found::Zero, "{steps:?}: {found:?}");
        }
    }

    #[test]
    fn too_few_levels_and_rounding() {
        assert_eq!(of(&falling(&[2.0]), 2.0).found, Found::Unknown);
        assert_eq!(of(&[1.0], 2.0).found, Found::Unknown);
        let exact = Limit::new(&[(1.0, 1.0), (0.5, 0.24)], 2.0, 1.0, None, true).unwrap();
        assert_eq!(exact.found, Found::Zero);
        let level = Limit::new(&[(1.0, 1.0), (0.5, 0.6)], 2.0, 1.0, None, true).unwrap();
        assert_eq!(level.found, Found::Unknown);
        assert_eq!(of(&[3e-14, 1e-14, 6e-14], 2.0).found, Found::Zero);
        assert_eq!(of(&[1.0, f64::NAN, 0.1], 2.0).found, Found::Unknown);
        assert_eq!(of(&[1.0, 0.5, 0.5], 2.0).found, Found::Apart);
        let given = Limit::new(&[(1.0, 1.0), (0.5, 1e-3)], 2.0, 1.0, Some(1e-2), false).unwrap();
        assert_eq!(given.found, Found::Zero);
    }

    /// The former rule: the fit over all levels is at most 0.25 below theory.
    fn fit_reaches(d: &[f64], theory: f64) -> bool {
        let levels: Vec<(f64, f64)> = H.into_iter().zip(d.iter().copied()).collect();
        super::super::Fit::new(&levels).is_some_and(|fit| fit.exponent >= theory - 0.25)
    }

    /// Differences with a known limit, by the expansion and as the norm of a sum at any angle, with a next term of either
    /// sign. By the expansion no limit above the bound is called zero. For norms a few are, where the error is opposite
    /// to the limit and they cancel on the finest mesh. Most limits that are 0 are called zero, and none is called nonzero.
    #[test]
    fn no_limit_above_the_bound_is_called_zero() {
        let mut random = random(7);
        let (mut missed, mut passed_before, mut zero, mut apart_of_right, mut apart) =
            (0, 0, 0, 0, 0);
        let draws = 4000;
        for draw in 0..draws {
            let p = [1.0, 2.0, 3.0][draw % 3];
            let count = [3, 4, 5][draw / 3 % 3];
            let q = p + 0.5 + random() * (p + 0.5);
            let c = 0.8 * (2.0 * random() - 1.0);
            let is_norm = draw % 2 == 0;
            let angle = 2.0 * random() - 1.0;
            let sample = |a: f64| -> Vec<f64> {
                let d = H[..count].iter().map(|h| {
                    let e = h.powf(p) * (1.0 + c * h.powf(q - p));
                    match is_norm {
                        true => (a * a + 2.0 * angle * a * e + e * e).sqrt(),
                        false => a + e,
                    }
                });
                d.collect()
            };
            let right = of(&sample(0.0), p);
            zero += usize::from(right.found == Found::Zero);
            apart_of_right += usize::from(right.found == Found::Apart);
            let a = 0.05 + 0.1 * random();
            let d = sample(a);
            let found = of(&d, p);
            apart += usize::from(found.found == Found::Apart);
            let told = format!("p {p} q {q} c {c} a {a} angle {angle}: {d:?} {found:?}");
            let is_zero = found.found == Found::Zero && fit_reaches(&d, p);
            if is_zero && a > PART * d[count - 1] {
                assert!(is_norm && angle < 0.0, "{told}");
                missed += 1;
            }
            passed_before += usize::from(fit_reaches(&d, p) && a > PART * d[count - 1]);
        }
        assert!(missed < draws * 2 / 100, "{missed}");
        assert!(passed_before > draws * 14 / 100, "{passed_before}");
        assert_eq!(apart_of_right, 0);
        assert!(zero > draws * 9 / 10, "{zero} of {draws}");
        assert!(apart > draws * 4 / 10, "{apart} of {draws}");
    }
}
