//! The paper's reference: P2 on a fine Union-Jack mesh, as a function to measure others against.

use faceoff_fem::contact::{Problem, Quantities};
use faceoff_fem::element::Space;
use faceoff_fem::known::Function;

/// A function of a P2 space on the Union-Jack mesh of n × n squares of the unit square.
pub struct Fine<'a> {
    pub space: Space<'a>,
    pub u: Vec<f64>,
    pub n: usize,
    pub norms: Quantities,
}

impl Function for Fine<'_> {
    fn value(&self, x: f64, y: f64) -> f64 {
        let cell = cell_at(self.n, x, y);
        let geometry = self.space.mesh.geometry(cell);
        let mut lambda = [0.0; 4];
        for (i, lambda) in lambda.iter_mut().enumerate().take(3) {
            // λ_i is 1 at vertex i.
            let corner = geometry.vertices[i];
            let slope = geometry.gradients[i];
            *lambda = 1.0 + slope.x * (x - corner.x) + slope.y * (y - corner.y);
        }
        let phi = self.space.element.values(2, &lambda);
        let local = self.space.local(cell, &self.u);
        phi.iter().zip(&local).map(|(p, u)| p * u).sum()
    }

    /// Exact: by Simpson's rule between the crossed lines of the fine mesh.
    fn mean(&self, a: [f64; 2], b: [f64; 2]) -> f64 {
        let n = self.n as f64;
        let mut cuts = vec![0.0, 1.0];
        // Both diagonals of every square, though each has only one: a superfluous cut does no harm.
        for line in [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, -1.0]] {
            let [from, to] = [a, b].map(|p| n * (line[0] * p[0] + line[1] * p[1]));
            let (low, high) = (from.min(to).ceil() as i64, from.max(to).floor() as i64);
            if from != to {
                cuts.extend((low..=high).map(|k| (k as f64 - from) / (to - from)));
            }
        }
        cuts.retain(|s| (0.0..=1.0).contains(s));
        cuts.sort_by(f64::total_cmp);
        let at = |s: f64| self.value(a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]));
        let pieces = cuts.windows(2).filter(|pair| pair[1] > pair[0]);
        pieces
            .map(|pair| {
                let [low, high] = [pair[0], pair[1]];
                (high - low) / 6.0 * (at(low) + 4.0 * at(0.5 * (low + high)) + at(high))
            })
            .sum()
    }

    fn grad_norm_sq(&self) -> f64 {
        self.norms.grad_norm_sq
    }

    fn l2_norm(&self) -> f64 {
        self.norms.l2_norm
    }
}

/// The cell of the Union-Jack mesh that contains (x, y), in the numbering of the generator.
fn cell_at(n: usize, x: f64, y: f64) -> usize {
    let place = |t: f64| -> (usize, f64) {
        let scaled = (t * n as f64).clamp(0.0, n as f64);
        let square = (scaled as usize).min(n - 1);
        (square, scaled - square as f64)
    };
    let ((i, s), (j, t)) = (place(x), place(y));
    let upper = if (i + j) % 2 == 0 { t > s } else { s + t > 1.0 };
    2 * (j * n + i) + usize::from(upper)
}

/// ‖∇(U-V)‖ / ‖∇U‖ for V from the mesh with half as many squares per side: Union-Jack meshes are nested, so V is in U's space.
pub fn step_between(problem: &Problem, u: &[f64], coarse: &Fine) -> f64 {
    let difference: Vec<f64> = problem
        .space
        .points()
        .zip(u)
        .map(|(p, u)| u - coarse.value(p[0], p[1]))
        .collect();
    (problem.stiffness.energy(&difference) / problem.stiffness.energy(u)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_fem::contact::{ContactSet, Discretisation, Errors};
    use faceoff_fem::contact::{Iteration, Method, Stop, errors, quantities, solve};
    use faceoff_fem::element::{CR, P2};
    use faceoff_fem::known::{distance, fine_errors};
    use faceoff_fem::quadrature;
    use faceoff_fem::scene::{Exact, Scene};
    use faceoff_fem::truth::{DEFAULT_RESOLUTION, Reference};
    use faceoff_mesh::mesh::Triangulation;
    use faceoff_mesh::mesh::generate::union_jack;

    fn mesh(n: usize) -> Triangulation {
        Triangulation::new("uj", &union_jack(n, [1.0; 2])).unwrap()
    }

    fn wavy(space: &Space) -> Vec<f64> {
        (0..space.dofs).map(|k| (7.3 * k as f64).sin()).collect()
    }

    fn norms(problem_norms: [f64; 2]) -> Quantities {
        Quantities {
            grad_norm_sq: problem_norms[0],
            l2_norm: problem_norms[1],
            contact_flux: 0.0,
            contact_residual: 0.0,
            weighted_residual: 0.0,
            contact_set: ContactSet::Runs(vec![]),
        }
    }

    fn fine<'a>(mesh: &'a Triangulation, u: &[f64], n: usize) -> Fine<'a> {
        let space = Space::new(mesh, &P2);
        let energy = faceoff_fem::assembly::Stiffness::new(&space).energy(u);
        let mass = faceoff_fem::assembly::norm_squared(&space, u);
        Fine {
            space,
            u: u.to_vec(),
            n,
            norms: norms([energy, mass.sqrt()]),
        }
    }

    #[test]
    fn every_dof_is_found_at_its_point() {
        for n in [1, 6, 7] {
            let mesh = mesh(n);
            let space = Space::new(&mesh, &P2);
            let u = wavy(&space);
            let fine = fine(&mesh, &u, n);
            for (p, u) in space.points().zip(&u) {
                assert!((fine.value(p[0], p[1]) - u).abs() < 1e-12, "n = {n}: {p:?}");
            }
        }
    }

    /// 7 and 3: the meshes share no line. The means use very many points.
    #[test]
    fn means_are_exact_on_any_line() {
        let mesh = mesh(7);
        let space = Space::new(&mesh, &P2);
        let u = wavy(&space);
        let fine = fine(&mesh, &u, 7);
        for (a, b) in [
            ([0.0, 0.0], [1.0 / 3.0, 1.0 / 3.0]),
            ([2.0 / 3.0, 0.0], [1.0 / 3.0, 1.0 / 3.0]),
            ([1.0, 1.0 / 3.0], [1.0, 2.0 / 3.0]),
            ([0.1, 0.77], [0.83, 0.05]),
        ] {
            let points = 200_000;
            let sum: f64 = (0..points)
                .map(|k| {
                    let s = (f64::from(k) + 0.5) / f64::from(points);
                    fine.value(a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]))
                })
                .sum();
            let expected = sum / f64::from(points);
            assert!((fine.mean(a, b) - expected).abs() < 1e-8, "{a:?} {b:?}");
        }
    }

    /// On nested meshes both integrals can be computed exactly, cell by cell of the fine mesh.
    #[test]
    fn errors_to_a_fine_function_are_those_on_the_common_refinement() {
        let (coarse_mesh, fine_mesh) = (mesh(3), mesh(12));
        let space = Space::new(&fine_mesh, &P2);
        let smooth: Vec<f64> = space
            .points()
            .map(|p| (2.0 * p[0]).sin() * (1.0 - p[1] * p[1]))
            .collect();
        let fine = fine(&fine_mesh, &smooth, 12);
        let coarse = Space::new(&coarse_mesh, &CR);
        let u_h: Vec<f64> = coarse.points().map(|p| p[0] - p[1] * p[0]).collect();
        let here = distance(&coarse, &u_h, &fine);

        let rule = quadrature::exact(2, 5);
        let (mut h1, mut l2) = (0.0, 0.0);
        for cell in 0..fine_mesh.cell_count() {
            let geometry = fine_mesh.geometry(cell);
            let centre = geometry.point(&[1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 0.0]);
            let parent = cell_at(3, centre[0], centre[1]);
            let outer = coarse_mesh.geometry(parent);
            let of_coarse = coarse.local(parent, &u_h);
            let slope = coarse.slope(&outer, &[0.0; 4], &of_coarse);
            let local = space.local(cell, &smooth);
            for (lambda, weight) in rule.iter() {
                let x = nalgebra::Vector3::from(geometry.point(&lambda));
                let mut of_parent = [0.0; 4];
                for i in 0..3 {
                    of_parent[i] = 1.0 + outer.gradients[i].dot(&(x - outer.vertices[i]));
                }
                let phi = coarse.element.values(2, &of_parent);
                let value: f64 = phi.iter().zip(&of_coarse).map(|(p, u)| p * u).sum();
                let difference = fine.value(x.x, x.y) - value;
                let of_fine = space.slope(&geometry, &lambda, &local);
                h1 += weight * geometry.measure() * (of_fine - slope).norm_squared();
                l2 += weight * geometry.measure() * difference.powi(2);
            }
        }
        let expected = Errors {
            h1: (h1 / fine.grad_norm_sq()).sqrt(),
            l2: l2.sqrt() / fine.l2_norm(),
        };
        assert!(
            (here.h1 / expected.h1 - 1.0).abs() < 1e-9,
            "{here:?} {expected:?}"
        );
        assert!(
            (here.l2 / expected.l2 - 1.0).abs() < 1e-3,
            "{here:?} {expected:?}"
        );
    }

    /// The errors of P2 by adaptive quadrature with the closed form, and as estimated from P2 only.
    #[test]
    fn p2_has_the_errors_that_quadrature_and_its_own_steps_say() {
        let scene = Scene::find("many-zones-3").unwrap();
        let truth = Reference::zones(3, DEFAULT_RESOLUTION).unwrap();
        let meshes: Vec<_> = [24, 48]
            .iter()
            .map(|&n| scene.triangulation(Some(n)).unwrap())
            .collect();
        let solved: Vec<_> = meshes
            .iter()
            .map(|mesh| {
                let problem =
                    Problem::new(&scene, mesh, &Discretisation::of(&scene, Method::p2())).unwrap();
                let u = solve(&problem, Iteration::Newton, Stop::default(), |_, _| Ok(()))
                    .unwrap()
                    .u;
                (problem, u)
            })
            .collect();
        let of = |k: usize| {
            let (problem, u) = &solved[k];
            fine_errors(problem, u, &quantities(problem, u), &truth)
        };
        let (problem, u) = &solved[1];
        let here = of(1);
        let there = errors(
            &problem.space,
            u,
            scene.exact().and_then(Exact::formula).unwrap(),
        )
        .unwrap();
        assert!(
            (here.h1 / there.h1 - 1.0).abs() < 1e-2,
            "{here:?} {there:?}"
        );
        assert!(
            (here.l2 / there.l2 - 1.0).abs() < 1e-2,
            "{here:?} {there:?}"
        );
        // P2 is nearly orthogonal: e₁² ≈ e₂² + step².
        let coarse = fine(&meshes[0], &solved[0].1, 24);
        let step = step_between(problem, u, &coarse);
        let sum = step.hypot(here.h1);
        assert!((sum / of(0).h1 - 1.0).abs() < 0.1, "{sum} {:?}", of(0));
    }
}
