//! 3D solutions, in contact on z = 0.

use std::f64::consts::FRAC_PI_8;

use num_complex::Complex64;

use super::{ExactSolution, Point, Text};

/// A 2D solution in x and z.
#[derive(Debug, Clone, Copy)]
pub struct Extruded<S>(pub S);

impl<S: ExactSolution> ExactSolution for Extruded<S> {
    fn u(&self, [x, _, z]: Point) -> f64 {
        self.0.u([x, z, 0.0])
    }

    fn grad(&self, [x, _, z]: Point) -> [f64; 3] {
        let [gx, gz, _] = self.0.grad([x, z, 0.0]);
        [gx, 0.0, gz]
    }

    fn f(&self, [x, _, z]: Point) -> f64 {
        self.0.f([x, z, 0.0])
    }

    fn text(&self) -> Text {
        self.0.text().extruded()
    }

    fn is_piecewise(&self) -> bool {
        self.0.is_piecewise()
    }
}

/// A rigid sphere, contact on the disc r < a:
/// (π/8)(2a²-r²+2z²) + Im[(Z²/2+r²/4)L - ZR/4 - z(ZL-R)], Z = z+ia, R = √(r²+Z²), L = log(R+Z).
#[derive(Debug, Clone, Copy)]
pub struct HertzSphere {
    /// The radius of the contact disc.
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

impl ExactSolution for HertzSphere {
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

    /// The same in real numbers, R = p + iq: Z²/2-zZ is real, so that the imaginary part above is
    /// (r²/4-(z²+a²)/2) arg(R+Z) + ¾zq - ¼ap.
    fn text(&self) -> Text {
        let a = self.a;
        // R² = A + iB. The larger of p and q is the root, the other B over twice that: no digits cancel.
        let (real, imaginary) = (format!("(x^2+y^2+z^2-{a}^2)"), format!("(2*{a}*z)"));
        let root = format!("sqrt(0.5*(sqrt({real}^2+{imaginary}^2)+abs({real})))");
        let other = format!("{imaginary}/(2*max({root},1e-300))");
        let p = format!("if({real}>0,{root},{other})");
        let q = format!("if({real}>0,{other},{root})");
        Text::new(
            format!(
                "pi/8*(2*{a}^2-x^2-y^2+2*z^2)+(0.25*(x^2+y^2)-0.5*(z^2+{a}^2))*atan2({q}+{a},{p}+z)+0.75*z*{q}-0.25*{a}*{p}"
            ),
            "0",
        )
    }
}
