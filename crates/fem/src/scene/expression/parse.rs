//! From text to tree.
//!
//! ```text
//! sum     = product { ("+" | "-") product }
//! product = sign { ("*" | "/") sign }
//! sign    = { "-" | "+" } power                       -x^2 is -(x^2)
//! power   = atom [ ("^" | "**") sign ]                right-associative
//! atom    = number | "pi" | "x" | "y" | "z" | "(" sum ")" | function "(" sum { "," sum } ")"
//!         | "if" "(" sum ("<" | "<=" | ">" | ">=") sum "," sum "," sum ")"
//! ```

use super::{Comparison, FUNCTIONS, Node, Operator, ParseError};

/// Longest text and deepest nesting accepted: far beyond any formula, far below the stack's end.
const MAX_LENGTH: usize = 20_000;
const MAX_DEPTH: usize = 120;

/// The tree of a formula.
pub(super) fn parse(text: &str) -> Result<Node, ParseError> {
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
        None => Ok(root),
        Some(c) => Err(parser.error(format!("`{c}` where the expression should end"))),
    }
}

fn binary(operator: Operator, a: Node, b: Node) -> Node {
    Node::Binary(operator, Box::new(a), Box::new(b))
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
            left = binary(operator, left, self.product()?);
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
            left = binary(operator, left, self.sign()?);
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
            return Ok(binary(Operator::Power, base, exponent));
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
        Ok(binary(Operator::Power, base, exponent))
    }

    fn choice(&mut self) -> Result<Node, ParseError> {
        self.expect("(")?;
        let a = self.sum()?;
        // The longer ones first.
        let signs = [
            ("<=", Comparison::LessEqual),
            (">=", Comparison::GreaterEqual),
            ("<", Comparison::Less),
            (">", Comparison::Greater),
        ];
        let found = signs.into_iter().find(|(sign, _)| self.take(sign));
        let needed = "`if` needs a comparison (<, <=, >, >=) first";
        let (_, comparison) = found.ok_or_else(|| self.error(needed))?;
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
    use crate::scene::Expression;

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
}
