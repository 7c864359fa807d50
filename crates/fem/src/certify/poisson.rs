//! -Δ on a space with values given at some dofs, factored once, or by iterations where these are predicted to take less.

use crate::assembly::{Iterated, Stiffness, iterations};
use crate::contact::Problem;
use crate::linear::{Choice, Factor, Precision, Reduced, Role, Settings, Solver, condense, norm};
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};

/// A residual is no more than rounding where it is this part of all fluxes: what it leaves of a balance is charged.
const ROUNDING: f64 = 1e-11;
/// Iterations leave this part of a right-hand side where what they find is checked afterwards.
const ABOUT: f64 = 1e-9;
/// Iterations that are predicted: some thirty for each of the fluxes of a certificate.
const ITERATIONS: f64 = 100.0;

pub(super) struct Poisson<'a> {
    problem: &'a Problem<'a>,
    pub stiffness: Stiffness<'a>,
    pub roles: Vec<Role>,
    pub solver: Solver,
    way: Option<Way>,
}

enum Way {
    Factor(Factor),
    Iterations(Box<Iterated>),
}

impl<'a> Poisson<'a> {
    pub fn new(problem: &'a Problem<'a>, stiffness: Stiffness<'a>, roles: Vec<Role>) -> Self {
        Poisson {
            problem,
            stiffness,
            roles,
            solver: Solver::Auto,
            way: None,
        }
    }

    /// Prepares whatever solves; a factor has a right-hand side eliminated meanwhile.
    ///
    /// # Errors
    /// The errors of the linear solver.
    pub fn prepare(&mut self, b: &[f64]) -> Result<Option<Reduced>> {
        let instead = iterations(&self.stiffness, ITERATIONS, (0.0, 0));
        let condensed = match self.solver {
            Solver::Iterative => None,
            solver => self.condensed(b, solver, Some(instead))?,
        };
        if condensed.is_some() {
            return Ok(condensed);
        }
        let is_given = |dof: usize| self.roles[dof] == Role::Fixed;
        let on_vertices = self.problem.vertex_stiffness()?;
        match Iterated::new(&self.stiffness, is_given, on_vertices)? {
            Some(iterated) => self.way = Some(Way::Iterations(Box::new(iterated))),
            None => return self.condensed(b, Solver::Multifrontal, None),
        }
        Ok(None)
    }

    fn condensed(
        &mut self,
        b: &[f64],
        solver: Solver,
        instead: Option<Choice>,
    ) -> Result<Option<Reduced>> {
        let settings = Settings {
            solver,
            precision: Precision::F64,
        };
        let condensed = condense(
            &self.stiffness,
            &self.roles,
            &[],
            b.to_vec(),
            settings,
            instead,
        )?;
        Ok(condensed.map(|(factor, reduced, ..)| {
            self.way = Some(Way::Factor(factor));
            reduced
        }))
    }

    /// The values of w where they are given, and the rows of b elsewhere.
    ///
    /// # Errors
    /// The errors of the linear solver.
    pub fn solution(&mut self, mut w: Vec<f64>, b: &[f64]) -> Result<Vec<f64>> {
        // A second solve takes away the rounding of the first, where it is more than nothing.
        for _ in 0..2 {
            let product = self.stiffness.times(&w);
            let left: Vec<f64> = b.iter().zip(&product).map(|(b, y)| b - y).collect();
            let squares = left.iter().zip(&self.roles);
            let squares = squares.filter(|(_, role)| **role != Role::Fixed);
            let of_left: f64 = squares.map(|(r, _)| r * r).sum();
            let of_all: f64 = product.iter().map(|y| y * y).sum();
            if of_left <= ROUNDING * ROUNDING * of_all {
                break;
            }
            let step = self.with_residual(&left, 0.5 * ROUNDING * norm(b).max(of_all.sqrt()))?;
            w.iter_mut().zip(step).for_each(|(w, step)| *w += step);
        }
        Ok(w)
    }

    /// The solution of the rows of b up to the rounding of one solve, or to nine digits by iterations, and 0 where values are given.
    ///
    /// # Errors
    /// The errors of the linear solver.
    pub fn about(&mut self, b: &[f64]) -> Result<Vec<f64>> {
        self.with_residual(b, ABOUT * norm(b))
    }

    fn with_residual(&mut self, b: &[f64], residual: f64) -> Result<Vec<f64>> {
        let mut reduced = None;
        if self.way.is_none() {
            reduced = self.prepare(b)?;
        }
        if let Some(Way::Iterations(iterated)) = &mut self.way {
            let found = iterated.solution(b, residual);
            cancel::check()?;
            match found {
                Some(found) => return Ok(found),
                // Cells of extreme shape.
                None => reduced = self.condensed(b, Solver::Multifrontal, None)?,
            }
        }
        let mut step = vec![0.0; b.len()];
        let Some(Way::Factor(factor)) = &self.way else {
            return Err(Error::Solver {
                what: "no solver was chosen for the flux".into(),
                remedy: "report this".into(),
            });
        };
        let reduced = reduced.unwrap_or_else(|| factor.reduce(b));
        factor.expand(reduced, &[], &mut step);
        for (step, role) in step.iter_mut().zip(&self.roles) {
            if *role == Role::Fixed {
                *step = 0.0;
            }
        }
        Ok(step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Discretisation;
    use crate::element::{CR, Space};
    use crate::scene::{Part, Scene};

    /// With loads and given values, and each without the other, in 2D and in 3D.
    #[test]
    fn iterations_are_as_good_as_a_factor() {
        for (scene, n) in [("one-zone", 12), ("one-zone-3d", 5)] {
            let scene = Scene::find(scene).unwrap();
            let mesh = scene.triangulation(Some(n)).unwrap();
            let discretisation = Discretisation::of(&scene, "p2".parse().unwrap());
            let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
            let space = Space::new(&mesh, &CR);
            let role = |part: &Option<Part>| match part {
                Some(Part::Dirichlet) => Role::Fixed,
                _ => Role::Eliminated,
            };
            let roles: Vec<Role> = problem.parts.iter().map(role).collect();
            let by = |solver: Solver| {
                let stiffness = problem.stiffness.on(&space);
                let mut poisson = Poisson::new(&problem, stiffness, roles.clone());
                poisson.solver = solver;
                poisson
            };
            let free = |values: &[f64]| -> Vec<f64> {
                let values = values.iter().zip(&roles);
                let free = values.map(|(v, role)| if *role == Role::Fixed { 0.0 } else { *v });
                free.collect()
            };
            let minus = |a: &[f64], b: &[f64]| -> Vec<f64> {
                a.iter().zip(b).map(|(a, b)| a - b).collect()
            };
            let mut random = crate::Random::new(7);
            let mut some = |scale: f64| -> Vec<f64> {
                let values = roles.iter().map(|_| scale * (random.next() - 0.5));
                values.collect()
            };
            for [of_b, of_w] in [[1.0, 1.0], [0.0, 1.0], [1e6, 0.0]] {
                let (b, all) = (some(of_b), some(of_w));
                let given = minus(&all, &free(&all));
                let [direct, iterated] = [Solver::Multifrontal, Solver::Iterative].map(|solver| {
                    let mut poisson = by(solver);
                    let found = poisson.solution(given.clone(), &b).unwrap();
                    let iterates = matches!(poisson.way, Some(Way::Iterations(_)));
                    assert_eq!(iterates, solver == Solver::Iterative);
                    let product = poisson.stiffness.times(&found);
                    let left = norm(&free(&minus(&product, &b)));
                    assert!(left <= ROUNDING * norm(&product), "{left}");
                    found
                });
                let away = norm(&minus(&direct, &iterated));
                assert!(away <= 1e-9 * norm(&direct), "{away}");
            }
            // What no iteration reaches is factored.
            let (b, mut poisson) = (some(1.0), by(Solver::Iterative));
            let found = poisson.with_residual(&b, 0.0).unwrap();
            assert!(matches!(poisson.way, Some(Way::Factor(_))));
            let left = norm(&free(&minus(&poisson.stiffness.times(&found), &b)));
            assert!(left <= 1e-12 * norm(&b), "{left}");
        }
    }
}
