//! What v may be on the contact faces: a linear function that is nowhere above ψ, or ψ itself by a lift.
//!
//! In 2D v is ψ's interpolant and its lift where ψ is not linear. Where there is no lift, in 3D and where ψ jumps or has a
//! spike, v stays below ψ by as much as its interpolant is above it somewhere on the face: that costs <λ, v-ψ>.

use super::lift::{Lift, lift};
use super::model::{Domain, Effort};
use super::refusal;
use super::simplex::Simplex;
use super::tree::{Leaf, Tree};
use crate::contact::Problem;
use crate::interval::{Interval, above_of_all, above_of_product};
use crate::scene::Part;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use rayon::prelude::*;

/// What v stays below ψ for rounding alone, relative to the largest |ψ| on the face.
const ROUNDING: f64 = 1e-12;
/// Leaves of ψ beyond one a face, and of each face.
const MORE: usize = 20_000;
const PER_FACE: usize = 32;
/// So many times a leaf of ψ is cut in halves, in the plane and in space: where ψ is bent a line below the leaf passes below ψ by
/// 1/64 and 1/16 of what it would.
const CUTS: [usize; 2] = [3, 4];

/// ψ on a contact face.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Obstacle {
    /// v at the vertices is at most this, by the mesh's order of the face.
    pub ceiling: [f64; 4],
    /// ψ at the vertices.
    pub values: [Interval; 4],
    /// Is v's P1 part compared with ψ's interpolant, the rest being lifted?
    pub is_lifted: bool,
    /// The mean of ψ.
    pub mean: Interval,
    /// Where there is a lift: [s, value] of a polygon that ψ is nowhere below, s from one vertex to the other.
    pub polygon: Vec<[f64; 2]>,
}

/// ψ on all contact faces, and its lifts.
///
/// # Errors
/// ψ that is not bounded on a face; an interruption.
pub(super) fn obstacles(problem: &Problem, unit: i32) -> Result<(Vec<Obstacle>, Vec<Lift>)> {
    let (mesh, psi) = (problem.space.mesh, &problem.scene.data().psi);
    let zero = Obstacle {
        ceiling: [0.0; 4],
        values: [Interval::ZERO; 4],
        is_lifted: false,
        mean: Interval::ZERO,
        polygon: Vec::new(),
    };
    if psi.is_zero() {
        return Ok((vec![zero; problem.contact.len()], Vec::new()));
    }
    let domain = Domain {
        expression: psi,
        vertices: Box::new(|k| mesh.face_vertices(problem.contact[k].face)),
        measures: problem
            .contact
            .iter()
            .map(|contact| contact.measure)
            .collect(),
        dim: mesh.dim - 1,
        space: mesh.dim,
        unit,
    };
    let mut trees = domain.enclose(&Effort {
        tolerance: 1e-6,
        budget: PER_FACE * problem.contact.len() + MORE,
    })?;
    trees.par_iter_mut().enumerate().try_for_each(|(k, tree)| {
        domain.straighten(k, tree, CUTS[mesh.dim - 2]);
        cancel::check()
    })?;
    let mut on_dirichlet = vec![false; mesh.points.len()];
    for face in (0..mesh.face_count()).filter(|&f| problem.parts[f] == Some(Part::Dirichlet)) {
        mesh.face(face)
            .iter()
            .for_each(|&v| on_dirichlet[v as usize] = true);
    }
    let (mut obstacles, mut lifts) = (Vec::new(), Vec::new());
    for (contact, tree) in problem.contact.iter().zip(&trees) {
        let face = mesh.face(contact.face);
        let mut obstacle = zero.clone();
        for (value, &vertex) in obstacle.values.iter_mut().zip(face) {
            let at = mesh.points[vertex as usize].map(Interval::at);
            *value = psi.range(at).times_power_of_two(unit);
        }
        // How far the interpolant of the vertex values is above ψ, and the mean of ψ.
        let (mut drop, mut size, mut means) = (0.0_f64, 0.0_f64, Interval::ZERO);
        tree.for_each(&mut |node, piece, share| {
            let leaf = tree.leaf(node);
            let below = from_below(leaf);
            for j in 0..mesh.dim {
                let linear: Interval = (0..mesh.dim)
                    .map(|i| piece[j][i] * obstacle.values[i])
                    .sum();
                drop = drop.max((linear - below[j]).high);
                size = size.max(leaf.values[j].abs());
            }
            let sum: Interval = leaf.values[..mesh.dim]
                .iter()
                .map(|v| Interval::at(*v))
                .sum();
            means += share
                * (sum / Interval::at(mesh.dim as f64) + Interval::around_zero(leaf.unknown()));
        });
        if !drop.is_finite() {
            return Err(refusal(
                format!(
                    "psi could not be bounded on {}",
                    mesh.face_label(contact.face)
                ),
                "give an obstacle that is defined and finite on Γ_C",
            ));
        }
        let meets_dirichlet = face.iter().any(|&v| on_dirichlet[v as usize]);
        if mesh.dim == 2 && drop > 0.0 && (meets_dirichlet || drop > ROUNDING * size) {
            let simplex = Simplex::new(mesh, contact.cell);
            let local = mesh.local_face(contact.cell, contact.face);
            if let Ok(lift) = lift(&simplex, contact.cell, local, psi, unit)
                && lift
                    .as_ref()
                    .is_none_or(|lift| is_worth_it(&simplex, lift, drop))
            {
                lifts.extend(lift);
                obstacle.is_lifted = true;
                obstacle.polygon = polygon(tree);
            }
        }
        obstacle.mean = means;
        for (ceiling, value) in obstacle
            .ceiling
            .iter_mut()
            .zip(obstacle.values)
            .take(mesh.dim)
        {
            let below = if obstacle.is_lifted {
                value
            } else {
                value - Interval::at(drop)
            };
            *ceiling = below.low;
        }
        obstacles.push(obstacle);
    }
    Ok((obstacles, lifts))
}

/// The linear function of these values at the corners is nowhere above ψ on a leaf.
fn from_below(leaf: &Leaf) -> [Interval; 4] {
    let slack = Interval::at(leaf.wave) + Interval::at(leaf.most());
    leaf.values.map(|value| Interval::at(value) - slack)
}

/// ψ on the leaves of a face from below: linear between these values, where it may have two values at an s.
fn polygon(tree: &Tree) -> Vec<[f64; 2]> {
    let mut polygon = Vec::new();
    tree.for_each(&mut |node, piece, _| {
        let corners = piece.iter().zip(from_below(tree.leaf(node)));
        polygon.extend(corners.take(2).map(|(corner, psi)| [corner[1], psi.low]));
    });
    polygon
}

/// A lift over a spike costs more than passing below it: the slope of what is lifted is much steeper than its height over
/// the cell's size.
fn is_worth_it(cell: &Simplex, lift: &Lift, drop: f64) -> bool {
    let flat = above_of_product(drop, 1.0 / cell.diameter) * cell.measure.high.sqrt();
    let steep = lift.norms(cell)[0];
    steep <= 30.0 * flat || above_of_all([steep]) == 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Discretisation, Method, Problem};
    use crate::scene::{Data, Expression, Scene};

    /// The polygon below x² on a face of length h is nowhere farther below it than h²/100: by Taylor's formula on the whole face the
    /// ends are h²/6 below.
    #[test]
    fn polygons_are_near_a_bent_obstacle() {
        let scene = Scene::find("one-zone").unwrap();
        let scene = scene.with_data(Data {
            psi: Expression::parse("x^2").unwrap(),
            ..scene.data().clone()
        });
        let mesh = scene.triangulation(Some(4)).unwrap();
        let discretisation = Discretisation::of(&scene, Method::cr());
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let (found, _) = obstacles(&problem, 0).unwrap();
        for (contact, obstacle) in problem.contact.iter().zip(found) {
            let [a, b] = [0, 1].map(|i| mesh.points[mesh.face(contact.face)[i] as usize][0]);
            assert!(obstacle.polygon.len() > 2);
            for [s, below] in obstacle.polygon {
                let off = (a + s * (b - a)).powi(2) - below;
                assert!(0.0 <= off + 1e-15 && off < 0.01 * (b - a).powi(2), "{off}");
            }
        }
    }

    /// The mean of what no leaf resolves is not known, and its interval holds it: -1 on all but acos(0.9)/π of a period.
    #[test]
    fn means_hold_what_is_not_known() {
        let scene = Scene::find("one-zone").unwrap();
        let psi = Expression::parse("if(sin(1e7*x)<0.9,-1,0)").unwrap();
        let scene = scene.with_data(Data {
            psi,
            ..scene.data().clone()
        });
        let mesh = scene.triangulation(Some(4)).unwrap();
        let discretisation = Discretisation::of(&scene, Method::cr());
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let mean = -1.0 + 0.9_f64.acos() / std::f64::consts::PI;
        for obstacle in obstacles(&problem, 0).unwrap().0 {
            let Interval { low, high } = obstacle.mean;
            assert!(low - 1e-3 <= mean && mean <= high + 1e-3, "{low} {high}");
        }
    }
}
