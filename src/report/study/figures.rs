//! Work and precision of every code and method, and the effect of γ₀: error over time and over γ₀.

use crate::campaigns::study::{NORMS, Norm, Row, StudyOutcome, Varied, duration, front_in, value};
use crate::engine::unique;
use crate::report::html::{Axis, COLOURS, Chart, Line, Point, charts};
use crate::report::model::{Cell, Figure, short};
use crate::text::{Text, text};

/// Values below rounding are not drawn.
const LEAST: f64 = 1e-14;

/// Error over time, on uniform meshes and adapted ones; `None` without a row for it.
pub fn work<'a>(outcome: &'a StudyOutcome, scene: &str) -> Option<Figure<'a>> {
    let kinds = [Varied::Mesh, Varied::Adaptive];
    let time = |row: &Row| row.seconds.median;
    let panel = |norm| {
        let front = front_in(&outcome.rows, norm).into_iter();
        let front = front
            .map(|k| &outcome.rows[k])
            .filter(|row| row.scene == scene);
        let mut front: Vec<[f64; 2]> = front
            .filter_map(|row| Some([time(row), shown(row, norm)?]))
            .collect();
        front.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Chart {
            x: Axis {
                at: (-6..=5).map(times).collect(),
                ..Axis::new("time: mesh, assembly and solution")
            },
            front,
            ..chart(lines(outcome, scene, &kinds, norm, time, true), norm)
        }
    };
    let engines = unique(outcome.rows.iter().map(|row| &*row.engine));
    let colours = match engines.len() {
        1 => "Colours and marks are methods",
        _ => "Colours are codes, marks methods",
    };
    let caption = text!(
        "**Work and precision** of {scene}. {colours}; dashed: adapted meshes; hollow: guaranteed bounds of the \
         error; bars: least to most time. Dotted: what no measurement beats in both, other tolerances, rules and solvers included"
    );
    figure(NORMS.map(panel), format!("work-{scene}"), caption)
}

/// Error over γ₀; `None` without a row for it.
pub fn gamma<'a>(outcome: &'a StudyOutcome, scene: &str) -> Option<Figure<'a>> {
    let panel = |norm| {
        let lines = lines(
            outcome,
            scene,
            &[Varied::Gamma0],
            norm,
            |row| row.gamma0,
            false,
        );
        Chart {
            x: Axis::new("γ₀"),
            ..chart(lines, norm)
        }
    };
    let caption = text!("**Errors over γ₀** of {scene}, on the finest mesh");
    figure(NORMS.map(panel), format!("gamma0-{scene}"), caption)
}

fn figure<'a>(panels: [Chart; 2], name: String, caption: Text) -> Option<Figure<'a>> {
    let panels = panels.into_iter().filter(|chart| !chart.lines.is_empty());
    let panels: Vec<Chart> = panels.collect();
    let label = caption.to_string();
    (!panels.is_empty()).then(|| Figure {
        name,
        caption,
        picture: Box::new(move |width| charts(&label, &panels, width)),
    })
}

fn chart(lines: Vec<Line>, norm: Norm) -> Chart {
    let (name, of) = match norm {
        Norm::Energy => ("Energy", "‖∇(u − uₕ)‖ / ‖∇u‖"),
        Norm::L2 => ("L²", "‖u − uₕ‖ / ‖u‖"),
    };
    Chart {
        name: name.into(),
        y: Axis::new(of),
        lines,
        ..Chart::default()
    }
}

/// 10^power seconds, as one says it.
fn times(power: i32) -> (f64, String) {
    let seconds = 10f64.powi(power);
    let label = match power {
        ..-3 => format!("{} µs", 10f64.powi(power + 6).round()),
        -3..0 => format!("{} ms", 10f64.powi(power + 3).round()),
        _ => format!("{} s", seconds.round()),
    };
    (seconds, label)
}

fn shown(row: &Row, norm: Norm) -> Option<f64> {
    row.error(norm).filter(|e| *e > LEAST && e.is_finite())
}

/// One line per code, method and kind of mesh, by ascending x; for γ₀ that of the finest mesh.
fn lines(
    outcome: &StudyOutcome,
    scene: &str,
    kinds: &[Varied],
    norm: Norm,
    x: impl Fn(&Row) -> f64,
    has_spread: bool,
) -> Vec<Line> {
    let counts = |row: &&Row| {
        let is_shown = row.scene == scene && kinds.contains(&row.varied) && row.converged;
        is_shown && x(row) > 0.0
    };
    let rows: Vec<&Row> = outcome.rows.iter().filter(counts).collect();
    let engines = unique(rows.iter().map(|row| &*row.engine));
    let methods = unique(rows.iter().map(|row| &*row.method));
    let place = |all: &[&str], name: &str| all.iter().position(|of| *of == name).unwrap_or(0);
    let mut all = Vec::new();
    for (varied, engine, method) in unique(rows.iter().map(|r| (r.varied, &*r.engine, &*r.method)))
    {
        let of = |row: &&&Row| (row.varied, &*row.engine, &*row.method) == (varied, engine, method);
        let mut track: Vec<&Row> = rows.iter().filter(of).copied().collect();
        if varied == Varied::Gamma0 {
            let finest = track.iter().map(|row| row.n).max().flatten();
            track.retain(|row| row.n == finest);
        }
        let point = |row: &Row, y: f64, is_hollow: bool| Point {
            spread: (has_spread && !is_hollow).then_some([row.seconds.least, row.seconds.most]),
            is_hollow,
            title: format!(
                "{engine} {method}, {varied} {}: {}{} in {}",
                value(row),
                if is_hollow { "at most " } else { "" },
                if is_hollow {
                    Cell::at_most(y).text()
                } else {
                    short(y)
                },
                duration(row.seconds.median)
            ),
            ..Point::new([x(row), y])
        };
        let is_bound = |row: &Row| norm == Norm::Energy && row.h1.is_none();
        let points = track.iter();
        let points = points.filter_map(|row| Some(point(row, shown(row, norm)?, is_bound(row))));
        let points: Vec<Point> = points.collect();
        if points.is_empty() {
            continue;
        }
        let [of_engine, of_method] = [place(&engines, engine), place(&methods, method)];
        // With one code, the methods have the colours.
        let (name, colour) = match engines.len() {
            1 => ("", of_method),
            _ => (engine, of_engine),
        };
        let colour = COLOURS[colour % COLOURS.len()];
        // The certified bound, above the true error.
        if varied == Varied::Adaptive && norm == Norm::Energy {
            let known = track.iter().filter(|row| !is_bound(row));
            let bounds = known.filter_map(|row| Some(point(row, row.certified?, true)));
            all.push(Line {
                colour,
                mark: of_method,
                points: bounds.collect(),
                ..Line::default()
            });
        }
        all.push(Line {
            names: [name.to_owned(), method.to_owned()],
            colour,
            mark: of_method,
            is_dashed: varied == Varied::Adaptive,
            thickness: 1.0,
            points,
            ..Line::default()
        });
    }
    all
}
