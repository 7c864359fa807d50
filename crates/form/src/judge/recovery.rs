//! The fewest changes of a form that leave nothing of a residual.
//!
//! With b = -F(u; ·) and the vectors d_k of the changes, over the sizes of rows, b = Σ δ_k d_k is sought with few δ_k that are not 0: first with
//! each change alone, then with each pair, then by adding the one that helps most (orthogonal matching pursuit: Y. Pati, R. Rezaiifar,
//! P. Krishnaprasad, Asilomar 1993). A change counts as the cause only if all rows are left with rounding.

use faceoff_mesh::parallel;

use super::change::{Cause, Change, Explanation, rank};
use super::dictionary::{Column, Entry, coordinates, dictionary};
use super::local::local;
use super::residual::{Residual, add, dot, largest};

/// Rows that leave no more than this, over their sizes, are left with rounding.
const ROUNDING: f64 = 1e-13;
/// Of numbers that were rounded when they were written, a row may be off by so many of their last digits.
const WRITTEN: f64 = 4.0;
/// A cause leaves no more than this part of the largest row.
const CONTRAST: f64 = 1e-2;
/// Changes that are tried in pairs.
const PAIRED: usize = 120;
/// Pairs, and changes beside one, that are looked at closely.
const CLOSELY: usize = 24;
/// Changes in one explanation.
const MOST: usize = 4;
/// Steps of Newton's method for the numbers of changes, which begin where no more than this part of the largest row is left.
const MOST_STEPS: usize = 8;
const NEAR: f64 = 0.3;
/// The nearest change is told if it explains this part.
const NEAREST: f64 = 0.5;
/// A number is a plain one, such as -1, if it is this near.
const PLAIN: f64 = 1e-6;
/// Other explanations that are told, and the rank up to which they always are.
const ALIKE: usize = 3;
const PLAINEST: usize = 5;

/// Some changes, their δ, and the rows that they leave.
#[derive(Clone)]
struct Trial {
    of: Vec<usize>,
    deltas: Vec<f64>,
    left: f64,
}

/// What counts as rounding in rows, over their sizes.
pub fn limit(unit: f64) -> f64 {
    ROUNDING.max(WRITTEN * unit)
}

/// Why a result does not solve a form; none where no change that is known explains half of it.
pub fn explain(residual: &Residual<'_>, unit: f64) -> Option<Explanation> {
    let b: Vec<f64> = scaled(residual, &residual.values)
        .iter()
        .map(|r| -r)
        .collect();
    let worst = largest(&b);
    let rounding = limit(unit).min(CONTRAST * worst);
    let among = |columns: &[Column]| {
        let search = Search {
            residual,
            columns,
            rounding,
            b: &b,
        };
        search.explanation()
    };
    let mut all = columns(residual, dictionary(residual));
    all.extend(local(residual, &b, rounding));
    let found = among(&all);
    if found.as_ref().is_some_and(|found| found.is_exact) {
        return found;
    }
    let others = among(&columns(residual, coordinates(residual)));
    others.filter(|others| others.is_exact).or(found)
}

/// Entries with their vectors over the sizes of rows; what is nothing here explains nothing.
fn columns(residual: &Residual<'_>, entries: Vec<(Entry, Vec<f64>)>) -> Vec<Column> {
    let all = entries.into_iter().map(|(entry, vector)| {
        let vector = scaled(residual, &vector);
        let square = dot(&vector, &vector);
        Column {
            change: entry.change.clone(),
            entry: Some(entry),
            vector,
            square,
        }
    });
    all.filter(|c| largest(&c.vector) > ROUNDING).collect()
}

struct Search<'a> {
    residual: &'a Residual<'a>,
    columns: &'a [Column],
    rounding: f64,
    b: &'a [f64],
}

impl Search<'_> {
    fn explanation(&self) -> Option<Explanation> {
        let singles: Vec<Trial> = (0..self.columns.len()).map(|k| self.fit(vec![k])).collect();
        let mut exact = self.exact(&singles);
        if exact.is_empty() {
            exact = self.exact(&self.pairs(&singles));
        }
        if exact.is_empty() {
            exact = self.exact(&self.greedy(&singles));
        }
        // With three or more anything can be had of far-fetched ones.
        let is_plain = |causes: &[Cause]| rank(causes) <= 10 * causes.len() + PLAINEST;
        exact.retain(|(causes, _)| causes.len() < 3 || is_plain(causes));
        exact.sort_by_key(|(causes, _)| rank(causes));
        let mut exact = exact.into_iter();
        if let Some((causes, left)) = exact.next() {
            // Beside a plain change a far-fetched one is no second opinion.
            let most = rank(&causes).max(10 * causes.len() + PLAINEST);
            let others = exact.map(|(causes, _)| causes);
            return Some(Explanation {
                left,
                share: 1.0,
                is_exact: true,
                alike: others
                    .filter(|causes| rank(causes) <= most)
                    .take(ALIKE)
                    .collect(),
                causes,
            });
        }
        let share = |trial: &Trial| 1.0 - norm(&self.rest(trial)) / norm(self.b);
        let nearest = singles
            .iter()
            .filter(|trial| !self.change(trial.of[0]).is_whole());
        let nearest = nearest.max_by(|a, b| share(a).total_cmp(&share(b)))?;
        (share(nearest) >= NEAREST).then(|| Explanation {
            causes: self.causes(nearest),
            left: nearest.left,
            share: share(nearest),
            is_exact: false,
            alike: Vec::new(),
        })
    }

    fn change(&self, k: usize) -> &Change {
        &self.columns[k].change
    }

    /// The δ that leave least in the sum of squares.
    fn fit(&self, of: Vec<usize>) -> Trial {
        let mut trial = Trial {
            deltas: vec![0.0; of.len()],
            of,
            left: 0.0,
        };
        // The second time for what rounding has left.
        for _ in 0..2 {
            let rest = self.rest(&trial);
            let of = trial.of.iter().map(|k| &self.columns[*k]);
            let right = of.clone().map(|c| dot(&c.vector, &rest)).collect();
            let gram = of
                .clone()
                .map(|c| of.clone().map(|d| dot(&c.vector, &d.vector)).collect())
                .collect();
            for (delta, more) in trial.deltas.iter_mut().zip(solved(gram, right)) {
                *delta += more;
            }
        }
        trial.left = largest(&self.rest(&trial));
        trial
    }

    fn rest(&self, trial: &Trial) -> Vec<f64> {
        let mut rest = self.b.to_vec();
        for (k, delta) in trial.of.iter().zip(&trial.deltas) {
            let all = rest.iter_mut().zip(&self.columns[*k].vector);
            all.for_each(|(rest, d)| *rest -= delta * d);
        }
        rest
    }

    /// Those trials that leave rounding, once numbers that a change does not have are 1, and parameters have their exact values.
    fn exact(&self, trials: &[Trial]) -> Vec<(Vec<Cause>, f64)> {
        let near = trials.iter().filter(|trial| {
            let changes = || trial.of.iter().map(|k| self.change(*k));
            let has = |is: fn(&Change) -> bool| changes().any(is);
            let is_curved = has(|c| matches!(c, Change::Parameter { .. }))
                || has(|c| matches!(c, Change::Factor { .. })) && has(Change::is_whole);
            trial.left <= self.rounding || is_curved && trial.left <= NEAR * largest(self.b)
        });
        let settled = near.filter_map(|trial| {
            let mut trial = trial.clone();
            for (k, delta) in trial.of.iter().zip(&mut trial.deltas) {
                let plain = match self.change(*k).is_whole() {
                    true => Some(1.0),
                    false => [-1.0, -2.0]
                        .into_iter()
                        .find(|n| (*delta - n).abs() < PLAIN),
                };
                *delta = plain.unwrap_or(*delta);
            }
            trial.left = largest(&self.rest(&trial));
            if trial.left > self.rounding {
                self.refine(&mut trial);
            }
            let is_cause = self.is_used(&trial) && self.has_equations(&trial);
            (is_cause && trial.left <= self.rounding).then(|| (self.causes(&trial), trial.left))
        });
        settled.collect()
    }

    /// Does each change matter, and are there more equations to explain than numbers to choose? In a term that is missing nothing else matters.
    fn is_used(&self, trial: &Trial) -> bool {
        let each = || trial.of.iter().zip(&trial.deltas);
        let missing = each().filter_map(|(k, delta)| match self.change(*k) {
            Change::Factor { term } if *delta == -1.0 => Some(*term),
            _ => None,
        });
        for term in missing {
            let of = trial.of.iter().map(|k| self.change(*k));
            if of.filter(|change| change.term() == Some(term)).count() > 1 {
                return false;
            }
        }
        let mut sizes = each().map(|(k, delta)| delta.abs() * largest(&self.columns[*k].vector));
        let numbers = trial
            .of
            .iter()
            .filter(|k| !self.change(**k).is_whole())
            .count();
        let failing = self.b.iter().filter(|b| b.abs() > self.rounding).count();
        failing > numbers && sizes.all(|size| size > 10.0 * self.rounding)
    }

    /// Does the changed form still say something in each row? Where all that a row is made of is taken away, it holds whatever the result is.
    fn has_equations(&self, trial: &Trial) -> bool {
        let Residual { terms, sizes, .. } = self.residual;
        let of = trial.of.iter().zip(&trial.deltas);
        let added: Vec<_> = of
            .map(|(k, d)| (self.change(*k).term(), d, &self.columns[*k]))
            .collect();
        let is_empty = |row: usize| {
            let own = terms.iter().enumerate().map(|(term, values)| {
                let mine = added.iter().filter(|(of, ..)| *of == Some(term));
                let changes =
                    mine.map(|(_, delta, column)| *delta * column.vector[row] * sizes[row]);
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

    /// Newton's method for all numbers: F may depend on parameters in any way, and a factor of a term is one of what else is changed in it.
    fn refine(&self, trial: &mut Trial) {
        let residual = self.residual;
        let entries: Option<Vec<&Entry>> = trial
            .of
            .iter()
            .map(|k| self.columns[*k].entry.as_ref())
            .collect();
        let Some(entries) = entries else { return };
        let terms = residual.terms.len();
        for _ in 0..MOST_STEPS {
            let (mut parameters, mut factors) = (residual.parameters.clone(), vec![1.0; terms]);
            for (entry, delta) in entries.iter().zip(&trial.deltas) {
                match entry.change {
                    Change::Parameter { parameter } => parameters[parameter] += delta,
                    Change::Factor { term } => factors[term] += delta,
                    _ => {}
                }
            }
            let at = |entry: &Entry, factors: &[f64]| entry.vector(residual, &parameters, factors);
            let mut vectors: Vec<Vec<f64>> = entries.iter().map(|e| at(e, &factors)).collect();
            let mut rest = residual.with(&parameters);
            for ((entry, delta), vector) in entries.iter().zip(&trial.deltas).zip(&vectors) {
                if !matches!(entry.change, Change::Parameter { .. }) {
                    add(&mut rest, vector, *delta);
                }
            }
            // What a number multiplies besides the form as it was.
            let wholes = || entries.iter().filter(|other| other.change.is_whole());
            for (entry, vector) in entries.iter().zip(&mut vectors) {
                match entry.change {
                    Change::Factor { term } => {
                        let mut only = vec![0.0; terms];
                        only[term] = 1.0;
                        wholes().for_each(|other| add(vector, &at(other, &only), 1.0));
                    }
                    Change::Parameter { parameter } => wholes().for_each(|other| {
                        let slope = other.slope(residual, parameter, &parameters, &factors);
                        add(vector, &slope, 1.0);
                    }),
                    _ => {}
                }
            }
            let rest: Vec<f64> = self.scaled(&rest).iter().map(|r| -r).collect();
            let vectors: Vec<Vec<f64>> = vectors.iter().map(|d| self.scaled(d)).collect();
            trial.left = largest(&rest);
            if !(trial.left > self.rounding) {
                return;
            }
            // Changes without a number have none to be refined.
            let open: Vec<usize> = (0..entries.len())
                .filter(|k| !entries[*k].change.is_whole())
                .collect();
            let right = open.iter().map(|k| dot(&vectors[*k], &rest)).collect();
            let products = |k: &usize| {
                open.iter()
                    .map(|l| dot(&vectors[*k], &vectors[*l]))
                    .collect()
            };
            let more = solved(open.iter().map(products).collect(), right);
            for (k, more) in open.iter().zip(more) {
                trial.deltas[*k] += more;
            }
        }
    }

    /// Over the sizes of rows.
    fn scaled(&self, values: &[f64]) -> Vec<f64> {
        scaled(self.residual, values)
    }

    fn causes(&self, trial: &Trial) -> Vec<Cause> {
        let each = trial.of.iter().zip(&trial.deltas).map(|(k, delta)| {
            let change = self.change(*k).clone();
            let factor = match &change {
                Change::Parameter { parameter } => self.residual.parameters[*parameter] + delta,
                Change::Mass { .. } | Change::Varying { .. } | Change::Slope { .. } => *delta,
                change if change.is_whole() => 1.0,
                _ => 1.0 + delta,
            };
            Cause { change, factor }
        });
        let mut all: Vec<Cause> = each.collect();
        all.sort_by_key(|cause| rank(std::slice::from_ref(cause)));
        all
    }

    /// The best changes alone, in order: what is left by squares.
    fn best(&self, singles: &[Trial], count: usize) -> Vec<usize> {
        let mut order: Vec<(f64, usize)> = singles
            .iter()
            .map(|trial| (norm(&self.rest(trial)), trial.of[0]))
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        order.into_iter().map(|(_, k)| k).take(count).collect()
    }

    /// The pairs that leave least.
    fn pairs(&self, singles: &[Trial]) -> Vec<Trial> {
        let best = self.best(singles, PAIRED);
        let b: Vec<f64> = best
            .iter()
            .map(|k| dot(&self.columns[*k].vector, self.b))
            .collect();
        let rows = parallel::map(best.iter().enumerate(), |(i, k)| {
            let of = best[..i].iter().enumerate().filter_map(|(j, l)| {
                let [c, d] = [&self.columns[*k], &self.columns[*l]];
                let both = dot(&c.vector, &d.vector);
                let determinant = c.square * d.square - both * both;
                // Two that are parallel are one.
                if determinant <= 1e-12 * c.square * d.square {
                    return None;
                }
                let explained =
                    b[i] * b[i] * d.square - 2.0 * b[i] * b[j] * both + b[j] * b[j] * c.square;
                Some((explained / determinant, [*k, *l]))
            });
            of.collect::<Vec<_>>()
        });
        let mut rows: Vec<(f64, [usize; 2])> = rows.into_iter().flatten().collect();
        rows.sort_by(|a, b| b.0.total_cmp(&a.0));
        let closely = rows.into_iter().take(CLOSELY);
        closely.map(|(_, pair)| self.fit(pair.to_vec())).collect()
    }

    /// From each of the best changes on, the one that helps most is added.
    fn greedy(&self, singles: &[Trial]) -> Vec<Trial> {
        let mut found = Vec::new();
        for first in self.best(singles, CLOSELY) {
            let mut trial = self.fit(vec![first]);
            while trial.of.len() < MOST && trial.left > self.rounding {
                let rest = self.rest(&trial);
                let gain = |k: &usize| {
                    let column = &self.columns[*k];
                    dot(&column.vector, &rest).powi(2) / column.square
                };
                let others = (0..self.columns.len()).filter(|k| !trial.of.contains(k));
                let Some(next) = others.max_by(|a, b| gain(a).total_cmp(&gain(b))) else {
                    break;
                };
                let mut of = trial.of.clone();
                of.push(next);
                trial = self.fit(of);
            }
            found.push(trial);
        }
        found
    }
}

/// Over the sizes of rows.
pub fn scaled(residual: &Residual<'_>, values: &[f64]) -> Vec<f64> {
    let all = values.iter().zip(&residual.sizes);
    all.map(|(r, size)| if *size > 0.0 { r / size } else { 0.0 })
        .collect()
}

fn norm(x: &[f64]) -> f64 {
    dot(x, x).sqrt()
}

/// Solves a small symmetric system by elimination with pivots on the diagonal; 0 for what is not determined.
fn solved(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    let size: Vec<f64> = (0..n).map(|k| a[k][k]).collect();
    let mut order = Vec::new();
    for _ in 0..n {
        let open = (0..n).filter(|k| !order.contains(k) && a[*k][*k] > 1e-14 * size[*k]);
        let Some(k) = open.max_by(|i, j| (a[*i][*i] / size[*i]).total_cmp(&(a[*j][*j] / size[*j])))
        else {
            break;
        };
        order.push(k);
        for i in (0..n).filter(|i| !order.contains(i)) {
            let factor = a[i][k] / a[k][k];
            for j in 0..n {
                a[i][j] -= factor * a[k][j];
            }
            b[i] -= factor * b[k];
        }
    }
    let mut x = vec![0.0; n];
    for k in order.iter().rev() {
        let others: f64 = (0..n).filter(|j| j != k).map(|j| a[*k][j] * x[j]).sum();
        x[*k] = (b[*k] - others) / a[*k][*k];
    }
    x
}
