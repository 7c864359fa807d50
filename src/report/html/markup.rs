//! HTML from templates: text is always escaped, and nothing else gets into the page.

use maud::Render;

use crate::report::console::misleads;
use crate::text::{Piece, Span, Text};

/// A piece of a page. Its only ways in are [`html!`] and [`raw`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Html(String);

/// A piece from a template of maud.
macro_rules! html {
    ($($body:tt)*) => { $crate::report::html::markup::raw(maud::html! { $($body)* }.into_string()) };
}
pub(super) use html;

impl Html {
    pub fn as_str(&self) -> &str {
        &self.0
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl FromIterator<Html> for Html {
    fn from_iter<I: IntoIterator<Item = Html>>(pieces: I) -> Self {
        Html(pieces.into_iter().map(|piece| piece.0).collect())
    }
}

impl<const N: usize> From<[Html; N]> for Html {
    fn from(pieces: [Html; N]) -> Self {
        pieces.into_iter().collect()
    }
}

impl Render for Html {
    fn render_to(&self, html: &mut String) {
        html.push_str(&self.0);
    }
}

/// A sentence: emphasised parts bold, input as code, numbers in decimal notation.
impl Render for Text {
    fn render_to(&self, html: &mut String) {
        html.push_str(&emphasised(self, "b").0);
    }
}

/// The same with emphasised parts in an element of this kind.
pub(super) fn emphasised(words: &Text, tag: &str) -> Html {
    let runs = words.spans().chunk_by(|a, b| a.is_strong == b.is_strong);
    let run = |run: &[Span]| {
        let inner: Html = run.iter().map(|span| shown(&span.piece)).collect();
        match run[0].is_strong {
            true => raw(format!("<{tag}>{}</{tag}>", inner.0)),
            false => inner,
        }
    };
    runs.map(run).collect()
}

fn shown(piece: &Piece) -> Html {
    match piece {
        Piece::Words(words) => html! { (words) },
        Piece::Code(words) => html! { code { (words) } },
        Piece::Boundary(letter) => html! { "Γ" sub { (letter) } },
        Piece::Number(number) => html! { (number.told()) },
        Piece::Link(to, words) => html! { a href=(to) { (words) } },
    }
}

/// Text that is already HTML: pictures drawn here, and the program's style and script.
pub(super) fn raw(html: impl Into<String>) -> Html {
    Html(html.into())
}

/// Names with their descriptions.
pub(super) fn facts(facts: &[(Text, Text)]) -> Html {
    html! { dl { @for (name, fact) in facts { dt { (name) } dd { (fact) } } } }
}

/// A picture with its caption above, of which the emphasised part comes first.
pub(super) fn figure(class: &str, caption: impl Into<Text>, picture: Html) -> Html {
    let class = Some(class).filter(|class| !class.is_empty());
    html! { figure class=[class] { figcaption { (caption.into()) } (picture) } }
}

/// The same for a wide page and for a narrow one.
pub(super) fn figures(class: &str, caption: impl Into<Text>, [wide, narrow]: [Html; 2]) -> Html {
    figure(
        class,
        caption,
        html! { .wide { (wide) } .narrow { (narrow) } },
    )
}

/// A part that opens when its name is clicked.
pub(super) fn folded(summary: Html, inner: Html) -> Html {
    html! { details { summary { (summary) } (inner) } }
}

/// Characters that are allowed in XML between tags or quotes.
pub(super) fn escape(text: &str) -> String {
    visible(&html! { (text) }.0)
}

/// Without misleading characters, which no page and no picture needs.
pub(super) fn visible(html: &str) -> String {
    let shown = |c: char| match c {
        '\n' | '\t' => c,
        _ if c.is_control() || misleads(c) => '\u{fffd}',
        _ => c,
    };
    html.chars().map(shown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::text::text;

    #[test]
    fn what_one_would_type_is_code() {
        let told = html! { (text!("of `{}` in `c`", "a<b")) };
        let code = "of <code>a&lt;b</code> in <code>c</code>";
        assert_eq!(told.as_str(), code);
    }

    #[test]
    fn text_cannot_become_markup() {
        let evil = "</td><script>alert('x')</script>\u{1b}\"";
        let html = html! { td title=(evil) { (evil) } };
        let html = visible(html.as_str());
        assert_eq!(html.matches('<').count(), 2);
        assert_eq!(html.matches('"').count(), 2);
        assert!(!html.contains('\u{1b}'));
    }
}
