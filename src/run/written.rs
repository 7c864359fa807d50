//! The precision of numbers in a file, which bounds the residual from below.

use serde::Serialize;

/// The number of digits that all of some numbers have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Written {
    /// All digits of binary64, as far as can be seen.
    Binary64,
    /// Those of binary32.
    Binary32,
    /// This number of decimal digits.
    Digits(usize),
}

/// Results are not written with fewer digits, and more are equivalent to all.
const DECIMALS: std::ops::RangeInclusive<usize> = 3..=14;
/// Numbers with this many digits may be binary32 as well.
const COARSE: usize = 6;
/// Fewer numbers than this are not conclusive.
const TELLING: usize = 4;

impl Written {
    /// The smallest number of digits that represents all of these, if half of those that are not 0 need it.
    pub fn of(values: &[f64]) -> Self {
        let values = || values.iter().copied().filter(|x| *x != 0.0);
        let all = |has: &dyn Fn(f64) -> bool| values().all(has);
        let are_needed = |fewer: &dyn Fn(f64) -> bool| {
            let need = values().filter(|x| !fewer(*x) && !is_simple(*x)).count();
            need >= TELLING && 2 * need >= values().count()
        };
        let decimal = |digits: usize| all(&|x| has_digits(x, digits));
        let digits = DECIMALS.into_iter().find(|digits| decimal(*digits));
        match digits {
            Some(digits) if digits <= COARSE => {
                // Some numbers end in 0 by chance.
                match are_needed(&|x| has_digits(x, digits.saturating_sub(2))) {
                    true => Written::Digits(digits),
                    false => Written::Binary64,
                }
            }
            _ if all(&is_binary32) && are_needed(&|x| has_digits(x, COARSE)) => Written::Binary32,
            Some(digits) if are_needed(&|x| has_digits(x, digits - 2)) => Written::Digits(digits),
            _ => Written::Binary64,
        }
    }

    /// The relative error of a number.
    pub fn unit(self) -> f64 {
        match self {
            Written::Binary64 => 0.5 * f64::EPSILON,
            Written::Binary32 => 0.5 * f64::from(f32::EPSILON),
            Written::Digits(digits) => 0.5 * 10f64.powi(1 - digits as i32),
        }
    }

    /// As the end of a sentence: `with 6 digits`.
    pub fn words(self) -> String {
        match self {
            Written::Binary64 => "with all digits".into(),
            Written::Binary32 => "as binary32 (float)".into(),
            Written::Digits(digits) => format!("with {digits} digits"),
        }
    }
}

/// Multiples of a power of two with about a dozen bits have few digits, and were not rounded.
fn is_simple(x: f64) -> bool {
    x.to_bits().trailing_zeros() >= 37
}

fn has_digits(x: f64, digits: usize) -> bool {
    let text = format!("{x:.*e}", digits.saturating_sub(1));
    text.parse() == Ok(x)
}

/// Also if the binary32 was written with the fewest decimals that identify it.
fn is_binary32(x: f64) -> bool {
    let rounded = x as f32;
    f64::from(rounded) == x || format!("{rounded:e}").parse() == Ok(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_counted() {
        let full: Vec<f64> = (1..50).map(|k| f64::from(k).sqrt().sin()).collect();
        assert_eq!(Written::of(&full), Written::Binary64);
        let single: Vec<f64> = full.iter().map(|x| f64::from(*x as f32)).collect();
        assert_eq!(Written::of(&single), Written::Binary32);
        let shortest = |x: &f64| (*x as f32).to_string().parse().unwrap();
        let shortest: Vec<f64> = full.iter().map(shortest).collect();
        assert_eq!(Written::of(&shortest), Written::Binary32);
        for digits in [4, 6, 10, 12] {
            let of = |x: &f64| format!("{x:.*e}", digits - 1).parse().unwrap();
            let rounded: Vec<f64> = full.iter().map(of).collect();
            assert_eq!(Written::of(&rounded), Written::Digits(digits));
        }
        // Numbers with an exact short form were not rounded.
        let of = |parts: f64| (1..40).map(|k| f64::from(k) / parts).collect::<Vec<f64>>();
        let (of_32, of_256) = (of(32.0), of(256.0));
        for simple in [
            &[0.0; 9][..],
            &[0.5, 0.25, 1.0, 2.0, 0.0],
            &[],
            &of_32,
            &of_256,
        ] {
            assert_eq!(Written::of(simple), Written::Binary64);
        }
    }
}
