//! The map as a figure: a line an extreme, a column a method, a colour what became of it.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;

use super::text::{find, lines, methods, word};
use super::{Outcome, Verdict};
use crate::drawing::{self, Drawing, Drawn, font};
use crate::error::Result;

const LABELS: i32 = 420;
const WIDTH: i32 = 110;
const HEIGHT: i32 = 22;
const TOP: i32 = 60;

struct Map<'a> {
    outcome: &'a Outcome,
    engine: &'a str,
    lines: Vec<(&'a str, &'a str)>,
    methods: Vec<&'a str>,
}

/// Draws `map-ENGINE.svg` and `.png` of every engine.
///
/// # Errors
/// Files that cannot be written.
pub fn draw(outcome: &Outcome, folder: &Path) -> Result<()> {
    for (engine, _) in &outcome.engines {
        let map = Map {
            outcome,
            engine,
            lines: lines(outcome, engine),
            methods: methods(outcome, engine),
        };
        drawing::draw(&map, folder, &format!("map-{engine}"))?;
    }
    Ok(())
}

impl Drawing for Map<'_> {
    fn size(&self) -> (u32, u32) {
        let width = LABELS + WIDTH * self.methods.len() as i32 + 20;
        let height = TOP + HEIGHT * self.lines.len() as i32 + 20;
        (width as u32, height as u32)
    }

    fn on<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawn<DB> {
        area.draw(&Text::new(self.engine.to_owned(), (12, 20), font(20)))?;
        for (m, method) in self.methods.iter().enumerate() {
            let x = LABELS + WIDTH * m as i32;
            area.draw(&Text::new((*method).to_owned(), (x + 8, 24), font(16)))?;
        }
        let mut last = "";
        for (l, &(family, value)) in self.lines.iter().enumerate() {
            let y = TOP + HEIGHT * l as i32;
            if family != last {
                area.draw(&Text::new(family.to_owned(), (12, y + 3), font(14)))?;
                area.draw(&PathElement::new(
                    vec![(12, y - 1), (self.size().0 as i32 - 20, y - 1)],
                    BLACK.mix(0.5),
                ))?;
                last = family;
            }
            area.draw(&Text::new(value.to_owned(), (170, y + 3), font(14)))?;
            for (m, method) in self.methods.iter().enumerate() {
                let Some(cell) = find(self.outcome, self.engine, (family, value), method) else {
                    continue;
                };
                let x = LABELS + WIDTH * m as i32;
                let corners = [(x + 1, y + 1), (x + WIDTH - 1, y + HEIGHT - 1)];
                area.draw(&Rectangle::new(corners, colour(&cell.verdict).filled()))?;
                area.draw(&Text::new(word(&cell.verdict), (x + 8, y + 3), font(14)))?;
            }
        }
        Ok(())
    }
}

/// Pale for what holds, from yellow to orange by decades of what is lost, grey for words, dark red for what is wrong.
fn colour(verdict: &Verdict) -> RGBColor {
    match verdict {
        Verdict::Holds => RGBColor(200, 230, 201),
        Verdict::Degrades { factor } => {
            let share = (factor.log10() / 6.0).clamp(0.0, 1.0);
            RGBColor(
                255,
                (240.0 - 110.0 * share) as u8,
                (180.0 - 140.0 * share) as u8,
            )
        }
        Verdict::Refuses { .. } => RGBColor(207, 216, 220),
        Verdict::Wrong { .. } => RGBColor(229, 57, 53),
    }
}
