//! The matrix of releases: a table, its history, and a badge for each release.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::badge::badge;
use super::html::history;
use super::json::visible;
use super::model::{Block, Cell, Report, Suite, Table, TestCase, cells, count, each_once, plain};
use super::provenance::now;
use super::verify::{Verified, verify};
use crate::campaigns::matrix::{Became, Entry, MatrixOutcome, Place, Release, verdict};
use crate::text::{Text, text};
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Place as Where, Result};
use faceoff_mesh::file;

/// One run, which is a line of the history.
#[derive(Serialize, Deserialize)]
pub struct Past {
    pub date: String,
    pub faceoff: String,
    pub releases: Vec<Release>,
    pub cells: Vec<Entry>,
}

const HISTORY: &str = "history.jsonl";

/// Earlier runs in a folder, the oldest first; empty for a new folder.
///
/// # Errors
/// A file that cannot be read, a line that this program did not write.
pub fn past(folder: &Path) -> Result<Vec<Past>> {
    let path = folder.join(HISTORY);
    if !path.exists() {
        return Ok(Vec::new());
    }
    let text = file::text(&path)?;
    let lines = text.lines().enumerate();
    let read = |(k, line): (usize, &str)| {
        serde_json::from_str(line).map_err(|e| {
            let remedy = "mend or remove the line: the history is kept there, one run a line";
            Error::file(&path, Where::Line(k + 1), e.to_string(), remedy)
        })
    };
    lines.map(read).collect()
}

/// The folder of the page of a scene and method, relative to that of the matrix.
pub fn cell_name(place: &Place) -> String {
    plain(&format!("{}-{}", place.scene, place.method), '_')
}

/// The page of each scene and method, as `verify` writes it.
///
/// # Errors
/// Only those of a broken installation.
pub fn matrix_cells(outcome: &MatrixOutcome) -> Result<Vec<(&Place, Report<'_>)>> {
    let pages = outcome.cases.iter().map(|(place, outcome)| {
        let report = verify(Verified {
            outcome,
            diagnoses: &[],
            missing: &[],
            explain: false,
            verbose: false,
        })?;
        Ok((place, report))
    });
    pages.collect()
}

/// The report of a run, after earlier ones.
///
/// # Errors
/// A result that JSON cannot hold.
pub fn matrix<'a>(outcome: &'a MatrixOutcome, mut past: Vec<Past>) -> Result<Report<'a>> {
    let held = |became| outcome.cells.iter().filter(|c| c.became == became).count();
    let all = outcome.cells.len();
    let mut headline = format!("{} of {all} agree", held(Became::Agrees));
    for (became, word) in [
        (Became::Differs, "differ"),
        (Became::Failed, "failed"),
        (Became::Absent, "are not there"),
        (Became::Refused, "are refused"),
    ] {
        if held(became) > 0 {
            headline += &format!(", {} {word}", held(became));
        }
    }
    let title = "faceoff matrix: which releases of which codes agree?";
    let mut report = Report::judging("matrix", title, outcome.verdict, outcome)?;
    report.headline = headline.clone().into();
    report.story.claim = text!("**{headline}**");
    report.story.rests_on = text!(
        "{}, each held against the solver of faceoff on the same meshes, field by field. A number is the largest difference, \
         relative to the field; a line's name leads to all that it rests on.",
        count(outcome.releases.len(), "release")
    );
    let version = |of: &Release| of.version.clone().unwrap_or("not there".into());
    let releases = outcome.releases.iter();
    report.engines = releases.map(|of| (of.name.clone(), version(of))).collect();
    past.push(Past {
        date: now(),
        faceoff: env!("CARGO_PKG_VERSION").into(),
        releases: outcome.releases.clone(),
        cells: outcome.cells.clone(),
    });
    let lines: Vec<String> = past
        .iter()
        .map(serde_json::to_string)
        .collect::<Result<_, _>>()
        .map_err(|e| Error::usage(format!("the history cannot be JSON: {e}"), "report this"))?;
    report.file(HISTORY, move || visible(&(lines.join("\n") + "\n")));
    report.story.rest.push(table(outcome).into());
    let sentences = sentences(outcome);
    if !sentences.is_empty() {
        report.story.rest.push(Block::list(sentences));
    }
    report.story.rest.push(Block::Page(vec![
        Block::heading(2, "Every release, run by run"),
        Block::text("● all agree, × something differs, ○ no answer; the latest run is last."),
        Block::drawn(move || history(&past)),
    ]));
    for release in &outcome.releases {
        let own: Vec<&Entry> = of(outcome, release).collect();
        let agree = own.iter().filter(|c| c.became == Became::Agrees).count();
        let asked = own.iter().filter(|c| c.became != Became::Refused).count();
        let (verdict, words) = (
            verdict(own.iter().copied()),
            format!("{agree} of {asked} agree"),
        );
        report.file(&badge_name(&release.name), move || badge(verdict, &words));
        report.suites.push(suite(release, &own));
    }
    Ok(report)
}

pub(super) fn badge_name(release: &str) -> String {
    format!("{release}.svg")
}

fn of<'a>(outcome: &'a MatrixOutcome, release: &Release) -> impl Iterator<Item = &'a Entry> {
    let name = release.name.clone();
    outcome
        .cells
        .iter()
        .filter(move |cell| cell.release == name)
}

/// One line per scene and method, one column per release.
fn table(outcome: &MatrixOutcome) -> Table {
    let version = |of: &Release| match &of.version {
        Some(version) if !version.contains(' ') => format!("{} {version}", of.name),
        _ => of.name.clone(),
    };
    let mut head = vec!["scene, method".to_owned()];
    head.extend(outcome.releases.iter().map(version));
    let rows = outcome.cells.chunks(outcome.releases.len().max(1));
    let rows = rows.map(|row| {
        let place = &row[0].place;
        let words = format!("{}, {}", place.scene, place.method);
        let mut cells = match outcome.cases.iter().any(|(of, _)| of == place) {
            true => cells![Text::link(cell_name(place) + "/index.html", words)],
            false => cells![words],
        };
        cells.extend(row.iter().map(cell));
        cells
    });
    Table::new("", head).with(rows)
}

fn cell(of: &Entry) -> Cell {
    match (of.became, of.difference) {
        (Became::Agrees, Some(value)) => Cell::judged(Verdict::Agree, value),
        (Became::Differs, Some(value)) => Cell::judged(Verdict::Disagree, value),
        (became, _) => word(became).into(),
    }
}

fn word(became: Became) -> &'static str {
    match became {
        Became::Agrees => "agrees",
        Became::Differs => "differs",
        Became::Refused => "refused",
        Became::Failed => "failed",
        Became::Absent => "not there",
    }
}

/// The reasons, each once.
fn sentences(outcome: &MatrixOutcome) -> Vec<Text> {
    let said = outcome.cells.iter().filter_map(|cell| {
        let sentence = text!(
            "{cell.release} {}: {}",
            word(cell.became),
            cell.why.as_ref()?
        );
        let place = format!("{}, {}", cell.place.scene, cell.place.method);
        Some((sentence, place.into()))
    });
    each_once(said, outcome.cells.len() / outcome.releases.len().max(1))
}

/// The results that are not refusals.
fn suite(release: &Release, cells: &[&Entry]) -> Suite {
    let cases = cells.iter().filter_map(|cell| {
        let verdict = cell.became.verdict()?;
        let words = cell
            .difference
            .map(|d| format!("relative difference {d:e}"));
        let why = cell.why.as_ref().map(Text::to_string);
        let message = why.or(words).unwrap_or_default();
        let name = format!("{}, {}", cell.place.scene, cell.place.method);
        Some(TestCase::new(&release.name, name, verdict, message))
    });
    Suite::new(&release.name, cases)
}
