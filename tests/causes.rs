//! Random faults in random scenes: those that the dictionary has are named, and no others are accused.

use std::sync::Arc;

use crate::common::{folder, times, write};
use crate::false_alarms::any_scene;
use faceoff::engine::{Settings, Silent};
use faceoff::run::{Datum, Runner, Setup, Variation, Written};
use faceoff::why::{Aspect, Explanation, Findings, examine};
use faceoff_fem::contact::{Iteration, Method, Stop, solve_by};
use faceoff_fem::quadrature;
use faceoff_fem::scene::{Expression, Scene};
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

/// Faults that are drawn, and the part of them that must be named.
const FAULTS: usize = 150;
const NAMED: f64 = 0.98;
/// A fault that leaves less is none.
const SHOWS: f64 = 1e-9;
/// In fewer rows than on three faces causes cannot be told apart.
const ROWS: usize = 9;

/// What is planted, and the words that say it, with the number behind `×`.
#[derive(Debug, Clone)]
struct Fault {
    variation: Variation,
    said: String,
    factor: Option<f64>,
}

/// From 1e-6 to 2 off, either way.
fn factor(draw: &mut impl FnMut() -> f64) -> f64 {
    let size = 2.0 * 10_f64.powf(-6.3 * draw());
    1.0 + if draw() < 0.5 { size } else { -0.4 * size }
}

fn fault(setup: &Setup, draw: &mut impl FnMut() -> f64) -> Fault {
    let data = Datum::ALL;
    let datum = data[(4.0 * draw()) as usize];
    let name = datum.name();
    let rules = |dim: usize, draw: &mut dyn FnMut() -> f64| {
        let names = quadrature::names(dim);
        names[(names.len() as f64 * draw()) as usize]
    };
    let plain = |variation, said: String| Fault {
        variation,
        said,
        factor: None,
    };
    match (8.0 * draw()) as usize {
        0 | 1 => {
            let factor = factor(draw);
            Fault {
                variation: Variation::Scaled(datum, factor),
                said: format!("{name} is × "),
                factor: Some(factor),
            }
        }
        2 | 3 => {
            let factor = factor(draw);
            Fault {
                variation: Variation::Gamma0(factor * setup.discretisation.gamma0()),
                said: "γ is × ".into(),
                factor: Some(factor),
            }
        }
        4 => {
            let rule = rules(2, draw);
            let said = format!("(f,v) is integrated by {rule}, ");
            plain(Variation::LoadRule(rule.into()), said)
        }
        5 => {
            let rule = rules(1, draw);
            let said = format!("Γ_C is integrated by {rule}, ");
            plain(Variation::ContactRule(rule.into()), said)
        }
        6 => plain(
            Variation::Negated(datum),
            format!("{name} has the other sign"),
        ),
        _ => {
            let size = factor(draw) - 1.0;
            plain(Variation::Shifted(datum, 0.1 * size), format!("{name} is "))
        }
    }
}

impl Fault {
    /// Is it what an explanation says?
    fn is(&self, explanation: &Explanation) -> bool {
        let what = explanation.what.to_string();
        let Some(at) = what.find(&self.said) else {
            return false;
        };
        let Some(factor) = self.factor else {
            return true;
        };
        let number = &what[at + self.said.len()..];
        let end = number.find(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c)));
        let found: f64 = number[..end.unwrap_or(number.len())]
            .trim_end_matches('.')
            .parse()
            .unwrap();
        // Three digits of what is more or less than 1.
        (found - factor).abs() <= 2e-2 * (factor - 1.0).abs()
    }
}

/// The same scenes on every machine; `FACEOFF_SEED` asks for others.
fn runner() -> (TestRunner, u64) {
    let seed = std::env::var("FACEOFF_SEED").map_or(1, |seed| seed.parse().unwrap());
    let bytes: Vec<u8> = (0..32).map(|k| (seed >> (k % 8)) as u8 ^ k as u8).collect();
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
    (TestRunner::new_with_rng(Config::default(), rng), seed)
}

fn solution(setup: &Setup) -> Option<Vec<f64>> {
    let case = setup.case().ok()?;
    let linear = setup.settings.linear;
    let told = |_, _| Ok(());
    let found = solve_by(
        &case.problem,
        Iteration::Newton,
        Stop::default(),
        linear,
        told,
    )
    .ok()?;
    (found.converged && found.u.iter().all(|u| u.is_finite())).then_some(found.u)
}

/// Do so many rows of a setup fail, each by so much?
fn shows(setup: &Setup, u: &[f64]) -> bool {
    let problem = setup.case().unwrap().problem;
    let rows = problem.rows(u);
    (0..u.len()).filter(|row| rows.error(*row) > SHOWS).count() >= ROWS
}

fn found(setup: &Setup, u: &[f64]) -> Findings {
    let settings = Settings::default();
    let runner = Runner::new(&settings, &Silent);
    examine(&runner, setup, u, Written::Binary64).unwrap()
}

/// The next scene, by a method of Nitsche's or another.
fn setup(runner: &mut TestRunner, settings: &Settings) -> Setup {
    let folder = folder();
    let (text, method, n) = any_scene().new_tree(runner).unwrap().current();
    let path = write(folder.path(), "random.toml", &text);
    let scene = Scene::find(&path.to_string_lossy()).unwrap();
    let method: Method = method.parse().unwrap();
    let mesh = Arc::new(scene.triangulation(Some(n)).unwrap());
    Setup::on(mesh, &scene, Some(n), method, settings)
}

#[test]
fn faults_in_random_scenes_are_named() {
    let settings = Settings::default();
    let (mut runner, seed) = runner();
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mut draw = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let (mut tried, mut missed) = (0, Vec::new());
    while tried < FAULTS * times() {
        let own = setup(&mut runner, &settings);
        let count = if draw() < 0.3 { 2 } else { 1 };
        let faults: Vec<Fault> = (0..count).map(|_| fault(&own, &mut draw)).collect();
        // Two of one datum are one.
        let about = |fault: &Fault| fault.said.split(' ').next().map(str::to_owned);
        if count == 2 && about(&faults[0]) == about(&faults[1]) {
            continue;
        }
        let planted = |faults: &[Fault]| {
            let mut all = faults.iter();
            all.try_fold(own.clone(), |setup, fault| {
                setup.with(&fault.variation).ok()
            })
        };
        let Some(u) = planted(&faults).and_then(|setup| solution(&setup)) else {
            continue;
        };
        // Without it rows fail, and more than a few, whose causes cannot be told apart.
        let shows = |k: usize| {
            let others: Vec<Fault> = [&faults[..k], &faults[k + 1..]].concat();
            planted(&others).is_some_and(|setup| shows(&setup, &u))
        };
        if !(0..faults.len()).all(shows) {
            continue;
        }
        let findings = found(&own, &u);
        let mut explained = findings.explanations.iter().filter(|e| e.accounts);
        tried += 1;
        if !explained.any(|e| faults.iter().all(|fault| fault.is(e))) {
            let said: Vec<String> = faults
                .iter()
                .map(|f| format!("{:?}", f.variation))
                .collect();
            missed.push(format!(
                "{} {}: {}",
                own.discretisation.method,
                said.join(" and "),
                findings.sentence()
            ));
        }
    }
    println!(
        "{} of {tried} not named\n{}",
        missed.len(),
        missed.join("\n")
    );
    assert!(
        missed.len() as f64 <= (1.0 - NAMED) * tried as f64,
        "{}",
        missed.join("\n")
    );
}

#[test]
fn faults_that_are_not_known_are_not_called_others() {
    let settings = Settings::default();
    let (mut runner, _) = runner();
    let (mut tried, mut accused) = (0, Vec::new());
    let waves = [
        "0.3*sin(7*x+2*y)",
        "1e-3*exp(x)*cos(5*y)",
        "0.05*sqrt(0.1+x*x+y)",
        "1e-5*(x*y-x^3+y*y)",
    ];
    let mut k = 0;
    while tried < FAULTS / 3 * times() {
        let own = setup(&mut runner, &settings);
        k += 1;
        let wave = waves[k % waves.len()];
        let mut data = own.scene.data().clone();
        let datum = match k / waves.len() % 3 {
            0 => &mut data.f,
            1 => &mut data.psi,
            _ => &mut data.t,
        };
        *datum = Expression::parse(&format!("({})+({wave})", datum.text())).unwrap();
        let changed = Setup {
            scene: own.scene.with_data(data),
            ..own.clone()
        };
        let Some(u) = solution(&changed) else {
            continue;
        };
        if !shows(&own, &u) {
            continue;
        }
        tried += 1;
        let findings = found(&own, &u);
        // Where contact is another one than the scheme's is what ψ has done.
        let culprit = findings.culprit().filter(|_| findings.is_of_scheme());
        if let Some(culprit) = culprit.filter(|e| e.ingredient != Aspect::Status) {
            let data = own.scene.data();
            accused.push(format!(
                "{} {wave}, n = {:?}, f = {}, ψ = {}, t = {}: {}, {} of {} rows, {:.1e}",
                own.discretisation.method,
                own.n,
                data.f.text(),
                data.psi.text(),
                data.t.text(),
                culprit.what,
                findings.failing,
                findings.rows,
                findings.residual
            ));
        }
    }
    println!(
        "{} of {tried} accused\n{}",
        accused.len(),
        accused.join("\n")
    );
    assert!(accused.is_empty(), "{}", accused.join("\n"));
}
