//! The order of measurements: coarse meshes first over all engines and methods, so that a small budget gives a complete
//! picture, then variations of the settings, and finally the advised commands.

use std::time::Instant;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::advice::advise;
use super::front::front;
use super::gamma::gammas;
use super::measure::{Setting, measure};
use super::rates::rates;
use super::row::{Row, Varied};
use super::scaling::scaling;
use super::subject::Subject;
use super::waste::waste;
use super::{LeftOut, StudyOutcome, StudyRequest};
use crate::engine::{self, Engine, Machine, Progress, digest};
use crate::run::Journal;
use faceoff_fem::contact::Method;
use faceoff_fem::scene::MeshSource;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};

/// Fractions of the budget until which each part may begin a measurement.
const MESHES: f64 = 0.45;
pub(super) const ADAPTIVE: f64 = 0.6;
pub(super) const TOLERANCES: f64 = 0.66;
pub(super) const GAMMAS: f64 = 0.74;
pub(super) const RULES: f64 = 0.8;
pub(super) const SOLVERS: f64 = 0.85;
pub(super) const TARGETS: f64 = 1.0;

/// The coarsest generated mesh.
const FIRST: usize = 8;
/// The number of meshes of every track that are measured regardless of the budget: two are enough for a picture.
const ALWAYS: usize = 2;
/// A companion's process may take the rest of the budget, and at least this many seconds.
const LEAST_LIMIT: f64 = 60.0;
/// The predicted ratio of times for the next mesh before two were measured: four times the cells, and a margin.
pub(super) const GROWTH: f64 = 5.0;

/// A measurement, and its time in seconds, including evaluation.
#[derive(Clone, Serialize, Deserialize)]
struct Measured {
    cost: f64,
    row: Row,
}

/// Measures until the budget is spent; the two coarsest meshes of everything in any case.
///
/// # Errors
/// An engine that is not installed; a journal that cannot be used; an interruption. Refused meshes and settings are
/// recorded in the outcome.
pub fn study(request: &StudyRequest, progress: &dyn Progress) -> Result<StudyOutcome> {
    let mut engines = Vec::new();
    for engine in &request.engines {
        engines.push((engine.name().to_owned(), engine.probe()?));
    }
    let machine = Machine::here();
    let of = json!({
        "faceoff": machine.version,
        "processor": machine.processor,
        "threads": machine.threads,
        "optimised": machine.optimised,
    });
    let journal = request.journal.as_deref();
    let journal = journal.map(|path| Journal::open(path, &of)).transpose()?;
    let mut campaign = Campaign {
        request,
        progress,
        clock: Instant::now(),
        engines,
        journal,
        rows: Vec::new(),
        costs: Vec::new(),
        left_out: Vec::new(),
    };
    campaign.meshes()?;
    campaign.adapted()?;
    campaign.tolerances()?;
    campaign.gammas()?;
    campaign.rules()?;
    campaign.solvers()?;
    campaign.targets()?;
    let Campaign {
        rows,
        left_out,
        clock,
        engines,
        ..
    } = campaign;
    let rates = rates(&rows);
    Ok(StudyOutcome {
        engines,
        budget: request.budget.as_secs_f64(),
        spent: clock.elapsed().as_secs_f64(),
        front: front(&rows),
        scaling: scaling(&rows, &rates, machine.memory_mb),
        advice: advise(request, &rows),
        waste: waste(&rows),
        gammas: gammas(&rows),
        rates,
        machine,
        rows,
        left_out,
    })
}

pub(super) struct Campaign<'a> {
    pub request: &'a StudyRequest,
    progress: &'a dyn Progress,
    clock: Instant,
    /// Name and version.
    engines: Vec<(String, String)>,
    journal: Option<Journal>,
    pub rows: Vec<Row>,
    /// The time of each row in seconds, including evaluation.
    pub costs: Vec<f64>,
    left_out: Vec<LeftOut>,
}

/// One engine and method on one scene over its meshes.
struct Track<'a> {
    setting: Setting<'a>,
    n: usize,
    /// Seconds of the last two meshes.
    costs: Vec<f64>,
    is_over: bool,
}

impl<'a> Campaign<'a> {
    pub fn elapsed(&self) -> f64 {
        self.clock.elapsed().as_secs_f64()
    }

    pub fn budget(&self) -> f64 {
        self.request.budget.as_secs_f64()
    }

    /// May a measurement with this predicted time begin in a part that ends at this fraction of the budget?
    pub fn allows(&self, share: f64, seconds: f64) -> bool {
        self.elapsed() + seconds <= share * self.budget()
    }

    pub fn next(&self, what: &str) -> Result<()> {
        self.progress.next(what, self.elapsed() / self.budget());
        cancel::check()
    }

    pub fn leave_out(&mut self, what: String, why: impl Into<String>) {
        self.left_out.push(LeftOut {
            what,
            why: why.into(),
        });
    }

    pub fn rust(&self) -> Option<&'a dyn Engine> {
        let engines = self.request.engines.iter();
        engines.map(|e| &**e).find(|e| e.is_own())
    }

    /// All measurements of the Rust engine so far, with their times.
    pub fn of(
        &self,
        subject: &Subject,
        method: Method,
        varied: Varied,
    ) -> impl Iterator<Item = (&Row, f64)> + use<'_> {
        let (scene, method) = (subject.scene.name().to_owned(), method.to_string());
        let all = self.rows.iter().zip(self.costs.iter().copied());
        all.filter(move |(row, _)| {
            row.varied == varied && row.track() == (&*scene, engine::OWN, &*method)
        })
    }

    /// Makes a row once per setting, whose description is `key` except for the program: from the journal, or now. Refused settings get
    /// no row; nor do those for which `make` has no time. Returns the row's index.
    pub fn once(
        &mut self,
        what: String,
        engine: &dyn Engine,
        key: &str,
        make: impl FnOnce(&Self) -> Result<Option<Row>>,
    ) -> Result<Option<usize>> {
        self.next(&what)?;
        let mut is_late = false;
        let found = || {
            let begun = Instant::now();
            let row = make(self)?;
            is_late = row.is_none();
            let row = row.ok_or_else(|| Error::usage("the budget was spent", "give more"))?;
            let cost = begun.elapsed().as_secs_f64();
            let measured = Measured { cost, row };
            Ok((measured.clone(), measured))
        };
        let at = format!("{what}, {}", digest(key.as_bytes()));
        let of = [engine.name(), &at];
        let found = match &self.journal {
            Some(journal) => journal.once(of, || engine.identity(), &Value::Null, Some, found)?,
            None => found().map(|(measured, _)| measured),
        };
        match found {
            Ok(Measured { cost, row }) => {
                self.rows.push(row);
                self.costs.push(cost);
                return Ok(Some(self.rows.len() - 1));
            }
            Err(error @ (Error::Ended(_) | Error::Contradiction { .. })) => return Err(error),
            Err(_) if is_late => self.leave_out(what, "the budget was spent"),
            Err(other) => self.leave_out(what, other.to_string()),
        }
        Ok(None)
    }

    /// Measures a setting; returns the row's index.
    pub fn add(&mut self, setting: &Setting) -> Result<Option<usize>> {
        self.once(
            setting.title(),
            setting.engine,
            &setting.key()?,
            |campaign| {
                let left = campaign.budget() - campaign.elapsed();
                measure(setting, left.max(LEAST_LIMIT)).map(Some)
            },
        )
    }

    fn meshes(&mut self) -> Result<()> {
        let request = self.request;
        let mut tracks: Vec<Track> = Vec::new();
        for subject in &request.subjects {
            for engine in &request.engines {
                for method in &request.methods {
                    if let Err(why) = engine.accepts(method) {
                        tracing::info!(%why, "left out");
                        continue;
                    }
                    tracks.push(Track {
                        setting: Setting {
                            subject,
                            engine: &**engine,
                            method: *method,
                            n: None,
                            varied: Varied::Mesh,
                            variation: None,
                            settings: request.settings.clone(),
                        },
                        n: first(subject),
                        costs: Vec::new(),
                        is_over: false,
                    });
                }
            }
        }
        while tracks.iter().any(|track| !track.is_over) {
            for track in &mut tracks {
                if !track.is_over {
                    self.next_mesh(track)?;
                }
            }
        }
        Ok(())
    }

    fn next_mesh(&mut self, track: &mut Track<'a>) -> Result<()> {
        // A file that does not state the n of its mesh has one mesh.
        let is_alone = track.setting.subject.scene.source().n().is_none();
        track.setting.n = Some(track.n).filter(|_| !is_alone);
        let predicted = match track.costs[..] {
            [] => 0.0,
            [only] => only * GROWTH,
            [.., before, last] => last * (last / before).clamp(1.0, 2.0 * GROWTH),
        };
        let is_due = track.costs.len() < ALWAYS;
        let is_wanted = track.costs.is_empty() || track.n <= self.request.finest;
        if !is_wanted || (!is_due && !self.allows(MESHES, predicted)) {
            track.is_over = true;
            return Ok(());
        }
        match self.add(&track.setting)? {
            Some(row) => track.costs.push(self.costs[row]),
            None => track.is_over = true,
        }
        track.is_over |= is_alone;
        track.n *= 2;
        Ok(())
    }
}

/// The coarsest n.
fn first(subject: &Subject) -> usize {
    let scene = &subject.scene;
    match scene.source() {
        MeshSource::Union { n, cuboid } => {
            let coarse = if cuboid.dim == 3 { FIRST / 2 } else { FIRST };
            // Sides that are split need a vertex there, which the scene's n has.
            if scene.has_mesh(coarse) { coarse } else { *n }
        }
        other => other.n().unwrap_or(1),
    }
}

pub(super) fn dimension(subject: &Subject) -> usize {
    match subject.scene.source() {
        MeshSource::Union { cuboid, .. } => cuboid.dim,
        other => {
            let mesh = subject.scene.triangulation(other.n());
            mesh.map_or(2, |mesh| mesh.dim)
        }
    }
}

/// Everything that defines the scene, including the contents of a mesh file.
///
/// # Errors
/// A mesh file that cannot be read.
pub(super) fn identity(subject: &Subject) -> Result<String> {
    let scene = &subject.scene;
    let content = match scene.source() {
        MeshSource::File { path, .. } => {
            let bytes = faceoff_mesh::file::read(path)?;
            digest(&bytes)
        }
        _ => String::new(),
    };
    Ok(format!("{scene:?} {content}"))
}
