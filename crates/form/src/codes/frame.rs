//! Templates: reading them, and the functions that they can call.

use std::sync::LazyLock;

use minijinja::syntax::SyntaxConfig;
use minijinja::{Environment, Error, UndefinedBehavior, Value};

use super::spelling::traces;
use super::{BY_HAND, CODES};
use crate::problem::Element;

/// The environment that templates share.
const PARTS: [(&str, &str); 8] = [
    ("head.txt", include_str!("frames/head.txt")),
    ("head.py", include_str!("frames/head.py")),
    ("lengths.py", include_str!("frames/lengths.py")),
    ("lists.py", include_str!("frames/lists.py")),
    ("newton.py", include_str!("frames/newton.py")),
    ("read.py", include_str!("frames/read.py")),
    ("system.py", include_str!("frames/system.py")),
    ("write_vtu.py", include_str!("frames/write_vtu.py")),
];

/// Fills the template of a code with the fields of a problem.
///
/// # Errors
/// A fault of the template.
pub fn fill(code: &str, fields: Value) -> Result<String, String> {
    static FRAMES: LazyLock<Result<Environment<'static>, Error>> = LazyLock::new(frames);
    let filled = match &*FRAMES {
        Ok(frames) => frames
            .get_template(code)
            .and_then(|frame| frame.render(fields)),
        Err(e) => Err(Error::new(e.kind(), e.to_string())),
    };
    filled.map_err(|e| {
        format!(
            "an internal error: the template for {code} cannot be filled: {e}; please report it"
        )
    })
}

/// The templates are parsed when they are asked for, since a run asks for few.
fn frames() -> Result<Environment<'static>, Error> {
    let mut all = Environment::new();
    let syntax = SyntaxConfig::builder()
        .trim_blocks(true)
        .lstrip_blocks(true)
        .keep_trailing_newline(true)
        .build()?;
    all.set_syntax(syntax);
    all.set_undefined_behavior(UndefinedBehavior::Strict);
    all.add_filter("within", within);
    all.add_filter("each", each);
    all.add_filter("dot", dot);
    all.add_function("trace", trace);
    all.set_loader(|asked| {
        let codes = CODES.iter().chain(&BY_HAND);
        let codes = codes.map(|code| (code.name, code.frame));
        let mut texts = PARTS.into_iter().chain(codes);
        let found = texts.find(|(name, _)| *name == asked);
        Ok(found.map(|(_, text)| text.to_owned()))
    });
    Ok(all)
}

/// Indents the lines of a block by a number of blanks, by default four.
fn within(text: &str, by: Option<usize>) -> String {
    let by = " ".repeat(by.unwrap_or(4));
    let lines = text.lines().map(|line| match line.is_empty() {
        true => "\n".to_owned(),
        false => format!("{by}{line}\n"),
    });
    lines.collect()
}

/// A text for each component, with `%` replaced by its number, counted from `first`.
fn each(text: &str, count: usize, first: usize) -> Vec<String> {
    let numbers = first..first + count;
    numbers.map(|k| text.replace('%', &k.to_string())).collect()
}

/// A scalar product.
fn dot(a: Vec<String>, b: Vec<String>) -> String {
    let each = a.iter().zip(&b).map(|(a, b)| format!("{a}*{b}"));
    each.collect::<Vec<_>>().join(" + ")
}

/// The components of a vector that are continuous on facets: the `normal` one, or all others.
fn trace(kind: &str, u: Vec<String>, n: Vec<String>) -> Vec<String> {
    let element = match kind {
        "normal" => Element::RaviartThomas,
        _ => Element::Nedelec,
    };
    traces(element, &u, &n)
}
