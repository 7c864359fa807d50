//! Elimination in one front: own loops for the many small fronts, faer for the few large ones.

use std::fmt::Debug;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor;
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, ColRef, MatMut, MatRef, Par, Spec};

/// Numbers that are stored in f64 or in f32, and computed with in f64.
pub trait Number: Copy + Debug + Send + Sync {
    const ZERO: Self;
    fn of(value: f64) -> Self;
    fn wide(self) -> f64;
    /// Stores numbers; the sum of what rounding took.
    fn store(values: &[f64], stored: &mut [Self]) -> f64;
}

impl Number for f64 {
    const ZERO: Self = 0.0;

    fn of(value: f64) -> Self {
        value
    }

    fn wide(self) -> f64 {
        self
    }

    fn store(values: &[f64], stored: &mut [Self]) -> f64 {
        stored.copy_from_slice(values);
        0.0
    }
}

impl Number for f32 {
    const ZERO: Self = 0.0;

    fn of(value: f64) -> Self {
        value as f32
    }

    fn wide(self) -> f64 {
        f64::from(self)
    }

    fn store(values: &[f64], stored: &mut [Self]) -> f64 {
        // Four sums side by side, as each waits for the last addition.
        let mut sums = [0.0; 4];
        for (values, stored) in values.chunks(4).zip(stored.chunks_mut(4)) {
            for ((sum, value), stored) in sums.iter_mut().zip(values).zip(stored) {
                *stored = *value as f32;
                *sum += value - f64::from(*stored);
            }
        }
        sums.iter().sum()
    }
}

/// Up to this many pivots, faer's overhead exceeds the arithmetic.
const SMALL: usize = 24;
/// The same for the update, in multiplications and additions.
const SMALL_UPDATE: usize = 200_000;
/// Pivots that are eliminated before the remaining columns are updated: products with this many columns are fastest.
const BLOCK: usize = 128;
/// From this number of operations on, several threads are worth it.
const PARALLEL: usize = 20_000_000;

/// Σ_i a_i x_i in four parts, which a processor does side by side.
pub(super) fn dot<T: Number>(a: &[T], x: &[f64]) -> f64 {
    let (a4, a_rest) = a.as_chunks::<4>();
    let (x4, x_rest) = x.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (a, x) in a4.iter().zip(x4) {
        for k in 0..4 {
            sums[k] += a[k].wide() * x[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(x_rest).map(|(a, x)| a.wide() * x).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// Clears the upper halves of this thread's registers, which faer's products leave in use.
///
/// Until that is done each instruction of SSE, of which all that is compiled for any x86-64 consists, waits for what its
/// register contained before: such code took up to twice as long. Code compiled for AVX clears them as it returns; a
/// norm by faer is such code.
pub(super) fn clear_registers() {
    std::hint::black_box(ColRef::from_slice(&[1.0_f64; 16]).norm_max());
}

/// The same on all threads, behind what faer did on several.
///
/// Nothing waits for the others: a thread of a pool that waits takes on other work meanwhile, and where many problems are
/// solved at once that is another solve, on top of this one on its stack.
pub(super) fn clear_registers_everywhere() {
    clear_registers();
    rayon::spawn_broadcast(|_| clear_registers());
}

/// The threads for a given number of multiplications and additions.
pub(super) fn threads_for(work: usize) -> Par {
    if work > PARALLEL {
        faer::get_global_parallelism()
    } else {
        Par::Seq
    }
}

/// Eliminates the pivots of a front.
///
/// `panel` has size × pivots entries by columns, the lower triangle of the pivots' block on top of
/// their rows of the border; it becomes the columns of L. `update` is border × border, and its
/// lower triangle becomes the Schur complement.
///
/// # Errors
/// The first pivot that is not positive.
pub(super) fn eliminate(
    panel: &mut [f64],
    size: usize,
    pivots: usize,
    update: &mut [f64],
) -> Result<(), usize> {
    let border = size - pivots;
    let is_small = pivots * border * border <= SMALL_UPDATE;
    if pivots <= SMALL {
        factor_small(panel, size)?;
        if is_small {
            update_small(update, border, panel, size);
            return Ok(());
        }
        let columns = MatRef::from_column_major_slice(panel, size, pivots);
        let update = MatMut::from_column_major_slice_mut(update, border, border);
        subtract_square(update, columns.split_at_row(pivots).1);
    } else {
        eliminate_blocks(panel, size, pivots, update)?;
    }
    clear_registers();
    Ok(())
}

/// The same by blocks of pivots: each is factored, and taken out of all that is behind it.
fn eliminate_blocks(
    panel: &mut [f64],
    size: usize,
    pivots: usize,
    update: &mut [f64],
) -> Result<(), usize> {
    let border = size - pivots;
    for from in (0..pivots).step_by(BLOCK) {
        let to = (from + BLOCK).min(pivots);
        let (done, rest) = panel.split_at_mut(to * size);
        let block = &mut done[from * size..];
        let block = MatMut::from_column_major_slice_mut(block, size, to - from);
        let (mut top, mut bottom) = block.split_at_row_mut(from).1.split_at_row_mut(to - from);
        let scratch =
            factor::cholesky_in_place_scratch::<f64>(to - from, Par::Seq, Spec::default());
        factor::cholesky_in_place(
            top.as_mut(),
            Default::default(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            Spec::default(),
        )
        .map_err(|error| match error {
            factor::LltError::NonPositivePivot { index } => from + index,
        })?;
        let threads = threads_for((size - to) * (to - from).pow(2));
        solve_lower_triangular_in_place(top.as_ref(), bottom.as_mut().transpose_mut(), threads);
        let (of_pivots, of_border) = bottom.as_ref().split_at_row(pivots - to);
        let rest = MatMut::from_column_major_slice_mut(rest, size, pivots - to);
        let (square, below) = rest.split_at_row_mut(to).1.split_at_row_mut(pivots - to);
        subtract_square(square, of_pivots);
        let threads = threads_for(border * (pivots - to) * (to - from));
        let turned = of_pivots.transpose();
        matmul(below, Accum::Add, of_border, turned, -1.0, threads);
        let update = MatMut::from_column_major_slice_mut(&mut *update, border, border);
        subtract_square(update, of_border);
    }
    Ok(())
}

/// `target` -= B Bᵀ on its lower triangle.
fn subtract_square(target: MatMut<f64>, b: MatRef<f64>) {
    let threads = threads_for(b.nrows() * b.nrows() * b.ncols());
    triangular::matmul(
        target,
        BlockStructure::TriangularLower,
        Accum::Add,
        b,
        BlockStructure::Rectangular,
        b.transpose(),
        BlockStructure::Rectangular,
        -1.0,
        threads,
    );
}

/// L of the panel, column by column, each with four earlier ones at a time.
fn factor_small(panel: &mut [f64], size: usize) -> Result<(), usize> {
    let pivots = panel.len() / size.max(1);
    for j in 0..pivots {
        let (done, rest) = panel.split_at_mut(j * size);
        let column = &mut rest[j..size];
        let mut fours = done.chunks_exact(4 * size);
        for four in &mut fours {
            let (a, b) = four.split_at(2 * size);
            let ((a, b), (c, d)) = (a.split_at(size), b.split_at(size));
            let [a, b, c, d] = [&a[j..], &b[j..], &c[j..], &d[j..]];
            let factors = [a[0], b[0], c[0], d[0]];
            for ((((x, a), b), c), d) in column.iter_mut().zip(a).zip(b).zip(c).zip(d) {
                *x -= (*a * factors[0] + *b * factors[1]) + (*c * factors[2] + *d * factors[3]);
            }
        }
        for earlier in fours.remainder().chunks_exact(size) {
            let factor = earlier[j];
            for (x, a) in column.iter_mut().zip(&earlier[j..]) {
                *x -= *a * factor;
            }
        }
        // Negated so that what is not a number is refused as well.
        if !(column[0] > 0.0) {
            return Err(j);
        }
        column[0] = column[0].sqrt();
        let inverse = 1.0 / column[0];
        for x in &mut column[1..] {
            *x *= inverse;
        }
    }
    Ok(())
}

/// Side of the tiles that are summed in registers.
const TILE: usize = 4;

/// `update` -= B Bᵀ on its lower triangle, B the rows of the panel below the pivots.
fn update_small(update: &mut [f64], border: usize, panel: &[f64], size: usize) {
    let pivots = size - border;
    let whole = border - border % TILE;
    for j in (0..whole).step_by(TILE) {
        for i in (j..whole).step_by(TILE) {
            let mut sums = [[0.0; TILE]; TILE];
            for column in panel.chunks_exact(size) {
                let column = &column[pivots..];
                let (Some(rows), Some(columns)) =
                    (column[i..].first_chunk(), column[j..].first_chunk())
                else {
                    continue;
                };
                add_product(&mut sums, rows, columns);
            }
            for (sums, target) in sums
                .iter()
                .zip(update[j * border..].chunks_exact_mut(border))
            {
                for (x, sum) in target[i..].iter_mut().zip(sums) {
                    *x -= *sum;
                }
            }
        }
    }
    for i in whole..border {
        let mut sums = [0.0; 64];
        for start in (0..=i).step_by(64) {
            let width = (i + 1 - start).min(64);
            let sums = &mut sums[..width];
            sums.fill(0.0);
            for column in panel.chunks_exact(size) {
                let column = &column[pivots..];
                let factor = column[i];
                for (sum, x) in sums.iter_mut().zip(&column[start..]) {
                    *sum += *x * factor;
                }
            }
            for (k, sum) in sums.iter().enumerate() {
                update[(start + k) * border + i] -= *sum;
            }
        }
    }
}

#[inline(always)]
fn add_product(sums: &mut [[f64; TILE]; TILE], rows: &[f64; TILE], columns: &[f64; TILE]) {
    for (sums, factor) in sums.iter_mut().zip(columns) {
        for (sum, x) in sums.iter_mut().zip(rows) {
            *sum += *x * *factor;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// B Bᵀ + n I of a full B: well conditioned.
    fn positive(n: usize) -> Vec<f64> {
        let b = |i: usize, j: usize| (12.9898 * (i * n + j) as f64).sin();
        let mut a = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..n {
                let sum: f64 = (0..n).map(|k| b(i, k) * b(j, k)).sum();
                a[j * n + i] = sum + if i == j { n as f64 } else { 0.0 };
            }
        }
        a
    }

    /// L Lᵀ + (0, S) = A, for fronts on all ways through the kernels.
    #[test]
    fn fronts_of_all_sizes_are_factored() {
        let sizes = [
            (1, 0),
            (1, 1),
            (3, 7),
            (8, 8),
            (5, 70),
            (24, 140),
            (25, 30),
            (40, 0),
            (90, 260),
            (BLOCK + 1, 70),
            (2 * BLOCK + 20, 150),
            (BLOCK, 0),
        ];
        for (pivots, border) in sizes {
            let size = pivots + border;
            let a = positive(size);
            let mut panel = a[..size * pivots].to_vec();
            let mut update = vec![0.0; border * border];
            for j in 0..border {
                for i in j..border {
                    update[j * border + i] = a[(pivots + j) * size + pivots + i];
                }
            }
            eliminate(&mut panel, size, pivots, &mut update).unwrap();
            for j in 0..size {
                for i in j..size {
                    let product: f64 = (0..=j.min(pivots - 1))
                        .map(|k| panel[k * size + i] * panel[k * size + j])
                        .sum();
                    let rest = if j >= pivots {
                        update[(j - pivots) * border + i - pivots]
                    } else {
                        0.0
                    };
                    let error = product + rest - a[j * size + i];
                    assert!(
                        error.abs() < 1e-14 * size as f64,
                        "{pivots} {border} {i} {j}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_pivot_that_is_not_positive_is_told() {
        for pivots in [3, 60] {
            let size = pivots + 2;
            let mut panel = positive(size)[..size * pivots].to_vec();
            panel[2 * size + 2] = -1e3;
            assert_eq!(eliminate(&mut panel, size, pivots, &mut [0.0; 4]), Err(2));
            panel[0] = f64::NAN;
            assert!(eliminate(&mut panel, size, pivots, &mut [0.0; 4]).is_err());
        }
    }
}
