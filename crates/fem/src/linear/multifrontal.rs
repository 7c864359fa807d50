//! Multifrontal Cholesky factorisation (I. Duff, J. Reid, ACM Trans. Math. Softw. 9, 1983).
//!
//! The matrix is never put together: each leaf of the tree sums its elements into a dense front,
//! each other front the updates of its two halves; every front eliminates its pivots and hands the
//! Schur complement on its border up. What arrives above the whole is that of the kept unknowns.
//! Only the tree decides what is done in which order, so that the result is the same with any
//! number of threads.

use std::sync::Arc;

use faer::Mat;

use super::analysis::Analysis;
use super::kernels::{Number, clear_registers_everywhere, eliminate};
use super::krylov::dot;
use super::plan::{Front, Plan};
use super::pool::Pool;
use super::substitution::{Columns, Share, Sides, backward, forward, forward_above};
use super::{Elements, Schur};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Error;
use faceoff_mesh::parallel;

/// P A Pᵀ = L Lᵀ of the eliminated unknowns, and the rows of L that belong to the kept ones.
///
/// L is computed in f64. Where it is stored in f32, what rounding took from the sum of a column is added to its diagonal, which
/// is in f64. With x_p the value at the pivot of column p the energy |Lᵀx|² is so off by rounding of Σ |l_pp l_ip| (x_i - x_p)², which is
/// of its size for any condition number of A: each step of refinement brings six digits.
pub struct Multifrontal<T> {
    analysis: Analysis,
    /// The columns of L below their diagonals, those of a part behind those of its halves, and the diagonals inverted.
    below: Vec<T>,
    inverse: Vec<f64>,
}

/// A right-hand side after its forward elimination.
#[derive(Clone)]
pub struct Forward {
    /// L⁻¹ b of the eliminated unknowns, in their order.
    y: Vec<f64>,
    /// b of the kept unknowns less what the eliminated ones brought.
    pub kept: Vec<f64>,
}

impl Forward {
    /// |L⁻¹b|² of the eliminated unknowns: the energy that is left with the kept ones at 0.
    pub fn energy(&self) -> f64 {
        dot(&self.y, &self.y)
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
        let mut below = vec![T::ZERO; analysis.entries() - y.len()];
        let mut inverse = vec![0.0; y.len()];
        let work = Work {
            elements,
            order: &analysis.elements,
            unknowns: &analysis.order,
            entries: analysis.entries(),
            pool: Pool::new(),
        };
        let mut rest = Room {
            below: &mut below,
            inverse: &mut inverse,
            y: &mut y,
            first: 0,
        };
        let mut parts = Vec::with_capacity(analysis.blocks.len());
        for (plan, border) in &analysis.blocks {
            let (own, others) = rest.split_at(plan.below(), plan.pivots);
            rest = others;
            parts.push((plan, border, own));
        }
        let factored = parallel::map(parts, |(plan, border, room)| {
            let (update, rest) = work.factor(plan, room)?;
            Ok((border.clone(), square(&update, rest.len()), rest))
        });
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
        let factor = Multifrontal {
            analysis,
            below,
            inverse,
        };
        Ok((factor, Forward { y, kept }, schur))
    }

    /// Forward elimination of a further right-hand side over a power of two.
    pub fn forward(&self, b: &[f64], unit: f64) -> Forward {
        let analysis = &self.analysis;
        let mut y = gather(&analysis.order, b, unit);
        let mut kept = gather(&analysis.kept, b, unit);
        let parts = self.parts(&mut y);
        let rests = parallel::map(parts, |(plan, _, share)| forward(plan, share));
        for (rest, (_, border)) in rests.iter().zip(&analysis.blocks) {
            for (value, &p) in rest.iter().zip(border) {
                kept[p as usize] += value;
            }
        }
        Forward { y, kept }
    }

    /// The eliminated unknowns, where the kept ones have the values `kept`; those in `x`, where
    /// fixed ones are left as they are.
    pub fn backward(&self, forward: Forward, kept: &[f64], x: &mut [f64]) {
        let analysis = &self.analysis;
        let mut y = forward.y;
        parallel::map(self.parts(&mut y), |(plan, border, share)| {
            let border: Vec<f64> = border.iter().map(|&p| kept[p as usize]).collect();
            backward(plan, share, &border);
        });
        parallel::update(x, |k, x| {
            let number = analysis.numbers[k] as usize;
            let of_kept = number.checked_sub(y.len()).map(|k| kept.get(k));
            // Fixed ones have no number.
            of_kept.unwrap_or(y.get(number)).copied().unwrap_or(x)
        });
    }
}

/// The numbers of these unknowns over a power of two.
fn gather(unknowns: &[u32], of_all: &[f64], unit: f64) -> Vec<f64> {
    let mut numbers = vec![0.0; unknowns.len()];
    parallel::update(&mut numbers, |k, _| of_all[unknowns[k] as usize] / unit);
    numbers
}

impl<T> Multifrontal<T> {
    /// The parts of the frontier, their borders, and their columns with their shares of `y`.
    fn parts<'a>(&'a self, y: &'a mut [f64]) -> Vec<(&'a Plan, &'a [u32], Share<'a, T>)> {
        let mut rest = Share {
            below: &self.below,
            inverse: &self.inverse,
            y,
        };
        let mut parts = Vec::with_capacity(self.analysis.blocks.len());
        for (plan, border) in &self.analysis.blocks {
            let (own, others) = rest.split_at(plan.below(), plan.pivots);
            rest = others;
            parts.push((plan, &border[..], own));
        }
        parts
    }
}

/// The output of a part: its columns, as [`Multifrontal`] has them, and y of its pivots, of which `first` is the first.
struct Room<'a, T> {
    below: &'a mut [T],
    inverse: &'a mut [f64],
    y: &'a mut [f64],
    first: usize,
}

impl<T: Number> Room<'_, T> {
    /// That of the first pivots, of whose columns `below` entries are, and that of the others.
    fn split_at(self, below: usize, pivots: usize) -> (Self, Self) {
        let (below, other_below) = self.below.split_at_mut(below);
        let (inverse, other_inverse) = self.inverse.split_at_mut(pivots);
        let (y, other_y) = self.y.split_at_mut(pivots);
        let others = Room {
            below: other_below,
            inverse: other_inverse,
            y: other_y,
            first: self.first + pivots,
        };
        let own = Room {
            below,
            inverse,
            y,
            first: self.first,
        };
        (own, others)
    }

    /// Inverts the diagonals of a front that has been eliminated.
    fn invert(&mut self, panel: &[f64], size: usize) {
        let diagonals = panel.iter().step_by(size + 1);
        for (inverse, diagonal) in self.inverse.iter_mut().zip(diagonals) {
            *inverse = 1.0 / diagonal;
        }
    }

    /// Copies its columns.
    fn store(self, panel: &[f64], size: usize) {
        let mut below = self.below;
        let columns = panel.chunks_exact(size.max(1)).enumerate();
        for ((j, column), inverse) in columns.zip(self.inverse) {
            let (own, others) = below.split_at_mut(size - j - 1);
            below = others;
            let lost = T::store(&column[j + 1..], own);
            if lost != 0.0 {
                *inverse = 1.0 / (column[j] + lost);
            }
        }
    }
}

/// The lower triangle of the Schur complement on the border of a part, by columns, and the
/// right-hand side there.
type Update = (Vec<f64>, Vec<f64>);

struct Work<'a, E> {
    elements: &'a E,
    /// The elements and the unknowns in their orders.
    order: &'a [u32],
    unknowns: &'a [u32],
    /// Of the whole factor.
    entries: usize,
    pool: Pool,
}

impl<E: Elements> Work<'_, E> {
    /// Writes the columns of a part, and y := L⁻¹ y.
    fn factor<T: Number>(&self, plan: &Plan, room: Room<T>) -> Result<Update, Refused> {
        cancel::check().map_err(Refused::Ended)?;
        let Some(halves) = &plan.halves else {
            return self.factor_all(plan, room);
        };
        let (left, right) = (&halves[0], &halves[1]);
        let (of_left, others) = room.split_at(left.below(), left.pivots);
        let (of_right, mut own) = others.split_at(right.below(), right.pivots);
        let (a, b) = rayon::join(
            || self.factor(left, of_left),
            || self.factor(right, of_right),
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
        let (in_a, in_b) = plan.above.split_at(left.border);
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
            .map_err(|k| Refused::NotPositive(self.unknowns[own.first + k]))?;
        own.invert(own_panel, size);
        let columns = Columns::InFront(own_panel, size);
        let rest = forward_above(plan, columns, own.inverse, own.y, [&a_rest, &b_rest]);
        own.store(own_panel, size);
        done(panel);
        pack(own_update, size - pivots);
        if is_last {
            update.truncate(triangle(size - pivots));
            update.shrink_to_fit();
        }
        Ok((update, rest))
    }

    /// The same for a part whose fronts are done one after the other.
    fn factor_all<T: Number>(&self, plan: &Plan, mut room: Room<T>) -> Result<Update, Refused> {
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
            let (mut own, others) = room.split_at(front.below(), p);
            room = others;
            eliminate(panel, f, p, update)
                .map_err(|k| Refused::NotPositive(self.unknowns[own.first + k]))?;
            own.invert(panel, f);
            sides.forward(plan, front, Columns::InFront(panel, f), own.inverse, own.y);
            own.store(panel, f);
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
fn pack(update: &mut [f64], border: usize) {
    let mut end = 0;
    for j in 0..border {
        update.copy_within(j * border + j..(j + 1) * border, end);
        end += border - j;
    }
}

/// The columns of a lower triangle that follow one another.
fn columns_of(update: &[f64], border: usize) -> impl Iterator<Item = &[f64]> {
    (1..=border).rev().scan(update, |rest, length| {
        let (column, other) = rest.split_at(length);
        *rest = other;
        Some(column)
    })
}

/// The symmetric matrix with this lower triangle, by columns.
fn square(lower: &[f64], size: usize) -> Mat<f64> {
    let mut square = Mat::zeros(size, size);
    let at = |i: usize, j: usize| lower[start_of(j, size) + i - j];
    let columns = square.as_mut().col_iter_mut().enumerate();
    parallel::map(columns, |(j, column)| {
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
fn sum_halves(front: &Front, panel: &mut [f64], update: &mut [f64], halves: [(&[f64], &[u32]); 2]) {
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
    let sum = |j: usize, first: usize, column: &mut [f64]| {
        column[j - first..].fill(0.0);
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
    let sum = |columns: &mut [f64], length: usize, first: usize| {
        let tasks = columns.chunks_mut(COLUMNS * length.max(1)).enumerate();
        parallel::map(tasks, |(task, columns)| {
            let columns = columns.chunks_mut(length.max(1));
            (first + task * COLUMNS..)
                .zip(columns)
                .for_each(|(j, column)| sum(j, first, column));
        });
    };
    sum(panel, size, 0);
    sum(update, border, pivots);
}

/// Columns of a front that one task sums.
const COLUMNS: usize = 64;

/// An update up to this size is added entry by entry, larger ones by runs of them.
const SHORT: usize = 16;

/// Up to this many rows, all of a front is cleared at once, and not only its lower triangle.
const WHOLE: usize = 64;

/// A front while it is summed.
struct Target<'a> {
    panel: &'a mut [f64],
    update: &'a mut [f64],
    size: usize,
    pivots: usize,
}

impl<'a> Target<'a> {
    /// Clears the lower triangle of the front.
    fn new(front: &Front, panel: &'a mut [f64], update: &'a mut [f64]) -> Self {
        let (size, border) = (front.size(), front.border as usize);
        for (rows, columns) in [(size, &mut *panel), (border, &mut *update)] {
            if rows <= WHOLE {
                columns.fill(0.0);
                continue;
            }
            for (j, column) in columns.chunks_exact_mut(rows).enumerate() {
                column[j..].fill(0.0);
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
    fn column(&mut self, j: usize) -> (&mut [f64], usize) {
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
                    column[i as usize - first] += *value;
                }
            }
        }
    }

    /// Adds an update, the columns of whose lower triangle these are; `places` ascend.
    fn add<'u>(&mut self, update: impl Iterator<Item = &'u [f64]>, places: &[u16]) {
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
fn runs<P: Copy + Into<u32>>(places: &[P], pivots: usize) -> Vec<(usize, usize)> {
    let place = |k: usize| places[k].into() as usize;
    let mut runs = Vec::with_capacity(8);
    let mut from = 0;
    for k in 1..=places.len() {
        let goes_on = k < places.len() && place(k) == place(k - 1) + 1 && place(k) != pivots;
        if !goes_on {
            runs.push((from, k));
            from = k;
        }
    }
    runs
}
