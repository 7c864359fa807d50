//! Observed orders beside theory.

use serde::Serialize;

use super::model::{Block, Cell, Report, Table, cells, count};
use crate::campaigns::orders::{Limit, Orders, Reach};
use crate::run::Observed;
use faceoff_fem::contact::Errors;
use faceoff_mesh::error::Result;

/// As JSON has it.
#[derive(Serialize)]
struct Found<'a> {
    orders: &'a [Orders],
}

/// The report of all orders.
///
/// # Errors
/// None but of a broken installation.
pub fn orders(all: &[Orders]) -> Result<Report<'_>> {
    let verdicts = all
        .iter()
        .flat_map(|o| [o.h1_verdict, o.l2_verdict])
        .flatten();
    let of = |wanted: Reach| verdicts.clone().filter(|v| *v == wanted).count();
    let headline = match verdicts.clone().count() {
        0 => "no theory is known of these solutions beside the orders".to_owned(),
        _ => format!(
            "{}: {} as theory, {} not settled, {} below",
            count(verdicts.clone().count(), "order"),
            of(Reach::AsTheory),
            of(Reach::NotSettled),
            of(Reach::Below)
        ),
    };
    let question = "faceoff orders: does every method converge as theory says?";
    let mut report = Report::new("orders", question, headline, &Found { orders: all })?;
    report.blocks.push(
        table("H¹", all, |o| {
            let theory = o.theory.as_ref().map(|t| ("", t.h1, t.h1_limited_by));
            (&o.h1, theory, o.h1_verdict, |e| e.h1)
        })
        .into(),
    );
    report.blocks.push(
        table("L²", all, |o| {
            let theory = o.theory.as_ref().map(|t| ("≥ ", t.l2, t.l2_limited_by));
            (&o.l2, theory, o.l2_verdict, |e| e.l2)
        })
        .into(),
    );
    let levels = all.iter().flat_map(|o| {
        o.levels.iter().map(move |l| {
            let reached = if l.converged { "" } else { "not converged" };
            cells![
                &o.scene,
                &o.method,
                l.n,
                l.dofs,
                l.steps,
                l.errors.h1,
                l.errors.l2,
                reached
            ]
        })
    });
    let head = [
        "scene",
        "method",
        "n",
        "dofs",
        "steps",
        "H¹ error",
        "L² error",
        "remark",
    ];
    let levels = Table::new("Errors relative to the norms of u", &head).with(levels);
    let folded = Block::Folded("Every mesh".into(), vec![levels.into()]);
    report.blocks.push(Block::Page(vec![folded]));
    Ok(report)
}

type Order<'a> = (
    &'a Observed,
    Option<(&'static str, f64, Limit)>,
    Option<Reach>,
    fn(&Errors) -> f64,
);

/// One line a scene and method.
fn table<'a>(norm: &str, all: &'a [Orders], of: impl Fn(&'a Orders) -> Order<'a>) -> Table {
    let rows = all.iter().map(|o| {
        let (observed, theory, verdict, error) = of(o);
        let n: Vec<String> = o.levels.iter().map(|l| l.n.to_string()).collect();
        let last = o.levels.last().map(|level| match level.converged {
            true => Cell::from(error(&level.errors)),
            false => "not converged".into(),
        });
        let steps: Vec<String> = observed.steps.iter().map(|o| format!("{o:.2}")).collect();
        let theory = theory.map(|(at_least, order, limit)| format!("{at_least}{order}, {limit}"));
        let verdict = verdict.map(|verdict| match verdict {
            Reach::AsTheory => "as theory",
            Reach::NotSettled => "not settled",
            Reach::Below => "below",
        });
        cells![
            &o.scene,
            &o.method,
            n.join(" "),
            last,
            steps.join(" "),
            observed.fit.map(|fit| Cell::fixed(fit, 2)),
            theory.unwrap_or("unknown".into()),
            verdict,
        ]
    });
    let caption =
        format!("{norm}: the error on the finest mesh, relative to the norm of u, and its orders");
    let head = [
        "scene", "method", "n", "error", "orders", "fit", "theory", "verdict",
    ];
    Table::new(caption, &head).with(rows)
}
