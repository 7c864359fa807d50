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

use rayon::prelude::*;

use super::csr::Csr;

/// Blocks are this part of the rows, and not smaller than a task is worth.
const BLOCKS: usize = 16;
const SMALLEST: usize = 1 << 13;

/// A matrix with its rows in the order of sweeps, and the sweeps.
pub struct Sweeps {
    /// In each row L, D, U and O one after the other.
    matrix: Csr,
    /// Where D and where O begin in each row.
    parts: Vec<[u32; 2]>,
    /// 1/a_ii, or 0 where a row is not swept.
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
        let parts = (0..matrix.rows())
            .map(|i| {
                let first = i / block * block;
                let class = |j: u32| match j as usize {
                    j if j < first || j >= first + block => 3,
                    j if j < i => 0,
                    j if j == i => 1,
                    _ => 2,
                };
                matrix.sort_row_by_key(i, class);
                let columns = matrix.row_columns(i);
                [1, 3].map(|from| columns.partition_point(|&j| class(j) < from) as u32)
            })
            .collect();
        let mut sweeps = Sweeps {
            inverse: Vec::new(),
            matrix,
            parts,
            block,
        };
        sweeps.set(&[]);
        sweeps
    }

    /// Takes the diagonal anew; `still` rows are not swept.
    pub fn set(&mut self, still: &[u32]) {
        let diagonal = self.parts.iter().enumerate();
        let diagonal = diagonal.map(|(i, [own, _])| self.matrix.value(i, *own));
        self.inverse = diagonal
            .map(|d| if d == 0.0 { 0.0 } else { 1.0 / d })
            .collect();
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

    /// x from a forward sweep, and `rest` = b - A x.
    pub fn forward(&self, b: &[f64], x: &mut [f64], rest: &mut [f64]) {
        let blocks = x
            .par_chunks_mut(self.block)
            .zip(rest.par_chunks_mut(self.block));
        blocks.enumerate().for_each(|(block, (x, rest))| {
            let first = block * self.block;
            for k in 0..x.len() {
                let i = first + k;
                let left = b[i] - self.matrix.dot_part(i, 0..self.parts[i][0], &x[..k], first);
                x[k] = self.inverse[i] * left;
                rest[k] = if self.inverse[i] == 0.0 { left } else { 0.0 };
            }
        });
        let x = &*x;
        self.matrix.by_rows(rest, |i, rest| {
            let entries = self.matrix.row_columns(i).len() as u32;
            rest - self.matrix.dot_part(i, self.parts[i][0] + 1..entries, x, 0)
        });
    }

    /// Changes x by a backward sweep; `before` becomes what x was.
    pub fn backward(&self, b: &[f64], x: &mut [f64], before: &mut [f64]) {
        before.copy_from_slice(x);
        let before = &*before;
        x.par_chunks_mut(self.block)
            .enumerate()
            .for_each(|(block, x)| {
                let first = block * self.block;
                for k in (0..x.len()).rev() {
                    let i = first + k;
                    if self.inverse[i] != 0.0 {
                        let entries = self.matrix.row_columns(i).len() as u32;
                        let [_, others] = self.parts[i];
                        let own = self.matrix.dot_part(i, 0..others, x, first);
                        let of_others = self.matrix.dot_part(i, others..entries, before, 0);
                        x[k] += self.inverse[i] * (b[i] - own - of_others);
                    }
                }
            });
    }

    /// y = A x for the x of a backward sweep with b and `before`, which becomes the change.
    pub fn product(&self, b: &[f64], x: &[f64], before: &mut [f64], y: &mut [f64]) {
        before
            .par_iter_mut()
            .zip(x)
            .for_each(|(before, x)| *before = x - *before);
        let change = &*before;
        self.matrix.by_rows(y, |i, _| {
            let entries = self.matrix.row_columns(i).len() as u32;
            let [own, others] = self.parts[i];
            if self.inverse[i] == 0.0 {
                return self.matrix.dot_part(i, 0..entries, x, 0);
            }
            b[i] + self.matrix.dot_part(i, 0..own, change, 0)
                + self.matrix.dot_part(i, others..entries, change, 0)
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 23;
    const BLOCK: usize = 7;

    /// Not symmetric, with a row that is not swept.
    fn sweeps() -> Sweeps {
        let mut matrix = Csr::empty(N);
        for i in 0..N {
            let near = (0..N).filter(|j| (i * 5 + j * 3) % 4 == 0 || *j == i);
            let value = |j: usize| {
                if i == j {
                    9.0
                } else {
                    ((i * 7 + j) as f64).sin()
                }
            };
            matrix.push(near.map(|j| (j as u32, value(j))));
        }
        let mut sweeps = Sweeps::by_blocks(matrix, BLOCK);
        sweeps.set(&[4]);
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
