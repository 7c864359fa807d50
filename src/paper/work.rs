//! How much of the study is done, for whoever watches.

use std::sync::Mutex;

use super::iterations::schemes;
use super::study::{Request, Watch};
use crate::engine::{Case, Progress};
use faceoff_mesh::error::Result;

/// Rough shares of the work; they only shape the bar.
pub mod cost {
    pub fn fine(n: usize) -> f64 {
        20.0 * (n * n) as f64
    }
    pub fn engine(name: &str, n: usize) -> f64 {
        let slowness = if name == "rust" { 2.0 } else { 60.0 };
        slowness * (n * n) as f64
    }
    pub fn count(n: usize) -> f64 {
        10.0 * (n * n) as f64
    }
    pub fn errors(n: usize) -> f64 {
        8.0 * (n * n) as f64
    }
}

/// What is done of everything, for whoever watches.
pub struct Work<'a> {
    total: f64,
    done: Mutex<f64>,
    watch: &'a Watch<'a>,
}

impl<'a> Work<'a> {
    pub fn new(request: &Request, watch: &'a Watch<'a>) -> Self {
        let examples = request.examples.len() as f64;
        let fine: f64 = [4, 2, 1]
            .map(|part| cost::fine(request.fine / part))
            .iter()
            .sum();
        let cr: f64 = request
            .n
            .iter()
            .map(|&n| {
                let engines = request.engines.iter();
                let solving: f64 = engines
                    .map(|e| cost::engine(e.name(), n) + cost::errors(n))
                    .sum();
                examples * solving + schemes(1.0).len() as f64 * cost::count(n)
            })
            .sum();
        Work {
            total: examples * fine + cr,
            done: Mutex::new(0.0),
            watch,
        }
    }

    fn done(&self) -> std::sync::MutexGuard<'_, f64> {
        self.done
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    pub fn tell(&self, what: &str) -> Result<()> {
        let share = *self.done() / self.total;
        (self.watch)(what, share)
    }

    pub fn finish(&self, cost: f64) {
        *self.done() += cost;
    }
}

/// Passes on what engines tell; they watch for interruptions themselves.
pub struct Listener<'a> {
    pub cases: &'a [Case<'a>],
    pub work: &'a Work<'a>,
}

impl Progress for Listener<'_> {
    fn step(&self, engine: &str, case: usize, iteration: usize, _: f64) {
        let Some(case) = self.cases.get(case) else {
            return;
        };
        let n = case.n.map_or(String::new(), |n| format!(", n = {n}"));
        let _ = self.work.tell(&format!(
            "{}, {engine}{n}, step {iteration}",
            case.scene().name()
        ));
    }

    fn done(&self, _: &str) {}
}
