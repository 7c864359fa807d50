//! The report as one HTML file: the verdict, a matrix of everything judged, and for each case what differs where. It
//! needs no network, no server and no scripts; a small one sorts tables.

mod case;
mod chain;
mod contact;
mod map;
mod markup;
mod pair;
mod plots;
mod summary;

use std::path::Path;

use super::json::write_text;
use crate::campaigns::verify::{VerifyOutcome, VerifyRequest};
use crate::run::Failure;
use crate::why::Diagnosis;
use faceoff_mesh::error::Result;
use markup::{Html, element, leaf, raw, text};

/// Nothing in the page may ask for anything outside of it.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:";

/// Writes `index.html` into `folder`. `missing` are engines that were asked for and left out.
///
/// # Errors
/// Scenes whose meshes cannot be made again, and a file that cannot be written.
pub fn write_html(
    folder: &Path,
    request: &VerifyRequest,
    outcome: &VerifyOutcome,
    diagnoses: &[Diagnosis],
    missing: &[Failure],
) -> Result<()> {
    let page = page(request, outcome, diagnoses, missing)?;
    write_text(&folder.join("index.html"), &page)
}

fn page(
    request: &VerifyRequest,
    outcome: &VerifyOutcome,
    diagnoses: &[Diagnosis],
    missing: &[Failure],
) -> Result<String> {
    let cases: Vec<Html> = outcome
        .cases
        .iter()
        .enumerate()
        .map(|(index, case)| case::section(index, case, request, diagnoses))
        .collect::<Result<_>>()?;
    let word = super::word(outcome.verdict);
    let head = Html::from([
        raw("<meta charset=\"utf-8\">"),
        raw(format!(
            "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\">",
            markup::escape(POLICY)
        )),
        raw("<meta name=\"viewport\" content=\"width=device-width\">"),
        // No icon is asked for.
        raw("<link rel=\"icon\" href=\"data:,\">"),
        leaf("title", &[], format!("faceoff: {word}")),
        element("style", &[], raw(include_str!("style.css"))),
    ]);
    let main = element(
        "main",
        &[],
        [
            leaf("h1", &[], "faceoff: do the codes agree, face by face?"),
            summary::verdict(request, outcome, diagnoses, missing)?,
            leaf("h2", &[], "All that was judged"),
            summary::matrix(outcome),
            summary::methods(outcome),
            cases.into_iter().collect(),
            leaf(
                "p",
                &[],
                format!("Written by faceoff {}.", env!("CARGO_PKG_VERSION")),
            ),
        ],
    );
    let body = element("body", &[], [main, script()]);
    let html = element(
        "html",
        &[("lang", "en")],
        [element("head", &[], head), body],
    );
    Ok(format!("<!doctype html>\n{}\n", html.as_str()))
}

fn script() -> Html {
    element("script", &[], raw(include_str!("sort.js")))
}

/// `one-zone, cr, n = 16`
fn label(case: &crate::campaigns::verify::CaseOutcome) -> String {
    let n = case.n.map_or(String::new(), |n| format!(", n = {n}"));
    format!("{}, {}{n}", case.scene, case.method)
}

/// The verdict as a word that does not rely on its colour.
fn word(verdict: faceoff_judge::Verdict) -> Html {
    let word = super::word(verdict);
    leaf("span", &[("class", &format!("word {word}"))], word)
}

/// A number of a table, short, and sortable.
fn number(value: f64) -> Html {
    if value.is_finite() {
        text(format!("{value:.1e}"))
    } else {
        text("–")
    }
}
