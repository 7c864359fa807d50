//! Solutions in space, in contact on z = 0.

use std::f64::consts::FRAC_PI_8;

use num_complex::Complex64;

use super::{Monomial, Point, Solution};

/// A planar solution in x and z.
#[derive(Debug, Clone, Copy)]
pub struct Extruded(pub Monomial);

impl Solution for Extruded {
    fn u(&self, [x, _, z]: Point) -> f64 {
        self.0.u([x, z, 0.0])
    }

    fn grad(&self, [x, _, z]: Point) -> [f64; 3] {
        let [gx, gz, _] = self.0.grad([x, z, 0.0]);
        [gx, 0.0, gz]
    }
}

/// A rigid sphere, contact on the disc r < a:
/// (π/8)(2a²-r²+2z²) + Im[(Z²/2+r²/4)L - ZR/4 - z(ZL-R)], Z = z+ia, R = √(r²+Z²), L = log(R+Z).
#[derive(Debug, Clone, Copy)]
pub struct HertzSphere {
    pub a: f64,
}

impl HertzSphere {
    /// r², z, Z, R, L.
    fn parts(&self, [x, y, z]: Point) -> (f64, f64, Complex64, Complex64, Complex64) {
        let square = x * x + y * y;
        let depth = Complex64::new(z.abs(), self.a);
        // R² lies in the upper half plane, on the disc at its edge: the principal root is the right one.
        let r2 = Complex64::new(square + z * z - self.a * self.a, (2.0 * z * self.a).abs());
        let r = r2.sqrt();
        (square, z.abs(), depth, r, (r + depth).ln())
    }
}

impl Solution for HertzSphere {
    fn u(&self, p: Point) -> f64 {
        let (square, z, depth, r, l) = self.parts(p);
        let potential =
            (0.5 * depth * depth + 0.25 * square) * l - 0.25 * depth * r - z * (depth * l - r);
        FRAC_PI_8 * (2.0 * self.a * self.a - square + 2.0 * z * z) + potential.im
    }

    fn grad(&self, p: Point) -> [f64; 3] {
        let (square, z, depth, r, l) = self.parts(p);
        // By r²: dR = 1/(2R), dL = 1/(2R(R+Z)).
        let (dr, dl) = (0.5 / r, 0.5 / (r * (r + depth)));
        let by_square = 0.25 * l + (0.5 * depth * depth + 0.25 * square) * dl
            - 0.25 * depth * dr
            - z * (depth * dl - dr);
        let radial = 2.0 * (by_square.im - FRAC_PI_8);
        let normal = 4.0 * FRAC_PI_8 * z + ((depth - z) * l - (depth * l - r)).im;
        [p[0] * radial, p[1] * radial, normal]
    }
}
