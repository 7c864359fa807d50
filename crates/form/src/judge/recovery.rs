//! Finds the fewest changes of a scheme that explain a residual.
//!
//! With b = -F(u; ·) and the vectors d_k of the changes, relative to the sizes of rows, b = Σ δ_k d_k is solved for few nonzero δ_k: first with
//! single changes, then with pairs, then by adding the one that reduces the residual most (orthogonal matching pursuit: Y. Pati, R. Rezaiifar,
//! P. Krishnaprasad, Asilomar 1993). A change counts as the cause only if it leaves rounding in all rows.

use faceoff_mesh::parallel;

pub use super::residual::largest;
use super::residual::{add, dot, norm};

/// A candidate leaves at most this fraction of the largest row.
const CONTRAST: f64 = 1e-2;
/// The number of changes that are tried in pairs.
const PAIRED: usize = 120;
/// The number of pairs, and of changes in addition to one, that are examined closely.
const CLOSELY: usize = 24;
/// The most steps of Newton's method for the numbers of changes, which begins if at most this fraction of the largest row is left.
const MOST_STEPS: usize = 12;
const NEAR: f64 = 0.3;
/// It continues while each step leaves at most this fraction of the residual of the one before.
const SLOW: f64 = 0.7;
/// The relative step of finite differences.
const STEP: f64 = 1e-4;
/// A number is replaced by a simple one, such as -1, if it is this near.
const PLAIN: f64 = 1e-6;
/// Three changes or more whose rank is beyond this can explain anything.
pub const PLAINEST: usize = 5;

/// A scheme with a residual, and the changes to try.
pub trait Scheme {
    /// The contribution of each change to the rows.
    fn columns(&self) -> &[Column];

    /// b with all of these changes, each with its number; `None` if only the vector of one of them is known.
    fn left(&self, changes: &[(usize, f64)]) -> Option<Vec<f64>>;

    /// Is the effect of these changes together not the sum of their effects, or not a multiple of the number?
    fn is_curved(&self, of: &[usize]) -> bool;

    /// The complexity of a change: among those that explain the same, the smallest counts.
    fn rank(&self, change: usize, number: f64) -> usize;

    /// Are these changes admissible as a cause?
    fn is_sound(&self, trial: &Trial) -> bool;
}

/// The contribution of a change to the rows, relative to their sizes.
#[derive(Debug, Clone)]
pub struct Column {
    /// For each row; for a change with a number, the contribution for the number 1, or by a unit of it if it is 0.
    pub vector: Vec<f64>,
    /// vector · vector
    pub square: f64,
    /// Is it a change without a number?
    pub is_whole: bool,
    /// The scale of its number.
    pub size: f64,
    /// Simple numbers, which replace one that is near.
    pub plain: &'static [f64],
    /// Further initial guesses for Newton's method if least squares fail; with them a step is at most twice the size.
    pub starts: &'static [f64],
}

/// Some changes, their numbers, and the largest remaining row.
#[derive(Debug, Clone)]
pub struct Trial {
    /// By their positions.
    pub of: Vec<usize>,
    /// In the same order.
    pub deltas: Vec<f64>,
    /// Relative to the size of the row.
    pub left: f64,
}

/// The result of the search.
#[derive(Debug)]
pub struct Recovered {
    /// Those that leave rounding, the simplest first.
    pub exact: Vec<Trial>,
    /// Each single change, with the number that leaves least.
    pub singles: Vec<Trial>,
}

impl Column {
    /// For a change without a number.
    pub fn whole(vector: Vec<f64>) -> Self {
        Column {
            is_whole: true,
            ..Column::number(vector, 1.0)
        }
    }

    /// For a change with a number of this size.
    pub fn number(vector: Vec<f64>, size: f64) -> Self {
        Column {
            square: dot(&vector, &vector),
            vector,
            is_whole: false,
            size,
            plain: &[],
            starts: &[],
        }
    }
}

/// Finds the fewest changes, up to a number of them, that leave no more than rounding of b.
pub fn recover(scheme: &dyn Scheme, b: &[f64], rounding: f64, most: usize) -> Recovered {
    let search = Search {
        scheme,
        columns: scheme.columns(),
        rounding: rounding.min(CONTRAST * largest(b)),
        b,
    };
    let singles: Vec<Trial> = (0..search.columns.len())
        .map(|k| search.fit(vec![k]))
        .collect();
    let mut exact = search.exact(&singles);
    if exact.is_empty() {
        exact = search.exact(&search.pairs(&singles));
    }
    if exact.is_empty() && most > 2 {
        exact = search.exact(&search.greedy(&singles, most));
    }
    let is_plain = |trial: &Trial| trial.rank(scheme) <= 10 * trial.of.len() + PLAINEST;
    exact.retain(|trial| trial.of.len() < 3 || is_plain(trial));
    exact.sort_by_key(|trial| trial.rank(scheme));
    Recovered { exact, singles }
}

impl Trial {
    /// The order of explanations with the same remainder: few changes before many, then simple ones before complex ones.
    pub fn rank(&self, scheme: &dyn Scheme) -> usize {
        let each = self.of.iter().zip(&self.deltas);
        let each = each.map(|(k, delta)| scheme.rank(*k, *delta));
        10 * self.of.len() + each.max().unwrap_or(0)
    }

    fn changes(&self) -> Vec<(usize, f64)> {
        let all = self.of.iter().copied().zip(self.deltas.iter().copied());
        all.collect()
    }
}

struct Search<'a> {
    scheme: &'a dyn Scheme,
    columns: &'a [Column],
    rounding: f64,
    b: &'a [f64],
}

impl Search<'_> {
    /// The δ with the least sum of squares.
    fn fit(&self, of: Vec<usize>) -> Trial {
        let vectors: Vec<&[f64]> = of.iter().map(|k| &*self.columns[*k].vector).collect();
        let (deltas, left) = fitted(&vectors, self.b);
        Trial { of, deltas, left }
    }

    fn rest(&self, trial: &Trial) -> Vec<f64> {
        let mut rest = self.b.to_vec();
        for (k, delta) in trial.of.iter().zip(&trial.deltas) {
            let all = rest.iter_mut().zip(&self.columns[*k].vector);
            all.for_each(|(rest, d)| *rest -= delta * d);
        }
        rest
    }

    /// Those trials that leave rounding, after the numbers of changes without one are removed and all others are solved for exactly.
    fn exact(&self, trials: &[Trial]) -> Vec<Trial> {
        let near = trials.iter().flat_map(|trial| {
            let is_near = trial.left <= NEAR * largest(self.b);
            let is_one = trial.left <= self.rounding || is_near && self.scheme.is_curved(&trial.of);
            let starts: &[f64] = match trial.of[..] {
                [k] if !is_one => self.columns[k].starts,
                _ => &[],
            };
            let others = starts.iter().map(|start| Trial {
                deltas: vec![*start],
                ..trial.clone()
            });
            is_one.then(|| trial.clone()).into_iter().chain(others)
        });
        let settled = near.filter_map(|trial| {
            let mut trial = trial.clone();
            self.settle(&mut trial);
            trial.left = largest(&self.rest(&trial));
            if trial.left > self.rounding || self.scheme.is_curved(&trial.of) {
                self.refine(&mut trial);
                self.settle(&mut trial);
            }
            let is_exact = trial.left <= self.rounding;
            (is_exact && self.is_used(&trial) && self.scheme.is_sound(&trial)).then_some(trial)
        });
        settled.collect()
    }

    /// Removes the numbers of changes without one, and rounds numbers to simple ones if they are near.
    fn settle(&self, trial: &mut Trial) {
        for (k, delta) in trial.of.iter().zip(&mut trial.deltas) {
            let column = &self.columns[*k];
            let mut plain = column.plain.iter().copied();
            *delta = match column.is_whole {
                true => 1.0,
                false => plain.find(|n| (*delta - n).abs() < PLAIN).unwrap_or(*delta),
            };
        }
    }

    /// Does each change have an effect, and are there more equations to explain than numbers to choose?
    fn is_used(&self, trial: &Trial) -> bool {
        let each = trial.of.iter().zip(&trial.deltas);
        let mut sizes = each.map(|(k, delta)| delta.abs() * largest(&self.columns[*k].vector));
        let numbers = trial.of.iter().filter(|k| !self.columns[**k].is_whole);
        let failing = self.b.iter().filter(|b| b.abs() > self.rounding).count();
        failing > numbers.count() && sizes.all(|size| size > 10.0 * self.rounding)
    }

    /// Newton's method for all numbers, with differences, since a scheme may depend on them in any way. One step beyond rounding gives them
    /// their full precision.
    fn refine(&self, trial: &mut Trial) {
        let open = (0..trial.of.len()).filter(|k| !self.columns[trial.of[*k]].is_whole);
        let open: Vec<usize> = open.collect();
        let (mut before, mut good) = (f64::INFINITY, None);
        for step in 0..MOST_STEPS {
            let Some(rest) = self.scheme.left(&trial.changes()) else {
                return;
            };
            trial.left = largest(&rest);
            let is_good = trial.left <= self.rounding;
            if let Some(before) = good.take() {
                if !is_good {
                    *trial = before;
                }
                return;
            }
            let is_done = is_good && step == 0;
            if is_done || open.is_empty() || !(trial.left <= SLOW * before) {
                return;
            }
            good = is_good.then(|| trial.clone());
            before = trial.left;
            let slope = |k: &usize| {
                let size = self.columns[trial.of[*k]].size;
                let at = |by: f64| {
                    let mut changes = trial.changes();
                    changes[*k].1 += by * size;
                    self.scheme.left(&changes)
                };
                let (high, low) = (at(STEP)?, at(-STEP)?);
                let both = low.iter().zip(&high);
                Some(
                    both.map(|(low, high)| (low - high) / (2.0 * STEP * size))
                        .collect(),
                )
            };
            let vectors: Option<Vec<Vec<f64>>> = open.iter().map(slope).collect();
            let Some(vectors) = vectors else { return };
            let right = vectors.iter().map(|d| dot(d, &rest)).collect();
            let products = |d: &Vec<f64>| vectors.iter().map(|e| dot(d, e)).collect();
            let more = solved(vectors.iter().map(products).collect(), right);
            for (k, more) in open.iter().zip(more) {
                let column = &self.columns[trial.of[*k]];
                let most = if column.starts.is_empty() {
                    f64::INFINITY
                } else {
                    2.0 * column.size
                };
                trial.deltas[*k] += more.clamp(-most, most);
            }
        }
    }

    /// The best single changes, ordered by the sum of squares that they leave.
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
                // Two parallel ones count as one.
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

    /// To each of the best changes, the one that reduces the residual most is added.
    fn greedy(&self, singles: &[Trial], most: usize) -> Vec<Trial> {
        let mut found = Vec::new();
        for first in self.best(singles, CLOSELY) {
            let mut trial = self.fit(vec![first]);
            while trial.of.len() < most && trial.left > self.rounding {
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

/// The multiples of vectors with the least sum of squares, and the largest remaining row.
pub fn fitted(vectors: &[&[f64]], b: &[f64]) -> (Vec<f64>, f64) {
    let mut deltas = vec![0.0; vectors.len()];
    let mut rest = b.to_vec();
    // The second pass corrects the rounding of the first.
    for _ in 0..2 {
        let right = vectors.iter().map(|d| dot(d, &rest)).collect();
        let products = |d: &&[f64]| vectors.iter().map(|e| dot(d, e)).collect();
        let more = solved(vectors.iter().map(products).collect(), right);
        for ((delta, more), vector) in deltas.iter_mut().zip(more).zip(vectors) {
            *delta += more;
            add(&mut rest, vector, -more);
        }
    }
    let left = largest(&rest);
    (deltas, left)
}

/// Solves a small symmetric system by elimination with pivots on the diagonal; undetermined components are 0.
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
