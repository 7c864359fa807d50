//! The contact zone of one period cell: a log-kernel integral equation with an unknown end point.
//!
//! In a cell, Z = ω(x' + iy) with x' the distance from the centre of the zone, theta = Re Z in [0, π], contact on
//! [0, alpha]. Write u = w(x) - v with -w'' = f; v is harmonic and ∂ᵧv = -p on y = 0, p = -∂ₙu ≥ 0 the pressure,
//! p = Σ p_k cos(k theta). Separation of variables gives, with κ = ωk,
//! v = p_0(1-y) + Σ cos(k theta) [A_k cosh κy + (p_k/κ) sinh κ(1-y)]/cosh κ.
//! The slow part Σ (p_k/κ) e^{-κy} cos(k theta) is a convolution of p with -ln|2(cos Z - cos theta')|/ω. The map
//! sin(Z/2) = sin(alpha/2) sin(φ/2) takes the zone to [0, π] and the cell into the disc |t| ≤ 1, t = e^{iφ}, where the
//! Chebyshev polynomials of the zone are powers of t and the kernel is diagonal:
//! p dtheta = Σ c_j cos(jφ) dφ gives v = Re[Ψ(t) + (c_0/ω) ln t + Σ a_k cos kZ], c_j = ωjΨ_j, p_0 = c_0 = Ψ_0/(1 - ln β/ω),
//! β = sin²(alpha/2), a_k = (A_k - p_k e^{-κ}/κ)/cosh κ.
//! u = 0 on the zone means Re Ψ(e^{iφ}) = w - Σ a_k cos(k theta): all c_j follow, and the p_k in it are so strongly damped
//! that a few sweeps settle them. p stays bounded at alpha when [tΨ'](-1) + c_0/ω = 0: that finds alpha.

use std::f64::consts::PI;

use num_complex::Complex64;

use super::half_sine::{HalfSines, fraction_of_pi, trim};
use super::load::Load;
use faceoff_mesh::error::{Error, Result};

/// e^{-x} beyond this does not change 1.
pub(super) const NEGLIGIBLE: f64 = 42.0;

const SWEEPS: usize = 60;

/// The solution on one cell, for a given alpha or for the right one.
#[derive(Debug, Clone)]
pub(super) struct ContactZone {
    pub alpha: f64,
    /// c_0 = p_0, the mean pressure over the cell.
    pub mean_pressure: f64,
    /// p_k, k ≥ 1.
    pub pressure: Vec<f64>,
    /// Ψ = Σ even_j t^j + the continuation of `odd`.
    even: Vec<f64>,
    odd: HalfSines,
    /// (Σ j even_j t^j - its value at -1)/(1+t).
    quotient: Vec<f64>,
}

/// Ψ + (c_0/ω) ln t at a point: real part, and the derivative by Z.
pub(super) struct Potential {
    pub re: f64,
    pub derivative: Complex64,
}

impl ContactZone {
    /// `points`: Chebyshev points on the zone; `modes`: how many p_k are kept.
    pub fn solve(load: &Load, points: usize, modes: usize) -> Result<Self> {
        // Too small a zone would have infinite pressure at its end, too large a one would pull.
        let (mut small, mut large) = (0.0, PI);
        loop {
            let middle = 0.5 * (small + large);
            if middle <= small || middle >= large {
                break;
            }
            if ContactZone::with_end(load, middle, points)?.end_pressure(load) > 0.0 {
                small = middle;
            } else {
                large = middle;
            }
        }
        let mut zone = ContactZone::with_end(load, 0.5 * (small + large), points)?;
        zone.check_resolved(load, points)?;
        zone.pressure = zone.pressure_modes(load, modes);
        Ok(zone)
    }

    fn with_end(load: &Load, alpha: f64, points: usize) -> Result<Self> {
        let omega = load.omega();
        let beta = (0.5 * alpha).sin().powi(2);
        let damped = (NEGLIGIBLE / omega).ceil() as usize;
        let thetas: Vec<f64> = chebyshev_angles(points)
            .map(|phi| theta_of(phi, alpha))
            .collect();
        let odd = HalfSines::fit(&thetas.iter().map(|&x| (load.odd)(x)).collect::<Vec<_>>());
        let mut zone = ContactZone {
            alpha,
            mean_pressure: 0.0,
            pressure: vec![0.0; damped.min(points - 1)],
            even: Vec::new(),
            odd,
            quotient: Vec::new(),
        };
        for _ in 0..SWEEPS {
            let values: Vec<f64> = thetas
                .iter()
                .map(|&theta| {
                    let reflected: f64 = (1..=damped)
                        .map(|k| zone.reflected(load, k) * (k as f64 * theta).cos())
                        .sum();
                    (load.even)(theta) - reflected
                })
                .collect();
            zone.even = cosine_coefficients(&values);
            let constant = zone.coefficient(0);
            zone.mean_pressure = constant / (1.0 - beta.ln() / omega);
            let pressure = zone.pressure_modes(load, zone.pressure.len());
            let change = pressure
                .iter()
                .zip(&zone.pressure)
                .enumerate()
                .map(|(k, (new, old))| (new - old).abs() * (-2.0 * omega * (k + 1) as f64).exp())
                .fold(0.0, f64::max);
            zone.pressure = pressure;
            if change <= 0.1 * f64::EPSILON {
                zone.quotient = divide_by_one_plus_t(&zone.even);
                return Ok(zone);
            }
        }
        Err(Error::Solver {
            what: format!(
                "the reference's top side and contact zone did not settle in {SWEEPS} sweeps"
            ),
            remedy: "report the load: its period must not exceed twice the height of the domain"
                .into(),
        })
    }

    /// a_k, what the side y = 1 reflects.
    fn reflected(&self, load: &Load, k: usize) -> f64 {
        let kappa = load.omega() * k as f64;
        let decay = (-kappa).exp();
        self.top_amplitude(load, k) * 2.0 * decay / (1.0 + decay * decay)
    }

    /// a_k cosh κ.
    pub fn top_amplitude(&self, load: &Load, k: usize) -> f64 {
        let kappa = load.omega() * k as f64;
        let pressure = self.pressure.get(k - 1).copied().unwrap_or(0.0);
        (load.amplitude)(k) - pressure * (-kappa).exp() / kappa
    }

    /// Ψ_j.
    fn coefficient(&self, j: usize) -> f64 {
        self.even.get(j).copied().unwrap_or(0.0) + self.odd.cosine_coefficient(j)
    }

    /// ([tΨ'](-1) + c_0/ω), of the sign of the pressure at the end of the zone.
    fn end_pressure(&self, load: &Load) -> f64 {
        let even: f64 = self
            .even
            .iter()
            .enumerate()
            .map(|(j, c)| {
                if j % 2 == 0 {
                    c * j as f64
                } else {
                    -c * j as f64
                }
            })
            .sum();
        self.mean_pressure / load.omega() + even + self.odd.slope_at_end()
    }

    /// p_k, k = 1 … count: exact for the first count + 1 terms of the density, and no other has a share in them.
    fn pressure_modes(&self, load: &Load, count: usize) -> Vec<f64> {
        let n = count + 1;
        let density: Vec<f64> = (0..n)
            .map(|j| match j {
                0 => self.mean_pressure,
                _ => load.omega() * j as f64 * self.coefficient(j),
            })
            .collect();
        let mut modes = vec![0.0; count];
        for phi in chebyshev_angles(n) {
            let value = cosine_sum(&density, phi);
            let theta = theta_of(phi, self.alpha);
            for (k, mode) in modes.iter_mut().enumerate() {
                *mode += 2.0 / n as f64 * value * ((k + 1) as f64 * theta).cos();
            }
        }
        modes
    }

    fn check_resolved(&self, load: &Load, points: usize) -> Result<()> {
        // A series that is down to rounding before the points run out is complete.
        let used = self.even.len().max(self.odd.len());
        if used + 2 <= points && self.end_pressure(load).abs() < 1e-9 {
            return Ok(());
        }
        Err(Error::Solver {
            what: format!("the reference is not resolved by {points} Chebyshev points"),
            remedy: "raise the resolution".into(),
        })
    }

    /// At Z = theta + i eta, theta in [0, π], eta ≥ 0.
    pub fn potential(&self, load: &Load, theta: f64, eta: f64) -> Potential {
        let strength = self.mean_pressure / load.omega();
        let sigma = (0.5 * self.alpha).sin();
        if eta > 2.0 * NEGLIGIBLE {
            // t is negligible compared with 1, and ln t = iZ + ln β.
            return Potential {
                re: self.coefficient(0) + strength * (2.0 * sigma.ln() - eta),
                derivative: Complex64::I * strength,
            };
        }
        let z = Complex64::new(theta, eta);
        let sqrt_t = self.sqrt_t(z);
        let t = sqrt_t * sqrt_t;
        let [odd, odd_quotient] = self.odd.evaluate(sqrt_t);
        let quotient = power_sum(&self.quotient, t) + odd_quotient;
        Potential {
            re: power_sum(&self.even, t).re + odd.re + 2.0 * strength * sqrt_t.norm().ln(),
            derivative: 2.0 * Complex64::I * sqrt_t * quotient * (0.5 * z).cos() / sigma,
        }
    }

    /// e^{iφ/2}, in the first quadrant.
    fn sqrt_t(&self, z: Complex64) -> Complex64 {
        let sigma = (0.5 * self.alpha).sin();
        let sine = (0.5 * z).sin() / sigma;
        // cos²(φ/2) = 1 - sine², without its cancellation at the end of the zone.
        let square =
            (0.5 * (self.alpha - z)).sin() * (0.5 * (self.alpha + z)).sin() / (sigma * sigma);
        // cos(φ/2) lies in the fourth quadrant; -0 keeps it there on the edges.
        let cosine = Complex64::new(square.re, -square.im.abs()).sqrt();
        1.0 / (cosine - Complex64::I * sine)
    }
}

/// φ_i = (i+½)π/n.
fn chebyshev_angles(n: usize) -> impl Iterator<Item = f64> {
    (0..n).map(move |i| (i as f64 + 0.5) * PI / n as f64)
}

fn theta_of(phi: f64, alpha: f64) -> f64 {
    2.0 * ((0.5 * alpha).sin() * (0.5 * phi).sin()).asin()
}

/// Coefficients of Σ c_j cos jφ from values at the Chebyshev angles, without the tail that is rounding only.
fn cosine_coefficients(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    let mut c: Vec<f64> = (0..n)
        .map(|j| {
            let sum: f64 = values
                .iter()
                .enumerate()
                .map(|(i, v)| v * fraction_of_pi(j * (2 * i + 1), 2 * n).cos())
                .sum();
            sum * if j == 0 { 1.0 } else { 2.0 } / n as f64
        })
        .collect();
    trim(&mut c);
    c
}

/// Σ c_j cos jφ, by Clenshaw.
fn cosine_sum(c: &[f64], phi: f64) -> f64 {
    let twice = 2.0 * phi.cos();
    let (mut b1, mut b2) = (0.0, 0.0);
    for &coefficient in c.iter().skip(1).rev() {
        (b1, b2) = (coefficient + twice * b1 - b2, b1);
    }
    c.first().copied().unwrap_or(0.0) + 0.5 * twice * b1 - b2
}

fn power_sum(c: &[f64], t: Complex64) -> Complex64 {
    c.iter().rev().fold(Complex64::ZERO, |sum, &c| sum * t + c)
}

/// Coefficients of (Σ j c_j t^j - its value at -1)/(1+t): from the top, where nothing cancels.
fn divide_by_one_plus_t(c: &[f64]) -> Vec<f64> {
    let mut quotient = vec![0.0; c.len().saturating_sub(1)];
    let mut above = 0.0;
    for (j, slot) in quotient.iter_mut().enumerate().rev() {
        let j = j + 1;
        above = j as f64 * c.get(j).copied().unwrap_or(0.0) - above;
        *slot = above;
    }
    quotient
}
