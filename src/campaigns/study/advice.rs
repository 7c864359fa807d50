//! Advice: for an error that is wanted, what was measured to reach it in the least time, and the command that does it again.
//! Nothing is interpolated: `targets` has measured each of these settings as it is advised.

use serde::Serialize;

use super::StudyRequest;
use super::row::{Row, Varied};
use super::subject::Subject;
use crate::engine::{self, quoted};
use faceoff_fem::contact::Stop;

/// What error is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Norm {
    /// ‖∇(u-u_h)‖_h / ‖∇u‖
    Energy,
    /// ‖u-u_h‖ / ‖u‖
    L2,
}

/// The norms that advice is given for.
pub const NORMS: [Norm; 2] = [Norm::Energy, Norm::L2];
/// Errors that advice is given for.
pub const TARGETS: [f64; 10] = [0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 1e-4, 1e-5];

/// How to reach an error.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Advice {
    /// Its name.
    pub scene: String,
    /// In which the error is meant.
    pub norm: Norm,
    /// The error that is wanted.
    pub target: f64,
    /// The one that took the least time.
    pub best: Alternative,
    /// The best of every other engine.
    pub others: Vec<Alternative>,
    /// Word for word.
    pub command: String,
}

/// One engine's way, as it was measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alternative {
    /// Its name.
    pub engine: String,
    /// Its name.
    pub method: String,
    /// Of a uniform mesh.
    pub n: Option<usize>,
    /// The certified accuracy of an adapted one.
    pub accuracy: Option<f64>,
    /// Relative increment at which the iteration stops.
    pub tolerance: f64,
    /// Relative to u.
    pub error: f64,
    /// Is the error the guaranteed bound, for want of the true one?
    pub is_bound: bool,
    /// The median of its repetitions, without start-up, or that of a finer mesh which took less.
    pub seconds: f64,
    /// As [`Row::memory_mb`].
    pub memory_mb: Option<f64>,
}

impl Alternative {
    fn new(row: &Row, norm: Norm, seconds: f64) -> Option<Self> {
        Some(Alternative {
            engine: row.engine.clone(),
            method: row.method.clone(),
            n: row.n,
            accuracy: row.accuracy,
            tolerance: row.tolerance,
            error: row.error(norm)?,
            is_bound: norm == Norm::Energy && row.h1.is_none(),
            seconds,
            memory_mb: row.memory_mb,
        })
    }

    /// `cr-fc, n = 40, tolerance 1e-4`
    pub fn setting(&self) -> String {
        let mut text = self.method.clone();
        if let Some(n) = self.n {
            text += &format!(", n = {n}");
        }
        if let Some(accuracy) = self.accuracy {
            text += &format!(", adapted to {} % certified", percent(accuracy));
        }
        if self.tolerance != Stop::default().increment {
            text += &format!(", tolerance {:e}", self.tolerance);
        }
        text
    }
}

/// Advice for every target that some measured row reaches.
pub fn advise(request: &StudyRequest, rows: &[Row]) -> Vec<Advice> {
    let mut all = Vec::new();
    for subject in &request.subjects {
        for norm in NORMS {
            for target in TARGETS {
                all.extend(one(request, rows, subject, norm, target));
            }
        }
    }
    all
}

fn one(
    request: &StudyRequest,
    rows: &[Row],
    subject: &Subject,
    norm: Norm,
    target: f64,
) -> Option<Advice> {
    let reaches = |row: &&Row| {
        row.scene == subject.scene.name()
            && row.converged
            && row.error(norm).is_some_and(|error| error <= target)
    };
    // Other engines are asked for no mesh of their own.
    let counts = |row: &&Row| {
        let varied = if row.engine == engine::OWN {
            Varied::Target
        } else {
            Varied::Mesh
        };
        row.varied == varied
    };
    let measured: Vec<&Row> = rows.iter().filter(counts).collect();
    let mut fast: Vec<&Row> = measured.iter().copied().filter(reaches).collect();
    fast.sort_by(|a, b| cost(a, &measured).total_cmp(&cost(b, &measured)));
    let mut kept: Vec<&Row> = Vec::new();
    for row in fast {
        if kept.iter().all(|other| other.engine != row.engine) {
            kept.push(row);
        }
    }
    let best = *kept.first()?;
    let others = kept[1..].iter();
    Some(Advice {
        scene: subject.scene.name().to_owned(),
        norm,
        target,
        best: Alternative::new(best, norm, cost(best, &measured))?,
        others: others
            .filter_map(|row| Alternative::new(row, norm, cost(row, &measured)))
            .collect(),
        command: format!("faceoff {}", quoted(words(request, subject, best))),
    })
}

/// The least time in which a row's mesh or a finer one was solved in the same way: noise makes no mesh dearer than a finer one.
fn cost(row: &Row, measured: &[&Row]) -> f64 {
    let way = |row: &Row| (row.accuracy.is_some(), row.tolerance);
    let alike = |other: &&&Row| {
        other.track() == row.track() && way(other) == way(row) && other.cells >= row.cells
    };
    let times = measured.iter().filter(alike).map(|of| of.seconds.median);
    times.fold(row.seconds.median, f64::min)
}

/// What is typed after the program's name to solve as a row was.
pub fn words(request: &StudyRequest, subject: &Subject, row: &Row) -> Vec<String> {
    let mut words: Vec<String> = vec!["solve".into(), subject.argument.clone()];
    let mut add = |option: &str, value: String| words.extend([option.to_owned(), value]);
    add("--method", row.method.clone());
    if let Some(n) = row.n {
        add("--n", n.to_string());
    }
    if let Some(accuracy) = row.accuracy {
        add("--accuracy", format!("{accuracy:e}"));
        add("--way", "adaptive".into());
    }
    let stop = request.settings.stop;
    if row.engine != engine::OWN {
        add("--engine", row.engine.clone());
    }
    if row.tolerance != Stop::default().increment {
        add("--tolerance", format!("{:e}", row.tolerance));
    }
    if stop.max_iterations != Stop::default().max_iterations {
        add("--max-iterations", stop.max_iterations.to_string());
    }
    if row.accuracy.is_some() {
        words.push("--certify=u_h".into());
    }
    if subject.is_trusted {
        words.push("--allow-outside".into());
    }
    words
}

impl Advice {
    /// "1 % energy error: cr-fc, n = 40, tolerance 1e-4: 6.1 ms, 9 MB; freefem (cr, n = 64) needs 0.9 s"
    pub fn sentence(&self) -> String {
        let best = &self.best;
        let norm = match self.norm {
            Norm::Energy if best.is_bound => "certified energy error",
            Norm::Energy => "energy error",
            Norm::L2 => "L² error",
        };
        let engine = match best.engine.as_str() {
            engine::OWN => String::new(),
            name => format!("{name} "),
        };
        let memory = best
            .memory_mb
            .map_or(String::new(), |mb| format!(", {mb:.0} MB"));
        let mut text = format!(
            "{} % {norm}: {engine}{}: {}{memory}",
            percent(self.target),
            best.setting(),
            duration(best.seconds),
        );
        for other in &self.others {
            text += &format!(
                "; {} ({}) needs {}",
                other.engine,
                other.setting(),
                duration(other.seconds)
            );
        }
        text
    }
}

/// Without the digits that a binary number adds.
fn percent(target: f64) -> String {
    let text = format!("{:.6}", 100.0 * target);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Three digits, in ms below a second.
pub fn duration(seconds: f64) -> String {
    let (value, unit) = if seconds < 1.0 {
        (1e3 * seconds, "ms")
    } else {
        (seconds, "s")
    };
    let digits = match value {
        v if v < 9.995 => 2,
        v if v < 99.95 => 1,
        _ => 0,
    };
    format!("{value:.digits$} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentences_are_short() {
        assert_eq!(percent(0.01), "1");
        assert_eq!(percent(5e-3), "0.5");
        assert_eq!(percent(1e-5), "0.001");
        assert_eq!(duration(0.00612), "6.12 ms");
        assert_eq!(duration(0.0999), "99.9 ms");
        assert_eq!(duration(2.5), "2.50 s");
        assert_eq!(duration(25.04), "25.0 s");
    }
}
