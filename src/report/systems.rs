//! Linear systems of codes in a report: a sentence per pair, a row per block, and the rows that differ on the mesh.

use super::html;
use super::model::{Block, Table, table};
use crate::campaigns::face_off::OfSystems;
use crate::text::number::whole;
use crate::text::{Text, text};
use crate::why::Stated;

/// Differences up to this are rounding.
const TOLERANCE: f64 = 1e-12;

/// The finding on two systems, as a sentence.
pub fn told(of: &OfSystems) -> Text {
    text!(
        "Systems of {of.a} and {of.b}{}: {}.",
        of.level.at(),
        words(of)
    )
}

/// The difference in the first pair of systems that differ.
pub fn claim(of: &OfSystems) -> Text {
    let others = of.in_form.iter().filter(|of| says_more(of));
    let others: Vec<Text> = others.map(|of| of.sentence.clone()).collect();
    let cause = (!others.is_empty()).then(|| Text::joined(others, "; "));
    text!(
        "**{of.a}** and **{of.b}** solve different equations{}: {}",
        of.level.at(),
        cause.unwrap_or_else(|| words(of))
    )
}

/// The rows that differ on the mesh, for the first systems that do.
pub fn picture(all: &[OfSystems]) -> Option<Block<'_>> {
    let (found, mesh, of) = all
        .iter()
        .find_map(|of| Some((of.found.as_ref()?, of.mesh.as_deref()?, of)))?;
    let what = format!("{} – {}{}", of.a, of.b, of.level.at());
    let draw = move || html::mesh::rows(mesh, &found.compared.rows, TOLERANCE, &what);
    Some(Block::Drawn(Box::new(draw)))
}

/// A sentence per pair.
pub fn pairs(all: &[OfSystems]) -> Table {
    table!("", all, |of|
        "codes" => format!("{} – {}{}", of.a, of.b, of.level.at()),
        "verdict" => of.verdict.word(),
        "found" => words(of),
    )
}

/// Is the other form known whose equations a code states?
fn says_more(of: &Stated) -> bool {
    !(of.is_form && of.is_derivative != Some(false) || of.sentence.is_empty())
}

fn words(of: &OfSystems) -> Text {
    let why = of.refused.as_deref().map(Text::message);
    // The statement by the form on both comes before the differences that follow.
    let known = of.in_form.iter().any(says_more);
    let stated = of
        .in_form
        .iter()
        .filter(|of| known && !of.sentence.is_empty());
    let found = of.found.as_ref().map(|found| found.sentence.clone());
    let all = stated.map(|of| of.sentence.clone()).chain(found);
    let found = of.found.as_ref().map(|_| Text::joined(all, "; "));
    found.or(why).unwrap_or_default()
}

/// All blocks of the matrices, and the right-hand sides.
pub fn blocks(all: &[OfSystems]) -> Table {
    let mut rows = Vec::new();
    for of in all {
        let Some(found) = &of.found else { continue };
        let found = &found.compared;
        rows.extend(found.matrix.iter().map(|block| {
            let what = text!("matrix, `{block.of}` with `{block.with}`");
            (of, what, &block.differs, block.largest, block.factor)
        }));
        rows.extend(found.load.iter().map(|load| {
            let what = text!("load, `{load.of}`");
            (of, what, &load.differs, load.largest, load.factor)
        }));
    }
    table!("Differences of the linear systems by blocks", rows, |(of, what, differs, largest, factor)|
        "codes" => format!("{} – {}{}", of.a, of.b, of.level.at()),
        "of" => what,
        "rows that differ" => whole(differs.rows),
        "largest difference" => super::model::Cell::size(largest),
        "factor" => factor.map(|factor| crate::text::number::number(factor, 6)),
    )
}
