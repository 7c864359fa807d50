//! The history of releases: one row of signs each, which do not rely on their colours.

use super::markup::{Html, html};
use super::tables::table;
use crate::campaigns::matrix::verdict;
use crate::engine::unique;
use crate::report::matrix::{Past, badge_name};
use crate::report::model::{Cell, Table};
use crate::text::Text;
use faceoff_judge::Verdict;

/// The most runs in a row.
const MOST: usize = 60;

pub(in crate::report) fn history(past: &[Past]) -> Html {
    let names = past
        .iter()
        .flat_map(|run| run.releases.iter().map(|of| &*of.name));
    let shown = &past[past.len().saturating_sub(MOST)..];
    let rows = unique(names).into_iter().map(|name| {
        let signs = shown.iter().map(|run| sign(run, name)).collect();
        // The badge of a release that is no longer in the request is from an earlier run.
        let is_asked = past
            .last()
            .is_some_and(|run| run.releases.iter().any(|of| of.name == name));
        let badge = badge_name(name);
        let link = is_asked.then(|| Text::link(badge, "badge"));
        let signs = Cell {
            more: signs,
            ..Cell::default()
        };
        vec![name.into(), signs, link.into()]
    });
    table(&Table::new("", ["release", "runs", "badge"]).with(rows))
}

/// One run of one release.
fn sign(run: &Past, name: &str) -> Html {
    let Some(release) = run.releases.iter().find(|of| of.name == name) else {
        return html! { "\u{2007}" };
    };
    let (sign, class) = match verdict(run.cells.iter().filter(|cell| cell.release == name)) {
        Verdict::Agree | Verdict::Conditioned => ("●", "good"),
        Verdict::Several | Verdict::Disagree => ("×", "bad"),
        Verdict::Undetermined => ("○", ""),
    };
    let version = release.version.as_deref().unwrap_or("not there");
    let about = format!("{}: {version}, faceoff {}", run.date, run.faceoff);
    html! { span class=(class) title=(about) { (sign) } }
}
