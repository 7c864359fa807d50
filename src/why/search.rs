//! A field in the scheme with one thing changed at a time, and in which rows it fails.

use std::sync::Arc;

use super::TermRows;
use crate::engine::{self, Answer};
use crate::run::{Runner, Setup, Variation};
use faceoff_fem::contact::{Problem, Rows, Term};
use faceoff_mesh::error::Result;

/// Terms that are part of up to this many times the fewest rows are as suspect.
const AS_FEW: f64 = 1.5;

/// A field in a scheme.
pub(super) struct Search<'a> {
    pub runner: &'a Runner<'a>,
    pub setup: &'a Setup,
    /// Some of it is changed for a while, and restored.
    pub problem: Problem<'a>,
    pub u: &'a [f64],
    pub rows: Rows,
    /// The backward errors of the rows.
    pub errors: Vec<f64>,
    pub residual: f64,
    pub limit: f64,
}

impl Search<'_> {
    /// The backward error of u in the scheme with one thing changed; none where there is no such scheme.
    pub fn left_with(&self, variation: &Variation) -> Option<f64> {
        let setup = self.setup.with(variation).ok()?;
        let case = setup.case().ok()?;
        let left = case.problem.backward_error(self.u).0;
        Some(if left.is_nan() { f64::INFINITY } else { left })
    }

    pub fn residual_with(&self, variation: &Variation) -> Option<Vec<f64>> {
        let setup = self.setup.with(variation).ok()?;
        let case = setup.case().ok()?;
        Some(case.problem.residual(self.u))
    }

    /// Rows in units of their terms.
    pub fn weighted(&self, rows: &[f64]) -> Vec<f64> {
        let scaled = rows.iter().zip(&self.rows.scale);
        scaled
            .map(|(row, scale)| if *row == 0.0 { 0.0 } else { row / scale })
            .collect()
    }

    /// What the Rust engine answers; none where it does not.
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
        // What is not a number fails.
        !(self.errors[row] <= self.limit)
    }

    /// The terms that all rows that fail contain: what changes another one alone explains nothing.
    pub fn in_all(&self) -> Vec<Term> {
        let terms = self.terms().into_iter();
        let failing = (0..self.u.len()).filter(|row| self.fails(*row)).count();
        terms
            .filter(|t| t.failing == failing)
            .map(|t| t.term)
            .collect()
    }

    /// The terms that may be wrong.
    pub fn suspects(&self) -> Vec<Term> {
        let suspects = self.terms().into_iter().filter(|t| t.suspect);
        suspects.map(|t| t.term).collect()
    }

    /// How far each term is part of the rows that fail.
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
