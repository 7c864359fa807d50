//! The map as figures: a line an extreme, a column a method, a colour what became of it, or how rounding is amplified.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::{amplified, find, lines, methods, word};
use crate::campaigns::stress::{Behaviour, Entry, StressOutcome};
use crate::report::drawing::{Drawing, Drawn, font};
use crate::report::model::Figure;

const LABELS: i32 = 420;
const WIDTH: i32 = 110;
const HEIGHT: i32 = 22;
const TOP: i32 = 60;

struct Map<'a> {
    outcome: &'a StressOutcome,
    engine: &'a str,
    lines: Vec<(&'a str, &'a str)>,
    methods: Vec<&'a str>,
    /// What a cell says, and its colour.
    shown: fn(&Entry) -> (String, RGBColor),
}

/// What became of each trial.
pub fn map<'a>(outcome: &'a StressOutcome, engine: &'a str) -> Figure<'a> {
    let shown = |cell: &Entry| (word(&cell.verdict), colour(&cell.verdict));
    let caption = format!("What becomes of each extreme by {engine}.");
    figure("map", caption, outcome, engine, shown)
}

/// How rounding is amplified at each answer.
pub fn conditions<'a>(outcome: &'a StressOutcome, engine: &'a str) -> Figure<'a> {
    let shown = |cell: &Entry| (amplified(cell), heat(cell.condition));
    let caption = format!("Condition estimates of the answers by {engine}.");
    figure("condition", caption, outcome, engine, shown)
}

fn figure<'a>(
    name: &str,
    caption: String,
    outcome: &'a StressOutcome,
    engine: &'a str,
    shown: fn(&Entry) -> (String, RGBColor),
) -> Figure<'a> {
    let picture = Box::new(Map {
        outcome,
        engine,
        lines: lines(outcome, engine),
        methods: methods(outcome, engine),
        shown,
    });
    Figure {
        name: format!("{name}-{engine}"),
        caption,
        picture,
    }
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
                let (words, colour) = (self.shown)(cell);
                area.draw(&Rectangle::new(corners, colour.filled()))?;
                area.draw(&Text::new(words, (x + 8, y + 3), font(14)))?;
            }
        }
        Ok(())
    }
}

/// Pale for what holds, from yellow to orange by decades of what is lost, grey for words, dark red for what is wrong.
fn colour(verdict: &Behaviour) -> RGBColor {
    match verdict {
        Behaviour::Holds => RGBColor(200, 230, 201),
        Behaviour::Degrades { factor } => warm(factor.log10() / 6.0),
        Behaviour::Refuses { .. } => RGBColor(207, 216, 220),
        Behaviour::Wrong { .. } => RGBColor(229, 57, 53),
    }
}

/// Yellow to orange by decades, to where no digit is left; grey where there is no answer.
fn heat(condition: Option<f64>) -> RGBColor {
    condition.map_or(RGBColor(207, 216, 220), |c| {
        warm(c.log10() / -f64::EPSILON.log10())
    })
}

/// From pale yellow at 0 to orange at 1.
fn warm(share: f64) -> RGBColor {
    let share = share.clamp(0.0, 1.0);
    RGBColor(
        255,
        (240.0 - 110.0 * share) as u8,
        (180.0 - 140.0 * share) as u8,
    )
}
