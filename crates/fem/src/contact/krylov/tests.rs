use super::*;
use crate::assembly::Stiffness;
use crate::contact::{Discretisation, Iteration, Method, Problem, Solution, Stop, solve_by};
use crate::element::{P1, Space};
use crate::linear::{Settings, Solver};
use crate::scene::{Data, Expression, Scene};
use faceoff_mesh::mesh::Triangulation;
use faceoff_mesh::mesh::generate::union_cube;

fn solve_with(problem: &Problem, solver: Solver) -> Result<Solution> {
    let settings = Settings {
        solver,
        ..Settings::default()
    };
    let newton = Iteration::Newton;
    solve_by(problem, newton, Stop::default(), settings, |_, _| Ok(()))
}

/// Relative to the second.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().fold(0.0, |s: f64, u| s.max(u.abs()));
    let pairs = a.iter().zip(b);
    pairs.fold(0.0, |s: f64, (a, b)| s.max((a - b).abs())) / size
}

/// And by rows of faces needs fewer steps than from nothing, as it starts from the contact set of P1.
#[test]
fn it_agrees_with_the_direct_solver() {
    let (mut steps, mut direct_steps) = (0, 0);
    for (scene, n) in [
        ("one-zone", 20),
        ("five-zones", 33),
        ("plate", 16),
        ("transition-1.5", 17),
    ] {
        let scene = Scene::find(scene).unwrap();
        let mesh = scene.triangulation(Some(n)).unwrap();
        let methods = [
            "cr",
            "cr-vi",
            "cr-fc",
            "p1-vi",
            "p2",
            "p2(1,1)",
            "cr(1,1)",
            "penalty",
            "multiplier",
        ];
        for method in methods {
            let method: Method = method.parse().unwrap();
            let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method)).unwrap();
            let (found, direct) = (
                solve_with(&problem, Solver::Iterative).unwrap(),
                solve_with(&problem, Solver::Multifrontal).unwrap(),
            );
            assert!(
                found.converged,
                "{} {method}: {:?}",
                scene.name(),
                found.increments
            );
            assert_eq!(found.linear.solver, Solver::Iterative);
            if !adds_to_rows(&Scheme::new(&problem)) {
                steps += found.increments.len();
                direct_steps += direct.increments.len();
            }
            let far = distance(&found.u, &direct.u);
            assert!(far < 1e-11, "{} {method}: {far:e}", scene.name());
        }
    }
    assert!(4 * steps < 3 * direct_steps, "{steps} of {direct_steps}");
}

/// Section 6.1 extruded, on a box of n³ small ones.
fn in_a_box(n: usize, size: [f64; 3]) -> (Scene, Triangulation) {
    let scene = Scene::find("one-zone-3d").unwrap();
    let mesh = Triangulation::new("box", &union_cube(n, size)).unwrap();
    (scene, mesh)
}

/// Plates, walls, beams and towers, whose cells are as thin as they are.
#[test]
fn thin_boxes_are_solved_by_iterations() {
    for (size, n) in [
        ([1.0, 1.0, 0.1], 5),
        ([1.0, 0.1, 1.0], 5),
        ([8.0, 1.0, 1.0], 5),
        ([0.1, 0.1, 1.0], 5),
        ([1.0, 1.0, 0.01], 4),
    ] {
        let (scene, mesh) = in_a_box(n, size);
        for method in ["cr", "cr-fc", "cr(1,1)", "p2"] {
            let discretisation = Discretisation::of(&scene, method.parse().unwrap());
            let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
            let direct = solve_with(&problem, Solver::Multifrontal).unwrap();
            let found = solve_with(&problem, Solver::Iterative).unwrap();
            assert!(found.converged, "{size:?} {method}: {:?}", found.increments);
            let far = distance(&found.u, &direct.u);
            assert!(far < 1e-10, "{size:?} {method}: {far:e}");
        }
    }
}

#[test]
fn auto_factorises_what_iterations_do_not_reach() {
    let (scene, mesh) = in_a_box(12, [1.0, 1e-4, 1.0]);
    let discretisation = Discretisation::of(&scene, Method::p2());
    let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
    let refused = solve_with(&problem, Solver::Iterative).err();
    let refused = refused.expect("iterations reach it").to_string();
    assert!(refused.contains("iterat"), "{refused}");
    let found = solve_with(&problem, Solver::Auto).unwrap();
    assert!(found.converged && found.linear.solver == Solver::Multifrontal);
    let chosen = Krylov::predicted(&Scheme::new(&problem));
    let condensed =
        super::super::condensed::Condensed::new(Scheme::new(&problem), Settings::default(), chosen);
    assert!(
        condensed.unwrap().is_err(),
        "auto did not choose to iterate"
    );
}

/// EᵀAE is the P1 matrix: what the preconditioner rests on.
#[test]
fn p1_is_embedded_exactly() {
    for (scene, method) in [
        ("plate", "cr"),
        ("plate", "p2"),
        ("block", "cr"),
        ("block", "p2"),
    ] {
        let scene = Scene::find(scene).unwrap();
        let mesh = scene.triangulation(None).unwrap();
        let problem = Problem::new(
            &scene,
            &mesh,
            &Discretisation::of(&scene, method.parse().unwrap()),
        )
        .unwrap();
        let p1 = Stiffness::new(&Space::new(&mesh, &P1));
        let v: Vec<f64> = (0..mesh.points.len())
            .map(|k| ((3 * k) as f64).sin())
            .collect();
        let of_v: Vec<f64> = (0..problem.space.dofs)
            .map(|dof| {
                let values = problem.space.vertex_values(dof);
                values
                    .map(|(vertex, value)| value * v[vertex as usize])
                    .sum()
            })
            .collect();
        let (energy, embedded) = (p1.energy(&v), problem.stiffness.energy(&of_v));
        assert!(
            (energy - embedded).abs() < 1e-12 * energy,
            "{method}: {energy} {embedded}"
        );
    }
}

/// The terms of contact cells are another matrix for each γ, and only their block sees it.
#[test]
fn quadratic_elements_iterate_as_fast_whatever_gamma() {
    let scene = Scene::find("one-zone-3d").unwrap();
    let mesh = scene.triangulation(Some(6)).unwrap();
    for gamma0 in [1e-6, 1e-2, 1.0, 1e2, 1e6] {
        let discretisation = Discretisation {
            gamma0,
            ..Discretisation::of(&scene, Method::p2())
        };
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let direct = solve_with(&problem, Solver::Multifrontal).unwrap();
        let found = solve_with(&problem, Solver::Iterative).unwrap();
        assert!(found.converged, "{gamma0}: {:?}", found.increments);
        let far = distance(&found.u, &direct.u);
        assert!(far < 1e-10, "{gamma0}: {far:e}");
    }
}

#[test]
fn a_body_that_contact_alone_holds_is_refused_in_words() {
    let held = Scene::find("one-zone-3d").unwrap();
    let mut boundary = held.boundary().clone();
    boundary.neumann.append(&mut boundary.dirichlet);
    let scene = held.with_boundary(boundary).with_data(Data {
        f: Expression::parse("1").unwrap(),
        ..held.data().clone()
    });
    let mesh = scene.triangulation(Some(2)).unwrap();
    let discretisation = Discretisation::of(&scene, Method::p2());
    let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
    let refused = solve_with(&problem, Solver::Iterative).unwrap_err();
    let refused = refused.to_string();
    assert!(
        refused.contains("Γ_D") && refused.contains("--linear"),
        "{refused}"
    );
    assert!(Krylov::predicted(&Scheme::new(&problem)).is_none());
    assert!(solve_with(&problem, Solver::Auto).unwrap().converged);
}

/// With g on Γ_D, which the rows that are kept do not have; of one u after the other.
#[test]
fn energies_are_those_of_all_dofs() {
    let scene = Scene::find("block").unwrap();
    let mesh = scene.triangulation(None).unwrap();
    let discretisation = Discretisation::of(&scene, "cr".parse().unwrap());
    let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
    let system = Krylov::new(Scheme::new(&problem)).unwrap();
    let start = problem.start();
    assert!(start.iter().any(|g| *g != 0.0), "g vanishes");
    for k in [0.0, 1.0, 0.0] {
        let wave = |dof: usize| (dof as f64 + k).sin();
        let mut u: Vec<f64> = (0..problem.space.dofs).map(wave).collect();
        for (dof, g) in problem.dirichlet.given() {
            u[dof] = g;
        }
        let is_near = |found: Energy, u: &[f64]| {
            let expected = problem.stiffness.energy(u);
            let found = found.value * found.unit * found.unit;
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        };
        is_near(system.size(&u), &u);
        let delta: Vec<f64> = u.iter().zip(&start).map(|(u, g)| u - g).collect();
        is_near(system.energy(&delta), &delta);
    }
}
