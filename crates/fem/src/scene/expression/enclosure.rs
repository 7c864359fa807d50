//! An expression over a whole box: intervals that hold all its values, first and second derivatives there, by forward
//! automatic differentiation in interval arithmetic.
//!
//! Where a condition of `if` is not decided on all of the box, its value is the hull of both branches and nothing is
//! known of its derivatives: a jump may be inside. `abs`, `min` and `max` are Lipschitz continuous: where they are not
//! decided, the gradient is the hull of both sides (F. H. Clarke, Optimization and Nonsmooth Analysis, 1983).

use super::gradient::Step;
use super::{Comparison, Expression, Function, Node, Operator};
use crate::interval::Interval;

/// How many derivatives are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd)]
pub enum Order {
    Value,
    Gradient,
    Hessian,
}

/// What an expression is on a box.
#[derive(Debug, Clone, Copy)]
pub struct Enclosure {
    pub value: Interval,
    pub gradient: [Interval; 3],
    /// ∂²/∂x², ∂²/∂x∂y, ∂²/∂y², ∂²/∂x∂z, ∂²/∂y∂z, ∂²/∂z²
    pub hessian: [Interval; 6],
    /// May it jump inside the box?
    pub may_jump: bool,
}

/// The axes of each second derivative.
pub const AXES: [[usize; 2]; 6] = [[0, 0], [0, 1], [1, 1], [0, 2], [1, 2], [2, 2]];

impl Expression {
    /// Its values and derivatives along the first `dim` axes at all points of a box.
    pub fn enclosure(&self, at: [Interval; 3], dim: usize, order: Order) -> Enclosure {
        self.over(at, dim, order, None)
    }

    /// The same almost everywhere on a simplex of dimension `simplex` that spans the box: where a condition of `if` turns
    /// over on a side of the box alone, it is decided.
    pub fn enclosure_inside(
        &self,
        at: [Interval; 3],
        dim: usize,
        order: Order,
        simplex: usize,
    ) -> Enclosure {
        let wide = at.map(|x| x.low < x.high);
        let spans = wide.iter().filter(|wide| **wide).count() == simplex;
        self.over(at, dim, order, spans.then_some(wide))
    }

    /// `inside`: the axes along which a simplex with inner points spans the box, where only those count.
    fn over(
        &self,
        at: [Interval; 3],
        dim: usize,
        order: Order,
        inside: Option<[bool; 3]>,
    ) -> Enclosure {
        let size = Size::new(dim, order);
        let mut all: Vec<Enclosure> = Vec::with_capacity(self.steps.0.len());
        for step in &self.steps.0 {
            all.push(match *step {
                Step::Number(_, [low, high]) => {
                    Enclosure::constant(Interval::new(f64::from_bits(low), f64::from_bits(high)))
                }
                Step::Coordinate(axis) => {
                    let mut coordinate = Enclosure::constant(at[axis]);
                    coordinate.gradient[axis] = Interval::ONE;
                    coordinate
                }
                Step::Negative(a) => all[a].negative(),
                Step::Binary(operator, a, b) => size.two_operands(operator, &all[a], &all[b]),
                Step::One(function, a) => size.one_argument(function, &all[a]),
                Step::Two(function, a, b) => size.two_arguments(function, &all[a], &all[b]),
                Step::If(comparison, [a, b, then, otherwise]) => {
                    let strictly = comparison.decided(all[a].value, all[b].value);
                    let touching =
                        || inside.and_then(|wide| touches(comparison, &all[a], &all[b], wide));
                    match strictly.or_else(touching) {
                        Some(true) => all[then],
                        Some(false) => all[otherwise],
                        None => all[then].or(&all[otherwise]),
                    }
                }
            });
        }
        all.pop().unwrap_or(Enclosure::constant(Interval::WHOLE))
    }
}

/// Does a comparison hold almost everywhere, or almost nowhere, where both sides meet at an end? Only where they differ
/// by a function with a slope, which is 0 on no set with inner points.
fn touches(comparison: Comparison, a: &Enclosure, b: &Enclosure, wide: [bool; 3]) -> Option<bool> {
    let has_slope = (0..3).any(|k| wide[k] && !(a.gradient[k] - b.gradient[k]).contains(0.0));
    if !has_slope || a.may_jump || b.may_jump {
        return None;
    }
    let (below, above) = (a.value.high <= b.value.low, a.value.low >= b.value.high);
    let is_less = matches!(comparison, Comparison::Less | Comparison::LessEqual);
    match (below, above) {
        (true, _) => Some(is_less),
        (_, true) => Some(!is_less),
        _ => None,
    }
}

impl Comparison {
    /// Does it hold for all numbers of both, or for none?
    fn decided(self, a: Interval, b: Interval) -> Option<bool> {
        let (yes, no) = match self {
            Comparison::Less => (a.high < b.low, a.low >= b.high),
            Comparison::LessEqual => (a.high <= b.low, a.low > b.high),
            Comparison::Greater => (a.low > b.high, a.high <= b.low),
            Comparison::GreaterEqual => (a.low >= b.high, a.high < b.low),
        };
        match (yes, no) {
            (true, _) => Some(true),
            (_, true) => Some(false),
            _ => None,
        }
    }
}

impl Node {
    /// The value of what no coordinate is in.
    pub(super) fn enclosure(&self) -> Interval {
        let size = Size::new(0, Order::Value);
        let of = |node: &Node| Enclosure::constant(node.enclosure());
        match self {
            Node::Number(value) if value.is_nan() => Interval::WHOLE,
            Node::Number(value) => Interval::at(*value),
            Node::Pi => Interval::PI,
            Node::Coordinate(_) => Interval::WHOLE,
            Node::Negative(a) => -a.enclosure(),
            Node::Binary(operator, a, b) => size.two_operands(*operator, &of(a), &of(b)).value,
            Node::Call(function, arguments) => match &arguments[..] {
                [a] => size.one_argument(*function, &of(a)).value,
                [a, b, ..] => size.two_arguments(*function, &of(a), &of(b)).value,
                [] => Interval::WHOLE,
            },
            Node::If(comparison, parts) => {
                let [a, b, then, otherwise] = parts.each_ref().map(Node::enclosure);
                match comparison.decided(a, b) {
                    Some(true) => then,
                    Some(false) => otherwise,
                    None => then.hull(otherwise),
                }
            }
        }
    }
}

/// How many derivatives are kept.
#[derive(Clone, Copy)]
struct Size {
    first: usize,
    second: usize,
}

impl Enclosure {
    fn constant(value: Interval) -> Self {
        Enclosure {
            value,
            gradient: [Interval::ZERO; 3],
            hessian: [Interval::ZERO; 6],
            may_jump: false,
        }
    }

    fn negative(&self) -> Self {
        Enclosure {
            value: -self.value,
            gradient: self.gradient.map(|g| -g),
            hessian: self.hessian.map(|h| -h),
            may_jump: self.may_jump,
        }
    }

    /// Either of both, with a jump where one becomes the other.
    fn or(&self, other: &Self) -> Self {
        Enclosure {
            value: self.value.hull(other.value),
            gradient: [Interval::WHOLE; 3],
            hessian: [Interval::WHOLE; 6],
            may_jump: true,
        }
    }

    /// Either of both, with a kink where one becomes the other.
    fn or_kink(&self, other: &Self, value: Interval) -> Self {
        let pairs = |k: usize| self.gradient[k].hull(other.gradient[k]);
        Enclosure {
            value,
            gradient: std::array::from_fn(pairs),
            hessian: [Interval::WHOLE; 6],
            may_jump: self.may_jump || other.may_jump,
        }
    }
}

impl Size {
    fn new(dim: usize, order: Order) -> Self {
        let first = if order >= Order::Gradient { dim } else { 0 };
        let second = if order >= Order::Hessian {
            dim * (dim + 1) / 2
        } else {
            0
        };
        Size { first, second }
    }

    /// g(a) from its value and its derivatives.
    fn chain(self, a: &Enclosure, value: Interval, d: Interval, dd: Interval) -> Enclosure {
        let mut of = Enclosure::constant(value);
        of.may_jump = a.may_jump;
        for k in 0..self.first {
            of.gradient[k] = d * a.gradient[k];
        }
        for k in 0..self.second {
            let [i, j] = AXES[k];
            of.hessian[k] = d * a.hessian[k] + dd * product(a.gradient, i, a.gradient, j);
        }
        of
    }

    /// g(a, b) from its value, its first derivatives, and ∂²/∂a², ∂²/∂a∂b, ∂²/∂b².
    fn chain2(
        self,
        a: &Enclosure,
        b: &Enclosure,
        value: Interval,
        [da, db]: [Interval; 2],
        [daa, dab, dbb]: [Interval; 3],
    ) -> Enclosure {
        let mut of = Enclosure::constant(value);
        of.may_jump = a.may_jump || b.may_jump;
        for k in 0..self.first {
            of.gradient[k] = da * a.gradient[k] + db * b.gradient[k];
        }
        for k in 0..self.second {
            let [i, j] = AXES[k];
            let mixed = a.gradient[i] * b.gradient[j] + a.gradient[j] * b.gradient[i];
            of.hessian[k] = da * a.hessian[k]
                + db * b.hessian[k]
                + daa * product(a.gradient, i, a.gradient, j)
                + dab * mixed
                + dbb * product(b.gradient, i, b.gradient, j);
        }
        of
    }

    fn two_operands(self, operator: Operator, a: &Enclosure, b: &Enclosure) -> Enclosure {
        let (x, y) = (a.value, b.value);
        match operator {
            Operator::Add => {
                let mut of = *a;
                of.value = x + y;
                of.may_jump |= b.may_jump;
                for k in 0..self.first {
                    of.gradient[k] += b.gradient[k];
                }
                for k in 0..self.second {
                    of.hessian[k] += b.hessian[k];
                }
                of
            }
            Operator::Subtract => self.two_operands(Operator::Add, a, &b.negative()),
            Operator::Multiply => {
                let zero = Interval::ZERO;
                self.chain2(a, b, x * y, [y, x], [zero, Interval::ONE, zero])
            }
            Operator::Divide => {
                let r = y.recip();
                let (square, zero) = (r.square(), Interval::ZERO);
                let second = [zero, -square, 2.0 * (x * (square * r))];
                self.chain2(a, b, x / y, [r, -(x * square)], second)
            }
            Operator::Power => self.power(a, b),
        }
    }

    fn power(self, a: &Enclosure, b: &Enclosure) -> Enclosure {
        let (x, p) = (a.value, b.value);
        if p.low != p.high {
            let log = self.one_argument(Function::Log, a);
            let exponent = self.two_operands(Operator::Multiply, b, &log);
            return self.one_argument(Function::Exp, &exponent);
        }
        let power = |k: f64| match p.low - k {
            0.0 => Interval::ONE,
            q => x.power(Interval::at(q)),
        };
        // 1 and 2 are whole numbers below 2^53, but p - 1 may round.
        let lower = |k: f64| {
            let exact = p - Interval::at(k);
            if exact.low == exact.high {
                power(k)
            } else {
                x.power(exact)
            }
        };
        let d = p * lower(1.0);
        let dd = p * (p - Interval::ONE) * lower(2.0);
        let of_zero = |c: Interval, d: Interval| if c.is_zero() { Interval::ZERO } else { d };
        let d = of_zero(p, d);
        let dd = of_zero(p * (p - Interval::ONE), dd);
        self.chain(a, power(0.0), d, dd)
    }

    fn one_argument(self, function: Function, a: &Enclosure) -> Enclosure {
        let x = a.value;
        let one = Interval::ONE;
        let wants = self.first > 0;
        let unknown = Interval::WHOLE;
        let (value, d, dd) = match function {
            Function::Sin => {
                let (s, c) = (x.sin(), if wants { x.cos() } else { unknown });
                (s, c, -s)
            }
            Function::Cos => {
                let (s, c) = (if wants { x.sin() } else { unknown }, x.cos());
                (c, -s, -c)
            }
            Function::Tan => {
                let t = x.tan();
                let d = one + t.square();
                (t, d, 2.0 * (t * d))
            }
            Function::Asin | Function::Acos => {
                let r = (one - x.square()).sqrt().recip();
                let dd = x * (r.square() * r);
                match function {
                    Function::Asin => (x.asin(), r, dd),
                    _ => (x.acos(), -r, -dd),
                }
            }
            Function::Atan => {
                let r = (one + x.square()).recip();
                (x.atan(), r, -2.0 * (x * r.square()))
            }
            Function::Sinh => (x.sinh(), x.cosh(), x.sinh()),
            Function::Cosh => (x.cosh(), x.sinh(), x.cosh()),
            Function::Tanh => {
                let t = x.tanh();
                let d = one - t.square();
                (t, d, -2.0 * (t * d))
            }
            Function::Exp => {
                let e = x.exp();
                (e, e, e)
            }
            Function::Log => {
                let r = x.recip();
                (x.ln(), r, -r.square())
            }
            Function::Sqrt => {
                let r = x.sqrt();
                let q = r.recip();
                (r, 0.5 * q, -0.25 * (q.square() * q))
            }
            Function::Abs if x.low >= 0.0 => return *a,
            Function::Abs if x.high <= 0.0 => return a.negative(),
            Function::Abs => return a.or_kink(&a.negative(), x.abs()),
            // The parser counts arguments: these have two.
            Function::Atan2 | Function::Min | Function::Max => (unknown, unknown, unknown),
        };
        self.chain(a, value, d, dd)
    }

    fn two_arguments(self, function: Function, a: &Enclosure, b: &Enclosure) -> Enclosure {
        let (x, y) = (a.value, b.value);
        match function {
            Function::Atan2 => {
                // The angle of (y, x): x is the ordinate here.
                let mut of = if self.first == 0 {
                    Enclosure::constant(x.atan2(y))
                } else {
                    let r = (x.square() + y.square()).recip();
                    let square = r.square();
                    let cross = 2.0 * (x * y * square);
                    let mixed = (x.square() - y.square()) * square;
                    self.chain2(a, b, x.atan2(y), [y * r, -(x * r)], [-cross, mixed, cross])
                };
                of.may_jump |= a.may_jump
                    || b.may_jump
                    || (x.contains(0.0) && y.low <= 0.0 && !(x.low >= 0.0 && y.high < 0.0));
                of
            }
            Function::Min if x.high <= y.low => *a,
            Function::Min if y.high <= x.low => *b,
            Function::Max if x.low >= y.high => *a,
            Function::Max if y.low >= x.high => *b,
            Function::Min => a.or_kink(b, x.min(y)),
            Function::Max => a.or_kink(b, x.max(y)),
            _ => Enclosure::constant(Interval::WHOLE),
        }
    }
}

/// a_i b_j; a square where both are one.
fn product(a: [Interval; 3], i: usize, b: [Interval; 3], j: usize) -> Interval {
    if i == j { a[i].square() } else { a[i] * b[j] }
}

impl std::ops::Mul<Enclosure> for f64 {
    type Output = Enclosure;

    /// For a power of two: exact.
    fn mul(self, of: Enclosure) -> Enclosure {
        Enclosure {
            value: self * of.value,
            gradient: of.gradient.map(|g| self * g),
            hessian: of.hessian.map(|h| self * h),
            may_jump: of.may_jump,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every vocabulary word, with values and derivatives at points of the box, the latter from `with_gradient`.
    #[test]
    fn values_and_derivatives_at_points_are_inside() {
        let mut random = crate::Random::new(1);
        let mut random = || random.next();
        for text in [
            "x + 2*y - 3*z",
            "-x*y/z",
            "x/(y + z)^2",
            "x^y",
            "2^x + x^2 + x^-1.5 + (x - 3)^3",
            "pow(x*y, z)",
            "sin(x*y) + cos(y/z) + tan(0.3*z)",
            "asin(0.5*x) + acos(0.4*y) + atan(x*z)",
            "atan2(y, x - 2*z)",
            "atan2(y-1, x-1)",
            "sinh(x) + cosh(y*z) + tanh(z)",
            "exp(-x*y) + log(x + y) + sqrt(x*z)",
            "abs(x - 2*y) + abs(y)",
            "min(x, y)*max(y, z) + min(z, x)",
            "if(x < y, x^2, sin(z)) + if(x >= y, y^2, z*x)",
            "(x^2+y^2)^0.75*sin(1.5*atan2(y,x))",
            "sin(40*x)*cos(37*y) - 2*pi*sin(2*pi*x)",
            "1e160*(x - 0.5)*exp(-((x-0.5)^2+(y-0.5)^2)*1e2)",
        ] {
            let e = Expression::parse(text).unwrap();
            for _ in 0..200 {
                let width = 10f64.powf(-4.0 * random());
                let at: [Interval; 3] = std::array::from_fn(|_| {
                    let low = 0.1 + 1.4 * random();
                    Interval::new(low, low + width)
                });
                let box_of = e.enclosure(at, 3, Order::Hessian);
                let mut first = None;
                for _ in 0..10 {
                    let point =
                        at.map(|a| (a.low + (a.high - a.low) * random()).clamp(a.low, a.high));
                    let (value, slope) = e.with_gradient(point);
                    let near = |of: Interval, value: f64| {
                        let slack = 1e-9 * (value.abs() + of.magnitude().min(1e300));
                        value.is_nan() || (of.low - slack <= value && value <= of.high + slack)
                    };
                    assert!(
                        near(box_of.value, value),
                        "{text} at {point:?}: {value} {box_of:?}"
                    );
                    for k in 0..3 {
                        assert!(
                            near(box_of.gradient[k], slope[k]),
                            "{text} at {point:?}: {slope:?} {:?}",
                            box_of.gradient
                        );
                    }
                    // Second derivatives hold the differences of first ones.
                    let Some((other, before)): Option<([f64; 3], [f64; 3])> = first else {
                        first = Some((point, slope));
                        continue;
                    };
                    for i in 0..3 {
                        let between: Interval = (0..3)
                            .map(|j| {
                                let is_ij = |axes: &[usize; 2]| *axes == [i.min(j), i.max(j)];
                                let k = AXES.iter().position(is_ij).unwrap();
                                let step: f64 = point[j] - other[j];
                                step * box_of.hessian[k]
                            })
                            .sum();
                        let change: f64 = slope[i] - before[i];
                        let slack = 1e-9 * (slope[i].abs() + before[i].abs());
                        assert!(
                            !change.is_finite()
                                || between.low - slack <= change && change <= between.high + slack,
                            "{text}: ∇ changes by {change}, {between:?}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn a_jump_is_seen_and_a_kink_is_none() {
        let at = |text: &str, x: [f64; 2]| {
            let x = [
                Interval::new(x[0], x[1]),
                Interval::new(-0.5, 0.5),
                Interval::ZERO,
            ];
            Expression::parse(text)
                .unwrap()
                .enclosure(x, 2, Order::Gradient)
        };
        let jump = at("if(x < 0.501, 0, 5)", [0.5, 0.502]);
        assert!(jump.may_jump && jump.value == Interval::new(0.0, 5.0));
        assert!(!at("if(x < 0.501, 0, 5)", [0.502, 0.6]).may_jump);
        // On a side of the box alone: decided inside, not at all points.
        let half = [
            Interval::new(0.25, 0.5),
            Interval::new(0.0, 0.5),
            Interval::ZERO,
        ];
        let inside = |text: &str, simplex: usize| {
            Expression::parse(text)
                .unwrap()
                .enclosure_inside(half, 2, Order::Gradient, simplex)
                .value
        };
        assert_eq!(inside("if(x < 0.5, 1, 2)", 2), Interval::at(1.0));
        assert_eq!(inside("if(x >= 0.5, 1, 2)", 2), Interval::at(2.0));
        assert_eq!(inside("if(x < 0.5, 1, 2)", 1), Interval::new(1.0, 2.0));
        assert_eq!(
            inside("if(max(x, 0.3) <= 0.3, 1, 2)", 2),
            Interval::new(1.0, 2.0)
        );
        assert!(at("if(x < 0.5, 1, 2)", [0.25, 0.5]).may_jump);
        let kink = at("abs(x - 0.5)", [0.4, 0.7]);
        assert!(!kink.may_jump && kink.gradient[0] == Interval::new(-1.0, 1.0));
        assert!(
            at("atan2(y, x)", [-0.4, -0.2]).may_jump && !at("atan2(y, x)", [0.2, 0.3]).may_jump
        );
        assert!(!at("abs(x)^0.501", [-0.1, 0.1]).gradient[0].is_finite());
    }

    /// 2π is no f64: the constant's interval holds it, and the rounded product is at its end.
    #[test]
    fn constants_are_what_they_stand_for() {
        let two_pi = Expression::parse("2*pi").unwrap();
        let of = two_pi.enclosure([Interval::ZERO; 3], 2, Order::Value).value;
        assert!(of.low <= std::f64::consts::TAU && std::f64::consts::TAU.next_up() <= of.high);
        let third = Expression::parse("1/3")
            .unwrap()
            .enclosure([Interval::ZERO; 3], 2, Order::Value)
            .value;
        assert!(third.low < third.high);
    }
}
