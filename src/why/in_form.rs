//! Whether a result solves a weak form, and which form it solves if not.

use serde::Serialize;

use super::changes::{CauseTold, Names};
use crate::run::{RESIDUAL_TOLERANCE, Written};
use crate::text::number::{share, size, whole};
use crate::text::{Text, text};
use faceoff_form::Problem;
use faceoff_form::judge::{Cause, Judged, judge};
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Mesh;

/// If numbers were rounded when they were written, a row may be wrong by this many units of their last digits.
const WRITTEN: f64 = 4.0;

/// The most equivalent explanations in a sentence; a page shows all.
const IN_SENTENCE: usize = 2;

/// How much the causes explain.
const EXACTLY: &str = "all but rounding";

/// The result of substituting a field into a form.
#[derive(Debug, Serialize)]
pub struct InForm {
    /// Does it solve the form?
    pub verdict: Verdict,
    /// The finding, without a full stop.
    pub sentence: Text,
    /// The largest residual of a free row, relative to the sum of the absolute values of its terms.
    pub residual: f64,
    /// The bound for rounding.
    pub limit: f64,
    /// The number of rows beyond it.
    pub failing: usize,
    /// The largest error of prescribed values, relative to the largest value.
    pub dirichlet: f64,
    /// The number of digits in the file.
    pub written: Written,
    /// The changes that together make a form that the result solves; empty if it solves the given form, or none is known.
    pub explanations: Vec<CauseTold>,
    /// Other changes with the same effect.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub alike: Vec<Vec<CauseTold>>,
    /// All changes as text to follow "as if", and how much they explain.
    #[serde(skip)]
    pub because: Vec<(Text, String)>,
    /// All rows and terms.
    #[serde(skip)]
    pub judged: Judged,
}

impl InForm {
    /// Substitutes the fields of a result, which have the names of the unknowns.
    ///
    /// # Errors
    /// A result on another mesh, fields that are missing or are not functions of the spaces, and a form of several time steps.
    pub fn new(problem: &Problem, mesh: &Mesh, result: &Mesh) -> Result<Self> {
        let written = result.fields.iter();
        let written = written.map(|field| Written::of(&field.values.to_f64()));
        let written = written.max_by(|a, b| a.unit().total_cmp(&b.unit()));
        let written = written.unwrap_or(Written::Binary64);
        let judged = judge(problem, mesh, result, written.unit())?;
        let limit = RESIDUAL_TOLERANCE.max(WRITTEN * written.unit());
        // Negated so that NaN fails.
        let fails = |error: f64| !(error <= limit);
        let failing = judged.rows.iter().filter(|row| fails(row.error)).count();
        let residual = judged.rows.first().map_or(0.0, |row| row.error);
        let dirichlet = judged.held.first().map_or(0.0, |row| row.error);
        let parts = faults(problem, &judged, &fails);
        let mut found = InForm {
            verdict: match parts.is_empty() {
                true => Verdict::Agree,
                false => Verdict::Disagree,
            },
            sentence: Text::joined(parts, "; "),
            residual,
            limit,
            failing,
            dirichlet,
            written,
            explanations: Vec::new(),
            alike: Vec::new(),
            because: Vec::new(),
            judged,
        };
        if found.verdict.passes() {
            found.sentence = text!(
                "solves the form to rounding: the largest residual is {}",
                size(residual)
            );
        } else {
            found.explain(problem);
        }
        Ok(found)
    }

    /// The changes that explain all but rounding, as text to follow "as if".
    pub fn cause(&self) -> Option<&Text> {
        let known = self
            .because
            .first()
            .filter(|_| !self.explanations.is_empty());
        known.map(|(words, _)| words)
    }

    fn explain(&mut self, problem: &Problem) {
        let names = Names {
            problem,
            terms: &self.judged.terms,
        };
        let given = &self.judged.given;
        if self.failing == 0 {
            if !given.is_empty() {
                let cause = names.sentence(given);
                self.sentence = text!("{}; it solves the form as if {}", &self.sentence, &cause);
                self.because = vec![(cause, EXACTLY.to_owned())];
                self.explanations = names.told(given, self.residual);
            }
            return;
        }
        let Some(found) = &self.judged.explanation else {
            self.sentence = text!("{}; no change that is known explains it", &self.sentence);
            return;
        };
        let all = |causes: &[Cause]| [causes, given].concat();
        let cause = names.sentence(&all(&found.causes));
        if !found.is_exact {
            self.sentence = text!(
                "{}; no change that is known explains it, the nearest, as if {}, explains {}",
                &self.sentence,
                &cause,
                share(found.share)
            );
            self.because = vec![(cause, share(found.share))];
            return;
        }
        let others = found.alike.iter();
        let others = others.map(|causes| names.sentence(&all(causes)));
        let all: Vec<Text> = std::iter::once(cause).chain(others).collect();
        self.sentence = text!(
            "{}; it solves the form as if {}",
            &self.sentence,
            Text::joined(all.iter().take(IN_SENTENCE).cloned(), ", or as if ")
        );
        let each = all.into_iter().map(|text| (text, EXACTLY.to_owned()));
        self.because = each.collect();
        let told = |causes: &[Cause]| names.told(&[causes, given].concat(), found.left);
        self.explanations = told(&found.causes);
        self.alike = found.alike.iter().map(|causes| told(causes)).collect();
    }
}

/// What does not hold.
fn faults(problem: &Problem, judged: &Judged, fails: &impl Fn(f64) -> bool) -> Vec<Text> {
    let mut parts = Vec::new();
    let [rows, held] =
        [&judged.rows, &judged.held].map(|rows| rows.iter().filter(|row| fails(row.error)).count());
    if rows > 0 {
        parts.push(text!(
            "{} of {} equations do not hold, the largest residual is {}",
            whole(rows),
            whole(judged.free),
            size(judged.rows[0].error)
        ));
    }
    if held > 0 {
        parts.push(text!(
            "{} of {} Dirichlet values are off, by up to {}",
            whole(held),
            whole(judged.held.len()),
            size(judged.held[0].error)
        ));
    }
    let means = judged.means.iter().filter(|(_, error)| fails(*error));
    let means: Vec<&str> = means
        .map(|(k, _)| problem.unknowns[*k].name.as_str())
        .collect();
    if !means.is_empty() {
        parts.push(text!("the mean of {} is off", means.join(" and that of ")));
    }
    parts
}
