//! What is known about a scene's solution without any finite elements.
//!
//! This code is independent of the methods that it judges.

pub mod exact;
mod half_sine;
mod load;
mod log_kernel;

use num_complex::Complex64;

use faceoff_mesh::error::{Error, Result};
use load::Load;
use log_kernel::{ContactZone, NEGLIGIBLE};

/// Chebyshev points on a contact zone; 16 already resolve both of the paper's problems.
pub const DEFAULT_RESOLUTION: usize = 48;

/// Modes of the cosine series in the norms, for each Chebyshev point, and at least: those left out fall like k⁻⁵.
const MODES_PER_POINT: usize = 16;
const LEAST_MODES: usize = 768;

/// Terms of the load's series near y = 1 in u; those left out amount to 3e-13.
const VALUE_TERMS: usize = 10_000;
/// The same in ∇u: 3e-11.
const GRADIENT_TERMS: usize = 200_000;

/// The solution of one of the problems of the paper's section 6 on the unit square: u = 0 on y = 1, ∂ₙu = 0 on
/// x = 0 and x = 1, contact (u ≤ 0, ∂ₙu ≤ 0, u ∂ₙu = 0) on y = 0, where ∂ₙ = -∂ᵧ.
///
/// Computed by separation of variables; see the module `log_kernel`. Errors are about 1e-13 of max |u|, and 1e-11 of
/// max |∇u| next to y = 1.
#[derive(Debug, Clone)]
pub struct Reference {
    /// Intervals of x in rising order.
    pub contact_set: Vec<[f64; 2]>,
    /// ‖∇u‖² over the square.
    pub grad_norm_sq: f64,
    /// ‖u‖ over the square.
    pub l2_norm: f64,
    /// The integral of ∂ₙu over y = 0.
    pub contact_flux: f64,
    load: Load,
    zone: ContactZone,
    /// a_k e^κ/2 of the first k: of the others the share of the pressure and e^{-2κ} are 0 in this arithmetic.
    first: Vec<f64>,
}

/// exp(-x) is 0 beyond.
const UNDERFLOW: f64 = 746.0;

impl Reference {
    /// The paper's 6.1, f = -2π sin 2πx. `resolution`: Chebyshev points on the contact zone.
    ///
    /// # Errors
    /// [`Error::Solver`] if the resolution is too low (or beyond any use).
    pub fn one_zone(resolution: usize) -> Result<Self> {
        Reference::solve(Load::one_zone(), resolution)
    }

    /// The paper's 6.2, f = (2πN)² cos 2πNx, for any N ≥ 1.
    ///
    /// # Errors
    /// [`Error::Usage`] for N = 0, [`Error::Solver`] if the resolution is too low (or beyond any use).
    pub fn zones(n: u32, resolution: usize) -> Result<Self> {
        if n == 0 {
            return Err(Error::usage(
                "0 zones make the load zero",
                "ask for at least one zone",
            ));
        }
        Reference::solve(Load::zones(n), resolution)
    }

    fn solve(load: Load, resolution: usize) -> Result<Self> {
        if !(8..=1024).contains(&resolution) {
            return Err(Error::Solver {
                what: format!("a reference cannot be computed from {resolution} Chebyshev points"),
                remedy: format!("use 8 to 1024; {DEFAULT_RESOLUTION} give full precision"),
            });
        }
        let modes = LEAST_MODES.max(MODES_PER_POINT * resolution);
        let zone = ContactZone::solve(&load, resolution, modes)?;
        let (grad_norm_sq, l2_norm) = norms(&load, &zone);
        let omega = load.omega();
        let first = (1..=(UNDERFLOW / omega).ceil() as usize)
            .map(|k| zone.top_amplitude(&load, k) / (1.0 + (-2.0 * omega * k as f64).exp()))
            .collect();
        Ok(Reference {
            contact_set: contact_set(&load, zone.alpha),
            grad_norm_sq,
            l2_norm,
            contact_flux: -zone.mean_pressure,
            load,
            zone,
            first,
        })
    }

    /// f at a point.
    pub fn f(&self, x: f64) -> f64 {
        (self.load.f)(x, self.load.frequency)
    }

    /// At most so fast f turns along x, in radians a unit of length: f is one wave.
    pub fn wave_number(&self) -> f64 {
        self.load.wave_number
    }

    /// u at a point of the closed square; not a number elsewhere.
    pub fn u(&self, x: f64, y: f64) -> f64 {
        if !inside(x, y) {
            return f64::NAN;
        }
        let (theta, _) = self.load.fold(x);
        let w = (self.load.even)(theta) + (self.load.odd)(theta);
        let bottom = self
            .zone
            .potential(&self.load, theta, self.load.omega() * y);
        let [top, ..] = self.top(theta, y, VALUE_TERMS);
        w - top - bottom.re
    }

    /// ∇u at a point of the closed square; not a number elsewhere.
    pub fn grad(&self, x: f64, y: f64) -> [f64; 2] {
        if !inside(x, y) {
            return [f64::NAN; 2];
        }
        let omega = self.load.omega();
        let (theta, sign) = self.load.fold(x);
        let bottom = self.zone.potential(&self.load, theta, omega * y).derivative;
        let [_, top_x, top_y] = self.top(theta, y, GRADIENT_TERMS);
        [
            sign * omega * ((self.load.slope)(theta) - top_x - bottom.re),
            omega * (bottom.im - top_y),
        ]
    }

    /// ∂ₙu at (x, 0), x in [0, 1]; exactly 0 off the contact set.
    pub fn flux(&self, x: f64) -> f64 {
        if !inside(x, 0.0) {
            return f64::NAN;
        }
        let (theta, _) = self.load.fold(x);
        if theta >= self.zone.alpha {
            return 0.0;
        }
        -self.load.omega() * self.zone.potential(&self.load, theta, 0.0).derivative.im
    }

    /// Σ a_k cos(k theta) cosh(κy), and its derivatives by theta and by ωy.
    fn top(&self, theta: f64, y: f64, max_terms: usize) -> [f64; 3] {
        let omega = self.load.omega();
        // a_k cosh κy decays like e^{-κ(1-y)}; its share of the pressure, e^{-κ} smaller, may outlast the load's modes.
        let visible = (NEGLIGIBLE / (omega * (1.0 - y))).ceil() as usize;
        let reflected = (NEGLIGIBLE / omega).ceil() as usize;
        let terms = visible
            .min(self.load.last_mode.max(reflected))
            .min(max_terms);
        let [down, up] =
            [1.0 - y, 1.0 + y].map(|s| Complex64::from_polar((-omega * s).exp(), theta));
        let (mut down_k, mut up_k) = (Complex64::ONE, Complex64::ONE);
        let mut sums = [0.0; 3];
        for k in 1..=terms {
            down_k *= down;
            up_k *= up;
            let first = self.first.get(k - 1).copied();
            let amplitude = first.unwrap_or_else(|| (self.load.amplitude)(k));
            let both = down_k + up_k;
            sums[0] += amplitude * both.re;
            sums[1] -= amplitude * k as f64 * both.im;
            sums[2] += amplitude * k as f64 * (down_k - up_k).re;
        }
        sums
    }
}

fn inside(x: f64, y: f64) -> bool {
    (0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y)
}

fn contact_set(load: &Load, alpha: f64) -> Vec<[f64; 2]> {
    let half_width = alpha / load.omega();
    if load.frequency < 1.0 {
        return vec![[load.centre - half_width, load.centre]];
    }
    (0..=load.frequency as u32)
        .map(|j| {
            let centre = f64::from(j) / load.frequency;
            [
                (centre - half_width).max(0.0),
                (centre + half_width).min(1.0),
            ]
        })
        .collect()
}

/// ‖∇u‖² = (f, u), for u ∂ₙu = 0 on every side, and ‖u‖, by Parseval.
///
/// The modes are u_0 = -p_0(1-y), u_k = A_k(1 - cosh κy/cosh κ) - (p_k/κ) sinh κ(1-y)/cosh κ.
fn norms(load: &Load, zone: &ContactZone) -> (f64, f64) {
    let mut grad_norm_sq = 0.0;
    let mut l2_norm_sq = zone.mean_pressure.powi(2) / 3.0;
    for (k, &pressure) in zone.pressure.iter().enumerate().rev() {
        let k = k + 1;
        let kappa = load.omega() * k as f64;
        let tanh = kappa.tanh();
        let sech = 2.0 * (-kappa).exp() / (1.0 + (-2.0 * kappa).exp());
        let a = (load.amplitude)(k);
        let b = pressure / kappa;
        grad_norm_sq += 0.5 * a * kappa * (a * (kappa - tanh) - b * (1.0 - sech));
        l2_norm_sq += 0.5
            * (a * a * (1.0 - 1.5 * tanh / kappa + 0.5 * sech * sech)
                - 2.0 * a * b * ((1.0 - sech) / kappa - 0.5 * tanh * sech)
                + b * b * 0.5 * (tanh / kappa - sech * sech));
    }
    (grad_norm_sq, l2_norm_sq.sqrt())
}

#[cfg(test)]
mod tests;
