//! Sparse matrices by rows, for everything that only multiplies.

use rayon::prelude::*;

use super::Symmetric;

/// A matrix in compressed sparse rows; the columns of a row come in any order, once each.
#[derive(Debug, Clone, PartialEq)]
pub struct Csr {
    columns: usize,
    /// One more than there are rows: positions in `indices` and `values`.
    starts: Vec<usize>,
    /// The columns of the entries.
    indices: Vec<u32>,
    values: Vec<f64>,
}

/// Rows that one task takes: many tasks for every core, and few enough that a task is worth it.
const CHUNK: usize = 8192;

impl Csr {
    /// A matrix without rows so far.
    pub fn empty(columns: usize) -> Self {
        Csr {
            columns,
            starts: vec![0],
            indices: Vec::new(),
            values: Vec::new(),
        }
    }

    /// Adds a row below; entries of one column are summed.
    pub fn push(&mut self, entries: impl IntoIterator<Item = (u32, f64)>) {
        let start = self.indices.len();
        for (column, value) in entries {
            match self.indices[start..].iter().position(|&c| c == column) {
                Some(k) => self.values[start + k] += value,
                None => {
                    self.indices.push(column);
                    self.values.push(value);
                }
            }
        }
        self.starts.push(self.indices.len());
    }

    /// How many rows it has.
    pub fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// How many columns it has.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Stored entries.
    pub fn entries(&self) -> usize {
        self.indices.len()
    }

    /// The columns and values of a row.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let range = self.starts[i]..self.starts[i + 1];
        let indices = self.indices[range.clone()].iter().copied();
        indices.zip(self.values[range].iter().copied())
    }

    /// The columns of a row, ascending.
    pub fn row_columns(&self, i: usize) -> &[u32] {
        &self.indices[self.starts[i]..self.starts[i + 1]]
    }

    /// The values of a row, in the order of its columns.
    pub fn row_values_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.values[self.starts[i]..self.starts[i + 1]]
    }

    fn dot(&self, i: usize, x: &[f64]) -> f64 {
        self.row(i).map(|(j, a)| a * x[j as usize]).sum()
    }

    /// y = A x
    pub fn times(&self, x: &[f64], y: &mut [f64]) {
        self.by_rows(y, |i, _| self.dot(i, x));
    }

    /// r = b - A x
    pub fn residual(&self, b: &[f64], x: &[f64], r: &mut [f64]) {
        self.by_rows(r, |i, _| b[i] - self.dot(i, x));
    }

    /// (b - A x)_i
    pub fn rest(&self, i: usize, b: &[f64], x: &[f64]) -> f64 {
        b[i] - self.dot(i, x)
    }

    /// y += A x
    pub fn add_times(&self, x: &[f64], y: &mut [f64]) {
        self.by_rows(y, |i, y| y + self.dot(i, x));
    }

    /// Writes each entry from its row and what it was. Rows do not depend on each other, so the result is the same on any number of cores.
    fn by_rows(&self, y: &mut [f64], value: impl Fn(usize, f64) -> f64 + Sync) {
        y.par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(chunk, part)| {
                for (k, y) in part.iter_mut().enumerate() {
                    *y = value(chunk * CHUNK + k, *y);
                }
            });
    }

    /// The largest Σ_j |a_ij|.
    pub fn norm(&self) -> f64 {
        (0..self.rows())
            .map(|i| self.row(i).map(|(_, a)| a.abs()).sum())
            .fold(0.0, f64::max)
    }

    /// a_ii, 0 where there is none.
    pub fn diagonal(&self) -> Vec<f64> {
        (0..self.rows())
            .map(|i| {
                let mut row = self.row(i);
                row.find(|&(j, _)| j as usize == i).map_or(0.0, |(_, a)| a)
            })
            .collect()
    }

    /// The transpose.
    pub fn transpose(&self) -> Csr {
        let mut starts = vec![0usize; self.columns + 1];
        for &j in &self.indices {
            starts[j as usize + 1] += 1;
        }
        for j in 0..self.columns {
            starts[j + 1] += starts[j];
        }
        let mut next = starts.clone();
        let mut indices = vec![0; self.indices.len()];
        let mut values = vec![0.0; self.values.len()];
        for i in 0..self.rows() {
            for (j, a) in self.row(i) {
                let place = &mut next[j as usize];
                indices[*place] = i as u32;
                values[*place] = a;
                *place += 1;
            }
        }
        Csr {
            columns: self.rows(),
            starts,
            indices,
            values,
        }
    }

    /// A B, row by row (F. G. Gustavson, ACM Trans. Math. Softw. 4, 1978).
    pub fn product(&self, other: &Csr) -> Csr {
        let mut result = Csr::empty(other.columns);
        let mut place = vec![usize::MAX; other.columns];
        for i in 0..self.rows() {
            let start = result.indices.len();
            for (k, a) in self.row(i) {
                for (j, b) in other.row(k as usize) {
                    let at = &mut place[j as usize];
                    // Places of earlier rows lie before `start`, or are not set.
                    if *at >= start && *at < result.indices.len() {
                        result.values[*at] += a * b;
                    } else {
                        *at = result.indices.len();
                        result.indices.push(j);
                        result.values.push(a * b);
                    }
                }
            }
            result.starts.push(result.indices.len());
        }
        result
    }

    /// One sweep x_i += (b - A x)_i / a_ii, forwards or backwards.
    pub fn gauss_seidel(&self, inverse_diagonal: &[f64], b: &[f64], x: &mut [f64], sweep: Sweep) {
        let mut relax = |i: usize| x[i] += inverse_diagonal[i] * (b[i] - self.dot(i, x));
        match sweep {
            Sweep::Forward => (0..self.rows()).for_each(&mut relax),
            Sweep::Backward => (0..self.rows()).rev().for_each(&mut relax),
        }
    }

    /// The forward sweep from x = 0, which needs the entries left of the diagonal only.
    pub fn gauss_seidel_from_zero(&self, inverse_diagonal: &[f64], b: &[f64], x: &mut [f64]) {
        for i in 0..self.rows() {
            let left = self.row(i).filter(|&(j, _)| (j as usize) < i);
            let known: f64 = left.map(|(j, a)| a * x[j as usize]).sum();
            x[i] = inverse_diagonal[i] * (b[i] - known);
        }
    }
}

/// The order in which a sweep takes the rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sweep {
    Forward,
    Backward,
}

impl From<&Symmetric> for Csr {
    /// Both halves.
    fn from(matrix: &Symmetric) -> Self {
        let n = matrix.n;
        let lower = |mut visit: Box<dyn FnMut(usize, usize, f64) + '_>| {
            for j in 0..n {
                for k in matrix.starts[j] as usize..matrix.starts[j + 1] as usize {
                    visit(matrix.rows[k] as usize, j, matrix.values[k]);
                }
            }
        };
        let mut starts = vec![0usize; n + 1];
        lower(Box::new(|i, j, _| {
            starts[i + 1] += 1;
            starts[j + 1] += usize::from(i != j);
        }));
        for k in 0..n {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let mut indices = vec![0; starts[n]];
        let mut values = vec![0.0; starts[n]];
        let mut put = |i: usize, j: usize, a: f64| {
            indices[next[i]] = j as u32;
            values[next[i]] = a;
            next[i] += 1;
        };
        lower(Box::new(|i, j, a| {
            put(i, j, a);
            if i != j {
                put(j, i, a);
            }
        }));
        Csr {
            columns: n,
            starts,
            indices,
            values,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(columns: usize, dense: &[&[f64]]) -> Csr {
        let mut rows = Csr::empty(columns);
        for row in dense {
            rows.push((0..).zip(row.iter().copied()).filter(|(_, a)| *a != 0.0));
        }
        rows
    }

    #[test]
    fn products_transposes_and_sums() {
        let a = rows(3, &[&[1.0, 2.0, 0.0], &[0.0, 0.0, 3.0]]);
        let b = rows(2, &[&[1.0, 0.0], &[4.0, 5.0], &[0.0, 6.0]]);
        let ab = a.product(&b);
        let mut y = [0.0; 2];
        ab.times(&[1.0, 10.0], &mut y);
        assert_eq!(y, [9.0 + 100.0, 180.0]);
        assert_eq!(a.transpose().transpose(), a);
        let mut r = [0.0; 3];
        a.transpose()
            .residual(&[1.0, 1.0, 1.0], &[1.0, 2.0], &mut r);
        assert_eq!(r, [0.0, -1.0, -5.0]);
        let mut twice = Csr::empty(2);
        twice.push([(1, 2.0), (0, 1.0), (1, 3.0)]);
        assert_eq!(twice.row(0).collect::<Vec<_>>(), [(1, 5.0), (0, 1.0)]);
    }

    #[test]
    fn sweeps_are_those_of_the_triangles() {
        let matrix = Symmetric {
            n: 3,
            starts: vec![0, 2, 4, 5],
            rows: vec![0, 1, 1, 2, 2],
            values: vec![4.0, -1.0, 4.0, -1.0, 2.0],
        };
        let a = Csr::from(&matrix);
        let inverse: Vec<f64> = a.diagonal().iter().map(|d| 1.0 / d).collect();
        let b = [4.0, 8.0, 2.0];
        let mut x = [7.0; 3];
        a.gauss_seidel_from_zero(&inverse, &b, &mut x);
        assert_eq!(x, [1.0, 2.25, 2.125]);
        let mut same = [0.0; 3];
        a.gauss_seidel(&inverse, &b, &mut same, Sweep::Forward);
        assert_eq!(same, x);
        let mut back = [0.0; 3];
        a.gauss_seidel(&inverse, &b, &mut back, Sweep::Backward);
        assert_eq!(back, [1.5625, 2.25, 1.0]);
    }
}
