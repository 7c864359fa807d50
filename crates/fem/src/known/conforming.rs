//! The errors of a conforming solution against the mesh-free one.

use super::nonconforming::{pieces, square_on_cell, transitions};
use crate::contact::{Errors, Problem, Quantities};
use crate::element::Space;
use crate::quadrature::{self, Piece, Rule, WHOLE, cut, longest_edge};
use crate::truth::Reference;
use faceoff_mesh::parallel;

/// The rounding of the squares whose difference is an error, relative to them: the truth has 13 digits, (f, U) as many.
const ROUNDING: f64 = 1e-12;
/// The radians of f across a part of a cell, at most: the product rule below has thirteen digits then.
const RADIANS: f64 = 0.5;

/// The errors of a conforming solution itself, relative to the norms of u.
///
/// U vanishes on Γ_D and is continuous, so that (∇u, ∇U) = (f, U) + <∂ₙu, U>_C and
/// ‖∇(u-U)‖² = ‖∇u‖² + ‖∇U‖² - 2 (∇u, ∇U): no gradient of u is needed. (f, U) is integrated to rounding, whatever rule the
/// scheme has: the error of that rule is part of U, not of its product with u. Where cancellation leaves no digit the error is
/// that of rounding, which it is at most, never 0.
pub fn fine_errors(problem: &Problem, u: &[f64], norms: &Quantities, truth: &Reference) -> Errors {
    let space = &problem.space;
    let mesh = space.mesh;
    let gauss = quadrature::exact(1, 9);
    let products = parallel::collect(mesh.cell_count(), |cell| {
        load_on_cell(space, u, truth, &gauss, cell)
    });
    let [mut product, size] = products
        .iter()
        .fold([0.0; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]]);
    for face in &problem.contact {
        let [a, b] = [0, 1].map(|k| mesh.points[mesh.face(face.face)[k] as usize]);
        let local = mesh.local_face(face.cell, face.face);
        let vertices = mesh.cell(face.cell);
        let first = mesh.face(face.face)[0];
        let values = space.local(face.cell, u);
        let cuts: Vec<f64> = transitions(truth)
            .map(|end| (end - a[0]) / (b[0] - a[0]))
            .filter(|s| *s > 0.0 && *s < 1.0)
            .collect();
        let integral = pieces(&cuts, |s| {
            let mut lambda = [0.0; 4];
            for (i, lambda) in lambda.iter_mut().enumerate().take(3) {
                if i != local {
                    *lambda = if vertices[i] == first { 1.0 - s } else { s };
                }
            }
            truth.flux(a[0] + s * (b[0] - a[0])) * space.value(&lambda, &values)
        });
        product += face.measure * integral;
    }
    let rounding = ROUNDING * (truth.grad_norm_sq + norms.grad_norm_sq + 2.0 * size);
    let square = truth.grad_norm_sq + norms.grad_norm_sq - 2.0 * product;
    let rule = quadrature::exact(2, 5);
    let squares = parallel::collect(mesh.cell_count(), |cell| {
        square_on_cell(space, u, truth, &rule, cell)
    });
    Errors {
        h1: (square.max(rounding) / truth.grad_norm_sq).sqrt(),
        l2: squares.iter().sum::<f64>().sqrt() / truth.l2_norm,
    }
}

/// ∫ f U and ∫ |f U| over a cell, which is cut until f, one wave in x, turns little across a part.
fn load_on_cell(
    space: &Space,
    u: &[f64],
    truth: &Reference,
    gauss: &Rule,
    cell: usize,
) -> [f64; 2] {
    let geometry = space.mesh.geometry(cell);
    let corners = [0, 1, 2].map(|i| geometry.point(&WHOLE[i])[0]);
    let along = |edge: &[f64; 4]| (0..3).map(|i| edge[i] * corners[i]).sum::<f64>().abs();
    let local = space.local(cell, u);
    let mut sum = [0.0; 2];
    let mut left = vec![(WHOLE, geometry.measure())];
    while let Some((piece, measure)) = left.pop() {
        let [i, j] = longest_edge(&piece, 2, along);
        let edge = std::array::from_fn(|k| piece[i][k] - piece[j][k]);
        if truth.wave_number() * along(&edge) > RADIANS {
            left.extend(cut(&piece, [i, j], 0.5).map(|half| (half, 0.5 * measure)));
            continue;
        }
        for (lambda, weight) in drawn_together(gauss, &piece) {
            let f = truth.f(geometry.point(&lambda)[0]);
            let term = measure * weight * f * space.value(&lambda, &local);
            sum = [sum[0] + term, sum[1] + term.abs()];
        }
    }
    sum
}

/// Points and weights of a product rule on a triangle, a square of which one side is drawn together: (s, t) ↦ p₀ + s (p₁ - p₀) + s t (p₂ - p₁) has the Jacobian 2 |T| s.
fn drawn_together<'a>(
    gauss: &'a Rule,
    piece: &'a Piece,
) -> impl Iterator<Item = ([f64; 4], f64)> + 'a {
    gauss.iter().flat_map(move |(along, weight)| {
        let s = along[1];
        gauss.iter().map(move |(across, other)| {
            let t = across[1];
            let inner = [1.0 - s, s * (1.0 - t), s * t];
            let lambda = std::array::from_fn(|i| (0..3).map(|k| inner[k] * piece[k][i]).sum());
            (lambda, 2.0 * s * weight * other)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Discretisation, Iteration, Method, Stop, quantities, solve};
    use crate::quadrature::parts;
    use crate::scene::Scene;
    use crate::truth::DEFAULT_RESOLUTION;

    /// Against the gradients themselves, by points in 256 parts of each cell: the rule of a scheme does not affect how its error is
    /// measured, and each rule has another error.
    #[test]
    fn errors_are_those_of_gradients_whatever_the_rule_of_the_scheme() {
        let scene = Scene::find("one-zone").unwrap();
        let truth = Reference::one_zone(DEFAULT_RESOLUTION).unwrap();
        let mesh = scene.triangulation(Some(6)).unwrap();
        let rule = quadrature::exact(2, 5);
        let pieces = (0..4).fold(vec![WHOLE], |all, _| {
            all.iter().flat_map(|p| parts(p, 2)).collect()
        });
        for name in ["centroid", "edges-3", "radon-7"] {
            let mut discretisation = Discretisation::of(&scene, Method::p2());
            discretisation.load_quadrature = Some(name.into());
            let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
            let u = solve(&problem, Iteration::Newton, Stop::default(), |_, _| Ok(()))
                .unwrap()
                .u;
            let found = fine_errors(&problem, &u, &quantities(&problem, &u), &truth);
            let space = &problem.space;
            let squares = parallel::collect(mesh.cell_count(), |cell| {
                let geometry = mesh.geometry(cell);
                let local = space.local(cell, &u);
                let mut sum = 0.0;
                for piece in &pieces {
                    for (inner, weight) in rule.iter() {
                        let lambda: [f64; 4] =
                            std::array::from_fn(|i| (0..3).map(|k| inner[k] * piece[k][i]).sum());
                        let [x, y, _] = geometry.point(&lambda);
                        let [gx, gy] = truth.grad(x, y);
                        let slope = space.slope(&geometry, &lambda, &local);
                        sum += weight * ((gx - slope[0]).powi(2) + (gy - slope[1]).powi(2));
                    }
                }
                geometry.measure() * sum / pieces.len() as f64
            });
            let direct = (squares.iter().sum::<f64>() / truth.grad_norm_sq).sqrt();
            assert!(
                (found.h1 / direct - 1.0).abs() < 1e-3,
                "{name}: {found:?} {direct}"
            );
        }
    }
}
