//! Manufactured solutions: u is chosen so that the conditions hold, and f = -Δu.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::{ExactSolution, Monomial, Point, Text};

/// s, positive where the contact side is free and negative where it is in contact.
#[derive(Debug, Clone, Copy)]
pub enum Selector {
    /// cos 2πnx, 2D.
    Waves {
        /// Periods on 0 ≤ x ≤ 1.
        n: u32,
    },
    /// cos 2πx cos 2πy, 3D.
    Checker,
}

/// How u leaves zero where s does: α(s) in -α(s) and α(-s).
#[derive(Debug, Clone, Copy)]
pub enum Profile {
    /// [s-δ]₊^p where free, [-s-δ]₊^q in contact; p, q ≥ 2; grazing on |s| ≤ δ.
    Power {
        /// Exponent where free.
        p: u32,
        /// Exponent in contact.
        q: u32,
        /// δ ≥ 0, half the range of s that grazes.
        delta: f64,
    },
    /// e^{-1/s}.
    Smooth,
}

impl Profile {
    /// A profile of powers.
    pub fn power(p: u32, q: u32, delta: f64) -> Self {
        Profile::Power { p, q, delta }
    }
}

/// A function's value, first and second derivative.
type Jet = [f64; 3];

/// `[t]₊^e`
fn ramp(t: f64, e: u32) -> Jet {
    if t <= 0.0 {
        return [0.0; 3];
    }
    let n = f64::from(e);
    let power = |k: u32| t.powf(n - f64::from(k));
    [power(0), n * power(1), n * (n - 1.0) * power(2)]
}

/// e^{-1/t} for t > 0.
fn smooth_ramp(t: f64) -> Jet {
    // e^{-1000} is zero in binary64.
    let t = t.max(1e-3);
    let e = (-1.0 / t).exp();
    [e, e / t.powi(2), e * (1.0 - 2.0 * t) / t.powi(4)]
}

/// (1-y)²(1+2y): one at y = 0 with slope 0, zero at y = 1 with slope 0.
fn fade(y: f64) -> Jet {
    [
        (1.0 - y).powi(2) * (1.0 + 2.0 * y),
        -6.0 * y * (1.0 - y),
        12.0 * y - 6.0,
    ]
}

/// (-α(s) + α(-s) y)(1-y)²(1+2y), y the last coordinate.
#[derive(Debug, Clone, Copy)]
pub struct Separated {
    /// s, which decides where contact is.
    pub selector: Selector,
    /// α, which decides how smooth u is.
    pub profile: Profile,
}

impl Separated {
    /// s, its gradient and its Laplacian, and the normal coordinate's index.
    fn select(&self, [x, y, _]: Point) -> (f64, [f64; 2], f64, usize) {
        match self.selector {
            Selector::Waves { n } => {
                let w = TAU * f64::from(n);
                let (sin, cos) = (w * x).sin_cos();
                (cos, [-w * sin, 0.0], -w * w * cos, 1)
            }
            Selector::Checker => {
                let ((sx, cx), (sy, cy)) = ((TAU * x).sin_cos(), (TAU * y).sin_cos());
                let s = cx * cy;
                (s, [-TAU * sx * cy, -TAU * cx * sy], -2.0 * TAU * TAU * s, 2)
            }
        }
    }

    /// α(s) and α(-s), each by its own argument.
    fn profile(&self, s: f64) -> [Jet; 2] {
        match self.profile {
            Profile::Power { p, q, delta } => [ramp(s - delta, p), ramp(-s - delta, q)],
            Profile::Smooth => [smooth_ramp(s), smooth_ramp(-s)],
        }
    }
}

impl ExactSolution for Separated {
    fn u(&self, p: Point) -> f64 {
        let (s, _, _, normal) = self.select(p);
        let [a, b] = self.profile(s);
        let y = p[normal];
        (-a[0] + b[0] * y) * fade(y)[0]
    }

    fn grad(&self, p: Point) -> [f64; 3] {
        let (s, ds, _, normal) = self.select(p);
        let [a, b] = self.profile(s);
        let y = p[normal];
        let [fade, slope, _] = fade(y);
        let across = (-a[1] - b[1] * y) * fade;
        let up = b[0] * fade + (-a[0] + b[0] * y) * slope;
        let mut grad = [across * ds[0], across * ds[1], 0.0];
        grad[normal] = up;
        grad
    }

    fn f(&self, p: Point) -> f64 {
        let (s, ds, laplacian, normal) = self.select(p);
        let [a, b] = self.profile(s);
        let y = p[normal];
        let [fade, slope, curvature] = fade(y);
        let square = ds[0] * ds[0] + ds[1] * ds[1];
        let free = -(a[2] * square + a[1] * laplacian);
        let contact = b[2] * square - b[1] * laplacian;
        -((free + contact * y) * fade + 2.0 * b[0] * slope + (-a[0] + b[0] * y) * curvature)
    }

    fn is_piecewise(&self) -> bool {
        matches!(self.profile, Profile::Power { .. })
    }

    fn text(&self) -> Text {
        // s, |∇s|², -Δs, and the normal coordinate.
        let (s, gradient, curvature, y) = match self.selector {
            Selector::Waves { n } => {
                let w = format!("(2*pi*{n})");
                let s = format!("cos({w}*x)");
                let curvature = format!("{w}^2*{s}");
                (s, format!("({w}*sin({w}*x))^2"), curvature, "y")
            }
            Selector::Checker => {
                let s = "(cos(2*pi*x)*cos(2*pi*y))".to_owned();
                let gradient = "(2*pi)^2*((sin(2*pi*x)*cos(2*pi*y))^2+(cos(2*pi*x)*sin(2*pi*y))^2)";
                let curvature = format!("2*(2*pi)^2*{s}");
                (s, gradient.to_owned(), curvature, "z")
            }
        };
        let jet = |t: String, e: u32| match self.profile {
            Profile::Power { delta, .. } => {
                let t = if delta == 0.0 {
                    t
                } else {
                    format!("{t}-{delta}")
                };
                let (first, second) = (e.saturating_sub(1), e.saturating_sub(2));
                [
                    format!("max({t},0)^{e}"),
                    format!("{e}*max({t},0)^{first}"),
                    format!("if(0<{t},{e}*{first}*max({t},0)^{second},0)"),
                ]
            }
            Profile::Smooth => {
                let t = format!("max({t},0.001)");
                let value = format!("exp(-1/{t})");
                [
                    value.clone(),
                    format!("{value}/{t}^2"),
                    format!("{value}*(1-2*{t})/{t}^4"),
                ]
            }
        };
        let (p, q) = match self.profile {
            Profile::Power { p, q, .. } => (p, q),
            Profile::Smooth => (0, 0),
        };
        let [a, a1, a2] = jet(s.clone(), p);
        let [b, b1, b2] = jet(format!("-{s}"), q);
        let fade = format!("(1-{y})^2*(1+2*{y})");
        let u = format!("(-{a}+{b}*{y})*{fade}");
        let across = format!(
            "({a1}*{curvature}-{a2}*{gradient}+({b2}*{gradient}+{b1}*{curvature})*{y})*{fade}"
        );
        let f = format!("-({across}-12*{b}*{y}*(1-{y})+(-{a}+{b}*{y})*(12*{y}-6))");
        Text {
            g: "0".into(),
            ..Text::new(u, f)
        }
    }
}

/// (1-r²/R²)³₊ Im (z-x0)^{3/2}: contact for x > x0, and nothing beyond the radius R.
#[derive(Debug, Clone, Copy)]
pub struct CutOff {
    /// Where contact begins on y = 0.
    pub x0: f64,
    /// R: u = 0 at this distance from (x0, 0) and beyond.
    pub radius: f64,
}

impl CutOff {
    /// 1 - r²/R², not below zero.
    fn rest(&self, [x, y, _]: Point) -> f64 {
        let square = (x - self.x0).powi(2) + y * y;
        (1.0 - square / self.radius.powi(2)).max(0.0)
    }

    fn inner(&self) -> Monomial {
        Monomial::transition(1.5, self.x0)
    }
}

impl ExactSolution for CutOff {
    fn u(&self, p: Point) -> f64 {
        self.rest(p).powi(3) * self.inner().u(p)
    }

    fn grad(&self, p: Point) -> [f64; 3] {
        let rest = self.rest(p);
        let slope = -6.0 * rest * rest / self.radius.powi(2) * self.inner().u(p);
        let [gx, gy, _] = self.inner().grad(p);
        let cube = rest.powi(3);
        [
            cube * gx + slope * (p[0] - self.x0),
            cube * gy + slope * p[1],
            0.0,
        ]
    }

    fn f(&self, p: Point) -> f64 {
        // The inner function is harmonic and homogeneous of degree 3/2: Δ(χv) = v(χ'' + 4χ'/r).
        let rest = self.rest(p);
        (54.0 * rest * rest - 24.0 * rest) / self.radius.powi(2) * self.inner().u(p)
    }

    fn is_piecewise(&self) -> bool {
        true
    }

    fn text(&self) -> Text {
        let CutOff { x0, radius } = self;
        let rest = format!("max(1-((x-{x0})^2+y^2)/{radius}^2,0)");
        let inner = self.inner().text().u;
        Text {
            g: "0".into(),
            ..Text::new(
                format!("{rest}^3*{inner}"),
                format!("(54*{rest}^2-24*{rest})/{radius}^2*{inner}"),
            )
        }
    }
}

/// Solutions that a line writes down.
#[derive(Debug, Clone, Copy)]
pub enum Elementary {
    /// sin πy.
    ContactEverywhere,
    /// -cos ½πy.
    ContactNowhere,
    /// y²(1-y).
    GrazingEverywhere,
    /// x(1-x)y(1-y), contact on x = 0 and y = 0.
    TwoSidesContact,
    /// -sin ½πx cos ½πy, free on x = 1 and y = 0.
    TwoSidesFree,
}

impl ExactSolution for Elementary {
    fn u(&self, [x, y, _]: Point) -> f64 {
        match self {
            Elementary::ContactEverywhere => (PI * y).sin(),
            Elementary::ContactNowhere => -(FRAC_PI_2 * y).cos(),
            Elementary::GrazingEverywhere => y * y * (1.0 - y),
            Elementary::TwoSidesContact => x * (1.0 - x) * y * (1.0 - y),
            Elementary::TwoSidesFree => -(FRAC_PI_2 * x).sin() * (FRAC_PI_2 * y).cos(),
        }
    }

    fn grad(&self, [x, y, _]: Point) -> [f64; 3] {
        match self {
            Elementary::ContactEverywhere => [0.0, PI * (PI * y).cos(), 0.0],
            Elementary::ContactNowhere => [0.0, FRAC_PI_2 * (FRAC_PI_2 * y).sin(), 0.0],
            Elementary::GrazingEverywhere => [0.0, y * (2.0 - 3.0 * y), 0.0],
            Elementary::TwoSidesContact => [
                (1.0 - 2.0 * x) * y * (1.0 - y),
                x * (1.0 - x) * (1.0 - 2.0 * y),
                0.0,
            ],
            Elementary::TwoSidesFree => {
                let ((sx, cx), (sy, cy)) = ((FRAC_PI_2 * x).sin_cos(), (FRAC_PI_2 * y).sin_cos());
                [-FRAC_PI_2 * cx * cy, FRAC_PI_2 * sx * sy, 0.0]
            }
        }
    }

    fn f(&self, p: Point) -> f64 {
        let [x, y, _] = p;
        match self {
            Elementary::ContactEverywhere => PI * PI * self.u(p),
            Elementary::ContactNowhere => FRAC_PI_2.powi(2) * self.u(p),
            Elementary::GrazingEverywhere => 6.0 * y - 2.0,
            Elementary::TwoSidesContact => 2.0 * (x * (1.0 - x) + y * (1.0 - y)),
            Elementary::TwoSidesFree => 2.0 * FRAC_PI_2.powi(2) * self.u(p),
        }
    }

    fn text(&self) -> Text {
        let (u, f) = match self {
            Elementary::ContactEverywhere => ("sin(pi*y)", "pi^2*sin(pi*y)"),
            Elementary::ContactNowhere => ("-cos(0.5*pi*y)", "-(0.5*pi)^2*cos(0.5*pi*y)"),
            Elementary::GrazingEverywhere => ("y^2*(1-y)", "6*y-2"),
            Elementary::TwoSidesContact => ("x*(1-x)*y*(1-y)", "2*(x*(1-x)+y*(1-y))"),
            Elementary::TwoSidesFree => (
                "-sin(0.5*pi*x)*cos(0.5*pi*y)",
                "-0.5*pi^2*sin(0.5*pi*x)*cos(0.5*pi*y)",
            ),
        };
        Text {
            g: "0".into(),
            ..Text::new(u, f)
        }
    }
}
