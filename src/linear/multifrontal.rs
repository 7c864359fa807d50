//! Multifrontal Cholesky factorisation (I. Duff, J. Reid, ACM Trans. Math. Softw. 9, 1983).
//!
//! The matrix is never put together: each leaf of the tree sums its elements into a dense front,
//! each other front the updates of its two halves; every front eliminates its pivots and hands the
//! Schur complement on its border up. What arrives above the whole is that of the kept unknowns.
//! The tree alone decides what is done in which order, so that the result is the same with any
//! number of threads.

use faer::Mat;

use super::analysis::{Analysis, Front, Plan};
use super::kernels::{Number, eliminate};
use super::{Elements, Schur};

/// P A Pᵀ = L Lᵀ of the eliminated unknowns, and the rows of L that belong to the kept ones.
pub struct Multifrontal<T> {
    analysis: Analysis,
    blocks: Option<Blocks<T>>,
}

/// The columns of L that belong to a [`Plan`], one after the other, each from its diagonal, which is inverted,
/// downwards.
struct Blocks<T> {
    halves: Option<Box<[Blocks<T>; 2]>>,
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

/// The unknown whose pivot is not positive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotPositive(pub u32);

impl<T: Number> Multifrontal<T> {
    /// Factors, eliminates `b` along, and returns the Schur complement of the kept unknowns.
    ///
    /// # Errors
    /// A matrix that is not positive definite.
    pub fn new(
        elements: &impl Elements,
        analysis: Analysis,
        b: &[f64],
    ) -> Result<(Self, Forward, Schur), NotPositive> {
        let mut dense = Mat::<f64>::zeros(analysis.border.len(), analysis.border.len());
        let mut y: Vec<f64> = analysis.order.iter().map(|&k| b[k as usize]).collect();
        let mut kept: Vec<f64> = analysis.kept.iter().map(|&k| b[k as usize]).collect();
        let mut blocks: Option<Blocks<T>> = None;
        if let Some(plan) = &analysis.plan {
            let work = Work {
                elements,
                order: &analysis.elements,
                unknowns: &analysis.order,
            };
            let (columns, update, rest) = work.factor(plan, &mut y, 0)?;
            blocks = Some(columns);
            for (j, column) in update.chunks_exact(rest.len().max(1)).enumerate() {
                for (i, value) in column.iter().enumerate().skip(j) {
                    dense[(i, j)] = value.wide();
                    dense[(j, i)] = value.wide();
                }
            }
            for (value, &p) in rest.iter().zip(&analysis.border) {
                kept[p as usize] += value;
            }
        }
        let aside = analysis.aside(elements);
        let schur = Schur::new(analysis.kept.len(), analysis.border.clone(), dense, aside);
        let factor = Multifrontal { analysis, blocks };
        Ok((factor, Forward { y, kept }, schur))
    }

    /// Forward elimination of a further right-hand side.
    pub fn forward(&self, b: &[f64]) -> Forward {
        let analysis = &self.analysis;
        let mut y: Vec<f64> = analysis.order.iter().map(|&k| b[k as usize]).collect();
        let mut kept: Vec<f64> = analysis.kept.iter().map(|&k| b[k as usize]).collect();
        if let (Some(plan), Some(blocks)) = (&analysis.plan, &self.blocks) {
            let rest = blocks.forward(plan, &mut y);
            for (value, &p) in rest.iter().zip(&analysis.border) {
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
        if let (Some(plan), Some(blocks)) = (&analysis.plan, &self.blocks) {
            let border: Vec<f64> = analysis.border.iter().map(|&p| kept[p as usize]).collect();
            blocks.backward(plan, &mut y, &border);
        }
        for (&k, value) in analysis.order.iter().zip(&y) {
            x[k as usize] = *value;
        }
        for (&k, value) in analysis.kept.iter().zip(kept) {
            x[k as usize] = *value;
        }
    }
}

/// The columns of a part, the lower triangle of the Schur complement on its border, and the
/// right-hand side there.
type Factored<T> = (Blocks<T>, Vec<T>, Vec<f64>);

struct Work<'a, E> {
    elements: &'a E,
    /// The elements and the unknowns in their orders.
    order: &'a [u32],
    unknowns: &'a [u32],
}

impl<E: Elements> Work<'_, E> {
    /// The columns of a part, its update, and its right-hand side's. `y` are its own pivots,
    /// which start at `first`.
    fn factor<T: Number>(
        &self,
        plan: &Plan,
        y: &mut [f64],
        first: usize,
    ) -> Result<Factored<T>, NotPositive> {
        let mut blocks = Blocks {
            halves: None,
            columns: Vec::with_capacity(plan.own_entries()),
        };
        let Some(halves) = &plan.halves else {
            let update = self.factor_all(plan, &mut blocks.columns, first)?;
            let rest = blocks.forward(plan, y);
            return Ok((blocks, update, rest));
        };
        let (left, right) = (&halves[0], &halves[1]);
        let (y_left, y_rest) = y.split_at_mut(left.pivots);
        let (y_right, y_own) = y_rest.split_at_mut(right.pivots);
        let middle = first + left.pivots;
        let own = middle + right.pivots;
        let (a, b) = rayon::join(
            || self.factor(left, y_left, first),
            || self.factor(right, y_right, middle),
        );
        let ((a, a_update, a_rest), (b, b_update, b_rest)) = (a?, b?);
        let front = plan.fronts[0];
        let (size, pivots) = (front.size(), front.pivots as usize);
        let mut panel = vec![T::ZERO; size * pivots];
        let mut update = vec![T::ZERO; (size - pivots).pow(2)];
        let (in_a, in_b) = plan.maps.split_at(left.border);
        let mut target = Target::new(&front, &mut panel, &mut update);
        target.add(&a_update, in_a);
        target.add(&b_update, in_b);
        drop((a_update, b_update));
        eliminate(&mut panel, size, pivots, &mut update)
            .map_err(|k| NotPositive(self.unknowns[own + k]))?;
        store(&panel, size, &mut blocks.columns);
        let rest = forward_front(
            &front,
            &blocks.columns,
            y_own,
            [(in_a, &a_rest), (in_b, &b_rest)],
        );
        blocks.halves = Some(Box::new([a, b]));
        Ok((blocks, update, rest))
    }

    /// The same for a part whose fronts are done one after the other.
    fn factor_all<T: Number>(
        &self,
        plan: &Plan,
        columns: &mut Vec<T>,
        mut pivot: usize,
    ) -> Result<Vec<T>, NotPositive> {
        let size = self.elements.size();
        let mut matrix = vec![0.0; size * size];
        // Updates that wait for their other half, and room of others that were taken up.
        let mut waiting: Vec<Vec<T>> = Vec::new();
        let mut free: Vec<Vec<T>> = Vec::new();
        let mut borders: Vec<usize> = Vec::new();
        let mut panel = Vec::new();
        let mut element = plan.from;
        let mut places = plan.places.chunks_exact(size);
        for front in &plan.fronts {
            let (f, p) = (front.size(), front.pivots as usize);
            let b = f - p;
            panel.clear();
            panel.resize(f * p, T::ZERO);
            let mut update = free.pop().unwrap_or_default();
            update.clear();
            update.resize(b * b, T::ZERO);
            let mut target = Target::new(front, &mut panel, &mut update);
            if front.elements > 0 {
                for place in places.by_ref().take(front.elements as usize) {
                    self.elements
                        .matrix(self.order[element] as usize, &mut matrix);
                    target.add_element(&matrix, place);
                    element += 1;
                }
            } else {
                let (second, first) = (waiting.pop(), waiting.pop());
                let (q, r) = (borders.pop().unwrap_or(0), borders.pop().unwrap_or(0));
                let start = front.map as usize;
                let (in_first, in_second) = plan.maps[start..start + q + r].split_at(r);
                for (half, places) in [(first, in_first), (second, in_second)] {
                    let half = half.unwrap_or_default();
                    target.add(&half, places);
                    free.push(half);
                }
            }
            eliminate(&mut panel, f, p, &mut update)
                .map_err(|k| NotPositive(self.unknowns[pivot + k]))?;
            pivot += p;
            store(&panel, f, columns);
            waiting.push(update);
            borders.push(b);
        }
        Ok(waiting.pop().unwrap_or_default())
    }
}

/// An update up to this size is added entry by entry, larger ones by runs of them.
const SHORT: usize = 16;

/// A front while it is summed.
struct Target<'a, T> {
    panel: &'a mut [T],
    update: &'a mut [T],
    size: usize,
    pivots: usize,
}

impl<'a, T: Number> Target<'a, T> {
    fn new(front: &Front, panel: &'a mut [T], update: &'a mut [T]) -> Self {
        Target {
            panel,
            update,
            size: front.size(),
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

    /// Adds the lower triangle of an update; `places` ascend.
    fn add(&mut self, update: &[T], places: &[u32]) {
        let border = places.len();
        if border <= SHORT {
            for (j, &place) in places.iter().enumerate() {
                let (column, first) = self.column(place as usize);
                let values = &update[j * border + j..(j + 1) * border];
                for (value, &i) in values.iter().zip(&places[j..]) {
                    column[i as usize - first] += *value;
                }
            }
            return;
        }
        let runs = runs(places, self.pivots);
        let mut run = 0;
        for (j, (values, &place)) in update.chunks_exact(border).zip(places).enumerate() {
            let (column, first) = self.column(place as usize);
            while runs[run].1 <= j {
                run += 1;
            }
            let mut from = j;
            for &(_, end) in &runs[run..] {
                let start = places[from] as usize - first;
                let target = &mut column[start..start + end - from];
                for (x, value) in target.iter_mut().zip(&values[from..end]) {
                    *x += *value;
                }
                from = end;
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

/// Appends the columns of a panel from their diagonals on, which are inverted.
fn store<T: Number>(panel: &[T], size: usize, columns: &mut Vec<T>) {
    for (j, column) in panel.chunks_exact(size.max(1)).enumerate() {
        columns.push(T::ONE / column[j]);
        columns.extend_from_slice(&column[j + 1..]);
    }
}

/// y := L⁻¹ y in one front; returns what it leaves on the border. `below` are places and values of
/// what comes from the halves.
fn forward_front<T: Number>(
    front: &Front,
    columns: &[T],
    y: &mut [f64],
    below: [(&[u32], &[f64]); 2],
) -> Vec<f64> {
    let (size, pivots) = (front.size(), front.pivots as usize);
    let mut x = vec![0.0; size];
    x[..pivots].copy_from_slice(y);
    for (places, values) in below {
        for (&place, value) in places.iter().zip(values) {
            x[place as usize] += value;
        }
    }
    let mut start = 0;
    for j in 0..pivots {
        let column = &columns[start..start + size - j];
        start += size - j;
        let (head, tail) = x[j..].split_at_mut(1);
        head[0] *= column[0].wide();
        for (x, l) in tail.iter_mut().zip(&column[1..]) {
            *x -= l.wide() * head[0];
        }
    }
    y.copy_from_slice(&x[..pivots]);
    x.split_off(pivots)
}

/// x := L⁻ᵀ x in one front; `x` are y of its pivots and the values on its border.
fn backward_front<T: Number>(columns: &[T], pivots: usize, x: &mut [f64]) {
    let size = x.len();
    let mut end = columns.len();
    for j in (0..pivots).rev() {
        let column = &columns[end - (size - j)..end];
        end -= size - j;
        let (head, tail) = x[j..].split_at_mut(1);
        head[0] = (head[0] - dot(&column[1..], tail)) * column[0].wide();
    }
}

/// Σ_i l_i x_i in four parts, which a processor does side by side.
fn dot<T: Number>(l: &[T], x: &[f64]) -> f64 {
    let (l4, l_rest) = l.as_chunks::<4>();
    let (x4, x_rest) = x.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (l, x) in l4.iter().zip(x4) {
        for k in 0..4 {
            sums[k] += l[k].wide() * x[k];
        }
    }
    let rest: f64 = l_rest.iter().zip(x_rest).map(|(l, x)| l.wide() * x).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

impl<T: Number> Blocks<T> {
    /// y := L⁻¹ y of a part; returns what it leaves on the border.
    fn forward(&self, plan: &Plan, y: &mut [f64]) -> Vec<f64> {
        let Some((halves, plans)) = self.halves.as_ref().zip(plan.halves.as_ref()) else {
            return self.forward_all(plan, y);
        };
        let (y_left, y_rest) = y.split_at_mut(plans[0].pivots);
        let (y_right, y_own) = y_rest.split_at_mut(plans[1].pivots);
        let (a, b) = rayon::join(
            || halves[0].forward(&plans[0], y_left),
            || halves[1].forward(&plans[1], y_right),
        );
        let (in_a, in_b) = plan.maps.split_at(plans[0].border);
        forward_front(
            &plan.fronts[0],
            &self.columns,
            y_own,
            [(in_a, &a), (in_b, &b)],
        )
    }

    fn forward_all(&self, plan: &Plan, mut y: &mut [f64]) -> Vec<f64> {
        let mut columns = &self.columns[..];
        let mut waiting: Vec<Vec<f64>> = Vec::new();
        for front in &plan.fronts {
            let (own, other) = columns.split_at(front.entries());
            columns = other;
            let (pivots, others) = y.split_at_mut(front.pivots as usize);
            y = others;
            let (mut a, mut b, mut maps) = (Vec::new(), Vec::new(), &[][..]);
            if front.elements == 0 {
                b = waiting.pop().unwrap_or_default();
                a = waiting.pop().unwrap_or_default();
                maps = &plan.maps[front.map as usize..][..a.len() + b.len()];
            }
            let (in_a, in_b) = maps.split_at(a.len());
            waiting.push(forward_front(front, own, pivots, [(in_a, &a), (in_b, &b)]));
        }
        waiting.pop().unwrap_or_default()
    }

    /// y := L⁻ᵀ y of a part, `border` the values on its border.
    fn backward(&self, plan: &Plan, y: &mut [f64], border: &[f64]) {
        let Some((halves, plans)) = self.halves.as_ref().zip(plan.halves.as_ref()) else {
            return self.backward_all(plan, y, border);
        };
        let (y_left, y_rest) = y.split_at_mut(plans[0].pivots);
        let (y_right, y_own) = y_rest.split_at_mut(plans[1].pivots);
        let mut x = [&*y_own, border].concat();
        backward_front(&self.columns, y_own.len(), &mut x);
        y_own.copy_from_slice(&x[..y_own.len()]);
        let (in_left, in_right) = plan.maps.split_at(plans[0].border);
        rayon::join(
            || halves[0].backward(&plans[0], y_left, &take(&x, in_left)),
            || halves[1].backward(&plans[1], y_right, &take(&x, in_right)),
        );
    }

    fn backward_all(&self, plan: &Plan, mut y: &mut [f64], border: &[f64]) {
        let mut columns = &self.columns[..];
        // Values on the borders of the fronts to come, the next one's last.
        let mut waiting = border.to_vec();
        let (mut x, mut map_end) = (Vec::new(), plan.maps.len());
        for front in plan.fronts.iter().rev() {
            let pivots = front.pivots as usize;
            let (others, own) = columns.split_at(columns.len() - front.entries());
            columns = others;
            let split = y.len() - pivots;
            let (rest, own_y) = std::mem::take(&mut y).split_at_mut(split);
            y = rest;
            let start = waiting.len() - front.border as usize;
            x.clear();
            x.extend_from_slice(own_y);
            x.extend_from_slice(&waiting[start..]);
            waiting.truncate(start);
            backward_front(own, pivots, &mut x);
            own_y.copy_from_slice(&x[..pivots]);
            if front.elements == 0 {
                let maps = &plan.maps[front.map as usize..map_end];
                map_end = front.map as usize;
                waiting.extend(maps.iter().map(|&place| x[place as usize]));
            }
        }
    }
}

/// The values at `places`.
fn take(x: &[f64], places: &[u32]) -> Vec<f64> {
    places.iter().map(|&place| x[place as usize]).collect()
}
