//! Multifrontal Cholesky factorisation (I. Duff, J. Reid, ACM Trans. Math. Softw. 9, 1983).
//!
//! The matrix is never put together: each leaf of the tree sums its elements into a dense front,
//! each other front the updates of its two halves; every front eliminates its pivots and hands the
//! Schur complement on its border up. What arrives above the whole is that of the kept unknowns.
//! The tree alone decides what is done in which order, so that the result is the same with any
//! number of threads.

use std::sync::Arc;

use faer::Mat;
use rayon::prelude::*;

use super::analysis::Analysis;
use super::kernels::{Number, clear_registers_everywhere, eliminate};
use super::plan::{Front, Plan};
use super::pool::Pool;
use super::substitution::{Sides, backward, forward, forward_above};
use super::{Elements, Schur};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Error;

/// P A Pᵀ = L Lᵀ of the eliminated unknowns, and the rows of L that belong to the kept ones.
pub struct Multifrontal<T> {
    analysis: Analysis,
    /// The columns of L, those of a part behind those of its halves; each from its diagonal, which
    /// is inverted, downwards.
    columns: Vec<T>,
}

/// A right-hand side after its forward elimination.
pub struct Forward {
    /// L⁻¹ b of the eliminated unknowns, in their order.
    y: Vec<f64>,
    /// b of the kept unknowns less what the eliminated ones brought.
    pub kept: Vec<f64>,
}

impl Forward {
    /// |L⁻¹b|² of the eliminated unknowns: the energy that is left with the kept ones at 0.
    pub fn energy(&self) -> f64 {
        self.y.iter().map(|y| y * y).sum()
    }
}

/// Why there is no factor.
#[derive(Debug)]
pub enum Refused {
    /// The pivot of this unknown is not positive.
    NotPositive(u32),
    /// The run has to end.
    Ended(Error),
}

impl<T: Number> Multifrontal<T> {
    /// Factors, eliminates `b` over a power of two along, and returns the Schur complement of the kept unknowns.
    ///
    /// # Errors
    /// A matrix that is not positive definite; the end of the run.
    pub fn new(
        elements: &impl Elements,
        analysis: Analysis,
        b: Vec<f64>,
        unit: f64,
    ) -> Result<(Self, Forward, Schur), Refused> {
        let mut y = gather(&analysis.order, &b, unit);
        let mut kept = gather(&analysis.kept, &b, unit);
        drop(b);
        let mut columns = vec![T::ZERO; analysis.entries()];
        let work = Work {
            elements,
            order: &analysis.elements,
            unknowns: &analysis.order,
            entries: columns.len(),
            pool: Pool::new(),
        };
        let mut parts = Vec::with_capacity(analysis.blocks.len());
        let (mut columns_left, mut y_left, mut first) = (&mut columns[..], &mut y[..], 0);
        for (plan, border) in &analysis.blocks {
            let (own, others) = columns_left.split_at_mut(plan.entries);
            let (own_y, other_y) = y_left.split_at_mut(plan.pivots);
            (columns_left, y_left) = (others, other_y);
            parts.push((plan, border, own, own_y, first));
            first += plan.pivots;
        }
        let factored: Vec<_> = parts
            .into_par_iter()
            .map(|(plan, border, columns, y, first)| {
                let (update, rest) = work.factor(plan, columns, y, first)?;
                Ok((border.clone(), square(&update, rest.len()), rest))
            })
            .collect();
        drop(work);
        clear_registers_everywhere();
        let mut blocks = Vec::with_capacity(factored.len());
        for block in factored {
            let (border, dense, rest) = block?;
            for (value, &p) in rest.iter().zip(&border) {
                kept[p as usize] += value;
            }
            blocks.push((border, dense));
        }
        let aside = analysis.aside(elements);
        let schur = Schur::new(
            analysis.kept.clone(),
            blocks,
            aside,
            Arc::clone(&analysis.lu),
        );
        let factor = Multifrontal { analysis, columns };
        Ok((factor, Forward { y, kept }, schur))
    }

    /// Forward elimination of a further right-hand side over a power of two.
    pub fn forward(&self, b: &[f64], unit: f64) -> Forward {
        let analysis = &self.analysis;
        let mut y = gather(&analysis.order, b, unit);
        let mut kept = gather(&analysis.kept, b, unit);
        let rests: Vec<Vec<f64>> = self
            .parts(&mut y)
            .into_par_iter()
            .map(|(plan, _, columns, y)| forward(plan, columns, y))
            .collect();
        for (rest, (_, border)) in rests.iter().zip(&analysis.blocks) {
            for (value, &p) in rest.iter().zip(border) {
                kept[p as usize] += value;
            }
        }
        Forward { y, kept }
    }

    /// The eliminated unknowns, where the kept ones have the values `kept`; those in `x`, where
    /// fixed ones are left as they are.
    pub fn backward(&self, forward: &Forward, kept: &[f64], x: &mut [f64]) {
        let analysis = &self.analysis;
        let mut y = forward.y.clone();
        self.parts(&mut y)
            .into_par_iter()
            .for_each(|(plan, border, columns, y)| {
                let border: Vec<f64> = border.iter().map(|&p| kept[p as usize]).collect();
                backward(plan, columns, y, &border);
            });
        let all = x.par_iter_mut().zip(&analysis.numbers);
        all.with_min_len(1 << 14).for_each(|(x, &number)| {
            let number = number as usize;
            let of_kept = number.checked_sub(y.len()).map(|k| kept.get(k));
            // Fixed ones have no number.
            if let Some(value) = of_kept.unwrap_or(y.get(number)) {
                *x = *value;
            }
        });
    }
}

/// The numbers of these unknowns over a power of two.
fn gather(unknowns: &[u32], of_all: &[f64], unit: f64) -> Vec<f64> {
    let numbers = unknowns.par_iter().with_min_len(1 << 14);
    numbers.map(|&k| of_all[k as usize] / unit).collect()
}

/// A part of the frontier: its plan, border and columns, and its share of a vector.
type Share<'a, T> = (&'a Plan, &'a [u32], &'a [T], &'a mut [f64]);

impl<T> Multifrontal<T> {
    /// The parts of the frontier, with their shares of `y`.
    fn parts<'a>(&'a self, mut y: &'a mut [f64]) -> Vec<Share<'a, T>> {
        let mut columns = &self.columns[..];
        let part = |(plan, border): &'a (Plan, Vec<u32>)| {
            let (own, others) = columns.split_at(plan.entries);
            let (own_y, other_y) = std::mem::take(&mut y).split_at_mut(plan.pivots);
            (columns, y) = (others, other_y);
            (plan, &border[..], own, own_y)
        };
        self.analysis.blocks.iter().map(part).collect()
    }
}

/// The lower triangle of the Schur complement on the border of a part, by columns, and the
/// right-hand side there.
type Update<T> = (Vec<T>, Vec<f64>);

struct Work<'a, E, T> {
    elements: &'a E,
    /// The elements and the unknowns in their orders.
    order: &'a [u32],
    unknowns: &'a [u32],
    /// Of the whole factor.
    entries: usize,
    pool: Pool<T>,
}

impl<E: Elements, T: Number> Work<'_, E, T> {
    /// Writes the columns of a part; `y` are its own pivots, which start at `first`.
    fn factor(
        &self,
        plan: &Plan,
        columns: &mut [T],
        y: &mut [f64],
        first: usize,
    ) -> Result<Update<T>, Refused> {
        cancel::check().map_err(Refused::Ended)?;
        let Some(halves) = &plan.halves else {
            return self.factor_all(plan, columns, y, first);
        };
        let (left, right) = (&halves[0], &halves[1]);
        let (of_left, others) = columns.split_at_mut(left.entries);
        let (of_right, columns) = others.split_at_mut(right.entries);
        let (y_left, y_rest) = y.split_at_mut(left.pivots);
        let (y_right, y_own) = y_rest.split_at_mut(right.pivots);
        let middle = first + left.pivots;
        let own = middle + right.pivots;
        let (a, b) = rayon::join(
            || self.factor(left, of_left, y_left, first),
            || self.factor(right, of_right, y_right, middle),
        );
        let ((a_update, a_rest), (b_update, b_rest)) = (a?, b?);
        cancel::check().map_err(Refused::Ended)?;
        let front = plan.fronts[0];
        let (size, pivots) = (front.size(), front.pivots as usize);
        let (in_panel, in_update) = (size * pivots, (size - pivots).pow(2));
        // Up here no smaller front will come, and memory is shortest.
        let is_last = 6 * plan.entries > self.entries;
        if is_last {
            self.pool.forget_below(in_panel);
        }
        let done = |room| {
            if !is_last {
                self.pool.give(room);
            }
        };
        let mut panel = self.pool.take(in_panel);
        let mut update = self.pool.take(in_update);
        let (in_a, in_b) = plan.maps.split_at(left.border);
        let own_panel = &mut panel[..in_panel];
        let own_update = &mut update[..in_update];
        sum_halves(
            &front,
            own_panel,
            own_update,
            [(&a_update, in_a), (&b_update, in_b)],
        );
        done(a_update);
        done(b_update);
        eliminate(own_panel, size, pivots, own_update)
            .map_err(|k| Refused::NotPositive(self.unknowns[own + k]))?;
        store(own_panel, size, columns);
        done(panel);
        pack(own_update, size - pivots);
        if is_last {
            update.truncate(triangle(size - pivots));
            update.shrink_to_fit();
        }
        let rest = forward_above(plan, columns, y_own, [&a_rest, &b_rest]);
        Ok((update, rest))
    }

    /// The same for a part whose fronts are done one after the other.
    fn factor_all(
        &self,
        plan: &Plan,
        mut columns: &mut [T],
        mut y: &mut [f64],
        mut pivot: usize,
    ) -> Result<Update<T>, Refused> {
        let size = self.elements.size();
        let mut matrix = vec![0.0; size * size];
        // Updates that wait for their other half, the last one on top, and the sizes of their borders.
        let mut waiting: Vec<usize> = Vec::new();
        let (mut top, mut highest) = (0, 0);
        for front in &plan.fronts {
            if !front.is_leaf() {
                let halves = waiting.split_off(waiting.len().saturating_sub(2));
                top -= halves.into_iter().map(triangle).sum::<usize>();
            }
            waiting.push(front.border as usize);
            top += triangle(front.border as usize);
            highest = highest.max(top);
        }
        waiting.clear();
        top = 0;
        let largest = |of: fn(&Front) -> usize| plan.fronts.iter().map(of).max().unwrap_or(0);
        let mut stack = self.pool.take(highest);
        let mut panel = self
            .pool
            .take(largest(|front| front.size() * front.pivots as usize));
        let mut update = self
            .pool
            .take(largest(|front| (front.border as usize).pow(2)));
        let mut sides = Sides::default();
        let mut element = plan.from;
        let mut places = plan.places.chunks_exact(size);
        for front in &plan.fronts {
            let (f, p) = (front.size(), front.pivots as usize);
            let b = f - p;
            let (panel, update) = (&mut panel[..f * p], &mut update[..b * b]);
            let mut target = Target::new(front, panel, update);
            if front.is_leaf() {
                for place in places.by_ref().take(front.elements as usize) {
                    self.elements
                        .matrix(self.order[element] as usize, &mut matrix);
                    target.add_element(&matrix, place);
                    element += 1;
                }
            } else {
                let (second, first) = (waiting.pop(), waiting.pop());
                let (q, r) = (first.unwrap_or(0), second.unwrap_or(0));
                let middle = top - triangle(r);
                let start = middle - triangle(q);
                let maps = &plan.maps[front.map as usize..][..q + r];
                let (in_first, in_second) = maps.split_at(q);
                target.add(columns_of(&stack[start..middle], q), in_first);
                target.add(columns_of(&stack[middle..top], r), in_second);
                top = start;
            }
            eliminate(panel, f, p, update)
                .map_err(|k| Refused::NotPositive(self.unknowns[pivot + k]))?;
            pivot += p;
            let (own, others) = std::mem::take(&mut columns).split_at_mut(front.entries());
            store(panel, f, own);
            columns = others;
            let (own_y, others) = std::mem::take(&mut y).split_at_mut(p);
            sides.forward(plan, front, own, own_y);
            y = others;
            let mut waits = &mut stack[top..];
            for (j, column) in update.chunks_exact(b.max(1)).enumerate() {
                let (own, others) = waits.split_at_mut(b - j);
                own.copy_from_slice(&column[j..]);
                waits = others;
            }
            waiting.push(b);
            top += triangle(b);
        }
        let mut whole = self.pool.take(top);
        whole[..top].copy_from_slice(&stack[..top]);
        for room in [stack, panel, update] {
            self.pool.give(room);
        }
        Ok((whole, sides.rest()))
    }
}

/// Entries of a lower triangle.
fn triangle(size: usize) -> usize {
    size * (size + 1) / 2
}

/// Moves the lower triangle of a square to its front: what waits takes half of the room.
fn pack<T: Number>(update: &mut [T], border: usize) {
    let mut end = 0;
    for j in 0..border {
        update.copy_within(j * border + j..(j + 1) * border, end);
        end += border - j;
    }
}

/// The columns of a lower triangle that follow one another.
fn columns_of<T>(update: &[T], border: usize) -> impl Iterator<Item = &[T]> {
    (1..=border).rev().scan(update, |rest, length| {
        let (column, other) = rest.split_at(length);
        *rest = other;
        Some(column)
    })
}

/// The symmetric matrix with this lower triangle, by columns.
fn square<T: Number>(lower: &[T], size: usize) -> Mat<f64> {
    let mut square = Mat::zeros(size, size);
    let at = |i: usize, j: usize| lower[start_of(j, size) + i - j].wide();
    let columns = square.as_mut().par_col_iter_mut().enumerate();
    columns.for_each(|(j, column)| {
        for (i, a) in column.iter_mut().enumerate() {
            *a = at(i.max(j), i.min(j));
        }
    });
    square
}

/// Where column j of a lower triangle starts.
fn start_of(j: usize, size: usize) -> usize {
    j * size - triangle(j) + j
}

/// The front above two halves, the lower triangles of whose updates and their places in it these are.
fn sum_halves<T: Number>(
    front: &Front,
    panel: &mut [T],
    update: &mut [T],
    halves: [(&[T], &[u32]); 2],
) {
    let (size, pivots, border) = (front.size(), front.pivots as usize, front.border as usize);
    // The column of each half that comes to each one here.
    let mut sources = vec![[None; 2]; size];
    for (half, (_, places)) in halves.iter().enumerate() {
        for (k, &place) in places.iter().enumerate() {
            sources[place as usize][half] = Some(k);
        }
    }
    let runs = halves.map(|(_, places)| runs(places, pivots));
    // `column` starts in row `first`.
    let sum = |j: usize, first: usize, column: &mut [T]| {
        column[j - first..].fill(T::ZERO);
        for ((source, (update, places)), runs) in sources[j].iter().zip(&halves).zip(&runs) {
            let Some(k) = *source else { continue };
            let start = start_of(k, places.len());
            let mut values = &update[start..start + places.len() - k];
            let mut from = k;
            for &(_, end) in &runs[runs.partition_point(|run| run.1 <= k)..] {
                let (part, rest) = values.split_at(end - from);
                let target = &mut column[places[from] as usize - first..];
                target
                    .iter_mut()
                    .zip(part)
                    .for_each(|(x, value)| *x += *value);
                (from, values) = (end, rest);
            }
        }
    };
    let columns = panel.par_chunks_mut(size.max(1)).enumerate();
    columns
        .with_min_len(COLUMNS)
        .for_each(|(j, column)| sum(j, 0, column));
    let columns = update.par_chunks_mut(border.max(1)).enumerate();
    columns
        .with_min_len(COLUMNS)
        .for_each(|(j, column)| sum(pivots + j, pivots, column));
}

/// Columns of a front that one task sums.
const COLUMNS: usize = 64;

/// An update up to this size is added entry by entry, larger ones by runs of them.
const SHORT: usize = 16;

/// Up to so many rows all of a front is cleared at once, and not only its lower triangle.
const WHOLE: usize = 64;

/// A front while it is summed.
struct Target<'a, T> {
    panel: &'a mut [T],
    update: &'a mut [T],
    size: usize,
    pivots: usize,
}

impl<'a, T: Number> Target<'a, T> {
    /// Clears the lower triangle of the front.
    fn new(front: &Front, panel: &'a mut [T], update: &'a mut [T]) -> Self {
        let (size, border) = (front.size(), front.border as usize);
        for (rows, columns) in [(size, &mut *panel), (border, &mut *update)] {
            if rows <= WHOLE {
                columns.fill(T::ZERO);
                continue;
            }
            for (j, column) in columns.chunks_exact_mut(rows).enumerate() {
                column[j..].fill(T::ZERO);
            }
        }
        Target {
            panel,
            update,
            size,
            pivots: front.pivots as usize,
        }
    }

    /// Column j of the front, and the row that it starts with.
    fn column(&mut self, j: usize) -> (&mut [T], usize) {
        if j < self.pivots {
            (&mut self.panel[j * self.size..(j + 1) * self.size], 0)
        } else {
            let border = self.size - self.pivots;
            let j = j - self.pivots;
            (&mut self.update[j * border..(j + 1) * border], self.pivots)
        }
    }

    /// Adds an element's matrix.
    fn add_element(&mut self, matrix: &[f64], places: &[u8]) {
        for (values, &j) in matrix.chunks_exact(places.len()).zip(places) {
            if j == Plan::FIXED {
                continue;
            }
            let (column, first) = self.column(j as usize);
            for (value, &i) in values.iter().zip(places) {
                if i >= j && i != Plan::FIXED {
                    column[i as usize - first] += T::of(*value);
                }
            }
        }
    }

    /// Adds an update, the columns of whose lower triangle these are; `places` ascend.
    fn add<'u>(&mut self, update: impl Iterator<Item = &'u [T]>, places: &[u32])
    where
        T: 'u,
    {
        if places.len() <= SHORT {
            for (j, values) in update.enumerate() {
                let (column, first) = self.column(places[j] as usize);
                for (value, &i) in values.iter().zip(&places[j..]) {
                    column[i as usize - first] += *value;
                }
            }
            return;
        }
        let runs = runs(places, self.pivots);
        let mut run = 0;
        for (j, mut values) in update.enumerate() {
            let (column, first) = self.column(places[j] as usize);
            while runs[run].1 <= j {
                run += 1;
            }
            let mut from = j;
            for &(_, end) in &runs[run..] {
                let start = places[from] as usize - first;
                let (part, rest) = values.split_at(end - from);
                for (x, value) in column[start..].iter_mut().zip(part) {
                    *x += *value;
                }
                (from, values) = (end, rest);
            }
        }
    }
}

/// Ranges of indices whose places follow one another, not across the end of the pivots.
fn runs(places: &[u32], pivots: usize) -> Vec<(usize, usize)> {
    let mut runs = Vec::with_capacity(8);
    let mut from = 0;
    for k in 1..=places.len() {
        let goes_on =
            k < places.len() && places[k] == places[k - 1] + 1 && places[k] as usize != pivots;
        if !goes_on {
            runs.push((from, k));
            from = k;
        }
    }
    runs
}

/// Copies the columns of a panel from their diagonals on, which are inverted.
fn store<T: Number>(panel: &[T], size: usize, mut columns: &mut [T]) {
    for (j, column) in panel.chunks_exact(size.max(1)).enumerate() {
        let (own, others) = std::mem::take(&mut columns).split_at_mut(size - j);
        own.copy_from_slice(&column[j..]);
        own[0] = T::ONE / own[0];
        columns = others;
    }
}
