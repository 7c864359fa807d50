//! Figure 2: errors over h, one panel for 6.1 and one for 6.2, with the paper's markers.
//!
//! Squares: H¹ error; circles: L² error; triangles: ‖u_h + [P(u_h)]₊‖ on Γ_C; dotted: O(h) above, O(h²) below. On the right the smallest N
//! has white markers and the largest black ones.

use plotters::coord::combinators::BindKeyPoints;
use plotters::coord::{CoordTranslate, Shift};
use plotters::prelude::*;

use crate::campaigns::paper::{ExampleOutcome, PaperOutcome, SeriesLevel};
use crate::report::drawing::{Drawn, axes, font};
use crate::report::number::power_of_ten;

/// Half the size of a marker.
const MARKER: i32 = 7;
/// Height of the strip below the panels.
const BELOW: i32 = 84;

#[derive(Clone, Copy)]
enum Marker {
    Square,
    Circle,
    Triangle,
}

type Shown = (Marker, &'static str, fn(&SeriesLevel) -> f64);

/// What is shown of each mesh, and with which marker.
const SHOWN: [Shown; 3] = [
    (Marker::Square, "H¹ error", |l| l.errors_to_fine.h1),
    (Marker::Circle, "L² error", |l| l.errors_to_fine.l2),
    (Marker::Triangle, "‖uₕ + [P(uₕ)]₊‖ on y = 0", |l| l.residual),
];

pub fn caption(outcome: &PaperOutcome) -> String {
    format!(
        "Convergence of the penalty-free method. Left: 6.1. Right: 6.2, {1}. Errors relative to P2 on {0} × {0}. \
         Dotted: upper O(h), lower O(h²).",
        outcome.fine,
        colours(&of_section(outcome, "6.2")),
    )
}

/// `white markers N = 3, black markers N = 5`
fn colours(examples: &[&ExampleOutcome]) -> String {
    let words: Vec<String> = examples
        .iter()
        .enumerate()
        .map(|(k, e)| {
            let colour = match (k, k + 1 == examples.len()) {
                (_, true) => "black",
                (0, _) => "white",
                _ => "grey",
            };
            format!("{colour} markers N = {}", e.zones.unwrap_or(0))
        })
        .collect();
    words.join(", ")
}

fn of_section<'a>(outcome: &'a PaperOutcome, section: &str) -> Vec<&'a ExampleOutcome> {
    let examples = outcome.examples.iter();
    let mut found: Vec<_> = examples
        .filter(|e| e.section == section && !e.series.is_empty())
        .collect();
    found.sort_by_key(|e| e.zones);
    found
}

pub fn draw<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    outcome: &PaperOutcome,
) -> Drawn<DB> {
    let (plots, below) = area.split_vertically(area.dim_in_pixel().1 as i32 - BELOW);
    let panels = plots.split_evenly((1, 2));
    for (panel, section) in panels.iter().zip(["6.1", "6.2"]) {
        let examples = of_section(outcome, section);
        if !examples.is_empty() {
            draw_panel(panel, &examples)?;
        }
    }
    let mut x = 60;
    for (marker, name, _) in SHOWN {
        draw_marker(&below, (x, 18), marker, &BLACK)?;
        below.draw(&Text::new(name, (x + 18, 9), font(18)))?;
        x += 160;
    }
    below.draw(&Text::new(caption(outcome), (50, 46), font(18)))
}

fn draw_panel<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    examples: &[&ExampleOutcome],
) -> Drawn<DB> {
    let series = |e: &ExampleOutcome, value: fn(&SeriesLevel) -> f64| -> Vec<(f64, f64)> {
        let points = e.series[0].levels.iter().map(|l| (l.h, value(l)));
        points.filter(|p| p.1 > 0.0 && p.1.is_finite()).collect()
    };
    let h: Vec<f64> = examples[0].series[0].levels.iter().map(|l| l.h).collect();
    let (finest, coarsest) = (h[h.len() - 1], h[0]);
    let upper = reference(&series(examples[0], SHOWN[0].2), 1, 2.2);
    let lower = reference(&series(examples[0], SHOWN[1].2), 2, 0.35);
    let line = |at: f64, order: i32| [finest, coarsest].map(|h| (h, at * h.powi(order)));
    let ends = [line(upper, 1), line(lower, 2)].concat();
    let all = SHOWN
        .iter()
        .flat_map(|s| examples.iter().flat_map(|e| series(e, s.2)));
    let all: Vec<f64> = all.chain(ends).map(|p| p.1).collect();
    let low = 0.5 * all.iter().copied().fold(f64::INFINITY, f64::min);
    let high = 2.0 * all.iter().copied().fold(0.0, f64::max);

    // Half a mesh of room on either side.
    let room = 2.0_f64.sqrt();
    let x = (finest / room..coarsest * room)
        .log_scale()
        .with_key_points(h.clone());
    let exponents = low.log10().ceil() as i32..=high.log10().floor() as i32;
    let powers = exponents.map(|k| 10.0_f64.powi(k)).collect();
    let y = (low..high).log_scale().with_key_points(powers);
    let mut chart = ChartBuilder::on(area)
        .margin(24)
        .x_label_area_size(66)
        .y_label_area_size(84)
        .caption(heading(examples), font(22))
        .build_cartesian_2d(x, y)?;
    axes(&mut chart.configure_mesh(), 0.12, 19)
        .label_style(font(17))
        .x_desc("h")
        .y_desc("relative error, residual")
        .x_label_formatter(&|h| format!("√2/{:.0}", 2.0_f64.sqrt() / h))
        .y_label_formatter(&|y| power_of_ten(y.log10().round() as i32))
        .draw()?;
    for (at, order, name, shift) in [(upper, 1, "O(h)", -26), (lower, 2, "O(h²)", 8)] {
        let ends = line(at, order);
        let style = BLACK.stroke_width(2);
        chart.draw_series(DashedLineSeries::new(ends, 2, 6, style))?;
        let label = EmptyElement::at(ends[0]) + Text::new(name, (-4, shift), font(18));
        chart.plotting_area().draw(&label)?;
    }
    for (k, example) in examples.iter().enumerate() {
        let share = match examples.len() {
            1 => 1.0,
            all => k as f64 / (all - 1) as f64,
        };
        let grey = (255.0 * (1.0 - share)) as u8;
        for (marker, _, value) in SHOWN {
            let points = series(example, value);
            chart.draw_series(LineSeries::new(points.clone(), BLACK.mix(0.6)))?;
            for point in points {
                let fill = RGBColor(grey, grey, grey);
                draw_marker(chart.plotting_area(), point, marker, &fill)?;
            }
        }
    }
    Ok(())
}

/// The factor of h^order that lies above all points for `beyond` > 1, and below them for `beyond` < 1.
fn reference(points: &[(f64, f64)], order: i32, beyond: f64) -> f64 {
    let factors = points.iter().map(|(h, e)| e / h.powi(order));
    let factor = match beyond > 1.0 {
        true => factors.fold(0.0, f64::max),
        false => factors.fold(f64::INFINITY, f64::min),
    };
    beyond * factor
}

fn draw_marker<DB: DrawingBackend, CT: CoordTranslate>(
    area: &DrawingArea<DB, CT>,
    at: CT::From,
    marker: Marker,
    fill: &RGBColor,
) -> Drawn<DB>
where
    CT::From: Clone,
{
    let edge = BLACK.stroke_width(2);
    let m = MARKER;
    let here = EmptyElement::at(at);
    match marker {
        Marker::Square => {
            let corners = [(-m, -m), (m, m)];
            let inside = Rectangle::new(corners, fill.filled());
            area.draw(&(here + inside + Rectangle::new(corners, edge)))
        }
        Marker::Circle => {
            let inside = Circle::new((0, 0), m, fill.filled());
            area.draw(&(here + inside + Circle::new((0, 0), m, edge)))
        }
        Marker::Triangle => {
            let corners = vec![(0, -m - 2), (m + 1, m), (-m - 1, m)];
            let outline = [&corners[..], &corners[..1]].concat();
            let inside = Polygon::new(corners, fill.filled());
            area.draw(&(here + inside + PathElement::new(outline, edge)))
        }
    }
}

fn heading(examples: &[&ExampleOutcome]) -> String {
    let zones: Vec<String> = examples
        .iter()
        .filter_map(|e| Some(e.zones?.to_string()))
        .collect();
    if zones.is_empty() {
        "6.1: f = -2π sin 2πx".to_owned()
    } else {
        format!("6.2: f = (2πN)² cos 2πNx, N = {}", zones.join(", "))
    }
}
