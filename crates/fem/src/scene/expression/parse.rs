//! From terms to the tree of a formula: what names mean in scenes.

use super::syntax::{Kind, Term};
use super::{FUNCTIONS, Function, Node, Operator, ParseError};

/// The tree of a formula.
pub(super) fn parse(text: &str) -> Result<Node, ParseError> {
    node(&Term::parse(text)?)
}

fn node(term: &Term) -> Result<Node, ParseError> {
    Ok(match &term.kind {
        Kind::Number(value) => Node::Number(*value),
        Kind::Name(name) => named(term, name)?,
        Kind::Negative(a) => match node(a)? {
            Node::Number(value) => Node::Number(-value),
            other => Node::Negative(Box::new(other)),
        },
        Kind::Binary(operator, parts) => binary(*operator, &parts[0], &parts[1])?,
        Kind::Call(function, arguments) => match &function.kind {
            Kind::Name(name) => call(term, name, arguments)?,
            _ => return Err(function.error("this is not a function")),
        },
        Kind::Compare(..) => return Err(term.error("a comparison where a value is needed")),
        Kind::Named(..) => return Err(term.error("`=` where a value is needed")),
        Kind::Text(_) => return Err(term.error("a text where a value is needed")),
        Kind::List(_) => return Err(term.error("`[` where a value is needed")),
        Kind::Index(a, _) | Kind::Member(a, _) => {
            return Err(ParseError {
                column: a.end + 1,
                what: "a component of something that has none".into(),
            });
        }
    })
}

fn binary(operator: Operator, a: &Term, b: &Term) -> Result<Node, ParseError> {
    Ok(Node::Binary(
        operator,
        Box::new(node(a)?),
        Box::new(node(b)?),
    ))
}

fn named(term: &Term, name: &str) -> Result<Node, ParseError> {
    match name {
        "x" => Ok(Node::Coordinate(0)),
        "y" => Ok(Node::Coordinate(1)),
        "z" => Ok(Node::Coordinate(2)),
        "pi" => Ok(Node::Pi),
        "if" | "pow" => Err(after(term, "`(` is needed")),
        _ if Function::of_name(name).is_some() => Err(after(term, "`(` is needed")),
        _ => Err(unknown(term, name)),
    }
}

fn after(term: &Term, what: &str) -> ParseError {
    ParseError {
        column: term.end + 1,
        what: what.into(),
    }
}

fn unknown(term: &Term, name: &str) -> ParseError {
    let known: Vec<_> = FUNCTIONS.iter().map(|row| row.0).collect();
    term.error(format!(
        "`{name}` is not known: use x, y, z, pi, if, pow, {}",
        known.join(", ")
    ))
}

fn call(term: &Term, name: &str, arguments: &[Term]) -> Result<Node, ParseError> {
    let takes = |count: usize| match arguments.len() == count {
        true => Ok(()),
        false => Err(term.error(format!(
            "`{name}` takes {count} argument{}, not {}",
            if count == 1 { "" } else { "s" },
            arguments.len()
        ))),
    };
    match name {
        "if" => {
            let Kind::Compare(comparison, sides) = &arguments[0].kind else {
                let needed = "`if` needs a comparison (<, <=, >, >=) first";
                return Err(after(&arguments[0], needed));
            };
            takes(3)?;
            let parts = [&sides[0], &sides[1], &arguments[1], &arguments[2]];
            let [a, b, then, otherwise] = parts.map(node);
            Ok(Node::If(*comparison, Box::new([a?, b?, then?, otherwise?])))
        }
        // pow(a, b) is a^b.
        "pow" => {
            takes(2)?;
            binary(Operator::Power, &arguments[0], &arguments[1])
        }
        _ => {
            let Some((function, count)) = Function::of_name(name) else {
                return Err(unknown(term, name));
            };
            takes(count)?;
            let arguments = arguments.iter().map(node).collect::<Result<_, _>>()?;
            Ok(Node::Call(function, arguments))
        }
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
