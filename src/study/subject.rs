//! A scene with what is known of its solution.

use crate::paper::reference_errors;
use faceoff_fem::contact::{Errors, Problem, errors};
use faceoff_fem::scene::Scene;
use faceoff_fem::truth::{DEFAULT_RESOLUTION, Reference};
use faceoff_mesh::error::Result;

/// A scene, and its truth.
#[derive(Clone)]
pub struct Subject {
    /// The name or the path that it was found by.
    pub argument: String,
    pub scene: Scene,
    /// May it name a mesh outside its folder?
    pub is_trusted: bool,
    truth: Truth,
}

#[derive(Clone)]
enum Truth {
    /// The scene's own formula.
    Exact,
    /// The mesh-free solution.
    Reference(Box<Reference>),
    /// Only bounds of the error are to be had.
    Unknown,
}

/// The scenes of 6.2, and the closed form that each has.
const CLOSED: [(&str, &str); 2] = [
    ("three-zones", "many-zones-3"),
    ("five-zones", "many-zones-5"),
];

impl Subject {
    /// A scene by a built-in's name or by the path of a TOML file.
    ///
    /// # Errors
    /// Those of [`Scene::find`].
    pub fn find(name: &str) -> Result<Self> {
        Self::new(name, Scene::find(name)?, false)
    }

    /// The same, wherever the scene's mesh lies.
    ///
    /// # Errors
    /// Those of [`Scene::find_anywhere`].
    pub fn find_anywhere(name: &str) -> Result<Self> {
        Self::new(name, Scene::find_anywhere(name)?, true)
    }

    fn new(name: &str, mut scene: Scene, is_trusted: bool) -> Result<Self> {
        if let Some((_, closed)) = CLOSED.iter().find(|(zones, _)| *zones == name) {
            scene.exact = Scene::find(closed)?.exact;
        }
        let truth = if scene.exact.is_some() {
            Truth::Exact
        } else if name == "one-zone" {
            Truth::Reference(Box::new(Reference::one_zone(DEFAULT_RESOLUTION)?))
        } else {
            Truth::Unknown
        };
        Ok(Subject {
            argument: name.to_owned(),
            scene,
            is_trusted,
            truth,
        })
    }

    /// The errors of u; none where the solution is not known.
    ///
    /// # Errors
    /// An exact solution that is not finite.
    pub fn errors(&self, problem: &Problem, u: &[f64]) -> Result<Option<Errors>> {
        match (&self.truth, &self.scene.exact) {
            (Truth::Exact, Some(exact)) => errors(&problem.space, u, exact).map(Some),
            (Truth::Reference(truth), _) => Ok(Some(reference_errors(problem, u, truth))),
            _ => Ok(None),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_fem::contact::{Iteration, Method, Stop, solve};

    /// The closed form and the mesh-free solution are two ways to one truth, and the elements' errors to the latter are
    /// computed in two ways.
    #[test]
    fn all_ways_to_the_truth_agree() {
        let closed = Subject::find("three-zones").unwrap();
        let reference = Subject {
            argument: closed.argument.clone(),
            scene: closed.scene.clone(),
            is_trusted: false,
            truth: Truth::Reference(Box::new(Reference::zones(3, DEFAULT_RESOLUTION).unwrap())),
        };
        let mesh = closed.scene.triangulation(Some(20)).unwrap();
        for method in [Method::cr(), "p1".parse().unwrap(), Method::p2()] {
            let problem = Problem::new(&closed.scene, &mesh, method).unwrap();
            let solution = solve(&problem, Iteration::Newton, Stop::default(), |_, _| Ok(()));
            let u = solution.unwrap().u;
            let [a, b] = [&closed, &reference].map(|s| s.errors(&problem, &u).unwrap().unwrap());
            assert!((a.h1 / b.h1 - 1.0).abs() < 5e-3, "{method}: {a:?} {b:?}");
            assert!((a.l2 / b.l2 - 1.0).abs() < 2e-2, "{method}: {a:?} {b:?}");
        }
        assert!(Subject::find("l-shape").unwrap().scene.exact.is_none());
    }
}
