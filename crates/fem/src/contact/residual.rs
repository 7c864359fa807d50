//! Any field put into the scheme: what each row leaves, which terms the row is made of, and how it would change with γ
//! on a face or with the contact status at a point.

use super::condition::Condition;
use super::form::Problem;
use crate::linear::add;
use faceoff_mesh::parallel;

/// Rows that one task looks at.
const CHUNK: usize = 1 << 14;

/// The terms of the scheme, and the rows of Γ_D.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Term {
    /// (∇u,∇v)
    Volume,
    /// (f,v) + <t,v>_N
    Load,
    /// <∂ₙu,v>_C
    Consistency,
    /// <u-ψ + [P(u)]₊, θ₂γ⁻¹v + θ₁∂ₙv>_C
    Contact,
    /// u - g on Γ_D
    Dirichlet,
}

/// The residual of each row, and what it is measured by.
pub struct Rows {
    /// R_i, all dofs.
    pub residual: Vec<f64>,
    /// The sum of the sizes of a row's terms, or of the largest row's where that is rounding.
    pub scale: Vec<f64>,
}

impl Rows {
    /// The backward error of a row.
    pub fn error(&self, row: usize) -> f64 {
        match self.residual[row] {
            // A size that overflowed measures nothing.
            _ if !self.scale[row].is_finite() => f64::NAN,
            0.0 => 0.0,
            residual => residual.abs() / self.scale[row],
        }
    }

    /// The largest, and its row; NaN where there is one.
    pub fn worst(&self) -> (f64, Option<usize>) {
        // What is not a number must not vanish in the maximum; of equal ones the first is reported.
        let worse = |a: (f64, Option<usize>), b: (f64, Option<usize>)| {
            let is_b = !a.0.is_nan() && (b.0.is_nan() || b.0 > a.0);
            if is_b { b } else { a }
        };
        let none = (0.0, None);
        let of_chunk = |(chunk, residual): (usize, &[f64])| {
            let rows = chunk * CHUNK..chunk * CHUNK + residual.len();
            rows.fold(none, |worst, row| {
                worse(worst, (self.error(row), Some(row)))
            })
        };
        let chunks = parallel::map(self.residual.chunks(CHUNK).enumerate(), of_chunk);
        chunks.into_iter().fold(none, worse)
    }
}

impl Problem<'_> {
    /// R_i = A_h(u; φ_i) - L(φ_i), all dofs; rows of Γ_D are u - g.
    ///
    /// ```text
    /// (2.4)  (∇u,∇v) - <∂ₙu,v>_C + <u-ψ + [P(u)]₊, θ₂γ⁻¹v + θ₁∂ₙv>_C = (f,v) + <t,v>_N
    /// ```
    ///
    /// With u-ψ + [P(u)]₊ = max(u-ψ, γ∂ₙu): the same number without the cancellation. Other laws
    /// have the same form with different functionals, [`Condition`].
    pub fn residual(&self, u: &[f64]) -> Vec<f64> {
        let mut r = self.stiffness.times(u);
        add(&mut r, &self.load, -1.0);
        for condition in &self.conditions {
            condition.add_to(u, &mut r);
        }
        for (row, g) in self.dirichlet.given() {
            r[row] = u[row] - g;
        }
        r
    }

    /// How far u is from solving the scheme, as a backward error: the largest residual of a row
    /// over the sum of the sizes of that row's terms, and its dof. Rounding leaves about 1e-15.
    pub fn backward_error(&self, u: &[f64]) -> (f64, Option<usize>) {
        self.rows(u).worst()
    }

    /// The residual of each row and what it is relative to.
    ///
    /// A row whose terms are all rounding in units of the largest row's is measured by the latter
    /// (M. Arioli, J. W. Demmel, I. S. Duff, SIAM J. Matrix Anal. Appl. 10, 1989): where u = 0 it
    /// would compare one rounding with another. The largest is that of the same connected part: no
    /// rounding comes from another one, compared with which all of u might be small. Nor does a row count for less than a
    /// thousandth of what (∇u,∇v) is at most: elimination leaves each row a rounding of the largest ones.
    pub fn rows(&self, u: &[f64]) -> Rows {
        let mut size = self.stiffness.sizes(u);
        let stiffest = self.largest_in_bodies(|row| self.is_free(row).then(|| size[row]));
        for condition in &self.conditions {
            let [gap, flux] = condition.sizes(u);
            let law = if condition.trace(u).p > 0.0 {
                condition.gamma * flux
            } else {
                gap
            };
            for (j, &dof) in condition.dofs.iter().enumerate() {
                size[dof as usize] += condition.weight
                    * (law * condition.test(j).abs() + flux * condition.flux_test(j).abs());
            }
        }
        parallel::update(&mut size, |row, size| size + self.load[row].abs());
        let highest = self.largest_in_bodies(|row| Some(u[row].abs()));
        let largest = self.largest_in_bodies(|row| self.is_free(row).then(|| size[row]));
        // A value that small compared with the largest is 0 up to rounding.
        let scale = |size: f64, largest: f64| match size < 1e3 * f64::EPSILON * largest {
            true => largest,
            false => size,
        };
        let of_row = |i: usize, size: f64| {
            let body = self.bodies.0[i] as usize;
            match self.dirichlet[i] {
                Some(g) => scale(g.abs().max(u[i].abs()), highest[body]),
                None => scale(size, largest[body]).max(1e-3 * stiffest[body]),
            }
        };
        parallel::update(&mut size, of_row);
        Rows {
            residual: self.residual(u),
            scale: size,
        }
    }

    fn is_free(&self, row: usize) -> bool {
        !self.dirichlet.holds(row)
    }

    /// The largest number of each connected part, 0 if there is none.
    fn largest_in_bodies(&self, of_row: impl Fn(usize) -> Option<f64> + Sync) -> Vec<f64> {
        let (bodies, count) = &self.bodies;
        let none = vec![0.0_f64; *count];
        let of_chunk = |(chunk, bodies): (usize, &[u32])| {
            let mut largest = none.clone();
            for (row, &body) in (chunk * CHUNK..).zip(bodies) {
                let largest = &mut largest[body as usize];
                *largest = largest.max(of_row(row).unwrap_or(0.0));
            }
            largest
        };
        let both = |mut a: Vec<f64>, b: Vec<f64>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a = a.max(b));
            a
        };
        let chunks = parallel::map(bodies.chunks(CHUNK).enumerate(), of_chunk);
        chunks.into_iter().reduce(both).unwrap_or(none)
    }

    /// Each row split into its [`Term`]s but the last, whose sum is the residual; 0 on Γ_D.
    pub fn terms(&self, u: &[f64]) -> [Vec<f64>; 4] {
        let volume = self.stiffness.times(u);
        let load = self.load.iter().map(|b| -b).collect();
        let (mut consistency, mut contact) = (vec![0.0; u.len()], vec![0.0; u.len()]);
        for condition in &self.conditions {
            let trace = condition.trace(u);
            let law = trace.gap.max(condition.gamma * trace.flux);
            for (j, &dof) in condition.dofs.iter().enumerate() {
                consistency[dof as usize] -= condition.weight * trace.flux * condition.flux_test(j);
                contact[dof as usize] += condition.weight * law * condition.test(j);
            }
        }
        let mut terms = [volume, load, consistency, contact];
        for (row, _) in self.dirichlet.given() {
            terms.iter_mut().for_each(|term| term[row] = 0.0);
        }
        terms
    }

    /// The conditions on each contact face, where they are at the rule's points: Nitsche's method.
    fn by_face(&self) -> impl Iterator<Item = &[Condition]> {
        let mut rest = match self.method().is_nitsche() {
            true => &self.conditions[..],
            false => &[],
        };
        let faces = self.contact.iter().take_while(|_| !rest.is_empty());
        let lengths: Vec<usize> = faces.map(|face| face.points.len()).collect();
        lengths.into_iter().map(move |points| {
            let (of_face, others) = rest.split_at(points);
            rest = others;
            of_face
        })
    }

    /// ∂R/∂γ_F for each contact face F, by (row, value); rows of Γ_D do not change. Empty for methods that are not Nitsche's.
    ///
    /// ```text
    /// Σ_q w ∂ₙu θ₁∂ₙφ_j   where P > 0,     -Σ_q w (u-ψ) θ₂γ⁻²φ_j   where P ≤ 0
    /// ```
    pub fn by_gamma(&self, u: &[f64]) -> Vec<Vec<(u32, f64)>> {
        let of_point = |condition: &Condition, j: usize| {
            let [theta1, theta2] = condition.thetas;
            let trace = condition.trace(u);
            match trace.p > 0.0 {
                true => trace.flux * theta1 * condition.flux[j],
                false => -trace.gap * theta2 * condition.displacement[j] / condition.gamma.powi(2),
            }
        };
        let faces = self.by_face();
        faces
            .map(|of_face| {
                let free = self.free_rows(of_face);
                let value = |j: usize| {
                    let at = of_face.iter();
                    at.map(|c| c.weight * of_point(c, j)).sum()
                };
                free.map(|(j, dof)| (dof, value(j))).collect()
            })
            .collect()
    }

    /// For each contact face and each of its points, by how much R changes where the point has the other status: the law
    /// min(u-ψ, γ∂ₙu) in the place of max(u-ψ, γ∂ₙu).
    pub fn by_status(&self, u: &[f64]) -> Vec<Vec<Vec<(u32, f64)>>> {
        let of_point = |c: &Condition, all: &[Condition]| {
            let change = -c.weight * c.trace(u).p.abs();
            let free = self.free_rows(all);
            free.map(|(j, dof)| (dof, change * c.test(j))).collect()
        };
        let faces = self.by_face();
        faces
            .map(|of_face| of_face.iter().map(|c| of_point(c, of_face)).collect())
            .collect()
    }

    /// The dofs that the conditions of a face see, where they are not on Γ_D, and their places among them.
    fn free_rows(&self, of_face: &[Condition]) -> impl Iterator<Item = (usize, u32)> {
        let dofs = of_face.first().map_or(&[][..], |c| &c.dofs);
        let all = dofs.iter().copied().enumerate();
        all.filter(|(_, dof)| self.dirichlet[*dof as usize].is_none())
    }

    /// Gives each contact face another γ; nothing happens for methods that are not Nitsche's.
    pub fn set_gamma(&mut self, gamma: &[f64]) {
        if !self.method().is_nitsche() {
            return;
        }
        let mut conditions = self.conditions.iter_mut();
        for (face, gamma) in self.contact.iter_mut().zip(gamma) {
            face.gamma = *gamma;
            let of_face = conditions.by_ref().take(face.points.len());
            of_face.for_each(|condition| condition.gamma = *gamma);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Discretisation, Iteration, Method, Stop, solve};
    use crate::scene::{Expression, Scene};
    use faceoff_mesh::mesh::Triangulation;
    use faceoff_mesh::mesh::generate::union_jack;

    /// The problem of a scene, its solution, and another field.
    fn each(of: impl Fn(&mut Problem, &[f64], &[f64])) {
        for (scene, n, method) in [
            ("one-zone", 6, "cr"),
            ("one-zone", 6, "cr-fc"),
            ("one-zone", 6, "p2"),
            ("one-zone-3d", 2, "cr"),
            ("one-zone-3d", 2, "p2"),
        ] {
            let scene = Scene::find(scene).unwrap();
            let mesh = scene.triangulation(Some(n)).unwrap();
            let method: Method = method.parse().unwrap();
            let discretisation = Discretisation::of(&scene, method);
            let mut problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
            let told = |_, _| Ok(());
            let found = solve(&problem, Iteration::Newton, Stop::default(), told).unwrap();
            let waves = found.u.iter().zip(0..);
            let other: Vec<f64> = waves.map(|(u, k)| u + 0.01 * f64::from(k).sin()).collect();
            of(&mut problem, &found.u, &other);
        }
    }

    #[test]
    fn the_terms_of_a_row_sum_to_its_residual() {
        each(|problem, u, other| {
            for u in [u, other] {
                let (rows, terms) = (problem.rows(u), problem.terms(u));
                for row in (0..u.len()).filter(|row| problem.dirichlet[*row].is_none()) {
                    let sum: f64 = terms.iter().map(|term| term[row]).sum();
                    assert!((sum - rows.residual[row]).abs() <= 1e-13 * rows.scale[row]);
                }
            }
        });
    }

    /// Off the kinks the residual is smooth in γ: its derivative is what differences have.
    #[test]
    fn the_derivative_by_gamma_is_that_of_the_residual() {
        each(|problem, _, u| {
            let derivative = problem.by_gamma(u);
            let gamma: Vec<f64> = problem.contact.iter().map(|face| face.gamma).collect();
            let face = gamma.len() / 2;
            let step = 1e-6 * gamma[face];
            let mut beside = gamma.clone();
            let mut at = |change: f64| {
                beside[face] = gamma[face] + change;
                problem.set_gamma(&beside);
                problem.residual(u)
            };
            let (above, below) = (at(step), at(-step));
            problem.set_gamma(&gamma);
            let mut quotient: Vec<f64> = above.iter().zip(&below).map(|(a, b)| a - b).collect();
            quotient.iter_mut().for_each(|q| *q /= 2.0 * step);
            let largest = quotient.iter().fold(0.0, |m: f64, q| m.max(q.abs()));
            assert!(largest > 0.0);
            for (row, value) in &derivative[face] {
                quotient[*row as usize] -= value;
            }
            assert!(quotient.iter().all(|q| q.abs() <= 1e-5 * largest));
        });
    }

    /// With the other status everywhere, -max(a, b) is min(-a, -b).
    #[test]
    fn the_other_status_exchanges_the_two_sides_of_the_law() {
        each(|problem, _, u| {
            let mut changed = problem.residual(u);
            for (row, value) in problem.by_status(u).iter().flatten().flatten() {
                changed[*row as usize] += value;
            }
            let mut expected = problem.stiffness.times(u);
            expected
                .iter_mut()
                .zip(&problem.load)
                .for_each(|(r, b)| *r -= b);
            for c in &problem.conditions {
                let trace = c.trace(u);
                let law = match trace.p > 0.0 {
                    true => [1.0, 0.0],
                    false => [0.0, 1.0],
                };
                c.add_law_to(law, u, &mut expected);
            }
            for (row, scale) in problem.rows(u).scale.iter().enumerate() {
                let off = changed[row] - expected[row];
                assert!(problem.dirichlet[row].is_some() || off.abs() <= 1e-12 * scale);
            }
        });
    }

    /// The size of a row is infinite and what it leaves is not, where two cells have the same value.
    #[test]
    fn a_field_whose_sizes_overflow_does_not_solve() {
        let scene = Scene::find("one-zone").unwrap();
        let mesh = scene.triangulation(Some(4)).unwrap();
        let discretisation = Discretisation::of(&scene, "cr".parse().unwrap());
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        for face in 0..mesh.face_count() {
            let mut u = vec![0.0; problem.space.dofs];
            let cells = mesh.face_cells(face).map(|cell| cell as usize);
            for cell in cells.into_iter().filter(|cell| *cell < mesh.cell_count()) {
                for dof in problem.space.cell_dofs(cell) {
                    u[*dof as usize] = 2e307;
                }
            }
            let error = problem.backward_error(&u).0;
            assert!(error.is_nan() || error > 0.01, "{face}: {error}");
        }
    }

    #[test]
    fn a_small_body_is_not_measured_by_a_large_one() {
        let mut mesh = union_jack(4, [1.0, 1.0]);
        let points = mesh.points.len() as u32;
        let cells: usize = mesh.blocks.iter().map(|block| block.len()).sum();
        let beside = mesh.points.iter().map(|[x, y, z]| [x + 2.0, *y, *z]);
        let beside: Vec<[f64; 3]> = beside.collect();
        mesh.points.to_mut().extend(beside);
        for mut block in mesh.blocks.clone() {
            block
                .nodes
                .to_mut()
                .iter_mut()
                .for_each(|node| *node += points);
            mesh.blocks.push(block);
        }
        for group in &mut mesh.groups {
            let beside: Vec<u32> = group.cells.iter().map(|cell| cell + cells as u32).collect();
            group.cells.extend(beside);
        }
        let mesh = Triangulation::new("two", &mesh).unwrap();
        let scene = Scene::find("one-zone").unwrap();
        let mut data = scene.data().clone();
        data.f = Expression::parse("1 + 1e16*max(0, 1.5-x)").unwrap();
        let scene = scene.with_data(data);
        let discretisation = Discretisation::of(&scene, "cr".parse().unwrap());
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let stop = Stop::default();
        let mut u = solve(&problem, Iteration::Newton, stop, |_, _| Ok(()))
            .unwrap()
            .u;
        assert!(problem.backward_error(&u).0 < 1e-12);
        for dof in (0..u.len()).filter(|dof| problem.dirichlet[*dof].is_none()) {
            if problem.space.point(dof)[0] > 1.5 {
                u[dof] += (dof as f64).sin();
            }
        }
        assert!(problem.backward_error(&u).0 > 0.01);
    }

    /// In any chunk: the first of the largest, and NaN before all.
    #[test]
    fn the_worst_row_is_the_first_of_the_largest() {
        let count = 2 * CHUNK + 5;
        let mut rows = Rows {
            residual: vec![0.0; count],
            scale: vec![2.0; count],
        };
        assert_eq!(rows.worst(), (0.0, None));
        for row in [count - 1, CHUNK + 3, CHUNK + 4] {
            rows.residual[row] = -1.0;
        }
        assert_eq!(rows.worst(), (0.5, Some(CHUNK + 3)));
        rows.residual[count - 2] = f64::NAN;
        let (worst, row) = rows.worst();
        assert!(worst.is_nan() && row == Some(count - 2));
    }

    /// Of two parts of the mesh, on more rows than one task looks at, against one row after the other.
    #[test]
    fn the_largest_of_each_part_is_found() {
        let scene = Scene::find("one-zone").unwrap();
        let mesh = scene.triangulation(Some(80)).unwrap();
        let method = "cr".parse().unwrap();
        let discretisation = Discretisation::of(&scene, method);
        let mut problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let count = problem.space.dofs;
        assert!(count > CHUNK);
        problem.bodies = (
            (0..count as u32)
                .map(|row| u32::from(row % 7 == 3))
                .collect(),
            2,
        );
        let value = |row: usize| (!row.is_multiple_of(5)).then(|| (row as f64).sin().abs());
        let mut expected = [0.0_f64; 2];
        for row in 0..count {
            let largest = &mut expected[usize::from(row % 7 == 3)];
            *largest = largest.max(value(row).unwrap_or(0.0));
        }
        assert_eq!(problem.largest_in_bodies(value), expected);
    }
}
