//! Substitutes a field into the scheme: finds the rows where it fails, and their residual in a changed scheme.

use std::sync::Arc;

use super::TermRows;
use crate::engine::{self, Answer};
use crate::run::{Runner, Setup};
use faceoff_fem::contact::{Problem, Rows, Term};
use faceoff_mesh::error::Result;

/// Terms that are part of up to this many times the fewest rows are equally suspect.
const AS_FEW: f64 = 1.5;

/// A field in a scheme.
pub(super) struct Search<'a> {
    pub runner: &'a Runner<'a>,
    pub setup: &'a Setup,
    /// Parts of it are changed temporarily, and restored.
    pub problem: Problem<'a>,
    pub u: &'a [f64],
    pub rows: Rows,
    /// The backward errors of the rows.
    pub errors: Vec<f64>,
    pub residual: f64,
    pub limit: f64,
}

impl Search<'_> {
    /// The contribution that a change must add to the rows: the negative residual relative to the sizes of the rows.
    pub fn wanted(&self) -> Vec<f64> {
        left(&self.rows)
    }

    /// The answer of the Rust engine; `None` if it has none.
    ///
    /// # Errors
    /// An interruption.
    pub fn solution(&self) -> Result<Option<Arc<Answer>>> {
        let rust = engine::find(engine::OWN)?;
        let case = self.setup.case()?;
        let answers = self.runner.each(&*rust, &[&case], &self.setup.settings)?;
        let answer = answers.into_iter().next().and_then(|answer| answer.ok());
        Ok(answer.filter(|answer| answer.converged))
    }

    pub fn fails(&self, row: usize) -> bool {
        // NaN fails.
        !(self.errors[row] <= self.limit)
    }

    /// For each term, in how many of the rows that fail it is.
    pub fn terms(&self) -> Vec<TermRows> {
        let problem = &self.problem;
        let count = self.u.len();
        let is_held = |row: usize| problem.dirichlet[row].is_some();
        let mut at_contact = vec![false; count];
        for condition in &problem.conditions {
            let dofs = condition.dofs.iter();
            dofs.for_each(|dof| at_contact[*dof as usize] = true);
        }
        let has_load = !problem.scene.data().f.is_zero();
        let has = |term: Term, row: usize| match term {
            Term::Dirichlet => is_held(row),
            _ if is_held(row) => false,
            Term::Volume => true,
            Term::Load => has_load || problem.load[row] != 0.0,
            Term::Consistency | Term::Contact => at_contact[row],
        };
        let all = [
            Term::Volume,
            Term::Load,
            Term::Consistency,
            Term::Contact,
            Term::Dirichlet,
        ];
        let failing = (0..count).filter(|row| self.fails(*row)).count();
        let counted = all.map(|term| {
            let rows = || (0..count).filter(|row| has(term, *row));
            (
                term,
                rows().count(),
                rows().filter(|row| self.fails(*row)).count(),
            )
        });
        let in_all = |of: &&(Term, usize, usize)| of.2 == failing && failing > 0;
        let fewest = counted.iter().filter(in_all).map(|of| of.1).min();
        let fewest = fewest.unwrap_or(0) as f64;
        let of = |of: &(Term, usize, usize)| TermRows {
            term: of.0,
            rows: of.1,
            failing: of.2,
            suspect: in_all(&of) && of.1 as f64 <= AS_FEW * fewest,
        };
        counted.iter().map(of).collect()
    }
}

/// The negative residual of u in a problem, relative to the sizes of the rows.
pub(super) fn left_in(problem: &Problem, u: &[f64]) -> Vec<f64> {
    left(&problem.rows(u))
}

fn left(rows: &Rows) -> Vec<f64> {
    let each = rows.residual.iter().enumerate();
    each.map(|(row, residual)| -rows.error(row).copysign(*residual))
        .collect()
}

/// Rows in units of their terms.
pub(super) fn weighted(rows: &[f64], scale: &[f64]) -> Vec<f64> {
    let each = rows.iter().zip(scale);
    each.map(|(row, scale)| if *row == 0.0 { 0.0 } else { row / scale })
        .collect()
}
