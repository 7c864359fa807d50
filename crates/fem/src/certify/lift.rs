//! Boundary values that no linear function holds: what g on Γ_D, and ψ on Γ_C, have beyond their linear
//! interpolant on a face.
//!
//! On a triangle κ with the face F opposite z, δ = g - I_h g extends to w(z + r(y-z)) = r δ(y), y ∈ F, r ∈ [0, 1]:
//! w = δ on F, and 0 on both other edges, as δ vanishes at the vertices. With the unit tangent τ, the normal n and
//! the height H of κ over F, s = (y-z)·τ,
//!
//! ```text
//! ∇w = δ' τ + (δ - s δ')/H n     the same along each ray from z
//! ```
//!
//! A face of a tetrahedron has edges in common with others, where δ does not vanish: not covered.

use super::{largest, refusal};
use crate::contact::Problem;
use crate::quadrature::{self, WHOLE, parts};
use crate::scene::{Expression, Part};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Triangulation;
use nalgebra::Vector3;

/// δ below this, relative to the largest value, is the rounding of a linear function.
const ROUNDING: f64 = 1e-13;
/// Faces are cut in two so often for the rule with five points.
const CUTS: usize = 4;

/// w on one cell.
#[derive(Debug, Clone)]
pub(super) struct Lift {
    pub cell: usize,
    /// The face's local number.
    pub local: usize,
    /// Points y on the face: barycentric coordinates in the cell, weights that sum to 1, and ∇w on the ray.
    pub rays: Vec<([f64; 4], f64, Vector3<f64>)>,
}

impl Lift {
    /// ‖∇w‖²_κ
    pub fn square(&self, measure: f64) -> f64 {
        let rays = self.rays.iter();
        measure
            * rays
                .map(|(_, w, slope)| w * slope.norm_squared())
                .sum::<f64>()
    }

    /// Points that integrate over κ what is a polynomial of degree 4 along the rays: barycentric
    /// coordinates, weights as fractions of |κ|, and ∇w.
    pub fn points(&self) -> Vec<([f64; 4], f64, Vector3<f64>)> {
        let along = quadrature::exact(1, 5);
        let mut points = Vec::new();
        for (on_face, weight, slope) in &self.rays {
            for ([_, r, ..], part) in along.iter() {
                let mut lambda = on_face.map(|l| r * l);
                lambda[self.local] = 1.0 - r;
                points.push((lambda, weight * part * 2.0 * r, *slope));
            }
        }
        points
    }
}

/// The lifts of all faces that need one, by cells.
///
/// # Errors
/// Data on Γ_D or Γ_C in 3D that are not linear on a face; data that are not finite.
pub(super) fn lifts(problem: &Problem) -> Result<Vec<Lift>> {
    let (mesh, scene) = (problem.space.mesh, problem.scene);
    let mut lifts = Vec::new();
    for (part, name, data) in [
        (Part::Dirichlet, "g", &scene.data().g),
        (Part::Contact, "psi", &scene.data().psi),
    ] {
        if data.is_zero() {
            continue;
        }
        let faces: Vec<usize> = (0..mesh.face_count())
            .filter(|&face| problem.parts[face] == Some(part))
            .collect();
        let vertices = faces.iter().flat_map(|&face| mesh.face(face));
        let size = largest(data, vertices.map(|&v| mesh.points[v as usize]));
        for face in faces {
            cancel::check()?;
            if mesh.dim == 3 {
                check_linear(mesh, face, name, data, size)?;
            } else if let Some(lift) = lift(mesh, face, data, size) {
                if !lift.square(1.0).is_finite() {
                    return Err(refusal(
                        format!(
                            "the slope of {name} is not finite on {}",
                            mesh.face_label(face)
                        ),
                        "give data with a square-integrable slope along the boundary",
                    ));
                }
                lifts.push(lift);
            }
        }
    }
    lifts.sort_by_key(|lift| lift.cell);
    Ok(lifts)
}

fn check_linear(
    mesh: &Triangulation,
    face: usize,
    name: &str,
    data: &Expression,
    size: f64,
) -> Result<()> {
    let corners: Vec<[f64; 3]> = mesh
        .face(face)
        .iter()
        .map(|&v| mesh.points[v as usize])
        .collect();
    let at_corners: Vec<f64> = corners.iter().map(|x| data.value(*x)).collect();
    for (lambda, _) in quadrature::exact(2, 5).iter() {
        let x: [f64; 3] =
            std::array::from_fn(|k| corners.iter().zip(lambda).map(|(c, l)| l * c[k]).sum());
        let linear: f64 = at_corners.iter().zip(lambda).map(|(v, l)| v * l).sum();
        if !((data.value(x) - linear).abs() <= ROUNDING.sqrt() * size) {
            return Err(refusal(
                format!(
                    "{name} is not linear on {}, and in 3D no extension into the cells is known",
                    mesh.face_label(face)
                ),
                "give data on Γ_D and Γ_C that are linear on every face",
            ));
        }
    }
    Ok(())
}

fn lift(mesh: &Triangulation, face: usize, data: &Expression, size: f64) -> Option<Lift> {
    let cell = mesh.face_cells(face)[0] as usize;
    let local = mesh.local_face(cell, face);
    let geometry = mesh.geometry(cell);
    let [i, j] = [1, 2].map(|k| (local + k) % 3);
    let [a, b, z] = [i, j, local].map(|k| geometry.vertices[k]);
    let length = (b - a).norm();
    let tangent = (b - a) / length;
    let normal = geometry.normal(local);
    let height = 2.0 * geometry.measure() / length;
    let (at_a, at_b) = (data.value(a.into()), data.value(b.into()));
    let mut pieces = vec![WHOLE];
    for _ in 0..CUTS {
        pieces = pieces.iter().flat_map(|piece| parts(piece, 1)).collect();
    }
    let rule = quadrature::exact(1, 9);
    let share = 1.0 / pieces.len() as f64;
    let mut largest = 0.0_f64;
    let mut rays = Vec::new();
    for piece in &pieces {
        for ([p, q, ..], weight) in rule.iter() {
            let s = p * piece[0][1] + q * piece[1][1];
            let y = a + s * (b - a);
            let (value, gradient) = data.with_gradient(y.into());
            let delta = value - (at_a + s * (at_b - at_a));
            let slope = Vector3::from(gradient).dot(&tangent) - (at_b - at_a) / length;
            largest = largest.max(delta.abs());
            let across = (delta - slope * (y - z).dot(&tangent)) / height;
            let mut lambda = [0.0; 4];
            (lambda[i], lambda[j]) = (1.0 - s, s);
            rays.push((lambda, weight * share, slope * tangent + across * normal));
        }
    }
    (!(largest <= ROUNDING * size)).then_some(Lift { cell, local, rays })
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_mesh::mesh::generate::union_jack;

    /// ∫_κ ∂w/∂x_k = ∫_F δ n_k, as w vanishes on the other edges.
    #[test]
    fn the_divergence_theorem_holds() {
        let mesh = Triangulation::new("uj", &union_jack(2, [2.0, 1.0])).unwrap();
        let data = Expression::parse("x^3 - y^2*x + sin(3*y)").unwrap();
        let mut lifted = 0;
        for face in (0..mesh.face_count()).filter(|&face| mesh.is_boundary(face)) {
            let Some(lift) = lift(&mesh, face, &data, 1.0) else {
                continue;
            };
            lifted += 1;
            let geometry = mesh.geometry(lift.cell);
            let mut inside = Vector3::zeros();
            for (_, weight, slope) in lift.points() {
                inside += geometry.measure() * weight * slope;
            }
            let [a, b]: [Vector3<f64>; 2] =
                [0, 1].map(|k| mesh.points[mesh.face(face)[k] as usize].into());
            let mean: f64 = quadrature::exact(1, 9)
                .iter()
                .map(|([p, q, ..], w)| {
                    let linear = p * data.value(a.into()) + q * data.value(b.into());
                    w * (data.value((p * a + q * b).into()) - linear)
                })
                .sum();
            let outside = mean * geometry.face_measure(lift.local) * geometry.normal(lift.local);
            assert!((inside - outside).norm() < 1e-8, "{inside} {outside}");
        }
        assert!(lifted > 4);
    }

    #[test]
    fn linear_data_need_none() {
        let mesh = Triangulation::new("uj", &union_jack(2, [2.0, 1.0])).unwrap();
        let data = Expression::parse("3*x - 7*y + 0.1").unwrap();
        for face in (0..mesh.face_count()).filter(|&face| mesh.is_boundary(face)) {
            assert!(lift(&mesh, face, &data, 6.0).is_none());
        }
    }
}
