//! The paper's figures from what was computed: each drawn once, as SVG and as PNG.

mod convergence;
mod elevation;

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;

use super::study::PaperOutcome;
use crate::drawing::{self, Drawing, Drawn, font};
use faceoff_mesh::error::Result;

/// A figure of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Figure {
    /// Figure 1.
    Elevation,
    /// Figure 2.
    Convergence,
}

pub const FIGURES: [Figure; 2] = [Figure::Elevation, Figure::Convergence];

impl Figure {
    /// The file's name without suffix.
    pub fn name(self) -> &'static str {
        match self {
            Figure::Elevation => "figure-1",
            Figure::Convergence => "figure-2",
        }
    }

    /// What is seen.
    pub fn caption(self, outcome: &PaperOutcome) -> String {
        match self {
            Figure::Elevation => elevation::caption(outcome),
            Figure::Convergence => convergence::caption(outcome),
        }
    }
}

/// A figure of one outcome.
struct Of<'a>(Figure, &'a PaperOutcome);

impl Drawing for Of<'_> {
    fn size(&self) -> (u32, u32) {
        match self.0 {
            Figure::Elevation => (1000, 760),
            Figure::Convergence => (1500, 820),
        }
    }

    fn on<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawn<DB> {
        match self.0 {
            Figure::Elevation => elevation::draw(area, self.1),
            Figure::Convergence => convergence::draw(area, self.1),
        }
    }
}

/// Draws a figure to `folder/NAME.svg` and `folder/NAME.png`.
///
/// # Errors
/// Files that cannot be written.
pub fn draw(figure: Figure, outcome: &PaperOutcome, folder: &Path) -> Result<()> {
    drawing::draw(&Of(figure, outcome), folder, figure.name())
}
