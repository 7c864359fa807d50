//! Intervals of real numbers that contain the value that they stand for, whatever the rounding.
//!
//! Every operation gives an interval that contains the exact result for all numbers of its operands (R. E. Moore,
//! Interval Analysis, 1966): what rounding to nearest gives is moved outward by one step where it is not exact. The
//! elementary functions are CORE-MATH's, which round correctly (A. Sibidanov, P. Zimmermann, S. Glondu, ARITH 2022).
//! An operation that is not defined somewhere in its operands, such as √ of negative numbers or a division by an interval with 0, gives the whole
//! line: nothing is known then, and no false bound is given.

use std::f64::consts::PI;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// All real numbers from `low` to `high`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Interval {
    /// The lower end, or -∞.
    pub low: f64,
    /// The upper end, or ∞.
    pub high: f64,
}

impl Interval {
    /// 0, exactly.
    pub const ZERO: Interval = Interval::at(0.0);
    /// 1, exactly.
    pub const ONE: Interval = Interval::at(1.0);
    /// Nothing is known.
    pub const WHOLE: Interval = Interval {
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
    };
    /// π
    pub const PI: Interval = Interval {
        low: PI,
        high: PI.next_up(),
    };

    /// One number.
    #[inline]
    pub const fn at(value: f64) -> Self {
        Interval {
            low: value,
            high: value,
        }
    }

    /// [low, high]; the whole line where one of them is not a number.
    #[inline]
    pub fn new(low: f64, high: f64) -> Self {
        if low <= high {
            Interval { low, high }
        } else {
            Interval::WHOLE
        }
    }

    /// [-radius, radius]
    pub fn around_zero(radius: f64) -> Self {
        Interval::new(-radius, radius)
    }

    /// The smallest interval with both.
    #[inline]
    pub fn hull(self, other: Self) -> Self {
        Interval {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// The intersection, for two enclosures of one number. If it is empty they contradict each other, and nothing is known.
    pub fn meet(self, other: Self) -> Self {
        Interval::new(self.low.max(other.low), self.high.min(other.high))
    }

    /// Whether both ends are finite.
    pub fn is_finite(self) -> bool {
        self.low.is_finite() && self.high.is_finite()
    }

    /// Whether it is exactly 0.
    #[inline]
    pub fn is_zero(self) -> bool {
        self.low == 0.0 && self.high == 0.0
    }

    /// Whether it contains this number.
    pub fn contains(self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    /// A number in the middle; 0 where an end is infinite.
    #[inline]
    pub fn mid(self) -> f64 {
        let mid = if self.low == self.high {
            self.low
        } else {
            0.5 * self.low + 0.5 * self.high
        };
        if mid.is_finite() { mid } else { 0.0 }
    }

    /// No number in it is farther from [`Interval::mid`].
    #[inline]
    pub fn radius(self) -> f64 {
        if self.low == self.high && self.low.is_finite() {
            return 0.0;
        }
        self.distance(self.mid())
    }

    /// No number in it is farther from `value`.
    pub fn distance(self, value: f64) -> f64 {
        let below = above_of_difference(value, self.low);
        let above = above_of_difference(self.high, value);
        below.max(above)
    }

    /// The largest absolute value.
    #[inline]
    pub fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    /// The smallest absolute value.
    pub fn mignitude(self) -> f64 {
        if self.contains(0.0) {
            0.0
        } else {
            self.low.abs().min(self.high.abs())
        }
    }

    /// Holds the absolute value of each x in it.
    #[inline]
    pub fn abs(self) -> Self {
        Interval {
            low: self.mignitude(),
            high: self.magnitude(),
        }
    }

    /// Holds x² for each x in it.
    #[inline]
    pub fn square(self) -> Self {
        let of = self.abs();
        if of.is_zero() {
            return of;
        }
        Interval::new(below(of.low * of.low).max(0.0), above(of.high * of.high))
    }

    /// Holds the smaller of each two.
    pub fn min(self, other: Self) -> Self {
        Interval {
            low: self.low.min(other.low),
            high: self.high.min(other.high),
        }
    }

    /// Holds the larger of each two.
    pub fn max(self, other: Self) -> Self {
        Interval {
            low: self.low.max(other.low),
            high: self.high.max(other.high),
        }
    }

    /// Holds 1/x for each x in it; everything where one of these is 0.
    pub fn recip(self) -> Self {
        if self.contains(0.0) {
            return Interval::WHOLE;
        }
        Interval::new(below(1.0 / self.high), above(1.0 / self.low))
    }

    /// 2^k times this.
    #[inline]
    pub fn times_power_of_two(self, k: i32) -> Self {
        if k == 0 || self.is_zero() {
            return self;
        }
        // In two steps, as 2^k itself may be out of range; inexact only where the result is.
        let (first, second) = (k / 2, k - k / 2);
        self * Interval::at(2f64.powi(first)) * Interval::at(2f64.powi(second))
    }

    /// The n-th power of whole n.
    pub fn powi(self, n: u32) -> Self {
        match n {
            0 => Interval::ONE,
            1 => self,
            _ if n.is_multiple_of(2) => self.powi(n / 2).square(),
            _ => self * self.powi(n - 1),
        }
    }

    /// self^other as `f64::powf` has it; the base may be negative only for whole exponents.
    pub fn power(self, other: Self) -> Self {
        let exponent = other.low;
        if other.low == other.high && exponent.fract() == 0.0 && exponent.abs() <= 1024.0 {
            let power = self.powi(exponent.abs() as u32);
            return if exponent < 0.0 { power.recip() } else { power };
        }
        if self.low < 0.0 || !other.is_finite() {
            return Interval::WHOLE;
        }
        if other.low == other.high {
            let of = |x: f64| core_math::pow(x, exponent);
            return if exponent > 0.0 {
                Interval::new(below(of(self.low)).max(0.0), above(of(self.high)))
            } else if self.low > 0.0 {
                Interval::new(below(of(self.high)).max(0.0), above(of(self.low)))
            } else {
                Interval::WHOLE
            };
        }
        (other * self.ln()).exp()
    }

    /// Holds √x for each x in it; everything where one of these is negative.
    pub fn sqrt(self) -> Self {
        if self.low < 0.0 {
            return Interval::WHOLE;
        }
        let (low, high) = (self.low.sqrt(), self.high.sqrt());
        let low = if low == 0.0 { 0.0 } else { below(low) };
        let high = if high == 0.0 { 0.0 } else { above(high) };
        Interval::new(low, high)
    }

    /// √ where what is negative is rounding: of sums of squares.
    pub fn root(self) -> Self {
        Interval {
            low: self.low.max(0.0),
            high: self.high.max(0.0),
        }
        .sqrt()
    }

    /// Holds exp x for each x in it.
    pub fn exp(self) -> Self {
        if self.is_zero() {
            return Interval::ONE;
        }
        let of = self.grown(core_math::exp);
        Interval::new(of.low.max(0.0), of.high)
    }

    /// Holds log x for each x in it; everything where one of these is not positive.
    pub fn ln(self) -> Self {
        if self.low <= 0.0 {
            return Interval::WHOLE;
        }
        self.grown(core_math::log)
    }

    /// Holds sinh x for each x in it.
    pub fn sinh(self) -> Self {
        self.grown(core_math::sinh)
    }

    /// Holds cosh x for each x in it.
    pub fn cosh(self) -> Self {
        let of = self.abs().grown(core_math::cosh);
        Interval::new(of.low.max(1.0), of.high)
    }

    /// Holds tanh x for each x in it.
    pub fn tanh(self) -> Self {
        self.grown(core_math::tanh).clamp()
    }

    /// Holds atan x for each x in it.
    pub fn atan(self) -> Self {
        self.grown(core_math::atan)
    }

    /// Holds asin x for each x in it; everything where one of these is beyond ±1.
    pub fn asin(self) -> Self {
        if self.low < -1.0 || self.high > 1.0 {
            return Interval::WHOLE;
        }
        self.grown(core_math::asin)
    }

    /// Holds acos x for each x in it; everything where one of these is beyond ±1.
    pub fn acos(self) -> Self {
        if self.low < -1.0 || self.high > 1.0 {
            return Interval::WHOLE;
        }
        Interval::new(
            below(core_math::acos(self.high)),
            above(core_math::acos(self.low)),
        )
    }

    /// Holds cos x for each x in it.
    pub fn cos(self) -> Self {
        // Beyond this the quotient by π is not known to within a small part of 1.
        if !(self.magnitude() < 1e9) {
            return Interval::new(-1.0, 1.0);
        }
        // kπ for first < k <= last may be inside: the extremes of cos.
        let (first, last) = self.multiples_of_pi();
        let (a, b) = (core_math::cos(self.low), core_math::cos(self.high));
        let is_even_inside = (last / 2.0).floor() * 2.0 > first;
        let is_odd_inside = ((last + 1.0) / 2.0).floor() * 2.0 - 1.0 > first;
        let low = if is_odd_inside { -1.0 } else { below(a.min(b)) };
        let high = if is_even_inside { 1.0 } else { above(a.max(b)) };
        Interval::new(low, high).clamp()
    }

    /// Holds sin x for each x in it.
    pub fn sin(self) -> Self {
        if self.is_zero() {
            return self;
        }
        if self.low == self.high {
            return self.grown(core_math::sin).clamp();
        }
        // Below π/2 it grows, and its ends know it to all digits.
        if self.magnitude() < 1.57 {
            return self.grown(core_math::sin).clamp();
        }
        (self - Interval::PI * Interval::at(0.5)).cos()
    }

    /// Holds tan x for each x in it; everything where a pole may be among these.
    pub fn tan(self) -> Self {
        let quarter = Interval::PI * Interval::at(0.5);
        let shifted = self + quarter;
        if !(self.magnitude() < 1e9) {
            return Interval::WHOLE;
        }
        let (first, last) = shifted.multiples_of_pi();
        if last > first {
            return Interval::WHOLE;
        }
        self.grown(core_math::tan)
    }

    /// The angle of (x, y), y first; where the negative x axis is inside with both its sides, all of [-π, π].
    pub fn atan2(self, x: Self) -> Self {
        let y = self;
        if x.low > 0.0 {
            return (y / x).atan();
        }
        let half = Interval::PI * Interval::at(0.5);
        if y.low > 0.0 {
            return half - (x / y).atan();
        }
        if y.high < 0.0 {
            return -half - (x / y).atan();
        }
        let whole = Interval::new(-Interval::PI.high, Interval::PI.high);
        if y.low < 0.0 {
            return whole;
        }
        if x.high < 0.0 {
            return Interval::PI + (y / x).atan();
        }
        Interval::new(0.0, Interval::PI.high)
    }

    /// [-1, 1] holds the values.
    fn clamp(self) -> Self {
        Interval::new(self.low.max(-1.0), self.high.min(1.0))
    }

    /// A function that grows and rounds correctly.
    fn grown(self, of: impl Fn(f64) -> f64) -> Self {
        let end = |x: f64, step: fn(f64) -> f64| {
            if x == 0.0 && of(x) == 0.0 {
                0.0
            } else {
                step(of(x))
            }
        };
        Interval::new(end(self.low, below), end(self.high, above))
    }

    /// kπ with first < k ≤ last are all that may be inside.
    fn multiples_of_pi(self) -> (f64, f64) {
        let quotient = Interval::new(self.low, self.high) / Interval::PI;
        // One more step, so that an end on a multiple counts as inside.
        (
            quotient.low.next_down().floor(),
            quotient.high.next_up().floor(),
        )
    }
}

/// At most the next number below, without a branch: rounding to nearest errs by 2⁻⁵³ |x| at most, and less than this
/// is taken away. No number where x is infinite.
#[inline(always)]
fn below(x: f64) -> f64 {
    x - (x.abs() * OUTWARD + f64::MIN_POSITIVE)
}

/// At least the next number above.
#[inline(always)]
fn above(x: f64) -> f64 {
    x + (x.abs() * OUTWARD + f64::MIN_POSITIVE)
}

/// A little more than 2⁻⁵³ = 1.11e-16: x less this part of it is nearer to the next number than to x.
const OUTWARD: f64 = 1.2e-16;

/// a + b and what it is less than the exact sum (D. E. Knuth, TwoSum).
#[inline]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

/// a + b rounded down.
#[inline(always)]
fn below_of_sum(a: f64, b: f64) -> f64 {
    let (sum, error) = two_sum(a, b);
    let outward = below(sum);
    // No number where an operand or the sum is infinite.
    if error >= 0.0 { sum } else { outward }
}

/// a + b rounded up.
#[inline(always)]
pub fn above_of_sum(a: f64, b: f64) -> f64 {
    let (sum, error) = two_sum(a, b);
    let outward = above(sum);
    if error <= 0.0 || sum == f64::INFINITY {
        sum
    } else {
        outward
    }
}

#[inline]
fn above_of_difference(a: f64, b: f64) -> f64 {
    above_of_sum(a, -b)
}

/// a b rounded up, of numbers that are not negative; 0 times anything is 0.
#[inline]
pub fn above_of_product(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 {
        0.0
    } else {
        above(a * b)
    }
}

/// The sum of numbers that are not negative, rounded up.
pub fn above_of_all(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, slack) = sum_of_all(values);
    above_of_product(sum, 1.0 + slack)
}

/// A sum, and what it may be off by relative to itself: each rounding errs by 2⁻⁵³ of its result at most, n of them by less
/// than (1 + 2⁻⁵²)ⁿ.
fn sum_of_all(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let (mut sum, mut count) = (0.0, 1.0);
    for value in values {
        sum += value;
        count += 1.0;
    }
    (sum, count * f64::EPSILON)
}

impl Add for Interval {
    type Output = Interval;

    #[inline]
    fn add(self, other: Interval) -> Interval {
        Interval::new(
            below_of_sum(self.low, other.low),
            above_of_sum(self.high, other.high),
        )
    }
}

impl AddAssign for Interval {
    #[inline]
    fn add_assign(&mut self, other: Interval) {
        *self = *self + other;
    }
}

impl Sub for Interval {
    type Output = Interval;

    #[inline]
    fn sub(self, other: Interval) -> Interval {
        self + -other
    }
}

impl Neg for Interval {
    type Output = Interval;

    #[inline]
    fn neg(self) -> Interval {
        Interval {
            low: -self.high,
            high: -self.low,
        }
    }
}

impl Mul for Interval {
    type Output = Interval;

    #[inline]
    fn mul(self, other: Interval) -> Interval {
        // Zeros apart: rounded outward they would be subnormal, which costs ten times the time.
        if self.is_zero() || other.is_zero() {
            return Interval::ZERO;
        }
        let all = [
            self.low * other.low,
            self.low * other.high,
            self.high * other.low,
            self.high * other.high,
        ];
        let smaller = |a: f64, b: f64| if a < b { a } else { b };
        let larger = |a: f64, b: f64| if a > b { a } else { b };
        // 0 ∞ is not a number, and nothing is known then.
        if (all[0] + all[1] + (all[2] + all[3])).is_nan() {
            return Interval::WHOLE;
        }
        let low = smaller(smaller(all[0], all[1]), smaller(all[2], all[3]));
        let high = larger(larger(all[0], all[1]), larger(all[2], all[3]));
        let (mut low, mut high) = (below(low), above(high));
        // No rounding changes the sign of a product.
        let (a, b) = (self.low >= 0.0, other.low >= 0.0);
        let (c, d) = (self.high <= 0.0, other.high <= 0.0);
        if a && b || c && d {
            low = low.max(0.0);
        }
        if a && d || c && b {
            high = high.min(0.0);
        }
        Interval::new(low, high)
    }
}

impl Mul<Interval> for f64 {
    type Output = Interval;

    #[inline]
    fn mul(self, other: Interval) -> Interval {
        if other.is_zero() || self == 0.0 {
            return Interval::ZERO;
        }
        let (a, b) = (self * other.low, self * other.high);
        let (low, high) = if self > 0.0 { (a, b) } else { (b, a) };
        // A power of two changes only the exponent.
        let is_power = self.to_bits() & ((1 << 52) - 1) == 0;
        let is_exact = |x: f64| x.is_normal() || x == 0.0;
        if is_power && is_exact(low) && is_exact(high) && self.is_normal() && self.abs() >= 1e-3 {
            return Interval { low, high };
        }
        Interval::new(below(low), above(high))
    }
}

impl Div for Interval {
    type Output = Interval;

    #[inline]
    fn div(self, other: Interval) -> Interval {
        if self.is_zero() && !other.contains(0.0) {
            return self;
        }
        if other.contains(0.0) {
            return Interval::WHOLE;
        }
        let all = [
            self.low / other.low,
            self.low / other.high,
            self.high / other.low,
            self.high / other.high,
        ];
        let low = all[0].min(all[1]).min(all[2].min(all[3]));
        let high = all[0].max(all[1]).max(all[2].max(all[3]));
        if all.iter().any(|q| q.is_nan()) {
            return Interval::WHOLE;
        }
        Interval::new(below(low), above(high))
    }
}

impl std::iter::Sum for Interval {
    fn sum<I: Iterator<Item = Interval>>(all: I) -> Interval {
        all.fold(Interval::ZERO, Add::add)
    }
}

#[cfg(test)]
mod tests;
