//! What a command has to say, said once: the page, the terminal, JSON, JUnit and annotations are made from it.

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
    /// `verify`, `mesh check`: as it is typed.
    pub command: &'static str,
    /// The question that it answers.
    pub title: String,
    /// Where something is judged: the verdict, and the word for it.
    pub verdict: Option<(Verdict, &'static str)>,
    /// The answer in one sentence; where it is empty, the verdict, and the claim where that is no pass or nothing is judged.
    pub headline: Text,
    /// The answer, and all that it rests on.
    pub story: Story<'a>,
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

/// What is told, top down: each part says more than the one before. A terminal has room for the rest, and then the headline.
#[derive(Default)]
pub struct Story<'a> {
    /// The answer as the page says it, without place and digits. Where it is empty, the headline.
    pub claim: Text,
    /// What the claim rests on, in three lines.
    pub rests_on: Text,
    /// What shows it, beside what to do next.
    pub picture: Vec<Block<'a>>,
    /// Suggestions, the best first.
    pub next: Vec<Todo>,
    /// What was found, top down.
    pub rest: Vec<Block<'a>>,
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
    /// The same under a heading of the page.
    Titled(Text, Table),
    /// A picture with its caption.
    Figure(Figure<'a>),
    /// Folded on the page until it is asked for: by a name, and what less is said of it.
    Folded([Text; 2], Vec<Block<'a>>),
    /// Side by side on the page, each over so many of twelve columns.
    Beside(Vec<(&'static str, Vec<Block<'a>>)>),
    /// What the terminal has no room for.
    Page(Vec<Block<'a>>),
    /// What the page says in another way.
    Terminal(Vec<Block<'a>>),
    /// A part of a page that is drawn when there is one.
    Drawn(Box<dyn Fn() -> Result<Html> + 'a>),
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
        plain(&self.name, '-') + ".svg"
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
    /// Of one case: does something do what it should?
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

    /// A part of the page, which nothing keeps from being drawn.
    pub fn drawn(draw: impl Fn() -> Html + 'a) -> Self {
        Block::Drawn(Box::new(move || Ok(draw())))
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

/// As part of a file's name, with this for what would lead elsewhere.
pub fn plain(name: &str, instead: char) -> String {
    let kept = |c: char| c.is_alphanumeric() || matches!(c, '.' | '-' | '_');
    let of = |c| if kept(c) { c } else { instead };
    name.chars().map(of).collect()
}

/// Each sentence once, with all places where it is said; with none where those are all that there are.
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
