//! HTML from small functions: what is text is escaped, whatever it holds, and nothing else gets into the page.

use std::fmt::Write as _;

use crate::report::model::{Cell, Table, short, word as word_of};
use faceoff_judge::Verdict;

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

/// A drawing that was made here, of this class and called `label` where it is not seen.
pub(super) fn picture(svg: &str, label: &str, class: &str) -> Html {
    let start = svg.find("<svg ").unwrap_or(0);
    let label = escape(label);
    let head = format!("<svg role=\"img\" aria-label=\"{label}\" class=\"{class}\" ");
    raw(svg[start..].replacen("<svg ", &head, 1).replace('\n', ""))
}

/// A table whose columns sort. A row with a verdict that is no pass is set off.
pub(super) fn table(table: &Table) -> Html {
    let numeric: Vec<bool> = (0..table.head.len()).map(|k| table.is_numeric(k)).collect();
    let class = |k: usize| Vec::from_iter(numeric[k].then_some(("class", "n")));
    let head = table.head.iter().enumerate();
    let head = head.map(|(k, name)| leaf("th", &[&[("scope", "col")], &*class(k)].concat(), name));
    let rows = table.rows.iter().map(|row| {
        let cells = row.iter().zip(0..numeric.len());
        let cells = cells.map(|(cell, k)| {
            let key = match cell {
                Cell::Number(value, _) if value.is_finite() => value.to_string(),
                _ => String::new(),
            };
            let mut attributes = class(k);
            attributes.extend((!key.is_empty()).then_some(("data-key", key.as_str())));
            element("td", &attributes, shown(cell))
        });
        let verdict = row.iter().filter_map(|cell| match cell {
            Cell::Verdict(verdict) | Cell::Judged(verdict, _) => Some(*verdict),
            _ => None,
        });
        let class = verdict.max().map_or("", word_of);
        element("tr", &[("class", class)], cells)
    });
    let table = element(
        "table",
        &[],
        [
            leaf("caption", &[], &table.caption),
            element("thead", &[], element("tr", &[], head)),
            element("tbody", &[], rows),
        ],
    );
    element("div", &[("class", "wide")], table)
}

fn shown(cell: &Cell) -> Html {
    match cell {
        Cell::Text(words) => prose(words),
        Cell::Number(_, digits) => text(digits),
        Cell::Verdict(verdict) => word(*verdict),
        Cell::Judged(verdict, number) => {
            Html::from([word(*verdict), text(format!(" {}", short(*number)))])
        }
        Cell::Link(to, words) => leaf("a", &[("href", to)], words),
    }
}

/// The verdict as a word that does not rely on its colour.
pub(super) fn word(verdict: Verdict) -> Html {
    let word = word_of(verdict);
    leaf("span", &[("class", &format!("word {word}"))], word)
}

/// Names and what they are.
pub(super) fn facts(facts: &[(impl AsRef<str>, String)]) -> Html {
    let items = facts.iter();
    let items =
        items.flat_map(|(name, fact)| [leaf("dt", &[], name), element("dd", &[], prose(fact))]);
    element("dl", &[], items)
}

/// What the colours of a picture mean: of the classes `k0`, `k1`, … the one that each name has.
pub(super) fn key(class: &str, classes: usize, names: &[&str]) -> Html {
    let items = names.iter().enumerate().map(|(k, name)| {
        let swatch = leaf("i", &[("class", &format!("{class}{}", k % classes))], "");
        element("li", &[], [swatch, text(name)])
    });
    element("ul", &[("class", "key")], items)
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
