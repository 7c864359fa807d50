//! Sums of half-integer sines, continued from the unit circle into the disc.
//!
//! A load with a kink at the corner where contact meets the side gives data that are smooth but odd there. Their
//! Chebyshev series converges like j⁻⁴ only; in sin((m+½)φ) they converge geometrically, and the analytic function
//! of t = e^{iφ} with that real part is elementary. With μ = m+½,
//! sin μφ = Re (1/π)(A_m + B_m), A_m = Σ_{j≥1} t^j/(μ-j), B_m = Σ_{j≥0} t^j/(μ+j);
//! A_0 = -t B_0, A_{m+1} = t(A_m + 1/μ), t B_{m+1} = B_m - 1/μ, B_0 = 2 artanh(√t)/√t.

use std::f64::consts::{FRAC_PI_4, PI};

use num_complex::Complex64;

/// Below this |t| the power series is short and the forward recurrence of B_m would lose digits.
const SERIES_RADIUS: f64 = 0.5;
const SERIES_TERMS: usize = 64;

/// Σ b_m sin((m+½)φ).
#[derive(Debug, Clone, Default)]
pub(super) struct HalfSines {
    b: Vec<f64>,
}

impl HalfSines {
    /// From values at φ_i = (i+½)π/n, i < n.
    pub fn fit(values: &[f64]) -> Self {
        let n = values.len();
        let mut b: Vec<f64> = (0..n)
            .map(|m| {
                let sum: f64 = values
                    .iter()
                    .enumerate()
                    .map(|(i, v)| v * fraction_of_pi((2 * m + 1) * (2 * i + 1), 4 * n).sin())
                    .sum();
                2.0 * sum / n as f64
            })
            .collect();
        trim(&mut b);
        HalfSines { b }
    }

    /// The number of terms above rounding.
    pub fn len(&self) -> usize {
        self.b.len()
    }

    /// Coefficient of cos jφ on [0, π].
    pub fn cosine_coefficient(&self, j: usize) -> f64 {
        let j = j as f64;
        let sum: f64 = self
            .terms()
            .map(|(mu, b)| b * mu / ((mu - j) * (mu + j)))
            .sum();
        if j == 0.0 { sum / PI } else { 2.0 * sum / PI }
    }

    /// Ψ(t), the analytic function with real part Σ b_m sin((m+½)φ) on t = e^{iφ}, and
    /// (tΨ'(t) - [tΨ'](-1))/(1+t), from √t in the closed first quadrant, |t| ≤ 1.
    pub fn evaluate(&self, sqrt_t: Complex64) -> [Complex64; 2] {
        if self.b.is_empty() {
            return [Complex64::ZERO; 2];
        }
        let t = sqrt_t * sqrt_t;
        if t.norm() < SERIES_RADIUS {
            return self.evaluate_near_centre(t);
        }
        let (mut b, mut quotient_b) = start(sqrt_t);
        let mut b_end = START_AT_END;
        let (mut a, mut quotient_a, mut a_end) = (-t * b, -(t * quotient_b + b_end), b_end);
        let mut sums = [Complex64::ZERO; 2];
        for (mu, coefficient) in self.terms() {
            sums[0] += coefficient * (a + b);
            sums[1] += coefficient * mu * (quotient_a - quotient_b);
            quotient_a = t * quotient_a + (a_end + 1.0 / mu);
            a = t * (a + 1.0 / mu);
            a_end = -(a_end + 1.0 / mu);
            b_end = 1.0 / mu - b_end;
            b = (b - 1.0 / mu) / t;
            quotient_b = (quotient_b - b_end) / t;
        }
        [sums[0] / PI, sums[1] / PI]
    }

    /// [tΨ'](-1).
    pub fn slope_at_end(&self) -> f64 {
        let mut b_end = START_AT_END;
        let mut a_end = b_end;
        let mut sum = 0.0;
        for (mu, coefficient) in self.terms() {
            sum += coefficient * (1.0 + mu * (a_end - b_end));
            a_end = -(a_end + 1.0 / mu);
            b_end = 1.0 / mu - b_end;
        }
        sum / PI
    }

    fn evaluate_near_centre(&self, t: Complex64) -> [Complex64; 2] {
        let mut value = Complex64::ZERO;
        let mut slope = Complex64::ZERO;
        for j in (0..SERIES_TERMS).rev() {
            let coefficient = self.cosine_coefficient(j);
            value = value * t + coefficient;
            slope = slope * t + j as f64 * coefficient;
        }
        [value, (slope - self.slope_at_end()) / (1.0 + t)]
    }

    fn terms(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.b.iter().enumerate().map(|(m, &b)| (half(m), b))
    }
}

/// Drops the tail of a series that is rounding only: differentiation and recurrences would amplify it.
pub(super) fn trim(series: &mut Vec<f64>) {
    let noise = 8.0 * f64::EPSILON * series.iter().fold(0.0, |a: f64, v| a.max(v.abs()));
    while series.last().is_some_and(|v| v.abs() <= noise) {
        series.pop();
    }
}

/// p π/q, reduced to less than 2π without rounding.
pub(super) fn fraction_of_pi(p: usize, q: usize) -> f64 {
    (p % (2 * q)) as f64 * PI / q as f64
}

fn half(m: usize) -> f64 {
    m as f64 + 0.5
}

/// B_0 at t = -1.
const START_AT_END: f64 = 2.0 * FRAC_PI_4;

/// B_0(t) and (B_0(t) - B_0(-1))/(1+t). With r = -i√t, B_0 = 2 arctan(r)/r.
fn start(sqrt_t: Complex64) -> (Complex64, Complex64) {
    let mut distance = 1.0 - sqrt_t;
    if distance.norm() < f64::EPSILON {
        // The logarithm at t = 1 is always multiplied by zero.
        distance = Complex64::new(f64::EPSILON, 0.0);
    }
    let value = ((1.0 + sqrt_t).ln() - distance.ln()) / sqrt_t;
    let r = -Complex64::I * sqrt_t;
    let v = (1.0 - r) / (1.0 + r);
    // Near t = -1 the difference cancels; arctan r = π/4 - arctan v does not.
    let quotient = if v.norm() < 0.3 {
        2.0 / (r * (1.0 + r)) * (FRAC_PI_4 - arctan_ratio(v) / (1.0 + r))
    } else {
        (value - START_AT_END) / (1.0 + sqrt_t * sqrt_t)
    };
    (value, quotient)
}

/// arctan(v)/v for |v| < 0.3.
fn arctan_ratio(v: Complex64) -> Complex64 {
    let square = -v * v;
    (0..16).rev().fold(Complex64::ZERO, |sum, k| {
        sum * square + 1.0 / f64::from(2 * k + 1)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> HalfSines {
        HalfSines {
            b: vec![0.7, -0.2, 0.05, 0.01, -0.002],
        }
    }

    #[test]
    fn fit_returns_the_coefficients() {
        let n = 12;
        let values: Vec<f64> = (0..n)
            .map(|i| {
                let phi = half(i) * PI / n as f64;
                sample().terms().map(|(mu, b)| b * (mu * phi).sin()).sum()
            })
            .collect();
        let fitted = HalfSines::fit(&values);
        assert_eq!(fitted.len(), 5);
        for (a, b) in fitted.b.iter().zip(sample().b) {
            assert!((a - b).abs() < 1e-15);
        }
    }

    #[test]
    fn the_real_part_on_the_circle_is_the_sum() {
        for phi in [0.0, 1e-9, 0.01, 0.5, 2.0, 3.1, PI - 1e-7, PI] {
            let [value, _] = sample().evaluate(Complex64::from_polar(1.0, phi / 2.0));
            let sum: f64 = sample().terms().map(|(mu, b)| b * (mu * phi).sin()).sum();
            assert!((value.re - sum).abs() < 1e-14, "{phi}: {} {sum}", value.re);
        }
    }

    #[test]
    fn inside_the_disc_both_forms_are_the_power_series() {
        let s = sample();
        for (radius, phi) in [(0.49, 2.2), (0.51, 2.2), (0.8, 0.4), (0.9, PI), (0.85, 3.0)] {
            let sqrt_t = Complex64::from_polar(f64::sqrt(radius), phi / 2.0);
            let t = sqrt_t * sqrt_t;
            let (mut value, mut slope) = (Complex64::ZERO, Complex64::ZERO);
            for j in (0..600).rev() {
                let c = s.cosine_coefficient(j);
                value = value * t + c;
                slope = slope * t + j as f64 * c;
            }
            let [v, q] = s.evaluate(sqrt_t);
            assert!((v - value).norm() < 1e-14, "{radius} {phi}: {v} {value}");
            let expected = (slope - s.slope_at_end()) / (1.0 + t);
            assert!(
                (q - expected).norm() < 1e-12,
                "{radius} {phi}: {q} {expected}"
            );
        }
    }

    #[test]
    fn the_quotient_is_continuous_at_the_end() {
        let s = sample();
        let at = |phi: f64| s.evaluate(Complex64::from_polar(1.0, phi / 2.0))[1];
        assert!((at(PI) - at(PI - 1e-8)).norm() < 1e-7);
        // Where v is 0.3, the two forms of the start meet.
        let border = PI - 4.0 * f64::atan(0.3);
        assert!((at(border - 1e-9) - at(border + 1e-9)).norm() < 1e-7);
    }
}
