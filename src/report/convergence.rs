//! Observed orders of results.

use plotters::coord::Shift;
use plotters::coord::combinators::BindKeyPoints;
use plotters::prelude::*;
use serde::Serialize;

use super::drawing::{Drawing, Drawn, axes, decades, font, label};
use super::model::{Block, Cell, Figure, Report, Table, joined, table};
use crate::campaigns::convergence::{Convergence, Order};
use faceoff_mesh::error::Result;

/// As JSON has it.
#[derive(Serialize)]
struct Found<'a> {
    results: &'a [Convergence],
}

/// The report of the orders of all fields.
///
/// # Errors
/// None but of a broken installation.
pub fn convergence(all: &[Convergence]) -> Result<Report<'_>> {
    let named = |of: &Order| {
        of.fit
            .map_or("none".to_owned(), |fit| format!("{:.2}", fit.exponent))
    };
    let headline = joined(
        all.iter().map(|of| {
            let h1 = of
                .h1
                .as_ref()
                .map_or(String::new(), |h1| format!(", {} in H¹", named(h1)));
            format!("`{}` has order {} in L²{h1}", of.field, named(&of.l2))
        }),
        "; ",
    );
    let question = "faceoff orders --results: with which order do results converge?";
    let mut report = Report::new("orders", question, headline, &Found { results: all })?;
    report.blocks.push(orders_table(all).into());
    for of in all {
        report.blocks.push(levels_table(of).into());
        let picture = Figure {
            name: format!("orders-{}", of.field),
            caption: format!("Errors of {} over h.", of.field),
            picture: Box::new(Errors(of)),
        };
        report
            .blocks
            .push(Block::Page(vec![Block::Figure(picture)]));
    }
    report.inputs = all
        .first()
        .into_iter()
        .flat_map(|of| of.levels.iter().map(|l| (&l.file).into()))
        .collect();
    Ok(report)
}

/// One line a field and norm.
fn orders_table(all: &[Convergence]) -> Table {
    let norms = all.iter().flat_map(|of| {
        let h1 = of.h1.as_ref().map(|order| (of, "H¹", order));
        [(of, "L²", &of.l2)].into_iter().chain(h1)
    });
    let interval = |of: &Order| {
        of.interval
            .map(|[low, high]| format!("{low:.2} to {high:.2}"))
    };
    table!("Orders in h; the interval holds it with 95 % confidence where errors scatter about a power of h", norms, |(of, norm, order)|
        "field" => &of.field,
        "norm" => norm,
        "against" => of.against,
        "between meshes" => joined(order.steps.iter().map(|o| format!("{o:.2}")), " "),
        "fit" => order.fit.map(|fit| Cell::fixed(fit.exponent, 2)),
        "95 %" => interval(order),
    )
}

/// One line a result.
fn levels_table(of: &Convergence) -> Table {
    table!(format!("Errors of `{}`", of.field), &of.levels, |level|
        "result" => &level.file,
        "cells" => level.cells,
        "h" => level.h,
        "L² error" => level.norms.map(|n| n.l2),
        "H¹ error" => level.norms.and_then(|n| n.h1),
        "not in common" => level.alone.map(|[a, b]| a.max(b)),
    )
}

/// Errors over h, log-log.
struct Errors<'a>(&'a Convergence);

const COLOURS: [RGBColor; 2] = [RGBColor(0, 114, 178), RGBColor(213, 94, 0)];

impl Drawing for Errors<'_> {
    fn size(&self) -> (u32, u32) {
        (800, 640)
    }

    fn on<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawn<DB> {
        let points = |pick: fn(&faceoff_judge::Norms) -> Option<f64>| -> Vec<(f64, f64)> {
            let errors = self
                .0
                .levels
                .iter()
                .filter_map(|l| Some((l.h, pick(l.norms.as_ref()?)?)));
            errors.filter(|(_, e)| *e > 0.0).collect()
        };
        let lines = [("L²", points(|n| Some(n.l2))), ("H¹", points(|n| n.h1))];
        let all = || lines.iter().flat_map(|(_, points)| points.iter());
        if all().next().is_none() {
            return area.draw(&Text::new(
                "there is no error above zero",
                (60, 60),
                font(18),
            ));
        }
        let (hs, h_powers) = decades(all().map(|p| p.0));
        let (errors, error_powers) = decades(all().map(|p| p.1));
        let mut chart = ChartBuilder::on(area)
            .margin(20)
            .x_label_area_size(56)
            .y_label_area_size(76)
            .caption(format!("{}: L² blue, H¹ orange", self.0.field), font(20))
            .build_cartesian_2d(
                hs.log_scale().with_key_points(h_powers),
                errors.log_scale().with_key_points(error_powers),
            )?;
        axes(&mut chart.configure_mesh(), 0.12, 17)
            .label_style(font(15))
            .x_desc("h")
            .y_desc("error")
            .x_label_formatter(&|h| label(*h))
            .y_label_formatter(&|e| label(*e))
            .draw()?;
        for ((_, points), colour) in lines.iter().zip(COLOURS) {
            chart.draw_series(LineSeries::new(points.clone(), colour.stroke_width(2)))?;
            chart.draw_series(points.iter().map(|p| Circle::new(*p, 5, colour.filled())))?;
        }
        Ok(())
    }
}
