//! `text!`, which makes a `Text` of faceoff from a template, as `format!` makes a string.
//!
//! In the template `{}` is the next argument, and `{name}` or `{of.name}` the value of that name where the macro is called. The rest of the
//! syntax is described in `src/text` of faceoff.

use proc_macro::{Delimiter, Group, Literal, TokenStream, TokenTree};

/// A sentence from a template and the values for its `{}`.
#[proc_macro]
pub fn text(input: TokenStream) -> TokenStream {
    let mut arguments = split(input).into_iter();
    let Some(template) = arguments.next() else {
        return complaint("text! needs a template");
    };
    let arguments: Vec<TokenStream> = arguments.collect();
    match &template.clone().into_iter().collect::<Vec<_>>()[..] {
        [TokenTree::Literal(literal)] => filled(&literal.to_string(), arguments),
        // A constant, which has no holes.
        _ if arguments.is_empty() => call(template, Vec::new()),
        _ => complaint("text! fills templates that are written where it is called"),
    }
}

/// The parts between commas.
fn split(input: TokenStream) -> Vec<TokenStream> {
    let is_comma = |tree: &TokenTree| matches!(tree, TokenTree::Punct(mark) if *mark == ',');
    let trees: Vec<TokenTree> = input.into_iter().collect();
    let parts = trees.split(is_comma);
    let parts = parts.map(|part| part.iter().cloned().collect::<TokenStream>());
    parts.filter(|part| !part.is_empty()).collect()
}

/// The template, as it is written, with all names removed, and the value for each of its `{}`.
fn filled(template: &str, arguments: Vec<TokenStream>) -> TokenStream {
    let mut arguments = arguments.into_iter();
    let (mut plain, mut values) = (String::new(), Vec::new());
    let mut parts = template.split('{');
    plain += parts.next().unwrap_or_default();
    for part in parts {
        plain.push('{');
        let Some((name, rest)) = part.split_once('}') else {
            plain += part;
            continue;
        };
        let value = match name {
            "" => arguments.next().map(from),
            path if is_path(path) => path.parse().ok().map(borrowed),
            _ => {
                plain += part;
                continue;
            }
        };
        let Some(value) = value else {
            return complaint("a `{}` of the template has no argument");
        };
        values.push(value);
        plain += "}";
        plain += rest;
    }
    if arguments.next().is_some() {
        return complaint("an argument has no `{}` in the template");
    }
    match plain.parse::<Literal>() {
        Ok(literal) => call(TokenTree::from(literal).into(), values),
        Err(_) => complaint("the template of text! is a string"),
    }
}

/// `name` or `of.name`
fn is_path(text: &str) -> bool {
    let is_letter = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
    let starts = |part: &str| part.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_');
    text.starts_with(|c: char| c.is_ascii_lowercase())
        && text.chars().all(is_letter)
        && text.split('.').all(starts)
}

fn code(text: &str) -> TokenStream {
    // Words of this file, which are Rust.
    text.parse().unwrap_or_default()
}

fn within(delimiter: Delimiter, inner: TokenStream) -> TokenStream {
    TokenTree::from(Group::new(delimiter, inner)).into()
}

/// `Text::from(value)`
fn from(value: TokenStream) -> TokenStream {
    [
        code("crate::text::Text::from"),
        within(Delimiter::Parenthesis, value),
    ]
    .into_iter()
    .collect()
}

/// `Text::from(&value)`
fn borrowed(value: TokenStream) -> TokenStream {
    from([code("&"), value].into_iter().collect())
}

/// `Text::filled(template, [values])`
fn call(template: TokenStream, values: Vec<TokenStream>) -> TokenStream {
    let values: TokenStream = values
        .into_iter()
        .flat_map(|value| [value, code(",")])
        .collect();
    let inner = [template, code(","), within(Delimiter::Bracket, values)];
    let inner = within(Delimiter::Parenthesis, inner.into_iter().collect());
    [code("crate::text::Text::filled"), inner]
        .into_iter()
        .collect()
}

fn complaint(words: &str) -> TokenStream {
    code(&format!("compile_error!({words:?})"))
}
