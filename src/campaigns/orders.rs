//! Observed orders of convergence for known u, compared with theory.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde::Serialize;

use crate::engine::{self, Progress, Settings, Silent};
use crate::run::{Observed, Runner, Setup, check_meshes};
use faceoff_fem::contact::{Errors, Method};
use faceoff_fem::known::Truth;
use faceoff_fem::scene::Scene;
use faceoff_fem::truth::exact::Regularity;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};

/// One method on one scene over several meshes.
#[derive(Debug, Clone, Serialize)]
pub struct Orders {
    /// The name of the scene.
    pub scene: String,
    /// The name of the method.
    pub method: String,
    /// `None` if the regularity of the solution is not stated.
    pub theory: Option<Theory>,
    /// By ascending n.
    pub levels: Vec<ErrorsOnMesh>,
    /// The order of the relative error in the energy norm.
    pub h1: Observed,
    /// The order of the relative error in L².
    pub l2: Observed,
    /// The comparison with theory in the energy norm; `None` if theory does not apply.
    pub h1_verdict: Option<Reach>,
    /// The same in L².
    pub l2_verdict: Option<Reach>,
}

/// An observed order compared with the theoretical one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reach {
    /// The fit reaches it.
    AsTheory,
    /// The fit does not reach it, but the order still changes from mesh to mesh: the solution is not resolved, or the position of a transition in its
    /// cell dominates. Finer meshes decide.
    NotSettled,
    /// The order has settled below.
    Below,
}

/// A fit that is below theory by at most this reaches it.
const ROOM: f64 = 0.1;
/// Consecutive orders that differ by less have settled.
const SETTLED: f64 = 0.02;

impl Reach {
    /// `None` without a fit; errors at rounding level have no order.
    fn new(observed: &Observed, theory: f64, finest: f64) -> Option<Self> {
        let fit = observed.fit?;
        if finest < ROUNDING {
            return None;
        }
        let settled = match observed.steps.as_slice() {
            [.., before, last] => (last - before).abs() < SETTLED,
            _ => false,
        };
        Some(match (fit >= theory - ROOM, settled) {
            (true, _) => Reach::AsTheory,
            (false, false) => Reach::NotSettled,
            (false, true) => Reach::Below,
        })
    }
}

/// Relative errors below this are rounding.
const ROUNDING: f64 = 1e-12;

/// One mesh.
#[derive(Debug, Clone, Serialize)]
pub struct ErrorsOnMesh {
    /// The refinement.
    pub n: usize,
    /// The number of dofs of the space, including those on Γ_D.
    pub dofs: usize,
    /// Steps of Newton's method, or of the active set method.
    pub steps: usize,
    /// Did the iteration reach its tolerance?
    pub converged: bool,
    /// Errors relative to u.
    #[serde(flatten)]
    pub errors: Errors,
}

/// The orders that theory states.
///
/// H¹: with u just outside of H^s an element of degree k has min(k, s-1). L²: duality adds the regularity of the
/// dual problem: 1 on the convex domains here, and 1/2 if Γ_C changes between
/// contact and not, or meets Γ_D, on a straight side. That is a lower bound, usually exceeded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Theory {
    /// The order in the energy norm.
    pub h1: f64,
    /// The limiting factor.
    pub h1_limited_by: Limit,
    /// The lower bound of the order in L².
    pub l2: f64,
    /// The limiting factor.
    pub l2_limited_by: Limit,
}

/// The factor that limits an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Limit {
    /// The regularity of u, or of the dual solution.
    Regularity,
    /// The degree of the element, or the consistency of the method.
    Method,
}

impl Theory {
    /// For a method and a solution; the flag says whether f vanishes everywhere.
    pub fn new(method: &Method, regularity: Regularity, load_free: bool) -> Self {
        let degree = method.element.degree() as f64;
        let smooth = regularity.sobolev - 1.0;
        let (h1, h1_limited_by) = if smooth < degree {
            (smooth, Limit::Regularity)
        } else {
            (degree, Limit::Method)
        };
        let (gain, dual) = if regularity.changes {
            (0.5, Limit::Regularity)
        } else {
            (1.0, h1_limited_by)
        };
        let consistency = method.law.highest_order(method.element, load_free);
        let (l2, l2_limited_by) = if h1 + gain > consistency {
            (consistency, Limit::Method)
        } else {
            (h1 + gain, dual)
        };
        Theory {
            h1,
            h1_limited_by,
            l2,
            l2_limited_by,
        }
    }
}

/// The errors and orders of every method on every scene, on finer and finer meshes `n`.
///
/// # Errors
/// Meshes that do not give an order; a scene whose solution is not known; errors of the solver; an interruption. An iteration that
/// does not converge is not an error: its level records that.
pub fn orders(
    scenes: &[Scene],
    methods: &[Method],
    n: &[usize],
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Vec<Orders>> {
    check_meshes(n)?;
    let mut studies = Vec::new();
    for scene in scenes {
        let truth = Truth::of(scene)?.ok_or_else(|| Error::Scene {
            scene: scene.name().to_owned(),
            place: "exact".into(),
            what: "its solution is not known, so there are no errors to take orders of".into(),
            remedy: "give u under [exact], or one of the built-in scenes that have it".into(),
        })?;
        let truth = Arc::new(truth);
        let of = |method: &Method| (scene, Arc::clone(&truth), *method);
        studies.extend(methods.iter().map(of));
    }
    let runner = Runner::new(settings, &Silent);
    let (begun, total) = (AtomicUsize::new(0), studies.len() * n.len());
    studies
        .into_par_iter()
        .map(|(scene, truth, method)| {
            let setup = |n: usize| {
                cancel::check()?;
                let share = begun.fetch_add(1, Ordering::Relaxed) as f64 / total as f64;
                progress.next(&format!("{}, {method}, n = {n}", scene.name()), share);
                Setup::new(scene, Some(n), method, settings)
            };
            series(&runner, &truth, n, setup)
        })
        .collect()
}

/// One setup on finer and finer meshes.
fn series(
    runner: &Runner,
    truth: &Truth,
    n: &[usize],
    setup: impl Fn(usize) -> Result<Setup>,
) -> Result<Orders> {
    let rust = engine::find(engine::OWN)?;
    let mut levels = Vec::with_capacity(n.len());
    let mut theory = None;
    let (mut scene, mut method) = (String::new(), String::new());
    for &n in n {
        let setup = setup(n)?;
        let case = setup.case()?;
        let answers = runner.answers(&*rust, &[&case])?;
        let answer = answers
            .of(0)
            .ok_or_else(|| Error::engine(engine::OWN, "it gave no answer", "report this"))?;
        levels.push(ErrorsOnMesh {
            n,
            dofs: case.problem.space.dofs,
            steps: answer.increments.len(),
            converged: answer.converged,
            errors: truth.errors(&case.problem, &answer.u)?,
        });
        let of = setup.discretisation.method;
        (scene, method) = (setup.scene.name().to_owned(), of.to_string());
        let load_free = setup.scene.data().f.is_zero();
        theory = (setup.scene.regularity()).map(|known| Theory::new(&of, known, load_free));
    }
    let of =
        |error: fn(&Errors) -> f64| Observed::new(levels.iter().map(|l| (l.n, error(&l.errors))));
    let (h1, l2) = (of(|e| e.h1), of(|e| e.l2));
    let finest = levels.last().map(|l| l.errors);
    let reach = |observed: &Observed, order: fn(&Theory) -> f64, error: fn(&Errors) -> f64| {
        Reach::new(observed, order(theory.as_ref()?), error(finest.as_ref()?))
    };
    Ok(Orders {
        h1_verdict: reach(&h1, |t| t.h1, |e| e.h1),
        l2_verdict: reach(&l2, |t| t.l2, |e| e.l2),
        scene,
        method,
        theory,
        h1,
        l2,
        levels,
    })
}

/// The name in JSON.
impl std::fmt::Display for Limit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.serialize(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Variation;

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

    fn study(scenes: &[&str], n: &[usize]) -> Vec<Orders> {
        let scenes: Vec<Scene> = scenes.iter().map(|s| Scene::find(s).unwrap()).collect();
        let methods = METHODS.map(|m| m.parse().unwrap());
        orders(&scenes, &methods, n, &Settings::default(), &Silent).unwrap()
    }

    #[test]
    fn observed_orders_are_those_of_theory() {
        let all = study(&["transition-1.5", "contact-nowhere"], &[8, 16, 32]);
        let text = format!("{all:#?}");
        for o in &all {
            let name = format!("{} {}\n{text}", o.scene, o.method);
            let theory = o.theory.unwrap();
            assert!(o.levels.iter().all(|l| l.converged), "{name}");
            let (h1, l2) = (o.h1.fit.unwrap(), o.l2.fit.unwrap());
            assert!((h1 - theory.h1).abs() < 0.12, "{name}");
            assert!(l2 > theory.l2 - 0.12, "{name}");
        }
    }

    /// Each on meshes fine enough for it: those that do not show their order yet get finer ones.
    #[test]
    fn every_exact_scene_converges_with_every_method() {
        for (k, scene) in Scene::exact_names().into_iter().enumerate() {
            let methods = (k..)
                .zip(METHODS)
                .filter(|(k, _)| crate::run::is_in_turn(*k, 5));
            let mut left: Vec<Method> = methods.map(|(_, m)| m.parse().unwrap()).collect();
            for n in [[8, 16, 32], [16, 32, 64], [32, 64, 128]] {
                let scenes = [Scene::find(scene).unwrap()];
                let all = orders(&scenes, &left, &n, &Settings::default(), &Silent).unwrap();
                left.clear();
                for o in &all {
                    let name = format!("{} {}\n{all:#?}", o.scene, o.method);
                    assert!(o.levels.iter().all(|l| l.converged), "{name}");
                    // If the method is exact, there is only rounding.
                    match o.h1_verdict {
                        Some(Reach::AsTheory) | None => {
                            assert!(o.l2_verdict != Some(Reach::Below), "{name}");
                        }
                        _ => left.push(o.method.parse().unwrap()),
                    }
                }
                if left.is_empty() {
                    break;
                }
            }
            assert!(
                left.is_empty(),
                "{scene} does not reach its order with {left:?}"
            );
        }
    }

    /// In 3D, on meshes that are fast enough in the debug build. The checkerboard needs finer ones, and the order of p2
    /// depends on the position of a transition in its cell.
    #[test]
    fn observed_orders_in_space_are_those_of_theory() {
        let mut all = Vec::new();
        for (k, scene) in (0..).zip(Scene::exact_names_3d()) {
            let methods = (k..).zip([Method::cr(), Method::cr_fc(), Method::p2()]);
            let methods: Vec<Method> = methods
                .filter(|(k, _)| crate::run::is_in_turn(*k, 3))
                .map(|(_, method)| method)
                .collect();
            let scenes = [Scene::find(scene).unwrap()];
            all.extend(orders(&scenes, &methods, &[4, 8], &Settings::default(), &Silent).unwrap());
        }
        let text = format!("{all:#?}");
        for o in &all {
            let name = format!("{} {}\n{text}", o.scene, o.method);
            assert!(o.levels.iter().all(|l| l.converged), "{name}");
            let theory = o.theory.unwrap();
            let room = match (o.scene.as_str(), o.method.as_str()) {
                ("checkerboard", _) => 0.5,
                ("transition-1.5-3d" | "hertz-sphere", "p2") => 0.3,
                _ => 0.1,
            };
            assert!(o.h1.fit.unwrap() > theory.h1 - room, "{name}");
        }
        let smooth = all
            .iter()
            .filter(|o| o.theory.unwrap().h1_limited_by == Limit::Method);
        let mut held = 0;
        for o in smooth.filter(|o| o.scene != "checkerboard") {
            held += 1;
            assert!(
                o.l2.fit.unwrap() > o.theory.unwrap().l2 - 0.1,
                "{} {}\n{text}",
                o.scene,
                o.method
            );
        }
        println!("{held} of {} orders in L²", all.len());
        assert!(held > 1, "{text}");
    }

    /// Without contact, the penalty-free law leaves a flux of order h/γ₀ on Γ_C, and the order
    /// in L² falls to 1; with the corrected flux it stays 2 for every γ₀.
    #[test]
    fn the_corrected_flux_has_second_order_for_every_gamma() {
        let methods = [Method::cr(), Method::cr_fc()];
        for gamma0 in [0.1, 1.0, 10.0, 100.0] {
            let scene = Scene::find("contact-nowhere").unwrap();
            let truth = Truth::of(&scene).unwrap().unwrap();
            let settings = Settings::default();
            let runner = Runner::new(&settings, &Silent);
            let all = methods.map(|method| {
                let setup = |n| {
                    let setup = Setup::new(&scene, Some(n), method, &settings)?;
                    setup.with(&Variation::Gamma0(gamma0))
                };
                series(&runner, &truth, &[16, 32, 64], setup).unwrap()
            });
            let [cr, fc] = [0, 1].map(|k| all[k].l2.steps[1]);
            assert!((fc - 2.0).abs() < 0.05, "{gamma0}: {fc}");
            assert!(gamma0 > 1.0 || (cr - 1.0).abs() < 0.1, "{gamma0}: {cr}");
            assert_eq!(all[1].theory.map(|t| t.l2), Some(2.0));
            assert_eq!(all[0].theory.map(|t| t.l2), Some(1.0));
        }
    }

    #[test]
    fn orders_are_judged_once_they_have_settled() {
        let judged = |errors: [f64; 3], theory: f64| {
            let n = [8, 16, 32];
            let observed = Observed::new(n.into_iter().zip(errors));
            Reach::new(&observed, theory, errors[2])
        };
        assert_eq!(judged([1.0, 0.5, 0.25], 1.0), Some(Reach::AsTheory));
        assert_eq!(judged([1.0, 0.5, 0.25], 1.2), Some(Reach::Below));
        assert_eq!(judged([1.0, 0.7, 0.35], 1.2), Some(Reach::NotSettled));
        assert_eq!(judged([1e-13, 1e-13, 1e-13], 1.0), None);
    }

    #[test]
    fn the_fit_is_over_the_last_three_meshes() {
        let errors: Vec<_> = [(4, 9.0), (8, 1.0), (16, 0.25), (32, 0.0625)].to_vec();
        assert!((Observed::new(errors.clone()).fit.unwrap() - 2.0).abs() < 1e-14);
        assert!(Observed::new(errors[..1].to_vec()).fit.is_none());
    }

    /// There is no formula for 6.1: the errors are with respect to the mesh-free solution.
    #[test]
    fn the_orders_of_one_zone_are_known() {
        let scenes = [Scene::find("one-zone").unwrap()];
        let methods = [Method::cr(), Method::p2()];
        let all = orders(
            &scenes,
            &methods,
            &[8, 16, 32],
            &Settings::default(),
            &Silent,
        )
        .unwrap();
        let theory = [0, 1].map(|k| all[k].theory.map(|of| [of.h1, of.l2]));
        assert_eq!(theory, [Some([1.0, 1.0]), Some([1.5, 2.0])]);
        let found = [0, 1].map(|k| all[k].h1.fit.unwrap());
        for (found, order) in found.into_iter().zip([1.0, 1.5]) {
            assert!(
                found > order - 0.1 && found < order + 0.3,
                "{found}: {all:#?}"
            );
        }
    }

    #[test]
    fn a_scene_without_a_solution_is_refused() {
        let scenes = [Scene::find("plate").unwrap()];
        let settings = Settings::default();
        let refusal = orders(&scenes, &[Method::cr()], &[16, 32], &settings, &Silent);
        let refusal = refusal.unwrap_err().to_string();
        assert!(refusal.contains("its solution is not known"), "{refusal}");
    }
}
