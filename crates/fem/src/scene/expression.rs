//! Expressions of a scene: parsed once into a tree, evaluated here, and written out from the tree
//! for the other codes. What is not in the tree's vocabulary cannot reach any engine.

mod enclosure;
mod gradient;
mod many;
mod parse;
pub mod syntax;
mod truncated;

pub use enclosure::{Condition, spanned};
pub use truncated::{
    GRADIENT, IN_PLANE, IN_SPACE, MOST, Monomials, ON_LINE, SECOND_IN_PLANE, SECOND_IN_SPACE,
    Taylor,
};

/// A real-valued function of the point (x, y, z).
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    text: String,
    root: Node,
    /// The same for gradients.
    steps: gradient::Steps,
}

#[derive(Debug, Clone, PartialEq)]
enum Node {
    Number(f64),
    Pi,
    Coordinate(usize),
    Negative(Box<Node>),
    Binary(Operator, Box<Node>, Box<Node>),
    Call(Function, Vec<Node>),
    /// `if(a < b, c, d)`
    If(Comparison, Box<[Node; 4]>),
}

/// An operation on two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Operator {
    /// a + b
    Add,
    /// a - b
    Subtract,
    /// a b
    Multiply,
    /// a/b
    Divide,
    /// aᵇ
    Power,
}

impl Operator {
    /// The value.
    #[inline(always)]
    pub fn apply(self, a: f64, b: f64) -> f64 {
        match self {
            Operator::Add => a + b,
            Operator::Subtract => a - b,
            Operator::Multiply => a * b,
            Operator::Divide => a / b,
            Operator::Power => power(a, b),
        }
    }
}

/// aᵇ. Squares are the most frequent powers, and a product is faster than a power.
fn power(a: f64, b: f64) -> f64 {
    if b == 2.0 { a * a } else { a.powf(b) }
}

/// A relation of two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Comparison {
    /// a < b
    Less,
    /// a ≤ b
    LessEqual,
    /// a > b
    Greater,
    /// a ≥ b
    GreaterEqual,
}

impl Comparison {
    /// Whether two numbers compare in this way. With NaN they never do.
    pub fn holds(self, a: f64, b: f64) -> bool {
        match self {
            Comparison::Less => a < b,
            Comparison::LessEqual => a <= b,
            Comparison::Greater => a > b,
            Comparison::GreaterEqual => a >= b,
        }
    }
}

/// A function of one or two numbers; its names are in a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Function {
    /// sin a
    Sin,
    /// cos a
    Cos,
    /// tan a
    Tan,
    /// arcsin a
    Asin,
    /// arccos a
    Acos,
    /// arctan a
    Atan,
    /// The angle of the point (b, a).
    Atan2,
    /// sinh a
    Sinh,
    /// cosh a
    Cosh,
    /// tanh a
    Tanh,
    /// exp a
    Exp,
    /// The natural logarithm.
    Log,
    /// √a
    Sqrt,
    /// |a|
    Abs,
    /// The smaller one.
    Min,
    /// The larger one.
    Max,
}

impl Function {
    /// The function of this name, and the number of its arguments.
    pub fn of_name(name: &str) -> Option<(Self, usize)> {
        let row = FUNCTIONS.iter().find(|row| row.0 == name)?;
        Some((row.2, row.1))
    }

    /// Its name in scenes, in FreeFEM and in UFL.
    pub fn names(self) -> [&'static str; 3] {
        let row = FUNCTIONS.iter().find(|row| row.2 == self);
        let row = row.expect("invariant: every function has its row");
        [row.0, row.3, row.4]
    }

    /// The value; `b` counts for those of two arguments only.
    #[inline(always)]
    pub fn apply(self, a: f64, b: f64) -> f64 {
        match self {
            Function::Sin => a.sin(),
            Function::Cos => a.cos(),
            Function::Tan => a.tan(),
            Function::Asin => a.asin(),
            Function::Acos => a.acos(),
            Function::Atan => a.atan(),
            Function::Atan2 => a.atan2(b),
            Function::Sinh => a.sinh(),
            Function::Cosh => a.cosh(),
            Function::Tanh => a.tanh(),
            Function::Exp => a.exp(),
            Function::Log => a.ln(),
            Function::Sqrt => a.sqrt(),
            Function::Abs => a.abs(),
            Function::Min => {
                if a < b {
                    a
                } else {
                    b
                }
            }
            Function::Max => {
                if a > b {
                    a
                } else {
                    b
                }
            }
        }
    }
}

/// Name in a scene, number of arguments, name in FreeFEM, name in UFL.
const FUNCTIONS: [(&str, usize, Function, &str, &str); 16] = [
    ("sin", 1, Function::Sin, "sin", "sin"),
    ("cos", 1, Function::Cos, "cos", "cos"),
    ("tan", 1, Function::Tan, "tan", "tan"),
    ("asin", 1, Function::Asin, "asin", "asin"),
    ("acos", 1, Function::Acos, "acos", "acos"),
    ("atan", 1, Function::Atan, "atan", "atan"),
    ("atan2", 2, Function::Atan2, "atan2", "atan2"),
    ("sinh", 1, Function::Sinh, "sinh", "sinh"),
    ("cosh", 1, Function::Cosh, "cosh", "cosh"),
    ("tanh", 1, Function::Tanh, "tanh", "tanh"),
    ("exp", 1, Function::Exp, "exp", "exp"),
    ("log", 1, Function::Log, "log", "ln"),
    ("sqrt", 1, Function::Sqrt, "sqrt", "sqrt"),
    ("abs", 1, Function::Abs, "abs", "abs"),
    ("min", 2, Function::Min, "min", "min_value"),
    ("max", 2, Function::Max, "max", "max_value"),
];

/// The error in a text, and its character (from 1).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParseError {
    /// In characters, from 1.
    pub column: usize,
    /// The error there.
    pub what: String,
}

impl Expression {
    /// Parses a formula.
    pub fn parse(text: &str) -> Result<Self, ParseError> {
        Ok(Expression::of(text.to_owned(), parse::parse(text)?))
    }

    /// A constant.
    pub fn constant(value: f64) -> Self {
        Expression::of(format!("{value:?}"), Node::Number(value))
    }

    fn of(text: String, root: Node) -> Self {
        Expression {
            steps: gradient::Steps::new(&root),
            text,
            root,
        }
    }

    /// The formula as it was given.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether this is the number 0 at all points.
    pub fn is_zero(&self) -> bool {
        self.root == Node::Number(0.0)
    }

    /// The value at a point; NaN or infinite where the formula is.
    pub fn value(&self, point: [f64; 3]) -> f64 {
        self.root.value(&point)
    }

    /// The same formula in FreeFEM's syntax.
    pub fn to_freefem(&self) -> String {
        self.root.text(Syntax::FreeFem)
    }

    /// The same formula in the syntax of UFL, with the point as `x`.
    pub fn to_ufl(&self) -> String {
        self.root.text(Syntax::Ufl)
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Syntax {
    FreeFem,
    Ufl,
}

impl Node {
    fn is_constant(&self) -> bool {
        match self {
            Node::Number(_) | Node::Pi => true,
            Node::Coordinate(_) => false,
            Node::Negative(a) => a.is_constant(),
            Node::Binary(_, a, b) => a.is_constant() && b.is_constant(),
            Node::Call(_, arguments) => arguments.iter().all(Node::is_constant),
            Node::If(_, parts) => parts.iter().all(Node::is_constant),
        }
    }

    fn value(&self, point: &[f64; 3]) -> f64 {
        match self {
            Node::Number(value) => *value,
            Node::Pi => std::f64::consts::PI,
            Node::Coordinate(axis) => point[*axis],
            Node::Negative(a) => -a.value(point),
            Node::Binary(operator, a, b) => operator.apply(a.value(point), b.value(point)),
            Node::Call(function, arguments) => {
                let second = arguments.get(1).map_or(0.0, |b| b.value(point));
                function.apply(arguments[0].value(point), second)
            }
            Node::If(comparison, parts) => {
                let [a, b, then, otherwise] = parts.as_ref();
                let (a, b) = (a.value(point), b.value(point));
                if comparison.holds(a, b) {
                    then.value(point)
                } else {
                    otherwise.value(point)
                }
            }
        }
    }

    /// Fully parenthesised, so that no code's rules of precedence matter; every number is written
    /// as a real, because FreeFEM divides integers as integers.
    fn text(&self, syntax: Syntax) -> String {
        let of = |node: &Node| node.text(syntax);
        match self {
            Node::Number(value) if value.is_sign_negative() => format!("({value:?})"),
            Node::Number(value) => format!("{value:?}"),
            Node::Pi => "pi".into(),
            Node::Coordinate(axis) => match syntax {
                Syntax::FreeFem => ["x", "y", "z"][*axis].into(),
                Syntax::Ufl => format!("x[{axis}]"),
            },
            Node::Negative(a) => format!("(-{})", of(a)),
            Node::Binary(operator, a, b) => {
                let sign = match (operator, syntax) {
                    (Operator::Add, _) => " + ",
                    (Operator::Subtract, _) => " - ",
                    (Operator::Multiply, _) => "*",
                    (Operator::Divide, _) => "/",
                    (Operator::Power, Syntax::FreeFem) => "^",
                    (Operator::Power, Syntax::Ufl) => "**",
                };
                format!("({}{sign}{})", of(a), of(b))
            }
            Node::Call(function, arguments) => {
                let row = FUNCTIONS.iter().find(|row| row.2 == *function);
                let name = row.map_or("", |(.., freefem, ufl)| match syntax {
                    Syntax::FreeFem => freefem,
                    Syntax::Ufl => ufl,
                });
                let arguments: Vec<String> = arguments.iter().map(of).collect();
                format!("{name}({})", arguments.join(", "))
            }
            Node::If(comparison, parts) => {
                let [a, b, then, otherwise] = parts.each_ref().map(of);
                let (sign, name) = match comparison {
                    Comparison::Less => ("<", "lt"),
                    Comparison::LessEqual => ("<=", "le"),
                    Comparison::Greater => (">", "gt"),
                    Comparison::GreaterEqual => (">=", "ge"),
                };
                match syntax {
                    // FreeFEM's `?:` on reals; only the chosen branch is evaluated.
                    Syntax::FreeFem => format!("(({a} {sign} {b}) ? {then} : {otherwise})"),
                    Syntax::Ufl => format!("conditional({name}({a}, {b}), {then}, {otherwise})"),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_codes_get_it_bracketed_and_real() {
        let f = Expression::parse("-2*pi*sin(2*pi*x)^2/3").unwrap();
        assert_eq!(
            f.to_freefem(),
            "((((-2.0)*pi)*(sin(((2.0*pi)*x))^2.0))/3.0)"
        );
        assert_eq!(
            f.to_ufl(),
            "((((-2.0)*pi)*(sin(((2.0*pi)*x[0]))**2.0))/3.0)"
        );
        let g = Expression::parse("if(x < y, log(x), z)").unwrap();
        assert_eq!(g.to_freefem(), "((x < y) ? log(x) : z)");
        assert_eq!(g.to_ufl(), "conditional(lt(x[0], x[1]), ln(x[0]), x[2])");
    }
}
