//! The field that v, λ and σ come from: u_h, or the solution of its scheme with f and t integrated.
//!
//! A scheme takes (f, φ_i) and <t, φ_i>_N by its rules. Where f jumps or has peaks these are off, and v and λ would keep what u_h
//! is off by on all of the domain, however fine the cells are where f is hard. Any v, λ and σ will do: the scheme is then solved
//! once more, with the integrals of f and t that the certificate has anyway.

use super::admissible;
use super::data::{Load, PreparedData};
use super::flux;
use super::tree::Tree;
use crate::contact::{Iteration, Problem, Stop, solve};
use crate::element::Space;
use crate::interval::Interval;
use faceoff_mesh::error::{Error, Result};

/// The integrals that a scheme takes are off where what they move u_h by is more than this part of its error, about …
const OFF: f64 = 0.1;
/// … and than this part of ‖τ‖, which the bound has from f only: what is less adds an eighth to that at most.
const BESIDE_WAVES: f64 = 0.5;

/// The scheme with its integrals, and its solution; none where u_h serves as well.
///
/// # Errors
/// An interruption.
pub(super) fn integrated<'a>(
    problem: &Problem<'a>,
    u: &[f64],
    data: &PreparedData,
) -> Result<Option<(Problem<'a>, Vec<f64>)>> {
    let given = problem.scene.data();
    let is_constant = given.f.axes().is_empty() && given.t.axes().is_empty();
    if is_constant {
        return Ok(None);
    }
    let Some(load) = loads(&problem.space, data) else {
        return Ok(None);
    };
    if !is_off(problem, u, &load, data) {
        return Ok(None);
    }
    tracing::debug!("the rules of the scheme do not integrate f or t: it is solved once more");
    let back = |b: &f64| Interval::at(*b).times_power_of_two(-data.unit).mid();
    let again = problem.loaded_by(load.iter().map(back).collect());
    let solved = again.and_then(|again| {
        let solution = solve(&again, Iteration::Newton, Stop::default(), |_, _| Ok(()))?;
        Ok((again, solution.u))
    });
    match solved {
        Ok(solved) => Ok(Some(solved)),
        Err(Error::Solver { .. }) => Ok(None),
        Err(other) => Err(other),
    }
}

/// (f, φ_i) + <t, φ_i>_N in the data's unit, where they are known for these φ_i.
fn loads(space: &Space, data: &PreparedData) -> Option<Vec<f64>> {
    match (space.element.name(), space.mesh.dim) {
        ("CR", _) => {
            let [_, b] = flux::loads(space.mesh, data, Load::on_face);
            Some(b)
        }
        ("P1", _) | ("P2", 2) => Some(admissible::loads(space, data)),
        _ => None,
    }
}

/// Whether ‖δ‖_V' of the difference δ of the loads is more than a part of the error of u_h on this mesh. From below: what
/// δ is for u_h itself, and for single φ_i.
fn is_off(problem: &Problem, u: &[f64], load: &[f64], data: &PreparedData) -> bool {
    let diagonal = problem.stiffness.diagonal();
    let (mut on_u, mut apart, mut size) = (0.0, 0.0, 0.0);
    for (i, b) in load.iter().enumerate() {
        if problem.dirichlet[i].is_none() {
            let off = b - data.scaled(problem.load[i]);
            on_u += off * data.scaled(u[i]);
            apart += off * off / diagonal[i];
            size += b * b / diagonal[i];
        }
    }
    let energy: f64 = {
        let product = problem.stiffness.times(u);
        let terms = product.iter().zip(u);
        terms.map(|(y, u)| data.scaled(*y) * data.scaled(*u)).sum()
    };
    if energy > 0.0 {
        apart += on_u * on_u / energy;
    }
    let (mesh, degree) = (problem.space.mesh, problem.space.element.degree());
    let order = degree as f64 / mesh.dim as f64;
    let error = (mesh.cell_count() as f64).powf(-order);
    let carried = |(cell, tree): (usize, &Tree)| {
        let carried = tree.carried.as_ref()?;
        Some(mesh.measure(cell) * carried.square.mid())
    };
    let of_waves: f64 = data.trees.iter().enumerate().filter_map(carried).sum();
    apart.sqrt() > (OFF * error * (energy + size).sqrt()).max(BESIDE_WAVES * of_waves.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::{add_load, add_traction};
    use crate::certify::tests::{certified, points_of_parts, solved};
    use crate::contact::Discretisation;
    use crate::quadrature::{Rule, exact};
    use crate::scene::{Data, Expression, Part, Scene};

    fn with_data(base: &str, f: &str, t: &str) -> Scene {
        let scene = Scene::find(base).unwrap();
        scene.with_data(Data {
            f: Expression::parse(f).unwrap(),
            t: Expression::parse(t).unwrap(),
            ..scene.data().clone()
        })
    }

    fn fine(dim: usize) -> Rule {
        let points = points_of_parts(dim, 4);
        Rule {
            points: points.iter().map(|(at, _)| at[1..=dim].to_vec()).collect(),
            weights: points.iter().map(|(_, weight)| *weight).collect(),
            ..exact(dim, 5)
        }
    }

    /// Against rules that are exact for f times any φ_i, or so fine that they are as good.
    #[test]
    fn loads_are_those_of_exact_rules() {
        for (base, n, f, t, methods, most) in [
            (
                "one-zone",
                5,
                "1+x-2*y",
                "1-y",
                &["cr", "p1-vi", "p2"][..],
                1e-14,
            ),
            // A wave in half a cell, which is carried.
            (
                "one-zone",
                2,
                "sin(25*x)",
                "0",
                &["cr", "p1-vi", "p2"],
                1e-6,
            ),
            (
                "one-zone-3d",
                2,
                "1+x-2*y+3*z",
                "1-z",
                &["cr", "p1-vi"],
                1e-14,
            ),
        ] {
            let scene = with_data(base, f, t);
            let mesh = scene.triangulation(Some(n)).unwrap();
            for method in methods {
                let discretisation = Discretisation::of(&scene, method.parse().unwrap());
                let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
                let data = PreparedData::new(&problem).unwrap();
                let is_carried = data.trees.iter().any(|tree| tree.carried.is_some());
                assert_eq!(is_carried, f.contains("sin"));
                let mut expected = vec![0.0; problem.space.dofs];
                let (rule, on_faces) = (fine(mesh.dim), exact(mesh.dim - 1, 3));
                let of = scene.data();
                add_load(&problem.space, &of.f, &rule, &mut expected).unwrap();
                for face in 0..mesh.face_count() {
                    if problem.parts[face] == Some(Part::Neumann) {
                        let t = &of.t;
                        add_traction(&problem.space, t, face, &on_faces, &mut expected).unwrap();
                    }
                }
                let found = loads(&problem.space, &data).unwrap();
                for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
                    if problem.dirichlet[i].is_none() {
                        let off = (found - expected).abs();
                        assert!(off < most, "{base} {method} {i} {found} {expected}");
                    }
                }
            }
        }
    }

    /// A band that no point of the rule meets: 31 % and 90 % with what u_h is by its rule.
    #[test]
    fn bounds_do_not_keep_what_a_rule_is_off_by() {
        // u depends only on y, and nothing touches: ∂u/∂y is a y below the band, and a y + 1 above.
        let truth = |a: f64| {
            let cubes =
                |from: f64, to: f64, slope: f64| (to.powi(3) - from.powi(3)) / (3.0 * slope);
            let above = match a {
                0.0 => 0.499,
                _ => cubes(0.501 * a + 1.0, a + 1.0, a),
            };
            let in_band = cubes(0.499 * a, 0.501 * a + 1.0, a + 500.0);
            (a * a * 0.499_f64.powi(3) / 3.0 + in_band + above).sqrt()
        };
        for (a, f, most) in [
            (1.0, "-1-if(abs(y-0.5)<0.001,500,0)", 0.04),
            (0.0, "-if(abs(y-0.5)<0.001,500,0)", 0.08),
        ] {
            let truth = truth(a);
            let scene = with_data("one-zone", f, "0");
            for method in ["cr", "cr-fc", "p1-vi", "p2"] {
                let mesh = scene.triangulation(Some(24)).unwrap();
                let discretisation = Discretisation::of(&scene, method.parse().unwrap());
                let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
                let u = solved(&problem);
                let (certificate, _) = certified(&problem, &u).unwrap();
                let [low, high] = certificate.gradient;
                assert!(low <= truth && truth <= high, "{f} {method} {low} {high}");
                assert!(
                    certificate.g < most * truth,
                    "{f} {method} {}",
                    certificate.g
                );
            }
        }
    }
}
