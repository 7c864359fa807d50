//! What an accuracy costs with each code.

use super::Html;
use super::markup::{Column, Entry, Sheet, leaf, prose};
use crate::campaigns::study::{Advice, Norm, duration};
use crate::engine::unique;
use crate::report::number::{number, trimmed};

/// Accuracy asked, what each code needs for it, and the command.
pub(in crate::report) fn costs<'a>(advice: &'a [Advice], scene: &str) -> Html {
    let advice: Vec<&Advice> = advice.iter().filter(|a| a.scene == scene).collect();
    let ways = |a: &'a Advice| [&a.best].into_iter().chain(&a.others);
    let engines = unique(advice.iter().flat_map(|a| ways(a).map(|way| &*way.engine)));
    let mut sheet = Sheet::default();
    sheet.head.push(Column::new("w", prose("accuracy asked")));
    sheet
        .head
        .extend(engines.iter().map(|name| Column::new("w", prose(name))));
    sheet
        .head
        .push(Column::new("cmd", prose("command of the fastest")));
    for a in advice {
        let norm = match a.norm {
            Norm::Energy if a.best.is_bound => "energy, certified",
            Norm::Energy => "energy",
            Norm::L2 => "L²",
        };
        let asked = format!("**{}** {norm}", percent_asked(a.target));
        let mut row = vec![Entry::new(prose(asked), Some(a.target))];
        row.extend(engines.iter().map(|name| {
            let Some(way) = ways(a).find(|way| way.engine == *name) else {
                return Entry::words("none measured");
            };
            let time = duration(way.seconds);
            let time = if way.engine == a.best.engine {
                format!("**{time}**")
            } else {
                time
            };
            let memory = way
                .memory_mb
                .map_or(String::new(), |mb| format!(", {mb:.0} MB"));
            let setting = leaf("small", &[], way.setting());
            let told = Html::from([prose(time + &memory), setting]);
            Entry::new(told, Some(way.seconds))
        }));
        row.push(Entry::words(format!("`{}`", a.command)));
        sheet.rows.push((false, row));
    }
    sheet.html()
}

/// `5 %`, without digits that say nothing.
pub(in crate::report) fn percent_asked(target: f64) -> String {
    format!("{} %", trimmed(&number(100.0 * target, 6)))
}
