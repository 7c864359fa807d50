//! Plots as inline SVG: histograms, curves along Γ_C, histories. Black and white, and three colours that everybody can
//! tell apart; the page's style turns them over in the dark.

use plotters::prelude::*;

use super::markup::{Html, picture};
use crate::report::drawing::{self, SvgArea, axes, font};
use faceoff_mesh::error::Result;

/// M. Okabe and K. Ito's palette, in the order of the engines.
pub(super) const COLOURS: [RGBColor; 4] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
];

/// Where differences begin: rounding.
const SMALLEST: i32 = -18;

/// What is larger is no answer, and beyond what axes can be drawn for.
const MOST: f64 = 1e100;

type Drawn = std::result::Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// `label` is what the picture is called where it is not seen.
fn draw(label: &str, size: (u32, u32), plot: impl FnOnce(&SvgArea) -> Drawn) -> Result<Html> {
    Ok(picture(&drawing::svg(size, plot)?, label, "plot"))
}

/// How many faces differ by how much: one bar a power of ten, what is 0 at the left end.
pub(super) fn histogram(label: &str, differences: &[f64], tolerance: f64) -> Result<Html> {
    let finite = differences.iter().filter(|d| d.is_finite() && **d > 0.0);
    let largest = finite.clone().fold(tolerance, |m, d| m.max(*d));
    let last = largest.log10().floor() as i32 + 1;
    let mut counts = vec![0usize; (last - SMALLEST) as usize];
    for d in differences.iter().filter(|d| d.is_finite()) {
        // Of 0 it is the least integer.
        let power = d.log10().floor() as i32;
        counts[(power.max(SMALLEST) - SMALLEST) as usize] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(1).max(1) as f64;
    draw(label, (460, 230), |area| {
        let range = f64::from(SMALLEST)..f64::from(last);
        let mut chart = ChartBuilder::on(area)
            .margin(8)
            .margin_right(16)
            .x_label_area_size(42)
            .y_label_area_size(48)
            .build_cartesian_2d(range, 0.0..1.05 * most)?;
        axes(&mut chart.configure_mesh(), 0.15, 12)
            .disable_x_mesh()
            .axis_style(BLACK)
            .x_labels((last - SMALLEST).min(8) as usize)
            .y_labels(4)
            .x_desc("|a-b| / (max|u| s)")
            .y_desc("values")
            .x_label_formatter(&|x| match x.round() as i32 {
                SMALLEST => "0".into(),
                power => format!("1e{power}"),
            })
            .y_label_formatter(&|y| format!("{y:.0}"))
            .draw()?;
        let bars = counts.iter().enumerate().filter(|(_, count)| **count > 0);
        chart.draw_series(bars.map(|(k, count)| {
            let low = f64::from(SMALLEST) + k as f64;
            let beyond = low >= tolerance.log10() - 1e-9;
            let colour = if beyond { COLOURS[1] } else { COLOURS[0] };
            let corners = [(low + 0.06, 0.0), (low + 0.94, *count as f64)];
            Rectangle::new(corners, colour.filled())
        }))?;
        let at = tolerance.log10();
        let line = vec![(at, 0.0), (at, 1.05 * most)];
        chart.draw_series(DashedLineSeries::new(line, 5, 4, BLACK.stroke_width(1)))?;
        let name = EmptyElement::at((at, 1.05 * most)) + Text::new("tolerance", (5, 0), font(12));
        chart.draw_series([name])?;
        Ok(())
    })
}

/// A quantity along Γ_C.
pub(super) struct Curves<'a> {
    /// Positions, ascending.
    pub s: &'a [f64],
    /// Name and values of each engine.
    pub values: Vec<(&'a str, Vec<f64>)>,
    /// From, to, and whether it is the whole of it: what is in contact.
    pub zones: &'a [(f64, f64)],
    /// Where the status of two engines differs.
    pub flips: &'a [f64],
    /// What it is.
    pub name: &'a str,
}

/// One above the other, on one axis of positions. Where curves coincide the thin ones lie on the thick ones.
pub(super) fn along_contact(label: &str, axis: &str, panels: &[Curves]) -> Result<Html> {
    draw(label, (720, 200 * panels.len() as u32 + 20), |area| {
        for (part, curves) in area.split_evenly((panels.len(), 1)).iter().zip(panels) {
            let all = || curves.values.iter().flat_map(|(_, v)| v.iter().copied());
            let (low, high) = padded(all());
            // With all of the zones, which end where faces do.
            let zones = curves.zones.iter().flat_map(|&(a, b)| [a, b]);
            let (from, to) = padded(curves.s.iter().copied().chain(zones));
            let mut chart = ChartBuilder::on(part)
                .margin(6)
                .margin_right(16)
                .x_label_area_size(36)
                .y_label_area_size(74)
                .build_cartesian_2d(from..to, low..high)?;
            let grey = BLACK.mix(0.1).filled();
            let shaded = |&(a, b): &(f64, f64)| Rectangle::new([(a, low), (b, high)], grey);
            chart.draw_series(curves.zones.iter().map(shaded))?;
            axes(&mut chart.configure_mesh(), 0.12, 12)
                .axis_style(BLACK)
                .y_labels(5)
                .x_desc(axis)
                .y_desc(curves.name)
                .y_label_formatter(&|y| format!("{:.3}", if y.abs() < 1e-12 { 0.0 } else { *y }))
                .draw()?;
            let thickest = 1 + 2 * curves.values.len() as u32;
            for (k, (_, values)) in curves.values.iter().enumerate() {
                let points = curves.s.iter().copied().zip(values.iter().copied());
                let points = points.filter(|p| low <= p.1 && p.1 <= high);
                let style = COLOURS[k % 4].stroke_width(thickest - 2 * k as u32 - 1);
                chart.draw_series(LineSeries::new(points, style))?;
            }
            let cross = |&s: &f64| Cross::new((s, low), 6, BLACK.stroke_width(2));
            chart.draw_series(curves.flips.iter().map(cross))?;
        }
        Ok(())
    })
}

/// The relative increment of each step, of each engine.
pub(super) fn histories(label: &str, engines: &[(&str, &[f64])]) -> Result<Html> {
    let shown = |v: f64| v > 0.0 && v < MOST;
    let all = || engines.iter().flat_map(|(_, v)| v.iter().copied());
    let all = || all().filter(|v| shown(*v));
    let low = 10_f64.powf(all().fold(1.0, f64::min).max(1e-20).log10().floor());
    let high = 10_f64.powf(all().fold(low * 10.0, f64::max).log10().ceil());
    let steps = engines.iter().map(|(_, v)| v.len());
    let steps = steps.max().unwrap_or(1).max(2);
    draw(label, (460, 230), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(8)
            .margin_right(16)
            .x_label_area_size(42)
            .y_label_area_size(60)
            .build_cartesian_2d(0.8..steps as f64 + 0.2, (low..high).log_scale())?;
        axes(&mut chart.configure_mesh(), 0.15, 12)
            .axis_style(BLACK)
            .x_labels(steps.min(10))
            .y_labels(6)
            .x_desc("step")
            .y_desc("relative increment")
            .x_label_formatter(&|x| format!("{x:.0}"))
            .y_label_formatter(&|y| format!("{y:.0e}"))
            .draw()?;
        for (k, (_, values)) in engines.iter().enumerate() {
            let values = values.iter().map(|v| if *v > 0.0 { *v } else { low });
            let points = (1..).map(f64::from).zip(values);
            let points: Vec<_> = points.filter(|p| p.1 >= low && p.1 < MOST).collect();
            let colour = COLOURS[k % 4];
            let width = (2 * (engines.len() - k) - 1) as u32;
            chart.draw_series(LineSeries::new(points.clone(), colour.stroke_width(width)))?;
            let size = 2 + 2 * (engines.len() - k) as i32;
            let marks = points.into_iter();
            chart.draw_series(marks.map(|p| Circle::new(p, size, colour.stroke_width(1))))?;
        }
        Ok(())
    })
}

/// The ends of what is shown, with some room; never empty, and wide enough that rounding is no mountain.
fn padded(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    let finite = values.filter(|v| v.abs() < MOST);
    let (low, high) = finite.fold(ends, |e, v| (e.0.min(v), e.1.max(v)));
    if !(low <= high) {
        return (0.0, 1.0);
    }
    let size = low.abs().max(high.abs());
    let room = match high - low {
        _ if size < 1.0 / MOST => 1.0,
        spread if spread < 1e-9 * size => 0.1 * size,
        spread => 0.04 * spread,
    };
    (low - room, high + room)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_of_any_size_are_drawn() {
        for differences in [
            &[][..],
            &[0.0],
            &[1e-300, 1e-16, 3.0, f64::NAN, f64::INFINITY],
            &[1e5],
        ] {
            let html = histogram("h \"1\"", differences, 1e-12).unwrap();
            assert!(
                html.as_str()
                    .starts_with("<svg role=\"img\" aria-label=\"h &quot;1&quot;\"")
            );
        }
        let odd = [
            &[][..],
            &[0.0],
            &[1e-300, -1e-300],
            &[1e300, -1e300],
            &[f64::NAN, 1.0, 0.0],
            &[1.0, 1.0 + 1e-15],
            &[f64::INFINITY],
        ];
        for values in odd {
            assert!(histories("h", &[("a", values)]).is_ok());
            let s: Vec<f64> = (0..values.len()).map(|k| 0.5 + k as f64).collect();
            let zones = [(0.0, 1.0)];
            let curves = Curves {
                s: &s,
                values: vec![("a", values.to_vec())],
                zones: &zones[..s.len().min(1)],
                flips: &s,
                name: "u",
            };
            assert!(along_contact("c", "x", &[curves]).is_ok());
        }
    }
}
