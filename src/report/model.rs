//! What a command has to say, said once: the page, the terminal, JSON, JUnit and annotations are made from it.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::html::{Html, Picture};
use super::json::document;
pub use super::table::{Cell, Column, Table};
pub(crate) use super::table::{cells, table};
use crate::text::Text;
use crate::text::number::number;
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;

/// The result of one command.
pub struct Report<'a> {
    /// `verify`, `mesh check`: as it is typed.
    pub command: &'static str,
    /// The question that it answers.
    pub title: String,
    /// Where something is judged: the verdict, and the word for it.
    pub verdict: Option<(Verdict, &'static str)>,
    /// The answer in one sentence, or in the verdict's word.
    pub headline: Text,
    /// The same as the page says it, without place and digits. Where it is empty, the headline.
    pub claim: Text,
    /// What the answer rests on, in three lines.
    pub lede: Text,
    /// What shows it, beside what to do next.
    pub lead: Vec<Block<'a>>,
    /// Suggestions, the best first.
    pub next: Vec<Todo>,
    /// What was found, top down.
    pub blocks: Vec<Block<'a>>,
    /// By which methods, and what numbers mean: the foot of the page.
    pub notes: Vec<Text>,
    /// Engines and their versions.
    pub engines: Vec<(String, String)>,
    /// Digests of meshes, by name.
    pub digests: Vec<(String, String)>,
    /// Files that were read, of which the page has the digests.
    pub inputs: Vec<PathBuf>,
    /// What was judged, one by one.
    pub suites: Vec<Suite>,
    /// Data that go into the folder of the report.
    pub files: Vec<Write<'a>>,
    /// The whole as JSON.
    pub json: String,
}

/// What to do next, and what one would type to do it.
pub struct Todo {
    /// What to do, as a sentence.
    pub words: Text,
    /// Each as one would type it.
    pub commands: Vec<String>,
}

/// Writes into a folder.
pub type Write<'a> = Box<dyn Fn(&Path) -> Result<()> + 'a>;

/// A part of a report.
pub enum Block<'a> {
    /// From 2, the largest.
    Heading(u8, Text),
    /// A paragraph.
    Text(Text),
    /// An item each.
    List(Vec<Text>),
    /// What one would type.
    Commands(Vec<String>),
    /// Names and what they are.
    Facts(Vec<(Text, Text)>),
    /// Words and numbers in columns.
    Table(Table),
    /// A picture with its caption.
    Figure(Figure<'a>),
    /// Folded on the page until it is asked for: by a name, and what less is said of it.
    Folded([Text; 2], Vec<Block<'a>>),
    /// What the terminal has no room for.
    Page(Vec<Block<'a>>),
    /// What the page says in another way.
    Terminal(Vec<Block<'a>>),
    /// A part of a page that is made when there is one.
    Html(Box<dyn Fn() -> Result<Html> + 'a>),
}

/// A picture: in the page, and as NAME.svg beside it.
pub struct Figure<'a> {
    /// Of its file, without suffix.
    pub name: String,
    /// What it shows.
    pub caption: Text,
    /// What draws it for a page of a width.
    pub picture: Box<dyn Fn(f64) -> Picture + 'a>,
}

impl Figure<'_> {
    /// The name of its file, without what would lead out of the folder.
    pub fn file(&self) -> String {
        let kept = |c: char| c.is_alphanumeric() || matches!(c, '.' | '-' | '_');
        let of = |c| if kept(c) { c } else { '-' };
        self.name.chars().map(of).collect::<String>() + ".svg"
    }
}

/// What was judged together.
pub struct Suite {
    /// As JUnit has it.
    pub name: String,
    /// Name and value.
    pub properties: Vec<(&'static str, String)>,
    /// In the order of the report.
    pub cases: Vec<TestCase>,
}

/// One thing that was judged.
pub struct TestCase {
    /// By which servers group: the case or the files.
    pub class: String,
    /// Unique in its class.
    pub name: String,
    /// How an annotation calls what is wrong, where that is not suite and name.
    pub title: Option<String>,
    /// That it took; 0 where it was not timed.
    pub seconds: f64,
    /// A pass, a failure or an error of JUnit.
    pub verdict: Verdict,
    /// Why it is no pass.
    pub message: String,
}

impl<'a> Report<'a> {
    /// A report without anything but its JSON.
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
            claim: Text::default(),
            lede: Text::default(),
            lead: Vec::new(),
            next: Vec::new(),
            blocks: Vec::new(),
            notes: Vec::new(),
            engines: Vec::new(),
            digests: Vec::new(),
            inputs: Vec::new(),
            suites: Vec::new(),
            files: Vec::new(),
            json: document(command, result)?,
        })
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
        collect(&self.lead, &mut found);
        collect(&self.blocks, &mut found);
        found
    }
}

impl Todo {
    /// What to do without a command.
    pub fn only(words: impl Into<Text>) -> Self {
        Todo::new(words, None::<String>)
    }

    /// What to do, and the commands that do it.
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
    /// What took no time of its own, and which annotations call by suite and name.
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
    /// Without properties.
    pub fn new(name: impl Into<String>, cases: impl IntoIterator<Item = TestCase>) -> Self {
        Suite {
            name: name.into(),
            properties: Vec::new(),
            cases: cases.into_iter().collect(),
        }
    }
}

impl Block<'_> {
    /// A paragraph.
    pub fn text(words: impl Into<Text>) -> Self {
        Block::Text(words.into())
    }

    /// A heading; of level 2 the largest.
    pub fn heading(level: u8, words: impl Into<Text>) -> Self {
        Block::Heading(level, words.into())
    }

    /// An item each.
    pub fn list(items: impl IntoIterator<Item = impl Into<Text>>) -> Self {
        Block::List(items.into_iter().map(Into::into).collect())
    }

    /// Folded on the page, by a name and what less is said of it.
    pub fn folded(name: impl Into<Text>, about: impl Into<Text>, inner: Vec<Self>) -> Self {
        Block::Folded([name.into(), about.into()], inner)
    }

    /// Names and what they are.
    pub fn facts<N: Into<Text>, F: Into<Text>>(facts: impl IntoIterator<Item = (N, F)>) -> Self {
        let facts = facts.into_iter();
        let facts = facts.map(|(name, fact)| (name.into(), fact.into()));
        Block::Facts(facts.collect())
    }
}

impl From<Table> for Block<'_> {
    fn from(table: Table) -> Self {
        Block::Table(table)
    }
}

/// Three digits: `0.123`, `1.23 · 10⁻⁴`; 0 is `0`, and what is not finite a dash.
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

/// Words with something between them.
pub fn joined(words: impl IntoIterator<Item = String>, between: &str) -> String {
    words.into_iter().collect::<Vec<_>>().join(between)
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
