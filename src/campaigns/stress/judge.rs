//! Judges the answers of an engine to a trial.

use std::sync::Arc;

use serde::Serialize;

use super::trial::Trial;
use crate::engine::{self, Answer, Case, Engine, Settings};
use crate::run::Runner;
use crate::text::{Number, Text, text};
use faceoff_fem::contact::{Ended, Method, Problem, condition};
use faceoff_fem::known::Truth;
use faceoff_fem::linear;
use faceoff_mesh::error::{Error, Result};

/// Errors below this count as zero: no mesh in use has a smaller one.
const NEGLIGIBLE: f64 = 1e-8;
/// A converged answer with a larger backward error does not solve the scheme.
const RESIDUAL: f64 = 1e-9;
/// With a larger relative error the solution is lost; a reference error below a tenth of it shows that the mesh could resolve it.
const NOTHING_LEFT: f64 = 0.5;

/// One engine and method at one extreme.
#[derive(Debug, Clone, Serialize)]
pub struct Entry {
    /// The name of the engine.
    pub engine: String,
    /// The name of the method.
    pub method: String,
    /// The family of the extreme.
    pub family: &'static str,
    /// The extreme value.
    pub value: Text,
    /// The classification of the answer.
    #[serde(flatten)]
    pub verdict: Behaviour,
    /// The larger of the relative errors in the energy norm and in L².
    pub error: Option<f64>,
    /// The same for the moderate problem.
    pub reference: Option<f64>,
    /// Digits that agree with the moderate solution, if that has the same dofs.
    pub digits: Option<f64>,
    /// Steps of the iteration.
    pub steps: Option<usize>,
    /// Backward error.
    pub residual: Option<f64>,
    /// A lower bound for the amplification of relative rounding errors at this u.
    pub condition: Option<f64>,
}

/// The classification of an answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "verdict", rename_all = "kebab-case")]
pub enum Behaviour {
    /// The error is that of the moderate problem.
    Holds,
    /// The error is larger than that of the moderate problem by this factor.
    Degrades {
        /// Above 1.
        factor: f64,
    },
    /// Refused with a message.
    Refuses {
        /// The message.
        sentence: Text,
    },
    /// A result reported as converged that is wrong.
    Wrong {
        /// The evidence.
        why: Text,
    },
}

impl Entry {
    fn new(engine: &str, method: Method, trial: &Trial) -> Self {
        Entry {
            engine: engine.to_owned(),
            method: method.to_string(),
            family: trial.family,
            value: trial.value.clone(),
            verdict: Behaviour::Holds,
            error: None,
            reference: None,
            digits: None,
            steps: None,
            residual: None,
            condition: None,
        }
    }

    fn but(self, verdict: Behaviour) -> Self {
        Entry { verdict, ..self }
    }
}

impl Behaviour {
    /// Is it a result reported as converged that is wrong?
    pub fn is_wrong(&self) -> bool {
        matches!(self, Behaviour::Wrong { .. })
    }
}

/// Runs all trials by one method in an engine, in one batch with the reference problems, and judges them.
///
/// # Errors
/// A moderate problem that cannot be solved, an interruption.
pub fn judge(
    runner: &Runner,
    engine: &dyn Engine,
    method: Method,
    trials: &[Trial],
) -> Result<Vec<Entry>> {
    let mut setups = Vec::new();
    for trial in trials {
        let of_reference = trial.reference_method.unwrap_or(method);
        setups.push(trial.extreme.setup(method, runner.settings));
        setups.push(trial.reference().setup(of_reference, runner.settings));
    }
    let mut cases: Vec<Result<Case, String>> = Vec::new();
    for setup in &setups {
        let case = setup.as_ref().map_err(ToString::to_string);
        cases.push(case.and_then(|setup| setup.case().map_err(|e| e.to_string())));
    }
    // A moderate problem is solved by the Rust engine if this one does not have its method.
    let own = engine::find(engine::OWN)?;
    let is_lent = |k: usize| {
        let lent = trials[k / 2].reference_method.filter(|_| k % 2 == 1);
        lent.is_some_and(|method| engine.accepts(&method).is_err())
    };
    let solved = |engine: &dyn Engine, by_own: bool| {
        let of = cases
            .iter()
            .enumerate()
            .filter(|(k, _)| is_lent(*k) == by_own);
        let sound: Vec<&Case> = of.filter_map(|(_, case)| case.as_ref().ok()).collect();
        Ok::<_, Error>(runner.each(engine, &sound, runner.settings)?.into_iter())
    };
    let mut answers = [solved(engine, false)?, solved(&*own, true)?];
    let lost = || Err("it gave no answer".to_owned());
    let found: Vec<Answered> = cases
        .iter()
        .enumerate()
        .map(|(k, case)| {
            let case = case.as_ref().map_err(String::clone)?;
            let answer = answers[usize::from(is_lent(k))].next();
            Ok((case, answer.unwrap_or_else(lost)?))
        })
        .collect();
    let pairs = trials.iter().zip(found.chunks_exact(2));
    pairs
        .map(|(trial, pair)| {
            let entry = Entry::new(engine.name(), method, trial);
            of_trial(runner.settings, entry, trial, &pair[0], &pair[1])
        })
        .collect()
}

type Answered<'a> = Result<(&'a Case<'a>, Arc<Answer>), String>;

fn of_trial(
    settings: &Settings,
    mut entry: Entry,
    trial: &Trial,
    extreme: &Answered,
    reference: &Answered,
) -> Result<Entry> {
    let (case, answer) = match extreme {
        Ok(answered) => answered,
        Err(sentence) => {
            let sentence = Text::message(sentence);
            return Ok(entry.but(Behaviour::Refuses { sentence }));
        }
    };
    let steps = answer.increments.len();
    entry.steps = Some(steps);
    entry.residual = Some(answer.residual);
    let amplified = condition(&case.problem, &answer.u, linear::Settings::default()).ok();
    entry.condition = amplified.filter(|condition| condition.is_finite());
    let (residual, history) = (answer.residual, answer.history.as_ref());
    let wrong = |why: Text| Behaviour::Wrong { why };
    let refuses = |sentence: Text| Behaviour::Refuses { sentence };
    let size = |value: f64| Number::new(value, 2);
    let at_once = match history.map(|history| history.ended) {
        Some(Ended::Undetermined) if !answer.converged => Some(refuses(text!(
            "the matrix is singular to working precision; rounding decides what u is, with a backward error of {}",
            size(residual)
        ))),
        _ if !answer.converged => Some(refuses(text!(
            "not reached in {} steps; the best iterate has the backward error {}",
            steps,
            size(residual)
        ))),
        _ if trial.must_refuse => Some(wrong("it answers, and there is no solution".into())),
        _ if !answer.u.iter().all(|u| u.is_finite()) => {
            Some(wrong("the answer is not finite".into()))
        }
        _ if !(residual <= RESIDUAL) => Some(wrong(text!(
            "it says that it converged, and the backward error is {}",
            Number::power(residual)
        ))),
        _ => None,
    };
    if let Some(verdict) = at_once {
        return Ok(entry.but(verdict));
    }
    let u: Vec<f64> = answer.u.iter().map(|u| u / trial.scale).collect();
    let (moderate_case, moderate) = reference.as_ref().map_err(|what| {
        let (family, value) = (trial.family, &trial.value);
        let what = format!("the moderate problem of {family} {value}: {what}");
        let remedy = "report this, or give scenes whose moderate values it solves";
        Error::engine(&entry.engine, what, remedy)
    })?;
    let error = match &trial.home {
        None => problem_error(&case.problem, &u)?,
        Some(home) => {
            let setup = home.setup(case.problem.method(), settings)?;
            problem_error(&setup.case()?.problem, &u)?
        }
    };
    let reference = problem_error(&moderate_case.problem, &moderate.u)?;
    if trial.home.is_some() && trial.reference.is_none() {
        entry.digits = Some(digits(&u, &moderate.u));
    }
    entry.error = Some(error);
    entry.reference = Some(reference);
    let factor = error / reference.max(NEGLIGIBLE);
    entry.verdict = if error <= (trial.room * reference).max(NEGLIGIBLE) {
        Behaviour::Holds
    } else if !trial.is_parameter && !(error <= NOTHING_LEFT) && reference < 0.1 * NOTHING_LEFT {
        wrong(text!(
            "the relative error is {}, and at moderate values {}",
            size(error),
            size(reference)
        ))
    } else {
        Behaviour::Degrades { factor }
    };
    Ok(entry)
}

/// The larger of the relative errors in the energy norm and L²; 0 if the solution is unknown.
fn problem_error(problem: &Problem, u: &[f64]) -> Result<f64> {
    let Some(truth) = Truth::of(problem.scene)? else {
        return Ok(0.0);
    };
    let found = truth.errors(problem, u)?;
    Ok(found.h1.max(found.l2))
}

/// -log₁₀ of the largest difference relative to the largest value; 17 if there is none.
fn digits(a: &[f64], b: &[f64]) -> f64 {
    let largest = b.iter().fold(0.0, |m: f64, b| m.max(b.abs()));
    let apart = a.iter().zip(b);
    let apart = apart.fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
    if apart == 0.0 {
        return 17.0;
    }
    -(apart / largest).log10()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaigns::stress::trial::Place;
    use crate::campaigns::stress::{StressRequest, stress};
    use crate::engine::{Progress, Run, Silent};
    use faceoff_fem::scene::Scene;

    /// The map of the Rust engine, without slow trials.
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
        let in_turn = (0..)
            .zip(methods)
            .filter(|(k, _)| crate::run::is_in_turn(*k, 4));
        let methods: Vec<Method> = in_turn.map(|(_, m)| m.parse().unwrap()).collect();
        let request = StressRequest {
            scenes: vec![Scene::find("manufactured-3").unwrap()],
            families: vec![],
            methods: methods.clone(),
            engines: vec![engine::find("rust").unwrap()],
            settings: Settings::default(),
            is_brief: true,
        };
        let outcome = stress(&request, &Silent).unwrap();
        let of =
            |want: fn(&Behaviour) -> bool| outcome.entries.iter().filter(move |c| want(&c.verdict));
        let wrong: Vec<_> = of(Behaviour::is_wrong).collect();
        assert!(wrong.is_empty(), "{wrong:#?}");
        // A change of units is not an extreme.
        for cell in &outcome.entries {
            if ["data", "domain"].contains(&cell.family) {
                assert_eq!(cell.verdict, Behaviour::Holds, "{cell:?}");
                assert!(cell.digits.unwrap() > 10.0, "{cell:?}");
            }
        }
        // Problems without a solution are refused by all, with a message.
        let unsolvable = |c: &&Entry| c.value.to_string().starts_with("floating, ");
        let refused = of(
            |v| matches!(v, Behaviour::Refuses { sentence } if sentence.to_string().contains("; ")),
        );
        assert_eq!(refused.filter(unsolvable).count(), 3 * methods.len());
        assert!(of(|v| *v == Behaviour::Holds).count() > outcome.entries.len() / 2);
    }

    fn tried(scene: Scene) -> Result<Vec<Entry>> {
        let request = StressRequest {
            scenes: vec![scene],
            families: vec!["gamma0".into()],
            methods: vec![Method::cr(), Method::p2()],
            engines: vec![engine::find(engine::OWN).unwrap()],
            settings: Settings::default(),
            is_brief: true,
        };
        Ok(stress(&request, &Silent)?.entries)
    }

    #[test]
    fn the_solution_of_one_zone_is_known_and_that_of_other_data_is_not() {
        let scene = Scene::find("one-zone").unwrap();
        let entries = tried(scene.clone()).unwrap();
        let found: Vec<f64> = entries.iter().filter_map(|c| c.reference).collect();
        // p2 exceeds rounding at some of 7 values.
        let known = found.iter().filter(|e| (1e-4..0.2).contains(*e)).count();
        assert!(known == found.len() && known > 7, "{entries:#?}");
        let changed = tried(scene.with_data(scene.data().clone())).unwrap_err();
        let refused = "its solution is not known";
        assert!(changed.to_string().contains(refused), "{changed}");
    }

    /// An engine that falsifies the answers of another one.
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
        fn run(
            &self,
            cases: &[&Case],
            settings: &Settings,
            progress: &dyn Progress,
        ) -> Result<Run> {
            for case in cases {
                self.accepts(&case.problem.method())?;
            }
            let mut run = engine::find("rust")?.run(cases, settings, progress)?;
            for (answer, case) in run.answers.iter_mut().zip(cases) {
                if case.scene().name() == "extreme" {
                    (self.0)(answer);
                }
            }
            Ok(run)
        }
    }

    /// The moderate method of the states is one that other engines do not have.
    #[test]
    fn an_engine_is_compared_with_what_it_cannot_solve() {
        let settings = Settings::default();
        let runner = Runner::new(&settings, &Silent);
        let trials = crate::campaigns::stress::states::trials().unwrap();
        let trials: Vec<Trial> = trials.into_iter().filter(|t| !t.is_heavy).collect();
        let found = judge(&runner, &Liar(|_| {}), Method::p2(), &trials).unwrap();
        let holds = |e: &Entry| e.verdict == Behaviour::Holds && e.reference.is_some();
        assert_eq!(found.len(), trials.len());
        assert!(
            found.iter().filter(|e| holds(e)).count() > trials.len() / 2,
            "{found:#?}"
        );
    }

    #[test]
    fn lies_are_seen() {
        let home = Place::of(&Scene::find("transition-1.5").unwrap(), Some(16)).unwrap();
        let mut extreme = home.clone();
        extreme.scene = extreme.scene.renamed("extreme").unwrap();
        let mut trial = Trial::new("lie", "1", extreme);
        trial.home = Some(home);
        let verdict = |lie: fn(&mut Answer), trial: &Trial| {
            let settings = Settings::default();
            let runner = Runner::new(&settings, &Silent);
            let trials = std::slice::from_ref(trial);
            let found = judge(&runner, &Liar(lie), Method::cr(), trials);
            found.unwrap().remove(0).verdict
        };
        assert_eq!(verdict(|_| {}, &trial), Behaviour::Holds);
        assert!(verdict(|a| a.u[7] = f64::NAN, &trial).is_wrong());
        assert!(verdict(|a| a.residual = 1e-3, &trial).is_wrong());
        assert!(verdict(|a| a.residual = f64::NAN, &trial).is_wrong());
        assert!(verdict(|a| a.u.iter_mut().for_each(|u| *u *= 2.0), &trial).is_wrong());
        let slightly = verdict(|a| a.u.iter_mut().for_each(|u| *u *= 1.2), &trial);
        assert!(matches!(slightly, Behaviour::Degrades { factor } if factor > 1.2));
        let unreached = verdict(|a| a.converged = false, &trial);
        assert!(matches!(unreached, Behaviour::Refuses { .. }));
        trial.must_refuse = true;
        assert!(verdict(|_| {}, &trial).is_wrong());
    }
}
