//! Figure 2: errors over h, one panel for 6.1 and one for 6.2, with the paper's marks.
//!
//! Squares: H¹ error; circles: L² error; triangles: ‖u_h + [P(u_h)]₊‖ on Γ_C; dotted: O(h) above, O(h²) below. On the right the
//! smallest N has hollow marks and the largest filled ones.

use crate::campaigns::paper::{ExampleOutcome, PaperOutcome, SeriesLevel};
use crate::report::html::{Axis, COLOURS, Chart, Line, Point, Slope};
use crate::text::{Text, text};

/// The quantities shown for each mesh, and their marks: a square, a circle and a triangle.
type Shown = (usize, &'static str, fn(&SeriesLevel) -> f64);
const SHOWN: [Shown; 3] = [
    (1, "H¹", |l| l.errors_to_fine.h1),
    (0, "L²", |l| l.errors_to_fine.l2),
    (2, "‖uₕ + [P]₊‖", |l| l.residual),
];

pub fn caption(outcome: &PaperOutcome) -> Text {
    let zones = of_section(outcome, "6.2");
    let last = zones.len().saturating_sub(1);
    let marks = zones.iter().enumerate().map(|(k, e)| {
        let mark = if k == last { "filled" } else { "hollow" };
        format!("{mark} marks N = {}", e.zones.unwrap_or(0))
    });
    let marks: Vec<String> = marks.collect();
    text!(
        "**Figure 2.** Convergence of the penalty-free method, errors relative to P2 on {outcome.fine} × {outcome.fine}, and the residual on y = 0. \
         6.2: {}. Dotted: O(h) above, O(h²) below",
        &marks.join(", ")
    )
}

fn of_section<'a>(outcome: &'a PaperOutcome, section: &str) -> Vec<&'a ExampleOutcome> {
    let examples = outcome.examples.iter();
    let mut found: Vec<_> = examples
        .filter(|e| e.section == section && !e.series.is_empty())
        .collect();
    found.sort_by_key(|e| e.zones);
    found
}

pub fn panels(outcome: &PaperOutcome) -> Vec<Chart> {
    let sections = ["6.1", "6.2"].map(|section| of_section(outcome, section));
    let sections = sections.iter().filter(|of| !of.is_empty());
    sections.map(|examples| panel(examples)).collect()
}

fn panel(examples: &[&ExampleOutcome]) -> Chart {
    let last = examples.len().saturating_sub(1);
    let lines = examples.iter().enumerate().flat_map(|(k, e)| {
        SHOWN.map(|(mark, name, value)| {
            let levels = e.series.iter().take(1).flat_map(|s| &s.levels);
            let points = levels.map(|l| Point {
                is_hollow: k < last,
                ..Point::new([l.h, value(l)])
            });
            let zones = e.zones.filter(|_| last > 0);
            let name = zones.map_or(name.to_owned(), |n| format!("{name}, N = {n}"));
            Line {
                colour: COLOURS[0],
                mark,
                points: points.collect(),
                ..Line::new(&name, 0, [])
            }
        })
    });
    let levels = examples.iter().take(1).flat_map(|e| &e.series).take(1);
    let h = levels.flat_map(|s| &s.levels).map(|l| l.h);
    let at = h.map(|h| (h, format!("√2/{:.0}", 2.0_f64.sqrt() / h)));
    let slope = |power, name: &str| Slope {
        power,
        name: name.to_owned(),
    };
    Chart {
        name: heading(examples),
        x: Axis {
            at: at.collect(),
            ..Axis::new("h")
        },
        y: Axis::new("relative error, residual"),
        lines: lines.collect(),
        slopes: vec![slope(1.0, "O(h)"), slope(2.0, "O(h²)")],
        ..Chart::default()
    }
}

fn heading(examples: &[&ExampleOutcome]) -> String {
    let zones: Vec<String> = examples
        .iter()
        .filter_map(|e| Some(e.zones?.to_string()))
        .collect();
    match zones.is_empty() {
        true => "6.1: f = −2π sin 2πx".to_owned(),
        false => format!("6.2: f = (2πN)² cos 2πNx, N = {}", zones.join(", ")),
    }
}
