//! Sparse symmetric matrices by columns; only the lower triangle is stored.

/// A symmetric matrix: rows ascending in each column, row ≥ column.
#[derive(Debug, Clone, PartialEq)]
pub struct Symmetric {
    pub n: usize,
    /// `n + 1` positions in `rows` and `values`.
    pub starts: Vec<usize>,
    pub rows: Vec<usize>,
    pub values: Vec<f64>,
}

/// Collects entries of the lower triangle; repeated entries are summed in the order they came.
#[derive(Debug)]
pub struct SymmetricBuilder {
    n: usize,
    entries: Vec<(u32, u32, f64)>,
}

impl SymmetricBuilder {
    pub fn new(n: usize, capacity: usize) -> Self {
        SymmetricBuilder {
            n,
            entries: Vec::with_capacity(capacity),
        }
    }

    /// Adds to the entries (i, j) and (j, i), which are one.
    pub fn add(&mut self, i: u32, j: u32, value: f64) {
        self.entries.push((i.max(j), i.min(j), value));
    }

    /// Sorts by counting: linear in the number of entries.
    pub fn build(self) -> Symmetric {
        let n = self.n;
        let by_row = counting_sort(n, &self.entries, |e| e.0);
        let by_column = counting_sort(n, &by_row, |e| e.1);
        let mut matrix = Symmetric {
            n,
            starts: vec![0; n + 1],
            rows: Vec::with_capacity(by_column.len() / 2),
            values: Vec::with_capacity(by_column.len() / 2),
        };
        let mut last = None;
        for (row, column, value) in by_column {
            if last == Some((row, column)) {
                *matrix
                    .values
                    .last_mut()
                    .expect("invariant: an entry came before") += value;
            } else {
                matrix.rows.push(row as usize);
                matrix.values.push(value);
                matrix.starts[column as usize + 1] += 1;
                last = Some((row, column));
            }
        }
        for column in 0..n {
            matrix.starts[column + 1] += matrix.starts[column];
        }
        matrix
    }
}

fn counting_sort(
    n: usize,
    entries: &[(u32, u32, f64)],
    key: impl Fn(&(u32, u32, f64)) -> u32,
) -> Vec<(u32, u32, f64)> {
    let mut next = vec![0usize; n + 1];
    for entry in entries {
        next[key(entry) as usize + 1] += 1;
    }
    for k in 0..n {
        next[k + 1] += next[k];
    }
    let mut sorted = vec![(0, 0, 0.0); entries.len()];
    for entry in entries {
        let slot = &mut next[key(entry) as usize];
        sorted[*slot] = *entry;
        *slot += 1;
    }
    sorted
}

impl Symmetric {
    /// y = A x
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.n];
        for j in 0..self.n {
            for k in self.starts[j]..self.starts[j + 1] {
                let (i, a) = (self.rows[k], self.values[k]);
                y[i] += a * x[j];
                if i != j {
                    y[j] += a * x[i];
                }
            }
        }
        y
    }

    /// xᵀ A x
    pub fn energy(&self, x: &[f64]) -> f64 {
        self.times(x).iter().zip(x).map(|(y, x)| x * y).sum()
    }

    /// Σ_j |A_ij x_j|
    pub fn sizes(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.n];
        for j in 0..self.n {
            for k in self.starts[j]..self.starts[j + 1] {
                let (i, a) = (self.rows[k], self.values[k].abs());
                y[i] += a * x[j].abs();
                if i != j {
                    y[j] += a * x[i].abs();
                }
            }
        }
        y
    }

    /// The block of the indices that have a number in `kept`; the numbers ascend with the indices.
    pub fn block(&self, kept: &[Option<u32>], n: usize) -> Symmetric {
        let mut block = Symmetric {
            n,
            starts: Vec::with_capacity(n + 1),
            rows: Vec::with_capacity(self.rows.len()),
            values: Vec::with_capacity(self.values.len()),
        };
        block.starts.push(0);
        for j in (0..self.n).filter(|&j| kept[j].is_some()) {
            for k in self.starts[j]..self.starts[j + 1] {
                if let Some(row) = kept[self.rows[k]] {
                    block.rows.push(row as usize);
                    block.values.push(self.values[k]);
                }
            }
            block.starts.push(block.rows.len());
        }
        block
    }

    /// Visits the entries of the lower triangle: row, column, value.
    pub fn for_each(&self, mut visit: impl FnMut(u32, u32, f64)) {
        for j in 0..self.n {
            for k in self.starts[j]..self.starts[j + 1] {
                visit(self.rows[k] as u32, j as u32, self.values[k]);
            }
        }
    }

    /// Adds to an entry of the lower triangle that is there.
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        let column = self.starts[j]..self.starts[j + 1];
        if let Ok(k) = self.rows[column.clone()].binary_search(&i) {
            self.values[column.start + k] += value;
        }
    }

    /// Neighbours of each index, without itself: (starts, indices).
    pub fn graph(&self) -> (Vec<usize>, Vec<u32>) {
        let mut starts = vec![0usize; self.n + 1];
        let pairs = || {
            (0..self.n).flat_map(|j| {
                self.rows[self.starts[j]..self.starts[j + 1]]
                    .iter()
                    .filter(move |&&i| i != j)
                    .map(move |&i| (i, j))
            })
        };
        for (i, j) in pairs() {
            starts[i + 1] += 1;
            starts[j + 1] += 1;
        }
        for k in 0..self.n {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let mut neighbours = vec![0u32; starts[self.n]];
        for (i, j) in pairs() {
            neighbours[next[i]] = j as u32;
            next[i] += 1;
            neighbours[next[j]] = i as u32;
            next[j] += 1;
        }
        (starts, neighbours)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_entries_are_summed_and_both_halves_multiply() {
        let mut builder = SymmetricBuilder::new(3, 8);
        for (i, j, a) in [
            (0, 0, 2.0),
            (1, 0, -1.0),
            (0, 1, -1.0),
            (2, 2, 5.0),
            (2, 1, 3.0),
        ] {
            builder.add(i, j, a);
        }
        let matrix = builder.build();
        assert_eq!(matrix.rows, [0, 1, 2, 2]);
        assert_eq!(matrix.times(&[1.0, 10.0, 100.0]), [-18.0, 298.0, 530.0]);
        assert_eq!(matrix.graph(), (vec![0, 1, 3, 4], vec![1, 0, 2, 1]));
    }
}
