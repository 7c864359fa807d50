//! Sparse matrices by rows, for everything that only multiplies.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use super::Elements;
use super::kernels::Number;
use faceoff_mesh::counting::sort_by_key;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::parallel;

/// A matrix in compressed sparse rows; the columns of a row come in any order, once each.
#[derive(Debug, Clone, PartialEq)]
pub struct Csr<T = f64> {
    columns: usize,
    /// One more than there are rows: positions in `indices` and `values`.
    starts: Vec<usize>,
    /// The columns of the entries.
    indices: Vec<u32>,
    values: Vec<T>,
}

/// Entries that are less than this of √(a_ii a_jj) are rounding: faces at right angles have no tie.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Rows that one task takes: many tasks for every core, and few enough that a task is worth it.
const CHUNK: usize = 8192;

/// Room for this many entries per row saves most of the copies that growing takes; unused room costs nothing.
const USUAL: usize = 8;

impl Csr {
    /// The sum of elements. Unknowns without a number are left out, and so are ties that are rounding, but in rows that are `whole`.
    ///
    /// # Errors
    /// More unknowns of elements than 32 bits count.
    pub fn sum(
        elements: &impl Elements,
        number: &[Option<u32>],
        whole: impl Fn(usize) -> bool + Sync,
    ) -> Result<Self> {
        let (size, count) = (elements.size(), elements.count());
        if u32::try_from(count * size).is_err() {
            return Err(Error::Solver {
                what: format!("{count} elements are too many for a matrix of rows"),
                remedy: "use --linear multifrontal, which never puts it together".into(),
            });
        }
        let n = number.iter().flatten().count();
        // The places in elements that each row is the sum of, ascending: first how many are in each part of the elements.
        let part = count.div_ceil(rayon::current_num_threads().min(8)).max(1);
        let rows_of = |k: usize| {
            let elements = (k * part..count.min((k + 1) * part)).map(|e| (e, elements.of(e)));
            elements.flat_map(|(e, unknowns)| {
                let rows = unknowns.iter().enumerate();
                rows.filter_map(move |(j, k)| Some(((e * size + j) as u32, number[*k as usize]?)))
            })
        };
        let mut next = parallel::map(0..count.div_ceil(part), |k| {
            let mut counts = vec![0; n];
            rows_of(k).for_each(|(_, row)| counts[row as usize] += 1);
            counts
        });
        let mut starts = vec![0u32; n + 1];
        for row in 0..n {
            let mut start = starts[row];
            for next in &mut next {
                let count = std::mem::replace(&mut next[row], start);
                start += count;
            }
            starts[row + 1] = start;
        }
        let places: Vec<AtomicU32> = (0..starts[n]).map(|_| AtomicU32::new(0)).collect();
        parallel::map(next.into_iter().enumerate(), |(k, mut next)| {
            for (place, row) in rows_of(k) {
                let at = &mut next[row as usize];
                places[*at as usize].store(place, Ordering::Relaxed);
                *at += 1;
            }
        });
        let places = &places;
        let of_row = |row: usize| {
            let places = places[starts[row] as usize..starts[row + 1] as usize].iter();
            places.map(|place| {
                let place = place.load(Ordering::Relaxed) as usize;
                (place / size, place % size)
            })
        };
        let mut diagonal = vec![0.0; n];
        parallel::map(diagonal.chunks_mut(CHUNK).enumerate(), |(k, diagonal)| {
            let mut values = vec![0.0; size];
            for (row, diagonal) in (k * CHUNK..).zip(diagonal) {
                for (element, local) in of_row(row) {
                    elements.row(element, local, &mut values);
                    *diagonal += values[local];
                }
            }
        });
        let scratch = || (vec![0.0; size], Sums::new(n));
        Ok(Csr::by_chunks(
            n,
            n,
            scratch,
            |(values, sums), rows, part| {
                for row in rows {
                    for (element, local) in of_row(row) {
                        elements.row(element, local, values);
                        for (&j, a) in elements.of(element).iter().zip(&*values) {
                            if let Some(j) = number[j as usize] {
                                sums.add(j, *a);
                            }
                        }
                    }
                    let is_whole = whole(row);
                    let is_tie = |&(j, a): &(u32, f64)| {
                        let size = (diagonal[row] * diagonal[j as usize]).abs().sqrt();
                        is_whole || j as usize == row || !(a.abs() <= ROUNDING * size)
                    };
                    let entries = sums.entries();
                    entries.sort_unstable_by_key(|entry| entry.0);
                    part.end_row(entries.iter().copied().filter(is_tie));
                    sums.clear();
                }
            },
        ))
    }

    /// The rows and columns that have a number; the numbers ascend.
    pub fn submatrix(&self, number: &[Option<u32>]) -> Self {
        let rows: Vec<usize> = (0..self.rows()).filter(|&i| number[i].is_some()).collect();
        Csr::by_chunks(
            rows.len(),
            rows.len(),
            || (),
            |(), chunk, part| {
                for &i in &rows[chunk] {
                    let entries = self.row(i);
                    part.end_row(entries.filter_map(|(j, a)| Some((number[j as usize]?, a))));
                }
            },
        )
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

    /// The columns of a row.
    pub fn row_columns(&self, i: usize) -> &[u32] {
        &self.indices[self.starts[i]..self.starts[i + 1]]
    }

    /// The values of a row, in the order of its columns.
    pub fn row_values(&self, i: usize) -> &[f64] {
        &self.values[self.places(i)]
    }

    /// The same, to be changed.
    pub fn row_values_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.values[self.starts[i]..self.starts[i + 1]]
    }

    /// a_ij, 0 if there is none.
    fn at(&self, i: usize, j: u32) -> f64 {
        let mut row = self.row(i);
        row.find(|&(column, _)| column == j).map_or(0.0, |(_, a)| a)
    }

    /// Orders a row; entries of one key stay as they were.
    pub fn sort_row_by_key<K: Ord>(&mut self, i: usize, key: impl Fn(u32) -> K) {
        let range = self.starts[i]..self.starts[i + 1];
        if self.indices[range.clone()].is_sorted_by_key(|&j| key(j)) {
            return;
        }
        let mut row: Vec<(u32, f64)> = self.row(i).collect();
        row.sort_by_key(|&(j, _)| key(j));
        for (k, (j, a)) in range.zip(row) {
            (self.indices[k], self.values[k]) = (j, a);
        }
    }

    /// Its values rounded, for a preconditioner.
    pub fn narrow(self) -> Csr<f32> {
        let mut values = vec![0.0; self.values.len()];
        parallel::update(&mut values, |k, _| self.values[k] as f32);
        Csr {
            columns: self.columns,
            starts: self.starts,
            indices: self.indices,
            values,
        }
    }

    /// Where the entries of a row are among `values`.
    pub fn places(&self, i: usize) -> Range<usize> {
        self.starts[i]..self.starts[i + 1]
    }

    /// The largest Σ_j |a_ij|.
    pub fn norm(&self) -> f64 {
        let sum = |i| self.row(i).map(|(_, a)| a.abs()).sum();
        let sums = parallel::collect(self.rows(), sum);
        sums.into_iter().fold(0.0, f64::max)
    }

    /// a_ii, 0 if there is none.
    pub fn diagonal(&self) -> Vec<f64> {
        parallel::collect(self.rows(), |i| self.at(i, i as u32))
    }
}

/// The parts of a slice that end there.
pub fn split<T>(mut all: &mut [T], ends: impl Iterator<Item = usize>) -> Vec<&mut [T]> {
    let mut start = 0;
    ends.map(|end| {
        let (own, others) = std::mem::take(&mut all).split_at_mut(end - start);
        (all, start) = (others, end);
        own
    })
    .collect()
}

/// A row that is summed up, by column in the order in which these come.
struct Sums {
    /// One more than the place among `entries` of each column that has one.
    place: Vec<u32>,
    entries: Vec<(u32, f64)>,
}

impl Sums {
    fn new(columns: usize) -> Self {
        Sums {
            place: vec![0; columns],
            entries: Vec::new(),
        }
    }

    #[inline]
    fn add(&mut self, column: u32, value: f64) {
        let place = &mut self.place[column as usize];
        if *place == 0 {
            self.entries.push((column, value));
            *place = self.entries.len() as u32;
        } else {
            self.entries[*place as usize - 1].1 += value;
        }
    }

    fn entries(&mut self) -> &mut [(u32, f64)] {
        &mut self.entries
    }

    /// For the next row.
    fn clear(&mut self) {
        for (column, _) in self.entries.drain(..) {
            self.place[column as usize] = 0;
        }
    }
}

impl<T: Number> Csr<T> {
    /// A matrix without rows so far.
    pub fn empty(columns: usize) -> Self {
        Csr {
            columns,
            starts: vec![0],
            indices: Vec::new(),
            values: Vec::new(),
        }
    }

    /// Rows that `fill` adds to parts of the matrix, side by side, each with `scratch` that is used again.
    pub fn by_chunks<Scratch: Send>(
        rows: usize,
        columns: usize,
        scratch: impl Fn() -> Scratch + Sync,
        fill: impl Fn(&mut Scratch, Range<usize>, &mut Self) + Sync,
    ) -> Self {
        let firsts = (0..rows).step_by(CHUNK);
        let parts: Vec<Self> = parallel::map_with(scratch, firsts, |scratch, first| {
            let rows = first..(first + CHUNK).min(rows);
            let mut part = Self::empty(columns);
            part.starts.reserve(rows.len());
            part.indices.reserve(USUAL * rows.len());
            part.values.reserve(USUAL * rows.len());
            fill(scratch, rows, &mut part);
            part
        });
        let ends: Vec<usize> = parts
            .iter()
            .scan(0, |end, part| {
                *end += part.entries();
                Some(*end)
            })
            .collect();
        let entries = ends.last().copied().unwrap_or(0);
        let mut matrix = Csr {
            starts: vec![0; rows + 1],
            indices: vec![0; entries],
            values: vec![T::ZERO; entries],
            ..Self::empty(columns)
        };
        let starts = matrix.starts[1..].chunks_mut(CHUNK);
        let indices = split(&mut matrix.indices, ends.iter().copied());
        let values = split(&mut matrix.values, ends.iter().copied());
        let tasks = parts.into_iter().zip(&ends).zip(starts);
        let tasks = tasks.zip(indices.into_iter().zip(values));
        parallel::map(tasks, |(((part, end), starts), (indices, values))| {
            let first = end - part.entries();
            for (start, end) in starts.iter_mut().zip(&part.starts[1..]) {
                *start = first + end;
            }
            indices.copy_from_slice(&part.indices);
            values.copy_from_slice(&part.values);
        });
        matrix
    }

    /// Adds a row below, whose entries have different columns.
    pub fn end_row(&mut self, entries: impl IntoIterator<Item = (u32, f64)>) {
        for (column, value) in entries {
            self.indices.push(column);
            self.values.push(T::of(value));
        }
        self.starts.push(self.indices.len());
    }

    /// The columns and values of a row.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (u32, T)> + '_ {
        let range = self.starts[i]..self.starts[i + 1];
        let indices = self.indices[range.clone()].iter().copied();
        indices.zip(self.values[range].iter().copied())
    }

    /// How many rows it has.
    pub fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// How many columns it has.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The bytes that one pass over it reads.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.starts[..])
            + size_of_val(&self.indices[..])
            + size_of_val(&self.values[..])
    }

    /// Stored entries.
    pub fn entries(&self) -> usize {
        self.indices.len()
    }

    /// The transpose.
    pub fn transpose(&self) -> Self {
        let (starts, places) = sort_by_key(&self.indices, self.columns);
        let mut row_of = vec![0; self.indices.len()];
        let ends = self.starts[1..].chunks(CHUNK);
        let tasks = split(&mut row_of, ends.clone().map(|ends| ends[ends.len() - 1]));
        let tasks = tasks.into_iter().zip(ends).enumerate();
        parallel::map(tasks, |(chunk, (own, ends))| {
            let (mut first, before) = (0, self.starts[chunk * CHUNK]);
            for (i, end) in (chunk * CHUNK..).zip(ends) {
                own[first..end - before].fill(i as u32);
                first = end - before;
            }
        });
        let mut indices = vec![0; places.len()];
        parallel::update(&mut indices, |k, _| row_of[places[k] as usize]);
        let mut values = vec![T::ZERO; places.len()];
        parallel::update(&mut values, |k, _| self.values[places[k] as usize]);
        Csr {
            columns: self.rows(),
            starts,
            indices,
            values,
        }
    }

    /// A B, row by row (F. G. Gustavson, ACM Trans. Math. Softw. 4, 1978).
    pub fn product(&self, other: &Csr) -> Csr {
        let scratch = || Sums::new(other.columns);
        Csr::by_chunks(self.rows(), other.columns, scratch, |sums, rows, part| {
            for i in rows {
                for (k, a) in self.row(i) {
                    for (j, b) in other.row(k as usize) {
                        sums.add(j, a.wide() * b);
                    }
                }
                part.end_row(sums.entries().iter().copied());
                sums.clear();
            }
        })
    }

    /// Σ_j a_ij x_j
    #[inline(always)]
    pub fn dot(&self, i: usize, x: &[f64]) -> f64 {
        let range = self.starts[i]..self.starts[i + 1];
        let entries = self.indices[range.clone()].iter().zip(&self.values[range]);
        entries.map(|(&j, a)| a.wide() * x[j as usize]).sum()
    }

    /// y = A x
    pub fn times(&self, x: &[f64], y: &mut [f64]) {
        parallel::update(y, |i, _| self.dot(i, x));
    }

    /// r = b - A x
    pub fn residual(&self, b: &[f64], x: &[f64], r: &mut [f64]) {
        parallel::update(r, |i, _| b[i] - self.dot(i, x));
    }

    /// (b - A x)_i
    pub fn rest(&self, i: usize, b: &[f64], x: &[f64]) -> f64 {
        b[i] - self.dot(i, x)
    }

    /// y += A x
    pub fn add_times(&self, x: &[f64], y: &mut [f64]) {
        parallel::update(y, |i, y| y + self.dot(i, x));
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

    /// With rows for several tasks, some of them empty.
    #[test]
    fn long_matrices_are_put_together_transposed_and_multiplied() {
        const ROWS: usize = 2 * CHUNK + 77;
        const COLUMNS: usize = 1000;
        let entries = |i: usize| {
            let count = i % 4;
            (0..count).map(move |k| (((i * 7 + k * 331) % COLUMNS) as u32, (i + k) as f64))
        };
        let matrix: Csr = Csr::by_chunks(
            ROWS,
            COLUMNS,
            || (),
            |(), rows, part| rows.for_each(|i| part.end_row(entries(i))),
        );
        assert_eq!((matrix.rows(), matrix.columns()), (ROWS, COLUMNS));
        for i in 0..ROWS {
            assert!(matrix.row(i).eq(entries(i)), "row {i}");
        }
        let transpose = matrix.transpose();
        assert_eq!(transpose.entries(), matrix.entries());
        for j in 0..COLUMNS {
            for (i, a) in transpose.row(j) {
                assert_eq!(matrix.at(i as usize, j as u32), a, "{i} {j}");
            }
        }
        // (AᵀA) x = Aᵀ(A x), in integers.
        let x: Vec<f64> = (0..COLUMNS).map(|j| (j % 3) as f64).collect();
        let (mut ax, mut expected, mut found) =
            (vec![0.0; ROWS], vec![0.0; COLUMNS], vec![0.0; COLUMNS]);
        matrix.times(&x, &mut ax);
        transpose.times(&ax, &mut expected);
        transpose.product(&matrix).times(&x, &mut found);
        assert_eq!(found, expected);
    }

    /// Elements whose sum has ties that cancel, unknowns without a number, and rows that keep everything.
    #[test]
    fn a_sum_of_elements_leaves_out_what_is_rounding() {
        struct Pairs;
        impl Elements for Pairs {
            fn unknowns(&self) -> usize {
                3
            }
            fn count(&self) -> usize {
                2
            }
            fn size(&self) -> usize {
                3
            }
            fn of(&self, element: usize) -> &[u32] {
                [&[0, 1, 2], &[2, 1, 3]][element]
            }
            fn centre(&self, _: usize) -> [f64; 3] {
                [0.0; 3]
            }
            fn matrix(&self, element: usize, matrix: &mut [f64]) {
                // Between 1 and 2, 0.1 + 0.2 - 0.3 is left.
                let tie = [0.1 + 0.2, -0.3][element];
                let [near, far] = [[-0.5, tie], [tie, -0.5]][element];
                let entries = match element {
                    0 => [1.0, near, 1e-17, near, 1.0, far, 1e-17, far, 1.0],
                    _ => [1.0, near, far, near, 1.0, 0.25, far, 0.25, 1.0],
                };
                matrix.copy_from_slice(&entries);
            }
        }
        let number = [Some(1), Some(0), Some(2), None];
        let rows = |whole: fn(usize) -> bool| {
            let sum = Csr::sum(&Pairs, &number, whole).unwrap();
            (0..3)
                .map(|i| sum.row(i).collect::<Vec<_>>())
                .collect::<Vec<_>>()
        };
        let tie = 0.1 + 0.2 - 0.3;
        assert!(tie > 0.0);
        assert_eq!(
            rows(|_| false),
            [
                vec![(0, 2.0), (1, -0.5)],
                vec![(0, -0.5), (1, 1.0)],
                vec![(2, 2.0)]
            ]
        );
        assert_eq!(rows(|row| row == 2)[2], [(0, tie), (1, 1e-17), (2, 2.0)]);
    }
}
