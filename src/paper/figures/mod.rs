//! The paper's figures from what was computed: each drawn once, as SVG and as PNG.

mod convergence;
mod elevation;

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

use super::study::Outcome;
use crate::error::{Error, Place, Result};

/// A figure of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Figure {
    /// Figure 1.
    Elevation,
    /// Figure 2.
    Convergence,
}

pub const FIGURES: [Figure; 2] = [Figure::Elevation, Figure::Convergence];

/// Registered with the font that the program carries; a viewer of SVG takes what it has.
const FONT: &str = "DejaVu Sans, sans-serif";

type Drawn<DB> = std::result::Result<(), DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;

impl Figure {
    /// The file's name without suffix.
    pub fn name(self) -> &'static str {
        match self {
            Figure::Elevation => "figure-1",
            Figure::Convergence => "figure-2",
        }
    }

    /// What is seen.
    pub fn caption(self, outcome: &Outcome) -> String {
        match self {
            Figure::Elevation => elevation::caption(outcome),
            Figure::Convergence => convergence::caption(outcome),
        }
    }

    fn size(self) -> (u32, u32) {
        match self {
            Figure::Elevation => (1000, 760),
            Figure::Convergence => (1500, 820),
        }
    }

    fn on<DB: DrawingBackend>(self, area: &DrawingArea<DB, Shift>, outcome: &Outcome) -> Drawn<DB> {
        area.fill(&WHITE)?;
        match self {
            Figure::Elevation => elevation::draw(area, outcome)?,
            Figure::Convergence => convergence::draw(area, outcome)?,
        }
        area.present()
    }
}

/// Draws a figure to `folder/NAME.svg` and `folder/NAME.png`.
///
/// # Errors
/// Files that cannot be written.
pub fn draw(figure: Figure, outcome: &Outcome, folder: &Path) -> Result<()> {
    let font = register_font(FONT, FontStyle::Normal, dejavu::sans::regular());
    let svg = folder.join(figure.name()).with_extension("svg");
    let png = folder.join(figure.name()).with_extension("png");
    if font.is_err() {
        return Err(failed(&svg, "the font that the program carries is no font"));
    }
    let area = SVGBackend::new(&svg, figure.size()).into_drawing_area();
    figure.on(&area, outcome).map_err(|e| failed(&svg, e))?;
    let area = BitMapBackend::new(&png, figure.size()).into_drawing_area();
    figure.on(&area, outcome).map_err(|e| failed(&png, e))
}

fn failed(path: &Path, why: impl std::fmt::Display) -> Error {
    let remedy = "check that the folder can be written to";
    Error::file(
        path,
        Place::Whole,
        format!("the figure cannot be drawn: {why}"),
        remedy,
    )
}

fn font(size: u32) -> TextStyle<'static> {
    (FONT, size).into_font().color(&BLACK)
}
