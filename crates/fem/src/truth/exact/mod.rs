//! Exact solutions of the Signorini problem, as numbers and as text that other codes can evaluate.
//!
//! -Δu = f; u = g on Γ_D, ∂ₙu = t on Γ_N, and u ≤ ψ, ∂ₙu ≤ 0, (u-ψ) ∂ₙu = 0 on Γ_C; here g is u itself, t = 0 and ψ = 0.
//! The last coordinate, y in two and z in three dimensions, is normal to the main contact side, where it is zero.

mod catalogue;
mod harmonic;
mod in_3d;
mod manufactured;
mod zones;

pub use catalogue::catalogue;
pub use harmonic::{Gap, Hertz, Monomial, Periodic};
pub use in_3d::{Extruded, HertzSphere};
pub use manufactured::{CutOff, Elementary, Profile, Selector, Separated};
pub use zones::ManyZones;

/// A point; 2D solutions ignore the third coordinate.
pub type Point = [f64; 3];

/// A solution as functions of a point of the closed domain.
pub trait ExactSolution: Send + Sync {
    /// u at a point.
    fn u(&self, p: Point) -> f64;
    /// ∇u at a point.
    fn grad(&self, p: Point) -> [f64; 3];
    /// -Δu at a point.
    fn f(&self, _: Point) -> f64 {
        0.0
    }
    /// The same for other codes.
    fn text(&self) -> Text;
    /// Whether f may jump or bend inside the domain.
    fn is_piecewise(&self) -> bool {
        false
    }
}

/// The condition that is prescribed on a side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// u = g.
    Dirichlet,
    /// ∂ₙu = t.
    Neumann,
    /// u ≤ ψ, ∂ₙu ≤ 0, (u-ψ) ∂ₙu = 0.
    Contact,
}

/// A side of the box, or the part of it with x in `range`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Side {
    /// The condition on it.
    pub kind: Kind,
    /// The coordinate that is constant on it.
    pub axis: usize,
    /// At the upper end of that coordinate, or at the lower.
    pub upper: bool,
    /// The part's interval of x; none: the whole side.
    pub range: Option<[f64; 2]>,
}

/// The data of a solution as expressions in x, y and, in 3D, z: + - * / ^, pi, the elementary functions, min, max, and
/// `if(a < b, c, d)`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Text {
    /// The solution.
    pub u: String,
    /// -Δu
    pub f: String,
    /// u on Γ_D.
    pub g: String,
    /// ∂ₙu on Γ_N.
    pub t: String,
    /// The obstacle on Γ_C.
    pub psi: String,
}

impl Text {
    fn new(u: impl Into<String>, f: impl Into<String>) -> Self {
        let u = u.into();
        Text {
            g: u.clone(),
            u,
            f: f.into(),
            t: "0".into(),
            psi: "0".into(),
        }
    }

    /// The data of a 2D solution in 3D, where z takes the place of y.
    fn extruded(self) -> Self {
        // No function's name has a y.
        let raise = |text: String| text.replace('y', "z");
        Text {
            u: raise(self.u),
            f: raise(self.f),
            g: raise(self.g),
            t: raise(self.t),
            psi: raise(self.psi),
        }
    }
}

/// Reasons that limit the order at which any method can approach a solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regularity {
    /// s with u in H^(s-ε) for every ε > 0 and not in H^s; infinite where u is smooth.
    pub sobolev: f64,
    /// Whether Γ_C changes between contact and no contact, or meets Γ_D, inside a flat side. The linearised
    /// problem then has solutions in H^(3/2-ε) only, else in H².
    pub changes: bool,
}

impl Regularity {
    /// Smooth, and nothing changes along Γ_C.
    pub const SMOOTH: Self = Regularity {
        sobolev: f64::INFINITY,
        changes: false,
    };

    /// In H^(s-ε), with a transition on Γ_C.
    pub const fn transition(sobolev: f64) -> Self {
        Regularity {
            sobolev,
            changes: true,
        }
    }
}

/// A solution on a box, with its boundary parts.
pub struct Benchmark {
    /// Usable as a file name.
    pub name: &'static str,
    /// Its purpose.
    pub purpose: &'static str,
    /// The reason that limits the order of any method.
    pub regularity: Regularity,
    /// 2 or 3.
    pub dimension: usize,
    /// The box's corner of the lowest coordinates.
    pub lower: Point,
    /// The box's corner of the highest coordinates; 2D boxes leave the third at 0.
    pub upper: Point,
    /// Every side of the box, in the order of the axes, lower before upper.
    pub sides: Vec<Side>,
    /// u, ∇u and f as numbers.
    pub solution: Box<dyn ExactSolution>,
    /// The same data as text.
    pub text: Text,
}

impl Benchmark {
    /// u at a point.
    pub fn u(&self, p: Point) -> f64 {
        self.solution.u(p)
    }

    /// ∇u at a point.
    pub fn grad(&self, p: Point) -> [f64; 3] {
        self.solution.grad(p)
    }

    /// -Δu at a point.
    pub fn f(&self, p: Point) -> f64 {
        self.solution.f(p)
    }

    /// The Dirichlet data.
    pub fn g(&self, p: Point) -> f64 {
        self.solution.u(p)
    }

    /// The Neumann data: all of these solutions are symmetric about their Neumann sides.
    pub fn t(&self, _: Point) -> f64 {
        0.0
    }

    /// The obstacle.
    pub fn psi(&self, _: Point) -> f64 {
        0.0
    }

    /// ∂ₙu on a side.
    pub fn flux(&self, side: &Side, p: Point) -> f64 {
        let slope = self.grad(p).get(side.axis).copied().unwrap_or(f64::NAN);
        if side.upper { slope } else { -slope }
    }
}

#[cfg(test)]
mod tests;
