//! Bounds as people read them: rounded outward to a few digits, since a bound that is rounded to the nearest may not be a bound any more.

use super::number::number;

/// The number of digits.
#[derive(Clone, Copy)]
pub enum Digits {
    /// Significant digits.
    Counting(usize),
    /// Decimals.
    Decimals(usize),
}

/// The least decimal with these digits that is not below the value; as a double, which shows as that decimal.
pub fn above(value: f64, digits: Digits) -> f64 {
    -below(-value, digits)
}

/// The largest decimal with these digits that is not above the value.
pub fn below(value: f64, digits: Digits) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    // All digits of a double.
    let text = format!("{:.1074}", value.abs());
    let (whole, decimals) = text.split_once('.').unwrap_or((&text, ""));
    let all: Vec<u8> = whole.bytes().chain(decimals.bytes()).collect();
    let first = all.iter().position(|digit| *digit != b'0').unwrap_or(0);
    let kept = match digits {
        Digits::Counting(count) => first + count,
        Digits::Decimals(count) => whole.len() + count,
    };
    let (kept, rest) = all.split_at(kept.min(all.len()));
    let mut digits: Vec<u8> = kept.iter().map(|digit| digit - b'0').collect();
    if value < 0.0 && rest.iter().any(|digit| *digit != b'0') {
        let nines = digits.iter().rev().take_while(|digit| **digit == 9).count();
        let at = digits.len() - nines;
        digits[at..].fill(0);
        match at.checked_sub(1) {
            Some(last) => digits[last] += 1,
            None => digits.insert(0, 1),
        }
    }
    let power = whole.len() as i64 - kept.len() as i64;
    let digits: String = digits
        .into_iter()
        .map(|digit| char::from(b'0' + digit))
        .collect();
    // Digits and a power are a number; beyond all doubles it is infinite, which is a bound still.
    let size: f64 = format!("{digits}e{power}").parse().unwrap_or(f64::INFINITY);
    size.copysign(value)
}

/// An upper bound with a given number of significant digits, rounded up.
pub fn at_most(bound: f64, digits: usize) -> String {
    number(above(bound, Digits::Counting(digits)), digits)
}

/// A lower bound with a given number of significant digits, rounded down.
pub fn at_least(bound: f64, digits: usize) -> String {
    number(below(bound, Digits::Counting(digits)), digits)
}

/// `[…, …]`, with a given number of significant digits, rounded outward.
pub fn interval([low, high]: [f64; 2], digits: usize) -> String {
    format!("[{}, {}]", at_least(low, digits), at_most(high, digits))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        // The same values on every day.
        #![proptest_config(ProptestConfig {
            failure_persistence: None,
            rng_seed: proptest::test_runner::RngSeed::Fixed(2017),
            ..ProptestConfig::default()
        })]
        #[test]
        fn what_is_shown_is_a_bound(value in proptest::num::f64::NORMAL | proptest::num::f64::SUBNORMAL, count in 1_usize..12) {
            let [low, high] = [below, above].map(|of| of(value, Digits::Counting(count)));
            prop_assert!(low <= value && value <= high);
            let unit = 10_f64.powf(value.abs().log10().floor() + 1.0 - count as f64);
            // Doubles below the least normal one have fewer digits.
            let unit = unit + f64::from_bits(2);
            prop_assert!(!(high - low > 1.001 * unit) || high.is_infinite() || low.is_infinite());
            // The digits that are shown are these numbers.
            let shown = |x: f64| format!("{x:.*e}", count - 1).parse::<f64>();
            prop_assert_eq!([shown(low), shown(high)], [Ok(low), Ok(high)]);
        }

        #[test]
        fn decimals_are_bounds(value in -1e4..1e4_f64, count in 0_usize..8) {
            let [low, high] = [below, above].map(|of| of(value, Digits::Decimals(count)));
            prop_assert!(low <= value && value <= high && high - low <= 1.001 * 0.1_f64.powi(count as i32));
            let shown = |x: f64| format!("{x:.count$}").parse::<f64>();
            prop_assert_eq!([shown(low), shown(high)], [Ok(low), Ok(high)]);
        }
    }

    #[test]
    fn decimals_are_not_moved() {
        for value in [0.0, 0.5, -0.25, 1024.0, 9.0] {
            let both = [below, above].map(|of| of(value, Digits::Counting(4)));
            assert_eq!(both, [value; 2]);
        }
        // 0.1 as a double is above 0.1.
        assert_eq!(interval([0.1, 0.1], 4), "[0.1000, 0.1001]");
        assert_eq!(interval([-0.1, 9.9999], 4), "[−0.1001, 10.00]");
        assert_eq!(above(1e-9, Digits::Decimals(4)), 1e-4);
        assert_eq!(below(1e-9, Digits::Decimals(4)), 0.0);
        assert_eq!(above(0.99999, Digits::Decimals(2)), 1.0);
    }
}
