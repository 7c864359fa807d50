//! The paper's figures from what was computed.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::{convergence, elevation};
use crate::campaigns::paper::PaperOutcome;
use crate::report::drawing::{Drawing, Drawn};
use crate::report::model::Figure;

/// Figure 1 of an outcome.
struct Elevation<'a>(&'a PaperOutcome);

/// Figure 2.
struct Convergence<'a>(&'a PaperOutcome);

impl Drawing for Elevation<'_> {
    fn size(&self) -> (u32, u32) {
        (1000, 760)
    }

    fn on<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawn<DB> {
        elevation::draw(area, self.0)
    }
}

impl Drawing for Convergence<'_> {
    fn size(&self) -> (u32, u32) {
        (1500, 820)
    }

    fn on<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawn<DB> {
        convergence::draw(area, self.0)
    }
}

/// Both.
pub fn figures(outcome: &PaperOutcome) -> [Figure<'_>; 2] {
    [
        Figure {
            name: "figure-1".into(),
            caption: elevation::caption(outcome),
            picture: Box::new(Elevation(outcome)),
        },
        Figure {
            name: "figure-2".into(),
            caption: convergence::caption(outcome),
            picture: Box::new(Convergence(outcome)),
        },
    ]
}
