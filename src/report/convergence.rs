//! The report of observed orders of results.

use std::collections::BTreeMap;

use super::html::{Axis, Chart, Line, Slope, charts};
use super::model::{Block, Cell, Figure, Report, Table, joined, table};
use crate::run::convergence::{Convergence, Order};
use crate::text::number::superscript;
use crate::text::{Text, text};
use faceoff_mesh::error::Result;

/// The report of the orders of all fields.
///
/// # Errors
/// Only those of a broken installation.
pub fn convergence(all: &[Convergence]) -> Result<Report<'_>> {
    let named = |of: &Order| {
        of.fit
            .map_or("none".to_owned(), |fit| format!("{:.2}", fit.exponent))
    };
    let headline = Text::joined(
        all.iter().map(|of| {
            let h1 = of.h1.as_ref().map(|h1| format!(", {} in H¹", named(h1)));
            text!("`{of.field}` has order {} in L²{h1}", named(&of.l2))
        }),
        "; ",
    );
    let question = "faceoff orders --results: with which order do results converge?";
    let found = BTreeMap::from([("results", all)]);
    let mut report = Report::new("orders", question, headline, &found)?;
    report.story.rest.push(orders_table(all).into());
    for of in all {
        report.story.rest.push(levels_table(of).into());
        let picture = Figure {
            name: format!("orders-{}", of.field),
            caption: text!("**Errors of {of.field}** over h. Dotted: the nearest whole order"),
            picture: Box::new(|width| charts("errors over h", &panels(of), width)),
        };
        report
            .story
            .rest
            .push(Block::Page(vec![Block::Figure(picture)]));
    }
    let limiting = all
        .iter()
        .filter_map(|of| Some((of, of.limiting.as_ref()?)));
    let limiting = limiting.map(|(of, found)| text!("In `{of.field}` {}.", found.words()));
    report.story.rests_on = Text::joined(limiting, " ");
    report.inputs = all
        .first()
        .into_iter()
        .flat_map(|of| of.levels.iter().map(|l| (&l.file).into()))
        .collect();
    Ok(report)
}

/// One line per field and norm.
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

/// One line per result.
fn levels_table(of: &Convergence) -> Table {
    table!(text!("Errors of `{of.field}`"), &of.levels, |level|
        "result" => &level.file,
        "cells" => level.cells,
        "h" => level.h,
        "L² error" => level.norms.map(|n| n.l2),
        "H¹ error" => level.norms.and_then(|n| n.h1),
        "not in common" => level.alone.map(|[a, b]| a.max(b)),
    )
}

/// Errors over h, one panel per norm.
fn panels(of: &Convergence) -> Vec<Chart> {
    type Pick = fn(&faceoff_judge::Norms) -> Option<f64>;
    let panel = |norm: &str, pick: Pick, order: &Order| {
        let errors = of.levels.iter();
        let errors = errors.filter_map(|l| Some([l.h, pick(l.norms.as_ref()?)?]));
        let power = order
            .fit
            .map(|fit| fit.exponent.round())
            .filter(|p| *p >= 1.0);
        let name = |p: f64| match p as i32 {
            1 => "h".to_owned(),
            p => format!("h{}", superscript(p)),
        };
        let fit = order.fit.map(|fit| format!("order {:.2}", fit.exponent));
        let line = Line::new(&fit.unwrap_or_default(), 0, errors);
        Chart {
            name: format!("{}, {norm}", of.field),
            x: Axis::new("h"),
            y: Axis::new("error"),
            lines: vec![line],
            slopes: Vec::from_iter(power.map(|power| Slope {
                power,
                name: name(power),
            })),
            ..Chart::default()
        }
    };
    let h1 = of.h1.as_ref().map(|h1| panel("H¹", |n| n.h1, h1));
    let l2 = panel("L²", |n| Some(n.l2), &of.l2);
    [l2].into_iter().chain(h1).collect()
}
