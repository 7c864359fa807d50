//! The solver of this crate as an engine.

use super::{Answer, Case, Engine, Progress, Run, Settings};
use faceoff_fem::contact::{self, Method};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;

pub(super) struct Rust;

impl Engine for Rust {
    fn name(&self) -> &str {
        "rust"
    }

    fn probe(&self) -> Result<String> {
        Ok(env!("CARGO_PKG_VERSION").to_owned())
    }

    fn is_installed(&self) -> bool {
        true
    }

    fn accepts(&self, _: &Method) -> Result<()> {
        Ok(())
    }

    fn run(&self, cases: &[Case], settings: &Settings, progress: &dyn Progress) -> Result<Run> {
        let answers = cases
            .iter()
            .enumerate()
            .map(|(index, case)| {
                let told = |step: usize, increment: f64| {
                    progress.step(self.name(), index, step, increment);
                    cancel::check()
                };
                let solution = contact::solve_by(
                    &case.problem,
                    settings.iteration,
                    settings.stop,
                    settings.linear,
                    told,
                )?;
                Ok(Answer::new(solution))
            })
            .collect::<Result<_>>()?;
        progress.done(self.name());
        Ok(Run {
            version: self.probe()?,
            answers,
        })
    }
}
