//! Expressions of a scene: parsed once into a tree, evaluated here, and written out from the tree
//! for the other codes. What is not in the tree's vocabulary cannot reach any engine.
//!
//! ```text
//! sum     = product { ("+" | "-") product }
//! product = sign { ("*" | "/") sign }
//! sign    = { "-" | "+" } power                       -x^2 is -(x^2)
//! power   = atom [ ("^" | "**") sign ]                right-associative
//! atom    = number | "pi" | "x" | "y" | "z" | "(" sum ")" | function "(" sum { "," sum } ")"
//!         | "if" "(" sum ("<" | "<=" | ">" | ">=") sum "," sum "," sum ")"
//! ```

mod gradient;
mod many;

use std::fmt::Write as _;

/// Longest text and deepest nesting accepted: far beyond any formula, far below the stack's end.
const MAX_LENGTH: usize = 20_000;
const MAX_DEPTH: usize = 120;

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

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
}

impl Operator {
    #[inline(always)]
    fn apply(self, a: f64, b: f64) -> f64 {
        match self {
            Operator::Add => a + b,
            Operator::Subtract => a - b,
            Operator::Multiply => a * b,
            Operator::Divide => a / b,
            Operator::Power => a.powf(b),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Comparison {
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
}

impl Comparison {
    fn holds(self, a: f64, b: f64) -> bool {
        match self {
            Comparison::Less => a < b,
            Comparison::LessEqual => a <= b,
            Comparison::Greater => a > b,
            Comparison::GreaterEqual => a >= b,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Function {
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Atan2,
    Sinh,
    Cosh,
    Tanh,
    Exp,
    Log,
    Sqrt,
    Abs,
    Min,
    Max,
}

impl Function {
    /// The value; `b` counts for those of two arguments only.
    #[inline(always)]
    fn apply(self, a: f64, b: f64) -> f64 {
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

/// What is wrong with a text, and at which character (from 1).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParseError {
    pub column: usize,
    pub what: String,
}

impl Expression {
    /// Parses a formula.
    pub fn parse(text: &str) -> Result<Self, ParseError> {
        if text.len() > MAX_LENGTH {
            return Err(ParseError {
                column: MAX_LENGTH,
                what: format!("an expression longer than {MAX_LENGTH} characters"),
            });
        }
        let mut parser = Parser {
            chars: text.chars().collect(),
            at: 0,
            depth: 0,
        };
        let root = parser.sum()?;
        parser.blanks();
        match parser.peek() {
            None => Ok(Expression::of(text.to_owned(), root)),
            Some(c) => Err(parser.error(format!("`{c}` where the expression should end"))),
        }
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

    /// Is this the number 0, whatever the point?
    pub fn is_zero(&self) -> bool {
        self.root == Node::Number(0.0)
    }

    /// Does the formula use z?
    pub fn uses_z(&self) -> bool {
        self.root.uses(2)
    }

    /// The value at a point; NaN or infinite where the formula is.
    pub fn value(&self, point: [f64; 3]) -> f64 {
        self.root.value(&point)
    }

    /// The same formula in FreeFEM's syntax.
    pub fn to_freefem(&self) -> String {
        let mut out = String::new();
        self.root.write(&mut out, Syntax::FreeFem);
        out
    }

    /// The same formula in the syntax of UFL, with the point as `x`.
    pub fn to_ufl(&self) -> String {
        let mut out = String::new();
        self.root.write(&mut out, Syntax::Ufl);
        out
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Syntax {
    FreeFem,
    Ufl,
}

impl Node {
    fn uses(&self, axis: usize) -> bool {
        match self {
            Node::Number(_) | Node::Pi => false,
            Node::Coordinate(k) => *k == axis,
            Node::Negative(a) => a.uses(axis),
            Node::Binary(_, a, b) => a.uses(axis) || b.uses(axis),
            Node::Call(_, arguments) => arguments.iter().any(|a| a.uses(axis)),
            Node::If(_, parts) => parts.iter().any(|a| a.uses(axis)),
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
    fn write(&self, out: &mut String, syntax: Syntax) {
        match self {
            Node::Number(value) if value.is_sign_negative() => {
                let _ = write!(out, "({value:?})");
            }
            Node::Number(value) => {
                let _ = write!(out, "{value:?}");
            }
            Node::Pi => out.push_str("pi"),
            Node::Coordinate(axis) => match syntax {
                Syntax::FreeFem => out.push(['x', 'y', 'z'][*axis]),
                Syntax::Ufl => {
                    let _ = write!(out, "x[{axis}]");
                }
            },
            Node::Negative(a) => {
                out.push_str("(-");
                a.write(out, syntax);
                out.push(')');
            }
            Node::Binary(operator, a, b) => {
                out.push('(');
                a.write(out, syntax);
                out.push_str(match (operator, syntax) {
                    (Operator::Add, _) => " + ",
                    (Operator::Subtract, _) => " - ",
                    (Operator::Multiply, _) => "*",
                    (Operator::Divide, _) => "/",
                    (Operator::Power, Syntax::FreeFem) => "^",
                    (Operator::Power, Syntax::Ufl) => "**",
                });
                b.write(out, syntax);
                out.push(')');
            }
            Node::Call(function, arguments) => {
                if let Some((_, _, _, freefem, ufl)) =
                    FUNCTIONS.iter().find(|row| row.2 == *function)
                {
                    out.push_str(match syntax {
                        Syntax::FreeFem => freefem,
                        Syntax::Ufl => ufl,
                    });
                }
                write_arguments(out, arguments, syntax);
            }
            Node::If(comparison, parts) => {
                let [a, b, then, otherwise] = parts.as_ref();
                match syntax {
                    Syntax::FreeFem => {
                        // FreeFEM's `?:` on reals; only the chosen branch is evaluated.
                        out.push_str("((");
                        a.write(out, syntax);
                        out.push_str(match comparison {
                            Comparison::Less => " < ",
                            Comparison::LessEqual => " <= ",
                            Comparison::Greater => " > ",
                            Comparison::GreaterEqual => " >= ",
                        });
                        b.write(out, syntax);
                        out.push_str(") ? ");
                        then.write(out, syntax);
                        out.push_str(" : ");
                        otherwise.write(out, syntax);
                        out.push(')');
                    }
                    Syntax::Ufl => {
                        out.push_str("conditional(");
                        out.push_str(match comparison {
                            Comparison::Less => "lt(",
                            Comparison::LessEqual => "le(",
                            Comparison::Greater => "gt(",
                            Comparison::GreaterEqual => "ge(",
                        });
                        a.write(out, syntax);
                        out.push_str(", ");
                        b.write(out, syntax);
                        out.push_str("), ");
                        then.write(out, syntax);
                        out.push_str(", ");
                        otherwise.write(out, syntax);
                        out.push(')');
                    }
                }
            }
        }
    }
}

fn write_arguments(out: &mut String, arguments: &[Node], syntax: Syntax) {
    out.push('(');
    for (k, argument) in arguments.iter().enumerate() {
        if k > 0 {
            out.push_str(", ");
        }
        argument.write(out, syntax);
    }
    out.push(')');
}

struct Parser {
    chars: Vec<char>,
    at: usize,
    depth: usize,
}

impl Parser {
    fn error(&self, what: impl Into<String>) -> ParseError {
        ParseError {
            column: self.at + 1,
            what: what.into(),
        }
    }

    fn peek(&self) -> Option<char> {
        self.chars.get(self.at).copied()
    }

    fn blanks(&mut self) {
        while self.peek().is_some_and(char::is_whitespace) {
            self.at += 1;
        }
    }

    /// Takes `token` if it comes next.
    fn take(&mut self, token: &str) -> bool {
        self.blanks();
        let matches = token
            .chars()
            .enumerate()
            .all(|(k, c)| self.chars.get(self.at + k) == Some(&c));
        if matches {
            self.at += token.chars().count();
        }
        matches
    }

    fn expect(&mut self, token: &str) -> Result<(), ParseError> {
        if self.take(token) {
            return Ok(());
        }
        let found = match self.peek() {
            Some(c) => format!("`{c}`"),
            None => "the end".into(),
        };
        Err(self.error(format!("{found} where `{token}` is needed")))
    }

    fn sum(&mut self) -> Result<Node, ParseError> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(self.error(format!("nesting deeper than {MAX_DEPTH} levels")));
        }
        let mut left = self.product()?;
        // A long chain makes a deep tree, whose evaluation recurses: it counts as depth as well.
        let outer = self.depth;
        loop {
            let operator = if self.take("+") {
                Operator::Add
            } else if self.take("-") {
                Operator::Subtract
            } else {
                break;
            };
            self.chain()?;
            left = Node::Binary(operator, Box::new(left), Box::new(self.product()?));
        }
        self.depth = outer - 1;
        Ok(left)
    }

    fn chain(&mut self) -> Result<(), ParseError> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(self.error(format!(
                "more than about {MAX_DEPTH} terms or factors in a row; bracket them"
            )));
        }
        Ok(())
    }

    fn product(&mut self) -> Result<Node, ParseError> {
        let mut left = self.sign()?;
        let outer = self.depth;
        loop {
            self.blanks();
            let power = self.peek() == Some('*') && self.chars.get(self.at + 1) == Some(&'*');
            let operator = if !power && self.take("*") {
                Operator::Multiply
            } else if self.take("/") {
                Operator::Divide
            } else {
                break;
            };
            self.chain()?;
            left = Node::Binary(operator, Box::new(left), Box::new(self.sign()?));
        }
        self.depth = outer;
        Ok(left)
    }

    fn sign(&mut self) -> Result<Node, ParseError> {
        let outer = self.depth;
        let mut negative = false;
        loop {
            if self.take("-") {
                negative = !negative;
            } else if !self.take("+") {
                break;
            }
        }
        let power = self.power()?;
        self.depth = outer;
        Ok(match (negative, power) {
            (false, node) => node,
            (true, Node::Number(value)) => Node::Number(-value),
            (true, node) => Node::Negative(Box::new(node)),
        })
    }

    fn power(&mut self) -> Result<Node, ParseError> {
        let base = self.atom()?;
        if self.take("^") || self.take("**") {
            self.chain()?;
            let exponent = self.sign()?;
            return Ok(Node::Binary(
                Operator::Power,
                Box::new(base),
                Box::new(exponent),
            ));
        }
        Ok(base)
    }

    fn atom(&mut self) -> Result<Node, ParseError> {
        self.blanks();
        match self.peek() {
            Some('(') => {
                self.at += 1;
                let inside = self.sum()?;
                self.expect(")")?;
                Ok(inside)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_alphabetic() || c == '_' => self.named(),
            Some(c) => Err(self.error(format!("`{c}` where a value is needed"))),
            None => Err(self.error("the expression ends where a value is needed")),
        }
    }

    fn number(&mut self) -> Result<Node, ParseError> {
        let start = self.at;
        let digits = |parser: &mut Self| {
            while parser.peek().is_some_and(|c| c.is_ascii_digit()) {
                parser.at += 1;
            }
        };
        digits(self);
        if self.peek() == Some('.') {
            self.at += 1;
            digits(self);
        }
        if matches!(self.peek(), Some('e' | 'E')) {
            let mantissa = self.at;
            self.at += 1;
            if matches!(self.peek(), Some('+' | '-')) {
                self.at += 1;
            }
            if self.peek().is_some_and(|c| c.is_ascii_digit()) {
                digits(self);
            } else {
                self.at = mantissa;
            }
        }
        let text: String = self.chars[start..self.at].iter().collect();
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Node::Number(value)),
            _ => {
                self.at = start;
                Err(self.error(format!("`{text}` is not a finite number")))
            }
        }
    }

    fn named(&mut self) -> Result<Node, ParseError> {
        let start = self.at;
        while self.peek().is_some_and(|c| c.is_alphanumeric() || c == '_') {
            self.at += 1;
        }
        let name: String = self.chars[start..self.at].iter().collect();
        match name.as_str() {
            "x" => return Ok(Node::Coordinate(0)),
            "y" => return Ok(Node::Coordinate(1)),
            "z" => return Ok(Node::Coordinate(2)),
            "pi" => return Ok(Node::Pi),
            "if" => return self.choice(),
            "pow" => return self.pow(),
            _ => {}
        }
        let Some((_, count, function, _, _)) = FUNCTIONS.iter().find(|row| row.0 == name) else {
            self.at = start;
            let known: Vec<_> = FUNCTIONS.iter().map(|row| row.0).collect();
            return Err(self.error(format!(
                "`{name}` is not known: use x, y, z, pi, if, pow, {}",
                known.join(", ")
            )));
        };
        self.expect("(")?;
        let mut arguments = vec![self.sum()?];
        while self.take(",") {
            arguments.push(self.sum()?);
        }
        self.expect(")")?;
        if arguments.len() != *count {
            self.at = start;
            return Err(self.error(format!(
                "`{name}` takes {count} argument{}, not {}",
                if *count == 1 { "" } else { "s" },
                arguments.len()
            )));
        }
        Ok(Node::Call(*function, arguments))
    }

    /// `pow(a, b)` is a^b.
    fn pow(&mut self) -> Result<Node, ParseError> {
        self.expect("(")?;
        let base = self.sum()?;
        self.expect(",")?;
        let exponent = self.sum()?;
        self.expect(")")?;
        Ok(Node::Binary(
            Operator::Power,
            Box::new(base),
            Box::new(exponent),
        ))
    }

    fn choice(&mut self) -> Result<Node, ParseError> {
        self.expect("(")?;
        let a = self.sum()?;
        let comparison = if self.take("<=") {
            Comparison::LessEqual
        } else if self.take(">=") {
            Comparison::GreaterEqual
        } else if self.take("<") {
            Comparison::Less
        } else if self.take(">") {
            Comparison::Greater
        } else {
            return Err(self.error("`if` needs a comparison (<, <=, >, >=) first"));
        };
        let b = self.sum()?;
        self.expect(",")?;
        let then = self.sum()?;
        self.expect(",")?;
        let otherwise = self.sum()?;
        self.expect(")")?;
        Ok(Node::If(comparison, Box::new([a, b, then, otherwise])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str, x: f64, y: f64) -> f64 {
        Expression::parse(text).unwrap().value([x, y, 0.0])
    }

    #[test]
    fn precedence_is_that_of_mathematics() {
        assert_eq!(value("-2^2", 0.0, 0.0), -4.0);
        assert_eq!(value("2^3^2", 0.0, 0.0), 512.0);
        assert_eq!(value("2**-1", 0.0, 0.0), 0.5);
        assert_eq!(value("1 - 2 - 3", 0.0, 0.0), -4.0);
        assert_eq!(value("8/4/2", 0.0, 0.0), 1.0);
        assert_eq!(value("2*x^2 + y", 3.0, 1.0), 19.0);
        assert_eq!(value("1/2", 0.0, 0.0), 0.5);
        assert_eq!(value("if(x <= 1, y, -y)", 1.0, 7.0), 7.0);
        assert_eq!(value("max(x, min(y, 2))", 1.0, 5.0), 2.0);
        assert_eq!(value("atan2(y, x)", 0.0, 1.0), std::f64::consts::FRAC_PI_2);
        assert_eq!(value("pow(x, 1 + 1)", 3.0, 0.0), 9.0);
        assert_eq!(value("3e2 + .5e-1", 0.0, 0.0), 300.05);
    }

    #[test]
    fn what_is_not_a_formula_is_refused_with_its_place() {
        for (text, column) in [
            ("1); exec(\"touch x\")", 2),
            ("sin(x", 6),
            ("system(x)", 1),
            ("x.__class__", 2),
            ("sin(x, y)", 1),
            ("", 1),
            ("2 x", 3),
            ("1e999", 1),
            ("if(x, 1, 2)", 5),
        ] {
            let error = Expression::parse(text).unwrap_err();
            assert_eq!(error.column, column, "{text}: {}", error.what);
        }
        assert!(Expression::parse(&"(".repeat(5000)).is_err());
        assert!(Expression::parse(&"-".repeat(5000)).is_err());
        assert!(Expression::parse(&format!("1{}", "+1".repeat(5000))).is_err());
        assert!(Expression::parse(&format!("1{}", "^1".repeat(5000))).is_err());
        assert!(Expression::parse(&"x".repeat(30_000)).is_err());
    }

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
