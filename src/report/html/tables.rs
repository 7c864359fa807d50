//! Tables, and the words for verdicts.

use super::markup::{Html, element, leaf, prose, text};
use crate::report::model::{Cell, Table, word as word_of};
use faceoff_judge::Verdict;

/// A table of a report: its columns sort by the numbers behind them.
pub(super) fn table(table: &Table) -> Html {
    let classes: Vec<&str> = (0..table.head.len())
        .map(|k| match table.head[k].class {
            Some(class) => class,
            None if table.is_numeric(k) => "n",
            None => "",
        })
        .collect();
    let class =
        |k: usize| Vec::from_iter((!classes[k].is_empty()).then_some(("class", classes[k])));
    let head = table.head.iter().enumerate().map(|(k, column)| {
        let attributes = [&[("scope", "col")], &class(k)[..]].concat();
        let name = prose(&column.name);
        element("th", &attributes, [name, column.more.clone()])
    });
    let head = element("thead", &[], element("tr", &[], head));
    let rows = table.rows.iter().enumerate().map(|(row, cells)| {
        let verdict = cells.iter().filter_map(|cell| cell.verdict).max();
        let is_hot = match table.set_off.get(row) {
            Some(is_set_off) => *is_set_off,
            None => verdict.is_some_and(|verdict| !verdict.passes()),
        };
        let cells = cells.iter().enumerate().map(|(k, cell)| {
            let key = cell.value.filter(|v| v.is_finite()).map(|v| v.to_string());
            let mut attributes = class(k);
            attributes.extend(key.as_deref().map(|key| ("data-v", key)));
            element("td", &attributes, of_cell(cell))
        });
        let hot = is_hot.then_some(("class", "hot"));
        element("tr", hot.as_slice(), cells)
    });
    let rows: Html = rows.collect();
    let caption = match table.caption.is_empty() {
        true => Html::default(),
        false => element("caption", &[], prose(&table.caption)),
    };
    let table = element("table", &[], [caption, head, element("tbody", &[], rows)]);
    element("div", &[("class", "scroll")], table)
}

fn of_cell(cell: &Cell) -> Html {
    let shown = prose(&cell.shown);
    let shown = match cell.is_bad {
        true => element("b", &[("class", "bad")], shown),
        false => shown,
    };
    let verdict = cell.verdict.map(word).unwrap_or_default();
    Html::from([verdict, shown, cell.more.clone()])
}

/// The verdict as a word that does not rely on its colour.
pub(super) fn word(verdict: Verdict) -> Html {
    match verdict {
        Verdict::Agree => text(word_of(verdict)),
        _ => leaf("b", &[("class", "bad")], word_of(verdict)),
    }
}
