//! Sparse symmetric matrices by columns; only the lower triangle is stored.

use super::{Elements, Role};
use faceoff_mesh::error::{Error, Result};

const NONE: u32 = u32::MAX;

/// A symmetric matrix: rows ascending in each column, row ≥ column.
#[derive(Debug, Clone, PartialEq)]
pub struct Symmetric {
    /// Number of rows.
    pub n: usize,
    /// `n + 1` positions in `rows` and `values`.
    pub starts: Vec<u32>,
    /// The row of each entry, from 0.
    pub rows: Vec<u32>,
    /// The value of each entry.
    pub values: Vec<f64>,
}

impl Symmetric {
    /// Sums the elements; rows and columns of fixed unknowns are left out, the others keep their
    /// order. Linear in the number of elements.
    ///
    /// # Errors
    /// More entries than 32 bits count.
    pub fn new(elements: &impl Elements, roles: &[Role]) -> Result<Self> {
        let size = elements.size();
        if elements.count() as u64 * (size * (size + 1) / 2) as u64 > u64::from(u32::MAX) {
            return Err(Error::Solver {
                what: format!(
                    "a matrix of {} elements has too many entries",
                    elements.count()
                ),
                remedy: "use --linear multifrontal, which never puts it together".into(),
            });
        }
        let mut n = 0;
        let numbers: Vec<u32> = roles
            .iter()
            .map(|role| {
                if *role == Role::Fixed {
                    return NONE;
                }
                n += 1;
                n as u32 - 1
            })
            .collect();
        let number = |k: u32| numbers[k as usize];
        // Every entry of every element gets a place in its column; then columns are summed.
        let mut starts = vec![0u32; n + 1];
        for e in 0..elements.count() {
            let unknowns = elements.of(e);
            for (k, &i) in unknowns.iter().enumerate() {
                for &j in &unknowns[..=k] {
                    if number(i) != NONE && number(j) != NONE {
                        starts[number(i).min(number(j)) as usize + 1] += 1;
                    }
                }
            }
        }
        for k in 0..n {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let mut entries = vec![(0u32, 0.0); starts[n] as usize];
        let mut matrix = vec![0.0; size * size];
        for e in 0..elements.count() {
            elements.matrix(e, &mut matrix);
            let unknowns = elements.of(e);
            for (k, &i) in unknowns.iter().enumerate() {
                for (l, &j) in unknowns[..=k].iter().enumerate() {
                    let (i, j) = (number(i), number(j));
                    if i != NONE && j != NONE {
                        let slot = &mut next[i.min(j) as usize];
                        entries[*slot as usize] = (i.max(j), matrix[l * size + k]);
                        *slot += 1;
                    }
                }
            }
        }
        Ok(Symmetric::sum(n, &starts, entries))
    }

    /// Sorts each column, which is short, and adds what falls on one place.
    fn sum(n: usize, starts: &[u32], mut entries: Vec<(u32, f64)>) -> Self {
        let mut matrix = Symmetric {
            n,
            starts: vec![0; n + 1],
            rows: Vec::with_capacity(entries.len()),
            values: Vec::with_capacity(entries.len()),
        };
        for column in 0..n {
            let range = starts[column] as usize..starts[column + 1] as usize;
            let entries = &mut entries[range];
            entries.sort_by_key(|entry| entry.0);
            for chunk in entries.chunk_by(|a, b| a.0 == b.0) {
                matrix.rows.push(chunk[0].0);
                matrix.values.push(chunk.iter().map(|entry| entry.1).sum());
            }
            matrix.starts[column + 1] = matrix.rows.len() as u32;
        }
        matrix
    }

    /// y = A x
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.n];
        for j in 0..self.n {
            for k in self.starts[j] as usize..self.starts[j + 1] as usize {
                let (i, a) = (self.rows[k] as usize, self.values[k]);
                y[i] += a * x[j];
                if i != j {
                    y[j] += a * x[i];
                }
            }
        }
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::tests::Network;

    #[test]
    fn elements_are_summed_and_both_halves_multiply() {
        // Springs of stiffness 1, 2, 3, each with one of stiffness 1 to the ground at both its ends.
        let network = Network::path(4);
        let mut roles = vec![Role::Eliminated; 4];
        let matrix = Symmetric::new(&network, &roles).unwrap();
        assert_eq!(matrix.rows, [0, 1, 1, 2, 2, 3, 3]);
        assert_eq!(
            matrix.times(&[1.0, 10.0, 100.0, 0.0]),
            [-8.0, -151.0, 680.0, -300.0]
        );
        roles[1] = Role::Fixed;
        let matrix = Symmetric::new(&network, &roles).unwrap();
        assert_eq!(matrix.rows, [0, 1, 2, 2]);
        assert_eq!(matrix.times(&[1.0, 10.0, 0.0]), [2.0, 70.0, -30.0]);
    }
}
