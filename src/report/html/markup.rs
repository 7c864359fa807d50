//! HTML from small functions: what is text is escaped, whatever it holds, and nothing else gets into the page.

use std::fmt::Write as _;

/// A piece of a page. Its only ways in are [`text`], [`element`] and [`raw`].
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Html(String);

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

impl<const N: usize> From<[Html; N]> for Html {
    fn from(pieces: [Html; N]) -> Self {
        pieces.into_iter().collect()
    }
}

pub(super) fn text(text: impl AsRef<str>) -> Html {
    Html(escape(text.as_ref()))
}

/// A text in which `…` encloses what one would type.
pub(super) fn prose(words: impl AsRef<str>) -> Html {
    let parts = words.as_ref().split('`').enumerate();
    parts
        .map(|(k, part)| match k % 2 {
            0 => text(part),
            _ => leaf("code", &[], part),
        })
        .collect()
}

/// What is HTML already: pictures that were drawn here, style and script that the program carries.
pub(super) fn raw(html: impl Into<String>) -> Html {
    Html(html.into())
}

pub(super) fn element(tag: &str, attributes: &[(&str, &str)], inner: impl Into<Html>) -> Html {
    let mut html = format!("<{tag}");
    for (name, value) in attributes {
        let _ = write!(html, " {name}=\"{}\"", escape(value));
    }
    let _ = write!(html, ">{}</{tag}>", inner.into().0);
    Html(html)
}

/// An element that holds only text.
pub(super) fn leaf(tag: &str, attributes: &[(&str, &str)], inner: impl AsRef<str>) -> Html {
    element(tag, attributes, text(inner))
}

/// A table whose columns sort; `class` of a row may be empty.
pub(super) fn table(caption: &str, head: &[&str], rows: Vec<(&str, Vec<Html>)>) -> Html {
    let head: Html = head
        .iter()
        .map(|name| leaf("th", &[("scope", "col")], name))
        .collect();
    let rows: Html = rows
        .into_iter()
        .map(|(class, cells)| {
            let cells: Html = cells
                .into_iter()
                .map(|cell| element("td", &[], cell))
                .collect();
            element("tr", &[("class", class)], cells)
        })
        .collect();
    let table = element(
        "table",
        &[],
        [
            leaf("caption", &[], caption),
            element("thead", &[], element("tr", &[], head)),
            element("tbody", &[], rows),
        ],
    );
    element("div", &[("class", "wide")], table)
}

/// A picture with what it shows in words.
pub(super) fn figure(picture: Html, caption: impl AsRef<str>) -> Html {
    let caption = element("figcaption", &[], prose(caption));
    element("figure", &[], [picture, caption])
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
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_one_would_type_is_code() {
        let told = prose("of `a<b` in `c`");
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
