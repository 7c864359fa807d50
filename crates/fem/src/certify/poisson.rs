//! -Δ on a space with values given at some dofs, factored once.

use crate::assembly::Stiffness;
use crate::element::Space;
use crate::linear::{Factor, Role, Settings, condense};
use faceoff_mesh::error::{Error, Result};

pub(super) struct Poisson<'a> {
    pub stiffness: Stiffness<'a>,
    pub roles: Vec<Role>,
    settings: Settings,
    factor: Option<Factor>,
}

impl<'a> Poisson<'a> {
    pub fn new(space: &Space<'a>, roles: Vec<Role>, settings: Settings) -> Self {
        Poisson {
            stiffness: Stiffness::new(space).kept(),
            roles,
            settings,
            factor: None,
        }
    }

    /// The values of w where they are given, and the rows of b elsewhere.
    ///
    /// # Errors
    /// Those of the linear solver.
    pub fn solution(&mut self, mut w: Vec<f64>, b: &[f64]) -> Result<Vec<f64>> {
        // The second solve takes away the rounding of the first.
        for _ in 0..2 {
            let product = self.stiffness.times(&w);
            let left: Vec<f64> = b.iter().zip(product).map(|(b, y)| b - y).collect();
            let step = self.about(&left)?;
            w.iter_mut().zip(step).for_each(|(w, step)| *w += step);
        }
        Ok(w)
    }

    /// What has the rows of b up to the rounding of one solve, and 0 where values are given.
    ///
    /// # Errors
    /// Those of the linear solver.
    pub fn about(&mut self, b: &[f64]) -> Result<Vec<f64>> {
        let reduced = match &self.factor {
            Some(factor) => factor.reduce(b),
            None => {
                let condensed = condense(
                    &self.stiffness,
                    &self.roles,
                    &[],
                    b.to_vec(),
                    self.settings,
                    None,
                )?;
                let Some((factor, reduced, ..)) = condensed else {
                    return Err(Error::Solver {
                        what: "no solver was chosen for the flux".into(),
                        remedy: "report this".into(),
                    });
                };
                self.factor = Some(factor);
                reduced
            }
        };
        let mut step = vec![0.0; b.len()];
        if let Some(factor) = &self.factor {
            factor.expand(&reduced, &[], &mut step);
        }
        for (step, role) in step.iter_mut().zip(&self.roles) {
            if *role == Role::Fixed {
                *step = 0.0;
            }
        }
        Ok(step)
    }
}
