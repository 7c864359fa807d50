//! Work and precision, every engine and method on one page, and what γ₀ does: error over time and over γ₀, log-log.

use plotters::coord::Shift;
use plotters::coord::combinators::BindKeyPoints;
use plotters::prelude::*;

use crate::campaigns::study::{NORMS, Norm, Row, StudyOutcome, Varied};
use crate::engine::unique;
use crate::report::drawing::{Drawing, Drawn, axes, font};
use crate::report::model::Figure;
use crate::report::number::power_of_ten;

/// Colours that can be distinguished without red and green (M. Okabe, K. Ito), then darker ones.
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
/// Labels on an axis.
const MOST_LABELS: i32 = 12;
/// Up to so many decades 2 and 5 are labelled as well.
const FEW_DECADES: i32 = 2;

/// Error over time, on uniform meshes and adapted ones; none without a row for it.
pub fn work<'a>(outcome: &'a StudyOutcome, scene: &str) -> Option<Figure<'a>> {
    let kinds = [
        (Varied::Mesh, None),
        (Varied::Adaptive, Some("dashed: adapted, certified")),
    ];
    let page = Page {
        title: scene.to_owned(),
        x: "seconds: mesh, assembly and solution",
        has_spread: true,
        lines: lines(outcome, scene, &kinds, |row| row.seconds.median),
    };
    let caption = format!("Work and precision of {scene}.");
    figure(page, format!("work-{scene}"), caption)
}

/// Error over γ₀; none without a row for it.
pub fn gamma<'a>(outcome: &'a StudyOutcome, scene: &str) -> Option<Figure<'a>> {
    let mut lines = lines(outcome, scene, &[(Varied::Gamma0, None)], |row| row.gamma0);
    for line in &mut lines {
        let finest = line.points.iter().map(|(_, row)| row.n).max().flatten();
        line.points.retain(|(_, row)| row.n == finest);
    }
    let page = Page {
        title: scene.to_owned(),
        x: "γ₀",
        has_spread: false,
        lines,
    };
    let caption = format!("Errors over γ₀ of {scene}.");
    figure(page, format!("gamma0-{scene}"), caption)
}

fn figure(page: Page<'_>, name: String, caption: String) -> Option<Figure<'_>> {
    let picture = Box::new(page);
    (!picture.lines.is_empty()).then_some(Figure {
        name,
        caption,
        picture,
    })
}

/// Two panels, in the energy norm and in L², with a legend.
struct Page<'a> {
    title: String,
    x: &'static str,
    /// Are the least and the largest time of each point shown?
    has_spread: bool,
    lines: Vec<Line<'a>>,
}

/// The rows of one line, by rising x.
struct Line<'a> {
    engine: &'a str,
    method: &'a str,
    /// Dashed, with what that means.
    dashed: Option<&'static str>,
    points: Vec<(f64, &'a Row)>,
}

/// A point in one norm.
struct Point {
    x: f64,
    y: f64,
    /// Of x.
    range: [f64; 2],
}

fn lines<'a>(
    outcome: &'a StudyOutcome,
    scene: &str,
    kinds: &[(Varied, Option<&'static str>)],
    x: impl Fn(&Row) -> f64,
) -> Vec<Line<'a>> {
    let mut lines: Vec<Line> = Vec::new();
    for &(varied, dashed) in kinds {
        for row in outcome.rows.iter().filter(|r| r.scene == scene) {
            if row.varied != varied || !row.converged || !(x(row) > 0.0) {
                continue;
            }
            let key = (&*row.engine, &*row.method, dashed);
            let same = |line: &&mut Line| (line.engine, line.method, line.dashed) == key;
            match lines.iter_mut().find(same) {
                Some(line) => line.points.push((x(row), row)),
                None => lines.push(Line {
                    engine: key.0,
                    method: key.1,
                    dashed,
                    points: vec![(x(row), row)],
                }),
            }
        }
    }
    lines
}

impl Drawing for Page<'_> {
    fn size(&self) -> (u32, u32) {
        (1500, 760)
    }

    fn on<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawn<DB> {
        let (plots, legend) = area.split_horizontally((self.size().0 - LEGEND) as i32);
        let panels = plots.split_evenly((1, 2));
        for (panel, norm) in panels.iter().zip(NORMS) {
            self.panel(panel, norm)?;
        }
        self.legend(&legend)
    }
}

impl Page<'_> {
    fn engines(&self) -> Vec<&str> {
        unique(self.lines.iter().map(|line| line.engine))
    }

    fn methods(&self) -> Vec<&str> {
        unique(self.lines.iter().map(|line| line.method))
    }

    /// The points of each line that has some in this norm. Below rounding there is nothing to see.
    fn points(&self, norm: Norm) -> Vec<(&Line<'_>, Vec<Point>)> {
        let of = |line: &Line| -> Vec<Point> {
            let points = line.points.iter();
            let points = points.filter_map(|(x, row)| {
                let y = row.error(norm).filter(|e| *e > 1e-14 && e.is_finite())?;
                let range = match self.has_spread {
                    true => [row.seconds.least, row.seconds.most],
                    false => [*x; 2],
                };
                Some(Point { x: *x, y, range })
            });
            points.collect()
        };
        let lines = self.lines.iter().map(|line| (line, of(line)));
        lines.filter(|(_, points)| !points.is_empty()).collect()
    }

    fn panel<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>, norm: Norm) -> Drawn<DB> {
        let lines = self.points(norm);
        let (name, of) = match norm {
            Norm::Energy => ("energy norm", "‖∇(u-u_h)‖ / ‖∇u‖"),
            Norm::L2 => ("L²", "‖u-u_h‖ / ‖u‖"),
        };
        if lines.is_empty() {
            let text = format!("{}: the error in {name} is not known", self.title);
            return area.draw(&Text::new(text, (60, 60), font(18)));
        }
        let all = || lines.iter().flat_map(|line| line.1.iter());
        let (xs, x_powers) = decades(all().flat_map(|p| p.range));
        let (errors, error_powers) = decades(all().map(|p| p.y));
        let is_bound = |line: &(&Line, _)| line.0.points.iter().any(|(_, row)| row.h1.is_none());
        let y = if norm == Norm::Energy && lines.iter().any(is_bound) {
            format!("guaranteed bound of {of}")
        } else {
            of.to_owned()
        };
        let mut chart = ChartBuilder::on(area)
            .margin(20)
            .x_label_area_size(56)
            .y_label_area_size(76)
            .caption(format!("{}: {name}", self.title), font(20))
            .build_cartesian_2d(
                xs.log_scale().with_key_points(x_powers),
                errors.log_scale().with_key_points(error_powers),
            )?;
        axes(&mut chart.configure_mesh(), 0.12, 17)
            .label_style(font(15))
            .x_desc(self.x)
            .y_desc(y)
            .x_label_formatter(&|t| label(*t))
            .y_label_formatter(&|e| label(*e))
            .draw()?;
        let (engines, methods) = (self.engines(), self.methods());
        for (line, points) in lines {
            let place = |names: &[&str], name: &str| names.iter().position(|n| *n == name);
            let colour = COLOURS[place(&methods, line.method).unwrap_or(0) % COLOURS.len()];
            let style = colour.stroke_width(2);
            let way: Vec<(f64, f64)> = points.iter().map(|p| (p.x, p.y)).collect();
            if line.dashed.is_some() {
                chart.draw_series(DashedLineSeries::new(way, 6, 5, style))?;
            } else {
                chart.draw_series(LineSeries::new(way, style))?;
            }
            for Point { x, y, range } in points {
                let at = EmptyElement::at((x, y));
                let plot = chart.plotting_area();
                let spread = range.map(|x| (x, y)).to_vec();
                plot.draw(&PathElement::new(spread, colour.mix(0.6)))?;
                let filled = colour.filled();
                match place(&engines, line.engine).unwrap_or(0) % 3 {
                    0 => plot.draw(&(at + Circle::new((0, 0), MARKER, filled)))?,
                    1 => {
                        let corners = [(-MARKER, -MARKER), (MARKER, MARKER)];
                        plot.draw(&(at + Rectangle::new(corners, filled)))?;
                    }
                    _ => plot.draw(&(at + TriangleMarker::new((0, 0), MARKER + 2, filled)))?,
                }
            }
        }
        Ok(())
    }

    fn legend<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawn<DB> {
        let mut y = 60;
        for (m, method) in self.methods().into_iter().enumerate() {
            let colour = COLOURS[m % COLOURS.len()].stroke_width(3);
            area.draw(&PathElement::new(vec![(10, y), (44, y)], colour))?;
            area.draw(&Text::new(method.to_owned(), (54, y - 9), font(17)))?;
            y += 26;
        }
        y += 16;
        for (e, engine) in self.engines().into_iter().enumerate() {
            let marker = ["circles", "squares", "triangles"][e % 3];
            let text = format!("{marker}: {engine}");
            area.draw(&Text::new(text, (10, y - 9), font(17)))?;
            y += 26;
        }
        let dashed = self.lines.iter().find_map(|line| line.dashed);
        let spread = self.has_spread.then_some("bars: least to most");
        for text in dashed.into_iter().chain(spread) {
            area.draw(&Text::new(text, (10, y - 9), font(17)))?;
            y += 26;
        }
        Ok(())
    }
}

/// `10⁻³`, or `2·10⁻³`.
fn label(value: f64) -> String {
    let power = (value.log10() + 1e-9).floor() as i32;
    let digit = (value / 10.0_f64.powi(power)).round();
    if digit == 1.0 {
        power_of_ten(power)
    } else {
        format!("{digit}·{}", power_of_ten(power))
    }
}

/// The range of whole decades about values that are positive, and what is labelled in it: not too many, nor too few.
fn decades(values: impl Iterator<Item = f64> + Clone) -> (std::ops::Range<f64>, Vec<f64>) {
    let low = values.clone().fold(f64::INFINITY, f64::min).log10().floor() as i32;
    let high = (values.fold(0.0, f64::max).log10().ceil() as i32).max(low + 1);
    let step = (high - low).div_euclid(MOST_LABELS) + 1;
    let multiples: &[f64] = match high - low {
        ..=FEW_DECADES => &[1.0, 2.0, 5.0],
        _ => &[1.0],
    };
    let powers = (low..=high).step_by(step as usize);
    let powers = powers.map(|k| 10.0_f64.powi(k));
    let labelled = powers.flat_map(|power| multiples.iter().map(move |m| m * power));
    (10.0_f64.powi(low)..10.0_f64.powi(high), labelled.collect())
}
