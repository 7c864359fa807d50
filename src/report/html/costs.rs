//! The cost of an accuracy with each code.

use super::Html;
use super::markup::html;
use super::tables::table;
use crate::campaigns::study::{Advice, Alternative, Norm, duration};
use crate::engine::unique;
use crate::report::model::{Cell, Column, Table};
use crate::text::number::{number, trimmed};
use crate::text::{Text, text};

/// The target accuracy, the cost of each code, and the command.
pub(in crate::report) fn costs<'a>(advice: &'a [Advice], scene: &str) -> Html {
    let advice: Vec<&Advice> = advice.iter().filter(|a| a.scene == scene).collect();
    let ways = |a: &'a Advice| [&a.best].into_iter().chain(&a.others);
    let engines = unique(advice.iter().flat_map(|a| ways(a).map(|way| &*way.engine)));
    let mut head = vec![Column::from(("w", "accuracy asked"))];
    head.extend(engines.iter().map(|name| Column::from(("w", *name))));
    head.push(("cmd", "command of the fastest").into());
    let rows = advice.into_iter().map(|a| {
        let norm = match a.norm {
            Norm::Energy if a.best.is_bound => "energy, certified",
            Norm::Energy => "energy",
            Norm::L2 => "L²",
        };
        let mut row = vec![Cell::number(
            a.target,
            text!("**{}** {norm}", percent_asked(a.target)),
        )];
        row.extend(engines.iter().map(|name| {
            let Some(way) = ways(a).find(|way| way.engine == *name) else {
                return "none measured".into();
            };
            let time = Text::from(duration(way.seconds));
            let time = match way.engine == a.best.engine {
                true => Text::strong(time),
                false => time,
            };
            let memory = way.memory_mb.map(|mb| format!(", {mb:.0} MB"));
            Cell {
                more: html! { small { (way.setting()) (within(way)) } },
                ..Cell::number(way.seconds, time.and(memory))
            }
        }));
        row.push(Text::code(&a.command).into());
        row
    });
    table(&Table::new("", head).with(rows))
}

fn within(way: &Alternative) -> &'static str {
    match way.is_repeatable {
        true => "",
        false => ", within this process",
    }
}

/// `5 %`, without insignificant digits.
pub(in crate::report) fn percent_asked(target: f64) -> String {
    format!("{} %", trimmed(&number(100.0 * target, 6)))
}
