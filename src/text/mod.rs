//! Sentences as values, with emphasised parts, code, and numbers with their digits.
//!
//! A sentence is made once, by `text!`. Programs get it as plain text ([`Text`]'s `Display`); pages format its spans.
//! No code searches the text.

pub mod number;
mod outward;

use std::fmt::{self, Display, Formatter};

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use number::{number, signed};
pub use outward::{Digits, above, at_least, at_most, below, interval};

/// A text whose parts have a meaning.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Text(Vec<Span>);

/// A part of a sentence.
#[derive(Debug, Clone, PartialEq)]
pub struct Span {
    /// Whether it is emphasised.
    pub is_strong: bool,
    /// Its contents.
    pub piece: Piece,
}

/// The contents of a part of a sentence.
#[derive(Debug, Clone, PartialEq)]
pub enum Piece {
    /// Plain text, which is never interpreted.
    Words(String),
    /// Code: user input, or a name in a file.
    Code(String),
    /// The part of the boundary with this letter: Γ_C, Γ_D, Γ_N.
    Boundary(char),
    /// A number of a result.
    Number(Number),
    /// The target on a page, and the text.
    Link(String, String),
}

/// A number, and the precision that is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Number {
    value: f64,
    form: Form,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    /// This number of significant digits.
    Digits(usize),
    /// This number of decimals.
    Decimals(usize),
    /// As few digits as distinguish it from its neighbours, with a power of ten.
    Power,
    /// All digits.
    All,
}

/// On pages more digits than these are cut to a few.
const READABLE: usize = 10;

impl Number {
    /// With a given number of significant digits, as in `2.5e-7`.
    pub fn new(value: f64, digits: usize) -> Self {
        let form = Form::Digits(digits);
        Number { value, form }
    }

    /// An upper bound, rounded up.
    pub fn at_most(bound: f64, digits: usize) -> Self {
        Number::new(above(bound, Digits::Counting(digits)), digits)
    }

    /// A lower bound, rounded down.
    pub fn at_least(bound: f64, digits: usize) -> Self {
        Number::new(below(bound, Digits::Counting(digits)), digits)
    }

    /// With a given number of decimals.
    pub fn fixed(value: f64, decimals: usize) -> Self {
        let form = Form::Decimals(decimals);
        Number { value, form }
    }

    /// As few digits as it has, as in `1e-12`.
    pub fn power(value: f64) -> Self {
        let form = Form::Power;
        Number { value, form }
    }

    /// All digits that it has.
    pub fn exact(value: f64) -> Self {
        let form = Form::All;
        Number { value, form }
    }

    /// As people write it: `2.5 · 10⁻⁷`.
    pub fn told(&self) -> String {
        let plain = self.to_string();
        let mantissa = plain.split('e').next().unwrap_or(&plain);
        let counting = mantissa.trim_start_matches(['-', '0', '.']);
        let digits = counting.bytes().filter(u8::is_ascii_digit).count();
        match self.form {
            Form::Digits(digits) => number(self.value, digits),
            Form::Power if digits > READABLE => number(self.value, 4),
            Form::Power => number(self.value, digits.max(1)),
            Form::All if digits > READABLE => number(self.value, 6),
            Form::Decimals(_) if digits == 0 => "0".into(),
            Form::All | Form::Decimals(_) => signed(&plain),
        }
    }
}

/// As programs write it.
impl Display for Number {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let Number { value, form } = self;
        match form {
            Form::Digits(digits) => write!(f, "{value:.*e}", digits.saturating_sub(1)),
            Form::Decimals(decimals) => write!(f, "{value:.decimals$}"),
            Form::Power => write!(f, "{value:e}"),
            Form::All => write!(f, "{value}"),
        }
    }
}

/// A sentence from a template and the values for its `{}`, or of the names in them. In the template `…` encloses code
/// and **…** emphasis, and Γ_C is the part of the boundary; inserted values are not interpreted.
pub(crate) use faceoff_sentence::text;

impl Text {
    /// Its parts, one after the other.
    pub fn spans(&self) -> &[Span] {
        &self.0
    }

    /// Whether it has no parts.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// A message or a description that is kept as a string, in which `…` encloses code and Γ_C is the part of the
    /// boundary.
    pub fn message(words: &str) -> Self {
        let mut text = Text::default();
        if words.matches('`').count() % 2 == 1 {
            return Text::with_symbols(words);
        }
        for (k, part) in words.split('`').enumerate() {
            let part = match k % 2 {
                0 => Text::with_symbols(part),
                _ => Text::code(part),
            };
            text.add(false, part);
        }
        text
    }

    /// Code.
    pub fn code(words: impl Into<String>) -> Self {
        Text::of([Piece::Code(words.into())])
    }

    /// A link to a place on the page, or to a file next to it.
    pub fn link(to: impl Into<String>, words: impl Into<String>) -> Self {
        Text::of([Piece::Link(to.into(), words.into())])
    }

    /// Emphasised text.
    pub fn strong(words: impl Into<Text>) -> Self {
        let mut text = words.into();
        text.0.iter_mut().for_each(|span| span.is_strong = true);
        text
    }

    fn of(pieces: impl IntoIterator<Item = Piece>) -> Self {
        let said = |piece: &Piece| !matches!(piece, Piece::Words(words) if words.is_empty());
        let spans = pieces.into_iter().filter(said);
        let plain = |piece| Span {
            is_strong: false,
            piece,
        };
        Text(spans.map(plain).collect())
    }

    /// Called by `text!`.
    pub(crate) fn filled<const N: usize>(template: &str, values: [Text; N]) -> Self {
        let (mut text, mut values, mut is_strong) = (Text::default(), values.into_iter(), false);
        for (k, part) in template.split('`').enumerate() {
            if k % 2 == 1 {
                let mut words = String::new();
                let mut pieces = part.split("{}");
                words += pieces.next().unwrap_or_default();
                for piece in pieces {
                    words += &values.next().unwrap_or_default().to_string();
                    words += piece;
                }
                text.add(is_strong, Text::code(words));
                continue;
            }
            for (k, part) in part.split("**").enumerate() {
                is_strong ^= k > 0;
                for (k, words) in part.split("{}").enumerate() {
                    if k > 0 {
                        text.add(is_strong, values.next().unwrap_or_default());
                    }
                    text.add(is_strong, Text::with_symbols(words));
                }
            }
        }
        text
    }

    fn add(&mut self, is_strong: bool, more: Text) {
        let more = if is_strong { Text::strong(more) } else { more };
        self.0.extend(more.0);
    }

    fn with_symbols(words: &str) -> Self {
        let mut parts = words.split("Γ_");
        let first = parts.next().unwrap_or_default().to_owned();
        let rest = parts.flat_map(|part| match part.chars().next() {
            Some(letter) => {
                let rest = part[letter.len_utf8()..].to_owned();
                [Piece::Boundary(letter), Piece::Words(rest)]
            }
            None => ["Γ_", ""].map(|words| Piece::Words(words.to_owned())),
        });
        Text::of([Piece::Words(first)].into_iter().chain(rest))
    }

    /// For people, where there is no markup: in an attribute.
    pub fn told(&self) -> String {
        let of = |span: &Span| match &span.piece {
            Piece::Number(number) => number.told(),
            _ => Text(vec![span.clone()]).to_string(),
        };
        self.0.iter().map(of).collect()
    }

    /// With more text appended.
    pub fn and(mut self, more: impl Into<Text>) -> Self {
        self.0.extend(more.into().0);
        self
    }

    /// All of them with something between.
    pub fn joined(all: impl IntoIterator<Item = impl Into<Text>>, between: &str) -> Self {
        let mut text = Text::default();
        for (k, more) in all.into_iter().enumerate() {
            if k > 0 {
                text = text.and(between);
            }
            text = text.and(more);
        }
        text
    }

    /// As a sentence begins; a name in it stays as it is.
    pub fn capitalised(mut self) -> Self {
        if let Some(Span {
            piece: Piece::Words(words),
            ..
        }) = self.0.first_mut()
        {
            let mut letters = words.chars();
            let is_word = words
                .split(' ')
                .next()
                .is_some_and(|w| w.chars().all(|c| c.is_ascii_lowercase()));
            if let Some(first) = letters.next().filter(|_| is_word) {
                *words = first.to_uppercase().chain(letters).collect();
            }
        }
        self
    }
}

/// Plain text, without marks for emphasis; code is between backticks.
impl Display for Text {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        for Span { piece, .. } in &self.0 {
            match piece {
                Piece::Words(words) | Piece::Link(_, words) => f.write_str(words)?,
                Piece::Code(words) => write!(f, "`{words}`")?,
                Piece::Boundary(letter) => write!(f, "Γ_{letter}")?,
                Piece::Number(number) => write!(f, "{number}")?,
            }
        }
        Ok(())
    }
}

impl Serialize for Text {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// A text that was kept as a string, without its numbers.
impl<'de> Deserialize<'de> for Text {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer).map(|words| Text::message(&words))
    }
}

/// The parts of sentences.
macro_rules! text_from {
    ($($of:ty: $value:ident => $pieces:expr;)*) => {
        $(impl From<$of> for Text {
            fn from($value: $of) -> Self {
                Text::of($pieces)
            }
        })*
    };
}

text_from! {
    String: words => [Piece::Words(words)];
    &String: words => [Piece::Words(words.clone())];
    &str: words => [Piece::Words(words.to_owned())];
    &&str: words => [Piece::Words((*words).to_owned())];
    &&&str: words => [Piece::Words((**words).to_owned())];
    &&String: words => [Piece::Words((*words).clone())];
    usize: count => [Piece::Words(count.to_string())];
    &usize: count => [Piece::Words(count.to_string())];
    u32: count => [Piece::Words(count.to_string())];
    &u32: count => [Piece::Words(count.to_string())];
    Number: number => [Piece::Number(number)];
    &Number: number => [Piece::Number(*number)];
}

impl From<&Text> for Text {
    fn from(text: &Text) -> Self {
        text.clone()
    }
}

impl From<&&Text> for Text {
    fn from(text: &&Text) -> Self {
        (*text).clone()
    }
}

impl<T: Clone + Into<Text>> From<&Option<T>> for Text {
    fn from(value: &Option<T>) -> Self {
        value.clone().into()
    }
}

impl<T: Into<Text>> From<Option<T>> for Text {
    fn from(value: Option<T>) -> Self {
        value.map_or_else(Text::default, Into::into)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use number::THIN;

    #[test]
    fn what_is_put_into_a_template_is_taken_as_it_is() {
        let evil = "a `b` **c** Γ_C {} 1e-7";
        let of = text!("**{} of {}** on Γ_C: `{}`, {}", 1_usize, evil, evil, evil);
        assert_eq!(
            of.to_string(),
            format!("1 of {evil} on Γ_C: `{evil}`, {evil}")
        );
        let strong: String = of
            .spans()
            .iter()
            .filter(|span| span.is_strong)
            .map(|span| match &span.piece {
                Piece::Words(words) => &**words,
                other => panic!("{other:?}"),
            })
            .collect();
        assert_eq!(strong, format!("1 of {evil}"));
        let boundaries = of.spans().iter();
        let is_boundary = |span: &&Span| span.piece == Piece::Boundary('C');
        assert_eq!(boundaries.filter(is_boundary).count(), 1);
    }

    #[test]
    fn names_in_a_template_are_those_where_it_stands() {
        struct Of {
            name: String,
            size: Number,
        }
        let (what, of) = (Some("{} `and` **"), [("", 3_usize)]);
        let it = Of {
            name: "a `b` **{what}**".into(),
            size: Number::new(2.5, 2),
        };
        let told = text!(
            "`{it.name}`: **{what}** {}{} of {it.size}, { x }",
            of[0].1,
            "{}"
        );
        assert_eq!(
            told.to_string(),
            "`a `b` **{what}**`: {} `and` ** 3{} of 2.5e0, { x }"
        );
        let strong = told.spans().iter().filter(|span| span.is_strong);
        assert_eq!(strong.count(), 1);
    }

    #[test]
    fn numbers_are_those_of_programs_and_those_of_people() {
        for (of, plain, told) in [
            (Number::new(2.53e-7, 2), "2.5e-7", "2.5 · 10⁻⁷"),
            (Number::new(0.21, 2), "2.1e-1", "0.21"),
            (Number::power(1e-12), "1e-12", "10⁻¹²"),
            (
                Number::power(1.864_775_194_431_245),
                "1.864775194431245e0",
                "1.865",
            ),
            (Number::fixed(0.0, 4), "0.0000", "0"),
            (Number::fixed(-0.25, 4), "-0.2500", "−0.2500"),
            (
                Number::fixed(1.000_000_001, 11),
                "1.00000000100",
                "1.00000000100",
            ),
            (
                Number::exact(0.125_456_789_012_5),
                "0.1254567890125",
                "0.125457",
            ),
            (Number::exact(100.5), "100.5", "100.5"),
        ] {
            assert_eq!(of.to_string(), plain);
            assert_eq!(of.told().replace(THIN, " "), told);
        }
    }

    #[test]
    fn a_message_shows_what_one_would_type() {
        let told = Text::message("there is no scene `a**b**`; see `faceoff scenes`");
        assert_eq!(
            told.to_string(),
            "there is no scene `a**b**`; see `faceoff scenes`"
        );
        assert_eq!(told.spans().len(), 4);
        for words in ["one ` alone", "at the end Γ_", "`a` on Γ_C", ""] {
            assert_eq!(Text::message(words).to_string(), words);
        }
        assert_eq!(text!("at `{}`", Number::power(1e-8)).told(), "at `1e-8`");
        assert_eq!(text!("at {}", Number::power(1e-8)).told(), "at 10⁻⁸");
        assert_eq!(text!("the two").capitalised().to_string(), "The two");
    }
}
