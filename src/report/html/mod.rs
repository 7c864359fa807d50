//! A report as one HTML file: the answer, then everything that it rests on. It needs no network, no server and no
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
pub(super) use codes::{tolerances, tried};
pub(super) use compared::{Compared, by_field};
pub(super) use convergence::newton;
pub(super) use costs::{costs, percent_asked};
use faceoff_mesh::error::Result;
pub(super) use history::history;
pub(super) use map::{Map, Spot};
pub use markup::Html;
use markup::{division, element, emphasised, facts, folded, leaf, prose, raw, text};
pub use plane::Picture;
pub(super) use plane::{NARROWEST, WIDEST};
pub(super) use residual::{Put, by_term, cause};
pub(super) use solution::{cells, solution};
pub(super) use spread::Spread;
pub(super) use steps::steps;
use tables::table;
pub(super) use verify::Run;

/// Nothing in the page may ask for anything outside of it.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:";

/// A longer answer is no headline.
const LONG: usize = 110;

/// The page of a report whose data are in `folder` already, so that it can name them.
///
/// # Errors
/// What a part of it is made of.
pub(super) fn page(report: &Report, folder: &Path) -> Result<String> {
    let headline = &report.headline;
    let style = [
        include_str!("svg.css"),
        include_str!("style.css"),
        include_str!("ramp.css"),
    ]
    .concat();
    let head = Html::from([
        raw("<meta charset=\"utf-8\">"),
        raw(format!(
            "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\">",
            markup::escape(POLICY)
        )),
        raw("<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"),
        // No icon is asked for.
        raw("<link rel=\"icon\" href=\"data:,\">"),
        leaf(
            "title",
            &[],
            format!("faceoff {}: {headline}", report.command),
        ),
        element("style", &[], raw(style)),
    ]);
    let word = report
        .verdict
        .map_or("done", |(verdict, _)| word_of(verdict));
    let is_brief = report.next.is_empty() && word == "agree";
    let class = if is_brief {
        format!("{word} brief")
    } else {
        word.to_owned()
    };
    let main = [
        origin(report),
        answer(report),
        lead(report)?,
        blocks(&report.blocks)?,
        foot(report, folder)?,
    ];
    let main = element("main", &[("class", &class)], main);
    let script = element("script", &[], raw(include_str!("sort.js")));
    let body = element("body", &[], [main, script]);
    let html = element(
        "html",
        &[("lang", "en")],
        [element("head", &[], head), body],
    );
    Ok(format!("<!doctype html>\n{}\n", html.as_str()))
}

/// The command, and in one line by what, where and when; more of it folded.
fn origin(report: &Report) -> Html {
    let Provenance { command, line, all } = provenance(report);
    let verdict = report.verdict.map(|(verdict, word)| {
        let class = format!("v {}", word_of(verdict));
        element("span", &[], leaf("b", &[("class", &class)], word))
    });
    let line = line.iter().map(|words| element("span", &[], prose(words)));
    let line: Html = verdict.into_iter().chain(line).collect();
    division(
        "prov",
        [leaf("code", &[], command), folded(line, [facts(&all)])],
    )
}

/// The verdict as a sentence, and what it rests on.
fn answer(report: &Report) -> Html {
    let label = match report.verdict {
        Some((_, word)) => format!("verdict: {word}"),
        None => "result".to_owned(),
    };
    let claim = match report.claim.is_empty() {
        true => report.headline.clone().capitalised(),
        false => report.claim.clone(),
    };
    let mut attributes = vec![("id", "verdict")];
    let length = claim.to_string().chars().count();
    attributes.extend((length > LONG).then_some(("class", "long")));
    let lede = match report.lede.is_empty() {
        true => Html::default(),
        false => element("p", &[("class", "lede")], prose(&report.lede)),
    };
    let attributes_of = [("role", "status"), ("aria-label", &*label)];
    element(
        "header",
        &attributes_of,
        [element("h1", &attributes, emphasised(&claim, "em")), lede],
    )
}

/// The picture, and beside it what to do.
fn lead(report: &Report) -> Result<Html> {
    let pictures = blocks(&report.lead)?;
    let steps = report.next.iter().map(|step| {
        let commands = step
            .commands
            .iter()
            .map(|of| element("pre", &[], typed(of)));
        element("li", &[], [prose(&step.words)].into_iter().chain(commands))
    });
    if report.next.is_empty() {
        return Ok(pictures);
    }
    let has_pictures = pictures != Html::default();
    let class = if has_pictures { "c4 next" } else { "c12 next" };
    let next = element(
        "aside",
        &[("class", class)],
        [
            leaf("h2", &[], "What to do next"),
            element("ol", &[], steps),
        ],
    );
    Ok(match has_pictures {
        true => division("grid", [division("c8", pictures), next]),
        false => division("grid", next),
    })
}

/// A command whose options stay with their values where a line ends.
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
    let spans = words
        .into_iter()
        .map(|word| Html::from([leaf("span", &[], word), text(" ")]));
    spans.collect()
}

/// By which methods, and the files beside the page.
fn foot(report: &Report, folder: &Path) -> Result<Html> {
    let notes = report
        .notes
        .iter()
        .map(|words| element("p", &[], prose(words)));
    let mut files = names(folder)?;
    // What scripts read stands first.
    files.sort_by_key(|name| !name.ends_with(".json"));
    let link = |name: &String| leaf("a", &[("href", name)], name);
    let parted = |files: &[String]| -> Html {
        let links = files.iter().enumerate();
        links
            .map(|(k, name)| Html::from([text(if k == 0 { "" } else { ", " }), link(name)]))
            .collect()
    };
    let mut all = vec![text("Beside this page: ")];
    match files.len() {
        0..=6 => all.extend([parted(&files), text(".")]),
        more => {
            let rest = format!("{} files", more - 3);
            all.extend([
                parted(&files[..3]),
                text(" and "),
                folded(text(rest), [parted(&files[3..])]),
            ]);
        }
    }
    let notes: Html = notes.collect();
    Ok(element("footer", &[], [notes, division("files", all)]))
}

/// Side by side, in so many columns of twelve each.
pub(super) fn beside<const N: usize>(all: [(&str, Html); N]) -> Html {
    division("grid", all.map(|(class, part)| division(class, part)))
}

/// Any number of pictures, three in a row.
pub(super) fn in_thirds(all: impl Iterator<Item = Html>) -> Html {
    let parts: Html = all.map(|part| division("c4 half", part)).collect();
    division("grid", parts)
}

/// Names and what they are, beside a picture.
pub(super) fn known(of: &[(Text, Text)]) -> Html {
    facts(of)
}

/// A part with a heading.
fn titled(words: impl Into<Text>, part: Html) -> Html {
    Html::from([element("h2", &[], prose(words)), part])
}

fn blocks(all: &[Block]) -> Result<Html> {
    all.iter().map(|of| block(of)).collect()
}

fn block(block: &Block) -> Result<Html> {
    Ok(match block {
        Block::Heading(level, words) => element(&format!("h{level}"), &[], prose(words)),
        Block::Text(words) => element("p", &[], prose(words)),
        Block::List(items) => {
            let items = items.iter().map(|item| element("li", &[], prose(item)));
            element("ul", &[], items)
        }
        Block::Commands(lines) => leaf("pre", &[], lines.join("\n")),
        Block::Facts(of) => facts(of),
        Block::Table(of) => table(of),
        Block::Figure(of) => figure_of(of),
        Block::Folded([name, about], inner) => {
            // What is said behind the dot is less than a name.
            let about = match about.is_empty() {
                true => Html::default(),
                false => element("span", &[], Html::from([text("· "), prose(about)])),
            };
            folded(
                Html::from([prose(name), text(" "), about]),
                [blocks(inner)?],
            )
        }
        Block::Page(inner) => blocks(inner)?,
        Block::Terminal(_) => Html::default(),
        Block::Html(make) => make()?,
    })
}

/// Drawn for a wide page and for a narrow one, and where it is as a file.
fn figure_of(of: &Figure) -> Html {
    let [wide, narrow] = [WIDEST, NARROWEST].map(|width| (of.picture)(width).html());
    let file = of.file();
    let link = leaf("a", &[("href", &file)], "SVG");
    let caption = element("figcaption", &[], [prose(&of.caption), text(" "), link]);
    let drawn = [division("wide", wide), division("narrow", narrow)];
    element("figure", &[], [caption].into_iter().chain(drawn))
}
