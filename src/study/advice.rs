//! Advice: for an error that is wanted, the engine, method and mesh that reach it in the least time, read off measured
//! rows by interpolation in logarithms. Nothing is extrapolated.

use serde::Serialize;

use super::row::{Row, Varied};
use super::subject::Subject;
use super::waste::Waste;
use crate::scene::MeshSource;

/// What error is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Norm {
    /// ‖∇(u-u_h)‖_h / ‖∇u‖
    Energy,
    /// ‖u-u_h‖ / ‖u‖
    L2,
}

/// Errors that advice is given for.
pub const TARGETS: [f64; 10] = [0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 1e-4, 1e-5];
/// Meshes are chosen for this part of the target: between two measured ones the place of a transition in its cell moves
/// the error a little.
const AIM: f64 = 0.95;

/// How to reach an error.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Advice {
    pub scene: String,
    pub norm: Norm,
    /// The error that is wanted.
    pub target: f64,
    pub best: Alternative,
    /// The best of every other engine.
    pub others: Vec<Alternative>,
    /// The loosest tolerance of the iteration that was found to cost nothing, or the program's own.
    pub tolerance: f64,
    /// Word for word.
    pub command: String,
}

/// One engine's way.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alternative {
    pub engine: String,
    pub method: String,
    pub n: usize,
    /// Predicted from the measured rows about it.
    pub error: f64,
    pub seconds: f64,
    pub memory_mb: Option<f64>,
}

/// Advice for every target that some measured row reaches.
pub fn advise(subjects: &[Subject], rows: &[Row], waste: &[Waste], default: f64) -> Vec<Advice> {
    let mut all = Vec::new();
    for subject in subjects {
        for norm in [Norm::Energy, Norm::L2] {
            for target in TARGETS {
                all.extend(one(subject, rows, waste, default, norm, target));
            }
        }
    }
    all
}

fn one(
    subject: &Subject,
    rows: &[Row],
    waste: &[Waste],
    default: f64,
    norm: Norm,
    target: f64,
) -> Option<Advice> {
    let name = &subject.scene.name;
    let mut ways: Vec<Alternative> = tracks(rows, name)
        .iter()
        .filter_map(|track| cheapest(subject, track, norm, target))
        .collect();
    ways.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    let mut kept: Vec<Alternative> = Vec::new();
    for way in ways {
        if kept.iter().all(|other| other.engine != way.engine) {
            kept.push(way);
        }
    }
    if kept.is_empty() {
        return None;
    }
    let best = kept.remove(0);
    let found = waste.iter().find(|w| {
        (&w.scene, &w.method, w.varied) == (name, &best.method, Varied::Tolerance)
            && best.engine == "rust"
    });
    let tolerance = found.and_then(|w| w.enough.parse().ok()).unwrap_or(default);
    let mut command = format!(
        "faceoff solve {name} --method \"{}\" --n {}",
        best.method, best.n
    );
    if best.engine != "rust" {
        command += &format!(" --engine {}", best.engine);
    }
    if tolerance != default {
        command += &format!(" --tolerance {tolerance:e}");
    }
    Some(Advice {
        scene: name.clone(),
        norm,
        target,
        best,
        others: kept,
        tolerance,
        command,
    })
}

/// The rows on uniform meshes of each engine and method, by ascending n.
fn tracks<'a>(rows: &'a [Row], scene: &str) -> Vec<Vec<&'a Row>> {
    let mut tracks: Vec<Vec<&Row>> = Vec::new();
    let of_scene = |row: &&Row| row.scene == scene && row.varied == Varied::Mesh && row.converged;
    for row in rows.iter().filter(of_scene) {
        match tracks.iter_mut().find(|t| t[0].track() == row.track()) {
            Some(track) => track.push(row),
            None => tracks.push(vec![row]),
        }
    }
    for track in &mut tracks {
        track.sort_by_key(|row| row.n);
    }
    tracks
}

/// The coarsest mesh of a track from which on the error is below the target.
fn cheapest(subject: &Subject, track: &[&Row], norm: Norm, target: f64) -> Option<Alternative> {
    let aim = AIM * target;
    let errors: Vec<f64> = track
        .iter()
        .map(|row| row.error(norm))
        .collect::<Option<_>>()?;
    let fine = errors
        .iter()
        .rposition(|e| !(*e <= aim))
        .map_or(0, |k| k + 1);
    let row = track.get(fine)?;
    let way = |n: usize, error: f64, seconds: f64, memory_mb: Option<f64>| Alternative {
        engine: row.engine.clone(),
        method: row.method.clone(),
        n,
        error,
        seconds,
        memory_mb,
    };
    let as_measured = way(row.n?, errors[fine], row.seconds.median, row.memory_mb);
    // Meshes from files exist at the measured fineness only.
    if fine == 0 || !matches!(subject.scene.mesh, MeshSource::Union { .. }) {
        return Some(as_measured);
    }
    let coarse = track[fine - 1];
    let (n0, n1) = (coarse.n? as f64, row.n? as f64);
    let order = (errors[fine - 1] / errors[fine]).ln() / (n1 / n0).ln();
    let wanted = (n0 * (errors[fine - 1] / aim).powf(1.0 / order)).ceil() as usize;
    let n = (wanted..row.n?).find(|n| subject.scene.has_mesh(*n));
    let Some(n) = n else {
        return Some(as_measured);
    };
    // Between the two rows, linear in logarithms.
    let share = (n as f64 / n0).ln() / (n1 / n0).ln();
    let between = |a: f64, b: f64| a.powf(1.0 - share) * b.powf(share);
    let memory = coarse.memory_mb.zip(row.memory_mb);
    Some(way(
        n,
        between(errors[fine - 1], errors[fine]),
        between(coarse.seconds.median, row.seconds.median),
        memory.map(|(a, b)| between(a.max(1.0), b.max(1.0))),
    ))
}

impl Advice {
    /// "1 % energy error: cr-fc, n = 40, tolerance 1e-4: 6.1 ms, 9 MB; freefem needs 0.9 s"
    pub fn sentence(&self) -> String {
        let norm = match self.norm {
            Norm::Energy => "energy error",
            Norm::L2 => "L² error",
        };
        let best = &self.best;
        let memory = best
            .memory_mb
            .map_or(String::new(), |mb| format!(", {mb:.0} MB"));
        let mut text = format!(
            "{} % {norm}: {} {}, n = {}, tolerance {:e}: {}{memory}",
            percent(self.target),
            best.engine,
            best.method,
            best.n,
            self.tolerance,
            duration(best.seconds),
        );
        for other in &self.others {
            text += &format!(
                "; {} ({}, n = {}) needs {}",
                other.engine,
                other.method,
                other.n,
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

/// In ms below a second.
pub fn duration(seconds: f64) -> String {
    if seconds < 1.0 {
        format!("{:.3} ms", 1e3 * seconds)
    } else {
        format!("{seconds:.2} s")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Iteration, Method, Problem, Stop, solve};
    use crate::engine::{self, Settings};
    use crate::linear;
    use crate::study::measure::{Setting, measure};
    use crate::study::waste::waste;
    use std::time::Duration;

    const N: [usize; 4] = [8, 16, 32, 64];

    fn settings(increment: f64) -> Settings {
        Settings {
            launch: Default::default(),
            stop: Stop {
                increment,
                ..Stop::default()
            },
            iteration: Iteration::Newton,
            linear: linear::Settings::default(),
            time_limit: Duration::from_secs(600),
            keep: None,
        }
    }

    /// What a campaign would measure: meshes, and tolerances on the last but one.
    fn measured(subjects: &[Subject], methods: &[Method]) -> Vec<Row> {
        let engine = engine::find("rust").unwrap();
        let mut rows = Vec::new();
        for subject in subjects {
            for &method in methods {
                let mut add = |n: usize, varied: Varied, tolerance: f64| {
                    let setting = Setting {
                        subject,
                        engine: &*engine,
                        method,
                        n: Some(n),
                        varied,
                        settings: settings(tolerance),
                    };
                    rows.push(measure(&setting, 600.0).unwrap());
                };
                for n in N {
                    add(n, Varied::Mesh, 1e-12);
                }
                for k in 2..=12 {
                    add(N[2], Varied::Tolerance, 10.0_f64.powi(-k));
                }
            }
        }
        rows
    }

    /// Each advice, followed, reaches its error, though its mesh was never measured; and nothing is advised beyond what was.
    #[test]
    fn advice_holds_when_it_is_followed() {
        let names = ["transition-1.5", "manufactured-3"];
        let subjects = names.map(|name| Subject::find(name).unwrap());
        let methods = [Method::cr_fc(), "p1".parse().unwrap()];
        let rows = measured(&subjects, &methods);
        let waste = waste(&rows);
        let all = advise(&subjects, &rows, &waste, 1e-12);
        let (mut between, mut loose) = (0, 0);
        for advice in &all {
            let is_its = |s: &&Subject| s.scene.name == advice.scene;
            let subject = subjects.iter().find(is_its).unwrap();
            assert!(advice.best.n <= N[3]);
            let mesh = subject.scene.triangulation(Some(advice.best.n)).unwrap();
            let method = advice.best.method.parse().unwrap();
            let problem = Problem::new(&subject.scene, &mesh, method).unwrap();
            let stop = settings(advice.tolerance).stop;
            let solution = solve(&problem, Iteration::Newton, stop, |_, _| Ok(()));
            let errors = subject.errors(&problem, &solution.unwrap().u);
            let errors = errors.unwrap().unwrap();
            let error = match advice.norm {
                Norm::Energy => errors.h1,
                Norm::L2 => errors.l2,
            };
            let told = advice.sentence();
            assert!(error <= 1.03 * advice.target, "{told}: {error:e}");
            let predicted = advice.best.error;
            let off = (error / predicted - 1.0).abs();
            assert!(
                off < 0.25,
                "{told}: {error:e}, and {predicted:e} was predicted"
            );
            between += usize::from(!advice.best.n.is_power_of_two());
            loose += usize::from(advice.tolerance > 1e-12);
        }
        assert!(between > 2 && loose > 2, "{all:#?}");
        // Coarser meshes than advised do not do: there is nothing cheaper of that method.
        let finest = |name: &str, norm: Norm| {
            let of_scene = rows.iter().filter(|r| r.scene == name && r.n == Some(N[3]));
            let errors = of_scene.filter_map(|r| r.error(norm));
            errors.fold(f64::INFINITY, f64::min)
        };
        for name in names {
            for (norm, target) in [Norm::Energy, Norm::L2]
                .into_iter()
                .flat_map(|norm| TARGETS.map(|target| (norm, target)))
            {
                let key = (name, norm, target);
                let is_there = all.iter().any(|a| (&*a.scene, a.norm, a.target) == key);
                assert_eq!(is_there, finest(name, norm) <= AIM * target, "{key:?}");
            }
        }
    }

    #[test]
    fn sentences_are_short() {
        assert_eq!(percent(0.01), "1");
        assert_eq!(percent(5e-3), "0.5");
        assert_eq!(percent(1e-5), "0.001");
        assert_eq!(duration(0.00612), "6.120 ms");
        assert_eq!(duration(2.5), "2.50 s");
    }
}
