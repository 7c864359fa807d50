//! The paper's 6.2 in closed form.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use super::{ExactSolution, Point, Text};

/// f = ω² cos ωx, ω = 2πN, on the unit square with the paper's sides, N + 1 zones about x = j/N.
///
/// u = [1 - cosh ω(y-½)/cosh ½ω - c cosh ωy] cos ωx + T Re{2it(1-s)/(cos ½ωz + r) + 2s log((r-it)/√s)}, T = tanh ½ω,
/// t = sin ½ωz, r = √(s-t²), c = T (1-s)² e^{-ω}/cosh ω, where ωs = 1 - s + s ln s; contact where |sin ½ωx| < √s.
/// What the contact zones send reaches y = 1 with e^{-ω} in the first mode, which c takes away there; the second mode, and what c
/// does to y = 0, are the error: about e^{-4πN}, below rounding from N = 3 on. Without c it would be e^{-2πN} at y = 1.
///
/// Everything that grows with y is stored in units of e^{½ωy}, so that nothing overflows.
#[derive(Debug, Clone, Copy)]
pub struct ManyZones {
    n: u32,
    s: f64,
}

impl ManyZones {
    /// With n zones of contact.
    pub fn new(n: u32) -> Self {
        let omega = TAU * f64::from(n);
        // Newton from the left on a concave, rising function.
        let mut s = 0.1 / omega;
        for _ in 0..60 {
            s -= (omega * s - 1.0 + s - s * s.ln()) / (omega - s.ln());
        }
        ManyZones { n, s }
    }

    /// Half the width of a zone.
    pub fn half_width(&self) -> f64 {
        2.0 / self.omega() * self.s.sqrt().asin()
    }

    /// ‖∇u‖².
    pub fn grad_norm_sq(&self) -> f64 {
        let omega = self.omega();
        let tanh = (0.5 * omega).tanh();
        let free = tanh * tanh * omega.tanh() * (1.0 - self.s).powi(2) / omega;
        0.5 * omega * omega * (free + 1.0 - 2.0 * tanh / omega)
    }

    /// ∫ ∂ₙu over y = 0.
    pub fn contact_flux(&self) -> f64 {
        -self.omega() * (0.5 * self.omega()).tanh() * self.s
    }

    fn omega(&self) -> f64 {
        TAU * f64::from(self.n)
    }

    /// The factor of cos ωx in u, and its derivative by y.
    fn cosine_factor(&self, y: f64) -> [f64; 2] {
        let omega = self.omega();
        let decay = |distance: f64| (-omega * distance).exp();
        let echo = (0.5 * omega).tanh() * (1.0 - self.s).powi(2) * decay(1.0) / (1.0 + decay(2.0));
        let load = 1.0 / (1.0 + decay(1.0));
        [
            1.0 - load * (decay(1.0 - y) + decay(y)) - echo * (decay(1.0 - y) + decay(1.0 + y)),
            -omega
                * (load * (decay(1.0 - y) - decay(y)) + echo * (decay(1.0 - y) - decay(1.0 + y))),
        ]
    }

    /// t, cos ½ωz and r on the half period that x folds to, all times q = e^{-½ωy}; q, and the sign of dx there.
    fn parts(&self, x: f64, y: f64) -> (Complex64, Complex64, Complex64, f64, f64) {
        let half = 0.5 * self.omega();
        let (sin, cos) = (half * x).sin_cos();
        let sign = if sin * cos < 0.0 { -1.0 } else { 1.0 };
        let q = (-half * y.abs()).exp();
        let (sinh, cosh) = (0.5 * (1.0 - q * q), 0.5 * (1.0 + q * q));
        let t = Complex64::new(sin.abs() * cosh, cos.abs() * sinh);
        let cosine = Complex64::new(cos.abs() * cosh, -sin.abs() * sinh);
        let square = self.s * q * q - t * t;
        let r = Complex64::new(square.re, -square.im.abs()).sqrt();
        (t, cosine, r, q, sign)
    }
}

impl ExactSolution for ManyZones {
    fn u(&self, [x, y, _]: Point) -> f64 {
        let omega = self.omega();
        let (t, cosine, r, _, _) = self.parts(x, y);
        let ratio = 2.0 * Complex64::I * t * (1.0 - self.s) / (cosine + r);
        let logarithm = ((r - Complex64::I * t) / self.s.sqrt()).ln() + 0.5 * omega * y.abs();
        self.cosine_factor(y)[0] * (omega * x).cos()
            + (PI * f64::from(self.n)).tanh() * (ratio + 2.0 * self.s * logarithm).re
    }

    fn grad(&self, [x, y, _]: Point) -> [f64; 3] {
        let omega = self.omega();
        let s = self.s;
        let (t, cosine, r, q, sign) = self.parts(x, y);
        let strength = omega * (0.5 * omega).tanh();
        // cos ωz - 2r cos ½ωz + s without its cancellation.
        let slope = (q * (1.0 - s)).powi(2) / (q * q * (1.0 + s) - 2.0 * t * t + 2.0 * r * cosine);
        let d = Complex64::I * strength * (slope - s);
        let [factor, factor_slope] = self.cosine_factor(y);
        [
            sign * d.re - factor * omega * (omega * x).sin(),
            factor_slope * (omega * x).cos() - d.im,
            0.0,
        ]
    }

    fn f(&self, [x, ..]: Point) -> f64 {
        self.omega().powi(2) * (self.omega() * x).cos()
    }

    fn text(&self) -> Text {
        let (n, s) = (self.n, self.s);
        let (phase, omega) = (format!("pi*{n}"), format!("(2*pi*{n})"));
        let [sin, cos] = ["sin", "cos"].map(|name| format!("abs({name}({phase}*x))"));
        let q = format!("exp(-2*{phase}*y)");
        let [sinh, cosh] = ["-", "+"].map(|sign| format!("(0.5*(1{sign}{q}))"));
        let (t_re, t_im) = (format!("{sin}*{cosh}"), format!("{cos}*{sinh}"));
        let (square_re, square_im) = (
            format!("({s:e}*{q}-({t_re})^2+({t_im})^2)"),
            format!("(2*{t_re}*{t_im})"),
        );
        let modulus = format!("({square_re}^2+{square_im}^2)^0.25");
        let angle = format!("(0.5*atan2({square_im},{square_re}))");
        // r = r_re - i r_im.
        let (r_re, r_im) = (
            format!("{modulus}*cos{angle}"),
            format!("{modulus}*sin{angle}"),
        );
        let (d_re, d_im) = (
            format!("({cos}*{cosh}+{r_re})"),
            format!("({sin}*{sinh}+{r_im})"),
        );
        let ratio = format!("({t_re}*{d_im}+{t_im}*{d_re})/({d_re}^2+{d_im}^2)");
        let logarithm = format!("(log((({r_re}+{t_im})^2+({r_im}+{t_re})^2)/{s:e})+{omega}*y)");
        let decay = |distance: &str| format!("exp(-{omega}*({distance}))");
        let [far, near, beyond] = ["1-y", "y", "1+y"].map(decay);
        let [once, twice] = ["1", "2"].map(decay);
        let echo = format!("tanh({phase})*(1-{s:e})^2*{once}*({far}+{beyond})/(1+{twice})");
        let load = format!("(1-({far}+{near})/(1+{once})-{echo})*cos({omega}*x)");
        Text {
            g: "0".into(),
            ..Text::new(
                format!("{load}+tanh({phase})*({s:e}*{logarithm}-2*(1-{s:e})*{ratio})"),
                format!("{omega}^2*cos({omega}*x)"),
            )
        }
    }
}
