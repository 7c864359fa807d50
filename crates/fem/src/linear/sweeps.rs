//! Sweeps of Gauss and Seidel within blocks of rows, which do not wait for each other: the smoother of a preconditioner.
//!
//! ```text
//! forward, from x = 0:  (D + L) x = b,  and what is left, b - A x = -(U + O) x
//! backward:             (D + U) x' = b - (L + O) x,  and the product, A x' = b + (L + O) (x' - x)
//! ```
//!
//! D is the diagonal, L and U are the entries of a block before and after it, O those of other blocks. What a sweep leaves and the
//! product with what it gives take half the entries (S. C. Eisenstat, SIAM J. Sci. Stat. Comput. 2, 1981). A backward sweep
//! is the transpose of a forward one, so that a cycle with both is symmetric.
//!
//! What sweeps read are the entries rounded to f32, at half the bytes, and a diagonal that leaves the sums of rows as they were:
//! xᵀAx so is off by rounding of Σ |a_ij| (x_i - x_j)², whatever the condition of A. The product is that of this matrix.

use std::ops::Range;

use rayon::prelude::*;

use super::csr::Csr;

/// Blocks are this part of the rows, and not smaller than a task is worth.
const BLOCKS: usize = 16;
const SMALLEST: usize = 1 << 13;

/// A matrix with its rows in the order of sweeps, and the sweeps.
pub struct Sweeps {
    /// In each row L, D, U and O one after the other.
    matrix: Csr,
    /// Its values over a power of two, rounded; 0 on the diagonal.
    narrow: Vec<f32>,
    unit: f64,
    /// Where D and where O begin in each row.
    parts: Vec<[u32; 2]>,
    /// 1/D, or 0 where a row is not swept.
    inverse: Vec<f64>,
    block: usize,
}

impl Sweeps {
    /// All rows are swept, but those whose diagonal is 0; it is stored in every row.
    pub fn new(matrix: Csr) -> Self {
        let block = matrix.rows().div_ceil(BLOCKS).max(SMALLEST);
        Sweeps::by_blocks(matrix, block)
    }

    fn by_blocks(mut matrix: Csr, block: usize) -> Self {
        let rows = matrix.rows();
        let class = |i: usize, j: u32| {
            let first = i / block * block;
            match j as usize {
                j if j < first || j >= first + block => 3,
                j if j < i => 0,
                j if j == i => 1,
                _ => 2,
            }
        };
        let is_unsorted = |i: &usize| {
            let columns = matrix.row_columns(*i);
            !columns.is_sorted_by_key(|&j| class(*i, j))
        };
        let unsorted: Vec<usize> = (0..rows).into_par_iter().filter(is_unsorted).collect();
        for i in unsorted {
            matrix.sort_row_by_key(i, |j| class(i, j));
        }
        let parts = (0..rows).into_par_iter().map(|i| {
            let columns = matrix.row_columns(i);
            [1, 3].map(|from| columns.partition_point(|&j| class(i, j) < from) as u32)
        });
        let parts: Vec<[u32; 2]> = parts.collect();
        let diagonal = parts.par_iter().enumerate();
        let largest = diagonal
            .map(|(i, [own, _])| matrix.value(i, *own).abs())
            .reduce(|| 0.0, f64::max);
        let mut sweeps = Sweeps {
            narrow: vec![0.0; matrix.entries()],
            inverse: vec![0.0; rows],
            unit: power_of_two(largest),
            matrix,
            parts,
            block,
        };
        sweeps.round();
        sweeps
    }

    /// Rounds all rows.
    fn round(&mut self) {
        const ROWS: usize = 4096;
        let (matrix, unit, parts) = (&self.matrix, self.unit, &self.parts);
        let mut tasks = Vec::with_capacity(self.inverse.len().div_ceil(ROWS));
        let mut rest = &mut self.narrow[..];
        for (task, inverse) in self.inverse.chunks_mut(ROWS).enumerate() {
            let rows = task * ROWS..task * ROWS + inverse.len();
            let entries = matrix.places(rows.end - 1).end - matrix.places(rows.start).start;
            let (own, others) = rest.split_at_mut(entries);
            rest = others;
            tasks.push((rows, inverse, own));
        }
        tasks
            .into_par_iter()
            .for_each(|(rows, inverse, mut narrow)| {
                for (i, inverse) in rows.zip(inverse) {
                    let (own, others) = narrow.split_at_mut(matrix.places(i).len());
                    narrow = others;
                    *inverse = rounded(matrix, unit, i, parts[i][0], own);
                }
            });
    }

    /// Takes the `changed` rows anew; `still` ones are not swept.
    pub fn set(&mut self, changed: impl Iterator<Item = u32>, still: &[u32]) {
        for row in changed.map(|row| row as usize) {
            let own = &mut self.narrow[self.matrix.places(row)];
            self.inverse[row] = rounded(&self.matrix, self.unit, row, self.parts[row][0], own);
        }
        for &row in still {
            self.inverse[row as usize] = 0.0;
        }
    }

    /// The matrix.
    pub fn matrix(&self) -> &Csr {
        &self.matrix
    }

    /// The matrix, whose columns stay where they are; see [`Sweeps::set`].
    pub fn matrix_mut(&mut self) -> &mut Csr {
        &mut self.matrix
    }

    #[inline]
    fn dot(&self, i: usize, part: Range<u32>, x: &[f64], first: usize) -> f64 {
        self.unit * self.matrix.dot_part(&self.narrow, i, part, x, first)
    }

    /// Bytes of one pass over it with `vectors`, each once.
    fn bytes(&self, vectors: usize) -> usize {
        let values = size_of_val(&self.narrow[..]);
        let of_rows = size_of_val(&self.parts[..]) + (1 + vectors) * 8 * self.parts.len();
        self.matrix.bytes() - values + of_rows
    }

    /// x from a forward sweep, and `rest` = b - A x.
    pub fn forward(&self, b: &[f64], x: &mut [f64], rest: &mut [f64]) {
        let (bytes, flops) = (self.bytes(3), 2 * self.matrix.entries());
        let _span = tracing::debug_span!("sweeps", bytes, flops).entered();
        let blocks = x
            .par_chunks_mut(self.block)
            .zip(rest.par_chunks_mut(self.block));
        blocks.enumerate().for_each(|(block, (x, rest))| {
            let first = block * self.block;
            for k in 0..x.len() {
                let i = first + k;
                let left = b[i] - self.dot(i, 0..self.parts[i][0], &x[..k], first);
                x[k] = self.inverse[i] * left;
                rest[k] = if self.inverse[i] == 0.0 { left } else { 0.0 };
            }
        });
        let x = &*x;
        self.matrix.by_rows(rest, |i, rest| {
            let entries = self.matrix.places(i).len() as u32;
            rest - self.dot(i, self.parts[i][0] + 1..entries, x, 0)
        });
    }

    /// Changes x by a backward sweep; `before` becomes what x was.
    pub fn backward(&self, b: &[f64], x: &mut [f64], before: &mut [f64]) {
        let (bytes, flops) = (self.bytes(3), 2 * self.matrix.entries());
        let _span = tracing::debug_span!("sweeps", bytes, flops).entered();
        before.copy_from_slice(x);
        let before = &*before;
        x.par_chunks_mut(self.block)
            .enumerate()
            .for_each(|(block, x)| {
                let first = block * self.block;
                for k in (0..x.len()).rev() {
                    let i = first + k;
                    if self.inverse[i] != 0.0 {
                        let entries = self.matrix.places(i).len() as u32;
                        let [_, others] = self.parts[i];
                        let own = self.dot(i, 0..others, x, first);
                        let of_others = self.dot(i, others..entries, before, 0);
                        x[k] = self.inverse[i] * (b[i] - own - of_others);
                    }
                }
            });
    }

    /// y = A x for the x of a backward sweep with b and `before`, which becomes the change.
    pub fn product(&self, b: &[f64], x: &[f64], before: &mut [f64], y: &mut [f64]) {
        // Half of the entries.
        let entries = self.matrix.entries();
        let (bytes, flops) = (self.bytes(4) - 6 * entries, entries);
        let _span = tracing::debug_span!("sweeps", bytes, flops).entered();
        before
            .par_iter_mut()
            .zip(x)
            .for_each(|(before, x)| *before = x - *before);
        let change = &*before;
        self.matrix.by_rows(y, |i, _| {
            let entries = self.matrix.places(i).len() as u32;
            let [own, others] = self.parts[i];
            if self.inverse[i] == 0.0 {
                return self.matrix.dot(i, x);
            }
            b[i] + self.dot(i, 0..own, change, 0) + self.dot(i, others..entries, change, 0)
        });
    }
}

/// Of the size of a number; 1 where that is none.
fn power_of_two(size: f64) -> f64 {
    let power = f64::from_bits(size.to_bits() & f64::INFINITY.to_bits());
    if power.is_normal() { power } else { 1.0 }
}

/// Rounds the entries of a row beside the diagonal; returns the inverse of a diagonal with which their sum is what it was.
fn rounded(matrix: &Csr, unit: f64, row: usize, own: u32, narrow: &mut [f32]) -> f64 {
    let values = &matrix.row_values(row)[..narrow.len()];
    let mut diagonal = values[own as usize];
    let is_swept = diagonal != 0.0;
    for (k, (narrow, a)) in narrow.iter_mut().zip(values).enumerate() {
        if k == own as usize {
            *narrow = 0.0;
        } else {
            *narrow = (a / unit) as f32;
            diagonal += a - unit * f64::from(*narrow);
        }
    }
    if is_swept { 1.0 / diagonal } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 23;
    const BLOCK: usize = 7;

    /// Not symmetric, with a row that is not swept; in numbers of f32.
    fn sweeps() -> Sweeps {
        let mut matrix = Csr::empty(N);
        for i in 0..N {
            let near = (0..N).filter(|j| (i * 5 + j * 3) % 4 == 0 || *j == i);
            let value = |j: usize| {
                if i == j {
                    9.0
                } else {
                    f64::from(((i * 7 + j) as f32).sin())
                }
            };
            matrix.push(near.map(|j| (j as u32, value(j))));
        }
        let mut sweeps = Sweeps::by_blocks(matrix, BLOCK);
        sweeps.set(0..0, &[4]);
        sweeps
    }

    fn at(sweeps: &Sweeps, i: usize, j: usize) -> f64 {
        let mut row = sweeps.matrix().row(i);
        row.find(|&(k, _)| k as usize == j).map_or(0.0, |(_, a)| a)
    }

    fn assert_close(a: &[f64], b: &[f64]) {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 1e-13, "{a} {b}");
        }
    }

    /// Constants are as near to the kernel of what is swept as to that of the matrix.
    #[test]
    fn rounding_leaves_the_sums_of_rows() {
        for unit in [1e-200, 1.0 / 3.0, 1e200] {
            let mut matrix = Csr::empty(3);
            let [a, b, c] = [0.1, 0.7, 1e-9].map(|a| a * unit);
            matrix.push([(0, a + b), (1, -a), (2, -b)]);
            matrix.push([(0, -a), (1, a + c), (2, -c)]);
            matrix.push([(0, -b), (1, -c), (2, b + c)]);
            let sweeps = Sweeps::new(matrix);
            for i in 0..3 {
                let rest = sweeps.dot(i, 0..3, &[1.0; 3], 0);
                let sum = 1.0 / sweeps.inverse[i] + rest;
                assert!(sum.abs() < 1e-15 * unit, "{unit} {i}: {sum}");
                for k in sweeps.matrix.places(i).filter(|k| sweeps.narrow[*k] != 0.0) {
                    let j = sweeps.matrix.row_columns(i)[k % 3];
                    let narrow = sweeps.unit * f64::from(sweeps.narrow[k]);
                    let off = narrow / at(&sweeps, i, j as usize) - 1.0;
                    assert!(off.abs() < 1e-7, "{unit} {i} {j}: {off}");
                }
            }
        }
    }

    #[test]
    fn sweeps_are_those_of_the_triangles_of_each_block_with_what_they_leave() {
        let sweeps = sweeps();
        let b: Vec<f64> = (0..N).map(|k| (k as f64).cos()).collect();
        let (mut x, mut rest) = (vec![7.0; N], vec![7.0; N]);
        sweeps.forward(&b, &mut x, &mut rest);
        let mut expected = vec![0.0; N];
        for i in (0..N).filter(|i| *i != 4) {
            let own = i / BLOCK * BLOCK..i;
            let known: f64 = own.map(|j| at(&sweeps, i, j) * expected[j]).sum();
            expected[i] = (b[i] - known) / 9.0;
        }
        assert_close(&x, &expected);
        let mut left = vec![0.0; N];
        sweeps.matrix().residual(&b, &x, &mut left);
        assert_close(&rest, &left);

        let mut before = vec![0.0; N];
        let start = x.clone();
        sweeps.backward(&b, &mut x, &mut before);
        assert_eq!(before, start);
        let mut expected = start.clone();
        for i in (0..N).rev().filter(|i| *i != 4) {
            let now = |j: usize| {
                if j / BLOCK == i / BLOCK {
                    expected[j]
                } else {
                    start[j]
                }
            };
            let sum: f64 = (0..N).map(|j| at(&sweeps, i, j) * now(j)).sum();
            expected[i] += (b[i] - sum) / 9.0;
        }
        assert_close(&x, &expected);
        let (mut y, mut product) = (vec![0.0; N], vec![0.0; N]);
        sweeps.product(&b, &x, &mut before, &mut y);
        sweeps.matrix().times(&x, &mut product);
        assert_close(&y, &product);
    }
}
