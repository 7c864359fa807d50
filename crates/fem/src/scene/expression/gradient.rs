//! The gradient of an expression by forward automatic differentiation: dual numbers over the tree, in which a term that
//! occurs several times is taken once. Formulas of exact solutions repeat theirs by the hundred.

use std::collections::HashMap;

use super::{Comparison, Expression, Function, Node, Operator, power};
use crate::interval::Interval;

/// A value and its gradient.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Dual {
    value: f64,
    slope: [f64; 3],
}

impl Expression {
    /// ∇ at a point. Where the formula has a kink, the gradient of the branch that gives the
    /// value; NaN or infinite where the formula is not differentiable.
    pub fn gradient(&self, point: [f64; 3]) -> [f64; 3] {
        self.with_gradient(point).1
    }

    /// Value and gradient at a point, in one pass.
    pub fn with_gradient(&self, point: [f64; 3]) -> (f64, [f64; 3]) {
        self.steps.dual(point, &mut self.steps.room())
    }

    /// Values and gradients at points, in turn.
    pub fn with_gradients(
        &self,
        points: impl Iterator<Item = [f64; 3]>,
    ) -> impl Iterator<Item = (f64, [f64; 3])> {
        let mut room = self.steps.room();
        points.map(move |point| self.steps.dual(point, &mut room))
    }
}

impl Dual {
    fn constant(value: f64) -> Self {
        Dual {
            value,
            slope: [0.0; 3],
        }
    }

    /// g(a) from its value and g'(a).
    fn chain(self, value: f64, derivative: f64) -> Self {
        Dual {
            value,
            slope: self.slope.map(|s| times(derivative, s)),
        }
    }

    /// g(a, b) from its value and both partial derivatives.
    fn chain2(self, other: Self, value: f64, [da, db]: [f64; 2]) -> Self {
        Dual {
            value,
            slope: std::array::from_fn(|k| times(da, self.slope[k]) + times(db, other.slope[k])),
        }
    }

    fn power(self, other: Self) -> Self {
        let (a, b) = (self.value, other.value);
        let value = power(a, b);
        let by_base = if b == 2.0 { a } else { power(a, b - 1.0) };
        // Powers and logarithms take the time of all else; most exponents are constant.
        let by_exponent = match other.slope {
            [0.0, 0.0, 0.0] => 0.0,
            _ => value * a.ln(),
        };
        self.chain2(other, value, [times(by_base, b), by_exponent])
    }
}

/// A product in which what does not vary counts for nothing, even against an infinite slope: the
/// logarithm of a negative base under a constant exponent, √ of a clipped term.
fn times(derivative: f64, slope: f64) -> f64 {
    if slope == 0.0 {
        0.0
    } else {
        derivative * slope
    }
}

/// The terms of a formula, each behind those it is made of; the last one is the whole.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Steps(pub(super) Vec<Step>);

/// A term; others by their places.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Step {
    /// For constants: the bits of the number, and of an interval that contains the value that it stands for.
    Number(u64, [u64; 2]),
    Coordinate(usize),
    Negative(usize),
    Binary(Operator, usize, usize),
    One(Function, usize),
    Two(Function, usize, usize),
    If(Comparison, [usize; 4]),
}

impl Step {
    fn constant(node: &Node) -> Self {
        let Interval { low, high } = node.enclosure();
        let value = node.value(&[0.0; 3]);
        Step::Number(value.to_bits(), [low.to_bits(), high.to_bits()])
    }
}

impl Steps {
    pub(super) fn new(root: &Node) -> Self {
        let mut steps = Vec::new();
        place(root, &mut steps, &mut HashMap::new());
        Steps(steps)
    }

    /// The coordinates that occur, in ascending order.
    pub(super) fn axes(&self) -> Vec<usize> {
        let is_one = |axis: &usize| self.0.contains(&Step::Coordinate(*axis));
        (0..3).filter(is_one).collect()
    }

    /// A place for each term.
    fn room(&self) -> Vec<Dual> {
        vec![Dual::constant(f64::NAN); self.0.len()]
    }

    /// Value and gradient of the whole, by those of all terms in `all`. Both branches of a choice are taken: one that does not count
    /// does no harm.
    fn dual(&self, point: [f64; 3], all: &mut [Dual]) -> (f64, [f64; 3]) {
        // Each arm writes its own place: a common one on the stack, written by halves and read as a whole, takes half of all time.
        for k in 0..all.len() {
            match self.0[k] {
                Step::Number(bits, _) => all[k].value = f64::from_bits(bits),
                Step::Coordinate(axis) => {
                    all[k].value = point[axis];
                    all[k].slope[axis] = 1.0;
                }
                Step::Negative(a) => all[k] = all[a].chain(-all[a].value, -1.0),
                Step::Binary(operator, a, b) => all[k] = two_operands(operator, all[a], all[b]),
                Step::One(function, a) => all[k] = one_argument(function, all[a]),
                Step::Two(function, a, b) => all[k] = two_arguments(function, all[a], all[b]),
                Step::If(comparison, [a, b, then, otherwise]) => {
                    let holds = comparison.holds(all[a].value, all[b].value);
                    all[k] = all[if holds { then } else { otherwise }];
                }
            }
        }
        all.last().map_or((f64::NAN, [f64::NAN; 3]), |whole| {
            (whole.value, whole.slope)
        })
    }
}

/// Where a term is, put behind all others if it is new.
fn place(node: &Node, steps: &mut Vec<Step>, known: &mut HashMap<Step, usize>) -> usize {
    let mut of = |node: &Node| place(node, steps, known);
    let step = if node.is_constant() {
        Step::constant(node)
    } else {
        match node {
            Node::Number(_) | Node::Pi => Step::constant(node),
            Node::Coordinate(axis) => Step::Coordinate(*axis),
            Node::Negative(a) => Step::Negative(of(a)),
            Node::Binary(operator, a, b) => Step::Binary(*operator, of(a), of(b)),
            Node::Call(function, arguments) => match &arguments[..] {
                [a] => Step::One(*function, of(a)),
                [a, b, ..] => Step::Two(*function, of(a), of(b)),
                // The parser counts arguments.
                [] => Step::constant(&Node::Number(f64::NAN)),
            },
            Node::If(comparison, parts) => Step::If(*comparison, parts.each_ref().map(of)),
        }
    };
    *known.entry(step).or_insert_with(|| {
        steps.push(step);
        steps.len() - 1
    })
}

fn two_operands(operator: Operator, a: Dual, b: Dual) -> Dual {
    let (x, y) = (a.value, b.value);
    match operator {
        Operator::Add => a.chain2(b, x + y, [1.0, 1.0]),
        Operator::Subtract => a.chain2(b, x - y, [1.0, -1.0]),
        Operator::Multiply => a.chain2(b, x * y, [y, x]),
        Operator::Divide => a.chain2(b, x / y, [1.0 / y, -x / (y * y)]),
        Operator::Power => a.power(b),
    }
}

fn one_argument(function: Function, a: Dual) -> Dual {
    let x = a.value;
    let (value, derivative) = match function {
        Function::Sin => (x.sin(), x.cos()),
        Function::Cos => (x.cos(), -x.sin()),
        Function::Tan => (x.tan(), 1.0 / x.cos().powi(2)),
        Function::Asin => (x.asin(), 1.0 / (1.0 - x * x).sqrt()),
        Function::Acos => (x.acos(), -1.0 / (1.0 - x * x).sqrt()),
        Function::Atan => (x.atan(), 1.0 / (1.0 + x * x)),
        Function::Sinh => (x.sinh(), x.cosh()),
        Function::Cosh => (x.cosh(), x.sinh()),
        Function::Tanh => (x.tanh(), 1.0 / x.cosh().powi(2)),
        Function::Exp => (x.exp(), x.exp()),
        Function::Log => (x.ln(), 1.0 / x),
        Function::Sqrt => (x.sqrt(), 0.5 / x.sqrt()),
        Function::Abs => (x.abs(), x.signum()),
        // The parser counts arguments: these have two.
        Function::Atan2 | Function::Min | Function::Max => (f64::NAN, f64::NAN),
    };
    a.chain(value, derivative)
}

fn two_arguments(function: Function, a: Dual, b: Dual) -> Dual {
    let (x, y) = (a.value, b.value);
    match function {
        Function::Atan2 => {
            let square = x * x + y * y;
            a.chain2(b, x.atan2(y), [y / square, -x / square])
        }
        Function::Min if x < y => a,
        Function::Max if x > y => a,
        _ => b,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A central difference of sixth order.
    fn difference(e: &Expression, point: [f64; 3], axis: usize) -> f64 {
        let h = 1e-3;
        let at = |s: f64| {
            let mut p = point;
            p[axis] += s * h;
            e.value(p)
        };
        let pair = |s: f64| at(s) - at(-s);
        (45.0 * pair(1.0) - 9.0 * pair(2.0) + pair(3.0)) / (60.0 * h)
    }

    #[test]
    fn what_is_repeated_is_taken_once_and_what_is_constant_is_a_number() {
        let e = Expression::parse("sin(x*y)^2 + sin(x*y)*(2*pi) - 2*pi").unwrap();
        // x, y, x y, sin, 2, its square, 2 π, the product, the sum, and the whole.
        assert_eq!(e.steps.0.len(), 10, "{:?}", e.steps);
    }

    #[test]
    fn it_is_the_limit_of_differences_for_every_function() {
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
            "sinh(x) + cosh(y*z) + tanh(z)",
            "exp(-x*y) + log(x + y) + sqrt(x*z)",
            "abs(x - 2*y) + abs(y)",
            "min(x, y)*max(y, z) + min(z, x)",
            "if(x < y, x^2, sin(z)) + if(x >= y, y^2, z*x)",
            "max(x - 5, 0)^2 + max(x - 5, 0)^0.5",
            "(x^2+y^2)^0.75*sin(1.5*atan2(y,x))",
            "(x*y)^2 + sin(x*y)*(x*y + cos(2*pi)*z) - y*x",
        ] {
            let e = Expression::parse(text).unwrap();
            for point in [[0.7, 0.4, 1.3], [0.3, 0.9, 0.6], [1.1, 1.6, 0.8]] {
                let (value, slope) = e.with_gradient(point);
                assert_eq!(value.to_bits(), e.value(point).to_bits(), "{text}");
                assert_eq!(slope, e.gradient(point));
                for axis in 0..3 {
                    let expected = difference(&e, point, axis);
                    let error = (slope[axis] - expected).abs();
                    assert!(
                        error < 1e-10 * (1.0 + expected.abs()),
                        "{text} at {point:?}, axis {axis}: {} {expected}",
                        slope[axis]
                    );
                }
            }
        }
    }
}
