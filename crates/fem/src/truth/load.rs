//! The two loads of the paper's section 6, as one period cell of a cosine series sees them.

use std::f64::consts::{PI, TAU};

/// A load f(x) that is even about the centre of its contact zone and has the period `1/frequency`.
///
/// `theta` = 2π·frequency·|x - centre| runs through [0, π], from the centre of the contact zone to the
/// middle of the free part. The particular solution w(x), -w'' = f, has w' = 0 at both ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Load {
    pub centre: f64,
    pub frequency: f64,
    /// f as a function of x.
    pub f: fn(x: f64, frequency: f64) -> f64,
    /// f is a sine or cosine of this times x.
    pub wave_number: f64,
    /// w(theta) as the sum of a part that is smooth and even about theta = 0, and one that is smooth and odd.
    pub even: fn(theta: f64) -> f64,
    pub odd: fn(theta: f64) -> f64,
    /// dw/dtheta.
    pub slope: fn(theta: f64) -> f64,
    /// A_k in w = Σ A_k cos(k theta), k ≥ 1.
    pub amplitude: fn(k: usize) -> f64,
    /// A_k = 0 for all k beyond.
    pub last_mode: usize,
}

impl Load {
    /// (6.1), f = -2π sin 2πx: the contact zone lies at the side x = 1, and f has a kink in its even extension.
    pub fn one_zone() -> Self {
        Load {
            centre: 1.0,
            frequency: 0.5,
            f: |x, _| -TAU * (TAU * x).sin(),
            wave_number: TAU,
            even: |_| 0.5,
            odd: |theta| (2.0 * theta).sin() / TAU - theta / PI,
            slope: |theta| ((2.0 * theta).cos() - 1.0) / PI,
            amplitude: |k| {
                let square = (k as f64).powi(2);
                if k % 2 == 1 {
                    -16.0 / ((square - 4.0) * square * PI * PI)
                } else {
                    0.0
                }
            },
            last_mode: usize::MAX,
        }
    }

    /// (6.2), f = (2πN)² cos 2πNx: contact about x = j/N.
    pub fn zones(n: u32) -> Self {
        Load {
            centre: 0.0,
            frequency: f64::from(n),
            f: |x, frequency| (TAU * frequency).powi(2) * (TAU * frequency * x).cos(),
            wave_number: TAU * f64::from(n),
            even: f64::cos,
            odd: |_| 0.0,
            slope: |theta| -theta.sin(),
            amplitude: |k| if k == 1 { 1.0 } else { 0.0 },
            last_mode: 1,
        }
    }

    /// Wave number of the first mode.
    pub fn omega(&self) -> f64 {
        TAU * self.frequency
    }

    /// theta of x, and the sign of dtheta/dx.
    pub fn fold(&self, x: f64) -> (f64, f64) {
        let periods = (x - self.centre) * self.frequency;
        let rest = periods - periods.round();
        (TAU * rest.abs(), if rest < 0.0 { -1.0 } else { 1.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_particular_solution_is_its_cosine_series() {
        for load in [Load::one_zone(), Load::zones(3)] {
            for theta in [0.0, 0.3, 1.7, PI] {
                let terms = 1..=load.last_mode.min(20_000);
                let series: f64 = terms
                    .map(|k| (load.amplitude)(k) * (k as f64 * theta).cos())
                    .sum();
                let w = (load.even)(theta) + (load.odd)(theta);
                assert!((series - w).abs() < 1e-12, "{theta}: {series} {w}");
            }
        }
    }

    #[test]
    fn the_particular_solution_solves_the_equation() {
        let w = |load: &Load, x: f64| {
            let (theta, _) = load.fold(x);
            (load.even)(theta) + (load.odd)(theta)
        };
        for load in [Load::one_zone(), Load::zones(3)] {
            for x in [0.03, 0.21, 0.64, 0.97] {
                let h = 1e-3;
                let second = (-w(&load, x - 2.0 * h) + 16.0 * w(&load, x - h) - 30.0 * w(&load, x)
                    + 16.0 * w(&load, x + h)
                    - w(&load, x + 2.0 * h))
                    / (12.0 * h * h);
                let f = (load.f)(x, load.frequency);
                assert!(
                    (second + f).abs() < 1e-5 * (1.0 + f.abs()),
                    "{x}: {second} {f}"
                );
                let (theta, sign) = load.fold(x);
                let slope = sign * load.omega() * (load.slope)(theta);
                let difference = (w(&load, x + h) - w(&load, x - h)) / (2.0 * h);
                assert!(
                    (slope - difference).abs() < 1e-2,
                    "{x}: {slope} {difference}"
                );
            }
        }
    }
}
