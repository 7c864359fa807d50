//! Advice: for a target error, the fastest setting that was measured to reach it, and the command to repeat it.
//! Nothing is interpolated: each of these settings was measured, by `targets` with the advised command if the budget allowed that.

use serde::Serialize;

use super::StudyRequest;
use super::row::{Row, Varied};
use super::subject::Subject;
use crate::engine::{self, quoted};
use faceoff_fem::contact::Stop;

/// The norm of the target error.
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
/// The factor by which a command may take longer than a solve within this process, which has its memory and threads already.
const WARM: f64 = 3.0;

/// How to reach an error.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Advice {
    /// The name of the scene.
    pub scene: String,
    /// The norm of the error.
    pub norm: Norm,
    /// The target error.
    pub target: f64,
    /// The fastest engine's way.
    pub best: Alternative,
    /// The best way of every other engine.
    pub others: Vec<Alternative>,
    /// The command, verbatim.
    pub command: String,
}

/// One engine's way, as it was measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alternative {
    /// The name of the engine.
    pub engine: String,
    /// The name of the method.
    pub method: String,
    /// The n of a uniform mesh.
    pub n: Option<usize>,
    /// The certified accuracy of an adapted one.
    pub accuracy: Option<f64>,
    /// The relative increment at which the iteration stops.
    pub tolerance: f64,
    /// The relative error.
    pub error: f64,
    /// Is the error the guaranteed bound, since the true one is unknown?
    pub is_bound: bool,
    /// The median of its repetitions, without start-up, or that of a finer mesh which took less.
    pub seconds: f64,
    /// The peak memory of its process, if it ran in a separate one.
    pub memory_mb: Option<f64>,
    /// Was it measured by the advised command, or a similar one, in a separate process?
    #[serde(skip)]
    pub is_repeatable: bool,
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
            // For a solve within this process it would be the memory in addition to that of the process.
            memory_mb: row.memory_mb.filter(|_| is_repeatable(row)),
            is_repeatable: is_repeatable(row),
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

/// Advice for every target that some measured row reaches. For each engine, a target costs at most as much as a smaller error does.
pub fn advise(request: &StudyRequest, rows: &[Row]) -> Vec<Advice> {
    let mut all = Vec::new();
    for subject in &request.subjects {
        let is_counted = |row: &&Row| {
            let kinds = [Varied::Target, Varied::Mesh, Varied::Adaptive];
            row.scene == subject.scene.name() && row.converged && kinds.contains(&row.varied)
        };
        let measured: Vec<&Row> = rows.iter().filter(is_counted).collect();
        for norm in NORMS {
            let mut kept: Vec<(&Row, f64)> = Vec::new();
            let mut of_norm = Vec::new();
            for target in TARGETS.into_iter().rev() {
                for (row, seconds) in fastest(&measured, norm, target) {
                    match kept
                        .iter_mut()
                        .find(|(other, _)| other.engine == row.engine)
                    {
                        Some(other) if seconds < other.1 => *other = (row, seconds),
                        Some(_) => {}
                        None => kept.push((row, seconds)),
                    }
                }
                kept.sort_by(|a, b| a.1.total_cmp(&b.1));
                of_norm.extend(one(request, subject, (norm, target), &kept));
            }
            all.extend(of_norm.into_iter().rev());
        }
    }
    all
}

/// The fastest row of each engine that reaches a target, and its time. Solves within this process are warm: one represents the
/// Rust engine if no command was run that is about as fast.
fn fastest<'r>(measured: &[&'r Row], norm: Norm, target: f64) -> Vec<(&'r Row, f64)> {
    let reaches = |row: &&Row| row.error(norm).is_some_and(|error| error <= target);
    let mut found: Vec<(&Row, f64)> = Vec::new();
    let weight = |row: &Row, seconds: f64| match is_repeatable(row) {
        true => seconds,
        false => WARM * seconds,
    };
    for row in measured.iter().copied().filter(reaches) {
        let seconds = cost(row, measured);
        match found
            .iter_mut()
            .find(|(other, _)| other.engine == row.engine)
        {
            Some((other, of)) if weight(row, seconds) < weight(other, *of) => {
                (*other, *of) = (row, seconds);
            }
            Some(_) => {}
            None => found.push((row, seconds)),
        }
    }
    found
}

/// Was it measured in a separate process?
fn is_repeatable(row: &Row) -> bool {
    row.engine != engine::OWN || row.varied == Varied::Target
}

/// Advice from the way of each engine, by ascending time.
fn one(
    request: &StudyRequest,
    subject: &Subject,
    (norm, target): (Norm, f64),
    ways: &[(&Row, f64)],
) -> Option<Advice> {
    let of = |&(row, seconds): &(&Row, f64)| Alternative::new(row, norm, seconds);
    let (best, others) = ways.split_first()?;
    Some(Advice {
        scene: subject.scene.name().to_owned(),
        norm,
        target,
        best: of(best)?,
        others: others.iter().filter_map(of).collect(),
        command: format!("faceoff {}", quoted(words(request, subject, best.0))),
    })
}

/// The least time in which a row's mesh or a finer one was solved in the same way: noise must not make a mesh more expensive than a finer one.
fn cost(row: &Row, measured: &[&Row]) -> f64 {
    let way = |row: &Row| (row.accuracy.is_some(), row.tolerance, is_repeatable(row));
    let alike = |other: &&&Row| {
        other.track() == row.track() && way(other) == way(row) && other.cells >= row.cells
    };
    let times = measured.iter().filter(alike).map(|of| of.seconds.median);
    times.fold(row.seconds.median, f64::min)
}

/// The arguments after the program's name to solve as for a row.
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

/// Without spurious digits of a binary number.
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
    use super::super::row::sample;
    use super::*;
    use faceoff_fem::scene::Scene;

    fn request() -> StudyRequest {
        let scene = Scene::find("manufactured-3").unwrap();
        StudyRequest {
            subjects: vec![Subject::new("manufactured-3", scene, false).unwrap()],
            methods: Vec::new(),
            engines: Vec::new(),
            budget: std::time::Duration::from_secs(8),
            finest: 64,
            settings: engine::Settings::default(),
            journal: None,
            follow: None,
        }
    }

    fn row(engine: &str, varied: Varied, n: usize, error: f64, seconds: f64) -> Row {
        Row {
            scene: "manufactured-3".into(),
            engine: engine.into(),
            n: Some(n),
            cells: 2 * n * n,
            ..sample(varied, error, seconds)
        }
    }

    /// The time of every engine for an error, in ms, the fastest first.
    fn needed(rows: &[Row], target: f64) -> Vec<(String, f64)> {
        let advice = advise(&request(), rows);
        let of = advice
            .into_iter()
            .find(|a| a.target == target && a.norm == Norm::Energy);
        let ways = of
            .into_iter()
            .flat_map(|a| [a.best].into_iter().chain(a.others));
        ways.map(|way| (way.engine, (1e3 * way.seconds).round()))
            .collect()
    }

    #[test]
    fn every_measured_row_counts_where_no_command_was_run() {
        let mut rows = vec![
            row("freefem", Varied::Mesh, 16, 0.009, 0.051),
            row("rust", Varied::Mesh, 16, 0.009, 0.007),
            row("rust", Varied::Mesh, 8, 0.09, 0.003),
            row("rust", Varied::Target, 8, 0.09, 0.004),
            row("rust", Varied::LoadQuadrature, 8, 0.001, 0.001),
        ];
        let both = [("rust".to_owned(), 7.0), ("freefem".to_owned(), 51.0)];
        assert_eq!(needed(&rows, 0.01), both);
        // A command that was run has the time to expect; one whose error is far below the target does not.
        assert_eq!(needed(&rows, 0.1)[0], ("rust".to_owned(), 4.0));
        rows.push(row("rust", Varied::Target, 64, 0.001, 0.100));
        assert_eq!(needed(&rows, 0.01), both);
        rows.push(row("rust", Varied::Target, 15, 0.0095, 0.010));
        assert_eq!(needed(&rows, 0.01)[0], ("rust".to_owned(), 10.0));
    }

    #[test]
    fn no_error_costs_more_than_a_smaller_one() {
        let rows = [
            row("rust", Varied::Target, 8, 0.09, 0.007),
            row("rust", Varied::Mesh, 16, 0.009, 0.005),
        ];
        assert_eq!([0.1, 0.01].map(|of| needed(&rows, of)[0].1), [5.0; 2]);
    }

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
