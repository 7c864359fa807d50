//! The errors of a conforming solution against the mesh-free one.

use rayon::prelude::*;

use super::nonconforming::{pieces, square_on_cell, transitions};
use crate::contact::{Errors, Problem, Quantities};
use crate::element::{Basis, Space};
use crate::quadrature::{self, Piece, Rule, WHOLE, parts};
use crate::truth::Reference;
use faceoff_mesh::mesh::CellGeometry;

/// What is left of the squares whose difference is an error, relative to them: the truth has 13 digits, (f, U) 12.
const ROUNDING: f64 = 1e-12;
/// A part of a cell is halved until that changes the mean there by less than this share of the mean of all, or so often.
const SHARE: f64 = 1e-11;
const DEEPEST: usize = 8;

/// The errors of a conforming solution itself, relative to the norms of u.
///
/// U vanishes on Γ_D and is continuous, so that (∇u, ∇U) = (f, U) + <∂ₙu, U>_C and
/// ‖∇(u-U)‖² = ‖∇u‖² + ‖∇U‖² - 2 (∇u, ∇U): no gradient of u is needed. (f, U) is integrated to twelve digits, whatever rule the
/// scheme has: the error of that rule is part of U, not of its product with u. Where cancellation leaves no digit the error is
/// that of rounding, which it is at most, never 0.
pub fn fine_errors(problem: &Problem, u: &[f64], norms: &Quantities, truth: &Reference) -> Errors {
    let space = &problem.space;
    let mesh = space.mesh;
    let rule = quadrature::exact(2, 5);
    let cells = || (0..mesh.cell_count()).into_par_iter();
    let load = |cell| Load::new(space, u, truth, &rule, cell);
    let sizes: Vec<[f64; 2]> = cells()
        .map(|cell| {
            let load = load(cell);
            [load.measure() * load.on(&WHOLE).1, load.measure()]
        })
        .collect();
    let [size, measure] = sizes
        .iter()
        .fold([0.0; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]]);
    let room = SHARE * size / measure;
    let integrals: Vec<f64> = cells()
        .map(|cell| {
            let load = load(cell);
            load.measure() * load.refined(&WHOLE, load.on(&WHOLE).0, room, DEEPEST)
        })
        .collect();
    let mut product: f64 = integrals.iter().sum();
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
    let squares: Vec<f64> = (0..mesh.cell_count())
        .into_par_iter()
        .map(|cell| square_on_cell(space, u, truth, &rule, cell))
        .collect();
    Errors {
        h1: (square.max(rounding) / truth.grad_norm_sq).sqrt(),
        l2: squares.iter().sum::<f64>().sqrt() / truth.l2_norm,
    }
}

/// f U on a cell.
struct Load<'a> {
    space: &'a Space<'a>,
    truth: &'a Reference,
    rule: &'a Rule,
    geometry: CellGeometry,
    local: Basis,
}

impl<'a> Load<'a> {
    fn new(
        space: &'a Space<'a>,
        u: &[f64],
        truth: &'a Reference,
        rule: &'a Rule,
        cell: usize,
    ) -> Self {
        Load {
            space,
            truth,
            rule,
            geometry: space.mesh.geometry(cell),
            local: space.local(cell, u),
        }
    }

    fn measure(&self) -> f64 {
        self.geometry.measure()
    }

    /// The means of f U and |f U| over a part of the cell, by the rule.
    fn on(&self, part: &Piece) -> (f64, f64) {
        let terms = self.rule.iter().map(|(inner, weight)| {
            let lambda = std::array::from_fn(|i| (0..3).map(|k| inner[k] * part[k][i]).sum());
            let f = self.truth.f(self.geometry.point(&lambda)[0]);
            weight * f * self.space.value(&lambda, &self.local)
        });
        terms.fold((0.0, 0.0), |(sum, size), term| {
            (sum + term, size + term.abs())
        })
    }

    /// The mean of f U over a part, cut until the parts of it give the same.
    fn refined(&self, part: &Piece, coarse: f64, room: f64, deeper: usize) -> f64 {
        let parts = parts(part, 2);
        let share = 1.0 / parts.len() as f64;
        let means: Vec<f64> = parts.iter().map(|part| self.on(part).0).collect();
        let fine = share * means.iter().sum::<f64>();
        if deeper == 0 || !((fine - coarse).abs() > room) {
            return fine;
        }
        let each = parts.iter().zip(means);
        let refined = each.map(|(part, mean)| self.refined(part, mean, room, deeper - 1));
        share * refined.sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Discretisation, Iteration, Method, Stop, quantities, solve};
    use crate::scene::Scene;
    use crate::truth::DEFAULT_RESOLUTION;
    use nalgebra::Vector3;

    /// Against the gradients themselves, by points in 256 parts of each cell: the rule of a scheme has no say in how its error is
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
            let squares: Vec<f64> = (0..mesh.cell_count())
                .into_par_iter()
                .map(|cell| {
                    let geometry = mesh.geometry(cell);
                    let local = space.local(cell, &u);
                    let mut sum = 0.0;
                    for piece in &pieces {
                        for (inner, weight) in rule.iter() {
                            let lambda: [f64; 4] = std::array::from_fn(|i| {
                                (0..3).map(|k| inner[k] * piece[k][i]).sum()
                            });
                            let [x, y, _] = geometry.point(&lambda);
                            let [gx, gy] = truth.grad(x, y);
                            let slopes = space.gradients(&geometry, &lambda);
                            let slope: Vector3<f64> = crate::contact::gradient(&slopes, &local);
                            sum += weight * ((gx - slope[0]).powi(2) + (gy - slope[1]).powi(2));
                        }
                    }
                    geometry.measure() * sum / pieces.len() as f64
                })
                .collect();
            let direct = (squares.iter().sum::<f64>() / truth.grad_norm_sq).sqrt();
            assert!(
                (found.h1 / direct - 1.0).abs() < 1e-3,
                "{name}: {found:?} {direct}"
            );
        }
    }
}
