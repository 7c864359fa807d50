//! Figure 1: the elevation of the fine solution of 6.1.

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::campaigns::paper::PaperOutcome;
use crate::report::drawing::{Drawn, font, shade};

const YAW: f64 = 0.62;
const PITCH: f64 = 0.42;

pub fn caption(outcome: &PaperOutcome) -> String {
    let (title, contact) = outcome.examples.first().map_or(("", &[][..]), |e| {
        (e.title.as_str(), e.contact_set.as_slice())
    });
    let intervals: Vec<String> = contact
        .iter()
        .map(|[a, b]| format!("{a:.4} ≤ x ≤ {b:.4}"))
        .collect();
    format!(
        "The fine mesh solution of {title} by P2 on {0} × {0}. Red: contact, {1} on y = 0.",
        outcome.fine,
        intervals.join(", ")
    )
}

pub fn draw<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    outcome: &PaperOutcome,
) -> Drawn<DB> {
    let Some(example) = outcome.examples.first() else {
        return Ok(());
    };
    let heights = &example.fine.elevation;
    let all = || heights.iter().flatten().copied();
    let (low, high) = (all().fold(0.0, f64::min), all().fold(0.0, f64::max));
    let room = 0.05 * (high - low).max(f64::MIN_POSITIVE);
    let (bottom, top) = (low - room, high + room);
    let (plot, below) = area.split_vertically(area.dim_in_pixel().1 as i32 - 50);

    // x to the right, u upwards (plotters' second axis), -y towards the reader: Γ_C lies in front.
    let mut chart =
        ChartBuilder::on(&plot)
            .margin(30)
            .build_cartesian_3d(0.0..1.0, bottom..top, -1.0..0.0)?;
    chart.with_projection(|mut projection| {
        projection.yaw = YAW;
        projection.pitch = PITCH;
        projection.scale = 0.82;
        projection.into_matrix()
    });
    chart
        .configure_axes()
        .axis_panel_style(WHITE)
        .light_grid_style(TRANSPARENT)
        .bold_grid_style(BLACK.mix(0.15))
        .label_style(font(16))
        .x_labels(6)
        .y_labels(6)
        .z_labels(6)
        .tick_size(6)
        .x_formatter(&|x| format!("{x:.1}"))
        .y_formatter(&|u| format!("{:.1}", unsigned_zero(*u)))
        // x = 1 and y = 0 share a corner, which x labels.
        .z_formatter(&|z| {
            if unsigned_zero(*z) == 0.0 {
                String::new()
            } else {
                format!("{:.1}", -z)
            }
        })
        .draw()?;

    let last = heights.len() - 1;
    let at = |k: usize| k as f64 / last as f64;
    let mut tiles = Vec::with_capacity(last * last);
    for j in 0..last {
        for i in 0..last {
            let corner = |i: usize, j: usize| (at(i), heights[j][i], -at(j));
            let corners = vec![
                corner(i, j),
                corner(i + 1, j),
                corner(i + 1, j + 1),
                corner(i, j + 1),
            ];
            let mean = corners.iter().map(|c| c.1).sum::<f64>() / 4.0;
            let (x, z) = (0.5 * (at(i) + at(i + 1)), -0.5 * (at(j) + at(j + 1)));
            let depth = chart.plotting_area().as_coord_spec();
            tiles.push((depth.projected_depth(&x, &mean, &z), mean, corners));
        }
    }
    // The far ones first; what is nearer covers them.
    tiles.sort_by_key(|tile| tile.0);
    for (_, mean, corners) in tiles {
        let share = (mean - low) / (high - low);
        chart.draw_series([Polygon::new(corners.clone(), shade(share).filled())])?;
        let outline = corners.iter().chain(&corners[..1]).copied();
        let outline: Vec<_> = outline.collect();
        chart.draw_series([PathElement::new(outline, BLACK.mix(0.35).stroke_width(1))])?;
    }
    for &[a, b] in &example.contact_set {
        let style = RED.stroke_width(4);
        chart.draw_series([PathElement::new(vec![(a, 0.0, 0.0), (b, 0.0, 0.0)], style)])?;
    }
    let name = |text: &'static str, at: (f64, f64, f64)| Text::new(text, at, font(20));
    chart.draw_series([
        name("x", (0.42, bottom, 0.16)),
        name("y", (1.16, bottom, -0.44)),
        name("u", (-0.14, 0.5 * (bottom + top), 0.0)),
    ])?;
    below.draw(&Text::new(caption(outcome), (30, 12), font(18)))
}

/// Rounding must not print as -0.0.
fn unsigned_zero(value: f64) -> f64 {
    if value.abs() < 1e-9 { 0.0 } else { value }
}
