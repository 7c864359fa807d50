//! For each target error: the way that measured rows predict to be the fastest, measured with the advised command.
//! If it misses the target, a finer mesh is tried, up to the one that was measured to reach it.

use super::advice::{NORMS, Norm, TARGETS, words};
use super::campaign::{self, Campaign};
use super::measure::{Setting, measure};
use super::row::{Row, Times, Varied};
use super::subject::Subject;
use super::waste::waste;
use faceoff_fem::contact::Method;
use faceoff_fem::scene::MeshSource;
use faceoff_mesh::error::Result;

/// Meshes are chosen for this fraction of the error, since between two measured meshes the position of a transition in its cell changes
/// the error a little.
const AIM: f64 = 0.97;
/// Ways that are predicted to take up to this many times longer than the fastest are measured as well.
const CLOSE: f64 = 1.2;
/// The number of meshes that are tried for one error, and the refinement between them.
const TRIES: usize = 6;
const FINER: f64 = 1.04;
/// The number of repetitions of a command, and the total time in seconds after which they end.
const FOLLOWED: usize = 5;
const LONG_ENOUGH: f64 = 3.0;
/// The time in seconds that a process may take to start.
const START: f64 = 0.1;
/// A looser tolerance is advised if it saves this fraction of the time.
const WORTH: f64 = 1.02;

/// The cost of a command.
#[derive(Debug, Clone, Copy)]
pub struct Followed {
    /// In seconds, as the command reports it: mesh, assembly and solution.
    pub seconds: f64,
    /// The peak memory of its process.
    pub memory_mb: f64,
}

/// Runs the program with these arguments.
pub type Follow = dyn Fn(&[String]) -> Result<Followed>;

/// The predicted way to reach an error.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Way {
    method: Method,
    mesh: Mesh,
    seconds: f64,
    /// The time of a measurement in seconds, including evaluation.
    cost: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Mesh {
    /// This n, at most the finest, which was measured to reach it.
    Uniform {
        n: Option<usize>,
        finest: Option<usize>,
    },
    /// Adapted to this accuracy.
    Adapted(f64),
}

impl Campaign<'_> {
    pub fn targets(&mut self) -> Result<()> {
        let request = self.request;
        for norm in NORMS {
            for target in TARGETS {
                for subject in &request.subjects {
                    self.target(subject, norm, target)?;
                }
            }
        }
        Ok(())
    }

    fn target(&mut self, subject: &Subject, norm: Norm, target: f64) -> Result<()> {
        let mut ways = self.ways(subject, norm, target);
        ways.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
        let fastest = ways.first().map_or(0.0, |way| way.seconds);
        ways.retain(|way| way.seconds <= CLOSE * fastest);
        for way in ways {
            let run = way.seconds + START;
            let runs = (FOLLOWED as f64 * run).min(LONG_ENOUGH + run);
            if !self.allows(campaign::TARGETS, way.cost + runs) {
                let name = subject.scene.name();
                let what = format!("{name}, {}, advice for {target:e}", way.method);
                self.leave_out(what, "the budget was spent");
                continue;
            }
            match way.mesh {
                Mesh::Adapted(accuracy) => {
                    let known = |r: &Row| r.accuracy == Some(accuracy);
                    if !self.has(subject, way.method, known) {
                        self.adapt(subject, way.method, accuracy, Varied::Target)?;
                    }
                }
                Mesh::Uniform { n, finest } => {
                    self.uniform(subject, way.method, (n, finest), (norm, target))?;
                }
            }
        }
        Ok(())
    }

    /// The Rust engine's ways to an error that were measured so far.
    fn ways(&self, subject: &Subject, norm: Norm, target: f64) -> Vec<Way> {
        let mut ways = Vec::new();
        if self.rust().is_none() {
            return ways;
        }
        for &method in &self.request.methods {
            let of = |varied: Varied| -> Vec<(&Row, f64)> {
                let rows = self.of(subject, method, varied);
                let mut rows: Vec<_> = rows.filter(|(row, _)| row.converged).collect();
                rows.sort_by_key(|(row, _)| row.cells);
                rows
            };
            ways.extend(cheapest(subject, method, &of(Varied::Mesh), norm, target));
            let adapted = of(Varied::Adaptive);
            let reaches = |row: &Row| row.error(norm).is_some_and(|error| error <= target);
            if let Some((row, cost)) = adapted.into_iter().find(|(row, _)| reaches(row)) {
                ways.extend(row.accuracy.map(|accuracy| Way {
                    method,
                    mesh: Mesh::Adapted(accuracy),
                    seconds: row.seconds.median,
                    cost,
                }));
            }
        }
        ways
    }

    /// Was such a target of this track measured already?
    fn has(&self, subject: &Subject, method: Method, which: impl Fn(&Row) -> bool) -> bool {
        let mut rows = self.of(subject, method, Varied::Target);
        rows.any(|(row, _)| which(row))
    }

    fn uniform(
        &mut self,
        subject: &Subject,
        method: Method,
        (mut n, finest): (Option<usize>, Option<usize>),
        (norm, target): (Norm, f64),
    ) -> Result<()> {
        let usual = self.request.settings.stop.increment;
        let mut tolerance = self.enough(subject, method).unwrap_or(usual);
        for k in 0..TRIES {
            // An existing measurement may suffice.
            let known = |r: &Row| r.accuracy.is_none() && r.n == n && r.tolerance == tolerance;
            let is_below = |error: f64| error <= target;
            let reaches = |r: &Row| known(r) && r.converged && r.error(norm).is_some_and(is_below);
            if !self.has(subject, method, known) && !self.sized(subject, method, n, tolerance)? {
                return Ok(());
            }
            if self.has(subject, method, reaches) {
                return Ok(());
            }
            if n == finest {
                if tolerance == usual {
                    return Ok(());
                }
                tolerance = usual;
            } else {
                n = finest
                    .filter(|_| k + 3 >= TRIES)
                    .or(finer(subject, n, finest));
            }
        }
        Ok(())
    }

    /// Measures a mesh and a tolerance with the command; false if it is refused.
    fn sized(
        &mut self,
        subject: &Subject,
        method: Method,
        n: Option<usize>,
        tolerance: f64,
    ) -> Result<bool> {
        let Some(engine) = self.rust() else {
            return Ok(false);
        };
        let mut settings = self.request.settings.clone();
        settings.stop.increment = tolerance;
        let setting = Setting {
            subject,
            engine,
            method,
            n,
            varied: Varied::Target,
            variation: None,
            settings,
        };
        let made = self.once(
            setting.title(),
            setting.engine,
            &setting.key()?,
            |campaign| {
                let mut row = measure(&setting, f64::INFINITY)?;
                campaign.follow(subject, &mut row)?;
                Ok(Some(row))
            },
        )?;
        Ok(made.is_some())
    }

    /// Replaces the row's time and memory by those of the command that solves as the row did.
    pub fn follow(&self, subject: &Subject, row: &mut Row) -> Result<()> {
        let Some(follow) = &self.request.follow else {
            return Ok(());
        };
        let words = words(self.request, subject, row);
        let mut all = Vec::new();
        while all.len() < FOLLOWED
            && all.iter().map(|f: &Followed| f.seconds).sum::<f64>() < LONG_ENOUGH
        {
            self.next(&words.join(" "))?;
            all.push(follow(&words)?);
        }
        row.seconds = Times::new(all.iter().map(|f| f.seconds).collect());
        let memory = all.iter().map(|f| f.memory_mb);
        row.memory_mb = Some(memory.fold(0.0, f64::max));
        Ok(())
    }

    /// The loosest tolerance that costs no accuracy, if that saves time.
    fn enough(&self, subject: &Subject, method: Method) -> Option<f64> {
        let rows = self.of(subject, method, Varied::Tolerance);
        let rows: Vec<Row> = rows.map(|(row, _)| row.clone()).collect();
        let found = waste(&rows);
        let found = found.first().filter(|w| w.time_ratio > WORTH)?;
        found.enough.parse().ok()
    }
}

/// The next existing mesh.
fn finer(subject: &Subject, n: Option<usize>, finest: Option<usize>) -> Option<usize> {
    let (n, finest) = n.zip(finest)?;
    let wanted = ((n as f64 * FINER).ceil() as usize).max(n + 1);
    (wanted..finest)
        .find(|n| subject.scene.has_mesh(*n))
        .or(Some(finest))
}

/// The coarsest mesh from which on the error is predicted to be below the target; `track` by ascending cells, with costs.
fn cheapest(
    subject: &Subject,
    method: Method,
    track: &[(&Row, f64)],
    norm: Norm,
    target: f64,
) -> Option<Way> {
    let errors = track.iter().map(|(row, _)| row.error(norm));
    let errors: Vec<f64> = errors.collect::<Option<_>>()?;
    let harmful = errors.iter().rposition(|e| !(*e <= target));
    let fine = harmful.map_or(0, |k| k + 1);
    let (row, cost) = *track.get(fine)?;
    let way = |n: Option<usize>, seconds: f64| Way {
        method,
        mesh: Mesh::Uniform { n, finest: row.n },
        seconds,
        cost,
    };
    let as_measured = Some(way(row.n, row.seconds.median));
    // Meshes from files exist only at the measured fineness.
    if fine == 0 || !matches!(subject.scene.source(), MeshSource::Union { .. }) {
        return as_measured;
    }
    let coarse = track[fine - 1].0;
    let (n0, n1) = (coarse.n? as f64, row.n? as f64);
    let order = (errors[fine - 1] / errors[fine]).ln() / (n1 / n0).ln();
    let wanted = n0 * (errors[fine - 1] / (AIM * target)).powf(1.0 / order);
    let Some(n) = (wanted.ceil() as usize..row.n?).find(|n| subject.scene.has_mesh(*n)) else {
        return as_measured;
    };
    // Between the two rows, linear in logarithms.
    let share = (n as f64 / n0).ln() / (n1 / n0).ln();
    let [before, after] = [coarse, row].map(|row| row.seconds.median);
    Some(way(Some(n), before.powf(1.0 - share) * after.powf(share)))
}

#[cfg(test)]
mod tests {
    use super::super::row::sample;
    use super::*;
    use faceoff_fem::scene::Scene;

    fn rows(errors: &[(usize, f64)]) -> Vec<Row> {
        let of = |&(n, error): &(usize, f64)| Row {
            n: Some(n),
            cells: 2 * n * n,
            ..sample(Varied::Mesh, error, n as f64)
        };
        errors.iter().map(of).collect()
    }

    #[test]
    fn meshes_lie_between_measured_ones_and_never_beyond() {
        let scene = Scene::find("manufactured-3").unwrap();
        let subject = Subject::new("manufactured-3", scene, false).unwrap();
        let way = |errors: &[(usize, f64)], target: f64| {
            let rows = rows(errors);
            let track: Vec<_> = rows.iter().map(|row| (row, 1.0)).collect();
            let way = cheapest(&subject, Method::cr(), &track, Norm::Energy, target)?;
            let Mesh::Uniform { n, finest } = way.mesh else {
                return None;
            };
            Some((n?, finest?))
        };
        // First order: 0.02 · 0.97 is at n = 8 · 0.08/0.0194 = 33, in steps that the mesh allows.
        let first = [(8, 0.08), (16, 0.04), (32, 0.02), (64, 0.01)];
        let found = way(&first, 0.015).unwrap();
        assert!(found.0 >= 44 && found.0 <= 46 && found.1 == 64, "{found:?}");
        assert_eq!(way(&first, 0.01), Some((64, 64)));
        assert_eq!(way(&first, 0.009), None);
        assert_eq!(way(&first, 0.5), Some((8, 8)));
        // A coarse mesh that is accurate by chance does not count.
        let lucky = [(8, 0.01), (16, 0.04), (32, 0.02)];
        assert_eq!(way(&lucky, 0.02), Some((32, 32)));
    }
}
