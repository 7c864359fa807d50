//! Causes that only show when two codes run again: tolerances, the order of the mesh, linear solvers, the initial guess.

use serde::{Serialize, Serializer};

use super::Change;
use crate::engine::{self, Engine, unique};
use crate::run::{RESIDUAL_TOLERANCE, Runner, Setup, Variation, tolerance};
use crate::text::{Number, Text, text};
use faceoff_fem::contact::{Problem, face_fields};
use faceoff_fem::linear::{self, Precision, Solver};
use faceoff_judge::judge;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::FaceFields;

/// The conclusion from running two codes from two initial guesses.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Start {
    /// None, since not both answers are solutions.
    Unsolved,
    /// One linear system, which both solve, is ill-conditioned.
    OneSystem,
    /// The initial guesses lead to two solutions.
    Decides,
}

impl Start {
    /// What the initial guess was set to.
    fn words(self) -> &'static str {
        match self {
            Start::Unsolved => "either answer, not both of which solve the scheme",
            Start::OneSystem => {
                "either answer: both solve the same linear system, which is badly conditioned"
            }
            Start::Decides => "both answers in turn, which both solve the scheme",
        }
    }
}

/// The result of running two codes again for one case.
#[derive(Debug, Clone, Serialize)]
pub struct Diagnosis {
    /// The name of the scene.
    pub scene: String,
    /// The name of the method.
    pub method: String,
    /// The refinement, if the scene has one.
    pub n: Option<usize>,
    /// The first engine.
    pub a: String,
    /// The second.
    pub b: String,
    /// The largest |a-b| of any field by value, relative to max|u| and the field's sensitivity.
    pub difference: f64,
    /// Those that account for the difference first.
    pub ingredients: Vec<Ingredient>,
    /// Are both solutions of one linear system, which is then ill-conditioned?
    #[serde(skip)]
    pub is_one_system: bool,
}

/// One setting that was made equal.
#[derive(Debug, Clone, Serialize)]
pub struct Ingredient {
    /// The setting: tolerances, the order of the mesh, linear solvers, or the initial guess.
    #[serde(rename = "ingredient", serialize_with = "of_change")]
    pub change: Change,
    /// Its common value.
    pub matched: String,
    /// The remaining difference, in the unit of `Again`.
    pub left: f64,
    /// Is the remainder rounding?
    pub accounts: bool,
}

fn of_change<S: Serializer>(change: &Change, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&change.of())
}

/// Two answers to a case that differ without a residual that explains it.
pub struct Again<'a> {
    runner: &'a Runner<'a>,
    setup: &'a Setup,
    problem: Problem<'a>,
    answers: [FaceFields; 2],
    /// u at all dofs.
    u: [&'a [f64]; 2],
    found: Vec<Ingredient>,
}

impl<'a> Again<'a> {
    /// # Errors
    /// A setup without a discrete problem.
    pub fn new(
        runner: &'a Runner<'a>,
        setup: &'a Setup,
        answers: [(&str, &'a [f64]); 2],
    ) -> Result<Self> {
        let problem = setup.case()?.problem;
        Ok(Again {
            answers: answers.map(|(name, u)| face_fields(&problem, u, name)),
            u: answers.map(|(_, u)| u),
            runner,
            setup,
            problem,
            found: Vec::new(),
        })
    }

    /// Runs both with one setting made equal at a time.
    ///
    /// # Errors
    /// An interruption.
    pub fn diagnosis(mut self, engines: [&dyn Engine; 2]) -> Result<Diagnosis> {
        let stop = self.setup.settings.stop;
        let increment = 1e-14_f64.min(0.01 * stop.increment);
        let again = [
            (
                Change::Tolerances,
                format!("increments of at most {increment:e}"),
                Variation::Increment(increment, 4),
            ),
            (
                Change::Cells,
                "the cells in reverse order for both codes".into(),
                Variation::CellsReversed,
            ),
            (
                Change::Load,
                "a constant f and no t in both codes".into(),
                Variation::ConstantLoad,
            ),
        ];
        for (change, matched, variation) in again {
            cancel::check()?;
            if let Some(left) = self.run(engines, &variation)? {
                self.add(change, matched, left);
            }
        }
        let start = self.start()?;
        self.linear_solver()?;
        self.found.sort_by_key(|i| !i.accounts);
        let [a, b] = &self.answers;
        Ok(Diagnosis {
            scene: self.setup.scene.name().to_owned(),
            method: self.setup.discretisation.method.to_string(),
            n: self.setup.n,
            a: a.source.clone(),
            b: b.source.clone(),
            difference: distance(a, b),
            ingredients: self.found,
            is_one_system: start == Start::OneSystem,
        })
    }

    fn add(&mut self, change: Change, matched: String, left: f64) {
        self.found.push(Ingredient {
            change,
            matched,
            left,
            accounts: left <= tolerance(&self.setup.discretisation.method),
        });
    }

    /// The remaining difference when both engines run again; `None` if one of them does not answer.
    fn run(&self, engines: [&dyn Engine; 2], variation: &Variation) -> Result<Option<f64>> {
        let Ok(setup) = self.setup.with(variation) else {
            return Ok(None);
        };
        let Ok(case) = setup.case() else {
            return Ok(None);
        };
        let mut fields = Vec::new();
        for engine in engines {
            let answers = self.runner.each(engine, &[&case], &setup.settings)?;
            if let Some(Ok(answer)) = answers.into_iter().next() {
                fields.push(face_fields(&case.problem, &answer.u, engine.name()));
            }
        }
        let [a, b] = &fields[..] else {
            return Ok(None);
        };
        Ok(Some(distance(a, b)))
    }

    fn start(&mut self) -> Result<Start> {
        let residuals = self.u.map(|u| self.problem.backward_error(u).0);
        let [a, b] = &self.answers;
        let judged = judge(a, b, tolerance(&self.setup.discretisation.method))?;
        let flips = judged.iter().find_map(|field| field.flips).unwrap_or(0);
        let (start, left) = start_decides(residuals, flips, distance(a, b));
        self.add(Change::Start, start.words().into(), left);
        Ok(start)
    }

    /// Compares the Rust engine with another linear solver to the answer of the other engine.
    fn linear_solver(&mut self) -> Result<()> {
        let rust = engine::find(engine::OWN)?;
        let is_own = |k: &usize| self.answers[*k].source == rust.name();
        let (Some(_), Some(other)) = ((0..2).find(is_own), (0..2).find(|k| !is_own(k))) else {
            return Ok(());
        };
        for solver in [Solver::Faer, Solver::Multifrontal] {
            let linear = linear::Settings {
                solver,
                precision: Precision::F64,
            };
            let setup = self.setup.with(&Variation::Linear(linear))?;
            let case = setup.case()?;
            let answers = self.runner.each(&*rust, &[&case], &setup.settings)?;
            if let Some(Ok(answer)) = answers.into_iter().next() {
                let fields = face_fields(&self.problem, &answer.u, "rust again");
                let other = &self.answers[other];
                let matched = format!("{solver} in the Rust engine, against {}", other.source);
                let left = distance(&fields, other);
                self.add(Change::Solver(solver), matched, left);
            }
        }
        Ok(())
    }
}

impl Diagnosis {
    /// Does it belong to these two in this case?
    pub fn is_of(&self, case: (&str, &str, Option<usize>), pair: (&str, &str)) -> bool {
        (&*self.scene, &*self.method, self.n) == case && (&*self.a, &*self.b) == pair
    }

    /// A sentence on what accounts for the difference.
    pub fn sentence(&self) -> Text {
        let all = self.ingredients.iter();
        let mut causes: Vec<&Ingredient> = all.clone().filter(|i| i.accounts).collect();
        causes.dedup_by(|i, j| i.change.of() == j.change.of());
        let difference = Number::new(self.difference, 2);
        if !causes.is_empty() {
            let causes = causes.into_iter().map(|i| {
                text!(
                    "{} accounts for it: with {} the difference falls from {} to {}",
                    i.change.of(),
                    &i.matched,
                    difference,
                    Number::new(i.left, 2)
                )
            });
            return text!("{}.", Text::joined(causes, "; "));
        }
        let none = text!(
            "nothing that was matched accounts for the difference of {}",
            difference
        );
        if self.is_one_system {
            return text!(
                "{}: both answers solve the scheme to rounding and with the same contact status, so that the linear \
                 system is badly conditioned.",
                none
            );
        }
        let names = unique(all.map(|i| i.change.of()));
        text!("{}, neither {}.", none, names.join(" nor "))
    }
}

/// The remaining difference when both codes start from either answer. If there are two solutions, the initial guess decides which is found; but
/// since the scheme is linear while no point of Γ_C changes its status, they differ there. Answers with the same status are
/// one solution of one linear system and only differ by rounding.
fn start_decides(residuals: [f64; 2], flips: usize, difference: f64) -> (Start, f64) {
    // Compared one by one, since the maximum of a number and NaN is the number.
    let solved = residuals.iter().all(|r| *r <= RESIDUAL_TOLERANCE);
    let residual = residuals[0].max(residuals[1]);
    match flips {
        _ if !solved => (Start::Unsolved, difference),
        0 => (Start::OneSystem, difference),
        _ => (Start::Decides, residual),
    }
}

/// The largest difference of any field by value, as the judge measures it; infinite if there is none.
fn distance(a: &FaceFields, b: &FaceFields) -> f64 {
    let judged = judge(a, b, 1.0).unwrap_or_default();
    let values = judged.iter().filter(|f| f.field != "status");
    let largest = values.map(|f| match f.max_rel.is_nan() {
        true => f64::INFINITY,
        false => f.max_rel,
    });
    largest.reduce(f64::max).unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::start_decides;

    #[test]
    fn the_start_decides_only_between_two_solutions() {
        let of = |residuals, flips| start_decides(residuals, flips, 1e-3).1;
        assert_eq!(of([1e-16, 3e-15], 2), 3e-15);
        assert_eq!(of([1e-16, 3e-15], 0), 1e-3);
        assert_eq!(of([1e-16, 1e-9], 2), 1e-3);
        assert_eq!(of([f64::NAN, 1e-16], 2), 1e-3);
        assert_eq!(of([1e-16, f64::NAN], 2), 1e-3);
    }
}
