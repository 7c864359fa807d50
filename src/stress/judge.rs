//! What an engine makes of a trial.

use serde::Serialize;

use super::trial::{Place, Trial};
use crate::engine::{Case, Engine, Settings, Silent};
use faceoff_fem::contact::{Ended, Method, Problem, condition, errors};
use faceoff_fem::element::Space;
use faceoff_fem::linear;
use faceoff_mesh::error::{Error, Result};

/// Below this an error is as good as none: no mesh in use has a smaller one.
const NEGLIGIBLE: f64 = 1e-8;
/// A converged answer with a backward error above this does not solve the scheme.
const RESIDUAL: f64 = 1e-9;
/// A relative error above this leaves nothing of the solution; a reference below a tenth of it says that there could be.
const NOTHING_LEFT: f64 = 0.5;

/// One engine and method at one extreme.
#[derive(Debug, Clone, Serialize)]
pub struct Cell {
    pub engine: String,
    pub method: String,
    pub family: &'static str,
    pub value: String,
    #[serde(flatten)]
    pub verdict: Verdict,
    /// The larger of the relative errors in the energy norm and in L².
    pub error: Option<f64>,
    /// The same of the moderate problem.
    pub reference: Option<f64>,
    /// Digits that agree with the moderate solution, where that has the same dofs.
    pub digits: Option<f64>,
    pub steps: Option<usize>,
    /// Backward error.
    pub residual: Option<f64>,
    /// An estimate from below of how many times a relative rounding is amplified at this u.
    pub condition: Option<f64>,
}

/// What became of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "verdict", rename_all = "kebab-case")]
pub enum Verdict {
    /// The error is that of moderate values.
    Holds,
    /// The error is so many times that of moderate values.
    Degrades { factor: f64 },
    /// Said in words.
    Refuses { sentence: String },
    /// An answer that claims to be one and is not.
    Wrong { why: String },
}

impl Verdict {
    pub fn is_wrong(&self) -> bool {
        matches!(self, Verdict::Wrong { .. })
    }
}

struct Answered {
    u: Vec<f64>,
    steps: usize,
    residual: f64,
    converged: bool,
    ended: Option<Ended>,
}

/// Solves a trial and the problem it is compared with.
///
/// # Errors
/// A moderate problem that cannot be solved, an interruption.
pub fn judge(
    engine: &dyn Engine,
    trial: &Trial,
    method: Method,
    settings: &Settings,
) -> Result<Cell> {
    let mut cell = Cell {
        engine: engine.name().to_owned(),
        method: method.to_string(),
        family: trial.family,
        value: trial.value.clone(),
        verdict: Verdict::Holds,
        error: None,
        reference: None,
        digits: None,
        steps: None,
        residual: None,
        condition: None,
    };
    let answered = match solve(engine, &trial.extreme, method, settings) {
        Ok(answered) => answered,
        Err(Error::Interrupted) => return Err(Error::Interrupted),
        Err(refusal) => {
            cell.verdict = Verdict::Refuses {
                sentence: refusal.to_string(),
            };
            return Ok(cell);
        }
    };
    cell.steps = Some(answered.steps);
    cell.residual = Some(answered.residual);
    cell.condition = amplification(&trial.extreme, method, &answered.u);
    let wrong = |why: String| Verdict::Wrong { why };
    if !answered.converged {
        let sentence = if answered.ended == Some(Ended::Undetermined) {
            format!(
                "the matrix is singular to working precision; rounding decides what u is, with a backward error of {:.1e}",
                answered.residual
            )
        } else {
            format!(
                "not reached in {} steps; the best iterate has the backward error {:.1e}",
                answered.steps, answered.residual
            )
        };
        cell.verdict = Verdict::Refuses { sentence };
        return Ok(cell);
    }
    if trial.must_refuse {
        cell.verdict = wrong("it answers, and there is no solution".into());
        return Ok(cell);
    }
    if !answered.u.iter().all(|u| u.is_finite()) {
        cell.verdict = wrong("the answer is not finite".into());
        return Ok(cell);
    }
    if !(answered.residual <= RESIDUAL) {
        cell.verdict = wrong(format!(
            "it says that it converged, and the backward error is {:e}",
            answered.residual
        ));
        return Ok(cell);
    }
    let u: Vec<f64> = answered.u.iter().map(|u| u / trial.scale).collect();
    let home = trial.home();
    let error = error(home, method, &u)?;
    let of = trial.reference_method.unwrap_or(method);
    let moderate = solve(engine, trial.reference(), of, settings)?;
    let reference = self::error(trial.reference(), of, &moderate.u)?;
    if trial.home.is_some() && trial.reference.is_none() {
        cell.digits = Some(digits(&u, &moderate.u));
    }
    cell.error = Some(error);
    cell.reference = Some(reference);
    let factor = error / reference.max(NEGLIGIBLE);
    cell.verdict = if error <= (trial.room * reference).max(NEGLIGIBLE) {
        Verdict::Holds
    } else if !trial.is_parameter && !(error <= NOTHING_LEFT) && reference < 0.1 * NOTHING_LEFT {
        wrong(format!(
            "the relative error is {error:.1e}, and at moderate values {reference:.1e}"
        ))
    } else {
        Verdict::Degrades { factor }
    };
    Ok(cell)
}

fn solve(
    engine: &dyn Engine,
    place: &Place,
    method: Method,
    settings: &Settings,
) -> Result<Answered> {
    let mesh = place.triangulation()?;
    let case = Case {
        scene: &place.scene,
        n: None,
        problem: Problem::new(&place.scene, &mesh, method)?,
    };
    let run = engine.run(std::slice::from_ref(&case), settings, &Silent)?;
    let answer = run
        .answers
        .into_iter()
        .next()
        .ok_or_else(|| Error::engine(engine.name(), "it gave no answer", "report this"))?;
    Ok(Answered {
        u: answer.u,
        steps: answer.increments.len(),
        residual: answer.residual,
        converged: answer.converged,
        ended: answer.history.map(|history| history.ended),
    })
}

/// How rounding is amplified at u; none where that is beyond all numbers, or the scheme is singular there.
fn amplification(place: &Place, method: Method, u: &[f64]) -> Option<f64> {
    let mesh = place.triangulation().ok()?;
    let problem = Problem::new(&place.scene, &mesh, method).ok()?;
    let found = condition(&problem, u, linear::Settings::default()).ok();
    found.filter(|condition| condition.is_finite())
}

/// The larger of both relative errors; 0 where nothing is known.
fn error(place: &Place, method: Method, u: &[f64]) -> Result<f64> {
    let Some(exact) = &place.scene.exact else {
        return Ok(0.0);
    };
    let mesh = place.triangulation()?;
    let space = Space::new(&mesh, method.element);
    let found = errors(&space, u, exact)?;
    Ok(found.h1.max(found.l2))
}

/// -log₁₀ of the largest difference over the largest value; 17 where there is none.
fn digits(a: &[f64], b: &[f64]) -> f64 {
    let largest = b.iter().fold(0.0, |m: f64, b| m.max(b.abs()));
    let apart = a
        .iter()
        .zip(b)
        .fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
    if apart == 0.0 {
        return 17.0;
    }
    -(apart / largest).log10()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::{self, Answer, Progress, Run};
    use crate::stress::{Request, stress};
    use faceoff_fem::contact::{Iteration, Stop};
    use faceoff_fem::scene::Scene;
    use std::time::Duration;

    fn settings() -> Settings {
        Settings {
            launch: Default::default(),
            stop: Stop::default(),
            iteration: Iteration::Newton,
            linear: linear::Settings::default(),
            time_limit: Duration::from_secs(60),
            keep: None,
        }
    }

    /// The map of the Rust engine, but for what takes seconds.
    #[test]
    fn nothing_is_wrong_in_rust() {
        let methods = [
            "cr",
            "cr-fc",
            "p1",
            "p2",
            "p1-vi",
            "cr-vi",
            "penalty",
            "multiplier",
        ];
        let request = Request {
            scenes: vec![Scene::find("manufactured-3").unwrap()],
            families: vec![],
            methods: methods.map(|m| m.parse().unwrap()).to_vec(),
            engines: vec![engine::find("rust").unwrap()],
            settings: settings(),
            is_brief: true,
        };
        let outcome = stress(&request, &|_, _| Ok(())).unwrap();
        let of =
            |want: fn(&Verdict) -> bool| outcome.cells.iter().filter(move |c| want(&c.verdict));
        let wrong: Vec<_> = of(Verdict::is_wrong).collect();
        assert!(wrong.is_empty(), "{wrong:#?}");
        // Units are no extreme.
        for cell in &outcome.cells {
            if ["data", "domain"].contains(&cell.family) {
                assert_eq!(cell.verdict, Verdict::Holds, "{cell:?}");
                assert!(cell.digits.unwrap() > 10.0, "{cell:?}");
            }
        }
        // What has no solution is refused by all, and with a sentence.
        let unsolvable = |c: &&Cell| c.value.starts_with("floating, ");
        let refused = of(|v| matches!(v, Verdict::Refuses { sentence } if sentence.contains("; ")));
        assert_eq!(refused.filter(unsolvable).count(), 3 * methods.len());
        assert!(of(|v| *v == Verdict::Holds).count() > outcome.cells.len() / 2);
    }

    /// An engine that answers what another one does, falsified.
    struct Liar(fn(&mut Answer));

    impl Engine for Liar {
        fn name(&self) -> &str {
            "liar"
        }
        fn probe(&self) -> Result<String> {
            Ok("1".into())
        }
        fn is_installed(&self) -> bool {
            true
        }
        fn run(&self, cases: &[Case], settings: &Settings, progress: &dyn Progress) -> Result<Run> {
            let mut run = engine::find("rust")?.run(cases, settings, progress)?;
            if cases[0].scene.name == "extreme" {
                run.answers.iter_mut().for_each(self.0);
            }
            Ok(run)
        }
    }

    #[test]
    fn lies_are_seen() {
        let home = Place::of(&Scene::find("transition-1.5").unwrap(), Some(16)).unwrap();
        let mut extreme = home.clone();
        extreme.scene.name = "extreme".into();
        let mut trial = Trial::new("lie", "1", extreme);
        trial.home = Some(home);
        let verdict = |lie: fn(&mut Answer), trial: &Trial| {
            let cell = judge(&Liar(lie), trial, Method::cr(), &settings()).unwrap();
            cell.verdict
        };
        assert_eq!(verdict(|_| {}, &trial), Verdict::Holds);
        assert!(verdict(|a| a.u[7] = f64::NAN, &trial).is_wrong());
        assert!(verdict(|a| a.residual = 1e-3, &trial).is_wrong());
        assert!(verdict(|a| a.residual = f64::NAN, &trial).is_wrong());
        assert!(verdict(|a| a.u.iter_mut().for_each(|u| *u *= 2.0), &trial).is_wrong());
        let slightly = verdict(|a| a.u.iter_mut().for_each(|u| *u *= 1.2), &trial);
        assert!(matches!(slightly, Verdict::Degrades { factor } if factor > 1.2));
        let unreached = verdict(|a| a.converged = false, &trial);
        assert!(matches!(unreached, Verdict::Refuses { .. }));
        trial.must_refuse = true;
        assert!(verdict(|_| {}, &trial).is_wrong());
    }
}
