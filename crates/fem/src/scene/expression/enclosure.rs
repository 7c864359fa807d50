//! An expression over a whole box: intervals that hold all its values and derivatives there, by forward automatic
//! differentiation in interval arithmetic.
//!
//! Where a condition of `if` is not decided on all of the box, its value is the hull of both branches and nothing is
//! known of its derivatives: a jump may be inside. `abs`, `min` and `max` are Lipschitz continuous: where they are not
//! decided, the gradient is the hull of both sides.

use super::gradient::Step;
use super::truncated::{GRADIENT, MOST, Size, Taylor};
use super::{Comparison, Expression, Function, Node, Operator};
use crate::interval::Interval;

/// The first terms of a Taylor series: g^(k)/k!
type Series = [Interval; MOST + 1];

/// The condition of an `if` on a box: does a - b have the sign that it asks for?
#[derive(Debug, Clone, Copy)]
pub struct Condition<const N: usize> {
    /// a - b
    pub difference: Taylor<N>,
    /// Whether it is `a < b`, or `a <= b`.
    pub is_less: bool,
    /// Whether it holds at all points, or at none.
    pub decided: Option<bool>,
}

impl Expression {
    /// The axes along which it varies, at most: those whose coordinates occur.
    pub fn axes(&self) -> Vec<usize> {
        self.steps.axes()
    }

    /// How many different terms there are: what an evaluation takes.
    pub fn terms(&self) -> usize {
        self.steps.0.len()
    }

    /// Its values at all points of a box.
    pub fn range(&self, at: [Interval; 3]) -> Interval {
        self.enclosure::<GRADIENT>(at, &[], 0).value()
    }

    /// Its values and the derivatives up to `order` along `axes`, at all points of a box.
    pub fn enclosure<const N: usize>(
        &self,
        at: [Interval; 3],
        axes: &[usize],
        order: usize,
    ) -> Taylor<N> {
        self.over(at, axes, order, None)
    }

    /// The same almost everywhere on a simplex of dimension `simplex` that spans the box: where a condition of `if` turns
    /// over only on a side of the box, it is decided.
    pub fn enclosure_inside<const N: usize>(
        &self,
        at: [Interval; 3],
        axes: &[usize],
        order: usize,
        simplex: usize,
    ) -> Taylor<N> {
        self.over(at, axes, order, spanned(at, simplex))
    }

    /// `inside`: the axes along which a simplex with inner points spans the box, where only those count.
    pub fn over<const N: usize>(
        &self,
        at: [Interval; 3],
        axes: &[usize],
        order: usize,
        inside: Option<[bool; 3]>,
    ) -> Taylor<N> {
        self.over_by(at, axes, order, inside, &[], None)
    }

    /// With all conditions of `if` in `met`, in the order of the formula's terms. They are taken to have the values in `chosen`;
    /// where it has no value for one that is not decided on the box, a jump may be inside.
    pub fn over_by<const N: usize>(
        &self,
        at: [Interval; 3],
        axes: &[usize],
        order: usize,
        inside: Option<[bool; 3]>,
        chosen: &[Option<bool>],
        mut met: Option<&mut Vec<Condition<N>>>,
    ) -> Taylor<N> {
        let mut chosen = chosen.iter();
        let size = Size::new(axes.len(), order);
        let mut all: Vec<Taylor<N>> = Vec::with_capacity(self.steps.0.len());
        for step in &self.steps.0 {
            all.push(match *step {
                Step::Number(_, [low, high]) => {
                    Taylor::constant(Interval::new(f64::from_bits(low), f64::from_bits(high)))
                }
                Step::Coordinate(axis) => {
                    let mut coordinate = Taylor::constant(at[axis]);
                    if let Some(k) = axes.iter().position(|a| *a == axis && order > 0) {
                        coordinate.coefficients[1 + k] = Interval::ONE;
                    }
                    coordinate
                }
                Step::Negative(a) => all[a].negative(),
                Step::Binary(operator, a, b) => size.two_operands(operator, &all[a], &all[b]),
                Step::One(function, a) => size.one_argument(function, &all[a]),
                Step::Two(function, a, b) => size.two_arguments(function, &all[a], &all[b]),
                Step::If(comparison, [a, b, then, otherwise]) => {
                    let strictly = comparison.decided(all[a].value(), all[b].value());
                    let touching = || {
                        let wide = inside.filter(|_| order > 0)?;
                        let wide = (0..axes.len()).filter(|k| wide[axes[*k]]);
                        touches(comparison, &all[a], &all[b], wide)
                    };
                    let decided = strictly.or_else(touching);
                    let choice = chosen.next().copied().flatten();
                    if let Some(met) = &mut met {
                        met.push(Condition {
                            difference: size.sum(&all[a], &all[b].negative()),
                            is_less: comparison.is_less(),
                            decided,
                        });
                    }
                    match choice.or(decided) {
                        Some(true) => all[then],
                        Some(false) => all[otherwise],
                        None => all[then].or(&all[otherwise]),
                    }
                }
            });
        }
        all.pop().unwrap_or(Taylor::constant(Interval::WHOLE))
    }
}

/// The axes along which a simplex of this dimension spans a box, if it does.
pub fn spanned(at: [Interval; 3], simplex: usize) -> Option<[bool; 3]> {
    let wide = at.map(|x| x.low < x.high);
    let spans = wide.iter().filter(|wide| **wide).count() == simplex;
    spans.then_some(wide)
}

/// Whether a comparison holds almost everywhere, or almost nowhere, where both sides meet at an end. Only where they differ
/// by a function with a slope, which is 0 on no set with inner points.
fn touches<const N: usize>(
    comparison: Comparison,
    a: &Taylor<N>,
    b: &Taylor<N>,
    mut wide: impl Iterator<Item = usize>,
) -> Option<bool> {
    let has_slope = wide.any(|k| !(a.slope(k) - b.slope(k)).contains(0.0));
    if !has_slope || a.may_jump || b.may_jump {
        return None;
    }
    let (below, above) = (
        a.value().high <= b.value().low,
        a.value().low >= b.value().high,
    );
    let is_less = comparison.is_less();
    match (below, above) {
        (true, _) => Some(is_less),
        (_, true) => Some(!is_less),
        _ => None,
    }
}

impl Comparison {
    /// Whether it holds where the first is much smaller.
    fn is_less(self) -> bool {
        matches!(self, Comparison::Less | Comparison::LessEqual)
    }

    /// Whether it holds for all numbers of both, or for none.
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
        let size = Size::new(0, 0);
        let of = |node: &Node| Taylor::<1>::constant(node.enclosure());
        match self {
            Node::Number(value) if value.is_nan() => Interval::WHOLE,
            Node::Number(value) => Interval::at(*value),
            Node::Pi => Interval::PI,
            Node::Coordinate(_) => Interval::WHOLE,
            Node::Negative(a) => -a.enclosure(),
            Node::Binary(operator, a, b) => size.two_operands(*operator, &of(a), &of(b)).value(),
            Node::Call(function, arguments) => match &arguments[..] {
                [a] => size.one_argument(*function, &of(a)).value(),
                [a, b, ..] => size.two_arguments(*function, &of(a), &of(b)).value(),
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

impl Size {
    fn two_operands<const N: usize>(
        self,
        operator: Operator,
        a: &Taylor<N>,
        b: &Taylor<N>,
    ) -> Taylor<N> {
        match operator {
            Operator::Add => self.sum(a, b),
            Operator::Subtract => self.sum(a, &b.negative()),
            Operator::Multiply => self.product(a, b),
            Operator::Divide => {
                let one = Interval::ONE;
                let mut of = self.product(a, &self.chain(b, &power(b.value(), -one, self.order)));
                of.coefficients[0] = a.value() / b.value();
                of
            }
            // At a point an exponent that varies has one value, too.
            Operator::Power if !self.is_constant(b) => {
                let exponent = self.product(b, &self.one_argument(Function::Log, a));
                self.one_argument(Function::Exp, &exponent)
            }
            Operator::Power => self.chain(a, &power(a.value(), b.value(), self.order)),
        }
    }

    fn one_argument<const N: usize>(self, function: Function, a: &Taylor<N>) -> Taylor<N> {
        match function {
            Function::Abs if a.value().low >= 0.0 => *a,
            Function::Abs if a.value().high <= 0.0 => a.negative(),
            Function::Abs => self.kink(a, &a.negative(), a.value().abs()),
            _ => self.chain(a, &series(function, a.value(), self.order)),
        }
    }

    fn kink<const N: usize>(self, a: &Taylor<N>, b: &Taylor<N>, value: Interval) -> Taylor<N> {
        a.or_kink(b, value, self.slopes())
    }

    fn two_arguments<const N: usize>(
        self,
        function: Function,
        a: &Taylor<N>,
        b: &Taylor<N>,
    ) -> Taylor<N> {
        let (x, y) = (a.value(), b.value());
        match function {
            Function::Atan2 => {
                // The angle of (y, x): x is the ordinate here. Its derivatives are those of atan(x/y), and of -atan(y/x): the
                // larger divides, or intervals of 1 / (1 + q²) are too wide.
                let of = |a: &Taylor<N>, b: &Taylor<N>| {
                    let quotient = self.two_operands(Operator::Divide, a, b);
                    self.one_argument(Function::Atan, &quotient)
                };
                let jumps = x.contains(0.0) && y.low <= 0.0 && !(x.low >= 0.0 && y.high < 0.0);
                let mut angle = if self.order == 0 || jumps {
                    a.or(b)
                } else if y.mignitude() >= x.mignitude() {
                    of(a, b)
                } else {
                    of(b, a).negative()
                };
                angle.coefficients[0] = x.atan2(y);
                angle.may_jump = a.may_jump || b.may_jump || jumps;
                angle
            }
            Function::Min if x.high <= y.low => *a,
            Function::Min if y.high <= x.low => *b,
            Function::Max if x.low >= y.high => *a,
            Function::Max if y.low >= x.high => *b,
            Function::Min => self.kink(a, b, x.min(y)),
            Function::Max => self.kink(a, b, x.max(y)),
            // The parser counts arguments: all others have one.
            _ => Taylor::constant(Interval::WHOLE),
        }
    }
}

/// The coefficients for x^p with constant p: p (p-1) … (p-k+1)/k! x^(p-k).
fn power(x: Interval, p: Interval, order: usize) -> Series {
    let mut binomial = Interval::ONE;
    let mut series = [Interval::ZERO; MOST + 1];
    for (k, term) in series.iter_mut().enumerate().take(order + 1) {
        // Small integers are exact, but p - k may round.
        let exponent = p - Interval::at(k as f64);
        if !binomial.is_zero() {
            let power = if exponent.is_zero() {
                Interval::ONE
            } else {
                x.power(exponent)
            };
            *term = binomial * power;
        }
        binomial = binomial * exponent / Interval::at(k as f64 + 1.0);
    }
    series
}

/// The derivatives of a function at all points of an interval.
fn series(function: Function, x: Interval, order: usize) -> Series {
    let at = Interval::at;
    let [zero, one] = [Interval::ZERO, Interval::ONE];
    // From g, g', and g'' = ±g.
    let cyclic = |g: Interval, slope: Interval, sign: f64| -> Series {
        let all = [g, slope, sign * g, sign * slope, g];
        std::array::from_fn(|k| all[k] / at([1.0, 1.0, 2.0, 6.0, 24.0][k]))
    };
    // From the series of g'.
    let integral = |value: Interval, slopes: Series| -> Series {
        std::array::from_fn(|k| match k {
            0 => value,
            _ => slopes[k - 1] / at(k as f64),
        })
    };
    // g' = 1 ± g².
    let riccati = |value: Interval, sign: f64| -> Series {
        let mut g = [zero; MOST + 1];
        g[0] = value;
        for k in 0..order {
            let square = match k {
                0 => g[0].square(),
                _ => (0..=k).map(|i| g[i] * g[k - i]).sum(),
            };
            let slope = if k == 0 {
                one + sign * square
            } else {
                sign * square
            };
            g[k + 1] = slope / at(k as f64 + 1.0);
        }
        g
    };
    // (p_0 + p_1 h + p_2 h²)^a: p_0 k y_k = Σ_j (a j - k + j) p_j y_(k-j).
    let of_quadratic = |p: [Interval; 3], a: f64, first: Interval| -> Series {
        let mut y = [zero; MOST + 1];
        y[0] = first;
        for k in 1..order {
            let terms = (1..=k.min(2)).map(|j| {
                let weight = a * j as f64 - (k - j) as f64;
                weight * (p[j] * y[k - j])
            });
            y[k] = terms.sum::<Interval>() / (k as f64 * p[0]);
        }
        y
    };
    match function {
        Function::Sin if order == 0 => [x.sin(); MOST + 1],
        Function::Cos if order == 0 => [x.cos(); MOST + 1],
        Function::Sin => cyclic(x.sin(), x.cos(), -1.0),
        Function::Cos => cyclic(x.cos(), -x.sin(), -1.0),
        Function::Sinh => cyclic(x.sinh(), x.cosh(), 1.0),
        Function::Cosh => cyclic(x.cosh(), x.sinh(), 1.0),
        Function::Exp => {
            let e = x.exp();
            cyclic(e, e, 1.0)
        }
        Function::Tan => riccati(x.tan(), 1.0),
        Function::Tanh => riccati(x.tanh(), -1.0),
        Function::Log => {
            let mut g = integral(x.ln(), power(x, -one, order));
            g[0] = x.ln();
            g
        }
        Function::Sqrt => {
            let mut g = power(x, at(0.5), order);
            g[0] = x.sqrt();
            g
        }
        Function::Atan => {
            let square = one + x.square();
            let slopes = of_quadratic([square, 2.0 * x, one], -1.0, square.recip());
            integral(x.atan(), slopes)
        }
        Function::Asin | Function::Acos => {
            let rest = one - x.square();
            let first = rest.sqrt().recip();
            let slopes = of_quadratic([rest, -2.0 * x, -one], -0.5, first);
            match function {
                Function::Asin => integral(x.asin(), slopes),
                _ => integral(x.acos(), slopes.map(|slope| -slope)),
            }
        }
        // These are not functions of one argument with derivatives.
        Function::Abs | Function::Atan2 | Function::Min | Function::Max => {
            [Interval::WHOLE; MOST + 1]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::truncated::{IN_SPACE, Monomials};
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
                let box_of: Taylor<IN_SPACE> = e.enclosure(at, &[0, 1, 2], MOST);
                let mut inside =
                    || at.map(|a| (a.low + (a.high - a.low) * random()).clamp(a.low, a.high));
                for _ in 0..10 {
                    let (from, to) = (inside(), inside());
                    let (value, slope) = e.with_gradient(to);
                    let slack = |of: Interval| 1e-9 * (value.abs() + of.magnitude().min(1e300));
                    let holds = |of: Interval, value: f64| {
                        let slack = slack(of);
                        value.is_nan() || (of.low - slack <= value && value <= of.high + slack)
                    };
                    for k in 0..3 {
                        let of = box_of.slope(k);
                        assert!(holds(of, slope[k]), "{text} at {to:?}: {slope:?} {of:?}");
                    }
                    // Taylor's formula of each order, with its last derivatives anywhere in the box.
                    let at_point: Taylor<IN_SPACE> =
                        e.enclosure(from.map(Interval::at), &[0, 1, 2], MOST);
                    let step: [f64; 3] = std::array::from_fn(|k| to[k] - from[k]);
                    let of = Monomials::of(3);
                    for order in 0..=MOST {
                        let terms = of.exponents[..of.counts[order]].iter().enumerate();
                        let found: Interval = terms
                            .map(|(n, e)| {
                                let power = step.iter().zip(e).map(|(s, e)| s.powi(i32::from(*e)));
                                let is_last = e.iter().sum::<u8>() as usize == order;
                                let coefficients = if is_last { &box_of } else { &at_point };
                                power.product::<f64>() * coefficients.coefficients[n]
                            })
                            .sum();
                        assert!(
                            holds(found, value),
                            "{text}, order {order}, from {from:?} to {to:?}: {value} {found:?}"
                        );
                    }
                }
            }
        }
    }

    /// Next to an axis, where one argument of the angle is nearly 0, as well.
    #[test]
    fn derivatives_on_a_small_box_are_nearly_known() {
        let e = Expression::parse("(x^2+y^2)^0.75*sin(1.5*atan2(y,x))").unwrap();
        for eighth in 0..8 {
            for small in [1e-9, 1e-6, 1e-3] {
                let angle = f64::from(eighth) * std::f64::consts::FRAC_PI_8 + 3.0 * small;
                let at = |x: f64| Interval::new(x - small, x + small);
                let box_of = [at(angle.cos()), at(angle.sin()), Interval::ZERO];
                let of: Taylor<IN_SPACE> = e.enclosure(box_of, &[0, 1], MOST);
                for of in of.coefficients {
                    assert!(of.radius() < 1e3 * small, "{angle}, {small}: {of:?}");
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
                .enclosure::<GRADIENT>(x, &[0, 1], 1)
        };
        let jump = at("if(x < 0.501, 0, 5)", [0.5, 0.502]);
        assert!(jump.may_jump && jump.value() == Interval::new(0.0, 5.0));
        assert!(!at("if(x < 0.501, 0, 5)", [0.502, 0.6]).may_jump);
        // Only on a side of the box: decided inside, not at all points.
        let half = [
            Interval::new(0.25, 0.5),
            Interval::new(0.0, 0.5),
            Interval::ZERO,
        ];
        let inside = |text: &str, simplex: usize| {
            Expression::parse(text)
                .unwrap()
                .enclosure_inside::<GRADIENT>(half, &[0, 1], 1, simplex)
                .value()
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
        assert!(!kink.may_jump && kink.slope(0) == Interval::new(-1.0, 1.0));
        assert!(
            at("atan2(y, x)", [-0.4, -0.2]).may_jump && !at("atan2(y, x)", [0.2, 0.3]).may_jump
        );
        assert!(!at("abs(x)^0.501", [-0.1, 0.1]).slope(0).is_finite());
    }

    /// 2π is not an f64: the constant's interval holds it, and the rounded product is at its end.
    #[test]
    fn constants_are_what_they_stand_for() {
        let two_pi = Expression::parse("2*pi").unwrap();
        let of = two_pi.range([Interval::ZERO; 3]);
        assert!(of.low <= std::f64::consts::TAU && std::f64::consts::TAU.next_up() <= of.high);
        let third = Expression::parse("1/3").unwrap().range([Interval::ZERO; 3]);
        assert!(third.low < third.high);
    }
}
