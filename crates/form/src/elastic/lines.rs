//! A text that is generated from the lines of another one, so that an error in it is reported at the line that it comes from.

use faceoff_mesh::error::{Error, Place};

/// The generated text, and the origin of each of its lines.
#[derive(Debug, Clone, Default)]
pub struct Lines {
    /// The text, with line ends.
    pub text: String,
    /// For each line, the line that it comes from, and whether it is an exact copy of it.
    origins: Vec<(usize, bool)>,
}

impl Lines {
    /// Adds lines that are copied unchanged from the other text, the first of them from `line`.
    pub fn copy(&mut self, line: usize, text: &str) {
        for (k, part) in text.lines().enumerate() {
            self.text += part;
            self.text.push('\n');
            self.origins.push((line + k, true));
        }
    }

    /// Adds lines that are generated because of `line` of the other text.
    pub fn make(&mut self, line: usize, text: &str) {
        for part in text.lines() {
            self.text += part;
            self.text.push('\n');
            self.origins.push((line, false));
        }
    }

    /// An error in this text, at its place in the other text.
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
