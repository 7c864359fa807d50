//! Invariance under units: a power of two in coordinates or data changes no digit of the answer.

use super::bodies::FLOATING;
use super::scaling::{moved, scaled_data};
use super::trial::Place;
use crate::engine;
use faceoff_fem::contact::{Iteration, Method, Solution, Stop, solve_by};
use faceoff_fem::linear::{Precision, Settings, Solver};
use faceoff_fem::scene::Scene;

const METHODS: [&str; 8] = [
    "cr",
    "cr-fc",
    "p1",
    "p2",
    "p1-vi",
    "cr-vi",
    "penalty",
    "multiplier",
];

/// A floating box, pressed down.
fn floating_box() -> Scene {
    let text = FLOATING
        .replace("union-jack", "union-cube\"\nn = 3\nsize = [1, 1, 1]\n# \"")
        .replace("\"top\"", "\"top\", \"front\", \"back\"")
        .replace("f = \"1\"", "f = \"1+x-2*z*z\"");
    Scene::parse(&text).unwrap()
}

fn scenes() -> Vec<(Scene, usize)> {
    let named = [("manufactured-3", 8), ("plate", 16), ("block", 4)];
    let mut scenes: Vec<_> = named
        .map(|(name, n)| (Scene::find(name).unwrap(), n))
        .into();
    scenes.push((Scene::parse(FLOATING).unwrap(), 8));
    scenes.push((floating_box(), 3));
    scenes
}

fn solved(place: &Place, method: Method, settings: Settings) -> Solution {
    let setup = place.setup(method, &engine::Settings::default()).unwrap();
    let problem = setup.case().unwrap().problem;
    let go_on = |_, _| Ok(());
    let solution = solve_by(
        &problem,
        Iteration::Newton,
        Stop::default(),
        settings,
        go_on,
    );
    solution.unwrap_or_else(|e| panic!("{} {method} {settings:?}: {e}", place.scene.name()))
}

/// The same bits, with another exponent.
fn assert_same(a: &Solution, b: &Solution, factor: f64, name: &str) {
    let first = a.u.iter().zip(&b.u).position(|(a, b)| a * factor != *b);
    if let Some(i) = first {
        panic!(
            "{name}: dof {i} is {:e} and not {:e}",
            b.u[i],
            a.u[i] * factor
        );
    }
    assert_eq!(a.increments, b.increments, "{name}");
    assert_eq!((a.ended, &a.changes), (b.ended, &b.changes), "{name}");
}

fn check(places: impl Fn(&Place) -> Vec<(String, Place, f64)>) {
    let mut compared = 0;
    for (scene, n) in scenes() {
        let home = Place::of(&scene, Some(n)).unwrap();
        for method in METHODS {
            let method: Method = method.parse().unwrap();
            let mut ways = vec![Settings::default()];
            if method == Method::cr() || method == Method::cr_fc() {
                for solver in [Solver::Faer, Solver::Iterative, Solver::Multifrontal] {
                    let precision = if solver == Solver::Multifrontal {
                        Precision::F32Refined
                    } else {
                        Precision::F64
                    };
                    ways.push(Settings { solver, precision });
                }
            }
            let is_held = !home.scene.boundary().dirichlet.is_empty();
            // Fixed point iterations need a domain with Dirichlet values.
            ways.retain(|way| is_held || way.solver != Solver::Iterative);
            for settings in ways {
                let here = solved(&home, method, settings);
                for (what, place, factor) in places(&home) {
                    let there = solved(&place, method, settings);
                    let name = format!(
                        "{} {method} {} {} {what}",
                        home.scene.name(),
                        settings.solver,
                        settings.precision
                    );
                    assert_same(&here, &there, factor, &name);
                    compared += here.u.len();
                }
            }
        }
    }
    assert!(compared > 100_000);
}

#[test]
fn a_power_of_two_in_the_data_changes_no_digit() {
    check(|home| {
        let scaled = |k: i32| {
            let factor = 2.0_f64.powi(k);
            let mut place = home.clone();
            let data = scaled_data(home.scene.data(), factor).unwrap();
            place.scene = home.scene.with_data(data);
            (format!("data × 2^{k}"), place, factor)
        };
        [-400, -3, 400].map(scaled).into()
    });
}

#[test]
fn a_power_of_two_in_the_coordinates_changes_no_digit() {
    check(|home| {
        let scaled = |k: i32| {
            let place = moved(home, 2.0_f64.powi(k), 0.0).unwrap();
            (format!("coordinates × 2^{k}"), place, 1.0)
        };
        [-40, -1, 40].map(scaled).into()
    });
}
