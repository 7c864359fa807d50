//! Linear systems of codes in a report: a sentence per pair, and a row per block.

use super::model::{Table, table};
use crate::campaigns::face_off::OfSystems;
use crate::text::number::whole;
use crate::text::{Text, text};

/// What was found of two systems, as a sentence.
pub fn told(of: &OfSystems) -> Text {
    text!(
        "Systems of {of.a} and {of.b}{}: {}.",
        of.level.at(),
        words(of)
    )
}

/// What differs in the first system that does.
pub fn claim(of: &OfSystems) -> Text {
    let found = of.found.as_ref().map(|found| found.sentence.clone());
    text!(
        "**{of.a}** and **{of.b}** solve different equations{}: {}",
        of.level.at(),
        found.unwrap_or_default()
    )
}

/// A sentence per pair.
pub fn pairs(all: &[OfSystems]) -> Table {
    table!("", all, |of|
        "codes" => format!("{} – {}{}", of.a, of.b, of.level.at()),
        "verdict" => of.verdict.word(),
        "found" => words(of),
    )
}

fn words(of: &OfSystems) -> Text {
    let why = of.refused.as_deref().map(Text::message);
    let found = of.found.as_ref().map(|found| found.sentence.clone());
    found.or(why).unwrap_or_default()
}

/// A row of the table.
struct Row<'a> {
    of: &'a OfSystems,
    what: Text,
    rows: usize,
    largest: f64,
    factor: Option<f64>,
}

/// All blocks of the matrices, and the right-hand sides.
pub fn blocks(all: &[OfSystems]) -> Table {
    let mut rows = Vec::new();
    for of in all {
        let Some(found) = &of.found else { continue };
        let found = &found.compared;
        rows.extend(found.matrix.iter().map(|block| Row {
            of,
            what: text!("matrix, `{block.of}` with `{block.with}`"),
            rows: block.differs.rows,
            largest: block.largest,
            factor: block.factor,
        }));
        rows.extend(found.load.iter().map(|load| Row {
            of,
            what: text!("load, `{load.of}`"),
            rows: load.differs.rows,
            largest: load.largest,
            factor: load.factor,
        }));
    }
    table!("Differences of the linear systems by blocks", &rows, |row|
        "codes" => format!("{} – {}{}", row.of.a, row.of.b, row.of.level.at()),
        "of" => row.what.clone(),
        "rows that differ" => whole(row.rows),
        "largest difference" => super::model::Cell::size(row.largest),
        "factor" => row.factor.map(|factor| crate::text::number::number(factor, 6)),
    )
}
