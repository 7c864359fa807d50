//! What is measured in which order: coarse meshes first over all engines and methods, so that a small budget gives a whole
//! picture, then settings beside their neighbours.

use std::time::Instant;

use super::advice::advise;
use super::fit::rates;
use super::front::front;
use super::measure::{Setting, described, measure};
use super::row::{Row, Times, Varied};
use super::subject::Subject;
use super::waste::waste;
use super::{LeftOut, Outcome, Request};
use crate::adapt::{Ended, Way, Wish, reach};
use crate::certify::Target;
use crate::contact::{Method, Problem};
use crate::engine::{Engine, Machine, Settings};
use crate::error::{Error, Result};
use crate::linear::{self, Precision, Solver};
use crate::quadrature;
use crate::scene::MeshSource;

/// Shares of the budget until which each part may begin something.
const MESHES: f64 = 0.6;
const TOLERANCES: f64 = 0.7;
const GAMMAS: f64 = 0.78;
const RULES: f64 = 0.84;
const SOLVERS: f64 = 0.9;
const ADAPTIVE: f64 = 1.0;

/// The coarsest generated mesh, and the n near which settings are varied.
const FIRST: usize = 8;
const USUAL: usize = 64;
/// Meshes of every track that are measured whatever the budget: two make a picture.
const ALWAYS: usize = 2;
/// A companion's process may take what is left of the budget, and at least so many seconds.
const LEAST_LIMIT: f64 = 60.0;
/// How many times longer the next mesh is supposed to take before two were measured: four times the cells, and some.
const GROWTH: f64 = 5.0;
/// Decades of the tolerances.
const DECADES: std::ops::RangeInclusive<i32> = 2..=12;
/// Decades of γ₀.
const GAMMA_DECADES: std::ops::RangeInclusive<i32> = -12..=12;
/// Certified accuracies of adapted meshes.
const ACCURACIES: [f64; 8] = [0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001];

/// Is told what is measured next and the share of the budget that is spent; may end the run.
pub type Watch<'a> = dyn Fn(&str, f64) -> Result<()> + 'a;

/// Measures until the budget is spent; the two coarsest meshes of everything in any case.
///
/// # Errors
/// An engine that is not there; the coarsest mesh of a scene refused; an interruption. What a finer mesh, or another
/// setting, refuses is told in the outcome.
pub fn study(request: &Request, watch: &Watch) -> Result<Outcome> {
    let mut engines = Vec::new();
    for engine in &request.engines {
        engines.push((engine.name().to_owned(), engine.probe()?));
    }
    let mut campaign = Campaign {
        request,
        watch,
        clock: Instant::now(),
        rows: Vec::new(),
        costs: Vec::new(),
        left_out: Vec::new(),
    };
    campaign.meshes()?;
    campaign.tolerances()?;
    campaign.gammas()?;
    campaign.rules()?;
    campaign.solvers()?;
    campaign.adapted()?;
    let Campaign {
        rows,
        left_out,
        clock,
        ..
    } = campaign;
    let waste = waste(&rows);
    let default = request.settings.stop.increment;
    Ok(Outcome {
        machine: Machine::here(),
        engines,
        budget: request.budget.as_secs_f64(),
        spent: clock.elapsed().as_secs_f64(),
        front: front(&rows),
        rates: rates(&rows),
        advice: advise(&request.subjects, &rows, &waste, default),
        waste,
        rows,
        left_out,
    })
}

struct Campaign<'a> {
    request: &'a Request,
    watch: &'a Watch<'a>,
    clock: Instant,
    rows: Vec<Row>,
    /// Seconds that each row took, evaluation included.
    costs: Vec<f64>,
    left_out: Vec<LeftOut>,
}

/// One engine and method on one scene over its meshes.
struct Track<'a> {
    subject: &'a Subject,
    engine: &'a dyn Engine,
    method: Method,
    n: usize,
    /// Seconds of the last two meshes.
    costs: Vec<f64>,
    is_over: bool,
}

impl<'a> Campaign<'a> {
    fn elapsed(&self) -> f64 {
        self.clock.elapsed().as_secs_f64()
    }

    /// May something that is predicted to take so long begin in a part that ends at this share of the budget?
    fn allows(&self, share: f64, seconds: f64) -> bool {
        self.elapsed() + seconds <= share * self.request.budget.as_secs_f64()
    }

    fn tell(&self, what: &str) -> Result<()> {
        (self.watch)(what, self.elapsed() / self.request.budget.as_secs_f64())
    }

    fn leave_out(&mut self, what: String, why: impl Into<String>) {
        self.left_out.push(LeftOut {
            what,
            why: why.into(),
        });
    }

    /// Measures a setting; what it refuses is left out, and no row comes of it. Its seconds.
    fn add(&mut self, setting: &Setting) -> Result<Option<f64>> {
        self.tell(&setting.title())?;
        let begun = Instant::now();
        let left = self.request.budget.as_secs_f64() - self.elapsed();
        match measure(setting, left.max(LEAST_LIMIT)) {
            Ok(row) => {
                self.rows.push(row);
                self.costs.push(begun.elapsed().as_secs_f64());
                Ok(self.costs.last().copied())
            }
            Err(Error::Interrupted) => Err(Error::Interrupted),
            Err(other) => {
                self.leave_out(setting.title(), other.to_string());
                Ok(None)
            }
        }
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
                        subject,
                        engine: &**engine,
                        method: *method,
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
        let setting = Setting {
            subject: track.subject,
            engine: track.engine,
            method: track.method,
            n: Some(track.n).filter(|_| track.subject.scene.mesh.n().is_some()),
            varied: Varied::Mesh,
            settings: self.request.settings.clone(),
        };
        let predicted = match track.costs[..] {
            [] => 0.0,
            [only] => only * GROWTH,
            [.., before, last] => last * (last / before).clamp(1.0, 2.0 * GROWTH),
        };
        let is_due = track.costs.len() < ALWAYS;
        if !is_due && !self.allows(MESHES, predicted) {
            track.is_over = true;
            return Ok(());
        }
        match self.add(&setting)? {
            Some(cost) => track.costs.push(cost),
            None => track.is_over = true,
        }
        // A file that does not say what n it counts as has one mesh.
        track.is_over |= track.subject.scene.mesh.n().is_none();
        track.n *= 2;
        Ok(())
    }

    /// The row of this track whose mesh settings are varied on: the finest up to the usual n; and what it cost.
    fn base(&self, scene: &str, method: &Method) -> Option<(usize, f64)> {
        let method = method.to_string();
        let rows = self.rows.iter().zip(&self.costs).filter(|(row, _)| {
            row.varied == Varied::Mesh && row.track() == (scene, "rust", &*method)
        });
        let fits = rows.filter(|(row, _)| row.n.is_some_and(|n| n <= USUAL));
        fits.max_by_key(|(row, _)| row.n)
            .and_then(|(row, cost)| Some((row.n?, *cost)))
    }

    /// Measures variations of what the Rust engine has measured already, each track as a whole.
    fn vary(
        &mut self,
        share: f64,
        varied: Varied,
        methods: &[Method],
        variations: impl Fn(&Subject) -> Vec<Variation>,
    ) -> Result<()> {
        let request = self.request;
        let Some(engine) = request.engines.iter().find(|e| e.name() == "rust") else {
            return Ok(());
        };
        for subject in &request.subjects {
            for method in methods {
                let Some((n, cost)) = self.base(&subject.scene.name, method) else {
                    continue;
                };
                let variations = variations(subject);
                if !self.allows(share, cost * variations.len() as f64) {
                    let what = format!("{}, {method}, n = {n}, {varied}", subject.scene.name);
                    self.leave_out(what, "the budget was spent");
                    continue;
                }
                for variation in variations {
                    self.add(&Setting {
                        subject: variation.subject.as_ref().unwrap_or(subject),
                        engine: &**engine,
                        method: *method,
                        n: Some(n),
                        varied,
                        settings: variation.settings,
                    })?;
                }
            }
        }
        Ok(())
    }

    fn tolerances(&mut self) -> Result<()> {
        let settings = &self.request.settings;
        let variations = |_: &Subject| {
            DECADES
                .map(|k| {
                    let mut settings = settings.clone();
                    settings.stop.increment = 10.0_f64.powi(-k);
                    Variation::of(settings)
                })
                .collect()
        };
        self.vary(
            TOLERANCES,
            Varied::Tolerance,
            &self.request.methods,
            variations,
        )
    }

    /// 24 decades, of the penalty-free methods.
    fn gammas(&mut self) -> Result<()> {
        let settings = &self.request.settings;
        let methods = [Method::cr(), Method::cr_fc()];
        let asked = |m: &&Method| self.request.methods.contains(m);
        let methods: Vec<Method> = methods.iter().filter(asked).copied().collect();
        self.vary(GAMMAS, Varied::Gamma0, &methods, |subject| {
            GAMMA_DECADES
                .step_by(2)
                .map(|k| {
                    let mut subject = subject.clone();
                    subject.scene.gamma0 = 10.0_f64.powi(k);
                    Variation::on(subject, settings.clone())
                })
                .collect()
        })
    }

    fn rules(&mut self) -> Result<()> {
        let settings = &self.request.settings;
        let nitsche = |m: &&Method| m.is_nitsche();
        let methods: Vec<Method> = self
            .request
            .methods
            .iter()
            .filter(nitsche)
            .copied()
            .collect();
        for varied in [Varied::ContactQuadrature, Varied::LoadQuadrature] {
            self.vary(RULES, varied, &methods, |subject| {
                let scene = &subject.scene;
                if varied == Varied::LoadQuadrature && scene.data.f.is_zero() {
                    return Vec::new();
                }
                let below = usize::from(varied == Varied::ContactQuadrature);
                let dim = dimension(subject);
                let names = quadrature::names(dim - below).iter().rev();
                names
                    .map(|name| {
                        let mut subject = subject.clone();
                        let rule = if below == 1 {
                            &mut subject.scene.contact_quadrature
                        } else {
                            &mut subject.scene.load_quadrature
                        };
                        *rule = Some((*name).to_owned());
                        Variation::on(subject, settings.clone())
                    })
                    .collect()
            })?;
        }
        Ok(())
    }

    fn solvers(&mut self) -> Result<()> {
        let settings = &self.request.settings;
        let nitsche = |m: &&Method| m.is_nitsche();
        let methods: Vec<Method> = self
            .request
            .methods
            .iter()
            .filter(nitsche)
            .copied()
            .collect();
        self.vary(SOLVERS, Varied::Linear, &methods, |_| {
            let all = [
                (Solver::Multifrontal, Precision::F64),
                (Solver::Multifrontal, Precision::F32Refined),
                (Solver::Faer, Precision::F64),
                (Solver::Iterative, Precision::F64),
            ];
            all.map(|(solver, precision)| {
                let mut settings = settings.clone();
                settings.linear = linear::Settings { solver, precision };
                Variation::of(settings)
            })
            .into()
        })
    }

    /// Adapted meshes until certified accuracies, by the Rust engine.
    fn adapted(&mut self) -> Result<()> {
        let request = self.request;
        if !request.engines.iter().any(|e| e.name() == "rust") {
            return Ok(());
        }
        for subject in &request.subjects {
            if dimension(subject) != 2 {
                continue;
            }
            for method in request.methods.iter().filter(|m| m.is_nitsche()) {
                let mut last = 0.0;
                for accuracy in ACCURACIES {
                    if !self.allows(ADAPTIVE, last * GROWTH) {
                        break;
                    }
                    let begun = Instant::now();
                    match self.adapt(subject, *method, accuracy)? {
                        Some(row) => self.rows.push(row),
                        None => break,
                    }
                    last = begun.elapsed().as_secs_f64();
                    self.costs.push(last);
                }
            }
        }
        Ok(())
    }

    /// None where the accuracy is not reached, which is told.
    fn adapt(&mut self, subject: &Subject, method: Method, accuracy: f64) -> Result<Option<Row>> {
        let Settings { stop, linear, .. } = self.request.settings;
        let wish = Wish {
            method,
            target: Target::UH,
            accuracy,
            stop,
            linear,
            way: Some(Way::Adaptive),
        };
        let what = format!(
            "{}, rust {method}, adapted to {accuracy:e}",
            subject.scene.name
        );
        self.tell(&what)?;
        let budget = self.request.budget.as_secs_f64();
        let clock = Instant::now();
        let reached = reach(&subject.scene, &wish, |_, next| {
            self.tell(&what)?;
            match next {
                Some(next) if self.elapsed() + next.seconds > budget => Err(Error::Solver {
                    what: "the budget was spent".into(),
                    remedy: "give a larger one".into(),
                }),
                _ => Ok(()),
            }
        });
        let reached = match reached {
            Ok(reached) => reached,
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(other) => {
                self.leave_out(what, other.to_string());
                return Ok(None);
            }
        };
        let seconds = clock.elapsed().as_secs_f64();
        if let Ended::NotReached(why) = &reached.ended {
            self.leave_out(what, why);
            return Ok(None);
        }
        let problem = Problem::new(&subject.scene, &reached.mesh, method)?;
        let u = &reached.solution.u;
        let errors = subject.errors(&problem, u)?;
        let values = crate::contact::quantities(&problem, u);
        let mut row = described(subject, &problem, "rust");
        row.varied = Varied::Adaptive;
        row.tolerance = stop.increment;
        row.linear = reached.solution.linear.solver.to_string();
        row.precision = reached.solution.linear.precision.to_string();
        row.steps = reached.solution.increments.len();
        row.converged = reached.solution.converged;
        row.residual = problem.backward_error(u).0;
        row.h1 = errors.map(|e| e.h1);
        row.l2 = errors.map(|e| e.l2);
        row.certified = Some(reached.certificate.relative(Target::UH));
        row.contact_residual = values.contact_residual;
        row.contact_flux = values.contact_flux;
        row.seconds = Times::new(vec![seconds]);
        Ok(Some(row))
    }
}

/// A neighbour of what is usual.
struct Variation {
    /// None: as it is.
    subject: Option<Subject>,
    settings: Settings,
}

impl Variation {
    fn of(settings: Settings) -> Self {
        Variation {
            subject: None,
            settings,
        }
    }

    fn on(subject: Subject, settings: Settings) -> Self {
        Variation {
            subject: Some(subject),
            settings,
        }
    }
}

/// Where to begin.
fn first(subject: &Subject) -> usize {
    let scene = &subject.scene;
    match &scene.mesh {
        MeshSource::Union { n, cuboid } => {
            let coarse = if cuboid.dim == 3 { FIRST / 2 } else { FIRST };
            // Sides that are split need a vertex there, which the scene's own n has.
            if scene.has_mesh(coarse) { coarse } else { *n }
        }
        other => other.n().unwrap_or(1),
    }
}

fn dimension(subject: &Subject) -> usize {
    match &subject.scene.mesh {
        MeshSource::Union { cuboid, .. } => cuboid.dim,
        other => {
            let mesh = subject.scene.triangulation(other.n());
            mesh.map_or(2, |mesh| mesh.dim)
        }
    }
}
