//! Adaptive refinement to certified accuracies, by the Rust engine.

use std::cell::Cell;
use std::time::Instant;

use super::campaign::{ADAPTIVE, Campaign, GROWTH, dimension, identity};
use super::measure::evaluated;
use super::row::{Row, Times, Varied};
use super::subject::Subject;
use crate::engine::{self, HighWater, Settings};
use crate::run::consistent;
use faceoff_fem::adapt::{Outcome, Way, Wish, reach};
use faceoff_fem::certify::Target;
use faceoff_fem::contact::{Discretisation, Method, Problem};
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};

/// Certified accuracies, descending.
const ACCURACIES: [f64; 8] = [0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001];

impl Campaign<'_> {
    pub fn adapted(&mut self) -> Result<()> {
        let request = self.request;
        for subject in &request.subjects {
            if dimension(subject) != 2 {
                continue;
            }
            for method in request.methods.iter().filter(|m| m.is_nitsche()) {
                let uniform = self.of(subject, *method, Varied::Mesh);
                let most = uniform.map(|(row, _)| row.dofs).max().unwrap_or(0);
                let (mut last, mut dofs) = (0.0, 0);
                for accuracy in ACCURACIES {
                    // Beyond the finest uniform mesh there is nothing to compare with.
                    if dofs > most || !self.allows(ADAPTIVE, last * GROWTH) {
                        break;
                    }
                    let Some(row) = self.adapt(subject, *method, accuracy, Varied::Adaptive)?
                    else {
                        break;
                    };
                    (last, dofs) = (self.costs[row], self.rows[row].dofs);
                }
            }
        }
        Ok(())
    }

    /// The index of the row; `None` if the accuracy is not reached, which is reported.
    pub fn adapt(
        &mut self,
        subject: &Subject,
        method: Method,
        accuracy: f64,
        varied: Varied,
    ) -> Result<Option<usize>> {
        let Some(engine) = self.rust() else {
            return Ok(None);
        };
        let name = subject.scene.name();
        let what = format!("{name}, rust {method}, adapted to {accuracy:e}, {varied}");
        let key = format!(
            "{} {method} {accuracy:e} {varied} {:?}",
            identity(subject)?,
            self.request.settings.stop
        );
        let title = what.clone();
        self.once(what, engine, &key, |campaign| {
            let mut row = campaign.reached(subject, method, accuracy, &title)?;
            if let Some(row) = &mut row {
                row.varied = varied;
                if varied == Varied::Target {
                    campaign.follow(subject, row)?;
                }
            }
            Ok(row)
        })
    }

    /// `None` if there is not enough time.
    fn reached(
        &self,
        subject: &Subject,
        method: Method,
        accuracy: f64,
        what: &str,
    ) -> Result<Option<Row>> {
        let Settings { stop, linear, .. } = self.request.settings;
        let wish = Wish {
            discretisation: Discretisation::of(&subject.scene, method),
            target: Target::UH,
            accuracy,
            stop,
            linear,
            way: Some(Way::Adaptive),
        };
        let (clock, water) = (Instant::now(), HighWater::begin());
        let is_late = Cell::new(false);
        let reached = reach(&subject.scene, &wish, |_, next| {
            self.next(what)?;
            is_late.set(next.is_some_and(|next| self.elapsed() + next.seconds > self.budget()));
            if is_late.get() {
                return Err(Error::Solver {
                    what: "the budget was spent".into(),
                    remedy: "give a larger one".into(),
                });
            }
            Ok(())
        });
        let seconds = clock.elapsed().as_secs_f64();
        if is_late.get() {
            return Ok(None);
        }
        let reached = reached?;
        cancel::check()?;
        if let Outcome::NotReached(why) = reached.outcome {
            return Err(Error::Solver {
                what: why,
                remedy: "ask for less".into(),
            });
        }
        let problem = Problem::new(&subject.scene, &reached.mesh, &wish.discretisation)?;
        let answer = engine::Answer::new(reached.solution);
        let truth = subject.truth.as_deref();
        let row = evaluated(&problem, engine::OWN, &answer, truth)?;
        consistent(row.h1, &reached.certificate)?;
        Ok(Some(Row {
            accuracy: Some(accuracy),
            tolerance: stop.increment,
            certified: Some(reached.certificate.relative(Target::UH)),
            seconds: Times::new(vec![seconds]),
            memory_mb: water.and_then(|water| water.megabytes()),
            ..row
        }))
    }
}
