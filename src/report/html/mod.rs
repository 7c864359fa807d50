//! A report as one HTML file: the answer, then all evidence. It needs no network, no server and no
//! scripts; a small one sorts tables.

mod agree;
mod along;
mod axis;
mod chain;
mod chart;
mod codes;
mod compared;
mod convergence;
mod costs;
mod effect;
pub(super) mod elevation;
mod history;
mod map;
mod markup;
pub(super) mod mesh;
mod pair;
mod panels;
mod plane;
mod ramp;
mod residual;
mod solution;
mod source;
mod spread;
mod steps;
mod surface;
mod tables;
mod verify;

use std::path::Path;

use super::folder::names;
use super::model::{Block, Figure, Report, word as word_of};
use super::provenance::{Provenance, provenance};
use crate::text::Text;
pub(super) use along::along_one;
pub(super) use axis::{Axis as DotAxis, Dot};
pub(super) use chart::{Axis, COLOURS, Chart, Line, Point, Slope, chart_figure, charts};
pub(super) use codes::{fields, tolerances};
pub(super) use compared::Compared;
pub(super) use convergence::newton;
pub(super) use costs::{costs, percent_asked};
use faceoff_mesh::error::Result;
pub(super) use history::history;
pub(super) use map::{Map, Spot};
pub use markup::Html;
use markup::{emphasised, facts, figures, folded, html, raw, visible};
pub use plane::Picture;
pub(super) use plane::{NARROWEST, WIDEST};
pub(super) use residual::{Put, by_term, cause};
pub(super) use solution::{cells, solution};
pub(super) use spread::Spread;
pub(super) use steps::steps;
use tables::table;
pub(super) use verify::Run;

/// The page must not load anything from outside.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:";

/// A longer answer is not used as a headline.
const LONG: usize = 110;

/// The page of a report whose data are already in `folder`, so that it can name them.
///
/// # Errors
/// Errors in making one of its parts.
pub(super) fn page(report: &Report, folder: &Path) -> Result<String> {
    let style = [
        include_str!("svg.css"),
        include_str!("style.css"),
        include_str!("ramp.css"),
    ]
    .concat();
    let word = report
        .verdict
        .map_or("done", |(verdict, _)| word_of(verdict));
    let is_brief = report.story.next.is_empty() && word == "agree";
    // No icon is requested.
    let html = html! {
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width,initial-scale=1";
                link rel="icon" href="data:,";
                title { "faceoff " (report.command) ": " (report.headline().to_string()) }
                style { (raw(style)) }
            }
            body {
                main class={ (word) @if is_brief { " brief" } } {
                    (origin(report))
                    (answer(report))
                    (lead(report)?)
                    (blocks(&report.story.rest)?)
                    (foot(report, folder)?)
                }
                script { (raw(include_str!("sort.js"))) }
            }
        }
    };
    Ok(visible(&format!("<!doctype html>\n{}\n", html.as_str())))
}

/// The command, and on one line program, machine and date; the rest is folded.
fn origin(report: &Report) -> Html {
    let Provenance { command, line, all } = provenance(report);
    let line = html! {
        @if let Some((verdict, word)) = report.verdict {
            span { b class={ "v " (word_of(verdict)) } { (word) } }
        }
        @for words in &line { span { (words) } }
    };
    html! { .prov { code { (command) } (folded(line, facts(&all))) } }
}

/// The verdict as a sentence, with its evidence.
fn answer(report: &Report) -> Html {
    let label = match report.verdict {
        Some((_, word)) => format!("verdict: {word}"),
        None => "result".to_owned(),
    };
    let claim = match report.story.claim.is_empty() {
        true => report.headline().capitalised(),
        false => report.story.claim.clone(),
    };
    let is_long = claim.to_string().chars().count() > LONG;
    html! {
        header role="status" aria-label=(label) {
            h1 #verdict class=[is_long.then_some("long")] { (emphasised(&claim, "em")) }
            @if !report.story.rests_on.is_empty() { p.lede { (report.story.rests_on) } }
        }
    }
}

/// The picture, and next to it the suggestions.
fn lead(report: &Report) -> Result<Html> {
    let pictures = blocks(&report.story.picture)?;
    if report.story.next.is_empty() {
        return Ok(pictures);
    }
    Ok(html! {
        .grid {
            @if !pictures.is_empty() { .c8 { (pictures) } }
            aside class={ @if pictures.is_empty() { "c12" } @else { "c4" } " next" } {
                h2 { "What to do next" }
                ol {
                    @for step in &report.story.next {
                        li { (step.words) @for of in &step.commands { pre { (typed(of)) } } }
                    }
                }
            }
        }
    })
}

/// A command in which line breaks do not separate options from their values.
fn typed(command: &str) -> Html {
    let mut words: Vec<String> = Vec::new();
    for word in command.split(' ') {
        match words.last_mut() {
            Some(last)
                if last.starts_with("--") && !last.contains(' ') && !word.starts_with("--") =>
            {
                last.push(' ');
                last.push_str(word);
            }
            _ => words.push(word.to_owned()),
        }
    }
    html! { @for word in words { span { (word) } " " } }
}

/// The methods, and the files in the folder of the page.
fn foot(report: &Report, folder: &Path) -> Result<Html> {
    let mut files = names(folder)?;
    // Files for scripts come first.
    files.sort_by_key(|name| !name.ends_with(".json"));
    let (shown, rest) = match files.len() {
        0..=6 => (&files[..], &[][..]),
        _ => files.split_at(3),
    };
    let links = |files: &[String]| {
        html! { @for (k, name) in files.iter().enumerate() { @if k > 0 { ", " } a href=(name) { (name) } } }
    };
    Ok(html! {
        footer {
            @for words in &report.notes { p { (words) } }
            .files {
                "Beside this page: " (links(shown))
                @if rest.is_empty() { "." } @else {
                    " and " (folded(html! { (rest.len()) " files" }, links(rest)))
                }
            }
        }
    })
}

/// Pictures, three in a row.
pub(super) fn in_thirds(all: impl IntoIterator<Item = Html>) -> Html {
    html! { .grid { @for part in all { .c4.half { (part) } } } }
}

fn blocks(all: &[Block]) -> Result<Html> {
    all.iter().map(|of| block(of)).collect()
}

fn block(block: &Block) -> Result<Html> {
    Ok(match block {
        Block::Heading(2, words) => html! { h2 { (words) } },
        Block::Heading(_, words) => html! { h3 { (words) } },
        Block::Text(words) => html! { p { (words) } },
        Block::List(items) => html! { ul { @for item in items { li { (item) } } } },
        Block::Commands(lines) => html! { pre { (lines.join("\n")) } },
        Block::Facts(of) => facts(of),
        Block::Table(of) => table(of),
        Block::Titled(words, of) => html! { h2 { (words) } (table(of)) },
        Block::Figure(of) => figure_of(of),
        Block::Folded([name, about], inner) => {
            let name = html! { (name) " " @if !about.is_empty() { span { "· " (about) } } };
            folded(name, blocks(inner)?)
        }
        Block::Beside(all) => {
            html! { .grid { @for (class, inner) in all { div class=(class) { (blocks(inner)?) } } } }
        }
        Block::Page(inner) => blocks(inner)?,
        Block::Terminal(_) => Html::default(),
        Block::Drawn(draw) => draw()?,
    })
}

/// Drawn for a wide page and for a narrow one, with the name of its file.
fn figure_of(of: &Figure) -> Html {
    let drawn = [WIDEST, NARROWEST].map(|width| (of.picture)(width).html());
    let caption = of
        .caption
        .clone()
        .and(" ")
        .and(Text::link(of.file(), "SVG"));
    figures("", caption, drawn)
}
