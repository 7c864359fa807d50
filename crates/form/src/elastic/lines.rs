//! A text that is made of lines of another, so that what is wrong in it can be told at its place there.

use faceoff_mesh::error::{Error, Place};

/// A text in the making.
#[derive(Debug, Clone, Default)]
pub struct Lines {
    /// With line ends.
    pub text: String,
    /// Of each line, the line that it comes from, and whether it stands there word for word.
    origins: Vec<(usize, bool)>,
}

impl Lines {
    /// Adds what stands in the other text from the start of a line on.
    pub fn copy(&mut self, line: usize, text: &str) {
        for (k, part) in text.lines().enumerate() {
            self.text += part;
            self.text.push('\n');
            self.origins.push((line + k, true));
        }
    }

    /// Adds what is made because of a line there.
    pub fn make(&mut self, line: usize, text: &str) {
        for part in text.lines() {
            self.text += part;
            self.text.push('\n');
            self.origins.push((line, false));
        }
    }

    /// An error in this text as one in the other.
    pub fn told(&self, error: Error) -> Error {
        let origin = |line: usize| self.origins.get(line.saturating_sub(1)).copied();
        match error {
            Error::File {
                path,
                place,
                what,
                remedy,
            } => {
                let place = match place {
                    Place::Column(line, column) => match origin(line) {
                        Some((line, true)) => Place::Column(line, column),
                        Some((line, false)) => Place::Line(line),
                        None => Place::Whole,
                    },
                    other => other,
                };
                Error::File {
                    path,
                    place,
                    what,
                    remedy,
                }
            }
            Error::Scene {
                scene,
                place,
                what,
                remedy,
            } => {
                let line = place.strip_prefix("line ").and_then(|n| n.parse().ok());
                let place = match line.and_then(origin) {
                    Some((line, _)) => format!("line {line}"),
                    None => place,
                };
                Error::Scene {
                    scene,
                    place,
                    what,
                    remedy,
                }
            }
            other => other,
        }
    }
}
