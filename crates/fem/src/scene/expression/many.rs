//! An expression at many points: the tree is walked once for all of them.

use super::{Expression, Node, Operator, power};

impl Expression {
    /// The values at `points`, the same numbers as [`Expression::value`] gives.
    pub fn values(&self, points: &[[f64; 3]], values: &mut [f64]) {
        self.root.values(points, values, &mut Vec::new());
    }
}

impl Node {
    /// `spare` is room of earlier calls. Both branches of a choice are walked: a value that is not
    /// taken does no harm.
    fn values(&self, points: &[[f64; 3]], values: &mut [f64], spare: &mut Vec<Vec<f64>>) {
        if self.is_constant() {
            values.fill(self.value(&[0.0; 3]));
            return;
        }
        match self {
            Node::Number(_) | Node::Pi => {}
            Node::Coordinate(axis) => {
                for (value, point) in values.iter_mut().zip(points) {
                    *value = point[*axis];
                }
            }
            Node::Negative(a) => {
                a.values(points, values, spare);
                for value in values.iter_mut() {
                    *value = -*value;
                }
            }
            Node::Binary(operator, a, b) => {
                a.values(points, values, spare);
                let right = b.others(points, spare);
                // The loop is inside the choice, so that it can be vectorised.
                match operator {
                    Operator::Add => combine(values, &right, |a, b| a + b),
                    Operator::Subtract => combine(values, &right, |a, b| a - b),
                    Operator::Multiply => combine(values, &right, |a, b| a * b),
                    Operator::Divide => combine(values, &right, |a, b| a / b),
                    Operator::Power => combine(values, &right, power),
                }
                spare.push(right);
            }
            Node::Call(function, arguments) => {
                arguments[0].values(points, values, spare);
                match arguments.get(1) {
                    None => values.iter_mut().for_each(|a| *a = function.apply(*a, 0.0)),
                    Some(b) => {
                        let right = b.others(points, spare);
                        combine(values, &right, |a, b| function.apply(a, b));
                        spare.push(right);
                    }
                }
            }
            Node::If(comparison, parts) => {
                let [a, b, then, otherwise] = parts.as_ref();
                let [a, b, then] = [a, b, then].map(|part| part.others(points, spare));
                otherwise.values(points, values, spare);
                for (((value, a), b), then) in values.iter_mut().zip(&a).zip(&b).zip(&then) {
                    if comparison.holds(*a, *b) {
                        *value = *then;
                    }
                }
                spare.extend([a, b, then]);
            }
        }
    }

    /// The values in separate memory.
    fn others(&self, points: &[[f64; 3]], spare: &mut Vec<Vec<f64>>) -> Vec<f64> {
        let mut values = spare.pop().unwrap_or_default();
        values.resize(points.len(), 0.0);
        self.values(points, &mut values, spare);
        values
    }
}

fn combine(values: &mut [f64], right: &[f64], operation: impl Fn(f64, f64) -> f64) {
    for (a, b) in values.iter_mut().zip(right) {
        *a = operation(*a, *b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_points_have_the_values_of_each() {
        let points: Vec<_> = (0..300)
            .map(|k| std::array::from_fn(|i| (7.7 * f64::from(3 * k + i as i32)).sin() * 2.0))
            .collect();
        for text in [
            "3",
            "x",
            "-2*pi*sin(2*pi*x)",
            "x^2 - y/z + 3^y*(x + 1 - (y - z))",
            "if(x < y, log(x), z) + if(x >= 0.1, if(y > 0, 1/x, x), max(y, z))",
            "atan2(y, x) + min(x, y*z)*exp(-abs(z)) + sqrt(x)",
            "if(2 > 1, x, log(-1))",
        ] {
            let f = Expression::parse(text).unwrap();
            let mut values = vec![f64::NAN; points.len()];
            f.values(&points, &mut values);
            for (value, point) in values.iter().zip(&points) {
                assert_eq!(
                    value.to_bits(),
                    f.value(*point).to_bits(),
                    "{text} {point:?}"
                );
            }
        }
    }
}
