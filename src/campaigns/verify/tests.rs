//! Answers of a code with one fault, none of which may count as agreement.

use super::*;
use crate::engine::{Answer, Run};
use faceoff_fem::contact::{Stop, solve_by};

/// The Rust solver, whose answers are modified by `change`.
struct Changed {
    name: &'static str,
    stop: fn(Stop) -> Stop,
    change: fn(&mut Vec<Answer>),
}

impl Engine for Changed {
    fn name(&self) -> &str {
        self.name
    }

    fn probe(&self) -> Result<String> {
        Ok("1".into())
    }

    fn is_installed(&self) -> bool {
        true
    }

    fn run(&self, cases: &[&Case], settings: &Settings, _: &dyn Progress) -> Result<Run> {
        let solve = |case: &&Case| {
            let told = |_, _| Ok(());
            let (stop, linear) = ((self.stop)(settings.stop), settings.linear);
            let mut found = solve_by(&case.problem, settings.iteration, stop, linear, told)?;
            // The code reports that, whether it is true or not.
            found.converged = true;
            Ok(Answer::new(found))
        };
        let mut answers = cases.iter().map(solve).collect::<Result<Vec<_>>>()?;
        (self.change)(&mut answers);
        // The residual is that of the modified answer.
        for (answer, case) in answers.iter_mut().zip(cases) {
            answer.residual = case.problem.backward_error(&answer.u).0;
        }
        Ok(Run {
            version: "1".into(),
            answers,
        })
    }
}

fn honest(name: &'static str) -> Changed {
    Changed {
        name,
        stop: |stop| stop,
        change: |_| {},
    }
}

/// Two scenes with the same number of dofs, each by two methods: answers 0 and 2 are of one method, as are 1 and 3.
fn judged(a: Changed, b: Changed) -> Result<VerifyOutcome> {
    let request = VerifyRequest {
        scenes: ["one-zone", "three-zones"]
            .map(|name| Scene::find(name).unwrap())
            .into(),
        methods: ["cr", "p2"].map(|name| name.parse().unwrap()).into(),
        n: vec![6],
        engines: vec![&a, &b],
        settings: Settings::default(),
        journal: None,
    };
    verify(&request, &Silent)
}

type Fault = (&'static str, fn(&mut Vec<Answer>));

const FAULTS: [Fault; 13] = [
    ("the answers of two scenes swapped", |a| a.swap(0, 2)),
    ("the answer of another scene twice", |a| {
        a[3].u = a[1].u.clone()
    }),
    ("nothing but zeros", |a| a[0].u.fill(0.0)),
    ("the other sign", |a| {
        a[1].u.iter_mut().for_each(|v| *v = -*v)
    }),
    ("a unit, in the tenth digit", |a| {
        a[2].u.iter_mut().for_each(|v| *v *= 1.0 + 1e-10)
    }),
    ("a unit, a thousand times", |a| {
        a[2].u.iter_mut().for_each(|v| *v *= 1e3)
    }),
    ("a shift in the tenth digit", |a| {
        a[0].u.iter_mut().for_each(|v| *v += 1e-10)
    }),
    ("dofs off by one", |a| a[0].u.rotate_left(1)),
    ("dofs in reverse", |a| a[1].u.reverse()),
    ("two dofs swapped", |a| a[3].u.swap(2, 40)),
    ("one dof off in the tenth digit", |a| a[3].u[11] += 1e-10),
    ("a dof that is no number", |a| a[0].u[5] = f64::NAN),
    ("an infinite dof", |a| a[1].u[5] = f64::NEG_INFINITY),
];

#[test]
fn every_fault_of_an_answer_is_no_agreement() {
    assert_eq!(
        judged(honest("a"), honest("b")).unwrap().verdict,
        Verdict::Agree
    );
    for (name, change) in FAULTS {
        let faulty = |name| Changed {
            change,
            ..honest(name)
        };
        for (a, b) in [(honest("a"), faulty("b")), (faulty("a"), honest("b"))] {
            let outcome = judged(a, b).unwrap();
            assert_eq!(outcome.verdict, Verdict::Disagree, "{name}");
            assert!(outcome.cases.iter().any(|c| c.verdict == Verdict::Disagree));
        }
    }
    // An answer that solves the scheme, and reports that it does not.
    let modest = Changed {
        change: |answers| answers[2].converged = false,
        ..honest("b")
    };
    let outcome = judged(honest("a"), modest).unwrap();
    assert_eq!(outcome.verdict, Verdict::Undetermined);
    let early = |name| Changed {
        stop: |stop| Stop {
            max_iterations: 2,
            ..stop
        },
        ..honest(name)
    };
    let outcome = judged(honest("a"), early("b")).unwrap();
    assert_eq!(
        outcome.verdict,
        Verdict::Disagree,
        "a step that is not the last"
    );
}

#[test]
fn the_same_fault_in_both_codes_is_seen_by_the_residual() {
    let both = |name| Changed {
        change: |answers| answers[0].u.iter_mut().for_each(|v| *v *= 1.0 + 1e-6),
        ..honest(name)
    };
    let outcome = judged(both("a"), both("b")).unwrap();
    assert_eq!(outcome.verdict, Verdict::Disagree);
    let case = &outcome.cases[0];
    assert!(case.pairs.iter().all(|p| p.field.verdict == Verdict::Agree));
    assert!(case.engines.iter().all(|e| e.verdict == Verdict::Disagree));
}

#[test]
fn codes_that_differ_disagree_though_both_solve_the_scheme() {
    // The backward error of this is at most half of it; see the tests of diagnoses.
    let scaled = Changed {
        change: |answers| answers[0].u.iter_mut().for_each(|v| *v *= 1.0 + 1.9e-12),
        ..honest("b")
    };
    let outcome = judged(honest("a"), scaled).unwrap();
    let case = &outcome.cases[0];
    assert!(case.engines.iter().all(|e| e.verdict == Verdict::Agree));
    assert!(
        case.pairs
            .iter()
            .any(|p| p.field.verdict == Verdict::Disagree)
    );
    let verdicts = (case.verdict, outcome.verdict);
    assert_eq!(verdicts, (Verdict::Disagree, Verdict::Disagree));
}

#[test]
fn a_code_is_not_judged_against_itself_or_alone() {
    let told = judged(honest("a"), honest("a")).unwrap_err().to_string();
    assert!(told.contains("named twice"), "{told}");
}
