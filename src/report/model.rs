//! What a command has to say, said once: the page, the terminal, JSON, JUnit and annotations are made from it.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::html::{Html, Picture};
use super::json::document;
use super::number::{number, whole};
use super::outward::{Digits, above, below};
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
    pub headline: String,
    /// The same as the page says it, without place and digits; **…** encloses what it is about. Where it is empty, the
    /// headline.
    pub claim: String,
    /// What the answer rests on, in three lines.
    pub lede: String,
    /// What shows it, beside what to do next.
    pub lead: Vec<Block<'a>>,
    /// Suggestions, the best first.
    pub next: Vec<Todo>,
    /// What was found, top down.
    pub blocks: Vec<Block<'a>>,
    /// By which methods, and what numbers mean: the foot of the page.
    pub notes: Vec<String>,
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
    pub words: String,
    /// Each as one would type it.
    pub commands: Vec<String>,
}

/// Writes into a folder.
pub type Write<'a> = Box<dyn Fn(&Path) -> Result<()> + 'a>;

/// A part of a report. In texts, `…` encloses what one would type, and **…** what stands out on a page.
pub enum Block<'a> {
    /// From 2, the largest.
    Heading(u8, String),
    /// A paragraph.
    Text(String),
    /// An item each.
    List(Vec<String>),
    /// What one would type.
    Commands(Vec<String>),
    /// Names and what they are.
    Facts(Vec<(String, String)>),
    /// Words and numbers in columns.
    Table(Table),
    /// A picture with its caption.
    Figure(Figure<'a>),
    /// Folded on the page until it is asked for.
    Folded(String, Vec<Block<'a>>),
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
    pub caption: String,
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

/// Rows of cells; a column of numbers is aligned as such.
#[derive(Default, Clone)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// A name for each column.
    pub head: Vec<String>,
    /// As many cells each as `head`.
    pub rows: Vec<Vec<Cell>>,
}

/// What a table holds in one place.
#[derive(Clone)]
pub enum Cell {
    /// Words.
    Text(String),
    /// The value by which it sorts, and the digits that are shown.
    Number(f64, String),
    /// A verdict alone.
    Verdict(Verdict),
    /// A verdict and the number that it is about.
    Judged(Verdict, f64),
    /// A text that leads to a place of the page.
    Link(String, String),
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
        headline: impl Into<String>,
        result: &impl Serialize,
    ) -> Result<Self> {
        Ok(Report {
            command,
            title: title.to_owned(),
            verdict: None,
            headline: headline.into(),
            claim: String::new(),
            lede: String::new(),
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

impl Table {
    /// Without rows; `table!` makes one with them.
    pub fn new<S: ToString>(caption: impl Into<String>, head: &[S]) -> Self {
        Table {
            caption: caption.into(),
            head: head.iter().map(S::to_string).collect(),
            rows: Vec::new(),
        }
    }

    /// With all of these rows.
    pub fn with(mut self, rows: impl IntoIterator<Item = Vec<Cell>>) -> Self {
        self.rows.extend(rows);
        self
    }

    /// Does a column hold numbers, but for some words?
    pub fn is_numeric(&self, column: usize) -> bool {
        let cells = self.rows.iter().filter_map(|row| row.get(column));
        let (mut numbers, mut words) = (0, 0);
        for cell in cells {
            match cell {
                Cell::Number(..) => numbers += 1,
                Cell::Text(text) if text.is_empty() => {}
                _ => words += 1,
            }
        }
        numbers > words
    }
}

impl Todo {
    /// What to do, and the commands that do it.
    pub fn new<S: Into<String>>(
        words: impl Into<String>,
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
    /// Names and what they are.
    pub fn facts<N: Into<String>>(facts: impl IntoIterator<Item = (N, String)>) -> Self {
        let facts = facts.into_iter();
        Block::Facts(facts.map(|(name, fact)| (name.into(), fact)).collect())
    }
}

impl From<Table> for Block<'_> {
    fn from(table: Table) -> Self {
        Block::Table(table)
    }
}

/// A row from values of any kind.
macro_rules! cells {
    ($($value:expr),* $(,)?) => { vec![$($crate::report::model::Cell::from($value)),*] };
}
/// A table with a line a column: its name, and the cell of a row.
macro_rules! table {
    ($caption:expr, $rows:expr, |$row:pat_param| $($name:expr => $value:expr),* $(,)?) => {{
        let rows = $rows.into_iter().map(|$row| $crate::report::model::cells![$($value),*]);
        $crate::report::model::Table::new($caption, &[$($name),*]).with(rows)
    }};
}
pub(crate) use {cells, table};

impl Cell {
    /// With so many digits after the point.
    pub fn fixed(value: f64, digits: usize) -> Self {
        match value {
            v if !v.is_finite() => "–".into(),
            0.0 => Cell::Number(0.0, format!("{:.digits$}", 0.0)),
            v => Cell::Number(v, format!("{v:.digits$}")),
        }
    }

    /// A bound from above, with three digits, none of which is below it.
    pub fn at_most(bound: f64) -> Self {
        Cell::Number(bound, short(above(bound, Digits::Counting(3))))
    }

    /// A bound from below, with three digits, none of which is above it.
    pub fn at_least(bound: f64) -> Self {
        Cell::Number(bound, short(below(bound, Digits::Counting(3))))
    }

    /// What the terminal shows.
    pub fn text(&self) -> String {
        match self {
            Cell::Text(text) | Cell::Number(_, text) | Cell::Link(_, text) => text.clone(),
            Cell::Verdict(verdict) => word(*verdict).to_owned(),
            Cell::Judged(verdict, number) => format!("{} {}", word(*verdict), short(*number)),
        }
    }
}

/// What a cell is made of.
macro_rules! cell_from {
    ($($of:ty: $value:ident => $cell:expr;)*) => {
        $(impl From<$of> for Cell {
            fn from($value: $of) -> Self {
                $cell
            }
        })*
    };
}

cell_from! {
    // Three digits.
    f64: value => Cell::Number(value, short(value));
    usize: value => Cell::Number(value as f64, whole(value));
    String: text => Cell::Text(text);
    &String: text => Cell::Text(text.clone());
    &str: text => Cell::Text(text.to_owned());
    Verdict: verdict => Cell::Verdict(verdict);
}

/// Nothing is an empty cell.
impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Cell::Text(String::new()), Into::into)
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
    Cell::Number(seconds, crate::campaigns::study::duration(seconds))
}

/// The word for a verdict.
pub fn word(verdict: Verdict) -> &'static str {
    verdict.word()
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
        assert_eq!(Cell::fixed(-0.0, 2).text(), "0.00");
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

    #[test]
    fn columns_of_numbers_are_known_by_what_they_hold() {
        let rows = [cells!["a", 1.0, ""], cells!["b", None::<f64>, ""]];
        let table = Table::new("", &["name", "error", "blank"]).with(rows);
        assert_eq!([0, 1, 2].map(|k| table.is_numeric(k)), [false, true, false]);
    }
}
