//! The part of data depending on only one axis that a flux on a triangle carries away.

use crate::interval::Interval;

/// Twice what rounding to nearest errs by, relative to the result.
pub(super) const STEP: f64 = f64::EPSILON;

/// τ on a triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Carried {
    /// The mean of |τ|².
    pub square: Interval,
    /// The means of s λ_i.
    pub flat: [Interval; 3],
    /// The means of s 4 λ_a λ_b, by the vertex opposite.
    pub bubbles: [Interval; 3],
}

impl Carried {
    /// The mean of s z, z = Σ z_i λ_i + Σ_F 4 b_F λ_a λ_b: of the middles, with one bound of radii and rounding.
    pub fn mean(&self, z: &[Interval], b: &[f64; 3]) -> Interval {
        let flat = self.flat.iter().zip(z);
        let flat = flat.map(|(s, z)| (s, z.mid(), z.radius()));
        let bubbles = self.bubbles.iter().zip(b).map(|(s, b)| (s, *b, 0.0));
        let (mut sum, mut off) = (0.0, 0.0);
        for (s, z, radius) in flat.chain(bubbles) {
            let (middle, size) = (s.mid(), z.abs() + radius);
            sum += middle * z;
            // Products and sums of six are rounded no more than six times.
            off += s.radius() * size + middle.abs() * (radius + 6.0 * STEP * size);
        }
        around(sum, off)
    }
}

/// The interval within this distance of a number, rounded in several steps.
pub(super) fn around(middle: f64, radius: f64) -> Interval {
    Interval::at(middle) + Interval::around_zero(1.001 * radius + f64::MIN_POSITIVE)
}
