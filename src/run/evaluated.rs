//! The evaluation of an answer: its errors if the solution is known, its quantities, and its certificate.

use faceoff_fem::certify::{Certificate, Target};
use faceoff_fem::contact::{Errors, Problem, Quantities, quantities};
use faceoff_fem::known::Truth;
use faceoff_mesh::error::{Error, Result};

/// An answer in comparison with what is known.
#[derive(Debug)]
pub struct Evaluated {
    /// Functionals of u_h.
    pub quantities: Quantities,
    /// Relative to the solution; `None` if it is unknown, or u is not finite.
    pub errors: Option<Errors>,
}

impl Evaluated {
    /// Evaluates u at all dofs of the problem's space.
    ///
    /// # Errors
    /// A known solution that is not finite.
    pub fn new(problem: &Problem, u: &[f64], truth: Option<&Truth>) -> Result<Self> {
        let quantities = quantities(problem, u);
        let known = truth.filter(|_| quantities.grad_norm_sq.is_finite());
        Ok(Evaluated {
            errors: known.map(|truth| truth.errors(problem, u)).transpose()?,
            quantities,
        })
    }
}

/// The relative uncertainty of a measured error: twice the accuracy of its quadrature.
const MEASURED: f64 = 2e-3;
/// The uncertainty relative to ‖∇u‖, for the square root of a sum with cancellation.
const CANCELLED: f64 = 1e-6;

/// Refuses an error ‖∇(u - u_h)‖ / ‖∇u‖ that the certificate of the same field excludes: the reported error is within the certified bound.
///
/// # Errors
/// [`Error::Contradiction`].
pub fn consistent(h1: Option<f64>, certificate: &Certificate) -> Result<()> {
    let Some(h1) = h1 else { return Ok(()) };
    let [least, most] = certificate.of(Target::UH);
    let [low, high] = certificate.gradient;
    let is_within = h1 * low <= most * (1.0 + MEASURED) + CANCELLED * low
        && h1 * high >= least * (1.0 - MEASURED) - CANCELLED * high;
    if is_within {
        return Ok(());
    }
    Err(Error::Contradiction {
        what: format!(
            "the error ‖∇(u - u_h)‖ / ‖∇u‖ = {h1:e} was measured, and {least:e} ≤ ‖∇(u - u_h)‖ ≤ {most:e}, {low:e} ≤ ‖∇u‖ ≤ {high:e} were proved"
        ),
    })
}

/// The certificate, or why there is none.
///
/// # Errors
/// Errors other than a refusal: those of the linear solver, and an interruption.
pub fn certificate<T>(found: Result<T>) -> Result<Result<T, String>> {
    match found {
        Ok(certified) => Ok(Ok(certified)),
        Err(Error::Certificate { because, .. }) => Ok(Err(because)),
        Err(other) => Err(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_fem::certify::certify;
    use faceoff_fem::contact::{Discretisation, Iteration, Method, Stop, solve};
    use faceoff_fem::scene::Scene;
    use rayon::prelude::*;

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

    /// An error of 0, as the rule of the scheme would give for this answer, and one that is too large.
    #[test]
    fn an_error_outside_of_its_bounds_is_a_contradiction() {
        let scene = Scene::find("one-zone").unwrap();
        let mesh = scene.triangulation(Some(8)).unwrap();
        let mut discretisation = Discretisation::of(&scene, Method::p2());
        discretisation.load_quadrature = Some("centroid".into());
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let solved = solve(&problem, Iteration::Newton, Stop::default(), |_, _| Ok(())).unwrap();
        let certificate = certify(&problem, &solved.u).unwrap();
        let truth = Truth::of(&scene).unwrap();
        let of = Evaluated::new(&problem, &solved.u, truth.as_ref()).unwrap();
        let h1 = of.errors.unwrap().h1;
        assert!(consistent(Some(h1), &certificate).is_ok());
        for wrong in [0.0, 2.0 * certificate.relative(Target::UH)] {
            let refused = consistent(Some(wrong), &certificate).unwrap_err();
            assert!(matches!(refused, Error::Contradiction { .. }), "{refused}");
        }
    }

    /// The error and the certificate of one answer; `None` if there is no answer, or no certificate.
    fn checked(name: &str, method: &str, gamma0: f64, rule: &str) -> Option<Result<()>> {
        let scene = Scene::find(name).unwrap();
        let truth = Truth::of(&scene).unwrap().unwrap();
        let mesh = scene.triangulation(Some(4)).unwrap();
        let method: Method = method.parse().unwrap();
        let mut discretisation = Discretisation::of(&scene, method);
        discretisation.gamma0 = gamma0;
        discretisation.load_quadrature = Some(rule.to_owned());
        let problem = Problem::new(&scene, &mesh, &discretisation).ok()?;
        let solved = solve(&problem, Iteration::Newton, Stop::default(), |_, _| Ok(())).ok()?;
        let certificate = certificate(certify(&problem, &solved.u)).unwrap().ok()?;
        let errors = Evaluated::new(&problem, &solved.u, Some(&truth))
            .unwrap()
            .errors;
        Some(consistent(errors.map(|e| e.h1), &certificate))
    }

    /// Every 2D scene whose solution is known with every method, and the paper's two with γ₀ over nine decades and every rule
    /// of the load.
    #[test]
    fn every_error_lies_within_what_is_certified() {
        let usual = |scene| METHODS.map(|method| (scene, method, 1.0, "radon-7"));
        let mut all: Vec<_> = Scene::exact_names().into_iter().flat_map(usual).collect();
        for scene in ["one-zone", "three-zones"] {
            for gamma0 in [1e-3, 1.0, 1e6] {
                for rule in ["radon-7", "edges-3", "centroid"] {
                    all.extend(METHODS.map(|method| (scene, method, gamma0, rule)));
                }
            }
        }
        let of = |&(scene, method, gamma0, rule): &(&str, &str, f64, &str)| {
            let found = checked(scene, method, gamma0, rule)?;
            let told = |error| format!("{scene} {method} γ₀ = {gamma0:e} {rule}: {error}");
            Some(found.err().map(told))
        };
        let in_turn = all
            .iter()
            .enumerate()
            .filter(|(k, _)| crate::run::is_in_turn(*k, 7));
        let all: Vec<_> = in_turn.map(|(_, case)| case).collect();
        let found: Vec<Option<String>> = all.par_iter().copied().filter_map(of).collect();
        assert!(
            4 * found.len() > 3 * all.len(),
            "{} of {}",
            found.len(),
            all.len()
        );
        let wrong: Vec<String> = found.into_iter().flatten().collect();
        assert!(wrong.is_empty(), "{wrong:#?}");
    }
}
