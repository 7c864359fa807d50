//! The errors of a Crouzeix–Raviart function against a function that is known by its values only.
//!
//! ∇u_h is constant on a cell κ, and ∫_κ ∇u = Σ_F ∫_F u n_F: so the CR interpolant I u, which has the face means of u,
//! has ∇I u = Π₀∇u, and the error falls into orthogonal parts,
//!
//! ```text
//! ‖∇(u-u_h)‖² = ‖∇u‖² - ‖∇I u‖² + ‖∇(I u-u_h)‖²
//! ```
//!
//! No gradient of u is needed, nor any quadrature near its singularities: only its means on faces, and ‖∇u‖.

use crate::contact::Errors;
use crate::element::Space;
use crate::quadrature::{self, Rule};
use crate::truth::Reference;
use faceoff_mesh::parallel;

/// The reference for errors.
pub trait Function: Sync {
    /// u at (x, y).
    fn value(&self, x: f64, y: f64) -> f64;
    /// The mean of u on the straight line from a to b.
    fn mean(&self, a: [f64; 2], b: [f64; 2]) -> f64;
    /// ‖∇u‖²
    fn grad_norm_sq(&self) -> f64;
    /// ‖u‖
    fn l2_norm(&self) -> f64;
}

/// The errors of u_h (all dofs of a CR space in 2D), relative to the norms of u.
///
/// L² by the rule of degree 5 on each cell: u - u_h is close to quadratic there, whose square has degree 4.
pub fn distance(space: &Space, u_h: &[f64], u: &dyn Function) -> Errors {
    let mesh = space.mesh;
    let means = parallel::collect(mesh.face_count(), |face| {
        let [a, b] = [0, 1].map(|k| mesh.points[mesh.face(face)[k] as usize]);
        u.mean([a[0], a[1]], [b[0], b[1]])
    });
    let rule = quadrature::exact(2, 5);
    // Collected before they are summed, so that the sum does not depend on the number of threads.
    let cells = parallel::collect(mesh.cell_count(), |cell| {
        let geometry = mesh.geometry(cell);
        let slope = |u| space.slope(&geometry, &[0.0; 4], &space.local(cell, u));
        let interpolant = slope(&means);
        let distance = interpolant - slope(u_h);
        let [of_interpolant, of_distance] =
            [interpolant, distance].map(|slope| geometry.measure() * slope.norm_squared());
        let square = square_on_cell(space, u_h, u, &rule, cell);
        [of_interpolant, of_distance, square]
    });
    let [interpolant, distance, square] = cells.iter().fold([0.0; 3], |sum, cell| {
        std::array::from_fn(|k| sum[k] + cell[k])
    });
    let beyond = (u.grad_norm_sq() - interpolant).max(0.0);
    Errors {
        h1: ((beyond + distance) / u.grad_norm_sq()).sqrt(),
        l2: square.sqrt() / u.l2_norm(),
    }
}

/// ‖u - u_h‖² on a cell, by `rule`.
pub(super) fn square_on_cell(
    space: &Space,
    u_h: &[f64],
    u: &dyn Function,
    rule: &Rule,
    cell: usize,
) -> f64 {
    let geometry = space.mesh.geometry(cell);
    let local = space.local(cell, u_h);
    let terms = rule.iter().map(|(lambda, weight)| {
        let [x, y, _] = geometry.point(&lambda);
        weight * (u.value(x, y) - space.value(&lambda, &local)).powi(2)
    });
    geometry.measure() * terms.sum::<f64>()
}

impl Function for Reference {
    fn value(&self, x: f64, y: f64) -> f64 {
        self.u(x, y)
    }

    /// By Gauss with five points. On Γ_C u bends like s^(3/2) at the ends of the contact zones: the line is cut there.
    fn mean(&self, a: [f64; 2], b: [f64; 2]) -> f64 {
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let at = |s: f64| self.u(a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]));
        if a[1] != 0.0 || b[1] != 0.0 {
            return pieces(&[], at);
        }
        let cuts: Vec<f64> = transitions(self)
            .map(|end| (end - a[0]) / (b[0] - a[0]))
            .filter(|s| *s * length > 0.0 && *s < 1.0)
            .collect();
        pieces(&cuts, at)
    }

    fn grad_norm_sq(&self) -> f64 {
        self.grad_norm_sq
    }

    fn l2_norm(&self) -> f64 {
        self.l2_norm
    }
}

/// Where contact begins or ends inside the side y = 0.
pub fn transitions(truth: &Reference) -> impl Iterator<Item = f64> + '_ {
    let ends = truth.contact_set.iter().flatten().copied();
    ends.filter(|end| (0.0..1.0).contains(end) && *end > 0.0)
}

/// ∫₀¹ g, the interval cut at `cuts`, where g goes like a constant and powers of the root of the distance.
///
/// Each piece with a cut at one end is run through by the square of the variable, which leaves powers: no singularity.
pub fn pieces(cuts: &[f64], g: impl Fn(f64) -> f64) -> f64 {
    let rule = quadrature::exact(1, 9);
    let nodes = || rule.iter().map(|(lambda, weight)| (lambda[1], weight));
    if cuts.is_empty() {
        return nodes().map(|(s, w)| w * g(s)).sum();
    }
    let mut ends = vec![0.0, 1.0];
    ends.extend(cuts);
    ends.sort_by(f64::total_cmp);
    let from = |origin: f64, end: f64| -> f64 {
        nodes()
            .map(|(s, w)| w * 2.0 * s * (end - origin).abs() * g(origin + s * s * (end - origin)))
            .sum()
    };
    ends.windows(2)
        .map(|pair| {
            let [low, high] = [pair[0], pair[1]];
            match [low, high].map(|end| cuts.contains(&end)) {
                [true, true] => {
                    let middle = 0.5 * (low + high);
                    from(low, middle) + from(high, middle)
                }
                [true, false] => from(low, high),
                _ => from(high, low),
            }
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Discretisation, Iteration, Method, Problem, Stop, errors, solve};
    use crate::scene::{Exact, Scene};
    use crate::truth::DEFAULT_RESOLUTION;

    #[test]
    fn roots_at_cuts_are_integrated() {
        let root = |s: f64| (s - 0.3).max(0.0).sqrt();
        let exact = 0.7_f64.powf(1.5) / 1.5;
        assert!((pieces(&[0.3], root) - exact).abs() < 1e-15);
        assert!((pieces(&[], root) - exact).abs() > 1e-4);
        let two = |s: f64| ((s - 0.3).max(0.0) * (0.8 - s).max(0.0)).sqrt();
        // Half a disc of diameter 1/2.
        let exact = std::f64::consts::PI * 0.25 * 0.25 / 2.0;
        assert!((pieces(&[0.3, 0.8], two) - exact).abs() < 1e-7);
    }

    /// Against the other way there is: the closed form of 6.2, its gradient, and adaptive quadrature.
    #[test]
    fn the_errors_are_those_of_adaptive_quadrature() {
        let scene = Scene::find("many-zones-3").unwrap();
        let truth = Reference::zones(3, DEFAULT_RESOLUTION).unwrap();
        for n in [8, 20] {
            let mesh = scene.triangulation(Some(n)).unwrap();
            let problem =
                Problem::new(&scene, &mesh, &Discretisation::of(&scene, Method::cr())).unwrap();
            let newton = solve(&problem, Iteration::Newton, Stop::default(), |_, _| Ok(()));
            let u = newton.unwrap().u;
            let here = distance(&problem.space, &u, &truth);
            let there = errors(
                &problem.space,
                &u,
                scene.exact().and_then(Exact::formula).unwrap(),
            )
            .unwrap();
            assert!(
                (here.h1 / there.h1 - 1.0).abs() < 1e-3,
                "{here:?} {there:?}"
            );
            // On the coarse mesh the square of the error is not a polynomial of degree 5.
            let room = if n == 8 { 3e-2 } else { 3e-3 };
            assert!(
                (here.l2 / there.l2 - 1.0).abs() < room,
                "{here:?} {there:?}"
            );
        }
    }
}
