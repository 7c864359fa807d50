//! The changes of a scene's scheme as columns of a recovery: the remaining residual of each is computed by assembly, without solving.

use super::dictionary::{Entry, Make};
use super::local::functionals;
use super::search::{Search, left_in, weighted};
use super::{Aspect, Explanation, Rank};
use crate::run::{Setup, Variation};
use crate::text::{Text, text};
use faceoff_fem::contact::Term;
use faceoff_form::judge::recovery::{Column, Recovered, Scheme, Trial, fitted, largest, recover};
use faceoff_mesh::{cancel, parallel};

/// The relative step of finite differences.
const STEP: f64 = 1e-3;
/// A change of a datum that changes no row by more has no effect.
const FELT: f64 = 1e-11;
/// u times less than this counts as zero.
const LEAST: f64 = 1e-6;
/// The most changes at once: each needs a separate problem.
const MOST: usize = 2;

/// A scene's scheme with its possible changes.
pub(super) struct Changes<'a> {
    setup: &'a Setup,
    u: &'a [f64],
    wanted: Vec<f64>,
    scale: Vec<f64>,
    limit: f64,
    /// For contact faces, if they are few.
    functionals: Option<Vec<Vec<Vec<f64>>>>,
    entries: Vec<Entry>,
    columns: Vec<Column>,
}

impl<'a> Changes<'a> {
    /// Keeps the entries that change a row, with their columns.
    pub fn new(search: &Search<'a>, entries: Vec<Entry>) -> Self {
        let mut all = Changes {
            setup: search.setup,
            u: search.u,
            wanted: search.wanted(),
            scale: search.rows.scale.clone(),
            limit: search.limit,
            functionals: functionals(search),
            entries,
            columns: Vec::new(),
        };
        let vectors = parallel::map(0..all.entries.len(), |k| all.vector(k));
        let entries = std::mem::take(&mut all.entries);
        for (entry, vector) in entries.into_iter().zip(vectors) {
            let vector = vector.filter(|d| d.iter().all(|d| d.is_finite()) && largest(d) > 0.0);
            if let Some(vector) = vector {
                all.columns.push(entry.make.column(vector));
                all.entries.push(entry);
            }
        }
        all
    }

    /// The contribution of a change to the rows.
    fn vector(&self, k: usize) -> Option<Vec<f64>> {
        let less = |a: &[f64], b: &[f64], by: f64| -> Vec<f64> {
            a.iter().zip(b).map(|(a, b)| (a - b) / by).collect()
        };
        let size = match &self.entries[k].make {
            Make::Known(left) => return Some(less(&self.wanted, left, 1.0)),
            Make::Choice(_) => return Some(less(&self.wanted, &self.left(&[(k, 1.0)])?, 1.0)),
            Make::Number { size, .. } => *size,
            Make::Values { .. } => 1.0,
        };
        let step = STEP * size;
        let [low, high] = [-step, step].map(|by| self.left(&[(k, by)]));
        Some(less(&low?, &high?, 2.0 * step))
    }

    /// The explanations of u, and the other changes, ordered by their remaining residual.
    pub fn explanations(&self) -> (Vec<Explanation>, Vec<Explanation>) {
        let Recovered { exact, singles } = recover(self, &self.wanted, self.limit, MOST);
        let those = exact.iter().map(|trial| self.explanation(trial));
        let those: Vec<Explanation> = those.collect();
        let is_exact = |trial: &Trial| exact.iter().any(|other| other.of == trial.of);
        let others = singles.into_iter().filter(|trial| !is_exact(trial));
        let left = |mut trial: Trial| {
            // A change without a number has nothing to fit.
            if let [k] = trial.of[..]
                && self.columns[k].is_whole
            {
                let each = self.wanted.iter().zip(&self.columns[k].vector);
                let rest: Vec<f64> = each.map(|(b, d)| b - d).collect();
                trial.left = largest(&rest);
            }
            self.explanation(&trial)
        };
        let mut others: Vec<Explanation> = others.map(left).collect();
        others.retain(|e| e.left.is_finite());
        others.sort_by(|a, b| a.left.total_cmp(&b.left));
        (those, others)
    }

    fn explanation(&self, trial: &Trial) -> Explanation {
        let each = trial.of.iter().zip(&trial.deltas);
        let mut each = each.map(|(k, number)| self.said(*k, *number));
        let first = each.next().expect("invariant: a trial has a change");
        let found = each.fold(first, |all, next| Explanation {
            factor: None,
            term: all.term.filter(|term| next.term == Some(*term)),
            at: [all.at, next.at].concat(),
            what: joined(all.what, next.what),
            ..Explanation::new(
                Aspect::Several,
                joined(all.brief, next.brief),
                all.rank.max(next.rank).max(Rank::Number),
                0.0,
            )
        });
        Explanation {
            left: trial.left,
            ..found
        }
    }
}

fn joined(a: Text, b: Text) -> Text {
    text!("{}, and {}", a, b)
}

impl Scheme for Changes<'_> {
    fn columns(&self) -> &[Column] {
        &self.columns
    }

    fn left(&self, changes: &[(usize, f64)]) -> Option<Vec<f64>> {
        self.left_with(changes, None)
    }

    fn is_curved(&self, of: &[usize]) -> bool {
        of.len() > 1 || of.iter().any(|k| !self.entries[*k].make.is_whole())
    }

    fn rank(&self, change: usize, number: f64) -> usize {
        self.said(change, number).rank as usize
    }

    /// Excludes trivial explanations: values that are scaled down to zero solve any scheme whose data are; a datum without effect on u may have any value; and a change that
    /// one or two contact faces explain says nothing about a number on all of them.
    fn is_sound(&self, trial: &Trial) -> bool {
        let each = || trial.of.iter().copied().zip(trial.deltas.iter().copied());
        let is_of_values = |(k, number): (usize, f64)| match self.entries[k].make {
            Make::Values { .. } => trial.of.len() > 1 || (1.0 + number).abs() <= LEAST,
            _ => false,
        };
        !each().any(is_of_values)
            && !self.is_double(trial)
            && each().all(|(k, _)| self.is_felt(k, trial))
            && self.is_seen(trial)
    }
}

impl Changes<'_> {
    /// The remaining residual with changes, and with one further change of the scheme.
    fn left_with(&self, changes: &[(usize, f64)], more: Option<&Variation>) -> Option<Vec<f64>> {
        cancel::check().ok()?;
        let (mut setup, mut by) = (self.setup.clone(), 1.0);
        for (k, number) in changes {
            match &self.entries[*k].make {
                Make::Choice(variation) => setup = setup.with(variation).ok()?,
                Make::Number { with, .. } => setup = setup.with(&with(*number)).ok()?,
                Make::Values { .. } => by *= 1.0 + number,
                Make::Known(_) => return None,
            }
        }
        setup = setup.varied(more).ok()?;
        let u: Vec<f64> = self.u.iter().map(|u| by * u).collect();
        let problem = setup.case().ok()?.problem;
        let is_whole = |(k, _): &(usize, f64)| self.entries[*k].make.is_whole();
        Some(match more.is_none() && changes.iter().all(is_whole) {
            true => left_in(&problem, &u),
            // The scale of the rows must not depend on numbers.
            false => {
                let rows = weighted(&problem.residual(&u), &self.scale);
                rows.iter().map(|row| -row).collect()
            }
        })
    }

    fn said(&self, k: usize, number: f64) -> Explanation {
        (self.entries[k].say)(number)
    }

    /// Do two changes concern the same thing, and is one of them a choice?
    fn is_double(&self, trial: &Trial) -> bool {
        let about = |k: &usize| self.said(*k, 1.0).ingredient;
        let is_choice = |k: &&usize| matches!(self.entries[**k].make, Make::Choice(_));
        let choices = trial.of.iter().filter(is_choice);
        let mut counts = choices.map(|k| trial.of.iter().filter(|l| about(l) == about(k)).count());
        counts.any(|count| count > 1)
    }

    /// Does a changed datum have an effect in the scheme with the changes?
    fn is_felt(&self, k: usize, trial: &Trial) -> bool {
        let datum = match (self.said(k, 1.0).ingredient, &self.entries[k].make) {
            (_, Make::Known(_)) => return true,
            (Aspect::Datum(datum), _) => datum,
            _ => return true,
        };
        let changes: Vec<_> = trial
            .of
            .iter()
            .copied()
            .zip(trial.deltas.iter().copied())
            .collect();
        let size = Some(largest(self.u)).filter(|size| *size > 0.0);
        let more = Variation::Shifted(datum, STEP * size.unwrap_or(1.0));
        let [with, without] = [Some(&more), None].map(|more| self.left_with(&changes, more));
        let Some((with, without)) = with.zip(without) else {
            return true;
        };
        let mut each = with.iter().zip(&without);
        each.any(|(a, b)| (a - b).abs() > FELT)
    }

    /// Do more contact faces fail than there are numbers of contact?
    fn is_seen(&self, trial: &Trial) -> bool {
        let Some(functionals) = &self.functionals else {
            return true;
        };
        let (mut rest, mut count) = (self.wanted.clone(), 0);
        for (k, number) in trial.of.iter().zip(&trial.deltas) {
            let of_contact = self.said(*k, *number).term == Some(Term::Contact);
            // A choice that leaves no residual in thirteen digits by chance does not count.
            match of_contact && !self.entries[*k].make.is_whole() {
                true => count += 1,
                false => {
                    let vector = &self.columns[*k].vector;
                    rest.iter_mut()
                        .zip(vector)
                        .for_each(|(rest, d)| *rest -= number * d);
                }
            }
        }
        let explains = |faces: &[&Vec<Vec<f64>>]| {
            let vectors: Vec<&[f64]> = faces.iter().flat_map(|f| f.iter().map(|v| &**v)).collect();
            fitted(&vectors, &rest).1 <= self.limit
        };
        let each = functionals.iter().enumerate();
        let mut pairs = each.flat_map(|(k, a)| functionals[..k].iter().map(move |b| [a, b]));
        match count {
            0 => true,
            1 => !functionals.iter().any(|face| explains(&[face])),
            _ => !pairs.any(|pair| explains(&pair)),
        }
    }
}
