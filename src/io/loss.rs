//! What a format cannot hold is never dropped in silence.

use std::path::Path;

use crate::error::{Error, Place, Result};

/// Gathers what a target format cannot hold.
#[derive(Default)]
pub struct Losses {
    /// Cells, groups, names, fields, labels: an error, or a warning each when the user allows it.
    losses: Vec<String>,
    /// What goes with a mesh without being part of it, such as the numbers of its points: a warning each.
    notes: Vec<String>,
}

impl Losses {
    pub fn lose(&mut self, what: impl Into<String>) {
        self.losses.push(what.into());
    }

    /// [`Losses::lose`] where `count` is not 0.
    pub fn lose_some(&mut self, count: usize, what: &str) {
        if count > 0 {
            self.lose(format!("{count} {what}"));
        }
    }

    pub fn note(&mut self, what: impl Into<String>) {
        self.notes.push(what.into());
    }

    /// The warnings to give.
    ///
    /// # Errors
    /// Something would be lost and `lossy` does not allow it.
    pub fn settle(self, path: &Path, format: &str, lossy: bool) -> Result<Vec<String>> {
        if lossy || self.losses.is_empty() {
            let lost = self
                .losses
                .into_iter()
                .map(|what| format!("{format} does not hold {what}"));
            return Ok(lost.chain(self.notes).collect());
        }
        let what = self.losses.join("; ");
        Err(Error::file(
            path,
            Place::Whole,
            format!("{format} cannot hold {what}"),
            "choose another format, or allow the loss with --lossy",
        ))
    }
}
