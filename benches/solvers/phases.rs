//! The phases of a solve beside the machine's limits: what each takes, and what its bytes and operations would take at the
//! bandwidth of a triad and the rate of a product of matrices, and its fresh pages at the rate at which the system gives
//! them, measured in the same run.
//!
//! Phases are the program's own spans, whose fields say what they move and compute: bytes are a lower bound, each array counted
//! once a pass. A span has the time that those within it do not have, but one that is `whole` has theirs as well. They so
//! add up to the time of the solve.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::ThreadId;
use std::time::Instant;

use faceoff_fem::contact::{Discretisation, Iteration, Method, Problem, Stop, solve_by};
use faceoff_fem::linear::Settings;
use faceoff_fem::scene::Scene;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use rayon::prelude::*;
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Metadata, Subscriber, debug_span};

/// What the spans of one name have taken.
#[derive(Default, Clone, Copy)]
struct Phase {
    entered: usize,
    seconds: f64,
    bytes: f64,
    flops: f64,
    pages: f64,
}

/// The fields of a span.
#[derive(Default, Clone, Copy)]
struct Fields {
    name: &'static str,
    bytes: f64,
    flops: f64,
    whole: bool,
}

impl Visit for Fields {
    fn record_debug(&mut self, _: &Field, _: &dyn std::fmt::Debug) {}

    fn record_f64(&mut self, field: &Field, value: f64) {
        match field.name() {
            "bytes" => self.bytes = value,
            "flops" => self.flops = value,
            _ => {}
        }
    }

    fn record_u64(&mut self, field: &Field, value: u64) {
        self.record_f64(field, value as f64);
    }

    fn record_bool(&mut self, field: &Field, value: bool) {
        self.whole |= field.name() == "whole" && value;
    }
}

/// A span that is entered: whose time it is, since when, and what those within it took of time and pages.
struct Open {
    owner: &'static str,
    whole: bool,
    since: Instant,
    pages: f64,
    within: [f64; 2],
}

#[derive(Default)]
struct State {
    new: BTreeMap<u64, Fields>,
    open: Vec<Open>,
    phases: BTreeMap<&'static str, Phase>,
    /// Of the spans that are within no other, in s.
    whole: f64,
}

/// Pages that the system has given this process, each with 4 kB or more; 0 where it does not say.
fn pages_so_far() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // Behind the name, which ends with the last bracket.
    let numbers = text.rsplit(')').next().unwrap_or_default();
    let faults = numbers.split_whitespace().nth(7);
    faults.and_then(|faults| faults.parse().ok()).unwrap_or(0.0)
}

/// Sums up the spans of one thread: what others do is within them.
#[derive(Clone)]
struct Clock {
    state: Arc<Mutex<State>>,
    next: Arc<AtomicU64>,
    thread: ThreadId,
}

impl Clock {
    fn new() -> Self {
        Clock {
            state: Arc::default(),
            next: Arc::new(AtomicU64::new(1)),
            thread: std::thread::current().id(),
        }
    }

    fn with(&self, change: impl FnOnce(&mut State)) {
        if std::thread::current().id() == self.thread {
            change(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner));
        }
    }
}

impl Subscriber for Clock {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.is_span()
    }

    fn new_span(&self, span: &Attributes<'_>) -> Id {
        let id = self.next.fetch_add(1, Ordering::Relaxed);
        let mut fields = Fields {
            name: span.metadata().name(),
            ..Fields::default()
        };
        span.record(&mut fields);
        self.with(|state| {
            state.new.insert(id, fields);
        });
        Id::from_u64(id)
    }

    fn enter(&self, id: &Id) {
        self.with(|state| {
            let Some(fields) = state.new.remove(&id.into_u64()) else {
                return;
            };
            let above = state.open.last().filter(|above| above.whole);
            let (owner, whole) = above.map_or((fields.name, fields.whole), |a| (a.owner, true));
            let phase = state.phases.entry(owner).or_default();
            phase.entered += usize::from(owner == fields.name);
            phase.bytes += fields.bytes;
            phase.flops += fields.flops;
            state.open.push(Open {
                owner,
                whole,
                since: Instant::now(),
                pages: pages_so_far(),
                within: [0.0; 2],
            });
        });
    }

    fn exit(&self, _: &Id) {
        self.with(|state| {
            let Some(open) = state.open.pop() else {
                return;
            };
            let seconds = open.since.elapsed().as_secs_f64();
            let pages = pages_so_far() - open.pages;
            let phase = state.phases.entry(open.owner).or_default();
            phase.seconds += seconds - open.within[0];
            phase.pages += pages - open.within[1];
            match state.open.last_mut() {
                Some(above) => {
                    above.within[0] += seconds;
                    above.within[1] += pages;
                }
                None => state.whole += seconds,
            }
        });
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, _: &Event<'_>) {}
}

/// A solve from the scene to u, and its phases.
pub struct Solve {
    title: String,
    whole: f64,
    phases: BTreeMap<&'static str, Phase>,
}

impl Solve {
    /// Solves, before [`Limits`] are measured: pages that these give back make those cost more that come after.
    pub fn new(name: &str, method: Method, n: usize, stop: Stop) -> super::Outcome<Self> {
        let scene = Scene::find(name)?;
        let clock = Clock::new();
        let (solution, unknowns) = tracing::subscriber::with_default(clock.clone(), || {
            let _span = debug_span!("the rest").entered();
            let mesh = debug_span!("mesh").in_scope(|| scene.triangulation(Some(n)))?;
            let discretisation = Discretisation::of(&scene, method);
            let problem = debug_span!("assembly")
                .in_scope(|| Problem::new(&scene, &mesh, &discretisation))?;
            let newton = Iteration::Newton;
            let solution = solve_by(&problem, newton, stop, Settings::default(), |_, _| Ok(()))?;
            super::Outcome::Ok((solution, problem.space.dofs))
        })?;
        let State { phases, whole, .. } =
            std::mem::take(&mut *clock.state.lock().unwrap_or_else(PoisonError::into_inner));
        let sum: f64 = phases.values().map(|phase| phase.seconds).sum();
        // By one clock, so that no other process on the machine matters.
        if !solution.converged || !((sum - whole).abs() <= 1e-9 * whole) {
            return Err(format!("{name}, {method}, n = {n}: {sum} s of phases, {whole} s").into());
        }
        let title = format!(
            "{name}, {method}, n = {n}: {unknowns} unknowns by {} in {}, {} steps, {whole:.3} s, backward error {:.1e}",
            solution.linear.solver,
            solution.linear.precision,
            solution.increments.len(),
            solution.backward_error,
        );
        Ok(Solve {
            title,
            whole,
            phases,
        })
    }
}

/// What the machine does at best, on all cores: bytes, operations and fresh pages a second.
pub struct Limits {
    bytes: f64,
    flops: f64,
    pages: f64,
}

impl Limits {
    /// A triad over arrays far larger than any cache; a product of matrices that a cache holds.
    pub fn measure(quick: bool) -> Self {
        let (length, size) = if quick {
            (1 << 16, 64)
        } else {
            (1 << 25, 2048)
        };
        let [b, c] = [1.0, 2.0].map(|value| vec![value; length]);
        let mut a = vec![0.0; length];
        let best = |run: &mut dyn FnMut()| {
            let mut seconds = f64::INFINITY;
            for _ in 0..5 {
                let clock = Instant::now();
                run();
                seconds = seconds.min(clock.elapsed().as_secs_f64());
            }
            seconds
        };
        let triad = best(&mut || {
            let rows = a.par_chunks_mut(1 << 14).zip(b.par_chunks(1 << 14));
            rows.zip(c.par_chunks(1 << 14)).for_each(|((a, b), c)| {
                for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                    *a = b + 3.0 * c;
                }
            });
        });
        // Three arrays are named, and a fourth pass fetches what is written.
        let bytes = 3.0 * 8.0 * length as f64 / triad;
        let before = pages_so_far();
        let fresh = best(&mut || {
            let mut fresh = vec![0_u8; 8 * length];
            let parts = fresh.par_chunks_mut(1 << 20);
            parts.for_each(|part| part.iter_mut().step_by(4096).for_each(|byte| *byte = 1));
            std::hint::black_box(fresh);
        });
        let pages = (pages_so_far() - before) / 5.0 / fresh;
        let flops_of_product = 2.0 * (size as f64).powi(3);
        let of = Mat::from_fn(size, size, |i, j| (i + 2 * j) as f64);
        let mut product = Mat::zeros(size, size);
        let wide = best(&mut || {
            let (accum, par) = (Accum::Replace, Par::rayon(0));
            matmul(&mut product, accum, &of, &of, 1.0, par);
        });
        let of = Mat::from_fn(size, size, |i, j| (i + 2 * j) as f32);
        let mut product = Mat::zeros(size, size);
        let narrow = best(&mut || {
            let (accum, par) = (Accum::Replace, Par::rayon(0));
            matmul(&mut product, accum, &of, &of, 1.0, par);
        });
        println!(
            "{} cores; triad over {} MB {:.1} GB/s; product of {size} × {size} matrices {:.1} Gflop/s in f64, {:.1} in f32; {:.0} thousand fresh pages a second\n",
            rayon::current_num_threads(),
            24 * length / 1_000_000,
            bytes / 1e9,
            flops_of_product / wide / 1e9,
            flops_of_product / narrow / 1e9,
            pages / 1e3,
        );
        Limits {
            bytes,
            flops: flops_of_product / wide,
            pages,
        }
    }

    /// The table of a solve.
    pub fn tell(&self, solve: Solve) {
        let Solve {
            title,
            whole,
            mut phases,
        } = solve;
        println!("{title}\n");
        println!(
            "| phase | times | s | part | GB at least | Gflop | thousand pages | s at the limits | of these |"
        );
        println!("|---|---|---|---|---|---|---|---|---|");
        let all = phases.values().map(|phase| self.least(*phase));
        let least: f64 = all.sum();
        let rest = phases.remove("the rest").map(|phase| ("the rest", phase));
        let mut rows: Vec<_> = phases.into_iter().collect();
        rows.sort_by(|a, b| b.1.seconds.total_cmp(&a.1.seconds));
        for (name, phase) in rows.into_iter().chain(rest) {
            println!("| {name} {}", self.row(phase, whole));
        }
        println!("| sum | | {whole:.3} | | | | | {least:.3} | |\n");
    }

    /// Its bytes or its operations, whichever take longer, and its pages, which a core does not clear while it computes.
    fn least(&self, phase: Phase) -> f64 {
        let moved = (phase.bytes / self.bytes).max(phase.flops / self.flops);
        // Where pages are not told there is no rate of them.
        let pages = phase.pages / self.pages;
        if pages.is_finite() {
            moved + pages
        } else {
            moved
        }
    }

    fn row(&self, phase: Phase, whole: f64) -> String {
        let told = |value: f64, text: String| if value > 0.0 { text } else { String::new() };
        let least = self.least(phase);
        format!(
            "| {} | {:.3} | {:.0} % | {} | {} | {:.0} | {} | {} |",
            phase.entered,
            phase.seconds,
            100.0 * phase.seconds / whole,
            told(phase.bytes, format!("{:.2}", phase.bytes / 1e9)),
            told(phase.flops, format!("{:.2}", phase.flops / 1e9)),
            phase.pages / 1e3,
            told(least, format!("{least:.3}")),
            told(
                phase.bytes + phase.flops,
                format!("{:.1} ×", phase.seconds / least)
            ),
        )
    }
}
