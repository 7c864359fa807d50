//! Tests that an interval is assembled as described in the module, each part by quadrature.

use super::super::quadratic::Quadratic;
use super::super::tests::{certified, solved, square};
use super::*;
use crate::contact::Discretisation;
use crate::quadrature::exact;
use nalgebra::Vector3;

/// The primal problem has no uncertainty: the interval is that of G and v only.
const EXACT: Known = Known {
    of_g: 0.0,
    eta: 0.0,
    terms: 0.0,
    contact: 0.0,
    friedrichs: 0.0,
};

/// Calls `look` with fields of a problem with contact, g, linear f and bubbles, a goal, and its dual solution.
fn with_goal(rests: bool, look: impl FnOnce(&CellFields, &Goal, &[f64], &[f64])) {
    let scene = square("20*(x-0.5)-3*y", "0", "0.2*x", "0.05");
    let mesh = scene.triangulation(Some(4)).unwrap();
    let discretisation = Discretisation::of(&scene, "p2".parse().unwrap());
    let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
    let (_, fields) = certified(&problem, &solved(&problem)).unwrap();
    let mut random = crate::Random::new(5);
    let means = (0..mesh.cell_count()).map(|_| 2.0 * random.next() - 1.0);
    let mut goal = Goal {
        means: means.collect(),
        rests: Vec::new(),
        on_boundary: vec![0.0; mesh.points.len()],
    };
    if rests {
        let mut rest = |_| Rest {
            spread: random.next(),
            most: 4.0 + random.next(),
            mean: random.next(),
        };
        goal.rests = (0..mesh.cell_count()).map(&mut rest).collect();
    }
    for (face, part) in problem.parts.iter().enumerate() {
        let beta = match part {
            Some(Part::Contact) => 0.7,
            Some(Part::Dirichlet) => -0.3,
            _ => continue,
        };
        let vertices = mesh.face(face).iter();
        vertices.for_each(|&vertex| goal.on_boundary[vertex as usize] = beta);
    }
    let pressed = problem.contact.iter().zip(&fields.lambda);
    let pressed = pressed.filter(|(_, lambda)| **lambda < 0.0);
    let faces: Vec<usize> = pressed.map(|(contact, _)| contact.face).collect();
    assert!(!faces.is_empty() && faces.len() < problem.contact.len());
    let mut solver = Fluxes::with_values(&problem, faces.into_iter());
    let [w, fluxes] = solver.dual(&goal.means, &goal.on_boundary, &[]).unwrap();
    look(&fields, &goal, &w, &fluxes);
}

/// The field of Raviart and Thomas with these fluxes at a point of its cell.
fn q(fields: &CellFields, fluxes: &[f64], cell: usize, lambda: &[f64; 4]) -> Vector3<f64> {
    let geometry = fields.problem.space.mesh.geometry(cell);
    let x = Vector3::from(geometry.point(lambda));
    let of = fields.fluxes_of(fluxes, cell).iter().zip(geometry.vertices);
    of.map(|(flux, vertex)| *flux * (x - vertex))
        .sum::<Vector3<f64>>()
        / (2.0 * geometry.measure())
}

fn v(fields: &CellFields, cell: usize, lambda: &[f64; 4]) -> f64 {
    let corners = fields.corner_values(cell);
    let b = fields.bubbles_of(cell).unwrap_or_default();
    let bubbles = (0..3).map(|i| 4.0 * b[i] * lambda[(i + 1) % 3] * lambda[(i + 2) % 3]);
    (0..3).map(|i| lambda[i] * corners[i].mid()).sum::<f64>() + bubbles.sum::<f64>()
}

/// Σ over the cells of an integral.
fn integral(fields: &CellFields, of: impl Fn(usize, &[f64; 4]) -> f64) -> f64 {
    let mesh = fields.problem.space.mesh;
    let cells = 0..mesh.cell_count();
    let of_cell = |cell: usize| {
        let rule = exact(2, 5);
        let points = rule.iter().map(|(lambda, w)| w * of(cell, &lambda));
        mesh.measure(cell) * points.sum::<f64>()
    };
    cells.map(of_cell).sum()
}

/// The least c with |μ| ≤ c |λ|.
fn least_c(fields: &CellFields, fluxes: &[f64]) -> f64 {
    let mesh = fields.problem.space.mesh;
    let mut c = 0.0_f64;
    for contact in &fields.problem.contact {
        let local = mesh.local_face(contact.cell, contact.face);
        let of = |all: &[f64]| fields.fluxes_of(all, contact.cell)[local];
        if of(fluxes) != 0.0 {
            let off = 4.0 * fields.stream.as_ref().unwrap().faces[contact.face].abs();
            c = c.max(of(fluxes).abs() / (of(&fields.fluxes).abs() - off));
        }
    }
    c
}

fn slope(fields: &CellFields, z: &[Interval], cell: usize) -> Vector3<f64> {
    let mesh = fields.problem.space.mesh;
    let geometry = mesh.geometry(cell);
    let of = mesh.cell(cell).iter().zip(geometry.gradients);
    of.map(|(vertex, gradient)| z[*vertex as usize].mid() * gradient)
        .sum()
}

/// (q-∇z, G) + (f, z) - <q·n, g>_D - <μ, ψ>_C + (k̄ + div q, v) is in the interval, whose width is a bound only of G's bubble.
#[test]
fn what_is_computed_is_in_the_interval() {
    with_goal(false, |fields, goal, w, fluxes| {
        let (problem, mesh) = (fields.problem, fields.problem.space.mesh);
        let found = goal
            .with(&Dual::new(fields, &EXACT, 0.0), w, fluxes)
            .unwrap();
        let data = problem.scene.data();
        let mut boundary = 0.0;
        for (face, part) in problem.parts.iter().enumerate() {
            let cell = mesh.face_cells(face)[0] as usize;
            let flux = fields.fluxes_of(fluxes, cell)[mesh.local_face(cell, face)];
            // Both are linear, and the flux is constant.
            let middle = mesh.face_midpoint(face);
            match part {
                Some(Part::Dirichlet) => boundary += flux * data.g.value(middle),
                Some(Part::Contact) => boundary += flux * data.psi.value(middle),
                _ => {}
            }
        }
        let z = goal.test_function(&Dual::new(fields, &EXACT, 0.0), least_c(fields, fluxes), w);
        let inside = integral(fields, |cell, at| {
            let geometry = mesh.geometry(cell);
            let simplex = fields.simplex(cell);
            let sigma = Vector3::from(fields.sigma_of::<3>(&simplex, cell).at(at, 2));
            let of_v = Quadratic::<3>::of(&fields.slope(&simplex, cell));
            let g = 0.5 * (Vector3::from(of_v.at(at, 2)) + sigma);
            let difference = q(fields, fluxes, cell, at) - slope(fields, &z, cell);
            let of_z = mesh.cell(cell).iter().zip(at);
            let of_z: f64 = of_z.map(|(i, l)| z[*i as usize].mid() * l).sum();
            let divergence =
                fields.fluxes_of(fluxes, cell).iter().sum::<f64>() / geometry.measure();
            difference.dot(&g)
                + data.f.value(geometry.point(at)) * of_z
                + (goal.means[cell] + divergence) * v(fields, cell, at)
        });
        let value = inside - boundary;
        assert!(
            found.low <= value && value <= found.high,
            "[{}, {}] {value}",
            found.low,
            found.high
        );
        assert!(found.high - found.low < 0.05, "{found:?}");
    });
}

/// What is known of u counts as R ‖q-∇z‖ + (sup |k̄ + div q + rest| F + ‖C h spread‖) η + c (terms + B): each by itself.
#[test]
fn errors_of_u_count_as_the_formula_says() {
    with_goal(true, |fields, goal, w, fluxes| {
        let mesh = fields.problem.space.mesh;
        let radius = |known: Known| {
            let found = goal
                .with(&Dual::new(fields, &known, 0.0), w, fluxes)
                .unwrap();
            found.radius()
        };
        // c is the same in all: that where `of_g` and `terms` are equal.
        let one = Known {
            of_g: 1.0,
            terms: 1.0,
            ..EXACT
        };
        let first = radius(one);
        let check = |what: &str, known: Known, expected: f64| {
            let more = radius(known) - first;
            assert!(
                (more / expected - 1.0).abs() < 1e-9,
                "{what}: {more} {expected}"
            );
        };
        let square = integral(fields, |cell, at| {
            q(fields, fluxes, cell, at).norm_squared()
        });
        // That of equal errors, or the least.
        let c = least_c(fields, fluxes).max(AWAY * square.sqrt());
        let z = goal.test_function(&Dual::new(fields, &EXACT, 0.0), c, w);
        let away = integral(fields, |cell, at| {
            (q(fields, fluxes, cell, at) - slope(fields, &z, cell)).norm_squared()
        });
        check(
            "R and terms",
            Known {
                of_g: 2.0,
                terms: 2.0,
                ..one
            },
            away.sqrt() + c,
        );
        check(
            "B",
            Known {
                contact: 1.0,
                ..one
            },
            c,
        );
        let j11 = 3.831_705_970_207_512;
        let (mut missing, mut spread) = (0.0_f64, 0.0);
        for (cell, rest) in goal.rests.iter().enumerate() {
            let (sum, size) = (
                fields.fluxes_of(fluxes, cell).iter().sum::<f64>(),
                mesh.measure(cell),
            );
            missing = missing.max((goal.means[cell] + sum / size).abs() + rest.most);
            spread += size * (mesh.geometry(cell).diameter / j11 * rest.spread).powi(2);
        }
        check("spread", Known { eta: 1.0, ..one }, spread.sqrt());
        let of_all = Known {
            eta: 1.0,
            friedrichs: 3.0,
            ..one
        };
        check("rest", of_all, 3.0 * missing + spread.sqrt());
    });
}

/// k may be k̄ ± its spread where v is above or below its mean, and beyond that all that is not known where v has one sign.
#[test]
fn no_rest_of_a_goal_makes_more_of_v() {
    with_goal(true, |fields, goal, w, fluxes| {
        let mesh = fields.problem.space.mesh;
        let width = |goal: &Goal| {
            let found = goal
                .with(&Dual::new(fields, &EXACT, 0.0), w, fluxes)
                .unwrap();
            found.radius()
        };
        let without = width(&Goal {
            rests: vec![Rest::default(); mesh.cell_count()],
            ..goal.clone()
        });
        let means: Vec<f64> = (0..mesh.cell_count())
            .map(|cell| {
                exact(2, 5)
                    .iter()
                    .map(|(at, w)| w * v(fields, cell, &at))
                    .sum()
            })
            .collect();
        for part in [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
            let rests = goal.rests.iter().map(|rest| Rest {
                spread: part[0] * rest.spread,
                most: part[1] * rest.most,
                mean: part[1] * rest.mean,
            });
            let goal = Goal {
                rests: rests.collect(),
                ..goal.clone()
            };
            let worst = integral(fields, |cell, at| {
                let (v, rest) = (v(fields, cell, at), &goal.rests[cell]);
                rest.spread * (v - means[cell]).abs() + rest.mean * v.abs()
            });
            let more = width(&goal) - without;
            assert!(
                worst <= more && more < 10.0 * worst,
                "{part:?} {worst} {more}"
            );
        }
    });
}
