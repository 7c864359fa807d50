//! HTML from small functions: what is text is escaped, whatever it holds, and nothing else gets into the page.

use std::fmt::Write as _;

use crate::report::console::misleads;
use crate::report::model::{Cell, Table, short, word as word_of};
use crate::report::number::in_words;
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

/// A text in which `…` encloses what one would type and **…** what stands out; numbers in it as a person writes them.
pub(super) fn prose(words: impl AsRef<str>) -> Html {
    emphasised(words.as_ref(), "b")
}

/// The same with what stands out in an element of its own.
pub(super) fn emphasised(words: &str, tag: &str) -> Html {
    let parts = words.split('`').enumerate();
    let outside = |part: &str| -> Html {
        let parts = part.split("**").enumerate();
        let of = |(k, part): (usize, &str)| match k % 2 {
            0 => symbols(part),
            _ => element(tag, &[], symbols(part)),
        };
        parts.map(of).collect()
    };
    let of = |(k, part): (usize, &str)| match k % 2 {
        0 => outside(part),
        _ => leaf("code", &[], part),
    };
    parts.map(of).collect()
}

/// Words with the parts of the boundary as one writes them, `Γ_C` with a C below.
fn symbols(words: &str) -> Html {
    let mut parts = words.split("Γ_");
    let first = parts.next().map(|part| text(in_words(part)));
    let rest = parts.map(|part| {
        let end = part.chars().next().map_or(0, char::len_utf8);
        Html::from([
            text("Γ"),
            leaf("sub", &[], &part[..end]),
            text(in_words(&part[end..])),
        ])
    });
    first.into_iter().chain(rest).collect()
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

/// A table of a report. A row with a verdict that is no pass is set off.
pub(super) fn table(table: &Table) -> Html {
    let head = table.head.iter().enumerate();
    let mut sheet = Sheet {
        caption: table.caption.clone(),
        head: head
            .map(|(k, name)| Column::new(if table.is_numeric(k) { "n" } else { "" }, prose(name)))
            .collect(),
        rows: Vec::new(),
    };
    for row in &table.rows {
        let entries = row.iter().map(|cell| {
            let value = match cell {
                Cell::Number(value, _) | Cell::Judged(_, value) => Some(*value),
                _ => None,
            };
            Entry::new(shown(cell), value)
        });
        let verdict = row.iter().filter_map(|cell| match cell {
            Cell::Verdict(verdict) | Cell::Judged(verdict, _) => Some(*verdict),
            _ => None,
        });
        let is_hot = verdict.max().is_some_and(|verdict| !verdict.passes());
        sheet.rows.push((is_hot, entries.collect()));
    }
    sheet.html()
}

/// A table of the page: columns that sort by the numbers behind them.
#[derive(Default)]
pub(super) struct Sheet {
    pub caption: String,
    pub head: Vec<Column>,
    /// Is a row set off?
    pub rows: Vec<(bool, Vec<Entry>)>,
}

/// The classes of a column and its heading: `n` is a number, `w` does not wrap, `opt` gives way on a narrow page, `d` has
/// dots on an axis.
pub(super) struct Column(&'static str, Html);

impl Column {
    pub fn new(class: &'static str, head: Html) -> Self {
        Column(class, head)
    }
}

/// What stands in a place, and by what it sorts if not by its words.
pub(super) struct Entry(Html, Option<f64>);

impl Entry {
    pub fn new(html: Html, value: Option<f64>) -> Self {
        Entry(html, value)
    }

    pub fn words(words: impl AsRef<str>) -> Self {
        Entry(prose(words), None)
    }

    pub fn number(value: f64, digits: impl AsRef<str>) -> Self {
        Entry(text(digits), Some(value))
    }
}

impl Sheet {
    pub fn html(self) -> Html {
        let head = self.head.iter().map(|Column(class, name)| {
            let class = Vec::from_iter((!class.is_empty()).then_some(("class", *class)));
            element(
                "th",
                &[&[("scope", "col")], &class[..]].concat(),
                name.clone(),
            )
        });
        let head: Html = head.collect();
        let rows = self.rows.into_iter().map(|(is_hot, entries)| {
            let cells = entries.into_iter().zip(&self.head);
            let cells = cells.map(|(Entry(html, value), Column(class, _))| {
                let key = value.filter(|v| v.is_finite()).map(|v| v.to_string());
                let mut attributes =
                    Vec::from_iter((!class.is_empty()).then_some(("class", *class)));
                attributes.extend(key.as_deref().map(|key| ("data-v", key)));
                element("td", &attributes, html)
            });
            let hot = is_hot.then_some(("class", "hot"));
            element("tr", hot.as_slice(), cells)
        });
        let rows: Html = rows.collect();
        let caption = match self.caption.is_empty() {
            true => Html::default(),
            false => element("caption", &[], prose(&self.caption)),
        };
        let head = element("thead", &[], element("tr", &[], head));
        let table = element("table", &[], [caption, head, element("tbody", &[], rows)]);
        element("div", &[("class", "scroll")], table)
    }
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
    match verdict {
        Verdict::Agree => text(word_of(verdict)),
        _ => leaf("b", &[("class", "bad")], word_of(verdict)),
    }
}

/// Names and what they are.
pub(super) fn facts(facts: &[(impl AsRef<str>, String)]) -> Html {
    let items = facts.iter();
    let items = items.flat_map(|(name, fact)| {
        [
            element("dt", &[], prose(name)),
            element("dd", &[], prose(fact)),
        ]
    });
    element("dl", &[], items)
}

/// A picture under what it shows in words, of which what stands out comes first.
pub(super) fn figure(
    class: &str,
    caption: impl AsRef<str>,
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
