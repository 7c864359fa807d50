//! Tables: made once, for the page and for the terminal.

use super::html::{Dot, DotAxis, Html};
use super::model::{short, word};
use crate::text::number::{size, whole};
use crate::text::{Text, at_least, at_most};
use faceoff_judge::Verdict;

/// Rows of cells; a column of numbers is aligned as numbers.
#[derive(Default, Clone)]
pub struct Table {
    /// The title.
    pub caption: Text,
    /// One per cell of a row.
    pub head: Vec<Column>,
    /// Each with as many cells as `head`.
    pub rows: Vec<Vec<Cell>>,
    /// Which rows are emphasised on the page; if it is empty, those with a verdict that does not pass.
    pub set_off: Vec<bool>,
}

/// The name of a column, and its style on the page.
#[derive(Default, Clone)]
pub struct Column {
    /// The text above the column.
    pub name: Text,
    /// On the page: `n` is a number, `w` does not wrap, `opt` is hidden on a narrow page, `d` has dots on an axis, `page` is for
    /// pages only. Without a style, `n` if the column holds numbers.
    pub class: Option<&'static str>,
    /// Additional content after the name on the page.
    pub more: Html,
}

/// The contents of a cell: a verdict, text or a number, and parts that only the page shows.
#[derive(Default, Clone)]
pub struct Cell {
    /// Before the text.
    pub verdict: Option<Verdict>,
    /// The text.
    pub shown: Text,
    /// The key for sorting.
    pub value: Option<f64>,
    /// Is it marked as wrong, other than by its verdict?
    pub is_bad: bool,
    /// After the text.
    pub more: Html,
}

impl Table {
    /// Without rows; `table!` makes one with them.
    pub fn new<C: Into<Column>>(
        caption: impl Into<Text>,
        head: impl IntoIterator<Item = C>,
    ) -> Self {
        Table {
            caption: caption.into(),
            head: head.into_iter().map(Into::into).collect(),
            ..Table::default()
        }
    }

    /// With all of these rows.
    pub fn with(mut self, rows: impl IntoIterator<Item = Vec<Cell>>) -> Self {
        self.rows.extend(rows);
        self
    }

    /// With these rows emphasised on the page.
    pub fn setting_off(mut self, rows: impl Iterator<Item = bool>) -> Self {
        self.set_off = rows.collect();
        self
    }

    /// Without columns that are empty.
    pub fn known(mut self) -> Self {
        let is_told =
            |cell: &Cell| cell.verdict.is_some() || !cell.shown.is_empty() || !cell.more.is_empty();
        let of = |k: usize| self.rows.iter().any(|row| is_told(&row[k]));
        let kept: Vec<bool> = (0..self.head.len()).map(of).collect();
        let mut keep = kept.iter();
        self.head.retain(|_| keep.next() == Some(&true));
        for row in &mut self.rows {
            let mut keep = kept.iter();
            row.retain(|_| keep.next() == Some(&true));
        }
        self
    }

    /// Is a column shown on a terminal?
    pub fn fits_terminal(&self, column: usize) -> bool {
        let classes = self.head[column].class.unwrap_or_default();
        !classes
            .split(' ')
            .any(|class| matches!(class, "d" | "page"))
    }

    /// Does a column hold numbers, except for some texts?
    pub fn is_numeric(&self, column: usize) -> bool {
        let cells = self.rows.iter().filter_map(|row| row.get(column));
        let (mut numbers, mut words) = (0, 0);
        for cell in cells {
            match cell.value {
                Some(_) if cell.verdict.is_none() => numbers += 1,
                None if cell.shown.is_empty() && cell.verdict.is_none() => {}
                _ => words += 1,
            }
        }
        numbers > words
    }
}

impl Column {
    /// With dots on an axis.
    pub(super) fn of_dots(name: impl Into<Text>, axis: &DotAxis) -> Self {
        Column {
            name: name.into(),
            class: Some("d"),
            more: axis.head(),
        }
    }
}

impl<T: Into<Text>> From<T> for Column {
    fn from(name: T) -> Self {
        Column {
            name: name.into(),
            ..Column::default()
        }
    }
}

/// A class and a name.
impl<T: Into<Text>> From<(&'static str, T)> for Column {
    fn from((class, name): (&'static str, T)) -> Self {
        Column {
            name: name.into(),
            class: Some(class),
            ..Column::default()
        }
    }
}

/// A row from values of any kind.
macro_rules! cells {
    ($($value:expr),* $(,)?) => { vec![$($crate::report::model::Cell::from($value)),*] };
}
/// A table with one line per column: its name, and the cell of a row.
macro_rules! table {
    ($caption:expr, $rows:expr, |$row:pat_param| $($name:expr => $value:expr),* $(,)?) => {{
        let rows = $rows.into_iter().map(|$row| $crate::report::model::cells![$($value),*]);
        let head: Vec<$crate::report::model::Column> = vec![$($name.into()),*];
        $crate::report::model::Table::new($caption, head).with(rows)
    }};
}
pub(crate) use {cells, table};

impl Cell {
    /// A value with its digits.
    pub fn number(value: f64, shown: impl Into<Text>) -> Self {
        Cell {
            value: Some(value),
            shown: shown.into(),
            ..Cell::default()
        }
    }

    /// With two digits: for differences, residuals and tolerances.
    pub fn size(value: f64) -> Self {
        Cell::number(value, size(value))
    }

    /// With a given number of digits after the point.
    pub fn fixed(value: f64, digits: usize) -> Self {
        match value {
            v if !v.is_finite() => "–".into(),
            0.0 => Cell::number(0.0, format!("{:.digits$}", 0.0)),
            v => Cell::number(v, format!("{v:.digits$}")),
        }
    }

    /// A bound from above, with three digits, none of which is below it.
    pub fn at_most(bound: f64) -> Self {
        Cell::number(bound, at_most(bound, 3))
    }

    /// A bound from below, with three digits, none of which is above it.
    pub fn at_least(bound: f64) -> Self {
        Cell::number(bound, at_least(bound, 3))
    }

    /// A verdict with its number.
    pub fn judged(verdict: Verdict, value: f64) -> Self {
        Cell {
            verdict: Some(verdict),
            ..Cell::number(value, format!(" {}", short(value)))
        }
    }

    /// A verdict with its evidence.
    pub fn because(verdict: Verdict, why: Option<&str>) -> Self {
        Cell {
            verdict: Some(verdict),
            shown: why.map_or_else(Text::default, |why| Text::message(&format!(": {why}"))),
            ..Cell::default()
        }
    }

    /// Dots on an axis, and the number for sorting.
    pub(super) fn dots(axis: &DotAxis, dots: &[Dot], value: f64) -> Self {
        Cell {
            more: axis.strip(dots),
            ..Cell::number(value, "")
        }
    }

    /// The same, marked as wrong.
    pub fn bad_if(mut self, is_bad: bool) -> Self {
        self.is_bad = is_bad;
        self
    }

    /// The text on a terminal.
    pub fn text(&self) -> String {
        let verdict = self.verdict.map(word).unwrap_or_default();
        format!("{verdict}{}", self.shown)
    }
}

/// Three digits.
impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Cell::number(value, short(value))
    }
}

impl From<usize> for Cell {
    fn from(value: usize) -> Self {
        Cell::number(value as f64, whole(value))
    }
}

impl From<Verdict> for Cell {
    fn from(verdict: Verdict) -> Self {
        Cell::because(verdict, None)
    }
}

/// Conversions of texts to cells.
macro_rules! cell_from {
    ($($of:ty),*) => {
        $(impl From<$of> for Cell {
            fn from(words: $of) -> Self {
                Cell { shown: words.into(), ..Cell::default() }
            }
        })*
    };
}
cell_from!(Text, &Text, String, &String, &str, &&str);

/// `None` is an empty cell.
impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or_else(Cell::default, Into::into)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_numbers_are_known_by_what_they_hold() {
        let rows = [cells!["a", 1.0, ""], cells!["b", None::<f64>, ""]];
        let table = Table::new("", ["name", "error", "blank"]).with(rows);
        assert_eq!([0, 1, 2].map(|k| table.is_numeric(k)), [false, true, false]);
        let known = table.known();
        assert_eq!((known.head.len(), known.rows[1].len()), (2, 2));
        assert_eq!(Cell::fixed(-0.0, 2).text(), "0.00");
        assert_eq!(Cell::judged(Verdict::Agree, 1e-3).text(), "agree 0.00100");
    }

    #[test]
    fn a_column_of_dots_is_known_and_no_terminal_has_room_for_it() {
        let axis = DotAxis::new([1e-9].into_iter(), vec![1e-12]);
        let dot = Dot {
            value: 1e-9,
            class: "",
            title: String::new(),
        };
        let of = table!("", [dot], |dot|
            "name" => "u",
            Column::of_dots("difference", &axis) => Cell::dots(&axis, &[dot], 1e-9),
            ("n page", "values") => 3_usize,
            "remark" => "",
        );
        let of = of.known();
        let names = of.head.iter().map(|column| column.name.to_string());
        assert_eq!(names.collect::<Vec<_>>(), ["name", "difference", "values"]);
        assert_eq!([0, 1, 2].map(|k| of.fits_terminal(k)), [true, false, false]);
    }
}
