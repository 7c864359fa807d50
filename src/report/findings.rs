//! Tables of the findings about a field in a scheme.

use super::html::{Dot, DotAxis};
use super::model::{Block, Cell, Column, Table, table};
use crate::text::number::place;
use crate::why::{self, Explanation, FaceGamma, Spot, TermRows};

/// The number of attempts that are not folded.
const TRIED: usize = 5;

/// The rows with the largest residual.
pub(super) fn worst(spots: &[Spot]) -> Table {
    table!("The rows that are farthest off, by backward error", spots, |spot|
        "vertices" => format!("{:?}", spot.vertices),
        "at" => place(&spot.midpoint),
        "residual" => spot.error,
    )
}

/// The terms in the failing rows.
pub(super) fn terms(terms: &[TermRows]) -> Table {
    let caption = "The terms of the rows that fail; a term that is wrong is part of all of them";
    table!(caption, terms, |of|
        "term" => why::name(of.term),
        "rows" => of.rows,
        "fail" => of.failing,
        "can be wrong" => if of.suspect { "yes" } else { "" },
    )
}

/// The changes that were tried, one at a time, with the remaining residual; the rest of a long list is folded.
pub(super) fn tried<'a>(explanations: &[Explanation], limit: f64) -> Vec<Block<'a>> {
    let axis = DotAxis::new(explanations.iter().map(|e| e.left), vec![limit]);
    let dot = |of: &Explanation| Dot {
        value: of.left,
        class: if of.accounts { "" } else { "e2" },
        title: of.ingredient.to_string(),
    };
    let table = |all: &[Explanation]| {
        let of = table!("", all, |of|
            ("", "what would have to be so") => &of.what,
            Column::of_dots("residual with it", &axis) => Cell::dots(&axis, &[dot(of)], of.left),
            ("n", "left") => Cell::size(of.left),
            ("w opt", "found") => if of.accounts { "explains it" } else { "does not" },
        );
        of.setting_off(all.iter().map(|of| of.accounts)).into()
    };
    let (first, rest) = explanations.split_at(explanations.len().min(TRIED));
    let more = (!rest.is_empty()).then(|| {
        let name = format!("{} more that leave more", rest.len());
        Block::folded(name, "", vec![table(rest)])
    });
    [table(first)].into_iter().chain(more).collect()
}

/// The γ that fits.
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
