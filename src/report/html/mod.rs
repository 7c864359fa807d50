//! A report as one HTML file: the answer, then everything that it rests on. It needs no network, no server and no
//! scripts; a small one sorts tables.

mod case;
mod chain;
mod contact;
mod map;
mod markup;
mod pair;
mod plots;
mod summary;

use std::fs;
use std::path::Path;

use super::folder::names;
use super::model::{Block, Figure, Report, word as word_of};
use super::provenance::provenance;
pub(super) use case::section;
pub(super) use contact::{histories, on_contact};
use faceoff_mesh::error::{Error, Result};
pub use markup::Html;
use markup::{element, facts, leaf, picture, prose, raw, table, text};
pub(super) use summary::top;

/// Nothing in the page may ask for anything outside of it.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:";

/// The page of a report whose figures and data are in `folder` already.
///
/// # Errors
/// What a part of it is made of, and figures that cannot be read.
pub(super) fn page(report: &Report, folder: &Path) -> Result<String> {
    let command = report.command;
    let headline = &report.headline;
    let head = Html::from([
        raw("<meta charset=\"utf-8\">"),
        raw(format!(
            "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\">",
            markup::escape(POLICY)
        )),
        raw("<meta name=\"viewport\" content=\"width=device-width\">"),
        // No icon is asked for.
        raw("<link rel=\"icon\" href=\"data:,\">"),
        leaf("title", &[], format!("faceoff {command}: {headline}")),
        element("style", &[], raw(include_str!("style.css"))),
    ]);
    let files = names(folder)?.into_iter();
    let files = files.map(|name| element("li", &[], leaf("a", &[("href", &name)], &name)));
    let main = element(
        "main",
        &[],
        [
            leaf("h1", &[], &report.title),
            answer(report, folder)?,
            blocks(&report.blocks, folder)?,
            leaf("h2", &[], "Provenance"),
            facts(&provenance(report)),
            leaf("h3", &[], "Beside this page"),
            element("ul", &[("class", "files")], files),
        ],
    );
    let script = element("script", &[], raw(include_str!("sort.js")));
    let body = element("body", &[], [main, script]);
    let html = element(
        "html",
        &[("lang", "en")],
        [element("head", &[], head), body],
    );
    Ok(format!("<!doctype html>\n{}\n", html.as_str()))
}

/// What stands first.
fn answer(report: &Report, folder: &Path) -> Result<Html> {
    let headline = &report.headline;
    let (class, label) = match report.verdict {
        Some((verdict, word)) => (word_of(verdict), format!("verdict: {word}")),
        None => ("done", "result".to_owned()),
    };
    let size = if headline.contains(' ') {
        " sentence"
    } else {
        ""
    };
    Ok(element(
        "section",
        &[
            ("class", &format!("verdict {class}{size}")),
            ("role", "status"),
            ("aria-label", &label),
        ],
        [
            leaf("strong", &[("id", "verdict")], headline),
            blocks(&report.lead, folder)?,
        ],
    ))
}

fn blocks(all: &[Block], folder: &Path) -> Result<Html> {
    all.iter().map(|of| block(of, folder)).collect()
}

fn block(block: &Block, folder: &Path) -> Result<Html> {
    Ok(match block {
        Block::Heading(level, words) => leaf(&format!("h{level}"), &[], words),
        Block::Text(words) => element("p", &[], prose(words)),
        Block::List(items) => {
            let items = items.iter().map(|item| element("li", &[], prose(item)));
            element("ul", &[], items)
        }
        Block::Commands(lines) => element(
            "pre",
            &[("class", "wide")],
            leaf("code", &[], lines.join("\n")),
        ),
        Block::Facts(of) => facts(of),
        Block::Table(of) => table(of),
        Block::Figure(of) => on_paper(of, folder)?,
        Block::Folded(summary, inner) => {
            let summary = element("summary", &[], prose(summary));
            element("details", &[], [summary, blocks(inner, folder)?])
        }
        Block::Page(inner) => blocks(inner, folder)?,
        Block::Terminal(_) => Html::default(),
        Block::Html(make) => make()?,
    })
}

/// A figure on white, whatever the page's ground.
fn on_paper(of: &Figure, folder: &Path) -> Result<Html> {
    let path = folder.join(format!("{}.svg", of.name));
    let svg = fs::read_to_string(&path).map_err(Error::io(&path, "read"))?;
    let drawn = element(
        "div",
        &[("class", "wide")],
        picture(&svg, &of.caption, "paper"),
    );
    let links = ["svg", "png"].map(|suffix| {
        let name = format!("{}.{suffix}", of.name);
        Html::from([
            text(" "),
            leaf("a", &[("href", &name)], suffix.to_uppercase()),
        ])
    });
    let caption = element("figcaption", &[], [prose(&of.caption), Html::from(links)]);
    Ok(element("figure", &[], [drawn, caption]))
}
