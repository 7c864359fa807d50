//! Sparse matrices by rows.

use faceoff_mesh::parallel;
use rayon::prelude::*;

/// A square sparse matrix in compressed rows, whose columns ascend.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    start: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl Matrix {
    /// From entries in any order; those at the same position are added in the order in which they come.
    pub fn new(count: usize, entries: Vec<(u32, u32, f64)>) -> Self {
        let mut start = vec![0usize; count + 1];
        entries
            .iter()
            .for_each(|(row, ..)| start[*row as usize + 1] += 1);
        (0..count).for_each(|row| start[row + 1] += start[row]);
        let mut next = start.clone();
        let mut sorted = vec![(0u32, 0.0f64); entries.len()];
        for (row, column, value) in entries {
            let at = &mut next[row as usize];
            sorted[*at] = (column, value);
            *at += 1;
        }
        let mut rest = &mut sorted[..];
        let mut rows = Vec::with_capacity(count);
        for row in 0..count {
            let (own, others) = rest.split_at_mut(start[row + 1] - start[row]);
            rows.push(own);
            rest = others;
        }
        rows.par_iter_mut()
            .for_each(|row| row.sort_by_key(|(column, _)| *column));
        drop(rows);
        let mut all = Matrix {
            start: Vec::with_capacity(count + 1),
            columns: Vec::with_capacity(sorted.len()),
            values: Vec::with_capacity(sorted.len()),
        };
        all.start.push(0);
        for row in 0..count {
            let first = all.columns.len();
            for &(column, value) in &sorted[start[row]..start[row + 1]] {
                match all.columns[first..].last() {
                    Some(last) if *last == column => {
                        *all.values.last_mut().expect("as long as the columns") += value
                    }
                    _ => {
                        all.columns.push(column);
                        all.values.push(value);
                    }
                }
            }
            all.start.push(all.columns.len());
        }
        all
    }

    /// The number of rows, and of columns.
    pub fn count(&self) -> usize {
        self.start.len() - 1
    }

    /// The columns and values of a row.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, f64)> + Clone + '_ {
        let at = self.start[row]..self.start[row + 1];
        let columns = self.columns[at.clone()].iter().map(|c| *c as usize);
        columns.zip(self.values[at].iter().copied())
    }

    /// The entry of a row and column, 0 where there is none.
    pub fn entry(&self, row: usize, column: usize) -> f64 {
        let at = self.start[row]..self.start[row + 1];
        let found = self.columns[at.clone()].binary_search(&(column as u32));
        found.map_or(0.0, |k| self.values[at.start + k])
    }

    /// The product with a vector, and for each row the sum of the absolute values of its terms.
    pub fn times(&self, x: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let both = parallel::collect(self.count(), |row| {
            let terms = self.row(row).map(|(column, a)| a * x[column]);
            terms.fold((0.0, 0.0), |(sum, size), term| {
                (sum + term, size + term.abs())
            })
        });
        both.into_iter().unzip()
    }

    /// The matrix of the same equations for the dofs x' = scale x, of which dof k gets the number `to[k]` among `count`.
    pub fn renumbered(&self, count: usize, to: &[u32], scale: &[f64]) -> Matrix {
        let mut from = vec![None; count];
        to.iter()
            .enumerate()
            .for_each(|(k, to)| from[*to as usize] = Some(k));
        let rows = parallel::collect(count, |row| {
            let Some(old) = from[row] else {
                return Vec::new();
            };
            let moved = self
                .row(old)
                .map(|(column, a)| (to[column], a / (scale[old] * scale[column])));
            let mut moved: Vec<(u32, f64)> = moved.collect();
            moved.sort_unstable_by_key(|(column, _)| *column);
            moved
        });
        let mut all = Matrix {
            start: vec![0],
            columns: Vec::with_capacity(self.columns.len()),
            values: Vec::with_capacity(self.columns.len()),
        };
        for row in rows {
            all.columns.extend(row.iter().map(|(column, _)| *column));
            all.values.extend(row.iter().map(|(_, a)| *a));
            all.start.push(all.columns.len());
        }
        all
    }
}
