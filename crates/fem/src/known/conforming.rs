//! The errors of a conforming solution against the mesh-free one.

use rayon::prelude::*;

use super::nonconforming::{pieces, square_on_cell, transitions};
use crate::contact::{Errors, Problem, Quantities};
use crate::quadrature;
use crate::truth::Reference;

/// The errors of the P2 solution itself, relative to the norms of u.
///
/// U vanishes on Γ_D and is continuous, so that (∇u, ∇U) = (f, U) + <∂ₙu, U>_C and
/// ‖∇(u-U)‖² = ‖∇u‖² + ‖∇U‖² - 2 (∇u, ∇U): no gradient of u is needed. (f, U) is by the scheme's own rule.
pub fn fine_errors(problem: &Problem, u: &[f64], norms: &Quantities, truth: &Reference) -> Errors {
    let space = &problem.space;
    let mesh = space.mesh;
    let mut product: f64 = problem.load.iter().zip(u).map(|(b, u)| b * u).sum();
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
    let square = truth.grad_norm_sq + norms.grad_norm_sq - 2.0 * product;
    let rule = quadrature::exact(2, 5);
    let squares: Vec<f64> = (0..mesh.cell_count())
        .into_par_iter()
        .map(|cell| square_on_cell(space, u, truth, &rule, cell))
        .collect();
    Errors {
        h1: (square.max(0.0) / truth.grad_norm_sq).sqrt(),
        l2: squares.iter().sum::<f64>().sqrt() / truth.l2_norm,
    }
}
