//! Tries all changes, and collects the findings.

use super::dictionary::dictionary;
use super::gamma::FaceGamma;
use super::place::Spot;
use super::recovery::Changes;
use super::search::Search;
use super::{Aspect, Explanation, Findings, Rank, gamma, known, local, scheme};
use crate::run::{RESIDUAL_TOLERANCE, Runner, Setup, Written};
use crate::text::text;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;

/// The error of a sum of rounded values may be larger than that of each.
const SUMMED: f64 = 4.0;
/// The number of worst rows that are kept.
const WORST: usize = 10;
/// The number of attempts that are reported if none explains the field.
const TOLD: usize = 8;
/// A change comes close if it leaves less than this fraction of the residual.
const NEAR: f64 = 0.1;
/// Examines u, at all dofs, as an answer to a setup; `written` is the precision of its digits.
///
/// # Errors
/// An interruption; a setup without a discrete problem.
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

    /// All attempts, with those that explain u first.
    fn explain(&mut self, gammas: &[FaceGamma]) -> Result<Vec<Explanation>> {
        let at_faces = gamma::at_faces(self, gammas);
        let size = self.u.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
        let mut entries = dictionary(self.setup, if size > 0.0 { size } else { 1.0 });
        entries.extend(at_faces.into_iter().chain(local::status(self)));
        entries.extend(local::values_held(self));
        let changes = Changes::new(self, entries);
        let (mut those, mut others) = changes.explanations();
        cancel::check()?;
        let accounts = |found: &[Explanation], rank: Rank| found.iter().any(|e| e.rank <= rank);
        if !accounts(&those, Rank::Number) {
            those.extend(scheme::explain(self).filter(|e| e.left <= self.limit));
        }
        if !accounts(&those, Rank::Places) {
            // If one change of the scheme comes close, there is another fault in addition, rather than an iteration that stopped early.
            let is_near = |e: &Explanation| e.left < NEAR * self.residual && e.rank < Rank::Many;
            let near = those.iter().chain(&others).any(is_near);
            those.extend(known::explain(self)?.filter(|e| !near || !e.is_iteration()));
        }
        for explanation in &mut those {
            explanation.accounts = !explanation.is_iteration();
        }
        those.sort_by_key(|e| e.rank);
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
