//! The Schur complement, and systems that differ from it in few places.

use std::sync::Arc;

use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};

use super::kernels::{clear_registers_everywhere, dot};
use super::lu::SchurLu;
use super::lu_plan::LuPlan;
use faceoff_mesh::parallel;

/// Rows that one task multiplies.
const ROWS: usize = 128;

/// An entry: row, column, value.
pub type Entry = (u32, u32, f64);

/// A symmetric matrix of the kept unknowns: a sum of dense blocks, where eliminated unknowns couple them, and of entries.
#[derive(Debug, Clone)]
pub struct Schur {
    /// The unknowns, ascending: the rows.
    kept: Vec<u32>,
    /// Rows, and the matrix on them.
    pub(super) blocks: Vec<(Vec<u32>, Mat<f64>)>,
    /// Entries of both triangles that come on top, anywhere.
    pub(super) rest: Vec<Entry>,
    pub(super) plan: Arc<LuPlan>,
}

impl Schur {
    pub(super) fn new(
        kept: Vec<u32>,
        blocks: Vec<(Vec<u32>, Mat<f64>)>,
        rest: Vec<Entry>,
        plan: Arc<LuPlan>,
    ) -> Self {
        Schur {
            kept,
            blocks,
            rest,
            plan,
        }
    }

    /// S times a power of two.
    pub(super) fn times_unit(mut self, unit: f64) -> Self {
        for (_, dense) in &mut self.blocks {
            for column in dense.col_iter_mut() {
                column.iter_mut().for_each(|a| *a *= unit);
            }
        }
        self.rest.iter_mut().for_each(|entry| entry.2 *= unit);
        self
    }

    /// Number of rows.
    pub fn size(&self) -> usize {
        self.kept.len()
    }

    /// The unknowns of its rows, ascending.
    pub fn kept(&self) -> &[u32] {
        &self.kept
    }

    /// S x
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.size()];
        for (border, dense) in &self.blocks {
            let at: Vec<f64> = border.iter().map(|&q| x[q as usize]).collect();
            // By symmetry its columns are the rows.
            let row = |k: usize| dot(dense.col_as_slice(k), &at);
            let on_border = parallel::chunks(border.len(), ROWS, |rows| rows.map(row).collect());
            for (&p, value) in border.iter().zip(&on_border) {
                y[p as usize] += value;
            }
        }
        for &(i, j, value) in &self.rest {
            y[i as usize] += value * x[j as usize];
        }
        y
    }

    /// The largest Σ_j |S_ij|, or a little more.
    pub fn norm(&self) -> f64 {
        let mut sums = vec![0.0; self.size()];
        for (border, dense) in &self.blocks {
            for (&q, column) in border.iter().zip(dense.col_iter()) {
                sums[q as usize] += column.iter().map(|a| a.abs()).sum::<f64>();
            }
        }
        for &(i, _, value) in &self.rest {
            sums[i as usize] += value.abs();
        }
        sums.into_iter().fold(0.0, f64::max)
    }

    /// Factors S with `extra` entries added, whose places the ties of [`super::condense`] have.
    /// The memory of an `old` one is used again.
    pub fn lu(&self, extra: &[Entry], old: Option<SchurLu>) -> SchurLu {
        SchurLu::new(self, extra, old)
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

    /// Mᵀ X
    fn right_times(&self, x: MatRef<f64>) -> Mat<f64> {
        Mat::from_fn(self.rank(), x.ncols(), |r, j| {
            let row = self.terms[r][1].iter();
            row.map(|&(i, value)| value * x[(i as usize, j)]).sum()
        })
    }
}

/// M⁻¹l of the l that changes of M have had so far: from step to step most of them are the same.
#[derive(Debug, Default)]
pub struct Solved(Vec<(Row, Vec<f64>)>);

impl Solved {
    fn of(&self, l: &Row) -> Option<&Vec<f64>> {
        let found = self.0.iter().find(|(row, _)| row == l);
        found.map(|(_, column)| column)
    }

    /// How many columns of a change are still to be solved for.
    pub fn missing(&self, change: &LowRank) -> usize {
        let is_missing = |[l, _]: &&[Row; 2]| self.of(l).is_none();
        change.terms.iter().filter(is_missing).count()
    }

    /// M⁻¹L
    fn columns(&mut self, lu: &SchurLu, change: &LowRank) -> Mat<f64> {
        let lefts = change.terms.iter().map(|[l, _]| l);
        let missing: Vec<&Row> = lefts.clone().filter(|l| self.of(l).is_none()).collect();
        let mut columns = Mat::zeros(lu.size(), missing.len());
        for (l, mut column) in missing.iter().zip(columns.col_iter_mut()) {
            for &(i, value) in *l {
                column[i as usize] += value;
            }
        }
        if !missing.is_empty() {
            lu.solve_in_place(columns.as_mut());
        }
        let solved = columns.col_iter().map(|c| c.iter().copied().collect());
        self.0.extend(missing.into_iter().cloned().zip(solved));
        let mut all = Mat::zeros(lu.size(), change.rank());
        for (l, column) in lefts.zip(all.col_iter_mut()) {
            let solved = self.of(l).into_iter().flatten();
            column
                .iter_mut()
                .zip(solved)
                .for_each(|(x, value)| *x = *value);
        }
        all
    }
}

impl SchurLu {
    /// The solver of M + L Rᵀ by the formula of Woodbury (1950):
    /// x = z - M⁻¹L (1 + RᵀM⁻¹L)⁻¹ Rᵀz with z = M⁻¹b. What is `solved` of M⁻¹L is not solved for again.
    pub fn changed<'a>(
        &'a self,
        change: &'a LowRank,
        solved: &mut Solved,
    ) -> impl Fn(&[f64]) -> Vec<f64> + use<'a> {
        let columns = solved.columns(self, change);
        let mut capacity = Mat::identity(change.rank(), change.rank());
        capacity += change.right_times(columns.as_ref());
        let capacity = capacity.partial_piv_lu();
        clear_registers_everywhere();
        move |b| {
            let mut z = Mat::from_fn(b.len(), 1, |i, _| b[i]);
            self.solve_in_place(z.as_mut());
            if change.rank() > 0 {
                let mut weights = change.right_times(z.as_ref());
                capacity.solve_in_place(weights.as_mut());
                z -= &columns * weights;
                clear_registers_everywhere();
            }
            z.col(0).iter().copied().collect()
        }
    }
}
