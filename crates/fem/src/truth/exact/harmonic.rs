//! Harmonic solutions: u = Re F(z), z = x + iy, ∇u = (Re F', -Im F').

use std::f64::consts::{FRAC_PI_2, PI};

use num_complex::Complex64;

use super::{ExactSolution, Point, Text};

const I: Complex64 = Complex64::I;

/// z in the closed upper half plane; -0 would change the side of a branch cut.
fn upper(x: f64, y: f64) -> Complex64 {
    Complex64::new(x, y.abs())
}

fn from_derivative(d: Complex64) -> [f64; 3] {
    [d.re, -d.im, 0.0]
}

/// Re c (z - x0)^e, with the argument in [0, π].
#[derive(Debug, Clone, Copy)]
pub struct Monomial {
    factor: Complex64,
    exponent: f64,
    x0: f64,
}

impl Monomial {
    fn new(factor: Complex64, exponent: f64, x0: f64) -> Self {
        Monomial {
            factor,
            exponent,
            x0,
        }
    }

    /// Im (z-x0)^e, e = 3/2, 7/2, 11/2, …: contact for x > x0.
    pub fn transition(exponent: f64, x0: f64) -> Self {
        Monomial::new(-I, exponent, x0)
    }

    /// -Re z²: free, touching at 0.
    pub fn touch() -> Self {
        Monomial::new(-Complex64::ONE, 2.0, 0.0)
    }

    /// Im z³: in contact, without pressure at 0.
    pub fn lift() -> Self {
        Monomial::new(-I, 3.0, 0.0)
    }

    /// -Re z^{1/2}: Γ_D for x < 0 meets a free Γ_C.
    pub fn meeting() -> Self {
        Monomial::new(-Complex64::ONE, 0.5, 0.0)
    }
}

impl ExactSolution for Monomial {
    fn u(&self, [x, y, _]: Point) -> f64 {
        (self.factor * upper(x - self.x0, y).powf(self.exponent)).re
    }

    fn grad(&self, [x, y, _]: Point) -> [f64; 3] {
        let z = upper(x - self.x0, y);
        from_derivative(self.factor * self.exponent * z.powf(self.exponent - 1.0))
    }

    fn text(&self) -> Text {
        let Monomial {
            factor,
            exponent: e,
            x0,
        } = self;
        let (sign, wave) = if factor.re == 0.0 {
            ("", "sin")
        } else {
            ("-", "cos")
        };
        let x = if *x0 == 0.0 {
            "x".to_owned()
        } else {
            format!("(x-{x0})")
        };
        let half = 0.5 * e;
        Text::new(
            format!("{sign}({x}^2+y^2)^{half}*{wave}({e}*atan2(y,{x}))"),
            "0",
        )
    }
}

/// √(z-a)√(z+a), arguments in [0, π].
fn root(z: Complex64, a: f64) -> Complex64 {
    (z - a).sqrt() * (z + a).sqrt()
}

/// The square of |√(z-a)√(z+a)|, and twice its argument, as text.
fn root_text(a: f64) -> [String; 2] {
    [
        format!("sqrt(((x-{a})^2+y^2)*((x+{a})^2+y^2))"),
        format!("(atan2(y,x-{a})+atan2(y,x+{a}))"),
    ]
}

/// -Re (a²-z²)^{3/2}: contact for |x| > a.
#[derive(Debug, Clone, Copy)]
pub struct Gap {
    /// Half the width of the gap, without contact.
    pub a: f64,
}

impl ExactSolution for Gap {
    fn u(&self, [x, y, _]: Point) -> f64 {
        -(-I * root(upper(x, y), self.a)).powu(3).re
    }

    fn grad(&self, [x, y, _]: Point) -> [f64; 3] {
        let z = upper(x, y);
        from_derivative(3.0 * z * (-I * root(z, self.a)))
    }

    fn text(&self) -> Text {
        let [square, angle] = root_text(self.a);
        Text::new(format!("-{square}^1.5*cos(1.5*({angle}-pi))"), "0")
    }
}

/// A rigid cylinder: -½ Re[z√(z²-a²) - a² log((z+√(z²-a²))/a)], contact for |x| < a.
#[derive(Debug, Clone, Copy)]
pub struct Hertz {
    /// Half the width of the contact.
    pub a: f64,
}

impl ExactSolution for Hertz {
    fn u(&self, [x, y, _]: Point) -> f64 {
        let z = upper(x, y);
        let r = root(z, self.a);
        -0.5 * (z * r - self.a * self.a * ((z + r) / self.a).ln()).re
    }

    fn grad(&self, [x, y, _]: Point) -> [f64; 3] {
        from_derivative(-root(upper(x, y), self.a))
    }

    fn text(&self) -> Text {
        let a = self.a;
        let [square, angle] = root_text(a);
        let (re, im) = (
            format!("sqrt({square})*cos(0.5*{angle})"),
            format!("sqrt({square})*sin(0.5*{angle})"),
        );
        let logarithm = format!("log(((x+{re})^2+(y+{im})^2)/{a}^2)");
        Text::new(format!("-0.5*(x*{re}-y*{im}-0.5*{a}^2*{logarithm})"), "0")
    }
}

/// -(2/πn) Re[ζq - c² log((ζ+q)/c)], ζ = cos(πnz/2), c = cos(πa/2), q = √(ζ²-c²), on x in [0, 1]: contact where the
/// distance of nx from the nearest even number exceeds a.
#[derive(Debug, Clone, Copy)]
pub struct Periodic {
    /// In (0, 1); a/n is half the width of a gap.
    pub a: f64,
    /// Half-periods on 0 ≤ x ≤ 1.
    pub n: u32,
}

impl Periodic {
    /// ζ, q, and sin(πnz/2), on the quarter period that x folds to, and the sign of dx there.
    fn parts(&self, [x, y, _]: Point) -> (Complex64, Complex64, Complex64, f64) {
        let phase = FRAC_PI_2 * f64::from(self.n);
        let (sin, cos) = (phase * x).sin_cos();
        let sign = if sin * cos < 0.0 { -1.0 } else { 1.0 };
        let (sinh, cosh) = ((phase * y.abs()).sinh(), (phase * y.abs()).cosh());
        let zeta = Complex64::new(cos.abs() * cosh, -sin.abs() * sinh);
        let sine = Complex64::new(sin.abs() * cosh, cos.abs() * sinh);
        let c = (FRAC_PI_2 * self.a).cos();
        // c - ζ lies in the upper half plane.
        let below = Complex64::new(c - zeta.re, zeta.im.abs());
        let q = -I * below.sqrt() * (zeta + c).sqrt();
        (zeta, q, sine, sign)
    }
}

impl ExactSolution for Periodic {
    fn u(&self, p: Point) -> f64 {
        let (zeta, q, ..) = self.parts(p);
        let c = (FRAC_PI_2 * self.a).cos();
        -2.0 / (PI * f64::from(self.n)) * (zeta * q - c * c * ((zeta + q) / c).ln()).re
    }

    fn grad(&self, p: Point) -> [f64; 3] {
        let (_, q, sine, sign) = self.parts(p);
        let [gx, gy, gz] = from_derivative(2.0 * sine * q);
        [sign * gx, gy, gz]
    }

    fn text(&self) -> Text {
        let n = self.n;
        let phase = format!("0.5*pi*{n}");
        let c = format!("cos(0.5*pi*{})", self.a);
        let re = format!("(abs(cos({phase}*x))*cosh({phase}*y))");
        let im = format!("(abs(sin({phase}*x))*sinh({phase}*y))");
        let modulus = format!("((({c}-{re})^2+{im}^2)*(({c}+{re})^2+{im}^2))^0.25");
        let angle = format!("(0.5*(atan2({im},{c}-{re})-atan2({im},{c}+{re})-pi))");
        let (q_re, q_im) = (
            format!("{modulus}*cos{angle}"),
            format!("{modulus}*sin{angle}"),
        );
        let logarithm = format!("log((({re}+{q_re})^2+({q_im}-{im})^2)/{c}^2)");
        Text::new(
            format!("-2/(pi*{n})*({re}*{q_re}+{im}*{q_im}-0.5*{c}^2*{logarithm})"),
            "0",
        )
    }
}
