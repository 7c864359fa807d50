//! The report of a sweep in a face-off file.

use super::html::{self, Axis, Chart, Line, chart_figure};
use super::model::{Block, Cell, Table, TestCase, Todo, joined, table};
use crate::campaigns::face_off::{OfPoint, OfSweep};
use crate::run::place;
use crate::text::number::whole;
use crate::text::{Text, text};

/// Smaller differences are drawn as this, since the axis is logarithmic.
const ROUNDING: f64 = 1e-17;

/// The claim about all points, with that about the point that is shown.
pub(super) fn claim(of: &OfSweep, shown: &Text) -> Text {
    let failing = of.points.iter().filter(|of| !of.verdict.passes()).count();
    let all = whole(of.points.len());
    match (failing, &of.smallest) {
        (0, _) => text!("{shown} at all {all} points of the sweep"),
        (failing, Some(smallest)) => text!(
            "{shown} at {}, as at {} of {all} points of the sweep",
            place(&smallest.at),
            whole(failing)
        ),
        (failing, None) => text!("{shown} at {} of {all} points", whole(failing)),
    }
}

/// The summary of the sweep.
pub(super) fn words(of: &OfSweep) -> Text {
    let over = of.over.join(", ");
    let drawn = of
        .seed
        .map(|seed| text!(", drawn at random (seed {})", whole(seed as usize)));
    let shown = match &of.smallest {
        None => text!(
            "What follows is of {}, where codes differ most.",
            place(&of.shown)
        ),
        Some(smallest) => {
            let from = match smallest.at == smallest.from {
                true => Text::default(),
                false => text!(
                    ", the simplest case of {} found in {} tries",
                    place(&smallest.from),
                    whole(smallest.tried)
                ),
            };
            text!("What follows is of {}{from}.", place(&smallest.at))
        }
    };
    text!(
        "The sweep over {over} has {} points{drawn}. {shown}",
        whole(of.points.len())
    )
}

/// The command for the simplest failure.
pub(super) fn next(of: &OfSweep) -> Option<Todo> {
    let smallest = of.smallest.as_ref()?;
    Some(Todo::new(
        text!("Run that case by itself:"),
        [smallest.command.clone()],
    ))
}

/// All points, and the differences of the codes over each number that changes.
pub(super) fn blocks(of: &OfSweep) -> Vec<Block<'_>> {
    let drawn = Block::drawn(move || figure(of));
    vec![
        Block::Titled("The points of the sweep".into(), points(of)),
        Block::Page(vec![drawn]),
    ]
}

fn points(of: &OfSweep) -> Table {
    let error = |point: &OfPoint, k: usize| point.errors.and_then(|errors| errors[k]);
    table!("", &of.points, |point|
        "at" => place(&point.at),
        "largest relative difference" => point.largest,
        "relative error in L²" => error(point, 0),
        "in H¹" => error(point, 1),
        "verdict" => Cell::from(point.verdict),
        "wrong" => joined(point.wrong.iter().cloned(), ", "),
    )
}

/// The largest difference over each name whose values are numbers: one panel per name.
fn figure(of: &OfSweep) -> html::Html {
    let (what, title) = match of.points.iter().any(|point| point.largest.is_some()) {
        true => ("largest relative difference", "Largest difference"),
        false => ("relative error in L²", "Error in L²"),
    };
    let panel = |name: &String| {
        let at = |of: &OfPoint| {
            let x: f64 = of.at.get(name)?.parse().ok()?;
            // Of one code the error.
            let error = || of.errors.and_then(|errors| errors[0]);
            let largest = of.largest.or_else(error).filter(|l| !l.is_nan())?;
            let mut point = html::Point::new([x, largest.max(ROUNDING)]);
            point.is_bad = !of.verdict.passes();
            point.title = place(&of.at);
            Some(point)
        };
        let mut points: Vec<html::Point> = of.points.iter().filter_map(at).collect();
        points.sort_by(|p, q| p.at[0].total_cmp(&q.at[0]));
        let values = points.iter().map(|p| (p.at[0], p.at[0].to_string()));
        let x = Axis::linear(name, values.collect::<Vec<_>>());
        Chart {
            name: format!("over {name}"),
            x,
            y: Axis::new(what),
            lines: vec![Line {
                points,
                thickness: if of.over.len() == 1 { 1.0 } else { 0.0 },
                ..Line::new("", 0, [])
            }],
            ..Chart::default()
        }
    };
    let panels: Vec<Chart> = of
        .over
        .iter()
        .map(panel)
        .filter(|of| !of.is_empty())
        .collect();
    if panels.is_empty() {
        return html::Html::default();
    }
    let widest = if panels.len() > 1 {
        html::WIDEST
    } else {
        535.0
    };
    let caption =
        text!("**{title}** at the points of the sweep; red: not reached, or codes do not agree");
    chart_figure(&caption, &panels, widest)
}

/// One case per point.
pub(super) fn cases(name: &str, of: &OfSweep) -> Vec<TestCase> {
    let each = of.points.iter().map(|point| {
        let wrong = joined(point.wrong.iter().cloned(), ", ");
        let why = match (point.verdict.passes(), wrong.is_empty()) {
            (true, _) => String::new(),
            (_, true) => "codes do not agree".to_owned(),
            _ => format!("does not agree: {wrong}"),
        };
        TestCase::new(name, format!("at {}", place(&point.at)), point.verdict, why)
    });
    each.collect()
}
