//! Tables, and the words for verdicts.

use super::markup::{Html, html};
use crate::report::model::{Cell, Table, word as word_of};
use faceoff_judge::Verdict;

/// A table of a report: its columns are sorted by the underlying numbers.
pub(super) fn table(table: &Table) -> Html {
    let classes: Vec<Option<&str>> = (0..table.head.len())
        .map(|k| table.head[k].class.or(table.is_numeric(k).then_some("n")))
        .map(|class| class.filter(|class| !class.is_empty()))
        .collect();
    let is_hot = |row: usize, cells: &[Cell]| match table.set_off.get(row) {
        Some(is_set_off) => *is_set_off,
        None => cells
            .iter()
            .filter_map(|cell| cell.verdict)
            .any(|of| !of.passes()),
    };
    html! {
        .scroll {
            table {
                @if !table.caption.is_empty() { caption { (table.caption) } }
                thead {
                    tr {
                        @for (column, class) in table.head.iter().zip(&classes) {
                            th scope="col" class=[class] { (column.name) (column.more) }
                        }
                    }
                }
                tbody {
                    @for (row, cells) in table.rows.iter().enumerate() {
                        tr class=[is_hot(row, cells).then_some("hot")] {
                            @for (cell, class) in cells.iter().zip(&classes) {
                                td class=[class] data-v=[cell.value.filter(|v| v.is_finite())] { (of_cell(cell)) }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn of_cell(cell: &Cell) -> Html {
    html! {
        @if let Some(verdict) = cell.verdict { (word(verdict)) }
        @if cell.is_bad { b.bad { (cell.shown) } } @else { (cell.shown) }
        (cell.more)
    }
}

/// The verdict as a word that does not rely on its colour.
pub(super) fn word(verdict: Verdict) -> Html {
    match verdict {
        Verdict::Agree => html! { (word_of(verdict)) },
        _ => html! { b.bad { (word_of(verdict)) } },
    }
}
