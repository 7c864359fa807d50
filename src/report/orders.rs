//! The report of observed orders and those of theory.

use std::collections::BTreeMap;

use super::html::{self, Axis, Chart, Html, Line, Slope, chart_figure};
use super::model::{Block, Cell, Report, Story, Table, count, joined, table};
use crate::campaigns::orders::{Limit, Orders, Reach, Theory};
use crate::engine::unique;
use crate::run::Observed;
use crate::text::{Text, text};
use faceoff_fem::contact::Errors;
use faceoff_mesh::error::Result;

/// The report of all orders.
///
/// # Errors
/// Only those of a broken installation.
pub fn orders(all: &[Orders]) -> Result<Report<'_>> {
    let verdicts = all
        .iter()
        .flat_map(|o| [o.h1_verdict, o.l2_verdict])
        .flatten();
    let of = |wanted: Reach| verdicts.clone().filter(|v| *v == wanted).count();
    let known = verdicts.clone().count();
    // Without a theoretical order, or at rounding.
    let open = match 2 * all.len() - known {
        0 => String::new(),
        open => format!(", {open} with nothing to judge"),
    };
    let question = "faceoff orders: does every method converge as theory says?";
    let found = BTreeMap::from([("orders", all)]);
    let mut report = Report::new("orders", question, "", &found)?;
    let h1 = in_norm("H¹", all, |o| {
        let theory = o.theory.as_ref().map(|t| ("", t.h1, t.h1_limited_by));
        (&o.h1, theory, o.h1_verdict, |e| e.h1)
    });
    let l2 = in_norm("L²", all, |o| {
        let theory = o.theory.as_ref().map(|t| ("≥ ", t.l2, t.l2_limited_by));
        (&o.l2, theory, o.l2_verdict, |e| e.l2)
    });
    let below: Vec<String> = all
        .iter()
        .filter(|o| [o.h1_verdict, o.l2_verdict].contains(&Some(Reach::Below)))
        .map(|o| format!("{} by {}", o.scene, o.method))
        .collect();
    let claim = match (known, &below[..]) {
        (0, _) => "Observed orders, of which no theory is known".into(),
        (_, []) => text!(
            "**{} of {}** as theory has them",
            of(Reach::AsTheory),
            count(2 * all.len(), "order")
        ),
        (_, some) => text!(
            "**{}** below theory: {}",
            count(some.len(), "order"),
            some.join(", ")
        ),
    };
    let rests_on = match (known, of(Reach::NotSettled), of(Reach::Below)) {
        (0, ..) => Text::default(),
        (_, 0, 0) => text!(
            "None is below theory, and all that theory knows are settled on these meshes{open}."
        ),
        (_, unsettled, below) => {
            text!("{unsettled} are not settled on these meshes, {below} are below theory{open}.")
        }
    };
    report.notes.push("Errors are relative to the norms of u; an order is the slope between two meshes, the fit that of the last ones.".into());
    let levels = all.iter();
    let levels = levels.flat_map(|o| o.levels.iter().map(move |l| (o, l)));
    let levels = table!("Errors relative to the norms of u", levels, |(o, l)|
        "scene" => &o.scene,
        "method" => &o.method,
        "n" => l.n,
        "dofs" => l.dofs,
        "steps" => l.steps,
        "H¹ error" => l.errors.h1,
        "L² error" => l.errors.l2,
        "remark" => if l.converged { "" } else { "not converged" },
    );
    let heading = Block::heading(2, "One row per scene and method");
    let folded = Block::folded("Every mesh", "", vec![levels.into()]);
    report.story = Story {
        claim,
        rests_on,
        picture: vec![Block::drawn(|| figures(all))],
        next: Vec::new(),
        rest: vec![
            Block::Page(vec![heading]),
            h1.into(),
            l2.into(),
            Block::Page(vec![folded]),
        ],
    };
    Ok(report)
}

/// A norm: an error in it, the fitted order, and that of theory.
type Norm = (
    fn(&Errors) -> f64,
    fn(&Orders) -> Option<f64>,
    fn(&Theory) -> f64,
);

/// For each scene the errors of its methods in both norms.
fn figures(all: &[Orders]) -> Html {
    let h1: Norm = (|e| e.h1, |o| o.h1.fit, |t| t.h1);
    let l2: Norm = (|e| e.l2, |o| o.l2.fit, |t| t.l2);
    let scenes = unique(all.iter().map(|o| &*o.scene)).into_iter();
    let pictures = scenes.map(|scene| {
        let of = || all.iter().filter(|o| o.scene == scene);
        let panels = [("H¹", h1), ("L²", l2)].map(|(norm, (error, fit, theory))| {
            let line = |o: &Orders| {
                let levels = o.levels.iter().filter(|l| l.converged);
                let errors = levels.map(|l| [l.n as f64, error(&l.errors)]);
                (o.method.clone(), errors.collect(), fit(o))
            };
            let theories = of().filter_map(|o| Some(theory(o.theory.as_ref()?)));
            over_n(norm, of().map(line), theories)
        });
        let caption = text!("**{scene}**: the relative error over n, and the order that fits");
        orders_figure(caption, panels.into(), html::WIDEST)
    });
    pictures.collect()
}

/// Errors over the refinements of the meshes, each line with its name and the fitted order; dotted the least and the largest
/// theoretical order.
pub(super) fn over_n(
    name: &str,
    lines: impl Iterator<Item = (String, Vec<[f64; 2]>, Option<f64>)>,
    theories: impl Iterator<Item = f64>,
) -> Chart {
    let lines = lines.enumerate().map(|(k, (name, errors, fit))| Line {
        about: fit.map_or(String::new(), |fit| format!("{fit:.2}")),
        ..Line::new(&name, k, errors)
    });
    let lines: Vec<Line> = lines.collect();
    let points = lines.iter().flat_map(|line| &line.points);
    let mut at: Vec<f64> = points.map(|p| p.at[0]).collect();
    at.sort_by(f64::total_cmp);
    at.dedup();
    let mut orders: Vec<f64> = theories.filter(|o| *o > 0.0).collect();
    orders.sort_by(f64::total_cmp);
    let slope = |order: &f64| Slope {
        power: -order,
        name: format!("order {order}"),
    };
    let ends = unique([orders.first(), orders.last()].into_iter().flatten());
    Chart {
        name: name.to_owned(),
        x: Axis {
            at: at.into_iter().map(|n| (n, n.to_string())).collect(),
            ..Axis::new("n")
        },
        y: Axis::new("error"),
        lines,
        slopes: ends.into_iter().map(slope).collect(),
        ..Chart::default()
    }
}

/// Such panels with their caption.
pub(super) fn orders_figure(caption: Text, panels: Vec<Chart>, widest: f64) -> Html {
    let has_theory = panels.iter().any(|panel| !panel.slopes.is_empty());
    let dotted = has_theory.then_some("; dotted: orders of theory");
    chart_figure(&caption.and(Text::from(dotted)), &panels, widest)
}

type Order<'a> = (
    &'a Observed,
    Option<(&'static str, f64, Limit)>,
    Option<Reach>,
    fn(&Errors) -> f64,
);

/// One line per scene and method.
fn in_norm<'a>(norm: &str, all: &'a [Orders], of: impl Fn(&'a Orders) -> Order<'a>) -> Table {
    let last = |o: &Orders, error: fn(&Errors) -> f64| match o.levels.last()? {
        level if level.converged => Some(Cell::from(error(&level.errors))),
        _ => Some("not converged".into()),
    };
    let theory = |theory: Option<(&str, f64, Limit)>| match theory {
        Some((at_least, order, limit)) => format!("{at_least}{order}, {limit}"),
        None => "unknown".into(),
    };
    let verdict = |verdict| match verdict {
        Reach::AsTheory => "as theory",
        Reach::NotSettled => "not settled",
        Reach::Below => "below",
    };
    let caption =
        format!("{norm}: the error on the finest mesh, relative to the norm of u, and its orders");
    let rows = all.iter().map(|o| (o, of(o)));
    table!(caption, rows, |(o, (observed, promised, reach, error))|
        "scene" => &o.scene,
        "method" => &o.method,
        "n" => joined(o.levels.iter().map(|l| l.n.to_string()), " "),
        "error" => last(o, error),
        "orders" => joined(observed.steps.iter().map(|o| format!("{o:.2}")), " "),
        "fit" => observed.fit.map(|fit| Cell::fixed(fit, 2)),
        "theory" => theory(promised),
        "verdict" => reach.map(verdict),
    )
}
