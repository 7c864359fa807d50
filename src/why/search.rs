//! The search: a field in the scheme with one thing changed at a time.

use std::sync::Arc;

use super::candidates::{Candidate, candidates};
use super::gamma::FaceGamma;
use super::place::Spot;
use super::{Aspect, Explanation, Findings, Rank, TermRows, data, gamma, known, local};
use crate::engine::{self, Answer};
use crate::run::{RESIDUAL_TOLERANCE, Runner, Setup, Variation, Written};
use crate::text::text;
use faceoff_fem::contact::{Problem, Rows, Term};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;

/// A sum of rounded values may be off by more than each.
const SUMMED: f64 = 4.0;
/// So many of the worst rows are kept.
const WORST: usize = 10;
/// Of the explanations that account for nothing so many are told.
const TOLD: usize = 8;
/// What leaves less than this part of the residual comes near.
const NEAR: f64 = 0.1;
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

/// What is to be said of u, at all dofs, as an answer to a setup; `written` is how exactly it was.
///
/// # Errors
/// An interruption; a setup that has no problem.
pub fn examine(runner: &Runner, setup: &Setup, u: &[f64], written: Written) -> Result<Findings> {
    let problem = setup.case()?.problem;
    let rows = problem.rows(u);
    let (residual, _) = rows.worst();
    let limit = match written {
        Written::Binary64 => RESIDUAL_TOLERANCE,
        _ => RESIDUAL_TOLERANCE.max(SUMMED * written.unit()),
    };
    let mut search = Search {
        errors: (0..u.len()).map(|row| rows.error(row)).collect(),
        runner,
        setup,
        problem,
        u,
        rows,
        residual,
        limit,
    };
    let gamma = gamma::by_face(&search.problem, u, RESIDUAL_TOLERANCE);
    let explanations = match residual {
        residual if residual <= RESIDUAL_TOLERANCE => Vec::new(),
        residual if residual <= limit => vec![search.rounded(written)],
        _ => search.explain(&gamma)?,
    };
    Ok(search.findings(written, gamma, explanations))
}

impl Search<'_> {
    fn rounded(&self, written: Written) -> Explanation {
        let what = text!(
            "its values are written {}, which is all that the residual shows",
            written.words()
        );
        Explanation {
            accounts: true,
            ..Explanation::new(Aspect::Digits, what, Rank::Written, self.residual)
        }
    }

    /// Everything that is tried, what explains u first.
    fn explain(&mut self, gammas: &[FaceGamma]) -> Result<Vec<Explanation>> {
        let mut found = Vec::new();
        let in_all = self.in_all();
        let may = |c: &Candidate| !c.alone || in_all.contains(&c.term);
        for candidate in candidates(self.setup).into_iter().filter(may) {
            cancel::check()?;
            if let Some(left) = self.left_with(&candidate.variation) {
                found.push(candidate.leaving(left));
            }
        }
        found.extend(gamma::explain(self, gammas));
        let accounts = |found: &[Explanation], limit: f64, rank: Rank| {
            found.iter().any(|e| e.left <= limit && e.rank <= rank)
        };
        if !accounts(&found, self.limit, Rank::Number) {
            found.extend(data::fits(self)?);
        }
        found.extend(local::status(self));
        found.extend(local::values_held(self));
        if !accounts(&found, self.limit, Rank::Places) {
            // What comes near by one change of the scheme has another fault beside it, not an iteration that stopped.
            let is_near = |e: &Explanation| e.left < NEAR * self.residual && e.rank < Rank::Many;
            let near = found.iter().any(is_near);
            found.extend(known::explain(self)?.filter(|e| !near || !e.is_iteration()));
        }
        for explanation in &mut found {
            let left = explanation.left;
            explanation.accounts = left <= self.limit && left <= NEAR * self.residual;
        }
        let (mut those, mut others): (Vec<_>, Vec<_>) = found
            .into_iter()
            .partition(|e| e.accounts || e.is_iteration());
        those.sort_by_key(|e| e.rank);
        others.sort_by(|a, b| a.left.total_cmp(&b.left));
        others.truncate(TOLD);
        those.extend(others);
        Ok(those)
    }

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

    fn fails(&self, row: usize) -> bool {
        // What is not a number fails.
        !(self.errors[row] <= self.limit)
    }

    /// The terms that all rows that fail contain: what changes another one alone explains nothing.
    fn in_all(&self) -> Vec<Term> {
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
    fn terms(&self) -> Vec<TermRows> {
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

    fn findings(
        self,
        written: Written,
        gamma: Vec<FaceGamma>,
        explanations: Vec<Explanation>,
    ) -> Findings {
        let problem = &self.problem;
        let mesh = problem.space.mesh;
        let fails_on = |face: usize| {
            let cell = mesh.face_cells(face)[0] as usize;
            let mut rows = problem.space.face_dofs(cell, mesh.local_face(cell, face));
            rows.any(|row| self.fails(row as usize))
        };
        let mut worst: Vec<usize> = (0..self.u.len()).filter(|row| self.fails(*row)).collect();
        let failing = worst.len();
        worst.sort_by(|a, b| self.errors[*b].total_cmp(&self.errors[*a]));
        worst.truncate(WORST);
        let spot = |row: &usize| Spot::of_dof(problem, *row, self.errors[*row]);
        Findings {
            residual: self.residual,
            limit: self.limit,
            written,
            rows: self.u.len(),
            failing,
            faces: mesh.face_count(),
            failing_faces: (0..mesh.face_count()).filter(|f| fails_on(*f)).count(),
            worst: worst.iter().map(spot).collect(),
            terms: self.terms(),
            gamma,
            explanations,
            errors: self.errors,
        }
    }
}
