//! HTML from small functions: what is text is escaped, whatever it holds, and nothing else gets into the page.

use std::fmt::Write as _;

use crate::report::console::misleads;
use crate::text::{Piece, Span, Text};

/// A piece of a page. Its only ways in are [`text`], [`element`] and [`raw`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Html(String);

impl Html {
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromIterator<Html> for Html {
    fn from_iter<I: IntoIterator<Item = Html>>(pieces: I) -> Self {
        let mut all = String::new();
        pieces.into_iter().for_each(|piece| all.push_str(&piece.0));
        Html(all)
    }
}

/// A piece is all that there is of it.
impl IntoIterator for Html {
    type Item = Html;
    type IntoIter = std::iter::Once<Html>;

    fn into_iter(self) -> Self::IntoIter {
        std::iter::once(self)
    }
}

impl<const N: usize> From<[Html; N]> for Html {
    fn from(pieces: [Html; N]) -> Self {
        pieces.into_iter().collect()
    }
}

pub(super) fn text(text: impl AsRef<str>) -> Html {
    Html(escape(text.as_ref()))
}

/// A sentence: what stands out bold, what one would type as code, numbers as people write them.
pub(super) fn prose(words: impl Into<Text>) -> Html {
    emphasised(&words.into(), "b")
}

/// The same with what stands out in an element of this kind.
pub(super) fn emphasised(words: &Text, tag: &str) -> Html {
    let runs = words.spans().chunk_by(|a, b| a.is_strong == b.is_strong);
    let run = |run: &[Span]| {
        let inner: Html = run.iter().map(|span| shown(&span.piece)).collect();
        match run[0].is_strong {
            true => element(tag, &[], inner),
            false => inner,
        }
    };
    runs.map(run).collect()
}

fn shown(piece: &Piece) -> Html {
    match piece {
        Piece::Words(words) => text(words),
        Piece::Code(words) => leaf("code", &[], words),
        Piece::Boundary(letter) => Html::from([text("Γ"), leaf("sub", &[], letter.to_string())]),
        Piece::Number(number) => text(number.told()),
        Piece::Link(to, words) => leaf("a", &[("href", to)], words),
    }
}

/// What is HTML already: pictures that were drawn here, style and script that the program carries.
pub(super) fn raw(html: impl Into<String>) -> Html {
    Html(html.into())
}

pub(super) fn element(
    tag: &str,
    attributes: &[(&str, &str)],
    inner: impl IntoIterator<Item = Html>,
) -> Html {
    let mut html = format!("<{tag}");
    for (name, value) in attributes {
        let _ = write!(html, " {name}=\"{}\"", escape(value));
    }
    let _ = write!(html, ">{}</{tag}>", inner.into_iter().collect::<Html>().0);
    Html(html)
}

/// An element that holds only text.
pub(super) fn leaf(tag: &str, attributes: &[(&str, &str)], inner: impl AsRef<str>) -> Html {
    element(tag, attributes, text(inner))
}

/// Names and what they are.
pub(super) fn facts(facts: &[(Text, Text)]) -> Html {
    let of = |(name, fact): &(Text, Text)| {
        [
            element("dt", &[], prose(name)),
            element("dd", &[], prose(fact)),
        ]
    };
    element("dl", &[], facts.iter().flat_map(of))
}

/// A picture under what it shows in words, of which what stands out comes first.
pub(super) fn figure(
    class: &str,
    caption: impl Into<Text>,
    pictures: impl IntoIterator<Item = Html>,
) -> Html {
    let caption = element("figcaption", &[], prose(caption));
    let pictures: Html = pictures.into_iter().collect();
    element("figure", &[("class", class)], [caption, pictures])
}

pub(super) fn division(class: &str, inner: impl IntoIterator<Item = Html>) -> Html {
    element("div", &[("class", class)], inner)
}

/// What opens when its name is pressed.
pub(super) fn folded(summary: Html, inner: impl IntoIterator<Item = Html>) -> Html {
    let inner: Html = inner.into_iter().collect();
    element("details", &[], [element("summary", &[], summary), inner])
}

pub(super) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            c if c.is_control() && c != '\n' && c != '\t' => escaped.push('\u{fffd}'),
            c if misleads(c) => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::text::text;

    #[test]
    fn what_one_would_type_is_code() {
        let told = prose(text!("of `{}` in `c`", "a<b"));
        let code = "of <code>a&lt;b</code> in <code>c</code>";
        assert_eq!(told.as_str(), code);
    }

    #[test]
    fn text_cannot_become_markup() {
        let evil = "</td><script>alert('x')</script>\u{1b}\"";
        let html = element("td", &[("title", evil)], text(evil));
        assert_eq!(html.as_str().matches('<').count(), 2);
        assert_eq!(html.as_str().matches('"').count(), 2);
        assert!(!html.as_str().contains('\u{1b}'));
    }
}
