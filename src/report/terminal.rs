//! A report on the terminal.

use std::fmt::Write as _;

use comfy_table::{CellAlignment, ContentArrangement, presets};

use super::model::{Block, Report, Table};
use crate::text::Text;

/// The parts for a terminal, without the answer, which is printed last.
pub fn text(report: &Report) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write(&mut text, &report.story.rest);
    // If the claim is the answer, its evidence is not printed elsewhere.
    let because = &report.story.rests_on;
    if report.verdict.is_none() && report.headline.is_empty() && !because.is_empty() {
        let _ = writeln!(text, "{because}");
    }
    text
}

fn write(text: &mut String, blocks: &[Block]) -> std::fmt::Result {
    for block in blocks {
        match block {
            Block::Heading(_, words) => writeln!(text, "{words}\n")?,
            Block::Text(words) => writeln!(text, "{words}")?,
            Block::List(items) => {
                for item in items {
                    writeln!(text, "- {item}")?;
                }
            }
            Block::Commands(lines) => {
                for line in lines {
                    writeln!(text, "  {line}")?;
                }
            }
            Block::Facts(facts) => {
                let names: Vec<String> = facts.iter().map(|(name, _)| name.to_string()).collect();
                let lengths = names.iter().map(|name| name.chars().count());
                let width = lengths.max().unwrap_or(0);
                for (name, (_, fact)) in names.iter().zip(facts) {
                    writeln!(text, "  {name:<width$}  {fact}")?;
                }
            }
            Block::Table(table) => write_table(text, &table.caption, table)?,
            Block::Titled(words, table) => write_table(text, words, table)?,
            Block::Folded([name, about], inner) => {
                let dot = if about.is_empty() { "" } else { " · " };
                writeln!(text, "{name}{dot}{about}")?;
                write(text, inner)?;
            }
            Block::Terminal(inner) => write(text, inner)?,
            Block::Figure(_) | Block::Beside(_) | Block::Page(_) | Block::Drawn(_) => {}
        }
    }
    Ok(())
}

fn write_table(text: &mut String, caption: &Text, table: &Table) -> std::fmt::Result {
    if !caption.is_empty() {
        writeln!(text, "{caption}")?;
    }
    let mut shown = comfy_table::Table::new();
    shown.load_style(presets::NOTHING);
    // The width of a terminal; elsewhere the necessary width.
    shown.set_content_arrangement(ContentArrangement::Dynamic);
    let columns: Vec<usize> = (0..table.head.len())
        .filter(|k| table.fits_terminal(*k))
        .collect();
    shown.set_header(columns.iter().map(|k| table.head[*k].name.to_string()));
    for row in &table.rows {
        shown.add_row(columns.iter().map(|k| row[*k].text()));
    }
    for (k, column) in columns.iter().zip(shown.column_iter_mut()) {
        column.set_cell_alignment(match table.is_numeric(*k) {
            true => CellAlignment::Right,
            false => CellAlignment::Left,
        });
    }
    for line in shown.lines() {
        writeln!(text, "{}", line.trim_end())?;
    }
    writeln!(text)
}
