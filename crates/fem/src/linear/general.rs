//! Factorisation of any square sparse matrix: Cholesky's by faer where it is symmetric and positive definite, else Gauss' with pivots in the
//! fronts of a nested dissection ([`super::lu`]).
//!
//! Rows and columns are scaled by powers of two first, so that units do not matter. An answer is refined, and counts only if it solves the
//! system; a matrix whose condition number leaves no digit is called singular.

use std::sync::Arc;

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{MatMut, Side};

use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::parallel;

use super::dissection::groups;
use super::lu::SchurLu;
use super::lu_plan::LuPlan;
use super::schur::Schur;

/// Condition numbers beyond this leave no digit.
const LARGEST_CONDITION: f64 = 1e15;
/// Differences of entries below this fraction of the larger are rounding.
const ROUNDING: f64 = 1e-12;
/// A backward error beyond this is not a solution.
const LARGEST_ERROR: f64 = 1e-8;
/// Refinement takes no more steps than this.
const MOST_STEPS: usize = 5;

/// A factored matrix.
pub struct General {
    /// By rows, scaled.
    starts: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
    /// Powers of two by which rows and columns are multiplied.
    scales: Vec<f64>,
    factor: Factor,
}

enum Factor {
    Cholesky(SymbolicLlt<usize>, Llt<usize, f64>),
    Gauss(Arc<LuPlan>, SchurLu),
}

fn refuse(what: impl Into<String>) -> Error {
    Error::Solver {
        what: what.into(),
        remedy: "fix what the equations leave free".into(),
    }
}

impl General {
    /// Factors a matrix given by its rows, whose columns ascend.
    ///
    /// `places` are where the unknowns are, for the order of elimination; unknowns beyond them, such as multipliers, come last. The order and the
    /// memory of an `old` matrix with entries at the same places are used again.
    ///
    /// # Errors
    /// A matrix that is singular, or memory that is not there.
    pub fn new(
        rows: Vec<Vec<(usize, f64)>>,
        places: &[[f64; 3]],
        old: Option<General>,
    ) -> Result<Self> {
        let n = rows.len();
        let mut largest = vec![0.0_f64; n];
        for (i, row) in rows.iter().enumerate() {
            for (j, value) in row {
                largest[i] = largest[i].max(value.abs());
                largest[*j] = largest[*j].max(value.abs());
            }
        }
        if let Some(k) = largest.iter().position(|x| *x == 0.0) {
            return Err(refuse(format!(
                "the matrix is singular: equation {k} of {n} is empty"
            )));
        }
        // Even powers, so that the diagonal is near 1.
        let scales: Vec<f64> = largest
            .iter()
            .map(|x| (-0.5 * x.log2()).round().exp2())
            .collect();
        let (mut starts, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
        for (i, row) in rows.into_iter().enumerate() {
            for (j, value) in row {
                columns.push(j);
                values.push(value * scales[i] * scales[j]);
            }
            starts.push(columns.len());
        }
        let old = old.filter(|old| old.starts == starts && old.columns == columns);
        let old = old.map(|old| old.factor);
        let factor = match is_symmetric(&starts, &columns, &values) {
            true => cholesky(&starts, &columns, &values, old.as_ref()),
            false => None,
        };
        let factor = factor.unwrap_or_else(|| gauss(&starts, &columns, &values, places, old));
        let general = General {
            starts,
            columns,
            values,
            scales,
            factor,
        };
        general.check_condition()?;
        Ok(general)
    }

    /// Solves once for a right-hand side without a pattern: its solution is as large as the inverse, but for bad luck.
    fn check_condition(&self) -> Result<()> {
        let n = self.scales.len();
        // Where all values are given there is nothing to solve.
        if n == 0 {
            return Ok(());
        }
        let mut x: Vec<f64> = (0..n)
            .map(|k| ((k as f64 + 1.0) * 0.754_877_666).fract() - 0.5)
            .collect();
        let size = largest(&x);
        self.apply(&mut x);
        let norm = (0..n)
            .map(|i| self.row(i).map(|(_, a)| a.abs()).sum::<f64>())
            .fold(0.0, f64::max);
        let condition = norm * largest(&x) / size;
        match condition < LARGEST_CONDITION {
            true => Ok(()),
            false => Err(refuse("the matrix is singular to working precision")),
        }
    }

    fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> {
        let range = self.starts[i]..self.starts[i + 1];
        let columns = self.columns[range.clone()].iter().copied();
        columns.zip(self.values[range].iter().copied())
    }

    /// The scaled system, in place.
    fn apply(&self, x: &mut [f64]) {
        let n = x.len();
        let x = MatMut::from_column_major_slice_mut(x, n, 1);
        match &self.factor {
            Factor::Cholesky(_, factor) => factor.solve_in_place(x),
            Factor::Gauss(_, factor) => factor.solve_in_place(x),
        }
    }

    /// Solves A x = b.
    ///
    /// # Errors
    /// A solution that does not solve, as where the matrix is singular.
    pub fn solve(&self, b: &[f64]) -> Result<Vec<f64>> {
        let b: Vec<f64> = b.iter().zip(&self.scales).map(|(b, s)| b * s).collect();
        let mut x = b.clone();
        self.apply(&mut x);
        let residual = |x: &[f64]| {
            parallel::collect(x.len(), |i| {
                let (mut sum, mut size) = (b[i], b[i].abs());
                for (j, a) in self.row(i) {
                    sum -= a * x[j];
                    size += (a * x[j]).abs();
                }
                [sum, size]
            })
        };
        let error = |left: &[[f64; 2]]| {
            let [error, size] =
                [0, 1].map(|k| left.iter().fold(0.0_f64, |most, r| most.max(r[k].abs())));
            if size > 0.0 { error / size } else { 0.0 }
        };
        let mut left = residual(&x);
        // Pivots in fronts may lose digits, which come back.
        for step in 0..MOST_STEPS {
            let mut correction: Vec<f64> = left.iter().map(|r| r[0]).collect();
            self.apply(&mut correction);
            let next: Vec<f64> = x.iter().zip(&correction).map(|(x, d)| x + d).collect();
            let after = residual(&next);
            let is_better = error(&after) < 0.5 * error(&left);
            if is_better || step == 0 {
                (x, left) = (next, after);
            }
            if !is_better {
                break;
            }
        }
        if !(error(&left) <= LARGEST_ERROR) {
            return Err(refuse("the matrix is singular: what solves it does not"));
        }
        Ok(x.iter().zip(&self.scales).map(|(x, s)| x * s).collect())
    }

    /// Whether it is factorised as symmetric and positive definite.
    pub fn is_definite(&self) -> bool {
        matches!(self.factor, Factor::Cholesky(..))
    }
}

/// None if the matrix is not positive definite.
fn cholesky(
    starts: &[usize],
    columns: &[usize],
    values: &[f64],
    old: Option<&Factor>,
) -> Option<Factor> {
    let n = starts.len() - 1;
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, starts, None, columns);
    let symbolic = match old {
        Some(Factor::Cholesky(symbolic, _)) => symbolic.clone(),
        _ => SymbolicLlt::try_new(pattern, Side::Lower).ok()?,
    };
    let matrix = SparseColMatRef::new(pattern, values);
    let factor = Llt::try_new_with_symbolic(symbolic.clone(), matrix, Side::Lower).ok()?;
    Some(Factor::Cholesky(symbolic, factor))
}

fn gauss(
    starts: &[usize],
    columns: &[usize],
    values: &[f64],
    places: &[[f64; 3]],
    old: Option<Factor>,
) -> Factor {
    let entries = (0..starts.len() - 1).flat_map(|i| {
        let range = starts[i]..starts[i + 1];
        let of_row = columns[range.clone()].iter().zip(&values[range]);
        of_row.map(move |(j, value)| (i as u32, *j as u32, *value))
    });
    let (plan, old) = match old {
        Some(Factor::Gauss(plan, old)) => (plan, Some(old)),
        _ => {
            let groups = groups(starts, columns, places);
            let ties = entries.clone().map(|(i, j, _)| [i, j]);
            let ties = ties.filter(|[i, j]| i != j);
            let plan = LuPlan::new(groups, std::iter::empty(), ties);
            (Arc::new(plan), None)
        }
    };
    let kept = (0..starts.len() as u32 - 1).collect();
    let schur = Schur::new(kept, Vec::new(), entries.collect(), Arc::clone(&plan));
    Factor::Gauss(plan, SchurLu::new(&schur, &[], old))
}

fn largest(v: &[f64]) -> f64 {
    v.iter()
        .fold(0.0, |most, x| if x.abs() <= most { most } else { x.abs() })
}

/// Whether every a_ij = a_ji up to rounding, with a positive diagonal.
fn is_symmetric(starts: &[usize], columns: &[usize], values: &[f64]) -> bool {
    let n = starts.len() - 1;
    let at = |i: usize, j: usize| {
        let row = starts[i]..starts[i + 1];
        let found = columns[row.clone()].binary_search(&j).ok()?;
        Some(values[row.start + found])
    };
    let is_row = |i: usize| {
        let is_diagonal = at(i, i).is_some_and(|a| a > 0.0);
        is_diagonal
            && (starts[i]..starts[i + 1]).all(|k| {
                let (j, a) = (columns[k], values[k]);
                j <= i
                    || at(j, i)
                        .is_some_and(|b| (a - b).abs() <= ROUNDING * (1.0 + a.abs().max(b.abs())))
            })
    };
    // Entries below the diagonal that have no partner above it are counted.
    let (mut below, mut above) = (0, 0);
    for i in 0..n {
        for j in &columns[starts[i]..starts[i + 1]] {
            below += usize::from(*j < i);
            above += usize::from(*j > i);
        }
    }
    below == above && parallel::collect(n, is_row).into_iter().all(|is| is)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (A x)_i of a tridiagonal matrix, whose solution is known.
    fn rows(n: usize, lower: f64, upper: f64, shift: f64) -> Vec<Vec<(usize, f64)>> {
        let row = |i: usize| {
            let mut row = Vec::new();
            if i > 0 {
                row.push((i - 1, lower));
            }
            row.push((i, 2.0 + shift));
            if i + 1 < n {
                row.push((i + 1, upper));
            }
            row
        };
        (0..n).map(row).collect()
    }

    fn line(n: usize) -> Vec<[f64; 3]> {
        (0..n).map(|k| [k as f64, 0.0, 0.0]).collect()
    }

    #[test]
    fn symmetric_or_not_systems_are_solved() {
        for (lower, upper) in [(-1.0, -1.0), (-1.5, -0.5), (3.0, 3.0)] {
            let x: Vec<f64> = (0..50).map(|k| f64::from(k).sin()).collect();
            let rows = rows(50, lower, upper, 0.25);
            let b: Vec<f64> = rows
                .iter()
                .map(|r| r.iter().map(|(j, a)| a * x[*j]).sum())
                .collect();
            let factor = General::new(rows, &line(50), None).unwrap();
            assert_eq!(factor.is_definite(), lower == -1.0);
            for (x, y) in x.iter().zip(factor.solve(&b).unwrap()) {
                assert!((x - y).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn singular_matrices_are_refused() {
        // Rows that sum to 0.
        let mut free = rows(40, -1.0, -1.0, 0.0);
        (free[0][0].1, free[39][1].1) = (1.0, 1.0);
        assert!(General::new(free, &line(40), None).is_err());
        let mut skew = rows(40, -1.5, -0.5, 0.0);
        (skew[0][0].1, skew[39][1].1) = (0.5, 1.5);
        assert!(General::new(skew, &line(40), None).is_err());
        assert!(General::new(vec![vec![(0, 1.0)], vec![]], &[], None).is_err());
    }

    #[test]
    fn zeros_on_the_diagonal_are_no_obstacle() {
        // Laplace's matrix on a grid, every third value given by a multiplier at its place; and only couples far from each other.
        let n = 30;
        let given: Vec<usize> = (0..n * n).step_by(3).collect();
        let mut places: Vec<[f64; 3]> = (0..n * n)
            .map(|k| [(k % n) as f64, (k / n) as f64, 0.0])
            .collect();
        places.extend(given.iter().map(|k| places[*k]).collect::<Vec<_>>());
        let mut saddle: Vec<Vec<(usize, f64)>> = vec![Vec::new(); places.len()];
        for k in 0..n * n {
            let (x, y) = (k % n, k / n);
            saddle[k].push((k, 4.0));
            let near = [(x > 0, k.wrapping_sub(1)), (x + 1 < n, k + 1)];
            let far = [(y > 0, k.wrapping_sub(n)), (y + 1 < n, k + n)];
            let there = near.into_iter().chain(far).filter(|near| near.0);
            saddle[k].extend(there.map(|(_, j)| (j, -1.0)));
        }
        for (m, k) in given.iter().enumerate() {
            saddle[n * n + m].push((*k, 1.0));
            saddle[*k].push((n * n + m, 1.0));
        }
        let couples = (0..200).map(|k| vec![(199 - k, 1.0 + k as f64)]).collect();
        for (mut rows, places) in [(saddle, places), (couples, line(200))] {
            rows.iter_mut().for_each(|row| row.sort_by_key(|e| e.0));
            let x: Vec<f64> = (0..rows.len()).map(|k| (k as f64).cos()).collect();
            let dot = |row: &Vec<(usize, f64)>| row.iter().map(|(j, a)| a * x[*j]).sum();
            let b: Vec<f64> = rows.iter().map(dot).collect();
            let first = General::new(rows.clone(), &places, None).unwrap();
            assert!(!first.is_definite());
            // In the order and the memory of the first.
            let again = General::new(rows, &places, Some(first)).unwrap();
            for (x, y) in x.iter().zip(again.solve(&b).unwrap()) {
                assert!((x - y).abs() < 1e-11, "{x} and {y}");
            }
        }
    }
}
