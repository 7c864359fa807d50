//! When the scheme has exactly one solution: the condition of Proposition 4.2, "γ₀ large enough", as a number for each mesh.
//!
//! Let w be the difference of two solutions, q = ∂ₙw. Each law max(a, b) of one less that of the other is χ(a₁-a₂) + (1-χ)(b₁-b₂)
//! with some χ in [0, 1] at each point of Γ_C.
//!
//! **Penalty-free on CR** (θ = (1, 0), flux corrected or not). The rows of a contact cell combined (see `scheme`) imply that
//! mean_F χw + (1-mean χ) γq = 0 on each contact face F, and ‖∇w‖² = Σ_F |F| q mean_F w. With s = Σ_k w_k χ_k ∇w·(x_k - x̄), the
//! weights summing to 1, and X = mean χ, the law is X mean w + (1-X) γq = -s, so that q mean w ≤ s²/(4X(1-X)γ). Of all χ that
//! quotient is largest where each χ_k is 0 or 1, since |s| is convex and √(X(1-X)) concave. So w = 0 if in each contact cell κ
//!
//! ```text
//! Σ_{F ⊂ κ} |F|/γ_F max_S |Σ_{k ∈ S} w_k (x_k - x̄)|² / (4 X_S (1-X_S)) < |κ|,   X_S = Σ_{k ∈ S} w_k.
//! ```
//!
//! With one point that is 0 < |κ|: unique for every γ.
//!
//! **θ₂ = 1**. Tested with w the scheme leaves ‖∇w‖² plus χw²/γ + χ(θ₁-1)qw + (1-χ)θ₁γq² at each point, which is at least
//! -¼(1-θ₁)²γq² for any real θ₁: unique for every γ where θ₁ = 1, and else if Σ_F ¼(1-θ₁)² γ_F C|F| < |κ|, with ‖q‖²_F ≤ C|F|/|κ| ‖∇w‖²_κ and
//! C = p(p-1+d)/d for ∇w of degree p-1 (T. Warburton, J. S. Hesthaven, Comput. Methods Appl. Mech. Engrg. 192, 2003, Theorem 3).

use super::face::ContactFace;
use super::form::Problem;
use super::law::{Law, Multiplier, Nitsche};
use faceoff_mesh::mesh::CellGeometry;

/// Why it is not shown that there is one solution only. There may still be.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Doubt {
    /// γ is too small, worst on this face: γ₀ must be larger by more than this factor.
    GammaTooSmall {
        /// Its number in the mesh.
        face: usize,
        /// γ there.
        gamma: f64,
        /// At least 1: its condition holds where γ₀ is larger by more than that.
        factor: f64,
    },
    /// γ is too large, worst on this face: γ₀ must be multiplied by less than this factor.
    GammaTooLarge {
        /// Its number in the mesh.
        face: usize,
        /// γ there.
        gamma: f64,
        /// At most 1: its condition holds where γ₀ is less than that part of what it is.
        factor: f64,
    },
    /// No condition is known for the method.
    NoTheorem,
    /// A part of the domain is not constrained, and no load presses it on its obstacle.
    Floating,
}

/// The reason why the scheme may have several solutions; None if there is exactly one.
pub fn doubt(problem: &Problem) -> Option<Doubt> {
    if problem.contact.is_empty() {
        return None;
    }
    if floats(problem) {
        return Some(Doubt::Floating);
    }
    let degree = problem.space.element.degree();
    match problem.method().law {
        Law::FluxCorrected => penalty_free(problem),
        Law::Nitsche(Nitsche { theta1, theta2 }) => match [theta1, theta2] {
            [1.0, 1.0] => None,
            [1.0, 0.0] if problem.space.element.on().faces && degree == 1 => penalty_free(problem),
            [theta1, 1.0] => family(problem, theta1, degree),
            _ => Some(Doubt::NoTheorem),
        },
        // Minima of strictly convex functionals, and least points of them.
        Law::Multiplier(Multiplier { gamma0 }) => (gamma0 >= 0.25).then_some(Doubt::NoTheorem),
        Law::Variational | Law::Penalty(_) => None,
    }
}

/// Whether there is a part that Γ_D does not constrain and that no load moves.
fn floats(problem: &Problem) -> bool {
    let Some(parts) = &problem.floating else {
        return false;
    };
    let mut sums = vec![[0.0; 2]; problem.bodies.1];
    for ((part, load), body) in parts.iter().zip(&problem.load).zip(&problem.bodies.0) {
        if part.is_some() {
            let [sum, size] = &mut sums[*body as usize];
            *sum += load;
            *size += load.abs();
        }
    }
    let held: Vec<bool> = {
        let mut held = vec![true; sums.len()];
        for (part, body) in parts.iter().zip(&problem.bodies.0) {
            held[*body as usize] &= part.is_none();
        }
        held
    };
    let balanced = |[sum, size]: &[f64; 2]| sum.abs() <= 1e-12 * size;
    sums.iter()
        .zip(held)
        .any(|(sum, held)| !held && balanced(sum))
}

fn penalty_free(problem: &Problem) -> Option<Doubt> {
    let share = |face: &ContactFace, cell: &CellGeometry| {
        face.measure / face.gamma * moment(face) / cell.measure()
    };
    let (face, factor) = worst(problem, share)?;
    let gamma = face.gamma;
    Some(Doubt::GammaTooSmall {
        face: face.face,
        gamma,
        factor,
    })
}

/// max_S |Σ_{k ∈ S} w_k (x_k - x̄)|² / (4 X_S (1-X_S))
fn moment(face: &ContactFace) -> f64 {
    let weights: Vec<f64> = face
        .points
        .iter()
        .map(|p| p.weight / face.measure)
        .collect();
    let mean = |i: usize| -> f64 {
        face.points
            .iter()
            .zip(&weights)
            .map(|(p, w)| w * p.x[i])
            .sum()
    };
    let centre = [0, 1, 2].map(mean);
    let mut largest = 0.0_f64;
    for chosen in 1..(1_usize << weights.len()) - 1 {
        let (mut moment, mut part) = ([0.0; 3], 0.0);
        for k in (0..weights.len()).filter(|k| chosen >> k & 1 == 1) {
            part += weights[k];
            for (i, moment) in moment.iter_mut().enumerate() {
                *moment += weights[k] * (face.points[k].x[i] - centre[i]);
            }
        }
        let square: f64 = moment.iter().map(|m| m * m).sum();
        largest = largest.max(square / (4.0 * part * (1.0 - part)));
    }
    largest
}

fn family(problem: &Problem, theta1: f64, degree: usize) -> Option<Doubt> {
    let (p, d) = (degree as f64, problem.space.mesh.dim as f64);
    let inverse = p * (p - 1.0 + d) / d * 0.25 * (1.0 - theta1).powi(2);
    let share = |face: &ContactFace, cell: &CellGeometry| {
        inverse * face.gamma * face.measure / cell.measure()
    };
    let (face, factor) = worst(problem, share)?;
    let gamma = face.gamma;
    Some(Doubt::GammaTooLarge {
        face: face.face,
        gamma,
        factor: factor.recip(),
    })
}

/// The largest sum of the shares of a cell's contact faces, if it is not below 1, and the face with the largest share of it.
fn worst<'a>(
    problem: &'a Problem,
    share: impl Fn(&ContactFace, &CellGeometry) -> f64,
) -> Option<(&'a ContactFace, f64)> {
    let mut faces: Vec<&ContactFace> = problem.contact.iter().collect();
    faces.sort_by_key(|face| face.cell);
    let mut found: Option<(&ContactFace, f64)> = None;
    for of_cell in faces.chunk_by(|a, b| a.cell == b.cell) {
        let cell = problem.space.mesh.geometry(of_cell[0].cell);
        let shares = of_cell.iter().map(|face| (*face, share(face, &cell)));
        let sum: f64 = shares.clone().map(|(_, share)| share).sum();
        let Some((face, _)) = shares.max_by(|a, b| a.1.total_cmp(&b.1)) else {
            continue;
        };
        if !(sum < 1.0) && found.is_none_or(|(_, most)| sum > most) {
            found = Some((face, sum));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Discretisation, Method};
    use crate::scene::Scene;

    fn doubt_of(scene: &str, method: &str, rule: &str, gamma0: f64) -> Option<Doubt> {
        let scene = Scene::find(scene).unwrap();
        let mesh = scene.triangulation(Some(4)).unwrap();
        let method: Method = method.parse().unwrap();
        let discretisation = Discretisation {
            gamma0,
            contact_quadrature: Some(rule.into()),
            ..Discretisation::of(&scene, method)
        };
        doubt(&Problem::new(&scene, &mesh, &discretisation).unwrap())
    }

    /// A cell of union-jack over a side F is half a square: |κ| = |F|²/2, h = √2 |F|. The points of Gauss are at ±|F|/√12, one of
    /// them has (|F|/√48)² for its moment, so that γ > |F|/24 is the condition.
    #[test]
    fn the_condition_is_the_one_by_hand() {
        let needed = |gamma0: f64| match doubt_of("one-zone", "cr", "gauss-2", gamma0) {
            Some(Doubt::GammaTooSmall { factor, .. }) => factor * gamma0,
            other => panic!("{other:?}"),
        };
        let least = 1.0 / (24.0 * 2.0_f64.sqrt());
        assert!((needed(1e-3) - least).abs() < 1e-12, "{}", needed(1e-3));
        assert_eq!(doubt_of("one-zone", "cr", "gauss-2", 1.01 * least), None);
        assert_eq!(doubt_of("one-zone", "cr", "midpoint", 1e-9), None);
    }

    #[test]
    fn theory_decides_for_the_rest() {
        for (method, gamma0) in [("p2", 1e-9), ("p2", 1e9), ("p1", 1e9), ("p1-vi", 1.0)] {
            assert_eq!(
                doubt_of("one-zone", method, "gauss-3", gamma0),
                None,
                "{method}"
            );
        }
        assert_eq!(doubt_of("one-zone", "p2(0,1)", "gauss-3", 0.01), None);
        let large = doubt_of("one-zone", "p2(-1,1)", "gauss-3", 10.0);
        assert!(
            matches!(large, Some(Doubt::GammaTooLarge { factor, .. }) if factor < 0.1),
            "{large:?}"
        );
        assert_eq!(
            doubt_of("one-zone", "p2(1,0)", "gauss-3", 1.0),
            Some(Doubt::NoTheorem)
        );
    }
}
