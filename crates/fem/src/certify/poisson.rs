//! -Δ on a space with values given at some dofs, factored once.

use crate::assembly::Stiffness;
use crate::linear::{Factor, Reduced, Role, Settings, condense};
use faceoff_mesh::error::{Error, Result};

/// A residual is no more than rounding where it is this part of all fluxes: what it leaves of a balance is charged.
const ROUNDING: f64 = 1e-11;

pub(super) struct Poisson<'a> {
    pub stiffness: Stiffness<'a>,
    pub roles: Vec<Role>,
    settings: Settings,
    factor: Option<Factor>,
}

impl<'a> Poisson<'a> {
    pub fn new(stiffness: Stiffness<'a>, roles: Vec<Role>, settings: Settings) -> Self {
        Poisson {
            stiffness,
            roles,
            settings,
            factor: None,
        }
    }

    /// Factors, with a right-hand side that is eliminated meanwhile.
    ///
    /// # Errors
    /// Those of the linear solver.
    pub fn factored(&mut self, b: Vec<f64>) -> Result<Reduced> {
        let (settings, none) = (
            self.settings,
            Error::Solver {
                what: "no solver was chosen for the flux".into(),
                remedy: "report this".into(),
            },
        );
        let condensed = condense(&self.stiffness, &self.roles, &[], b, settings, None)?;
        let (factor, reduced, ..) = condensed.ok_or(none)?;
        self.factor = Some(factor);
        Ok(reduced)
    }

    /// The values of w where they are given, and the rows of b elsewhere.
    ///
    /// # Errors
    /// Those of the linear solver.
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
            None => self.factored(b.to_vec())?,
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
