//! What a wrong answer is right for: the case again by the Rust solver, with one thing changed at a time.

use crate::engine::Case;
use faceoff_fem::contact::{Discretisation, Iteration, Law, Method, Problem, Stop, solve};
use faceoff_fem::quadrature;
use faceoff_fem::scene::{Boundary, Data, Expression, HRule, Scene};
use faceoff_mesh::mesh::Triangulation;

/// Two answers are one if they differ by less than this, relative to the larger of them. A factor of γ that is found by
/// search is not known to more digits.
const SAME: f64 = 1e-8;

/// Everything by which `u` would be right, in words; `known` is what it should be.
pub(super) fn suspects(case: &Case, mesh: &Triangulation, u: &[f64], known: &[f64]) -> Vec<String> {
    if let Some(factor) = factor(u, known) {
        return vec![format!("it is {factor:.6e} times what it should be")];
    }
    let mut found = Vec::new();
    for (words, scene, discretisation) in variants(&case.problem) {
        if answer(&scene, mesh, &discretisation).is_some_and(|v| distance(u, &v) < SAME) {
            found.push(words);
        }
    }
    if found.is_empty()
        && let Some(factor) = factor_of_gamma(case, mesh, u)
    {
        found.push(format!("γ is {factor:.6e} times what it should be"));
    }
    found
}

/// What the Rust solver finds; none where there is nothing to be found.
fn answer(
    scene: &Scene,
    mesh: &Triangulation,
    discretisation: &Discretisation,
) -> Option<Vec<f64>> {
    let problem = Problem::new(scene, mesh, discretisation).ok()?;
    let solution = solve(&problem, Iteration::Newton, Stop::default(), |_, _| Ok(())).ok()?;
    solution.converged.then_some(solution.u)
}

/// max |a - b| relative to the largest value of both
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let largest = a
        .iter()
        .chain(b)
        .fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
    let difference = a
        .iter()
        .zip(b)
        .fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
    difference / largest
}

/// c of u = c · known.
fn factor(u: &[f64], known: &[f64]) -> Option<f64> {
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let factor = dot(u, known) / dot(known, known);
    let scaled: Vec<f64> = known.iter().map(|v| factor * v).collect();
    (factor.is_finite() && distance(u, &scaled) < SAME).then_some(factor)
}

/// Scenes and discretisations that differ in one thing from those asked for, and in which.
fn variants(problem: &Problem) -> Vec<(String, Scene, Discretisation)> {
    let (scene, usual) = (problem.scene, &problem.discretisation);
    let mut all = Vec::new();
    type Of = fn(&mut Data) -> &mut Expression;
    let data: [(&str, Of); 4] = [
        ("f", |data| &mut data.f),
        ("g", |data| &mut data.g),
        ("t", |data| &mut data.t),
        ("ψ", |data| &mut data.psi),
    ];
    for (name, of) in data {
        let given = of(&mut scene.data().clone()).clone();
        if given.is_zero() {
            continue;
        }
        for (text, what) in [
            (format!("-({})", given.text()), "has the other sign"),
            ("0".to_owned(), "is left out"),
        ] {
            if let Ok(other) = Expression::parse(&text) {
                let mut data = scene.data().clone();
                *of(&mut data) = other;
                let scene = scene.with_data(data);
                all.push((format!("{name} {what}"), scene, usual.clone()));
            }
        }
    }
    let sides = [
        ("Γ_C and Γ_N", [2, 1]),
        ("Γ_C and Γ_D", [2, 0]),
        ("Γ_N and Γ_D", [1, 0]),
    ];
    for (names, [i, k]) in sides {
        let Boundary {
            dirichlet,
            neumann,
            contact,
        } = scene.boundary().clone();
        let mut parts = [dirichlet, neumann, contact];
        parts.swap(i, k);
        let [dirichlet, neumann, contact] = parts;
        let scene = scene.with_boundary(Boundary {
            dirichlet,
            neumann,
            contact,
        });
        all.push((format!("{names} are swapped"), scene, usual.clone()));
    }
    let mut add = |words: String, change: &dyn Fn(&mut Discretisation)| {
        let mut changed = usual.clone();
        change(&mut changed);
        all.push((words, scene.clone(), changed));
    };
    add("γ is that of the largest cell everywhere".into(), &|d| {
        d.h = HRule::Global
    });
    for (below, what) in [(0, "(f, v)"), (1, "Γ_C and Γ_N")] {
        for rule in quadrature::names(problem.space.mesh.dim - below) {
            let words = format!("the points for {what} are those of {rule}");
            add(words, &|d| {
                let place = match below {
                    0 => &mut d.load_quadrature,
                    _ => &mut d.contact_quadrature,
                };
                *place = Some((*rule).into());
            });
        }
    }
    match usual.method.law {
        Law::FluxCorrected => {
            add("the flux is not corrected".into(), &|d| {
                d.method = Method::cr()
            });
        }
        Law::Nitsche { theta1, theta2 } => {
            for (a, b) in [(1, 0), (1, 1), (0, 1), (-1, 0), (-1, 1)] {
                if (a, b) != (theta1, theta2) {
                    add(format!("θ₁ = {a} and θ₂ = {b}"), &|d| {
                        d.method = Method::nitsche(d.method.element, a, b)
                    });
                }
            }
            if usual.method.element.name() == "CR" {
                add("the flux is corrected".into(), &|d| {
                    d.method = Method::cr_fc()
                });
            }
        }
        _ => {}
    }
    all
}

/// s, where `u` is the answer with s γ for γ: the best of some decades, then by golden section.
fn factor_of_gamma(case: &Case, mesh: &Triangulation, u: &[f64]) -> Option<f64> {
    let at = |log: f64| -> f64 {
        let mut discretisation = case.problem.discretisation.clone();
        discretisation.gamma0 *= 10_f64.powf(log);
        let answer = answer(case.scene(), mesh, &discretisation);
        answer.map_or(f64::INFINITY, |v| distance(u, &v))
    };
    let grid = (-12..=12).map(|k| f64::from(k) / 2.0);
    let best = grid
        .map(|log| (at(log), log))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    // Towards 0 and infinity the answer no longer depends on γ, and many would fit.
    if best.1.abs() > 5.0 {
        return None;
    }
    let (mut low, mut high) = (best.1 - 0.5, best.1 + 0.5);
    let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
    for _ in 0..60 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if at(a) < at(b) {
            high = b;
        } else {
            low = a;
        }
    }
    let log = (low + high) / 2.0;
    (at(log) < SAME).then(|| 10_f64.powf(log))
}

/// Are the values of all cells right, but in one other order? `raw` and `known` have all local dofs of all cells.
pub(super) fn order(case: &Case, raw: &[f64], known: &[f64]) -> Option<String> {
    let space = &case.problem.space;
    let local = space.local_dofs;
    let largest = known.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let same = |a: f64, b: f64| (a - b).abs() <= SAME * largest;
    if raw.iter().zip(known).all(|(a, b)| same(*a, *b)) {
        return None;
    }
    // Dofs on vertices and on edges are not mixed up with each other.
    let vertices = space.mesh.dim + 1;
    let groups = [0..vertices.min(local), vertices.min(local)..local];
    let fits = |place: usize, from: usize| {
        let cells = raw.chunks(local).zip(known.chunks(local));
        cells
            .into_iter()
            .all(|(raw, known)| same(raw[place], known[from]))
    };
    let orders: Option<Vec<Vec<usize>>> = groups
        .into_iter()
        .map(|group| arrange(group.collect(), &fits))
        .collect();
    let order = orders?.concat();
    Some(format!(
        "the dofs of a cell are right but come in another order: at the places 0, 1, … stand those of {order:?}"
    ))
}

/// Are the values right, but at other places in each cell, or at other cells?
pub(super) fn elsewhere(case: &Case, raw: &[f64], known: &[f64]) -> Option<String> {
    let local = case.problem.space.local_dofs;
    let largest = known.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let same = |a: f64, b: f64| (a - b).abs() <= SAME * largest;
    let sorted = |values: &[f64]| {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        sorted
    };
    let alike = |a: &[f64], b: &[f64]| {
        let (a, b) = (sorted(a), sorted(b));
        a.iter().zip(&b).all(|(a, b)| same(*a, *b))
    };
    if raw
        .chunks(local)
        .zip(known.chunks(local))
        .all(|(a, b)| alike(a, b))
    {
        return Some(
            "each cell has the right values, but in an order that differs from cell to cell: \
             dofs belong to the vertices in the order given, not in the code's own"
                .into(),
        );
    }
    alike(raw, known)
        .then(|| "the values are right, but stand at other cells: keep the order given".into())
}

/// For each of `places`, a different one of them that it fits: `fits(place, from)`.
fn arrange(places: Vec<usize>, fits: &dyn Fn(usize, usize) -> bool) -> Option<Vec<usize>> {
    fn place(done: &mut Vec<usize>, places: &[usize], fits: &dyn Fn(usize, usize) -> bool) -> bool {
        let Some(next) = places.get(done.len()) else {
            return true;
        };
        for from in places {
            if !done.contains(from) && fits(*next, *from) {
                done.push(*from);
                if place(done, places, fits) {
                    return true;
                }
                done.pop();
            }
        }
        false
    }
    let mut done = Vec::with_capacity(places.len());
    place(&mut done, &places, fits).then_some(done)
}
