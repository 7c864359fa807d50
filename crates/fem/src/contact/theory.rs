//! The assumptions and results of the paper's theory, as numbers of one discretisation: Lemma 3.1, the positivity (4.2), assumption (2.10).

use nalgebra::Matrix3;

use super::face::ContactFace;
use super::form::Problem;
use super::quantities::face_fields;
use crate::assembly::norm_squared;

/// Lemma 3.1: v_h with the flux r on Γ_C and vanishing means on all other faces, on CR.
///
/// v_h = Σ_F r_F |κ|/|F| φ_F, for ∂ₙφ_F = |F|/|κ| on F. Where a cell has two contact faces its fluxes are not r.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Lifting {
    /// The largest |∂ₙv_h - r_F| over the largest |r_F|, (3.8), for an r that alternates.
    pub flux_error: f64,
    /// The largest |mean of v_h| on another face over the largest of all, (3.9).
    pub mean_error: f64,
    /// C of ‖v_h‖ ≤ C h^(3/2) ‖r‖_C, (3.10): the largest of any r, h the diameter of the largest cell at Γ_C.
    pub constant: f64,
}

/// The lifting of Lemma 3.1, put together and measured; none without contact faces or on another element.
pub fn lifting(problem: &Problem) -> Option<Lifting> {
    let space = &problem.space;
    if problem.contact.is_empty() || !space.element.on().faces || space.element.degree() != 1 {
        return None;
    }
    let mesh = space.mesh;
    let lift = |k: usize, face: &ContactFace, r: f64, v: &mut [f64]| {
        let local = mesh.local_face(face.cell, face.face);
        let of_face = r * mesh.geometry(face.cell).measure() / face.measure;
        for dof in space.face_dofs(face.cell, local) {
            v[dof as usize] += of_face;
        }
        k
    };
    let r_of = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -0.5 };
    let mut v = vec![0.0; space.dofs];
    for (k, face) in problem.contact.iter().enumerate() {
        lift(k, face, r_of(k), &mut v);
    }
    let fields = face_fields(problem, &v, "lifting");
    let column = |name: &str| fields.columns.iter().find(|c| c.name == name);
    let (means, fluxes) = (column("mean")?, column("flux")?);
    let largest = means.values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let on_contact: Vec<u32> = problem.contact.iter().map(|f| f.face as u32).collect();
    let others = means.faces.iter().zip(&means.values);
    let others = others.filter(|(face, _)| !on_contact.contains(face));
    let mean_error = others.fold(0.0_f64, |m, (_, v)| m.max(v.abs())) / largest;
    let flux_error = problem
        .contact
        .iter()
        .enumerate()
        .zip(&fluxes.values)
        .fold(0.0_f64, |m, ((k, _), flux)| m.max((flux - r_of(k)).abs()));

    let cells = problem.contact.iter().map(|f| mesh.geometry(f.cell));
    let h = cells.map(|g| g.diameter).fold(0.0, f64::max);
    // Cells at Γ_C do not overlap, so that the largest quotient is that of a single face.
    let quotient = |face: &ContactFace| {
        let mut v = vec![0.0; space.dofs];
        lift(0, face, 1.0, &mut v);
        norm_squared(space, &v) / (h.powi(3) * face.measure)
    };
    let constant = problem
        .contact
        .iter()
        .map(quotient)
        .fold(0.0, f64::max)
        .sqrt();
    Some(Lifting {
        flux_error,
        mean_error,
        constant,
    })
}

/// (4.2) with w = u₁ - u₂ and v_h = w + ξ_h(w) of Proposition 4.1, for the penalty-free method on CR in 2D:
///
/// ```text
/// c (‖∇w‖² + γ⁻¹‖w + [P(u₁)]₊ - [P(u₂)]₊‖²_C) ≤ A_h(u₁; v_h) - A_h(u₂; v_h)   for all u₁, u₂
/// ```
///
/// Where [P(u₁)]₊ - [P(u₂)]₊ = s (γ∂ₙw - w), s in [0, 1] at each point, the right-hand side is
///
/// ```text
/// ‖∇w‖² + <γ⁻¹w̄, w>_C + <s (γ∂ₙw - w), ∂ₙw + γ⁻¹w̄>_C,
/// ```
///
/// and so a quadratic form in w̄ and ∇w of each contact cell by itself: c is the least c of a cell and of all s. Right minus left
/// is concave in s, so that s of 0 and 1 suffice.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Positivity {
    /// The largest c in [0, 1].
    pub constant: f64,
    /// c > 0 for γ₀ above this, the smallest eigenvalue being negative below.
    pub least_gamma0: f64,
}

/// c is known to this.
const ACCURACY: f64 = 1e-6;

/// The constant of (4.2), and the γ₀ from which it exists; none in 3D, for other methods, and where a cell has two contact faces.
pub fn positivity(problem: &Problem) -> Option<Positivity> {
    let mut cells: Vec<usize> = problem.contact.iter().map(|face| face.cell).collect();
    cells.sort_unstable();
    let alone = cells.windows(2).all(|pair| pair[0] != pair[1]);
    let element = problem.space.element;
    let is_cr = element.on().faces && element.degree() == 1;
    let penalty_free = problem.method().law.thetas() == [1.0, 0.0];
    if problem.space.mesh.dim != 2 || !alone || cells.is_empty() || !is_cr || !penalty_free {
        return None;
    }
    let holds = |c: f64, factor: f64| {
        let mut faces = problem.contact.iter();
        faces.all(|face| is_positive(problem, face, c, factor))
    };
    // Both are monotone: (4.2) is weaker for smaller c, and for larger γ.
    let constant = bisect(0.0, 1.0, |c| holds(c, 1.0)).0;
    let some = |log: f64| !holds(ACCURACY, 10.0_f64.powf(log));
    let (_, least) = bisect(-9.0, 6.0, some);
    Some(Positivity {
        constant,
        least_gamma0: problem.discretisation.gamma0() * 10.0_f64.powf(least),
    })
}

/// The ends between which `holds`, which does below and does not above, changes.
fn bisect(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> (f64, f64) {
    if holds(high) {
        return (high, high);
    }
    while high - low > ACCURACY {
        let middle = 0.5 * (low + high);
        *(if holds(middle) { &mut low } else { &mut high }) = middle;
    }
    (low, high)
}

/// Whether the right side of (4.2) minus the left is non-negative on the cell at `face`, with γ times `factor`, for all s.
fn is_positive(problem: &Problem, face: &ContactFace, c: f64, factor: f64) -> bool {
    let gamma = factor * face.gamma;
    let volume = problem.space.mesh.geometry(face.cell).measure();
    let weights: Vec<f64> = face.points.iter().map(|p| p.weight).collect();
    let centre = |i: usize| -> f64 {
        let terms = face.points.iter().map(|p| p.weight * p.x[i]);
        terms.sum::<f64>() / face.measure
    };
    let centre = [centre(0), centre(1)];
    // Along the face, from its midpoint; the sign does not matter.
    let first = &face.points[0].x;
    let along = [first[0] - centre[0], first[1] - centre[1]];
    let length = along[0].hypot(along[1]);
    let place = |x: &[f64; 3]| match length > 0.0 {
        true => ((x[0] - centre[0]) * along[0] + (x[1] - centre[1]) * along[1]) / length,
        false => 0.0,
    };
    // In units in which the diagonal is of order 1: w̄ = a √(γ/|F|), ∂ₙw = q/√|κ|, the slope along F = t/√|κ|.
    let unit_of_mean = (gamma / face.measure).sqrt();
    let unit = volume.sqrt().recip();
    let q = [0.0, unit, 0.0];
    let mean = [unit_of_mean, 0.0, 0.0];
    (0..1_usize << weights.len()).all(|free| {
        let mut form = Matrix3::zeros();
        form[(1, 1)] = 1.0 - c;
        form[(2, 2)] = 1.0 - c;
        let mut add = |factor: f64, a: [f64; 3], b: [f64; 3]| {
            for i in 0..3 {
                for j in 0..3 {
                    form[(i, j)] += 0.5 * factor * (a[i] * b[j] + a[j] * b[i]);
                }
            }
        };
        for (k, (point, weight)) in face.points.iter().zip(&weights).enumerate() {
            let w = [unit_of_mean, 0.0, unit * place(&point.x)];
            let is_free = free >> k & 1 == 1;
            add(weight / gamma, mean, w);
            if is_free {
                let p = std::array::from_fn(|i| gamma * q[i] - w[i]);
                add(*weight, p, std::array::from_fn(|i| q[i] + mean[i] / gamma));
            }
            let left = if is_free { q.map(|q| gamma * q) } else { w };
            add(-c * weight / gamma, left, left);
        }
        let size = form.amax().max(1.0);
        form.symmetric_eigenvalues().min() >= -1e-12 * size
    })
}

/// Whether f seems to have no trace near Γ_C, so that (2.10) fails: ‖f‖ on Γ_C moved inwards by t grows as t shrinks to 10⁻¹² h, or is
/// not finite. A singularity that no quadrature point sees is not noticed.
pub fn load_has_no_trace(problem: &Problem) -> bool {
    let mesh = problem.space.mesh;
    let f = &problem.scene.data().f;
    let norm = |depth: f64| -> f64 {
        let of_face = |face: &ContactFace| -> f64 {
            let cell = mesh.geometry(face.cell);
            let normal = cell.normal(mesh.local_face(face.cell, face.face));
            let at =
                |x: &[f64; 3]| std::array::from_fn(|i| x[i] - depth * cell.diameter * normal[i]);
            let squares = face
                .points
                .iter()
                .map(|p| p.weight * f.value(at(&p.x)).powi(2));
            squares.sum()
        };
        problem.contact.iter().map(of_face).sum::<f64>().sqrt()
    };
    let outside = [-1, -2, -3]
        .map(|k| norm(10.0_f64.powi(k)))
        .into_iter()
        .fold(0.0, f64::max);
    let near = [-6, -9, -12].map(|k| norm(10.0_f64.powi(k)));
    near.iter().any(|n| !n.is_finite())
        || (near[2] > 1.5 * outside && near[0] < near[1] && near[1] < near[2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Discretisation, Method};
    use crate::scene::{Expression, Scene};

    fn with<T>(gamma0: f64, rule: &str, scene: &Scene, read: impl Fn(&Problem) -> T) -> T {
        let mesh = scene.triangulation(Some(4)).unwrap();
        let discretisation = Discretisation {
            gamma0,
            contact_quadrature: Some(rule.into()),
            ..Discretisation::of(scene, Method::cr())
        };
        read(&Problem::new(scene, &mesh, &discretisation).unwrap())
    }

    /// On a union-jack cell |κ| = |F|²/2 and h = √2 |F|, and ‖φ_F‖² = |κ|/3: C² = |κ|³/(3 h³ |F|³) = √2/96.
    #[test]
    fn the_lifting_of_lemma_3_1() {
        let scene = Scene::find("one-zone").unwrap();
        let of = with(100.0, "gauss-5", &scene, lifting).unwrap();
        assert!(of.flux_error < 1e-13 && of.mean_error < 1e-15, "{of:?}");
        assert!(
            (of.constant - (2.0_f64.sqrt() / 96.0).sqrt()).abs() < 1e-12,
            "{of:?}"
        );
    }

    /// With only the midpoint, w = w̄ and s is one number: the form is ‖∇w‖² + (1-s) γ⁻¹w̄²|F| + s γ q² |F|, and c = 1 whatever γ.
    #[test]
    fn positivity_at_midpoints_has_the_constant_one() {
        let scene = Scene::find("one-zone").unwrap();
        for gamma0 in [1e-3, 1.0, 1e3] {
            let of = with(gamma0, "midpoint", &scene, positivity).unwrap();
            assert!(of.constant > 1.0 - 1e-5, "{gamma0}: {of:?}");
            assert!(of.least_gamma0 < 1e-8 * gamma0, "{of:?}");
        }
    }

    /// A difference w for which (4.2) fails must exist below the least γ₀, and random ones must obey it above, in the method's own form.
    #[test]
    fn positivity_is_that_of_the_method() {
        let scene = Scene::find("one-zone").unwrap();
        let least = with(1.0, "gauss-5", &scene, positivity)
            .unwrap()
            .least_gamma0;
        for gamma0 in [1.001 * least, 100.0] {
            with(gamma0, "gauss-5", &scene, |problem| {
                let c = positivity(problem).unwrap().constant;
                assert!(c > 0.0);
                let mut smallest = f64::INFINITY;
                for seed in 0..300 {
                    let random = |salt: usize, k: usize| {
                        let x = (k as f64 * 12.9898 + (seed * 7 + salt) as f64 * 78.233).sin()
                            * 43_758.547;
                        x - x.floor() - 0.5
                    };
                    let u = |salt: usize| -> Vec<f64> {
                        let values = problem.dirichlet.iter().enumerate();
                        values.map(|(k, g)| g.unwrap_or(random(salt, k))).collect()
                    };
                    let (one, two) = (u(1), u(2));
                    let [left, right] = sides(problem, &one, &two);
                    assert!(right >= (c - 1e-5) * left, "{gamma0}: {right} {left} {c}");
                    smallest = smallest.min(right / left);
                }
                assert!(smallest < 2.0, "{smallest}");
            });
        }
    }

    /// ‖∇w‖² + γ⁻¹‖w + [P(u₁)]₊ - [P(u₂)]₊‖², and A_h(u₁; w + ξ) - A_h(u₂; w + ξ) from the problem's own residual.
    fn sides(problem: &Problem, one: &[f64], two: &[f64]) -> [f64; 2] {
        let space = &problem.space;
        let w: Vec<f64> = one.iter().zip(two).map(|(a, b)| a - b).collect();
        let mut left = problem.stiffness.energy(&w);
        let mut v = w.clone();
        for face in &problem.contact {
            let [a, b, of_w] = [one, two, &w].map(|u| space.local(face.cell, u));
            let mut mean = 0.0;
            for point in &face.points {
                let [a, b] = [&a, &b].map(|u| point.trace(face.gamma, u));
                let law = |t: &crate::contact::face::Trace| t.gap + t.p.max(0.0);
                left += point.weight / face.gamma * (law(&a) - law(&b)).powi(2);
                mean += point.weight / face.measure * point.trace(face.gamma, &of_w).gap;
            }
            let local = space.mesh.local_face(face.cell, face.face);
            let lift = mean / face.gamma * space.mesh.geometry(face.cell).measure() / face.measure;
            for dof in space.face_dofs(face.cell, local) {
                v[dof as usize] += lift;
            }
        }
        let (a, b) = (problem.residual(one), problem.residual(two));
        let rows = a.iter().zip(&b).zip(&v).zip(problem.dirichlet.iter());
        let right = rows.filter(|(_, g)| g.is_none());
        [left, right.map(|(((a, b), v), _)| (a - b) * v).sum()]
    }

    #[test]
    fn loads_without_a_trace_are_noticed() {
        let scene = Scene::find("one-zone").unwrap();
        let of = |f: &str| {
            let mut data = scene.data().clone();
            data.f = Expression::parse(f).unwrap();
            with(
                100.0,
                "gauss-5",
                &scene.clone().with_data(data),
                load_has_no_trace,
            )
        };
        for f in ["1/sqrt(y)", "y^(-0.2)", "log(y)", "sin(x)/y"] {
            assert!(of(f), "{f}");
        }
        for f in [
            "0",
            "-2*pi*sin(2*pi*x)",
            "1/sqrt(1-y)",
            "exp(9*y)",
            "1e9*sqrt(y)",
            "log(0.01+y)",
        ] {
            assert!(!of(f), "{f}");
        }
    }
}
