//! Tables of what is found about a field in a scheme.

use super::model::{Cell, Table, table};
use crate::text::number::place;
use crate::why::{self, Explanation, FaceGamma, Spot, TermRows};

/// The rows that are farthest off.
pub(super) fn worst(spots: &[Spot]) -> Table {
    table!("The rows that are farthest off, by backward error", spots, |spot|
        "vertices" => format!("{:?}", spot.vertices),
        "at" => place(&spot.midpoint),
        "residual" => spot.error,
    )
}

/// The terms that the failing rows hold.
pub(super) fn terms(terms: &[TermRows]) -> Table {
    let caption = "The terms of the rows that fail; a term that is wrong is part of all of them";
    table!(caption, terms, |of|
        "term" => why::name(of.term),
        "rows" => of.rows,
        "fail" => of.failing,
        "can be wrong" => if of.suspect { "yes" } else { "" },
    )
}

/// What was put in, and what it left.
pub(super) fn tried(explanations: &[Explanation]) -> Table {
    let caption =
        "What was put into the scheme in its place, one thing at a time, and the residual with it";
    table!(caption, explanations, |of|
        "ingredient" => of.ingredient.to_string(),
        "residual" => of.left,
        "found" => if of.accounts { "explains it" } else { "does not" },
        "with it" => &of.what,
    )
}

/// What γ would have to be.
pub(super) fn gamma<'a>(faces: impl IntoIterator<Item = &'a FaceGamma>) -> Table {
    let caption = "What γ would have to be on contact faces; in contact it has no say";
    let fitted = |of: &FaceGamma| {
        of.factor
            .map(|factor| Cell::number(factor, format!("× {factor:.10}")))
    };
    table!(caption, faces, |of|
        "face" => format!("{:?}", of.vertices),
        "at" => place(&of.midpoint),
        "γ" => fitted(of),
    )
}
