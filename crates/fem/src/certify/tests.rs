//! The bounds against solutions that are known.

use std::sync::OnceLock;

use nalgebra::Vector3;
use proptest::prelude::*;

use super::cells::CellFields;
use super::cut_off::tests::by_formula;
use super::lift::Lift;
use super::line::tests::{points_beside_knee, tau_by_quadrature};
use super::quadratic::Quadratic;
use super::*;
use crate::asked_for;
use crate::contact::{Discretisation, Iteration, Method, Problem, Stop, solve};
use crate::quadrature::{Piece, WHOLE, exact, parts};
use crate::scene::{Data, Exact, Expression, Part, Scene};
use faceoff_mesh::mesh::{CellGeometry, Triangulation};

/// Points that integrate over a cell what is smooth on a sixteenth of it, in 3D on an eighth: by the share of a part in its cell.
fn points_of_shares(dim: usize) -> impl Fn(f64) -> &'static [([f64; 4], f64)] {
    type Points = OnceLock<Vec<([f64; 4], f64)>>;
    static RULES: [[Points; 3]; 2] = [const { [const { OnceLock::new() }; 3] }; 2];
    move |share| {
        let smooth = 0.5f64.powi((dim * (4 - dim)) as i32);
        let enough = |times: &usize| share * 0.5f64.powi((dim * times) as i32) <= smooth * 1.001;
        let times = (0..4 - dim).find(enough).unwrap_or(4 - dim);
        RULES[dim - 2][times].get_or_init(|| points_of_parts(dim, times))
    }
}

/// The points and weights of a rule of degree 5 on each part of a simplex that is cut into 2^dim parts a given number of times.
pub(super) fn points_of_parts(dim: usize, times: usize) -> Vec<([f64; 4], f64)> {
    let mut pieces = vec![WHOLE];
    for _ in 0..times {
        pieces = pieces.iter().flat_map(|piece| parts(piece, dim)).collect();
    }
    let share = 1.0 / pieces.len() as f64;
    let rule = exact(dim, 5);
    let of_piece = |piece: &Piece| -> Vec<([f64; 4], f64)> {
        let points = rule.iter();
        let points = points.map(|(inner, w)| (inside(piece, &inner), w * share));
        points.collect()
    };
    pieces.iter().flat_map(of_piece).collect()
}

/// Where a point of a piece is in the whole.
pub(super) fn inside(piece: &Piece, inner: &[f64; 4]) -> [f64; 4] {
    std::array::from_fn(|i| (0..4).map(|k| inner[k] * piece[k][i]).sum())
}

struct True {
    v: f64,
    g: f64,
    u_h: f64,
    gradient: f64,
}

/// A lift's w and ∇w at a point of its cell, from the data themselves.
pub(super) fn lifted(
    cell: &CellGeometry,
    lift: &Lift,
    data: &Expression,
    lambda: &[f64; 4],
) -> (f64, Vector3<f64>) {
    let [a, b] = lift.ends;
    let r = lambda[a] + lambda[b];
    let s = if r > 0.0 { lambda[b] / r } else { 0.5 };
    let edge = cell.vertices[b] - cell.vertices[a];
    let y = cell.vertices[a] + s * edge;
    let [at_a, at_b] = [a, b].map(|i| data.value(cell.vertices[i].into()));
    let (value, gradient) = data.with_gradient(y.into());
    let delta = value - (at_a + s * (at_b - at_a)) - 4.0 * lift.bend * s * (1.0 - s);
    let along =
        Vector3::from(gradient).dot(&edge) - (at_b - at_a) - 4.0 * lift.bend * (1.0 - 2.0 * s);
    let slope =
        (delta - s * along) * cell.gradients[a] + (delta + (1.0 - s) * along) * cell.gradients[b];
    (r * delta, slope)
}

/// σ without τ.
pub(super) fn sigma(fields: &CellFields, cell: usize) -> impl Fn(&[f64; 4]) -> Vector3<f64> {
    let dim = fields.problem.space.mesh.dim;
    let sigma = fields.sigma_of::<3>(&fields.simplex(cell), cell);
    move |lambda| Vector3::from(sigma.at(lambda, dim))
}

/// The errors themselves, on the parts of each cell that its lift or its τ has.
fn errors(fields: &CellFields, truth: &Expression) -> True {
    let problem = fields.problem;
    let (space, mesh) = (&problem.space, problem.space.mesh);
    let points_of = points_of_shares(mesh.dim);
    let plain = points_of(1.0);
    let mut squares = [0.0; 4];
    let is_one = cut_off::on_curved_faces(problem, fields.data.unit);
    for cell in 0..mesh.cell_count() {
        let geometry = mesh.geometry(cell);
        let local = space.local(cell, &fields.u);
        let simplex = fields.simplex(cell);
        let balance = fields.balance(&simplex, cell);
        let slopes = Quadratic::<3>::of(&fields.slope(&simplex, cell));
        let sigma = sigma(fields, cell);
        let mut add = |lambda: &[f64; 4], weight: f64, lift: Vector3<f64>, tau: Vector3<f64>| {
            let of_exact = Vector3::from(truth.gradient(geometry.point(lambda)));
            let of_v = Vector3::from(slopes.at(lambda, mesh.dim)) + lift;
            let mean = 0.5 * (of_v + sigma(lambda) + tau);
            let of_u = space.slope(&geometry, lambda, &local);
            for (sum, of) in squares.iter_mut().zip([of_v, mean, of_u, Vector3::zeros()]) {
                *sum += geometry.measure() * weight * (of_exact - of).norm_squared();
            }
        };
        let zero = Vector3::zeros();
        let of_lift = fields.data.lifts_of(cell);
        if balance.carried.is_some() {
            let heights = of_lift.iter().flat_map(|lift| &lift.sectors);
            assert!(heights.map(|s| s.height).all(|height| height < 1e-9));
            let f = &problem.scene.data().f;
            let [a, b, c, _] = mesh.vertices(cell);
            let [p, q, r, _] = fields.data.trees[cell].whole.values;
            let axis = f.axes()[0];
            let tau = tau_by_quadrature(|x| f.value(x), [a, b, c], [p, q, r], axis);
            for (lambda, weight) in &points_beside_knee(&[a, b, c], axis, 3) {
                let [x, y] = tau(geometry.point(lambda));
                add(lambda, *weight, zero, Vector3::new(x, y, 0.0));
            }
        } else if let Some(lift) = of_lift.first() {
            assert!(
                of_lift.len() == 1 && balance.tau.is_empty(),
                "a cell of its own for each lift"
            );
            let given = problem.scene.data();
            let face = mesh.cell_faces(cell)[lift.local] as usize;
            let data = if problem.parts[face] == Some(Part::Dirichlet) {
                &given.g
            } else {
                &given.psi
            };
            for sector in &lift.sectors {
                let piece = lift.piece(sector);
                let share = sector.to - sector.from;
                for (inner, weight) in points_of(share) {
                    let at = inside(&piece, inner);
                    let (_, of_lift) = lifted(&geometry, lift, data, &at);
                    add(&at, weight * share, of_lift, zero);
                }
            }
        } else if let Some(cut_off) = fields.data.cut_off(cell) {
            assert!(balance.tau.is_empty());
            for part in &cut_off.parts {
                for (inner, weight) in points_of(part.share) {
                    let at = inside(&part.piece, inner);
                    let g = &problem.scene.data().g;
                    let (_, slope) = by_formula(mesh, g, &|vertex| is_one[vertex], (cell, &at));
                    add(&at, weight * part.share, slope, zero);
                }
            }
        } else if balance.tau.is_empty() {
            plain
                .iter()
                .for_each(|(lambda, weight)| add(lambda, *weight, zero, zero));
        } else {
            for tau in &balance.tau {
                let field = tau.field::<3>(&simplex);
                for (inner, weight) in points_of(tau.share) {
                    let here = Vector3::from(field.at(inner, mesh.dim));
                    add(&inside(&tau.piece, inner), weight * tau.share, zero, here);
                }
            }
        }
    }
    let [v, g, u_h, gradient] = squares.map(f64::sqrt);
    True {
        v,
        g,
        u_h,
        gradient,
    }
}

pub(super) fn solved(problem: &Problem) -> Vec<f64> {
    let solution = solve(problem, Iteration::Newton, Stop::default(), |_, _| Ok(()));
    solution.expect("an exact scene is solved").u
}

/// The certificate of a field, and the fields it is of.
pub(super) fn certified<'a>(
    problem: &'a Problem<'a>,
    u: &[f64],
) -> Result<(Certificate, CellFields<'a>)> {
    let data = PreparedData::new(problem)?;
    let mut solver = Fluxes::new(problem);
    let fields = CellFields::new(problem, u, Cow::Owned(data), &mut solver)?;
    let (certificate, _) = bounds(&fields, &mut solver)?;
    Ok((certificate, fields))
}

/// Bound over error for g, v and u_h.
fn ratios(name: &str, method: &str, n: usize) -> Result<[f64; 3]> {
    let scene = Scene::find(name)?;
    let mesh = scene.triangulation(Some(n))?;
    let method_of = method.parse().expect("a method");
    let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method_of))?;
    let u = solved(&problem);
    let (certificate, fields) = certified(&problem, &u)?;
    let exact = scene
        .exact()
        .and_then(Exact::formula)
        .expect("an exact scene");
    let truth = errors(&fields, exact);
    let [low, high] = certificate.gradient;
    assert!(
        low <= truth.gradient * (1.0 + 1e-9) && truth.gradient <= high * (1.0 + 1e-9),
        "{name} {method} {n}: {low} {} {high}",
        truth.gradient
    );
    // What `verify` builds on: a field that solves its scheme is not much worse than constants on the cells.
    let ratio = certificate.u_h[1] / certificate.constants;
    assert!(ratio <= 2.0, "{name} {method} {n} {ratio}");
    assert!(
        certificate.u_h[0] <= truth.u_h * (1.0 + 1e-3),
        "{name} {method} {n}"
    );
    Ok([
        certificate.g / truth.g,
        certificate.v / truth.v,
        certificate.u_h[1] / truth.u_h,
    ])
}

/// Scenes whose data on Γ_D have a slope that is not square-integrable along the side.
const REFUSED: [&str; 1] = ["dirichlet-meets-contact"];

/// The methods of the k-th scene: each scene has one of the three in turn, and all of them in `tests/run --all`.
fn in_turn(k: usize) -> Vec<&'static str> {
    let methods = ["cr", "cr-fc", "p2"];
    match asked_for().1 {
        1 => vec![methods[k % 3]],
        _ => methods.to_vec(),
    }
}

#[test]
fn bounds_hold_on_every_exact_scene() {
    let mut checked = 0;
    for (k, name) in Scene::exact_names().into_iter().enumerate() {
        for method in in_turn(k) {
            match ratios(name, method, 8) {
                Ok(ratios) => {
                    println!("{name:24} {method:6} {ratios:.3?}");
                    assert!(
                        ratios.iter().all(|r| *r >= 1.0 - 1e-3),
                        "{name} {method} {ratios:?}"
                    );
                    checked += 1;
                }
                Err(Error::Certificate { because, .. }) => {
                    println!("{name:24} {method:6} {because}");
                    assert!(REFUSED.contains(&name), "{name}: {because}");
                }
                Err(other) => panic!("{name}: {other}"),
            }
        }
    }
    assert!(checked * 3 > 50 * in_turn(0).len(), "{checked}");
}

#[test]
fn bounds_hold_in_space() {
    let mut checked = 0;
    for (k, name) in Scene::exact_names_3d().into_iter().enumerate() {
        // Its data take half of the time of all scenes: with `tests/run --all`.
        if name == "checkerboard" && asked_for().1 == 1 {
            continue;
        }
        for method in in_turn(k) {
            match ratios(name, method, 4) {
                Ok(ratios) => {
                    println!("{name:24} {method:6} {ratios:.3?}");
                    assert!(
                        ratios.iter().all(|r| *r >= 1.0 - 1e-3),
                        "{name} {method} {ratios:?}"
                    );
                    checked += 1;
                }
                // r^(3/2) by its angle, which jumps where that turns over.
                Err(Error::Certificate { because, .. }) => {
                    println!("{name:24} {method:6} {because}");
                    assert!(because.contains("next to Γ_D"), "{name}: {because}");
                }
                Err(other) => panic!("{name}: {other}"),
            }
        }
    }
    let least = if asked_for().1 == 1 { 3 } else { 4 };
    assert!(checked >= least * in_turn(0).len(), "{checked}");
}

#[test]
fn the_averaged_gradient_is_bounded_sharply() {
    let names = ["transition-1.5", "contact-everywhere", "many-zones-3"];
    let (_, times) = asked_for();
    for name in &names[..if times > 1 { 3 } else { 1 }] {
        let [g, _, u_h] = ratios(name, "cr-fc", 32).expect("a certificate");
        println!("{name} {g} {u_h}");
        // G's error is of second order, and what is left of f between quadratic functions is of third.
        assert!(g < 3.0 && u_h < 1.25, "{name}: {g} {u_h}");
    }
}

/// A scene's mesh whose inner vertices are moved by up to this part of h; none where a cell turned over.
fn with_moved_vertices(
    scene: &Scene,
    n: usize,
    moved: f64,
    random: &mut impl FnMut() -> f64,
) -> Option<Triangulation> {
    let (label, mut points) = scene.mesh(Some(n)).unwrap();
    let plain = Triangulation::new(&label, &points).unwrap();
    let mut inner = vec![true; plain.points.len()];
    for face in (0..plain.face_count()).filter(|&f| plain.is_boundary(f)) {
        plain
            .face(face)
            .iter()
            .for_each(|&v| inner[v as usize] = false);
    }
    let h = plain.geometry(0).diameter;
    for (point, inner) in points.points.to_mut().iter_mut().zip(inner) {
        for x in &mut point[..2] {
            *x += if inner { moved * h * random() } else { 0.0 };
        }
    }
    Triangulation::new(&label, &points).ok()
}

/// The same, moved a little.
pub(super) fn moved(scene: &Scene, n: usize, seed: u64) -> Triangulation {
    let mut random = crate::Random::new(seed);
    with_moved_vertices(scene, n, 0.1, &mut || 2.0 * random.next() - 1.0)
        .expect("cells that stay cells")
}

proptest! {
    #![proptest_config(crate::test_config(if asked_for().1 > 1 { 60 } else { 20 }))]

    /// Fields that solve nothing, on meshes that are moved and stretched.
    #[test]
    fn no_field_breaks_the_bound(
        pick in any::<prop::sample::Index>(),
        method in prop::sample::select(vec!["cr", "cr-fc", "p1", "p2"]),
        n in 1usize..4,
        noise in -4.0..1.0,
        seed in any::<u64>(),
        moved in 0.0..0.4,
    ) {
        let names = Scene::exact_names();
        let name = names[pick.index(names.len())];
        let mut random = crate::Random::new(seed);
        let mut random = || 2.0 * random.next() - 1.0;
        let scene = Scene::find(name).unwrap();
        let Some(mesh) = with_moved_vertices(&scene, 2 * n, moved, &mut random) else { return Ok(()) };
        let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method.parse().unwrap())).unwrap();
        let exact = scene.exact().and_then(Exact::formula).unwrap();
        let u: Vec<f64> = problem.space.points().zip(problem.dirichlet.iter()).map(|(x, g)| {
            g.unwrap_or_else(|| exact.value(x) + 10f64.powf(noise) * random())
        }).collect();
        let (certificate, fields) = match certified(&problem, &u) {
            Ok(certified) => certified,
            Err(Error::Certificate { because, .. }) => {
                prop_assert!(
                    REFUSED.contains(&name),
                    "{}: {}", name, because
                );
                return Ok(());
            }
            Err(other) => return Err(TestCaseError::fail(other.to_string())),
        };
        let truth = errors(&fields, exact);
        let least = 1.0 - 1e-3;
        prop_assert!(certificate.g >= least * truth.g, "{} g {} {}", name, certificate.g, truth.g);
        prop_assert!(certificate.v >= least * truth.v, "{} v {} {}", name, certificate.v, truth.v);
        prop_assert!(
            certificate.u_h[1] >= least * truth.u_h && certificate.u_h[0] <= truth.u_h / least,
            "{} u_h {:?} {}", name, certificate.u_h, truth.u_h
        );
    }
}

/// Several waves of f on a cell, along one axis: u = sin(kx + φ), or of y, which touches nothing.
fn waves(k: &str, phase: &str) -> [(&'static str, Scene); 2] {
    [
        ("x", "\"left\", \"right\"", "top", "bottom"),
        ("y", "\"bottom\", \"top\"", "right", "left"),
    ]
    .map(|(axis, held, free, contact)| {
        let text = format!(
            "name = \"waves\"\n[mesh]\ngenerator = \"union-jack\"\nn = 2\n[boundary]\ndirichlet = [{held}]\n\
             neumann = [\"{free}\"]\ncontact = [\"{contact}\"]\n[data]\nf = \"({k})^2*sin({k}*{axis}+{phase})\"\n\
             g = \"sin({k}*{axis}+{phase})\"\npsi = \"3\"\n"
        );
        (axis, Scene::parse(&text).unwrap())
    })
}

/// Norms and loads of cells with a flux that carries the wave of f hold what quadrature finds, tightly.
#[test]
fn norms_with_a_carried_wave_are_those_of_the_fields() {
    let mut checked = 0;
    for (axis, scene) in waves("16*pi", "pi/2-atan(1.5/pi)") {
        let mesh = scene.triangulation(Some(4)).unwrap();
        let f = &scene.data().f;
        let method = Method::cr();
        let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method)).unwrap();
        let (_, fields) = certified(&problem, &solved(&problem)).unwrap();
        for cell in 0..mesh.cell_count() {
            let tree = &fields.data.trees[cell];
            let simplex = fields.simplex(cell);
            let has_lift = !fields.data.lifts_of(cell).is_empty();
            if has_lift || fields.balance(&simplex, cell).carried.is_none() {
                continue;
            }
            checked += 1;
            let geometry = mesh.geometry(cell);
            let [a, b, c, _] = mesh.vertices(cell);
            let [p, q, r, _] = tree.whole.values;
            let tau = tau_by_quadrature(|x| f.value(x), [a, b, c], [p, q, r], f.axes()[0]);
            let points = points_beside_knee(&[a, b, c], f.axes()[0], 4);
            let (sigma, slope) = (sigma(&fields, cell), fields.slope::<3>(&simplex, cell));
            let slope = Quadratic::of(&slope);
            let (values, bubbles) = (fields.corner_values(cell), fields.bubbles_of(cell));
            let bubbles = bubbles.unwrap_or_default();
            let local = problem.space.local(cell, &fields.u);
            let mut sums = [0.0; 5];
            for (lambda, weight) in &points {
                let x = geometry.point(lambda);
                let [along, across] = tau(x);
                let of_v = Vector3::from(slope.at(lambda, 2));
                let sigma = sigma(lambda) + Vector3::new(along, across, 0.0);
                let of_g = 0.5 * (of_v + sigma);
                let of_u = problem.space.slope(&geometry, lambda, &local);
                let v: f64 = (0..3)
                    .map(|i| {
                        let bubble = 4.0 * lambda[(i + 1) % 3] * lambda[(i + 2) % 3];
                        lambda[i] * values[i].mid() + bubbles[i] * bubble
                    })
                    .sum();
                let fields = [of_v - sigma, of_g, of_g - of_u, sigma].map(|w| w.norm_squared());
                let [misfit, of_g, distance, flux] = fields;
                for (sum, of) in sums
                    .iter_mut()
                    .zip([misfit, of_g, distance, flux, f.value(x) * v])
                {
                    *sum += geometry.measure() * weight * of;
                }
            }
            let norms = fields.norms(&simplex, cell);
            let [misfit, of_g, distance, flux] = [0, 1, 2, 3].map(|k| sums[k].sqrt());
            let holds = |of: Interval, by: f64, tight: f64| {
                let room = 1e-3 * by.abs();
                assert!(
                    of.low - room <= by && by <= of.high + room && of.high - of.low <= tight,
                    "{axis} cell {cell}: {of:?} {by}"
                );
            };
            // σ is not a gradient where p has a slope, and (σ, τ) known less well.
            let size = fields.balance(&simplex, cell).norm + distance;
            holds(
                Interval::new(0.0, norms.parts.misfit),
                misfit,
                misfit + 0.4 * size,
            );
            holds(Interval::new(0.0, norms.flux), flux, flux + 0.4 * size);
            holds(norms.gradient, of_g, 0.4 * size);
            holds(norms.distance, distance, 0.4 * size);
            holds(norms.load, sums[4], 0.05 * size);
        }
    }
    assert!(checked > 20, "{checked}");
}

#[test]
fn waves_longer_than_cells_are_bounded() {
    let mut carried = 0;
    for (axis, scene) in waves("20", "0") {
        let exact = Expression::parse(&format!("sin(20*{axis})")).unwrap();
        // ‖∇u‖² = 200 + 5 sin 40, and J(u) = ½‖∇u‖² - 400 ∫ sin².
        let square = 200.0 + 5.0 * 40.0_f64.sin();
        let energy = 0.5 * square - (200.0 - 5.0 * 40.0_f64.sin());
        for (method, n, seed) in [
            ("cr", 1, 0),
            ("cr", 4, 1),
            ("cr-fc", 2, 2),
            ("p1", 3, 3),
            ("p2", 2, 4),
            ("p2", 5, 5),
        ] {
            let mesh = moved(&scene, n, seed);
            let method_of = method.parse().unwrap();
            let problem =
                Problem::new(&scene, &mesh, &Discretisation::of(&scene, method_of)).unwrap();
            let u = solved(&problem);
            let (certificate, fields) = certified(&problem, &u).unwrap();
            carried += fields
                .data
                .trees
                .iter()
                .filter(|tree| tree.carried.is_some())
                .count();
            let truth = errors(&fields, &exact);
            let ratios = [
                certificate.g / truth.g,
                certificate.v / truth.v,
                certificate.u_h[1] / truth.u_h,
            ];
            println!(
                "{axis} {method} {n} {ratios:.3?} {:?} {:?}",
                certificate.gradient, certificate.energy
            );
            assert!(
                ratios.iter().all(|r| *r >= 1.0 - 1e-4 && *r < 6.0),
                "{axis} {method} {n} {ratios:?}"
            );
            assert!(certificate.u_h[0] <= truth.u_h * (1.0 + 1e-4));
            let holds = |[low, high]: [f64; 2], value: f64| low <= value && value <= high;
            assert!(
                holds(certificate.gradient, square.sqrt()),
                "{:?}",
                certificate.gradient
            );
            assert!(
                holds(certificate.energy, energy),
                "{:?} {energy}",
                certificate.energy
            );
        }
    }
    assert!(carried > 100, "{carried}");
}

fn integral(mesh: &Triangulation, value: impl Fn(usize, &CellGeometry, &[f64; 4]) -> f64) -> f64 {
    let points = points_of_shares(mesh.dim)(1.0);
    let of_cell = |cell: usize| -> f64 {
        let geometry = mesh.geometry(cell);
        let values = points
            .iter()
            .map(|(at, weight)| weight * value(cell, &geometry, at));
        geometry.measure() * values.sum::<f64>()
    };
    (0..mesh.cell_count()).map(of_cell).sum()
}

/// The identity that all rests on, with functions that have nothing to do with each other.
#[test]
fn both_sides_of_the_identity_are_equal() {
    let scene = Scene::find("two-sides-contact").unwrap();
    let exact = scene.exact().and_then(Exact::formula).unwrap();
    let mesh = scene.triangulation(Some(4)).unwrap();
    let problem =
        Problem::new(&scene, &mesh, &Discretisation::of(&scene, Method::cr_fc())).unwrap();
    let u: Vec<f64> = problem
        .space
        .points()
        .zip(problem.dirichlet.iter())
        .map(|(x, g)| g.unwrap_or(exact.value(x) + 0.1 * (7.0 * x[0]).sin() - 0.2 * x[1]))
        .collect();
    let (_, fields) = certified(&problem, &u).unwrap();
    let (v, lambda): (Vec<f64>, _) = (fields.v.iter().map(|v| v.mid()).collect(), &fields.lambda);
    assert!(lambda.iter().any(|l| *l < 0.0));
    let slope = |x: [f64; 3]| Vector3::from(exact.gradient(x));
    let linear = |cell: usize, lambda: &[f64; 4]| -> f64 {
        let vertices = mesh.cell(cell).iter().zip(lambda);
        vertices.map(|(&k, l)| l * v[k as usize]).sum()
    };
    let of_v = |cell: usize| {
        let slope = fields.simplex(cell).gradient(&fields.corner_values(cell));
        Vector3::from(slope.map(Interval::mid))
    };
    let left = integral(&mesh, |cell, geometry, at| {
        let gradient = slope(geometry.point(at));
        let sigma = sigma(&fields, cell)(at);
        (of_v(cell) - gradient).norm_squared() + (sigma - gradient).norm_squared()
    });
    let right = integral(&mesh, |cell, geometry, at| {
        let x = geometry.point(at);
        let load = &fields.data.loads[cell];
        let linear_load: f64 =
            load.mean + load.slopes.iter().zip(at).map(|(a, l)| a * l).sum::<f64>();
        let rest = scene.data().f.value(x) - linear_load;
        (of_v(cell) - sigma(&fields, cell)(at)).norm_squared()
            + 2.0 * rest * (exact.value(x) - linear(cell, at))
    });
    let (mut touching, mut given) = (0.0, 0.0);
    for (face, lambda) in problem.contact.iter().zip(lambda) {
        let geometry = mesh.geometry(face.cell);
        let local = mesh.local_face(face.cell, face.face);
        let normal = geometry.normal(local);
        let corners: Vec<usize> = (0..3).filter(|&i| i != local).collect();
        for ([p, q, ..], weight) in exact_on_edges().iter() {
            let mut at = [0.0; 4];
            (at[corners[0]], at[corners[1]]) = (p, q);
            let (x, weight) = (geometry.point(&at), weight * face.measure);
            let value = linear(face.cell, &at);
            touching += weight * (slope(x).dot(&normal) * value + lambda * exact.value(x));
            given += weight * lambda * value;
        }
    }
    let (left, right) = (left + 2.0 * touching, right + 2.0 * given);
    assert!((left - right).abs() < 1e-6 * right, "{left} {right}");
}

fn exact_on_edges() -> quadrature::Rule {
    exact(1, 9)
}

#[test]
fn what_has_no_certificate_is_refused_in_words() {
    let scene = Scene::find("two-sides-contact").unwrap();
    let mesh = scene.triangulation(Some(2)).unwrap();
    let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, Method::cr())).unwrap();
    let refused = |scene: &Scene, u: &[f64], word: &str| {
        let problem = Problem::new(scene, &mesh, &Discretisation::of(scene, Method::cr())).unwrap();
        let text = certify(&problem, u).unwrap_err().to_string();
        assert!(
            text.starts_with("no certificate, because") && text.contains(word),
            "{text}"
        );
    };
    refused(
        &scene,
        &vec![1.0; problem.space.dofs],
        "violates its boundary data",
    );
    let with = |change: &dyn Fn(&mut Data)| {
        let mut data = scene.data().clone();
        change(&mut data);
        scene.with_data(data)
    };
    let parsed = |text: &str| Expression::parse(text).unwrap();
    for (g, word) in [
        ("if(x<0.53,-1,0)", "may jump"),
        ("-abs(x-0.53)^0.501", "slope of g is not bounded"),
        ("if(x<0.5,-1,0)", "may jump"),
        ("-1/(x-0.5)^2", "g could not be bounded"),
    ] {
        refused(&with(&|data| data.g = parsed(g)), &problem.start(), word);
    }
    refused(
        &with(&|data| data.f = parsed("1/(x-0.3)^2")),
        &problem.start(),
        "f could not be bounded",
    );
    let empty = with(&|data| data.psi = parsed("-1"));
    refused(&empty, &problem.start(), "below ψ");
}

/// A scene on the unit square: Γ_D on top, Γ_C at the bottom, sides free.
pub(super) fn square(f: &str, t: &str, g: &str, psi: &str) -> Scene {
    let parsed = |text: &str| Expression::parse(text).unwrap();
    Scene::find("one-zone").unwrap().with_data(Data {
        f: parsed(f),
        t: parsed(t),
        g: parsed(g),
        psi: parsed(psi),
    })
}
