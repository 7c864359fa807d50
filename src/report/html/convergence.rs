//! Increments step by step, one line per code.

use super::Html;
use super::chart::{Axis, COLOURS, Chart, Line, Point, RED, charts};
use super::markup::figure;
use crate::text::Text;

/// With more steps, none has a separate mark.
const MARKED: usize = 60;

/// The increments of each code, step by step; the lines of those at fault are red.
pub(in crate::report) fn newton(
    engines: &[(&str, &[f64])],
    faulty: &[&str],
    stop: Option<f64>,
    caption: impl Into<Text>,
) -> Html {
    let all = || engines.iter().flat_map(|(_, v)| v.iter().copied());
    let least = all().filter(|v| *v > 0.0).fold(f64::INFINITY, f64::min);
    if !least.is_finite() {
        return Html::default();
    }
    let lines = engines.iter().enumerate().map(|(k, (name, values))| {
        let colour = match faulty.contains(name) {
            true => RED,
            false => COLOURS[k % COLOURS.len()],
        };
        // An increment of 0 is drawn below all others.
        let at = |(k, v): (usize, &f64)| [(k + 1) as f64, if *v == 0.0 { 0.1 * least } else { *v }];
        let points = values.iter().enumerate().map(at).map(Point::new);
        Line {
            colour,
            is_bare: values.len() > MARKED,
            // Lines that overlap are all visible.
            thickness: 1.0 + (engines.len() - 1 - k) as f64,
            points: points.collect(),
            ..Line::new(name, 0, [])
        }
    });
    let lines: Vec<Line> = lines.collect();
    let steps = lines
        .iter()
        .map(|line| line.points.len())
        .max()
        .unwrap_or(1);
    let chart = Chart {
        x: Axis::linear("step", (1..=steps).map(|k| (k as f64, k.to_string()))),
        y: Axis::new("increment"),
        lines,
        levels: stop.map(|stop| (stop, "stop")).into_iter().collect(),
        ..Chart::default()
    };
    let picture = charts("iterations: increment by step", &[chart], 384.0);
    figure("", caption, picture.html())
}
