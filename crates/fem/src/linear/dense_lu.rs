//! LU factorisation of the first rows and columns of a dense matrix, with pivots among them.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor::{lu_in_place, lu_in_place_scratch};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_unit_lower_triangular_in_place,
};
use faer::{Accum, MatMut, MatRef, Par, Spec};

use super::kernels::{clear_registers, threads_for};

/// Pivots that are eliminated before all that is behind them is updated.
const PANEL: usize = 24;
/// From this number of pivots on, faer's factorisation takes less time.
const LARGE: usize = 96;
/// In products of fewer multiplications faer's way into its kernels takes longer than the arithmetic.
pub(super) const SMALL: usize = 20_000;

/// Eliminates the first p rows of a matrix by columns, pivoting among them; the exchanges. L is below the diagonal, U on it
/// and above, and what is left of the rest in its place.
pub(super) fn factor(matrix: &mut [f64], size: usize, p: usize) -> Vec<u32> {
    if p >= LARGE {
        return factor_large(matrix, size, p);
    }
    let mut swaps = Vec::with_capacity(p);
    for start in (0..p).step_by(PANEL) {
        let end = (start + PANEL).min(p);
        for k in start..end {
            let column = &matrix[k * size..][..p];
            let pivot = (k..p).fold(k, |best, i| {
                if column[i].abs() > column[best].abs() {
                    i
                } else {
                    best
                }
            });
            swaps.push(pivot as u32);
            let (done, rest) = matrix[start * size..].split_at_mut((k + 1 - start) * size);
            if pivot != k {
                let of_panel = done.chunks_exact_mut(size);
                let of_panel = of_panel.chain(rest.chunks_exact_mut(size).take(end - k - 1));
                of_panel.for_each(|column| column.swap(k, pivot));
            }
            let column = &mut done[(k - start) * size..];
            let inverse = 1.0 / column[k];
            column[k + 1..].iter_mut().for_each(|l| *l *= inverse);
            for next in rest.chunks_exact_mut(size).take(end - k - 1) {
                let factor = next[k];
                subtract(&mut next[k + 1..], &column[k + 1..], factor);
            }
        }
        let (done, rest) = matrix.split_at_mut(end * size);
        let (before, panel) = done.split_at_mut(start * size);
        // The other columns one after the other: a row has a place in each of them.
        let swap = |column: &mut [f64]| {
            let swaps = (start..end).zip(&swaps[start..]);
            swaps.for_each(|(k, &pivot)| column.swap(k, pivot as usize));
        };
        before.chunks_exact_mut(size).for_each(swap);
        let is_small = (end - start) * (size - end) * (size - end) < SMALL;
        for next in rest.chunks_exact_mut(size) {
            swap(next);
            for (k, column) in (start..).zip(panel.chunks_exact(size)) {
                let factor = next[k];
                let to = if is_small { size } else { end };
                subtract(&mut next[k + 1..to], &column[k + 1..to], factor);
            }
        }
        if !is_small {
            let lower = MatRef::from_column_major_slice(panel, size, end - start);
            let lower = lower.split_at_row(end).1;
            let rest = MatMut::from_column_major_slice_mut(rest, size, size - end);
            let (upper, target) = rest.split_at_row_mut(end);
            let upper = upper.split_at_row_mut(start).1;
            matmul(target, Accum::Add, lower, upper.as_ref(), -1.0, Par::Seq);
            clear_registers();
        }
    }
    swaps
}

/// The same by faer.
fn factor_large(matrix: &mut [f64], size: usize, p: usize) -> Vec<u32> {
    let threads = threads_for(p * size * size);
    let all = MatMut::from_column_major_slice_mut(&mut *matrix, size, size);
    let (mut own, ..) = all.split_at_mut(p, p);
    let (mut rows, mut places) = (vec![0_usize; p], vec![0_usize; p]);
    let scratch = lu_in_place_scratch::<usize, f64>(p, p, threads, Spec::default());
    let memory = &mut MemBuffer::new(scratch);
    let stack = MemStack::new(memory);
    lu_in_place(
        own.as_mut(),
        &mut rows,
        &mut places,
        threads,
        stack,
        Spec::default(),
    );
    // The permutation as exchanges: the position of each row at each step.
    let (mut at, mut place_of): (Vec<usize>, Vec<usize>) = ((0..p).collect(), (0..p).collect());
    let mut swaps = Vec::with_capacity(p);
    for (k, &row) in rows.iter().enumerate() {
        let from = place_of[row];
        swaps.push(from as u32);
        place_of[at[k]] = from;
        at.swap(k, from);
    }
    for column in matrix[p * size..].chunks_exact_mut(size) {
        let exchanges = swaps.iter().enumerate();
        exchanges.for_each(|(k, &pivot)| column.swap(k, pivot as usize));
    }
    let all = MatMut::from_column_major_slice_mut(matrix, size, size);
    let (own, mut upper, mut lower, rest) = all.split_at_mut(p, p);
    let own = own.as_ref();
    solve_unit_lower_triangular_in_place(own, upper.as_mut(), threads);
    let turned = lower.as_mut().transpose_mut();
    solve_lower_triangular_in_place(own.transpose(), turned, threads);
    matmul(
        rest,
        Accum::Add,
        lower.as_ref(),
        upper.as_ref(),
        -1.0,
        threads,
    );
    clear_registers();
    swaps
}

pub(super) fn subtract(y: &mut [f64], x: &[f64], factor: f64) {
    for (y, x) in y.iter_mut().zip(x) {
        *y -= factor * x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fronts of every way to factor them, with pivots far from the diagonal, against the product of the factors.
    #[test]
    fn factors_of_small_and_large_fronts_multiply_to_the_matrix() {
        let mut random = crate::Random::new(5);
        for (size, p) in [(7, 3), (40, 40), (130, 60), (LARGE + 30, LARGE), (300, 200)] {
            let matrix: Vec<f64> = (0..size * size).map(|_| random.next() - 0.5).collect();
            let mut done = matrix.clone();
            let swaps = factor(&mut done, size, p);
            let mut rows: Vec<usize> = (0..size).collect();
            for (k, &swap) in swaps.iter().enumerate() {
                assert!(k <= swap as usize && (swap as usize) < p);
                rows.swap(k, swap as usize);
            }
            for j in 0..size {
                for i in 0..size {
                    let of = |i: usize, j: usize| done[j * size + i];
                    let terms = (0..p.min(i).min(j + 1)).map(|k| of(i, k) * of(k, j));
                    let own = if i < p && i <= j || i >= p && j >= p {
                        of(i, j)
                    } else {
                        0.0
                    };
                    let product = terms.sum::<f64>() + own;
                    assert!(
                        (product - matrix[j * size + rows[i]]).abs() < 1e-12,
                        "{size} {p} {i} {j}"
                    );
                }
            }
        }
    }
}
