//! The Schur complement, and systems that differ from it in few places.

use std::collections::BTreeSet;

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Mat, MatMut, MatRef};

/// An entry: row, column, value.
pub type Entry = (u32, u32, f64);

/// A symmetric matrix of the kept unknowns: dense where eliminated ones couple them, and sparse
/// besides.
#[derive(Debug, Clone)]
pub struct Schur {
    size: usize,
    /// The unknowns of the dense part, ascending.
    border: Vec<u32>,
    dense: Mat<f64>,
    /// Entries of both triangles that come on top, anywhere.
    rest: Vec<Entry>,
}

impl Schur {
    /// `dense` on the unknowns `border`, of `size`, and `rest` on top.
    pub(super) fn new(size: usize, border: Vec<u32>, dense: Mat<f64>, rest: Vec<Entry>) -> Self {
        Schur {
            size,
            border,
            dense,
            rest,
        }
    }

    /// S times a power of two.
    pub(super) fn times_unit(mut self, unit: f64) -> Self {
        for column in self.dense.col_iter_mut() {
            column.iter_mut().for_each(|a| *a *= unit);
        }
        self.rest.iter_mut().for_each(|entry| entry.2 *= unit);
        self
    }

    pub fn size(&self) -> usize {
        self.size
    }

    /// S x
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut on_border = vec![0.0; self.border.len()];
        for (j, &q) in self.border.iter().enumerate() {
            let factor = x[q as usize];
            for (y, a) in on_border.iter_mut().zip(self.dense.col(j).iter()) {
                *y += a * factor;
            }
        }
        let mut y = vec![0.0; self.size];
        for (&p, value) in self.border.iter().zip(on_border) {
            y[p as usize] = value;
        }
        for &(i, j, value) in &self.rest {
            y[i as usize] += value * x[j as usize];
        }
        y
    }

    /// The largest Σ_j |S_ij|, or a little more.
    pub fn norm(&self) -> f64 {
        let mut sums = vec![0.0; self.size];
        for (&q, column) in self.border.iter().zip(self.dense.col_iter()) {
            sums[q as usize] = column.iter().map(|a| a.abs()).sum();
        }
        for &(i, _, value) in &self.rest {
            sums[i as usize] += value.abs();
        }
        sums.into_iter().fold(0.0, f64::max)
    }

    /// Factors S with `extra` entries added.
    pub fn lu(&self, extra: &[Entry]) -> SchurLu {
        SchurLu::new(self, extra)
    }
}

/// A factorisation of S and more. What has no dense coupling is eliminated in small blocks first.
pub struct SchurLu {
    blocks: Vec<Block>,
    outer: Vec<u32>,
    lu: PartialPivLu<f64>,
}

/// Unknowns that are coupled to each other, to few outer ones, and to nothing else.
struct Block {
    inner: Vec<u32>,
    /// Outer unknowns.
    outer: Vec<u32>,
    /// M_ii⁻¹, M_ii⁻¹ M_io and M_oi.
    inverse: Mat<f64>,
    across: Mat<f64>,
    back: Mat<f64>,
}

/// A block is eliminated first only if it has not more unknowns, and M_ii⁻¹ is not larger in units
/// of the block's entries.
const LARGEST_BLOCK: usize = 8;
const LARGEST_GROWTH: f64 = 1e6;

impl SchurLu {
    fn new(schur: &Schur, extra: &[Entry]) -> Self {
        let mut is_outer = vec![false; schur.size];
        schur
            .border
            .iter()
            .for_each(|&k| is_outer[k as usize] = true);
        let mut blocks = Vec::new();
        for (inner, entries) in components(&is_outer, schur.rest.iter().chain(extra)) {
            match Block::new(&inner, &entries) {
                Some(block) => blocks.push(block),
                None => inner.iter().for_each(|&k| is_outer[k as usize] = true),
            }
        }
        let outer: Vec<u32> = (0..schur.size as u32)
            .filter(|&k| is_outer[k as usize])
            .collect();
        let mut places = vec![usize::MAX; schur.size];
        for (place, &k) in outer.iter().enumerate() {
            places[k as usize] = place;
        }
        let place = |k: u32| places[k as usize];
        let mut matrix = Mat::zeros(outer.len(), outer.len());
        for (&q, column) in schur.border.iter().zip(schur.dense.col_iter()) {
            let mut target = matrix.col_mut(place(q));
            for (&p, value) in schur.border.iter().zip(column.iter()) {
                target[place(p)] = *value;
            }
        }
        for &(i, j, value) in schur.rest.iter().chain(extra) {
            if is_outer[i as usize] && is_outer[j as usize] {
                matrix[(place(i), place(j))] += value;
            }
        }
        for block in &blocks {
            let update = &block.back * &block.across;
            for (j, &q) in block.outer.iter().enumerate() {
                for (i, &p) in block.outer.iter().enumerate() {
                    matrix[(place(p), place(q))] -= update[(i, j)];
                }
            }
        }
        SchurLu {
            blocks,
            outer,
            lu: matrix.partial_piv_lu(),
        }
    }

    pub fn size(&self) -> usize {
        self.outer.len() + self.blocks.iter().map(|b| b.inner.len()).sum::<usize>()
    }

    /// Unknowns of the dense factorisation.
    pub fn dense_size(&self) -> usize {
        self.outer.len()
    }

    /// Solves M X = B in place; not finite where M is singular.
    pub(super) fn solve_in_place(&self, mut x: MatMut<f64>) {
        let columns = x.ncols();
        for block in &self.blocks {
            let z = &block.inverse * gather(x.as_ref(), &block.inner);
            let update = &block.back * &z;
            for j in 0..columns {
                for (i, &k) in block.inner.iter().enumerate() {
                    x[(k as usize, j)] = z[(i, j)];
                }
                for (i, &k) in block.outer.iter().enumerate() {
                    x[(k as usize, j)] -= update[(i, j)];
                }
            }
        }
        let mut outer = gather(x.as_ref(), &self.outer);
        self.lu.solve_in_place(outer.as_mut());
        for j in 0..columns {
            for (i, &k) in self.outer.iter().enumerate() {
                x[(k as usize, j)] = outer[(i, j)];
            }
        }
        for block in &self.blocks {
            let update = &block.across * gather(x.as_ref(), &block.outer);
            for j in 0..columns {
                for (i, &k) in block.inner.iter().enumerate() {
                    x[(k as usize, j)] -= update[(i, j)];
                }
            }
        }
    }
}

fn gather(x: MatRef<f64>, rows: &[u32]) -> Mat<f64> {
    Mat::from_fn(rows.len(), x.ncols(), |i, j| x[(rows[i] as usize, j)])
}

/// The sets of inner unknowns that entries join, each with the entries that touch it.
fn components<'a>(
    is_outer: &[bool],
    entries: impl Iterator<Item = &'a Entry> + Clone,
) -> Vec<(Vec<u32>, Vec<Entry>)> {
    let mut parent: Vec<u32> = (0..is_outer.len() as u32).collect();
    fn root(parent: &mut [u32], mut k: u32) -> u32 {
        while parent[k as usize] != k {
            parent[k as usize] = parent[parent[k as usize] as usize];
            k = parent[k as usize];
        }
        k
    }
    for &(i, j, _) in entries.clone() {
        if !is_outer[i as usize] && !is_outer[j as usize] {
            let (a, b) = (root(&mut parent, i), root(&mut parent, j));
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    let mut numbers = vec![usize::MAX; is_outer.len()];
    let mut found: Vec<(Vec<u32>, Vec<Entry>)> = Vec::new();
    for k in (0..is_outer.len() as u32).filter(|&k| !is_outer[k as usize]) {
        let root = root(&mut parent, k) as usize;
        if numbers[root] == usize::MAX {
            numbers[root] = found.len();
            found.push(Default::default());
        }
        numbers[k as usize] = numbers[root];
        found[numbers[root]].0.push(k);
    }
    for &entry in entries {
        let number = numbers[entry.0 as usize].min(numbers[entry.1 as usize]);
        if let Some((_, entries)) = found.get_mut(number) {
            entries.push(entry);
        }
    }
    found
}

impl Block {
    /// None if it had better not be eliminated first.
    fn new(inner: &[u32], entries: &[Entry]) -> Option<Self> {
        if inner.len() > LARGEST_BLOCK {
            return None;
        }
        let ends = entries.iter().flat_map(|&(i, j, _)| [i, j]);
        let outer: BTreeSet<u32> = ends.filter(|k| !inner.contains(k)).collect();
        let outer: Vec<u32> = outer.into_iter().collect();
        let mut matrix = Mat::<f64>::zeros(inner.len(), inner.len());
        let mut row = Mat::<f64>::zeros(inner.len(), outer.len());
        let mut back = Mat::<f64>::zeros(outer.len(), inner.len());
        let mut largest = 0.0_f64;
        for &(i, j, value) in entries {
            let place = |k: u32| inner.iter().position(|&other| other == k).ok_or(k);
            let out = |k: u32| outer.partition_point(|&other| other < k);
            match (place(i), place(j)) {
                (Ok(i), Ok(j)) => matrix[(i, j)] += value,
                (Ok(i), Err(j)) => row[(i, out(j))] += value,
                (Err(i), Ok(j)) => back[(out(i), j)] += value,
                (Err(_), Err(_)) => {}
            }
            largest = largest.max(value.abs());
        }
        let lu = matrix.partial_piv_lu();
        let mut inverse = Mat::identity(inner.len(), inner.len());
        lu.solve_in_place(inverse.as_mut());
        let across = &inverse * &row;
        // What is not a number is refused as well.
        let grows = |x: &f64| !(x.abs() * largest <= LARGEST_GROWTH);
        if inverse.col_iter().any(|column| column.iter().any(grows)) {
            return None;
        }
        Some(Block {
            inner: inner.to_vec(),
            outer,
            inverse,
            across,
            back,
        })
    }
}

/// Σ_r l_r m_rᵀ, a change of a matrix in few rows and columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LowRank {
    terms: Vec<[Row; 2]>,
}

/// A sparse vector by (index, value).
pub type Row = Vec<(u32, f64)>;

impl LowRank {
    /// Adds l mᵀ.
    pub fn push(&mut self, l: Row, m: Row) {
        self.terms.push([l, m]);
    }

    /// How many terms there are.
    pub fn rank(&self) -> usize {
        self.terms.len()
    }

    fn left(&self, n: usize) -> Mat<f64> {
        let mut l = Mat::zeros(n, self.rank());
        for (r, [left, _]) in self.terms.iter().enumerate() {
            for &(i, value) in left {
                l[(i as usize, r)] += value;
            }
        }
        l
    }

    /// Mᵀ X
    fn right_times(&self, x: MatRef<f64>) -> Mat<f64> {
        Mat::from_fn(self.rank(), x.ncols(), |r, j| {
            let row = self.terms[r][1].iter();
            row.map(|&(i, value)| value * x[(i as usize, j)]).sum()
        })
    }
}

impl SchurLu {
    /// The solver of M + L Rᵀ by the formula of Woodbury (1950):
    /// x = z - M⁻¹L (1 + RᵀM⁻¹L)⁻¹ Rᵀz with z = M⁻¹b.
    pub fn changed<'a>(&'a self, change: &'a LowRank) -> impl Fn(&[f64]) -> Vec<f64> {
        let mut columns = change.left(self.size());
        let mut capacity = Mat::identity(change.rank(), change.rank());
        if change.rank() > 0 {
            self.solve_in_place(columns.as_mut());
            capacity += change.right_times(columns.as_ref());
        }
        let capacity = capacity.partial_piv_lu();
        move |b| {
            let mut z = Mat::from_fn(b.len(), 1, |i, _| b[i]);
            self.solve_in_place(z.as_mut());
            if change.rank() > 0 {
                let mut weights = change.right_times(z.as_ref());
                capacity.solve_in_place(weights.as_mut());
                z -= &columns * weights;
            }
            z.col(0).iter().copied().collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Dense on every third of `n` unknowns, the others joined to neighbours in twos and threes.
    fn example(n: u32) -> (Schur, Vec<Entry>) {
        let border: Vec<u32> = (0..n).filter(|k| k % 3 == 0).collect();
        let dense = Mat::from_fn(border.len(), border.len(), |i, j| {
            (0.3 * (i + j) as f64).sin() + if i == j { 20.0 } else { 0.0 }
        });
        let mut rest = Vec::new();
        for k in 0..n {
            rest.push((k, k, 3.0));
            if k + 1 < n {
                rest.extend([(k, k + 1, 0.7), (k + 1, k, 0.7)]);
            }
        }
        let extra = (1..n).map(|k| (k, k - 1, f64::from(k).cos())).collect();
        (Schur::new(n as usize, border, dense, rest), extra)
    }

    /// b - (S + extra) x
    fn rest(schur: &Schur, extra: &[Entry], x: &[f64], b: &[f64]) -> f64 {
        let mut y = schur.times(x);
        for &(i, j, value) in extra {
            y[i as usize] += value * x[j as usize];
        }
        let rests = y.iter().zip(b).map(|(y, b)| (y - b).abs());
        rests.fold(0.0, f64::max)
    }

    #[test]
    fn blocks_and_the_dense_part_solve_together() {
        let (schur, extra) = example(31);
        let b: Vec<f64> = (0..31).map(|k| f64::from(k).sin()).collect();
        let lu = schur.lu(&extra);
        assert_eq!((lu.size(), lu.dense_size()), (31, 11));
        let x = lu.changed(&LowRank::default())(&b);
        assert!(rest(&schur, &extra, &x, &b) < 1e-14);
        // A block that cannot be eliminated for itself is left to pivoting.
        let mut singular = extra.clone();
        singular.extend([
            (1, 1, -3.0),
            (2, 2, -3.0),
            (1, 2, -0.7),
            (2, 1, -0.7 - 2.0_f64.cos()),
        ]);
        let lu = schur.lu(&singular);
        assert_eq!((lu.size(), lu.dense_size()), (31, 13));
        let x = lu.changed(&LowRank::default())(&b);
        assert!(rest(&schur, &singular, &x, &b) < 1e-13);
    }

    #[test]
    fn a_change_of_low_rank_needs_no_new_factorisation() {
        let (schur, mut extra) = example(40);
        let lu = schur.lu(&extra);
        let mut change = LowRank::default();
        for r in 0..4 {
            let l = vec![(r, 2.0), (r + 9, -1.0)];
            let m = vec![(2 * r, 0.5), (2 * r + 1, f64::from(r))];
            for &(i, x) in &l {
                extra.extend(m.iter().map(|&(j, y)| (i, j, x * y)));
            }
            change.push(l, m);
        }
        let b: Vec<f64> = (0..40).map(|k| f64::from(k).cos()).collect();
        let x = lu.changed(&change)(&b);
        assert!(rest(&schur, &extra, &x, &b) < 1e-14);
        assert!(schur.norm() > 20.0);
    }
}
