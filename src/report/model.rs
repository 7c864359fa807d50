//! The report of a command, stated once: the page, the terminal, JSON, JUnit and annotations are made from it.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::html::{Html, Picture};
use super::json::document;
pub use super::table::{Cell, Column, Table};
pub(crate) use super::table::{cells, table};
use crate::text::number::number;
use crate::text::{Text, text};
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;

/// The result of one command.
pub struct Report<'a> {
    /// `verify`, `mesh check`: the command as it is typed.
    pub command: &'static str,
    /// The question that it answers.
    pub title: String,
    /// If something is judged: the verdict, and the word for it.
    pub verdict: Option<(Verdict, &'static str)>,
    /// The answer in one sentence. If it is empty, the verdict is used, and the claim if the verdict does not pass or nothing is judged.
    pub headline: Text,
    /// The answer, with its evidence.
    pub story: Story<'a>,
    /// The methods, and the meaning of numbers: the foot of the page.
    pub notes: Vec<Text>,
    /// Engines and their versions.
    pub engines: Vec<(String, String)>,
    /// Digests of meshes, by name.
    pub digests: Vec<(String, String)>,
    /// Input files, whose digests are on the page.
    pub inputs: Vec<PathBuf>,
    /// The judged cases.
    pub suites: Vec<Suite>,
    /// Data for the folder of the report.
    pub files: Vec<Write<'a>>,
    /// The whole result as JSON.
    pub json: String,
}

/// The text, top down: each part has more detail than the one before. A terminal shows the rest, and then the headline.
#[derive(Default)]
pub struct Story<'a> {
    /// The answer on the page, without position and digits. If it is empty, the headline.
    pub claim: Text,
    /// The evidence for the claim, in three lines.
    pub rests_on: Text,
    /// The picture, next to the suggestions.
    pub picture: Vec<Block<'a>>,
    /// Suggestions, the best first.
    pub next: Vec<Todo>,
    /// The findings, top down.
    pub rest: Vec<Block<'a>>,
}

/// A suggestion, with the commands to type.
pub struct Todo {
    /// The suggestion as a sentence.
    pub words: Text,
    /// The commands.
    pub commands: Vec<String>,
}

/// Writes into a folder.
pub type Write<'a> = Box<dyn Fn(&Path) -> Result<()> + 'a>;

/// A part of a report.
pub enum Block<'a> {
    /// A heading; the largest has level 2.
    Heading(u8, Text),
    /// A paragraph.
    Text(Text),
    /// A list.
    List(Vec<Text>),
    /// Commands to type.
    Commands(Vec<String>),
    /// Names with their descriptions.
    Facts(Vec<(Text, Text)>),
    /// A table.
    Table(Table),
    /// The same under a heading of the page.
    Titled(Text, Table),
    /// A picture with its caption.
    Figure(Figure<'a>),
    /// Folded on the page until it is opened: with a name, and a short form of its contents.
    Folded([Text; 2], Vec<Block<'a>>),
    /// Side by side on the page, each with its number of twelve columns.
    Beside(Vec<(&'static str, Vec<Block<'a>>)>),
    /// Only for the page.
    Page(Vec<Block<'a>>),
    /// Only for the terminal.
    Terminal(Vec<Block<'a>>),
    /// A part of a page that is drawn when the page is made.
    Drawn(Box<dyn Fn() -> Result<Html> + 'a>),
}

/// A picture: in the page, and as NAME.svg in its folder.
pub struct Figure<'a> {
    /// The name of its file, without suffix.
    pub name: String,
    /// The caption.
    pub caption: Text,
    /// Draws it for a page of a given width.
    pub picture: Box<dyn Fn(f64) -> Picture + 'a>,
}

impl Figure<'_> {
    /// The name of its file, without parts that would leave the folder.
    pub fn file(&self) -> String {
        plain(&self.name, '-') + ".svg"
    }
}

/// Cases that were judged together.
pub struct Suite {
    /// The name in JUnit.
    pub name: String,
    /// Name and value.
    pub properties: Vec<(&'static str, String)>,
    /// In the order of the report.
    pub cases: Vec<TestCase>,
}

/// One thing that was judged.
pub struct TestCase {
    /// The key by which servers group: the case or the files.
    pub class: String,
    /// Unique in its class.
    pub name: String,
    /// The title of an annotation, if it is not suite and name.
    pub title: Option<String>,
    /// The time in seconds; 0 if it was not measured.
    pub seconds: f64,
    /// Passed, failed or error in JUnit.
    pub verdict: Verdict,
    /// Why it does not pass.
    pub message: String,
}

impl<'a> Report<'a> {
    /// A report that only has JSON.
    ///
    /// # Errors
    /// A result that JSON cannot hold.
    pub fn new(
        command: &'static str,
        title: &str,
        headline: impl Into<Text>,
        result: &impl Serialize,
    ) -> Result<Self> {
        Ok(Report {
            command,
            title: title.to_owned(),
            verdict: None,
            headline: headline.into(),
            story: Story::default(),
            notes: Vec::new(),
            engines: Vec::new(),
            digests: Vec::new(),
            inputs: Vec::new(),
            suites: Vec::new(),
            files: Vec::new(),
            json: document(command, result)?,
        })
    }

    /// The report of something that is judged.
    ///
    /// # Errors
    /// A result that JSON cannot hold.
    pub fn judging(
        command: &'static str,
        title: &str,
        verdict: Verdict,
        result: &impl Serialize,
    ) -> Result<Self> {
        let mut report = Report::new(command, title, "", result)?;
        report.verdict = Some((verdict, verdict.word()));
        Ok(report)
    }

    /// The answer in one sentence.
    pub fn headline(&self) -> Text {
        match self.verdict {
            _ if !self.headline.is_empty() => self.headline.clone(),
            Some((verdict, word)) if verdict.passes() => word.into(),
            Some((_, word)) => text!("{word}: {self.story.claim}"),
            None => self.story.claim.clone(),
        }
    }

    /// Adds a text file for the folder.
    pub fn file(&mut self, name: &str, text: impl Fn() -> String + 'a) {
        let name = name.to_owned();
        self.files.push(Box::new(move |folder| {
            super::json::write_text(&folder.join(&name), &text())
        }));
    }

    /// Every figure, in the order of the page.
    pub fn figures(&self) -> Vec<&Figure<'a>> {
        fn collect<'r, 'a>(blocks: &'r [Block<'a>], found: &mut Vec<&'r Figure<'a>>) {
            for block in blocks {
                match block {
                    Block::Figure(figure) => found.push(figure),
                    Block::Folded(_, inner) | Block::Page(inner) => collect(inner, found),
                    _ => {}
                }
            }
        }
        let mut found = Vec::new();
        collect(&self.story.picture, &mut found);
        collect(&self.story.rest, &mut found);
        found
    }
}

impl Todo {
    /// A suggestion without a command.
    pub fn only(words: impl Into<Text>) -> Self {
        Todo::new(words, None::<String>)
    }

    /// A suggestion, and its commands.
    pub fn new<S: Into<String>>(
        words: impl Into<Text>,
        commands: impl IntoIterator<Item = S>,
    ) -> Self {
        Todo {
            words: words.into(),
            commands: commands.into_iter().map(Into::into).collect(),
        }
    }
}

impl TestCase {
    /// A case without a separate time, which annotations name by suite and name.
    pub fn new(class: &str, name: impl Into<String>, verdict: Verdict, message: String) -> Self {
        TestCase {
            class: class.to_owned(),
            name: name.into(),
            title: None,
            seconds: 0.0,
            verdict,
            message,
        }
    }
}

impl Suite {
    /// A single case, with its expectation.
    pub fn of(subject: &str, class: &str, does: [&str; 2], verdict: Verdict, why: String) -> Self {
        let case = TestCase {
            title: Some(format!("{subject} {}", does[1])),
            ..TestCase::new(class, format!("{subject} {}", does[0]), verdict, why)
        };
        Suite::new(subject, [case])
    }

    /// Without properties.
    pub fn new(name: impl Into<String>, cases: impl IntoIterator<Item = TestCase>) -> Self {
        Suite {
            name: name.into(),
            properties: Vec::new(),
            cases: cases.into_iter().collect(),
        }
    }
}

impl<'a> Block<'a> {
    /// A paragraph.
    pub fn text(words: impl Into<Text>) -> Self {
        Block::Text(words.into())
    }

    /// A heading; the largest has level 2.
    pub fn heading(level: u8, words: impl Into<Text>) -> Self {
        Block::Heading(level, words.into())
    }

    /// A list.
    pub fn list(items: impl IntoIterator<Item = impl Into<Text>>) -> Self {
        Block::List(items.into_iter().map(Into::into).collect())
    }

    /// Folded on the page, with a name and a short form.
    pub fn folded(name: impl Into<Text>, about: impl Into<Text>, inner: Vec<Self>) -> Self {
        Block::Folded([name.into(), about.into()], inner)
    }

    /// Names with their descriptions.
    pub fn facts<N: Into<Text>, F: Into<Text>>(facts: impl IntoIterator<Item = (N, F)>) -> Self {
        let facts = facts.into_iter();
        let facts = facts.map(|(name, fact)| (name.into(), fact.into()));
        Block::Facts(facts.collect())
    }

    /// A part of the page whose drawing cannot fail.
    pub fn drawn(draw: impl Fn() -> Html + 'a) -> Self {
        Block::Drawn(Box::new(move || Ok(draw())))
    }
}

impl From<Table> for Block<'_> {
    fn from(table: Table) -> Self {
        Block::Table(table)
    }
}

/// Three digits: `0.123`, `1.23 · 10⁻⁴`; 0 is `0`, and values that are not finite are a dash.
pub fn short(value: f64) -> String {
    number(value, 3)
}

/// All digits.
pub fn exact(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        v if (1e-3..1e6).contains(&v) => value.to_string(),
        _ => format!("{value:e}"),
    }
}

/// `1.23 %`, with three digits.
pub fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    match percent.abs() {
        p if (1e-3..1e3).contains(&p) => {
            let digits = (2.0 - p.log10().floor()).max(0.0) as usize;
            format!("{percent:.digits$} %")
        }
        _ => format!("{} %", short(percent)),
    }
}

/// Three digits, in ms below a second.
pub fn duration(seconds: f64) -> Cell {
    Cell::number(seconds, crate::campaigns::study::duration(seconds))
}

/// The word for a verdict.
pub fn word(verdict: Verdict) -> &'static str {
    verdict.word()
}

/// A message with its full stop.
pub fn sentence(message: &str) -> String {
    format!("{}.", message.trim_end_matches('.'))
}

/// Words with a separator.
pub fn joined(words: impl IntoIterator<Item = String>, between: &str) -> String {
    words.into_iter().collect::<Vec<_>>().join(between)
}

/// As part of a file's name, with a replacement for characters that lead elsewhere.
pub fn plain(name: &str, instead: char) -> String {
    let kept = |c: char| c.is_alphanumeric() || matches!(c, '.' | '-' | '_');
    let of = |c| if kept(c) { c } else { instead };
    name.chars().map(of).collect()
}

/// Each sentence once, with all its places; without places if it applies to all of them.
pub fn each_once(said: impl Iterator<Item = (Text, Text)>, all: usize) -> Vec<Text> {
    let mut known: Vec<(Text, Vec<Text>)> = Vec::new();
    for (sentence, place) in said {
        match known.iter_mut().find(|(known, _)| *known == sentence) {
            Some((_, places)) => places.push(place),
            None => known.push((sentence, vec![place])),
        }
    }
    let told = |(sentence, places): (Text, Vec<Text>)| match places.len() {
        count if count == all => sentence,
        _ => text!("{sentence} ({})", Text::joined(places, "; ")),
    };
    known.into_iter().map(told).collect()
}

/// `1 case`, `2 cases`
pub fn count(number: usize, noun: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{number} {noun}{plural}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits_and_zero_is_zero() {
        assert_eq!(short(0.0), "0");
        assert_eq!(short(-0.0), "0");
        let values = [0.09996, 0.12345, 9.996, 123.4, 999.6];
        let texts = ["0.100", "0.123", "10.0", "123", "1\u{202f}000"];
        assert_eq!(values.map(short), texts);
        assert_eq!([f64::NAN, f64::INFINITY].map(short), ["–", "–"]);
        let shares = [0.0, 1.23456, 0.123456, 1.23456e-4, 1.23456e-6];
        let texts = [
            "0 %",
            "123 %",
            "12.3 %",
            "0.0123 %",
            "1.23\u{202f}·\u{202f}10⁻⁴ %",
        ];
        assert_eq!(shares.map(percent), texts);
    }
}
