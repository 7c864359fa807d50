//! When an iteration has converged, whatever solves its linear systems, in whatever units, on any number of threads.

use super::tests::{formula, newton, scene, square, with_gamma0};
use super::*;
use crate::linear::{Precision, Settings, Solver};
use crate::scene::{GroupName, Scene};
use faceoff_mesh::mesh::generate::union_jack;
use faceoff_mesh::mesh::{CellBlock, CellKind, Group, Mesh, Triangulation};

/// With γ far below h a face that is still to separate, or to close, is hardly seen in the energy norm; nor is it with a
/// loose tolerance.
#[test]
fn an_increment_alone_is_no_convergence() {
    let small = |gamma0: f64| ("manufactured-3", gamma0, Stop::default());
    let loose = |increment: f64| {
        let stop = Stop {
            increment,
            ..Stop::default()
        };
        ("transition-1.5", 100.0, stop)
    };
    for (scene, gamma0, stop) in [small(1e-10), small(1e-12), loose(1e-2), loose(1e-4)] {
        let scene = Scene::find(scene).unwrap();
        let mesh = scene.triangulation(Some(16)).unwrap();
        for name in ["cr", "cr-fc", "p1", "p2", "penalty"] {
            let discretisation = with_gamma0(&scene, name.parse().unwrap(), gamma0);
            let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
            let solution = solve(&problem, Iteration::Newton, stop, |_, _| Ok(())).unwrap();
            let error = problem.backward_error(&solution.u).0;
            assert_eq!(error, solution.backward_error);
            let name = format!("{} {name} {gamma0:e} {stop:?}", scene.name());
            assert!(solution.converged, "{name}: {error:e}");
            assert!(error <= stop.increment.max(1e-9), "{name}: {error:e}");
        }
    }
}

/// A sliver of height 1e-8 on Γ_C: γ∂ₙu∂ₙv is 1e16 times the rest, and rounding decides.
#[test]
fn a_matrix_that_is_singular_to_working_precision_is_no_convergence() {
    let text = r#"
name = "free"
[mesh]
generator = "union-jack"
[boundary]
dirichlet = ["top", "left", "right"]
contact = ["bottom"]
[data]
g = "x-3"
"#;
    let scene = Scene::parse(text).unwrap();
    let solved = |method: &str, height: f64| {
        let mut mesh = union_jack(8, [1.0, 1.0]);
        let above = mesh.points.iter().position(|p| *p == [0.625, 0.125, 0.0]);
        mesh.points.to_mut()[above.unwrap()] = [0.5625, 0.125 * height, 0.0];
        let mesh = Triangulation::new("sliver", &mesh).unwrap();
        let problem = Problem::new(
            &scene,
            &mesh,
            &Discretisation::of(&scene, method.parse().unwrap()),
        )
        .unwrap();
        let solution = solve(&problem, Iteration::Newton, Stop::default(), |_, _| Ok(()));
        let solution = solution.unwrap();
        let exact = |dof: usize| problem.space.point(dof)[0] - 3.0;
        let far = solution.u.iter().enumerate();
        let far = far.fold(0.0, |m: f64, (k, u)| m.max((u - exact(k)).abs()));
        (solution, far)
    };
    for method in ["p1", "p2"] {
        let (good, far) = solved(method, 1e-2);
        assert!(good.converged && far < 1e-8, "{method}: {far:e}");
        let (bad, far) = solved(method, 1e-8);
        // Whether the iteration itself ends is chance; that it is called converged must not be.
        assert!(
            far > 1e-2 && !bad.converged,
            "{method}: {far:e} {:?}",
            bad.ended
        );
    }
}

#[test]
fn what_is_out_of_reach_is_called_rounding_or_not_reached_with_the_best_iterate() {
    let mesh = square(24);
    let never = |max_iterations| Stop {
        increment: 1e-30,
        max_iterations,
    };
    for gamma0 in [1e-8, 100.0, 1e8] {
        for name in ["cr", "cr-fc", "p2"] {
            let scene = scene(|_, _| {});
            let discretisation = with_gamma0(&scene, name.parse().unwrap(), gamma0);
            let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
            let solution = solve(&problem, Iteration::Newton, never(50), |_, _| Ok(())).unwrap();
            assert_eq!(solution.ended, Ended::Rounding, "{name} {gamma0:e}");
            assert!(
                problem.backward_error(&solution.u).0 < 1e-13,
                "{name} {gamma0:e}"
            );
            // Two steps are too few, and that is not convergence.
            let solution = solve(&problem, Iteration::Newton, never(2), |_, _| Ok(())).unwrap();
            assert_eq!(solution.ended, Ended::NotReached, "{name} {gamma0:e}");
            assert!(!solution.converged);
        }
    }
    // A fixed point that diverges: far from the last iterate the best one comes back.
    let scene = scene(|_, _| {});
    let diverging = with_gamma0(&scene, Method::cr(), 10.0);
    let problem = Problem::new(&scene, &mesh, &diverging).unwrap();
    let lagged = "lagged-p".parse().unwrap();
    let solution = solve(&problem, lagged, never(40), |_, _| Ok(())).unwrap();
    assert!(
        !solution.converged && solution.step < 40,
        "{}",
        solution.step
    );
    let least = solution
        .residuals
        .iter()
        .fold(f64::INFINITY, |m: f64, r| m.min(*r));
    assert_eq!(solution.residuals[solution.step - 1], least);
    let largest = |v: &[f64]| v.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let of_u = largest(&problem.residual(&solution.u));
    assert!(of_u < 10.0 * least * (10.0 * largest(&solution.u) + largest(&problem.load)));
}

#[test]
fn data_far_from_one_have_the_same_solution() {
    let mesh = square(8);
    let u = |scale: &str, name: &str| {
        let scene = scene(|data, _| data.f = formula(&format!("-2*pi*sin(2*pi*x)*{scale}")));
        newton(
            &Problem::new(
                &scene,
                &mesh,
                &Discretisation::of(&scene, name.parse().unwrap()),
            )
            .unwrap(),
        )
        .u
    };
    for name in ["cr", "cr-fc", "p2"] {
        for (text, scale) in [("1e150", 1e150), ("1e-150", 1e-150)] {
            for (a, b) in u("1", name).iter().zip(u(text, name)) {
                assert!((a - b / scale).abs() < 1e-14, "{name} {text} {a} {b}");
            }
        }
    }
}

/// Whatever solves the linear systems, and in whatever precision, the answer is the same.
#[test]
fn linear_solvers_agree_on_all_methods() {
    let pressed = scene(|data, boundary| {
        boundary.neumann.append(&mut boundary.dirichlet);
        data.f = formula("1 + x");
    });
    let scenes = [
        Scene::find("one-zone").unwrap(),
        Scene::find("plate").unwrap(),
        pressed,
    ];
    for scene in scenes {
        let mesh = scene.triangulation(None).unwrap();
        for name in [
            "cr",
            "cr-fc",
            "p1",
            "p2",
            "p2(1,0)",
            "p1-vi",
            "cr-vi",
            "penalty",
            "multiplier",
        ] {
            let problem = Problem::new(
                &scene,
                &mesh,
                &Discretisation::of(&scene, name.parse().unwrap()),
            )
            .unwrap();
            let by = |solver, precision| {
                let settings = Settings { solver, precision };
                let report = |_, _| Ok(());
                let solution = solve_by(
                    &problem,
                    Iteration::Newton,
                    Stop::default(),
                    settings,
                    report,
                );
                let solution = solution.unwrap();
                assert!(solution.converged, "{name} {solver} {precision}");
                assert!(
                    problem.backward_error(&solution.u).0 < 1e-12,
                    "{name} {solver}"
                );
                solution.u
            };
            let u = by(Solver::Multifrontal, Precision::F64);
            let size = u.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
            for (solver, precision) in [
                (Solver::Faer, Precision::F64),
                (Solver::Auto, Precision::F32Refined),
            ] {
                let other = by(solver, precision);
                for (a, b) in u.iter().zip(&other) {
                    let error = (a - b).abs();
                    assert!(
                        error < 1e-12 * size,
                        "{} {name} {solver} {precision} {error:e}",
                        scene.name()
                    );
                }
            }
        }
    }
}

#[test]
fn without_contact_one_solve_is_all() {
    let scene = scene(|_, boundary| boundary.neumann.append(&mut boundary.contact));
    let mesh = square(8);
    for method in [Method::cr(), Method::p2()] {
        let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method)).unwrap();
        let solution = newton(&problem);
        assert_eq!(solution.increments.len(), 1);
        assert!(problem.backward_error(&solution.u).0 < 1e-14);
    }
}

/// Steps of refinement that are all zero end.
#[test]
fn without_any_load_u_is_zero() {
    let scene = scene(|data, boundary| {
        data.f = formula("0");
        boundary.neumann.append(&mut boundary.contact);
    });
    let discretisation = Discretisation::of(&scene, Method::cr());
    let mesh = square(8);
    let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
    for precision in [Precision::F64, Precision::F32Refined] {
        let settings = Settings {
            solver: Solver::Multifrontal,
            precision,
        };
        let (newton, stop) = (Iteration::Newton, Stop::default());
        let solution = solve_by(&problem, newton, stop, settings, |_, _| Ok(())).unwrap();
        assert!(solution.converged, "{precision}");
        assert!(solution.u.iter().all(|u| *u == 0.0), "{precision}");
    }
}

/// The same number of threads gives the same bits; another number differs by rounding at most.
#[test]
fn two_runs_are_the_same_and_threads_differ_by_rounding() {
    let scene = Scene::find("five-zones").unwrap();
    let run = |threads: usize, name: &str| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let mesh = scene.triangulation(Some(60)).unwrap();
            newton(
                &Problem::new(
                    &scene,
                    &mesh,
                    &Discretisation::of(&scene, name.parse().unwrap()),
                )
                .unwrap(),
            )
            .u
        })
    };
    for name in ["cr", "p2"] {
        let (one, two) = (run(1, name), run(2, name));
        assert!(one == run(1, name) && two == run(2, name), "{name}");
        let size = one.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
        for (a, b) in one.iter().zip(&two) {
            assert!((a - b).abs() < 1e-13 * size, "{name} {a} {b}");
        }
    }
}

/// A difference of 1e-17 from g = 0 is rounding, and 1e-9 is not.
#[test]
fn rounding_on_the_dirichlet_part_is_no_residual() {
    let scene = Scene::find("one-zone").unwrap();
    let mesh = scene.triangulation(Some(4)).unwrap();
    let mut discretisation = Discretisation::of(&scene, "cr".parse().unwrap());
    // With a large γ the rows on Γ_C are far larger than u, which has no relation to those on Γ_D.
    for gamma0 in [discretisation.gamma0, 1e6] {
        discretisation.gamma0 = gamma0;
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let mut u = newton(&problem).u;
        let fixed = problem
            .dirichlet
            .iter()
            .position(|g| *g == Some(0.0))
            .unwrap();
        u[fixed] = 1e-17;
        assert!(problem.backward_error(&u).0 < 1e-14, "{gamma0}");
        u[fixed] = 1e-9;
        assert_eq!(problem.backward_error(&u), (1.0, Some(fixed)), "{gamma0}");
    }
}

/// `n` × `m` squares of width 1/m, each cut in two.
fn strip(n: u32, m: u32) -> Triangulation {
    let at = |i: u32, j: u32| j * (n + 1) + i;
    let place =
        |k: u32| [f64::from(k % (n + 1)), f64::from(k / (n + 1)), 0.0].map(|x| x / f64::from(m));
    let squares = (0..n * m).map(|k| (k % n, k / n));
    let cells = squares.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        if (i + j) % 2 == 0 {
            [a, b, c, a, c, d]
        } else {
            [a, b, d, b, c, d]
        }
    });
    let sides: [Vec<u32>; 4] = [
        (0..n).flat_map(|i| [at(i, 0), at(i + 1, 0)]).collect(),
        (0..m).flat_map(|j| [at(n, j), at(n, j + 1)]).collect(),
        (0..n).flat_map(|i| [at(i + 1, m), at(i, m)]).collect(),
        (0..m).flat_map(|j| [at(0, j + 1), at(0, j)]).collect(),
    ];
    let mut first = 0;
    let groups = sides
        .iter()
        .zip(["bottom", "right", "top", "left"])
        .enumerate();
    let groups = groups.map(|(k, (side, name))| {
        let cells = first..first + side.len() as u32 / 2;
        first = cells.end;
        Group {
            dim: 1,
            tag: k as i64 + 1,
            name: Some(name.into()),
            cells: cells.collect(),
        }
    });
    let mesh = Mesh {
        points: (0..(n + 1) * (m + 1)).map(place).collect(),
        groups: groups.collect(),
        blocks: vec![
            CellBlock::new(CellKind::Line, sides.concat()),
            CellBlock::new(CellKind::Triangle, cells.collect()),
        ],
        ..Mesh::default()
    };
    Triangulation::new("strip", &mesh).unwrap()
}

/// faer keeps no more than the contact cells, and factors them as one dense matrix.
#[test]
fn a_long_contact_is_solved_as_by_one_dense_matrix() {
    let group = |name: &str| GroupName::Name(name.into());
    let scene = scene(|data, boundary| {
        data.psi = formula("0.02*sin(3*x)");
        boundary.dirichlet = vec![group("left"), group("right")];
        boundary.contact = vec![group("bottom"), group("top")];
        boundary.neumann = Vec::new();
    });
    for (n, m) in [(300, 1), (200, 4)] {
        let mesh = strip(n, m);
        for name in [
            "cr",
            "cr-fc",
            "p1",
            "p2",
            "p2(0,1)",
            "cr-vi",
            "p1-vi",
            "penalty",
            "multiplier",
        ] {
            let discretisation = with_gamma0(&scene, name.parse().unwrap(), 1.0);
            let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
            let by = |solver: Solver| {
                let settings = Settings {
                    solver,
                    ..Settings::default()
                };
                let go_on = |_, _| Ok(());
                solve_by(
                    &problem,
                    Iteration::Newton,
                    Stop::default(),
                    settings,
                    go_on,
                )
                .unwrap()
            };
            let [tree, whole] = [by(Solver::Multifrontal), by(Solver::Faer)];
            assert!(tree.converged && whole.converged, "{name}");
            assert!(
                10.0 * tree.linear.flops < whole.linear.flops,
                "{name}: {:e} {:e}",
                tree.linear.flops,
                whole.linear.flops
            );
            let size = whole.u.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
            for (a, b) in tree.u.iter().zip(&whole.u) {
                assert!((a - b).abs() < 1e-11 * size, "{name}: {a} {b}");
            }
        }
    }
}

/// The work that is repeated for each set of statuses grows linearly with the strip, and so does the memory.
#[test]
fn a_longer_contact_costs_no_more_a_face() {
    let scene = scene(|_, _| {});
    for name in ["cr", "cr-fc", "p2"] {
        let [short, long] = [500, 2000].map(|n| {
            let mesh = strip(n, 4);
            let problem = Problem::new(
                &scene,
                &mesh,
                &Discretisation::of(&scene, name.parse().unwrap()),
            )
            .unwrap();
            newton(&problem).linear
        });
        assert!(long.flops < 4.5 * short.flops, "{name}: {short:?} {long:?}");
        assert!(
            long.predicted_mb < 4.5 * short.predicted_mb,
            "{name}: {short:?} {long:?}"
        );
    }
}

/// Newton's method cycles there, and least indices take 893 steps for p2 on `plate` with γ₀ = 1e-5.
#[test]
fn a_small_gamma_is_reached_by_continuation() {
    for (name, gamma0) in [("p2", 1e-5), ("p2", 1e-8), ("p1", 1e-6), ("penalty", 1e-6)] {
        let scene = Scene::find("plate").unwrap();
        let mesh = scene.triangulation(None).unwrap();
        let problem = Problem::new(
            &scene,
            &mesh,
            &with_gamma0(&scene, name.parse().unwrap(), gamma0),
        )
        .unwrap();
        let solution = solve(&problem, Iteration::Newton, Stop::default(), |_, _| Ok(())).unwrap();
        println!(
            "{name} {gamma0:e}: {} {}",
            solution.on_the_way,
            solution.increments.len()
        );
        assert!(
            solution.converged,
            "{name} {gamma0:e}: {:?}",
            solution.changes
        );
        assert!(
            solution.on_the_way < 300,
            "{name} {gamma0:e}: {}",
            solution.on_the_way
        );
    }
}
