//! What shows only when two codes run again: tolerances, the order of the mesh, linear solvers, the start.

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

/// What two starts show.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Start {
    /// Nothing, as not both answers are solutions.
    Unsolved,
    /// That one linear system, which both solve, is badly conditioned.
    OneSystem,
    /// That they lead to two solutions.
    Decides,
}

impl Start {
    /// What the start was matched to.
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

/// What was found about two answers to one case.
#[derive(Debug, Clone, Serialize)]
pub struct Diagnosis {
    /// Its name.
    pub scene: String,
    /// Its name.
    pub method: String,
    /// The refinement, where the scene has one.
    pub n: Option<usize>,
    /// The first engine.
    pub a: String,
    /// The second.
    pub b: String,
    /// The largest |a-b| of any field by value, relative to max|u| and the field's sensitivity.
    pub difference: f64,
    /// Those that account for the difference first.
    pub ingredients: Vec<Ingredient>,
    /// Are both solutions of one linear system, which is then badly conditioned?
    #[serde(skip)]
    pub is_one_system: bool,
}

/// One ingredient, matched.
#[derive(Debug, Clone, Serialize)]
pub struct Ingredient {
    /// What was matched: tolerances, the order of the mesh, linear solvers, the start.
    #[serde(rename = "ingredient", serialize_with = "of_change")]
    pub change: Change,
    /// What it was set to.
    pub matched: String,
    /// The difference that is left, in the same units.
    pub left: f64,
    /// Is nothing but rounding left?
    pub accounts: bool,
}

fn of_change<S: Serializer>(change: &Change, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&change.of())
}

/// Two answers to a case that are not the same, whose difference no residual explains.
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
    /// A setup that has no problem.
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

    /// Runs both with one ingredient matched at a time.
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

    /// What is left when both engines run again; none where one of them does not answer.
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

    /// The Rust engine with another linear solver beside the answer of the other.
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
    /// Is it about these two in this case?
    pub fn is_of(&self, case: (&str, &str, Option<usize>), pair: (&str, &str)) -> bool {
        (&*self.scene, &*self.method, self.n) == case && (&*self.a, &*self.b) == pair
    }

    /// What accounts for the difference, in words.
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

/// What is left when both codes start from either answer. Of two solutions the start decides which is found; but as the
/// scheme is linear while no point of Γ_C changes its status, two of them differ there. Answers with the same status are
/// one solution of one linear system, which differ by rounding alone.
fn start_decides(residuals: [f64; 2], flips: usize, difference: f64) -> (Start, f64) {
    // Each by itself: the larger of a number and of what is none is the number.
    let solved = residuals.iter().all(|r| *r <= RESIDUAL_TOLERANCE);
    let residual = residuals[0].max(residuals[1]);
    match flips {
        _ if !solved => (Start::Unsolved, difference),
        0 => (Start::OneSystem, difference),
        _ => (Start::Decides, residual),
    }
}

/// The largest difference of any field by value, as the judge measures it; infinite where there is none.
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
