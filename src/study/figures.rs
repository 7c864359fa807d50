//! Work and precision: every engine and method on one page, error over time, log-log.

use std::path::Path;

use plotters::coord::Shift;
use plotters::coord::combinators::BindKeyPoints;
use plotters::prelude::*;

use super::row::{Row, Varied};
use super::text::scenes;
use super::{Norm, Outcome};
use crate::drawing::{self, Drawing, Drawn, font, power_of_ten};
use crate::error::Result;

/// Colours that are told apart without red and green (M. Okabe, K. Ito), then darker ones.
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(90, 90, 90),
    RGBColor(140, 86, 75),
];

/// Width of the legend on the right.
const LEGEND: u32 = 260;
const MARKER: i32 = 5;

/// Error over time of one scene: on the left in the energy norm, on the right in L².
struct Work<'a> {
    rows: Vec<&'a Row>,
    scene: &'a str,
    engines: Vec<&'a str>,
    methods: Vec<&'a str>,
}

/// Draws `work-SCENE.svg` and `.png` of every scene.
///
/// # Errors
/// Files that cannot be written.
pub fn draw(outcome: &Outcome, folder: &Path) -> Result<()> {
    for scene in scenes(outcome) {
        let rows = outcome.rows.iter().filter(|row| {
            let kind = matches!(row.varied, Varied::Mesh | Varied::Adaptive);
            row.scene == scene && kind && row.converged && row.seconds.median > 0.0
        });
        let rows: Vec<&Row> = rows.collect();
        let work = Work {
            scene: &scene,
            engines: distinct(rows.iter().map(|row| &*row.engine)),
            methods: distinct(rows.iter().map(|row| &*row.method)),
            rows,
        };
        drawing::draw(&work, folder, &format!("work-{scene}"))?;
    }
    Ok(())
}

fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut seen = Vec::new();
    for name in names {
        if !seen.contains(&name) {
            seen.push(name);
        }
    }
    seen
}

impl Drawing for Work<'_> {
    fn size(&self) -> (u32, u32) {
        (1500, 760)
    }

    fn on<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawn<DB> {
        let (plots, legend) = area.split_horizontally((self.size().0 - LEGEND) as i32);
        let panels = plots.split_evenly((1, 2));
        for (panel, norm) in panels.iter().zip([Norm::Energy, Norm::L2]) {
            self.panel(panel, norm)?;
        }
        self.legend(&legend)
    }
}

/// One line of a panel.
type Points = Vec<(f64, f64)>;

impl Work<'_> {
    fn points(&self, track: (&str, &str), varied: Varied, norm: Norm) -> Points {
        let rows = self
            .rows
            .iter()
            .filter(|row| (&*row.engine, &*row.method) == track && row.varied == varied);
        // Below rounding there is nothing to see.
        let points = rows.filter_map(|row| Some((row.seconds.median, row.error(norm)?)));
        points
            .filter(|(_, e)| *e > 1e-14 && e.is_finite())
            .collect()
    }

    /// Every line with the numbers of its engine and method.
    fn lines(&self, norm: Norm) -> Vec<(usize, usize, Varied, Points)> {
        let mut lines = Vec::new();
        for (e, engine) in self.engines.iter().enumerate() {
            for (m, method) in self.methods.iter().enumerate() {
                for varied in [Varied::Mesh, Varied::Adaptive] {
                    let points = self.points((engine, method), varied, norm);
                    if !points.is_empty() {
                        lines.push((e, m, varied, points));
                    }
                }
            }
        }
        lines
    }

    fn panel<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>, norm: Norm) -> Drawn<DB> {
        let lines = self.lines(norm);
        if lines.is_empty() {
            let text = "no error in this norm is known";
            return area.draw(&Text::new(text, (60, 60), font(18)));
        }
        let all = || lines.iter().flat_map(|line| line.3.iter());
        let (times, time_powers) = decades(all().map(|p| p.0));
        let (errors, error_powers) = decades(all().map(|p| p.1));
        let title = match norm {
            Norm::Energy => format!("{}: energy norm", self.scene),
            Norm::L2 => format!("{}: L²", self.scene),
        };
        let mut chart = ChartBuilder::on(area)
            .margin(20)
            .x_label_area_size(56)
            .y_label_area_size(76)
            .caption(title, font(20))
            .build_cartesian_2d(
                times.log_scale().with_key_points(time_powers),
                errors.log_scale().with_key_points(error_powers),
            )?;
        chart
            .configure_mesh()
            .bold_line_style(BLACK.mix(0.12))
            .light_line_style(TRANSPARENT)
            .label_style(font(15))
            .axis_desc_style(font(17))
            .x_desc("seconds")
            .y_desc("relative error")
            .x_label_formatter(&|t| power_of_ten(t.log10().round() as i32))
            .y_label_formatter(&|e| power_of_ten(e.log10().round() as i32))
            .draw()?;
        for (engine, method, varied, points) in lines {
            let colour = COLOURS[method % COLOURS.len()];
            let style = colour.stroke_width(2);
            if varied == Varied::Adaptive {
                chart.draw_series(DashedLineSeries::new(points.clone(), 6, 5, style))?;
            } else {
                chart.draw_series(LineSeries::new(points.clone(), style))?;
            }
            for point in points {
                let at = EmptyElement::at(point);
                match engine % 3 {
                    0 => chart
                        .plotting_area()
                        .draw(&(at + Circle::new((0, 0), MARKER, colour.filled())))?,
                    1 => {
                        let corners = [(-MARKER, -MARKER), (MARKER, MARKER)];
                        chart
                            .plotting_area()
                            .draw(&(at + Rectangle::new(corners, colour.filled())))?;
                    }
                    _ => chart
                        .plotting_area()
                        .draw(&(at + TriangleMarker::new((0, 0), MARKER + 2, colour.filled())))?,
                }
            }
        }
        Ok(())
    }

    fn legend<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawn<DB> {
        let mut y = 60;
        for (m, method) in self.methods.iter().enumerate() {
            let colour = COLOURS[m % COLOURS.len()].stroke_width(3);
            area.draw(&PathElement::new(vec![(10, y), (44, y)], colour))?;
            area.draw(&Text::new((*method).to_owned(), (54, y - 9), font(17)))?;
            y += 26;
        }
        y += 16;
        for (e, engine) in self.engines.iter().enumerate() {
            let marker = ["circles", "squares", "triangles"][e % 3];
            let text = format!("{marker}: {engine}");
            area.draw(&Text::new(text, (10, y - 9), font(17)))?;
            y += 26;
        }
        if self.rows.iter().any(|row| row.varied == Varied::Adaptive) {
            let text = "dashed: adapted, certified";
            area.draw(&Text::new(text, (10, y - 9), font(17)))?;
        }
        Ok(())
    }
}

/// The range of whole decades about values that are positive, and their powers of ten.
fn decades(values: impl Iterator<Item = f64> + Clone) -> (std::ops::Range<f64>, Vec<f64>) {
    let low = values.clone().fold(f64::INFINITY, f64::min).log10().floor() as i32;
    let high = (values.fold(0.0, f64::max).log10().ceil() as i32).max(low + 1);
    let powers = (low..=high).map(|k| 10.0_f64.powi(k)).collect();
    (10.0_f64.powi(low)..10.0_f64.powi(high), powers)
}
