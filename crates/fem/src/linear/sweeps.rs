//! Sweeps of Gauss and Seidel within blocks of rows, which do not wait for each other: the smoother of a preconditioner.
//!
//! ```text
//! forward, from x = 0:  (D + L) x = b,  and what is left, b - A x = -(O + U) x
//! backward:             (D + U) x' = b - (L + O) x,  and the product, A x' = b + (L + O) (x' - x)
//! ```
//!
//! D is the diagonal, L and U are the entries of a block before and after it, O those of other blocks. What a sweep leaves and the
//! product with what it gives take half the entries (S. C. Eisenstat, SIAM J. Sci. Stat. Comput. 2, 1981). A backward sweep
//! is the transpose of a forward one, so that a cycle with both is symmetric.
//!
//! Sweeps read the entries rounded to f32, at half the bytes, and a diagonal that preserves the row sums:
//! xᵀAx so is off by rounding of Σ |a_ij| (x_i - x_j)², whatever the condition of A. The product is that of this matrix.

use std::ops::Range;

use super::csr::{Csr, split};
use faceoff_mesh::parallel;

/// Blocks are this part of the rows, and not smaller than a task is worth.
const BLOCKS: usize = 16;
const SMALLEST: usize = 1 << 13;
/// Parts of rows with this many entries are summed side by side.
const LONG: usize = 8;
/// Rows that a task looks at.
const ROWS: usize = 1 << 12;

/// A matrix with its rows in the order of sweeps, and the sweeps.
pub struct Sweeps {
    /// In each row L, D, O and U one after the other.
    matrix: Csr,
    /// Columns and values of L, O and U, over a power of two and rounded, row by row.
    entries: Vec<(u32, f32)>,
    unit: f64,
    /// Where L, O and U of each row end among these, behind where the first row begins.
    ends: Vec<[u32; 3]>,
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
                j if j < first || j >= first + block => 2,
                j if j < i => 0,
                j if j == i => 1,
                _ => 3,
            }
        };
        let mut ends = vec![[0; 3]; rows + 1];
        let chunks = ends[1..].chunks_mut(ROWS).enumerate();
        // The largest diagonal, and the rows that are in another order.
        let found: Vec<(f64, Vec<usize>)> = parallel::map(chunks, |(chunk, ends)| {
            let (mut largest, mut unsorted) = (0.0, Vec::new());
            for (i, ends) in (chunk * ROWS..).zip(ends) {
                let (mut counts, mut last, mut sorted) = ([0; 4], 0, true);
                for (j, a) in matrix.row(i) {
                    let class = class(i, j);
                    counts[class] += 1;
                    sorted &= last <= class;
                    last = class;
                    if class == 1 {
                        largest = f64::max(largest, a.abs());
                    }
                }
                if !sorted {
                    unsorted.push(i);
                }
                // Each row before this one has a diagonal that is left out.
                let first = matrix.places(i).start - i;
                let [before, _, others, after] = counts;
                let lengths = [before, before + others, before + others + after];
                *ends = lengths.map(|length| (first + length) as u32);
            }
            (largest, unsorted)
        });
        let largest = found
            .iter()
            .fold(0.0, |m: f64, (of_chunk, _)| m.max(*of_chunk));
        for i in found.into_iter().flat_map(|(_, unsorted)| unsorted) {
            matrix.sort_row_by_key(i, |j| class(i, j));
        }
        let mut sweeps = Sweeps {
            unit: power_of_two(largest),
            entries: vec![(0, 0.0); matrix.entries() - rows],
            inverse: vec![0.0; rows],
            matrix,
            ends,
            block,
        };
        sweeps.round();
        sweeps
    }

    /// Where L, O and U of a row are.
    #[inline]
    fn parts(&self, i: usize) -> [Range<usize>; 3] {
        let [start, before, others, after] = [
            self.ends[i][2],
            self.ends[i + 1][0],
            self.ends[i + 1][1],
            self.ends[i + 1][2],
        ]
        .map(|k| k as usize);
        [start..before, before..others, others..after]
    }

    /// Rounds all rows.
    fn round(&mut self) {
        let (matrix, unit, ends) = (&self.matrix, self.unit, &self.ends);
        let of_tasks = ends[1..].chunks(ROWS);
        let ends_of_tasks = of_tasks.map(|ends| ends[ends.len() - 1][2] as usize);
        let tasks = split(&mut self.entries, ends_of_tasks);
        let tasks = self.inverse.chunks_mut(ROWS).zip(tasks).enumerate();
        parallel::map(tasks, |(task, (inverse, mut entries))| {
            for (i, inverse) in (task * ROWS..).zip(inverse) {
                let (own, others) = entries.split_at_mut((ends[i + 1][2] - ends[i][2]) as usize);
                entries = others;
                *inverse = rounded(matrix, unit, i, own);
            }
        });
    }

    /// Takes the `changed` rows anew; `still` ones are not swept.
    pub fn set(&mut self, changed: impl Iterator<Item = u32>, still: &[u32]) {
        for row in changed.map(|row| row as usize) {
            let [before, _, after] = self.parts(row);
            let own = &mut self.entries[before.start..after.end];
            self.inverse[row] = rounded(&self.matrix, self.unit, row, own);
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

    /// Σ a_ij x_j over some entries of a row, where x begins at the column `first`.
    #[inline(always)]
    fn dot(&self, part: Range<usize>, x: &[f64], first: usize) -> f64 {
        let term = |&(j, a): &(u32, f32)| f64::from(a) * x[j as usize - first];
        let entries = &self.entries[part];
        if entries.len() < LONG {
            return self.unit * entries.iter().map(term).sum::<f64>();
        }
        // Four sums side by side, as each waits for the last addition.
        let (fours, rest) = entries.as_chunks::<4>();
        let mut sums = [0.0; 4];
        for four in fours {
            for (sum, entry) in sums.iter_mut().zip(four) {
                *sum += term(entry);
            }
        }
        let [a, b, c, d] = sums;
        let rest: f64 = rest.iter().map(term).sum();
        self.unit * (rest + ((a + b) + (c + d)))
    }

    /// Bytes of one pass over it with `vectors`, each once.
    fn bytes(&self, vectors: usize) -> usize {
        let rows = self.inverse.len();
        size_of_val(&self.entries[..]) + size_of_val(&self.ends[..]) + (1 + vectors) * 8 * rows
    }

    /// x from a forward sweep, and `rest` = b - A x.
    pub fn forward(&self, b: &[f64], x: &mut [f64], rest: &mut [f64]) {
        let (bytes, flops) = (self.bytes(3), 2 * self.matrix.entries());
        let _span = tracing::debug_span!("sweeps", bytes, flops).entered();
        let blocks = x.chunks_mut(self.block).zip(rest.chunks_mut(self.block));
        parallel::map(blocks.enumerate(), |(block, (x, rest))| {
            let first = block * self.block;
            for k in 0..x.len() {
                let i = first + k;
                let [before, ..] = self.parts(i);
                let left = b[i] - self.dot(before, x, first);
                x[k] = self.inverse[i] * left;
                rest[k] = if self.inverse[i] == 0.0 { left } else { 0.0 };
            }
        });
        let x = &*x;
        parallel::update(rest, |i, rest| {
            let [_, others, after] = self.parts(i);
            rest - self.dot(others.start..after.end, x, 0)
        });
    }

    /// x from a backward sweep that starts at `old`.
    pub fn backward(&self, b: &[f64], old: &[f64], x: &mut [f64]) {
        let (bytes, flops) = (self.bytes(3), 2 * self.matrix.entries());
        let _span = tracing::debug_span!("sweeps", bytes, flops).entered();
        parallel::map(x.chunks_mut(self.block).enumerate(), |(block, x)| {
            let first = block * self.block;
            for k in (0..x.len()).rev() {
                let i = first + k;
                if self.inverse[i] == 0.0 {
                    x[k] = old[i];
                    continue;
                }
                let [before, others, after] = self.parts(i);
                let of_old = self.dot(before.start..others.end, old, 0);
                let of_new = self.dot(after, x, first);
                x[k] = self.inverse[i] * (b[i] - of_old - of_new);
            }
        });
    }

    /// y = A x for the x of a backward sweep with b from `old`, which becomes the change.
    pub fn product(&self, b: &[f64], x: &[f64], old: &mut [f64], y: &mut [f64]) {
        // Half of the entries.
        let entries = self.matrix.entries();
        let (bytes, flops) = (self.bytes(4) - 4 * entries, entries);
        let _span = tracing::debug_span!("sweeps", bytes, flops).entered();
        parallel::map(old.chunks_mut(ROWS).zip(x.chunks(ROWS)), |(old, x)| {
            old.iter_mut().zip(x).for_each(|(old, x)| *old = x - *old);
        });
        let change = &*old;
        parallel::update(y, |i, _| {
            if self.inverse[i] == 0.0 {
                return self.matrix.dot(i, x);
            }
            let [before, others, _] = self.parts(i);
            b[i] + self.dot(before.start..others.end, change, 0)
        });
    }
}

/// A power of two of the size of a number; 1 if it is not finite.
fn power_of_two(size: f64) -> f64 {
    let power = f64::from_bits(size.to_bits() & f64::INFINITY.to_bits());
    if power.is_normal() { power } else { 1.0 }
}

/// Rounds the off-diagonal entries of a row; returns the inverse of a diagonal with which their sum is what it was.
fn rounded(matrix: &Csr, unit: f64, row: usize, narrow: &mut [(u32, f32)]) -> f64 {
    let (mut diagonal, mut off, mut places) = (0.0, 0.0, narrow.iter_mut());
    for (j, a) in matrix.row(row) {
        if j as usize == row {
            diagonal = a;
        } else if let Some(place) = places.next() {
            *place = (j, (a / unit) as f32);
            off += a - unit * f64::from(place.1);
        }
    }
    if diagonal == 0.0 {
        0.0
    } else {
        1.0 / (diagonal + off)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 47;
    const BLOCK: usize = 29;

    /// Not symmetric, with a row that is not swept; in numbers of f32.
    fn sweeps() -> Sweeps {
        let mut matrix = Csr::empty(N);
        for i in 0..N {
            // Every third row has parts that are summed side by side.
            let in_step = |j: usize| (i * 5 + j * 3).is_multiple_of(4);
            let is_near = |j: usize| in_step(j) || i.is_multiple_of(3) || j == i;
            let near = (0..N).filter(|j| is_near(*j));
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
                let [before, _, after] = sweeps.parts(i);
                let rest = sweeps.dot(before.start..after.end, &[1.0; 3], 0);
                let sum = 1.0 / sweeps.inverse[i] + rest;
                assert!(sum.abs() < 1e-15 * unit, "{unit} {i}: {sum}");
                for (j, a) in &sweeps.entries[before.start..after.end] {
                    let narrow = sweeps.unit * f64::from(*a);
                    let off = narrow / at(&sweeps, i, *j as usize) - 1.0;
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

        let mut start = std::mem::replace(&mut x, vec![7.0; N]);
        sweeps.backward(&b, &start, &mut x);
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
        sweeps.product(&b, &x, &mut start, &mut y);
        sweeps.matrix().times(&x, &mut product);
        assert_close(&y, &product);
    }
}
