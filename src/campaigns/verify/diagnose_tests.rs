//! Codes with one known fault each, and the diagnosis for it.

use super::{VerifyRequest, diagnose, verify};
use crate::why::{Change, Diagnosis, Ingredient};

use crate::engine::{Answer, Case, Engine, Progress, Run, Settings, Silent};
use faceoff_fem::contact::{Discretisation, Method, Problem, Stop, solve_by};
use faceoff_fem::scene::{Expression, HRule, Scene};
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;

const N: usize = 6;

/// The Rust solver with a modified problem, stopping criterion or answer.
struct Faulty {
    name: &'static str,
    discretisation: fn(&mut Discretisation),
    data: fn(&Scene) -> Scene,
    max_iterations: fn(&Settings) -> usize,
    change: fn(&Problem, &mut [f64]),
}

impl Engine for Faulty {
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
        let answers = cases.iter().map(|case| {
            let of_case = &case.problem;
            let mut discretisation = of_case.discretisation.clone();
            (self.discretisation)(&mut discretisation);
            let data = (self.data)(case.scene());
            let problem = Problem::new(&data, of_case.space.mesh, &discretisation)?;
            let max_iterations = (self.max_iterations)(settings);
            let stop = Stop {
                max_iterations,
                ..settings.stop
            };
            let told = |_, _| Ok(());
            let linear = settings.linear;
            let mut found = solve_by(&problem, settings.iteration, stop, linear, told)?;
            (self.change)(&case.problem, &mut found.u);
            // It reports that regardless of the modification.
            found.converged = true;
            // The residual is that in the requested scheme.
            found.backward_error = of_case.backward_error(&found.u).0;
            Ok(Answer::new(found))
        });
        Ok(Run {
            version: "1".into(),
            answers: answers.collect::<Result<_>>()?,
        })
    }
}

const HONEST: Faulty = Faulty {
    name: "honest",
    discretisation: |_| {},
    data: Scene::clone,
    max_iterations: |settings| settings.stop.max_iterations,
    change: |_, _| {},
};

/// The named cause, and the sentence, for the one pair of these two.
fn named(a: Faulty, b: Faulty) -> (Vec<String>, String) {
    named_on("one-zone", a, b)
}

fn named_on(scene: &str, a: Faulty, b: Faulty) -> (Vec<String>, String) {
    let method: Method = "cr".parse().unwrap();
    let request = VerifyRequest {
        scenes: vec![Scene::find(scene).unwrap()],
        methods: vec![method],
        n: if scene == "one-zone" { vec![N] } else { vec![] },
        engines: vec![&a, &b],
        settings: Settings::default(),
        journal: None,
    };
    let outcome = verify(&request, &Silent).unwrap();
    assert_eq!(outcome.verdict, Verdict::Disagree);
    let mut findings = outcome.cases[0]
        .engines
        .iter()
        .filter_map(|e| e.findings.as_ref());
    let found = diagnose(&request, &outcome).unwrap();
    if let Some(findings) = findings.next().filter(|f| f.is_of_scheme()) {
        assert!(found.is_empty(), "nothing runs again");
        let all = findings.explanations.iter().filter(|e| e.accounts);
        assert!(all.clone().all(|e| e.left <= findings.limit));
        let mut names: Vec<String> = all.map(|e| e.ingredient.to_string()).collect();
        names.dedup();
        return (names, findings.sentence().to_string());
    }
    let [found] = &found[..] else {
        panic!("one pair disagrees: {found:?}")
    };
    let accounts = found.ingredients.iter().filter(|i| i.accounts);
    let mut names: Vec<String> = accounts.map(|i| i.change.of()).collect();
    names.dedup();
    for ingredient in &found.ingredients {
        assert_eq!(ingredient.accounts, ingredient.left <= 1e-12);
        assert!(ingredient.left >= 0.0, "{ingredient:?}");
    }
    assert!(found.difference > 1e-12);
    (names, found.sentence().to_string())
}

/// The scene, the expected cause, the fault of a code, and the expected sentence.
type Otherwise = (
    &'static str,
    &'static str,
    fn(&mut Discretisation),
    &'static str,
);

#[test]
fn what_of_the_scheme_a_code_does_otherwise_is_named_with_what_it_does() {
    let cases: [Otherwise; 4] = [
        (
            "one-zone",
            "the quadrature of the load",
            |s| s.load_quadrature = Some("edges-3".into()),
            "edges-3",
        ),
        (
            "one-zone",
            "the quadrature on Γ_C",
            |s| s.contact_quadrature = Some("gauss-2".into()),
            "gauss-2",
        ),
        ("one-zone", "γ", |s| s.gamma0 = 77.0, "γ₀ = 77"),
        // The cells differ in size.
        (
            "plate",
            "h",
            |s| s.h = HRule::Global,
            "h in γ = γ₀ h is global",
        ),
    ];
    for (on, name, discretisation, what) in cases {
        let other = Faulty {
            name: "other",
            discretisation,
            ..HONEST
        };
        let (names, sentence) = named_on(on, HONEST, other);
        assert_eq!(names[0], name, "{sentence}");
        assert!(sentence.contains(what), "{sentence}");
    }
}

#[test]
fn signs_and_data_that_are_left_out_are_named() {
    fn with(scene: &Scene, change: fn(&mut faceoff_fem::scene::Data)) -> Scene {
        let mut data = scene.data().clone();
        change(&mut data);
        scene.with_data(data)
    }
    let negated: fn(&Scene) -> Scene = |scene| {
        with(scene, |data| {
            data.f = Expression::parse("2*pi*sin(2*pi*x)").unwrap()
        })
    };
    let nothing: fn(&Scene) -> Scene =
        |scene| with(scene, |data| data.f = Expression::constant(0.0));
    for (data, what) in [(negated, "f has the other sign"), (nothing, "f is 0")] {
        let other = Faulty {
            name: "other",
            data,
            ..HONEST
        };
        let (names, sentence) = named(HONEST, other);
        assert_eq!(names[0], "f", "{sentence}");
        assert!(sentence.contains(what), "{sentence}");
    }
    // θ₁ = -1 instead of 1.
    let theta = Faulty {
        name: "other",
        discretisation: |d| d.method = "cr(-1,1)".parse().unwrap(),
        ..HONEST
    };
    let (names, sentence) = named(HONEST, theta);
    assert!(
        names[0] == "the method" && sentence.contains("it solves cr(-1,1), not cr"),
        "{sentence}"
    );
}

#[test]
fn a_code_that_stops_early_has_the_status_of_the_step_before() {
    let early = Faulty {
        name: "early",
        max_iterations: |settings| {
            if settings.stop.increment < 1e-12 {
                50
            } else {
                2
            }
        },
        ..HONEST
    };
    assert_eq!(named(HONEST, early).0[0], "the contact status");
}

#[test]
fn a_code_that_depends_on_the_order_of_cells_is_found_out() {
    let ordered = Faulty {
        name: "ordered",
        change: |problem, u| {
            let mesh = problem.space.mesh;
            let first = mesh.cell(0).iter().map(|v| mesh.points[*v as usize]);
            // The cells begin at the origin, or end there.
            if first.into_iter().any(|p| p == [0.0; 3]) {
                u[3] += 1e-6;
            }
        },
        ..HONEST
    };
    assert_eq!(named(HONEST, ordered).0, ["the order of the mesh"]);
}

#[test]
fn an_inaccurate_factor_of_the_rust_engine_is_the_linear_solvers() {
    let inaccurate = Faulty {
        name: "rust",
        change: |_, u| u[3] *= 1.0 + 1e-6,
        ..HONEST
    };
    assert_eq!(named(inaccurate, HONEST).0, ["the linear solver"]);
}

#[test]
fn of_two_answers_to_one_linear_system_none_is_to_blame() {
    // With g = ψ = 0 the scheme scales with u except for the load, which is at most half of all terms of a row: the
    // backward error is at most half of this factor, and so below 1e-12.
    let smooth = Faulty {
        name: "smooth",
        change: |_, u| u.iter_mut().for_each(|v| *v *= 1.0 + 1.9e-12),
        ..HONEST
    };
    let (names, sentence) = named(HONEST, smooth);
    assert!(names.is_empty(), "{names:?}");
    assert!(sentence.contains("badly conditioned"), "{sentence}");
}

#[test]
fn the_sentence_names_what_accounts_and_how_much() {
    let ingredient = |change: Change, left: f64| Ingredient {
        change,
        matched: "edges-3".into(),
        left,
        accounts: left <= 1e-12,
    };
    let mut found = Diagnosis {
        scene: "s".into(),
        method: "cr".into(),
        n: None,
        a: "a".into(),
        b: "b".into(),
        difference: 1e-3,
        ingredients: vec![
            ingredient(Change::Load, 2e-15),
            ingredient(Change::Start, 1e-3),
        ],
        is_one_system: false,
    };
    assert_eq!(
        found.sentence().to_string(),
        "the quadrature of the load accounts for it: with edges-3 the difference falls from 1.0e-3 to 2.0e-15."
    );
    found.ingredients.remove(0);
    assert!(
        found
            .sentence()
            .to_string()
            .starts_with("nothing that was matched accounts")
    );
}
