//! From text to terms: the one grammar of scenes, of data and of weak forms. The reader of the terms decides what a name means.
//!
//! ```text
//! sum      = product { ("+" | "-") product }
//! product  = sign { ("*" | "/") sign }
//! sign     = { "-" | "+" } power                       -x^2 is -(x^2)
//! power    = postfix [ ("^" | "**") sign ]             right-associative
//! postfix  = atom { "[" arguments "]" | "." name | "(" arguments ")" }
//! atom     = number | name | "(" sum ")" | "[" arguments "]"
//! arguments = argument { "," argument }
//! argument = text | name "=" sum | sum [ ("<" | "<=" | ">" | ">=") sum ]         text is in '…' or "…"
//! ```

use super::{Comparison, Operator, ParseError};

/// Longest text and deepest nesting accepted: far beyond any formula, far below the stack's end.
const MAX_LENGTH: usize = 20_000;
const MAX_DEPTH: usize = 120;

/// A part of a text with its place, in characters from 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// Its first character.
    pub start: usize,
    /// The one after its last.
    pub end: usize,
    /// Its kind.
    pub kind: Kind,
}

/// The kinds of terms.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    /// As in `2.5e-3`.
    Number(f64),
    /// As in `x`.
    Name(String),
    /// As in `'+'`: only as an argument.
    Text(String),
    /// `[a, b]`
    List(Vec<Term>),
    /// `-a`
    Negative(Box<Term>),
    /// `a + b` and the like.
    Binary(Operator, Box<[Term; 2]>),
    /// `a < b` and the like: only as an argument.
    Compare(Comparison, Box<[Term; 2]>),
    /// `name = a`: only as an argument.
    Named(String, Box<Term>),
    /// `f(a, b)`
    Call(Box<Term>, Vec<Term>),
    /// `a[i, j]`
    Index(Box<Term>, Vec<Term>),
    /// `a.name`
    Member(Box<Term>, String),
}

impl Term {
    /// Parses a text.
    ///
    /// # Errors
    /// A text outside the grammar, with the column; a text that is too long or nested too deeply.
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
            None => Ok(root),
            Some(c) => Err(parser.error(format!("`{c}` where the expression should end"))),
        }
    }

    /// An error about this term.
    pub fn error(&self, what: impl Into<String>) -> ParseError {
        ParseError {
            column: self.start + 1,
            what: what.into(),
        }
    }
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

    /// A term that ends at the position of the parser; blanks do not belong to it.
    fn term(&self, start: usize, kind: Kind) -> Term {
        let mut end = self.at;
        while end > start && self.chars[end - 1].is_whitespace() {
            end -= 1;
        }
        Term { start, end, kind }
    }

    fn binary(&self, operator: Operator, a: Term, b: Term) -> Term {
        self.term(a.start, Kind::Binary(operator, Box::new([a, b])))
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

    fn sum(&mut self) -> Result<Term, ParseError> {
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
            let right = self.product()?;
            left = self.binary(operator, left, right);
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

    fn product(&mut self) -> Result<Term, ParseError> {
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
            let right = self.sign()?;
            left = self.binary(operator, left, right);
        }
        self.depth = outer;
        Ok(left)
    }

    fn sign(&mut self) -> Result<Term, ParseError> {
        let outer = self.depth;
        self.blanks();
        let start = self.at;
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
        Ok(match negative {
            false => power,
            true => self.term(start, Kind::Negative(Box::new(power))),
        })
    }

    fn power(&mut self) -> Result<Term, ParseError> {
        let base = self.postfix()?;
        if self.take("^") || self.take("**") {
            self.chain()?;
            let exponent = self.sign()?;
            return Ok(self.binary(Operator::Power, base, exponent));
        }
        Ok(base)
    }

    fn postfix(&mut self) -> Result<Term, ParseError> {
        let mut left = self.atom()?;
        loop {
            let start = left.start;
            let kind = if self.take("(") {
                Kind::Call(Box::new(left), self.arguments(")")?)
            } else if self.take("[") {
                Kind::Index(Box::new(left), self.arguments("]")?)
            } else if self.peek() == Some('.') {
                self.at += 1;
                let start = self.at;
                let name = self.word();
                if name.is_empty() {
                    self.at = start - 1;
                    return Err(self.error("`.` where the expression should end"));
                }
                Kind::Member(Box::new(left), name)
            } else {
                return Ok(left);
            };
            self.chain()?;
            left = self.term(start, kind);
        }
    }

    fn arguments(&mut self, end: &str) -> Result<Vec<Term>, ParseError> {
        let mut all = vec![self.argument()?];
        while self.take(",") {
            all.push(self.argument()?);
        }
        self.expect(end)?;
        Ok(all)
    }

    fn argument(&mut self) -> Result<Term, ParseError> {
        self.blanks();
        if let Some(quote @ ('\'' | '"')) = self.peek() {
            let start = self.at;
            self.at += 1;
            while self.peek().is_some_and(|c| c != quote) {
                self.at += 1;
            }
            let text = self.chars[start + 1..self.at].iter().collect();
            self.expect(&quote.to_string())?;
            return Ok(self.term(start, Kind::Text(text)));
        }
        let left = self.sum()?;
        if let Kind::Name(name) = &left.kind
            && self.take("=")
        {
            let value = Box::new(self.sum()?);
            return Ok(self.term(left.start, Kind::Named(name.clone(), value)));
        }
        // The longer ones first.
        let signs = [
            ("<=", Comparison::LessEqual),
            (">=", Comparison::GreaterEqual),
            ("<", Comparison::Less),
            (">", Comparison::Greater),
        ];
        let Some((_, comparison)) = signs.into_iter().find(|(sign, _)| self.take(sign)) else {
            return Ok(left);
        };
        let right = self.sum()?;
        Ok(self.term(
            left.start,
            Kind::Compare(comparison, Box::new([left, right])),
        ))
    }

    fn word(&mut self) -> String {
        let start = self.at;
        while self.peek().is_some_and(|c| c.is_alphanumeric() || c == '_') {
            self.at += 1;
        }
        self.chars[start..self.at].iter().collect()
    }

    fn atom(&mut self) -> Result<Term, ParseError> {
        self.blanks();
        let start = self.at;
        match self.peek() {
            Some('(') => {
                self.at += 1;
                let inside = self.sum()?;
                self.expect(")")?;
                Ok(self.term(start, inside.kind))
            }
            Some('[') => {
                self.at += 1;
                let parts = self.arguments("]")?;
                Ok(self.term(start, Kind::List(parts)))
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_alphabetic() || c == '_' => {
                let name = self.word();
                Ok(self.term(start, Kind::Name(name)))
            }
            Some(c) => Err(self.error(format!("`{c}` where a value is needed"))),
            None => Err(self.error("the expression ends where a value is needed")),
        }
    }

    fn number(&mut self) -> Result<Term, ParseError> {
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
            Ok(value) if value.is_finite() => Ok(self.term(start, Kind::Number(value))),
            _ => {
                self.at = start;
                Err(self.error(format!("`{text}` is not a finite number")))
            }
        }
    }
}
