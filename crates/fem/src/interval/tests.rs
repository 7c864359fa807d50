//! Intervals hold what they should, against another library with 77 digits among others.

use super::*;
use crate::sixty_digits::Big;
use proptest::prelude::*;

/// Numbers of all sizes, zeros, small integers and ends of the range among them.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        3 => -10.0..10.0,
        2 => (any::<i8>()).prop_map(f64::from),
        1 => Just(0.0),
        1 => (-300i32..300, -1.0..1.0).prop_map(|(k, m)| m * 10f64.powi(k)),
    ]
}

fn interval() -> impl Strategy<Value = Interval> {
    (number(), number(), any::<bool>()).prop_map(|(a, b, point)| {
        if point {
            Interval::at(a)
        } else {
            Interval::new(a.min(b), a.max(b))
        }
    })
}

/// Some numbers of an interval, its ends among them.
fn inside(of: Interval) -> Vec<f64> {
    let at = |s: f64| (of.low * (1.0 - s) + of.high * s).clamp(of.low, of.high);
    [0.0, 0.1, 0.35, 0.5, 0.8, 1.0].map(at).to_vec()
}

proptest! {
    #![proptest_config(crate::test_config(4000))]

    #[test]
    fn results_are_inside(a in interval(), b in interval()) {
        for x in inside(a) {
            for y in inside(b) {
                for (name, of, value) in [
                    ("+", a + b, x + y),
                    ("-", a - b, x - y),
                    ("*", a * b, x * y),
                    ("/", a / b, x / y),
                    ("min", a.min(b), x.min(y)),
                    ("max", a.max(b), x.max(y)),
                    ("atan2", a.atan2(b), x.atan2(y)),
                ] {
                    prop_assert!(value.is_nan() || of.contains(value), "{x} {name} {y} = {value}, {of:?}");
                }
            }
            for (name, of, value) in [
                ("sin", a.sin(), core_math::sin(x)),
                ("cos", a.cos(), core_math::cos(x)),
                ("tan", a.tan(), core_math::tan(x)),
                ("exp", a.exp(), core_math::exp(x)),
                ("ln", a.ln(), core_math::log(x)),
                ("sqrt", a.sqrt(), x.sqrt()),
                ("square", a.square(), x * x),
                ("cube", a.powi(3), x * x * x),
                ("abs", a.abs(), x.abs()),
                ("sinh", a.sinh(), core_math::sinh(x)),
                ("cosh", a.cosh(), core_math::cosh(x)),
                ("tanh", a.tanh(), core_math::tanh(x)),
                ("atan", a.atan(), core_math::atan(x)),
                ("asin", a.asin(), core_math::asin(x)),
                ("acos", a.acos(), core_math::acos(x)),
                ("^1.5", a.power(Interval::at(1.5)), core_math::pow(x, 1.5)),
                ("^-2", a.power(Interval::at(-2.0)), 1.0 / (x * x)),
            ] {
                prop_assert!(value.is_nan() || of.contains(value), "{name} {x} = {value}, {of:?}");
            }
        }
    }

    /// Against sums with twice the digits: rounding to nearest is not enough, one step outward is.
    #[test]
    fn sums_hold_the_exact_sum(values in prop::collection::vec(-1.0..1.0, 2..40)) {
        let of: Interval = values.iter().map(|v| Interval::at(*v)).sum();
        // TwoSum's errors are added up: together they are exact to twice the digits.
        let (mut sum, mut rest) = (0.0, 0.0);
        for v in &values {
            let (s, e) = two_sum(sum, *v);
            (sum, rest) = (s, rest + e);
        }
        let low = (sum - of.low) + rest;
        let high = (of.high - sum) - rest;
        prop_assert!(low >= 0.0 && high >= 0.0, "{of:?} {sum} {rest}");
    }
}

/// Elementary functions of points, against another library with 77 digits: inside, and within three steps.
#[test]
fn functions_hold_what_sixty_digits_say() {
    let mut random = crate::Random::new(5);
    for k in 0..400 {
        let size = 10f64.powf(4.0 * random.next() - 3.0);
        let x = if k % 2 == 0 { size } else { -size };
        let at = Interval::at(x);
        for (name, of) in [
            ("sin", at.sin()),
            ("cos", at.cos()),
            ("tan", at.tan()),
            ("exp", at.exp()),
            ("ln", at.ln()),
            ("sinh", at.sinh()),
            ("cosh", at.cosh()),
            ("tanh", at.tanh()),
            ("atan", at.atan()),
            ("asin", at.asin()),
            ("acos", at.acos()),
        ] {
            let exact = Big::of(x).function(name);
            if exact.is_nan() {
                continue;
            }
            let inside = exact.at_least(of.low) && exact.at_most(of.high);
            assert!(inside, "{name} {x:e}: {of:?} {exact:?}");
            let narrow = of.high - of.low <= 1e-15 * of.magnitude();
            assert!(narrow || name == "tan", "{name} {x:e}: {of:?}");
        }
    }
}

#[test]
fn what_is_exact_stays_so() {
    let three = Interval::at(1.0) + Interval::at(2.0);
    assert_eq!(three, Interval::at(3.0));
    assert!((three * Interval::ZERO).is_zero());
    let tenth = Interval::at(1.0) / Interval::at(10.0);
    assert!(tenth.low < tenth.high && (tenth * Interval::at(10.0)).contains(1.0));
    assert_eq!(Interval::at(0.0).sin(), Interval::ZERO);
    assert_eq!(Interval::at(4.0).power(Interval::at(0.5)).mid(), 2.0);
}

/// sin and cos near their extremes, where the ends of the interval miss the largest value.
#[test]
fn extremes_between_the_ends_are_inside() {
    for k in -40..40 {
        let top = f64::from(k) * std::f64::consts::FRAC_PI_2;
        let of = Interval::new(top - 1e-3, top + 1e-3);
        let [sin, cos] = [of.sin(), of.cos()];
        assert!(sin.contains(core_math::sin(top)) && cos.contains(core_math::cos(top)));
        let largest = sin.magnitude().max(cos.magnitude());
        assert_eq!(largest, 1.0, "{k}");
    }
}

/// Roots and reciprocals in exact arithmetic: those rounded to nearest would be on only one side.
#[test]
fn roots_and_reciprocals_hold_the_exact_ones() {
    let mut random = crate::Random::new(5);
    for _ in 0..2000 {
        let x = 10f64.powf(200.0 * random.next() - 100.0);
        let [of_x, one] = [x, 1.0].map(Big::of);
        let root = Interval::at(x).sqrt();
        let [low, high] = [root.low, root.high].map(Big::of);
        assert!((&low * &low - of_x.clone()).at_most(0.0), "{x} {root:?}");
        assert!((&high * &high - of_x.clone()).at_least(0.0), "{x} {root:?}");
        let recip = Interval::at(x).recip();
        let [low, high] = [recip.low, recip.high].map(Big::of);
        assert!((&low * &of_x - one.clone()).at_most(0.0), "{x} {recip:?}");
        assert!((&high * &of_x - one.clone()).at_least(0.0), "{x} {recip:?}");
    }
}
