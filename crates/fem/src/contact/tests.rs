//! The method against what is known of it without it.

use super::*;
use crate::element::{CR, Element, MAX_DOFS, P1, P2};
use crate::linear::Settings;
use crate::scene::{Boundary, Data, Expression, GroupName, Scene};
use faceoff_mesh::mesh::Triangulation;
use faceoff_mesh::mesh::generate::union_jack;

pub(super) fn square(n: usize) -> Triangulation {
    Triangulation::new("union-jack", &union_jack(n, [1.0, 1.0])).unwrap()
}

pub(super) fn scene(change: impl Fn(&mut Data, &mut Boundary)) -> Scene {
    let scene = Scene::find("one-zone").unwrap();
    let (mut data, mut boundary) = (scene.data().clone(), scene.boundary().clone());
    change(&mut data, &mut boundary);
    scene.with_data(data).with_boundary(boundary)
}

pub(super) fn with_gamma0(scene: &Scene, method: Method, gamma0: f64) -> Discretisation {
    Discretisation {
        gamma0,
        ..Discretisation::of(scene, method)
    }
}

pub(super) fn formula(text: &str) -> Expression {
    Expression::parse(text).unwrap()
}

pub(super) fn newton(problem: &Problem) -> Solution {
    let solution = solve(problem, Iteration::Newton, Stop::default(), |_, _| Ok(())).unwrap();
    assert!(solution.converged, "{:?}", solution.increments);
    solution
}

/// (2.5), assembled for itself: Chouly, Hild and Renard's form of the method.
///
/// (∇u,∇v) + γ⁻¹<[u - γ∂ₙu]₊, v + θ₁γ∂ₙv>_C + θ₁γ<∂ₙu, ∂ₙv>_C = (f,v); `flux_term` is that last θ₁.
fn form_2_5(problem: &Problem, u: &[f64], flux_term: f64) -> Vec<f64> {
    let mut r = problem.stiffness.times(u);
    for (r, b) in r.iter_mut().zip(&problem.load) {
        *r -= b;
    }
    let theta1 = problem.method().law.thetas()[0];
    for face in &problem.contact {
        let (gamma, local) = (face.gamma, problem.space.local(face.cell, u));
        for point in &face.points {
            let trace = point.trace(gamma, &local);
            let positive = (trace.gap - gamma * trace.flux).max(0.0);
            for (j, &dof) in problem.space.cell_dofs(face.cell).iter().enumerate() {
                r[dof as usize] += point.weight
                    * (positive / gamma * (point.phi[j] + theta1 * gamma * point.dn[j])
                        + flux_term * gamma * trace.flux * point.dn[j]);
            }
        }
    }
    r
}

#[test]
fn proposition_2_1_the_forms_2_4_and_2_5_are_one() {
    let mesh = square(6);
    for name in ["p2", "p1", "cr(1,1)", "p2(0,1)", "p2(-1,1)", "cr(-1,1)"] {
        let method: Method = name.parse().unwrap();
        let scene = scene(|_, _| {});
        let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method)).unwrap();
        let u: Vec<f64> = (0..problem.space.dofs)
            .map(|k| (12.9898 * k as f64).sin())
            .collect();
        let (a, theta1) = (problem.residual(&u), method.law.thetas()[0]);
        // With the other sign of the last term it must fail, or the test would see nothing.
        let same = |sign: f64| {
            let b = form_2_5(&problem, &u, sign * theta1);
            let size = b.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            (0..problem.space.dofs)
                .filter(|&i| problem.dirichlet[i].is_none())
                .all(|i| (a[i] - b[i]).abs() < 1e-13 * size)
        };
        assert!(same(1.0), "{name}");
        assert!(theta1 == 0.0 || !same(-1.0), "{name}");
    }
}

/// With contact everywhere and ψ = u linear the scheme is consistent: it returns u exactly.
#[test]
fn linear_solutions_are_exact() {
    let mesh = square(5);
    // u = y - 2 + 0.3 x: ∂ₙu = -1 on y = 0, contact; ψ = u there.
    let contact = scene(|data, _| {
        data.f = formula("0");
        data.g = formula("y - 2 + 0.3*x");
        data.t = formula("if(x < 0.5, -0.3, 0.3)");
        data.psi = formula("0.3*x - 2");
    });
    // u = -1 - y: ∂ₙu = 1 on y = 0 is not a contact solution; u = -1 with ∂ₙu = 0 is separated.
    let separated = scene(|data, _| {
        data.f = formula("0");
        data.g = formula("-1");
    });
    for name in [
        "cr",
        "cr-fc",
        "p1",
        "p2",
        "cr(1,1)",
        "p2(1,0)",
        "p1(0,1)",
        "p2(-1,1)",
        "p1-vi",
        "cr-vi",
        "multiplier",
    ] {
        let method: Method = name.parse().unwrap();
        for (scene, u) in [
            (&contact, formula("y - 2 + 0.3*x")),
            (&separated, formula("-1")),
        ] {
            // The symmetric member needs a small γ to be stable.
            let mut discretisation = Discretisation::of(scene, method);
            if method.law.thetas()[0] != 1.0 {
                discretisation.gamma0 = 0.01;
            }
            let problem = Problem::new(scene, &mesh, &discretisation).unwrap();
            let solution = newton(&problem);
            for (value, x) in solution.u.iter().zip(problem.space.points()) {
                assert!((value - u.value(x)).abs() < 1e-12, "{name}");
            }
        }
    }
}

/// u = r^{3/2} sin(3θ/2) on the half disc's square: contact for x > 0, u ∈ H^{5/2-ε}.
#[test]
fn a_transition_from_contact_to_non_contact_converges() {
    let u = "(x^2+y^2)^0.75*sin(1.5*atan2(y,x))";
    let scene = scene(|data, boundary| {
        data.f = formula("0");
        data.g = formula(u);
        *boundary = Boundary {
            dirichlet: ["top", "left", "right"]
                .map(|n| GroupName::Name(n.into()))
                .to_vec(),
            neumann: vec![],
            contact: vec![GroupName::Name("bottom".into())],
        };
    });
    let exact = formula(u);
    for (name, order) in [("cr", 1.0), ("p1", 1.0), ("p2", 1.5), ("p2(1,0)", 1.5)] {
        let errors: Vec<f64> = [8, 16, 32]
            .iter()
            .map(|&n| {
                let mut mesh = union_jack(n, [2.0, 1.0]);
                for p in mesh.points.to_mut() {
                    p[0] -= 1.0;
                }
                let mesh = Triangulation::new("half", &mesh).unwrap();
                let problem = Problem::new(
                    &scene,
                    &mesh,
                    &Discretisation::of(&scene, name.parse().unwrap()),
                )
                .unwrap();
                let solution = newton(&problem);
                let rule = crate::quadrature::rule(2, "radon-7").unwrap();
                let mut error = 0.0;
                for cell in 0..mesh.cell_count() {
                    let geometry = mesh.geometry(cell);
                    let local = problem.space.local(cell, &solution.u);
                    for (lambda, weight) in rule.iter() {
                        let x = geometry.point(&lambda);
                        let slope = |k: usize| {
                            let (mut up, mut down) = (x, x);
                            up[k] += 1e-5;
                            down[k] -= 1e-5;
                            (exact.value(up) - exact.value(down)) / 2e-5
                        };
                        let e = problem.space.slope(&geometry, &lambda, &local)
                            - nalgebra::Vector3::new(slope(0), slope(1), 0.0);
                        error += weight * geometry.measure() * e.norm_squared();
                    }
                }
                error.sqrt()
            })
            .collect();
        let observed = (errors[1] / errors[2]).log2();
        assert!((observed - order).abs() < 0.12, "{name}: {errors:?}");
    }
}

#[test]
fn the_newton_matrix_is_the_derivative_of_the_residual() {
    let mesh = square(4);
    let family = ["cr", "p1", "p2"].into_iter().flat_map(|element| {
        ["1,0", "1,1", "0,1", "-1,1"].map(|theta| format!("{element}({theta})"))
    });
    let others = ["cr-fc", "p1-vi", "cr-vi", "penalty", "multiplier"].map(String::from);
    for name in family.chain(others) {
        let method: Method = name.parse().unwrap();
        let scene = scene(|_, _| {});
        let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method)).unwrap();
        let u: Vec<f64> = (0..problem.space.dofs)
            .map(|k| (7.3 * k as f64).sin())
            .collect();
        // A step from u along -R is exact where no status changes: R(u + εδ) = (1-ε) R(u).
        let scheme = choose::system(scheme::Scheme::new(&problem), Settings::default()).unwrap();
        let law = |condition: &Condition| {
            let p = condition.trace(&u).p;
            if p > 0.0 { [0.0, 1.0] } else { [1.0, 0.0] }
        };
        let laws: Vec<_> = problem.conditions.iter().map(law).collect();
        let r = problem.residual(&u);
        let mut next = u.clone();
        solve::take_step(&*scheme, &laws, &mut next).unwrap();
        let step: Vec<f64> = next.iter().zip(&u).map(|(v, u)| v - u).collect();
        let size = step.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let epsilon = 1e-7 / size;
        let moved: Vec<f64> = u.iter().zip(&step).map(|(u, d)| u + epsilon * d).collect();
        let after = problem.residual(&moved);
        let free = (0..problem.space.dofs).filter(|&i| problem.dirichlet[i].is_none());
        let scale = free.fold(0.0, |m: f64, i| m.max(r[i].abs()));
        for i in 0..problem.space.dofs {
            if problem.dirichlet[i].is_none() {
                let error = after[i] - (1.0 - epsilon) * r[i];
                assert!(error.abs() < 1e-12 * scale, "{method} {i} {error:e}");
            }
        }
    }
}

#[test]
fn every_splitting_ends_at_newtons_solution() {
    let mesh = square(8);
    for (splitting, gamma0) in [
        ("lagged-p", 0.5),
        ("lagged-gap", 10.0),
        ("relaxed", 100.0),
        ("flux-new", 0.5),
    ] {
        let scene = scene(|_, _| {});
        let discretisation = with_gamma0(&scene, Method::cr(), gamma0);
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let reference = newton(&problem);
        let stop = Stop {
            increment: 1e-12,
            max_iterations: 2000,
        };
        let solution = solve(&problem, splitting.parse().unwrap(), stop, |_, _| Ok(())).unwrap();
        let steps = solution.increments.len();
        assert!(
            solution.converged,
            "{splitting}: {:?}",
            &solution.increments[steps - 4..]
        );
        assert!(solution.increments.len() > reference.increments.len());
        for (a, b) in solution.u.iter().zip(&reference.u) {
            assert!((a - b).abs() < 1e-9, "{splitting}");
        }
    }
}

#[test]
fn the_residual_sees_a_term_that_is_missing() {
    let mesh = square(8);
    let here = scene(|_, _| {});
    let problem = Problem::new(&here, &mesh, &Discretisation::of(&here, Method::cr())).unwrap();
    let solution = newton(&problem);
    assert!(problem.backward_error(&solution.u).0 < 1e-14);
    let mut other = problem.discretisation.clone();
    other.gamma0 *= 1.0 + 1e-6;
    let other = Problem::new(&here, &mesh, &other).unwrap();
    let error = other.backward_error(&solution.u).0;
    assert!(error > 1e-11, "{error:e}");
    let nan = vec![f64::NAN; problem.space.dofs];
    assert!(problem.backward_error(&nan).0.is_nan());
}

#[test]
fn nothing_that_holds_the_domain_is_refused() {
    let mesh = square(4);
    let neumann = |sign: &str| {
        scene(|data, boundary| {
            boundary.neumann.append(&mut boundary.dirichlet);
            data.f = formula(sign);
        })
    };
    let cr = Discretisation::of(&scene(|_, _| {}), Method::cr());
    let refusal = Problem::new(&neumann("-1"), &mesh, &cr).err();
    assert!(refusal.unwrap().to_string().contains("does not press it"));
    // Pressed on, only contact constrains it: -u'' = 1 with u = ψ at y = 0 and u' = 0 at y = 1. At the
    // start, u = 0, the obstacle may be out of reach.
    for method in [Method::cr(), Method::cr_fc(), Method::p2()] {
        for psi in ["0", "0.1", "0.1 + x"] {
            let scene = neumann("1");
            let scene = scene.with_data(Data {
                psi: formula(psi),
                ..scene.data().clone()
            });
            let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method)).unwrap();
            let solution = newton(&problem);
            let flux = quantities(&problem, &solution.u).contact_flux;
            // v = 1 shows this exactly where nothing is tested with γ⁻¹v.
            let exact = method != Method::p2() || psi != "0.1 + x";
            let bound = if exact { 1e-11 } else { 0.05 };
            assert!((flux + 1.0).abs() < bound, "{method} {psi} {flux}");
        }
    }
    let free = scene(|_, boundary| {
        boundary.neumann.append(&mut boundary.dirichlet);
        boundary.neumann.append(&mut boundary.contact);
    });
    assert!(Problem::new(&free, &mesh, &cr).is_err());
    let bad = scene(|data, _| data.f = formula("log(x - 0.5)"));
    let refusal = Problem::new(&bad, &mesh, &cr).err().unwrap();
    assert!(refusal.to_string().contains("f = `log(x - 0.5)` is NaN at"));
}

#[test]
fn contact_sets_are_runs_along_the_side() {
    let mesh = square(32);
    for (name, zones) in [("one-zone", 1), ("three-zones", 4), ("five-zones", 6)] {
        let scene = Scene::find(name).unwrap();
        for method in [Method::cr(), Method::cr_fc(), Method::p2()] {
            let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method)).unwrap();
            let set = quantities(&problem, &newton(&problem).u).contact_set;
            let set = set.runs();
            assert_eq!(set.len(), zones, "{name} {method}: {set:?}");
            assert!(
                set.iter()
                    .all(|r| r[0] < r[1] && r[0] >= 0.0 && r[1] <= 1.0 + 1e-12)
            );
        }
    }
}

#[test]
fn dofs_of_faces_are_those_on_the_face() {
    let mesh = square(2);
    for element in [&CR as &'static dyn Element, &P1, &P2] {
        let space = crate::element::Space::new(&mesh, element);
        assert!(space.local_dofs <= MAX_DOFS);
        for face in 0..mesh.face_count() {
            let cell = mesh.face_cells(face)[0] as usize;
            let count = space.face_dofs(cell, mesh.local_face(cell, face)).count();
            assert_eq!(
                count,
                [("CR", 1), ("P1", 2), ("P2", 3)]
                    .iter()
                    .find(|e| e.0 == element.name())
                    .unwrap()
                    .1
            );
        }
    }
}

/// The conditions of the variational inequality, with the reaction only from the stiffness.
#[test]
fn variational_inequalities_are_complementary() {
    for scene in ["one-zone", "five-zones", "plate"] {
        let scene = Scene::find(scene).unwrap();
        let mesh = scene.triangulation(None).unwrap();
        for name in ["p1-vi", "cr-vi"] {
            let problem = Problem::new(
                &scene,
                &mesh,
                &Discretisation::of(&scene, name.parse().unwrap()),
            )
            .unwrap();
            let u = newton(&problem).u;
            let forces = problem.stiffness.times(&u);
            let psi = |dof: usize| scene.data().psi.value(problem.space.point(dof));
            let mut on_contact = vec![false; problem.space.dofs];
            for face in &problem.contact {
                let local = mesh.local_face(face.cell, face.face);
                for dof in problem.space.face_dofs(face.cell, local) {
                    on_contact[dof as usize] = true;
                }
            }
            let (mut touching, mut free) = (0, 0);
            for dof in 0..problem.space.dofs {
                if problem.dirichlet[dof].is_some() {
                    continue;
                }
                let reaction = forces[dof] - problem.load[dof];
                if !on_contact[dof] {
                    assert!(reaction.abs() < 1e-12, "{name} {dof} {reaction:e}");
                    continue;
                }
                // For CR the mean of ψ, which is not ψ at the midpoint.
                let curvature = if name == "cr-vi" { 1e-4 } else { 0.0 };
                let gap = u[dof] - psi(dof);
                assert!(reaction < 1e-12 && gap < 1e-12 + curvature, "{name} {dof}");
                if reaction < -1e-12 {
                    assert!(gap > -1e-12 - curvature, "{name} {dof} {gap:e}");
                    touching += 1;
                } else {
                    free += 1;
                }
            }
            assert!(touching > 3 && free > 3, "{name} {touching} {free}");
        }
    }
}

/// a(u,φ_i) - L(φ_i) off Γ_D, and terms on the contact faces that `add` puts in for each point.
fn balance(problem: &Problem, u: &[f64], mut add: impl FnMut(&ContactFace, &mut [f64])) -> f64 {
    let mut r = problem.stiffness.times(u);
    for (r, b) in r.iter_mut().zip(&problem.load) {
        *r -= b;
    }
    for face in &problem.contact {
        add(face, &mut r);
    }
    let free = (0..r.len()).filter(|&i| problem.dirichlet[i].is_none());
    free.fold(0.0, |m: f64, i| m.max(r[i].abs()))
}

#[test]
fn the_penalty_is_that_of_chouly_and_hild() {
    let scene = Scene::find("plate").unwrap();
    let mesh = scene.triangulation(None).unwrap();
    let problem = Problem::new(
        &scene,
        &mesh,
        &Discretisation::of(&scene, "penalty(0.03)".parse().unwrap()),
    )
    .unwrap();
    let u = newton(&problem).u;
    let balance = |epsilon0: f64| {
        balance(&problem, &u, |face, r| {
            let measure = mesh.geometry(face.cell).measure();
            let epsilon = epsilon0 * 2.0 * measure / face.measure;
            let local = problem.space.local(face.cell, &u);
            for point in &face.points {
                let gap = point.trace(1.0, &local).gap.max(0.0);
                for (j, &dof) in problem.space.cell_dofs(face.cell).iter().enumerate() {
                    r[dof as usize] += point.weight * gap / epsilon * point.phi[j];
                }
            }
        })
    };
    assert!(balance(0.03) < 1e-12);
    assert!(balance(0.031) > 1e-4);
}

/// The saddle point itself, with λ as an unknown: both equations and the signs.
#[test]
fn the_multiplier_is_that_of_hild_and_renard() {
    let scene = Scene::find("plate").unwrap();
    let mesh = scene.triangulation(None).unwrap();
    let problem = Problem::new(
        &scene,
        &mesh,
        &Discretisation::of(&scene, "multiplier".parse().unwrap()),
    )
    .unwrap();
    let u = newton(&problem).u;
    let (mut touching, mut free) = (0, 0);
    let mut balance = |sign: f64| {
        balance(&problem, &u, |face, r| {
            let geometry = mesh.geometry(face.cell);
            let gamma = 0.1 * 2.0 * geometry.measure() / face.measure;
            let local = problem.space.local(face.cell, &u);
            // P1: ∂ₙu is constant, and means are values at the midpoint up to ψ.
            let mean = |value: &dyn Fn(usize) -> f64| -> f64 {
                let points = face.points.iter().enumerate();
                points
                    .map(|(q, p)| p.weight / face.measure * value(q))
                    .sum()
            };
            let gap = mean(&|q| face.points[q].trace(gamma, &local).gap);
            let flux = mean(&|q| face.points[q].trace(gamma, &local).flux);
            // <u-ψ + γ(λ-∂ₙu), μ-λ> ≥ 0 for all μ ≤ 0.
            let lambda = (flux - gap / gamma).min(0.0);
            let slack = gap + gamma * (lambda - flux);
            assert!(slack <= 1e-14 && (slack * lambda).abs() < 1e-14);
            if lambda < 0.0 {
                touching += 1;
            } else {
                free += 1;
            }
            for (j, &dof) in problem.space.cell_dofs(face.cell).iter().enumerate() {
                let phi = mean(&|q| face.points[q].phi[j]);
                let dn = mean(&|q| face.points[q].dn[j]);
                r[dof as usize] +=
                    face.measure * (-lambda * phi + sign * gamma * (lambda - flux) * dn);
            }
        })
    };
    assert!(balance(1.0) < 1e-12);
    assert!(balance(-1.0) > 1e-4);
    assert!(touching > 3 && free > 3, "{touching} {free}");
}

#[test]
fn the_classical_methods_give_all_that_is_read_off() {
    let mesh = square(32);
    for name in ["p1-vi", "cr-vi", "penalty", "multiplier"] {
        let method: Method = name.parse().unwrap();
        for (scene, zones) in [("one-zone", 1), ("three-zones", 4), ("five-zones", 6)] {
            let scene = Scene::find(scene).unwrap();
            let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method)).unwrap();
            let u = newton(&problem).u;
            assert!(problem.backward_error(&u).0 < 1e-13, "{name}");
            let reference =
                Problem::new(&scene, &mesh, &Discretisation::of(&scene, Method::p2())).unwrap();
            let expected = quantities(&reference, &newton(&reference).u);
            let q = quantities(&problem, &u);
            assert_eq!(
                q.contact_set.runs().len(),
                zones,
                "{name} {:?}",
                q.contact_set
            );
            for (a, b) in [
                (q.grad_norm_sq, expected.grad_norm_sq),
                (q.l2_norm, expected.l2_norm),
                (q.contact_flux, expected.contact_flux),
            ] {
                assert!((a / b - 1.0).abs() < 0.2, "{name} {a} {b}");
            }
            let fields = face_fields(&problem, &u, "rust");
            assert!(fields.column("mean").is_some() && fields.column("status").is_some());
            // Another method's solution does not solve this one.
            let other = if method.element.on().faces {
                "cr"
            } else {
                "p1"
            };
            let other = Problem::new(
                &scene,
                &mesh,
                &Discretisation::of(&scene, other.parse().unwrap()),
            )
            .unwrap();
            assert!(problem.backward_error(&newton(&other).u).0 > 1e-9, "{name}");
        }
        let scene = scene(|_, _| {});
        let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method)).unwrap();
        let lagged = "lagged-p".parse().unwrap();
        let refusal = solve(&problem, lagged, Stop::default(), |_, _| Ok(()));
        assert!(refusal.unwrap_err().to_string().contains("family (2.4)"));
    }
}

/// With one point on each face `cr-fc` has the faces' means under the obstacle and fluxes in
/// balance with the load, which is the variational inequality on CR: another formulation, other
/// code. So γ has no part in it.
#[test]
fn the_corrected_flux_at_midpoints_is_the_variational_inequality_on_cr() {
    for name in ["one-zone", "five-zones", "plate", "two-sides-contact"] {
        let scene = Scene::find(name).unwrap();
        let mesh = scene.triangulation(None).unwrap();
        let solve = |method: &str, gamma0: f64| {
            let discretisation = Discretisation {
                contact_quadrature: Some("midpoint".into()),
                ..with_gamma0(&scene, method.parse().unwrap(), gamma0)
            };
            newton(&Problem::new(&scene, &mesh, &discretisation).unwrap()).u
        };
        let reference = solve("cr-vi", 100.0);
        let size = reference.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let distance = |u: &[f64]| {
            let pairs = u.iter().zip(&reference);
            pairs.fold(0.0, |m: f64, (a, b)| m.max((a - b).abs())) / size
        };
        for gamma0 in [1e-8_f64, 1e-3, 1.0, 100.0, 1e5, 1e8] {
            // The separated faces have λ = 0 to rounding in γλ only.
            let bound = 1e-13 * gamma0.max(1.0);
            let off = distance(&solve("cr-fc", gamma0));
            assert!(off < bound.min(1e-9), "{name} {gamma0:e} {off:e}");
        }
        let off = distance(&solve("cr", 1.0));
        assert!(name == "two-sides-contact" || off > 1e-3, "{name} {off:e}");
    }
}

/// b is condensed anew where it was given away.
#[test]
fn u_can_be_completed_again() {
    let scene = Scene::find("one-zone").unwrap();
    let mesh = scene.triangulation(Some(8)).unwrap();
    let discretisation = Discretisation::of(&scene, Method::cr());
    let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
    let system = choose::system(scheme::Scheme::new(&problem), Settings::default()).unwrap();
    let on_kept = system.start();
    let (once, again) = (system.complete(&on_kept), system.complete(&on_kept));
    let size = system::largest(&once);
    assert!(size > 0.0);
    for (a, b) in once.iter().zip(&again) {
        assert!((a - b).abs() <= 1e-13 * size, "{a} {b}");
    }
}
