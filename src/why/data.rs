//! The one number by which the data, or u itself, would have to be changed.

use super::candidates::term_of;
use super::search::Search;
use super::{Aspect, Explanation, Rank};
use crate::run::{Datum, Variation};
use crate::text::{Number, Text, text};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;

/// The residual is linear in the data while no status changes: few steps come to rest.
const STEPS: usize = 8;
/// A number that takes away less than this part of the residual in its first step explains nothing.
const WORTH: f64 = 0.3;

/// A number of the scheme: what it is usually, and the residuals with another.
struct Unknown<'a> {
    usual: f64,
    /// Of the difference quotient.
    step: f64,
    residual: &'a dyn Fn(f64) -> Option<Vec<f64>>,
}

/// Every datum times a number or with one added, and u times a number.
///
/// # Errors
/// An interruption.
pub(super) fn fits(search: &Search) -> Result<Vec<Explanation>> {
    let setup = search.setup;
    let data = setup.scene.data();
    let size = search.u.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
    let size = if size > 0.0 { size } else { 1.0 };
    let mut found = Vec::new();
    let is_homogeneous = [Datum::G, Datum::Psi].iter().all(|d| d.of(data).is_zero());
    for datum in Datum::ALL {
        let name = datum.name();
        let or_u = match datum {
            Datum::F if is_homogeneous && data.t.is_zero() => " (or u as a whole)",
            _ => "",
        };
        let scaled = |value: f64| Variation::Scaled(datum, value);
        let shifted = |value: f64| Variation::Shifted(datum, value);
        let change: [&dyn Fn(f64) -> Variation; 2] = [&scaled, &shifted];
        for (variation, (usual, step)) in change.into_iter().zip([(1.0, 1e-3), (0.0, 1e-3 * size)])
        {
            cancel::check()?;
            if usual == 1.0 && datum.of(data).is_zero() {
                continue;
            }
            let residual = |value: f64| search.residual_with(&variation(value));
            let number = Unknown {
                usual,
                step,
                residual: &residual,
            };
            let Some(value) = fit(search, &number) else {
                continue;
            };
            let Some(left) = search.left_with(&variation(value)) else {
                continue;
            };
            let (what, factor) = match usual {
                1.0 => (text!("{} is {}{}", name, times(value), or_u), Some(value)),
                _ => {
                    let size = if value > 0.0 {
                        "too large"
                    } else {
                        "too small"
                    };
                    let value = Number::power(rounded(value.abs()));
                    (text!("{} is {} {}", name, value, size), None)
                }
            };
            found.push(Explanation {
                term: Some(term_of(datum)),
                factor,
                ..Explanation::new(Aspect::Datum(datum), what, Rank::Number, left)
            });
        }
    }
    // For g = ψ = 0 a positive factor of u is one of f.
    let signs: &[f64] = if is_homogeneous {
        &[-1.0]
    } else {
        &[1.0, -1.0]
    };
    found.extend(whole(search, signs));
    Ok(found)
}

/// u times a number, by which it is divided to see.
fn whole(search: &Search, signs: &[f64]) -> Option<Explanation> {
    let scaled = |by: f64| search.u.iter().map(|u| by * u).collect::<Vec<f64>>();
    let residual = |by: f64| Some(search.problem.residual(&scaled(by)));
    let signs = signs.iter().filter_map(|usual| {
        let number = Unknown {
            usual: *usual,
            step: 1e-3,
            residual: &residual,
        };
        let by = fit(search, &number)?;
        Some((search.problem.backward_error(&scaled(by)).0, by))
    });
    let (left, by) = signs.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let what = text!("u is {} as a whole", times(1.0 / by));
    Some(Explanation {
        factor: Some(1.0 / by),
        ..Explanation::new(Aspect::U, what, Rank::Number, left)
    })
}

/// The number with the smallest residual, by Gauss and Newton with differences; none where it explains nothing.
fn fit(search: &Search, number: &Unknown) -> Option<f64> {
    let weighted = |value: f64| -> Option<Vec<f64>> {
        let residual = (number.residual)(value)?;
        Some(search.weighted(&residual))
    };
    let norm = |r: &[f64]| r.iter().map(|r| r * r).sum::<f64>().sqrt();
    let (mut value, mut here) = (number.usual, weighted(number.usual)?);
    let first = norm(&search.weighted(&search.rows.residual));
    let mut best = (norm(&here), value);
    for step in 0..STEPS {
        let beside = weighted(value + number.step)?;
        let (mut above, mut below) = (0.0, 0.0);
        for (here, beside) in here.iter().zip(&beside) {
            let slope = (beside - here) / number.step;
            above -= slope * here;
            below += slope * slope;
        }
        let change = above / below;
        if !change.is_finite() || change == 0.0 {
            break;
        }
        value += change;
        here = weighted(value)?;
        let left = norm(&here);
        if !(left < best.0) {
            break;
        }
        best = (left, value);
        if step == 0 && !(left <= WORTH * first) {
            break;
        }
    }
    (best.0 <= WORTH * first).then_some(best.1)
}

/// `× 1.00100`: three digits of what it is more or less than 1.
pub(super) fn times(factor: f64) -> Text {
    let off = (factor - 1.0).abs();
    let number = match off {
        _ if !(0.1..1e6).contains(&factor.abs()) => Number::new(factor, 7),
        off if off < 1e-11 => Number::fixed(1.0, 0),
        _ => {
            // 0.000999999 has its digits where 0.001 has them.
            let power = (off * (1.0 + 1e-6)).log10().floor();
            let digits = (2.0 - power).clamp(3.0, 14.0) as usize;
            Number::fixed(factor, digits)
        }
    };
    text!("× {}", number)
}

/// With four digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_have_three_digits_of_their_own() {
        let factors = [1.000_999_999_9, 1.01, 1.000_001, 2.0, -1.0, 77.0, 1e-8];
        let words = factors.map(|factor| times(factor).to_string());
        let expected = [
            "× 1.00100",
            "× 1.0100",
            "× 1.00000100",
            "× 2.000",
            "× -1.000",
            "× 77.000",
            "× 1.000000e-8",
        ];
        assert_eq!(words, expected);
        let rounded = [1e-6, 0.25].map(|value| Number::power(rounded(value)).to_string());
        assert_eq!(rounded, ["1e-6", "2.5e-1"]);
    }
}
