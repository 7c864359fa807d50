//! Finds the form that a result solves instead of the given one: the changes of the form's dictionary as a scheme for the recovery.

use super::change::{Cause, Change, Explanation};
use super::dictionary::{Entry, coordinates, dictionary};
use super::local::local;
use super::recovery::{Column, PLAINEST, Recovered, Scheme, Trial, recover};
use super::residual::{Residual, add, largest, norm};

/// Residuals of rows up to this, relative to their sizes, are rounding.
const ROUNDING: f64 = 1e-13;
/// If numbers were rounded when they were written, a row may be wrong by this many units of their last digits.
const WRITTEN: f64 = 4.0;
/// The closest change is reported if it explains this fraction.
const NEAREST: f64 = 0.5;
/// The most changes in one explanation.
const MOST: usize = 4;
/// The most further explanations that are reported.
const ALIKE: usize = 3;

/// A form with its possible changes.
struct Changes<'a> {
    residual: &'a Residual<'a>,
    rounding: f64,
    changes: Vec<Change>,
    /// The source of the vector for other parameters or factors; `None` for changes in some cells.
    entries: Vec<Option<Entry>>,
    columns: Vec<Column>,
}

/// The bound for rounding in rows, relative to their sizes.
pub fn limit(unit: f64) -> f64 {
    ROUNDING.max(WRITTEN * unit)
}

/// Why a result does not solve a form; `None` if no known change explains half of the residual.
pub fn explain(residual: &Residual<'_>, unit: f64) -> Option<Explanation> {
    let b = wanted(residual, &residual.values);
    let rounding = limit(unit);
    let mut all = Changes::new(residual, rounding, dictionary(residual));
    for (change, column) in local(residual, &b, rounding) {
        all.changes.push(change);
        all.entries.push(None);
        all.columns.push(column);
    }
    let found = all.explanation(&b);
    if found.as_ref().is_some_and(|found| found.is_exact) {
        return found;
    }
    let others = Changes::new(residual, rounding, coordinates(residual)).explanation(&b);
    others.filter(|others| others.is_exact).or(found)
}

/// The contribution that changes must add to rows, relative to their sizes.
pub fn wanted(residual: &Residual<'_>, values: &[f64]) -> Vec<f64> {
    let all = residual.goal.iter().zip(values);
    scaled(residual, &all.map(|(goal, r)| goal - r).collect::<Vec<_>>())
}

/// Relative to the sizes of rows.
fn scaled(residual: &Residual<'_>, values: &[f64]) -> Vec<f64> {
    let all = values.iter().zip(&residual.sizes);
    all.map(|(r, size)| if *size > 0.0 { r / size } else { 0.0 })
        .collect()
}

impl<'a> Changes<'a> {
    /// From entries with their contributions to rows; changes without an effect here are left out.
    fn new(residual: &'a Residual<'a>, rounding: f64, all: Vec<(Entry, Vec<f64>)>) -> Self {
        let mut found = Changes {
            residual,
            rounding,
            changes: Vec::new(),
            entries: Vec::new(),
            columns: Vec::new(),
        };
        for (entry, vector) in all {
            let vector = scaled(residual, &vector);
            if largest(&vector) <= ROUNDING {
                continue;
            }
            found
                .columns
                .push(match (entry.change.is_whole(), &entry.change) {
                    (true, _) => Column::whole(vector),
                    (_, Change::Parameter { parameter }) => {
                        let size = residual.parameters[*parameter].abs();
                        Column::number(vector, if size > 0.0 { size } else { 1.0 })
                    }
                    _ => Column {
                        plain: &[-1.0, -2.0],
                        ..Column::number(vector, 1.0)
                    },
                });
            found.changes.push(entry.change.clone());
            found.entries.push(Some(entry));
        }
        found
    }

    fn explanation(&self, b: &[f64]) -> Option<Explanation> {
        let Recovered { exact, singles } = recover(self, b, self.rounding, MOST);
        let mut exact = exact.into_iter();
        if let Some(found) = exact.next() {
            // If there is a simple change, a complex one is not an alternative.
            let most = found.rank(self).max(10 * found.of.len() + PLAINEST);
            let others = exact.filter(|trial| trial.rank(self) <= most);
            return Some(Explanation {
                left: found.left,
                share: 1.0,
                is_exact: true,
                alike: others
                    .take(ALIKE)
                    .map(|trial| self.causes(&trial))
                    .collect(),
                causes: self.causes(&found),
            });
        }
        let share = |trial: &Trial| {
            let mut rest = b.to_vec();
            add(
                &mut rest,
                &self.columns[trial.of[0]].vector,
                -trial.deltas[0],
            );
            1.0 - norm(&rest) / norm(b)
        };
        let with_number = singles
            .iter()
            .filter(|trial| !self.columns[trial.of[0]].is_whole);
        let nearest = with_number.max_by(|a, b| share(a).total_cmp(&share(b)))?;
        (share(nearest) >= NEAREST).then(|| Explanation {
            causes: self.causes(nearest),
            left: nearest.left,
            share: share(nearest),
            is_exact: false,
            alike: Vec::new(),
        })
    }

    fn causes(&self, trial: &Trial) -> Vec<Cause> {
        let each = trial.of.iter().zip(&trial.deltas);
        let mut all: Vec<(usize, Cause)> = each
            .map(|(k, delta)| {
                let change = self.changes[*k].clone();
                let factor = self.factor(*k, *delta);
                (self.rank(*k, *delta), Cause { change, factor })
            })
            .collect();
        all.sort_by_key(|(rank, _)| *rank);
        all.into_iter().map(|(_, cause)| cause).collect()
    }

    /// The reported form of a number.
    fn factor(&self, change: usize, delta: f64) -> f64 {
        match &self.changes[change] {
            Change::Parameter { parameter } => self.residual.parameters[*parameter] + delta,
            Change::Mass { .. }
            | Change::Varying { .. }
            | Change::Slope { .. }
            | Change::Obstacle { .. } => delta,
            change if change.is_whole() => 1.0,
            _ => 1.0 + delta,
        }
    }
}

impl Scheme for Changes<'_> {
    fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// F may depend on parameters in any way, and the factor of a term multiplies other changes in it.
    fn left(&self, changes: &[(usize, f64)]) -> Option<Vec<f64>> {
        let residual = self.residual;
        let mut parameters = residual.parameters.clone();
        let mut factors = vec![1.0; residual.terms.len()];
        for (k, delta) in changes {
            match self.changes[*k] {
                Change::Parameter { parameter } => parameters[parameter] += delta,
                Change::Factor { term } => factors[term] += delta,
                _ => {}
            }
        }
        let mut rows = residual.with(&parameters);
        for (k, delta) in changes {
            let entry = self.entries[*k].as_ref()?;
            if !matches!(entry.change, Change::Parameter { .. }) {
                let vector = entry.vector(residual, &parameters, &factors);
                add(&mut rows, &vector, *delta);
            }
        }
        Some(wanted(residual, &rows))
    }

    fn is_curved(&self, of: &[usize]) -> bool {
        let has = |is: fn(&Change) -> bool| of.iter().any(|k| is(&self.changes[*k]));
        has(|c| matches!(c, Change::Parameter { .. }))
            || has(|c| matches!(c, Change::Factor { .. })) && has(Change::is_whole)
    }

    fn rank(&self, change: usize, number: f64) -> usize {
        self.changes[change].rank(self.factor(change, number))
    }

    /// If a term is missing, other changes of it do not matter, nor does its replacement; and the changed form must still have terms in each row: if all terms of a row
    /// are removed, it holds for any result.
    fn is_sound(&self, trial: &Trial) -> bool {
        let Residual { terms, sizes, .. } = self.residual;
        let each = trial.of.iter().zip(&trial.deltas);
        let added: Vec<_> = each
            .map(|(k, delta)| (self.changes[*k].term(), *delta, &self.columns[*k]))
            .collect();
        let has = |is: &dyn Fn(&Change) -> bool| trial.of.iter().any(|k| is(&self.changes[*k]));
        let count = |term: usize| added.iter().filter(|(of, ..)| *of == Some(term)).count();
        let is_missing = |k: &usize| matches!(self.changes[*k], Change::Factor { .. });
        let each = trial.of.iter().zip(&added);
        let mut missing = each.filter(|(k, (_, delta, _))| is_missing(k) && *delta == -1.0);
        let is_added = has(&|c| matches!(c, Change::Mass { .. } | Change::Slope { .. }));
        if missing.any(|(_, (term, ..))| is_added || term.is_some_and(|term| count(term) > 1)) {
            return false;
        }
        let is_empty = |row: usize| {
            let own = terms.iter().enumerate().map(|(term, values)| {
                let mine = added.iter().filter(|(of, ..)| *of == Some(term));
                let changes =
                    mine.map(|(_, delta, column)| delta * column.vector[row] * sizes[row]);
                [
                    values[row].abs(),
                    (values[row] + changes.sum::<f64>()).abs(),
                ]
            });
            let [before, after] =
                own.fold([0.0, 0.0], |sum, own| [sum[0] + own[0], sum[1] + own[1]]);
            before > 1e3 * self.rounding * sizes[row] && after <= self.rounding * sizes[row]
        };
        !(0..sizes.len()).any(is_empty)
    }
}
