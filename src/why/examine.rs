//! The search: everything that is tried, and what is found.

use super::candidates::{Candidate, candidates};
use super::gamma::FaceGamma;
use super::place::Spot;
use super::search::Search;
use super::{Aspect, Explanation, Findings, Rank, data, gamma, known, local, scheme};
use crate::run::{RESIDUAL_TOLERANCE, Runner, Setup, Written};
use crate::text::text;
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
        if !accounts(&found, self.limit, Rank::Number) {
            found.extend(scheme::explain(self));
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
