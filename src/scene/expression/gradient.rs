//! The gradient of an expression by forward automatic differentiation: dual numbers over the tree.

use super::{Expression, Function, Node, Operator};

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
        self.root.dual(&point).slope
    }

    /// Value and gradient at a point, in one pass.
    pub fn with_gradient(&self, point: [f64; 3]) -> (f64, [f64; 3]) {
        let Dual { value, slope } = self.root.dual(&point);
        (value, slope)
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
        let value = a.powf(b);
        self.chain2(other, value, [times(a.powf(b - 1.0), b), value * a.ln()])
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

impl Node {
    fn dual(&self, point: &[f64; 3]) -> Dual {
        match self {
            Node::Number(value) => Dual::constant(*value),
            Node::Pi => Dual::constant(std::f64::consts::PI),
            Node::Coordinate(axis) => {
                let mut dual = Dual::constant(point[*axis]);
                dual.slope[*axis] = 1.0;
                dual
            }
            Node::Negative(a) => {
                let a = a.dual(point);
                a.chain(-a.value, -1.0)
            }
            Node::Binary(operator, a, b) => {
                let (a, b) = (a.dual(point), b.dual(point));
                let (x, y) = (a.value, b.value);
                match operator {
                    Operator::Add => a.chain2(b, x + y, [1.0, 1.0]),
                    Operator::Subtract => a.chain2(b, x - y, [1.0, -1.0]),
                    Operator::Multiply => a.chain2(b, x * y, [y, x]),
                    Operator::Divide => a.chain2(b, x / y, [1.0 / y, -x / (y * y)]),
                    Operator::Power => a.power(b),
                }
            }
            Node::Call(function, arguments) => {
                let a = arguments[0].dual(point);
                match arguments.get(1) {
                    None => one_argument(*function, a),
                    Some(b) => two_arguments(*function, a, b.dual(point)),
                }
            }
            Node::If(comparison, parts) => {
                let [a, b, then, otherwise] = parts.as_ref();
                let (a, b) = (a.value(point), b.value(point));
                let branch = if comparison.holds(a, b) {
                    then
                } else {
                    otherwise
                };
                branch.dual(point)
            }
        }
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
