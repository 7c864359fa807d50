//! The progress of the study.

use std::sync::Mutex;

use super::iterations::schemes;
use super::request::PaperRequest;
use crate::engine::{Case, Progress, lock};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;

/// Estimated work per square of a mesh; the values only affect the progress bar.
#[derive(Clone, Copy)]
pub enum Part {
    /// P2, with its errors.
    Fine = 20,
    /// CR by the Rust engine, and by a code that is slower.
    Own = 2,
    Other = 60,
    /// Iterations, counted.
    Count = 10,
    Errors = 8,
    /// All variants of an example.
    Sweep = 100,
}

impl Part {
    /// On a mesh of n × n squares.
    pub fn cost(self, n: usize) -> f64 {
        (self as usize * n * n) as f64
    }

    pub fn of_engine(is_own: bool) -> Self {
        match is_own {
            true => Part::Own,
            false => Part::Other,
        }
    }
}

/// The completed fraction of the whole, for a progress bar.
pub struct Work<'a> {
    total: f64,
    done: Mutex<f64>,
    progress: &'a dyn Progress,
}

impl<'a> Work<'a> {
    pub fn new(request: &PaperRequest, progress: &'a dyn Progress) -> Self {
        let examples = request.examples.len() as f64;
        let fine = [4, 2, 1].map(|part| Part::Fine.cost(request.fine / part));
        let fine: f64 = fine.iter().sum();
        let of_cr = |&n: &usize| {
            let engines = request.engines.iter();
            let engines = engines.map(|e| Part::of_engine(e.is_own()).cost(n));
            let solving: f64 = engines.map(|cost| cost + Part::Errors.cost(n)).sum();
            let counts = 2.0 * schemes(1.0).len() as f64 * Part::Count.cost(n);
            examples * (solving + Part::Sweep.cost(n)) + counts
        };
        let cr: f64 = request.n.iter().map(of_cr).sum();
        Work {
            total: examples * fine + cr,
            done: Mutex::new(0.0),
            progress,
        }
    }

    pub fn next(&self, what: &str) -> Result<()> {
        let share = *lock(&self.done) / self.total;
        self.progress.next(what, share);
        cancel::check()
    }

    pub fn finish(&self, cost: f64) {
        *lock(&self.done) += cost;
    }
}

/// Passes on the progress of engines, which poll for interruptions themselves.
pub struct Listener<'a> {
    pub cases: &'a [&'a Case<'a>],
    pub work: &'a Work<'a>,
}

impl Progress for Listener<'_> {
    fn step(&self, engine: &str, case: usize, iteration: usize, _: f64) {
        let Some(case) = self.cases.get(case) else {
            return;
        };
        let n = case.n.map_or(String::new(), |n| format!(", n = {n}"));
        let _ = self.work.next(&format!(
            "{}, {engine}{n}, step {iteration}",
            case.scene().name()
        ));
    }
}
