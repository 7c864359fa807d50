//! Triangular solves with the columns that [`super::multifrontal`] writes, by the same tree.

use super::kernels::{Number, dot};
use super::plan::{Front, Plan};

/// Right-hand sides in the fronts of a part that are done one after the other.
#[derive(Default)]
pub(super) struct Sides {
    /// What waits for its other half, the last one on top, and how much each is.
    waiting: Vec<f64>,
    counts: Vec<usize>,
    /// Of one front.
    x: Vec<f64>,
}

impl Sides {
    /// y := L⁻¹ y in the next front of the part.
    pub fn forward<T: Number>(&mut self, plan: &Plan, front: &Front, columns: &[T], y: &mut [f64]) {
        self.x.clear();
        self.x.extend_from_slice(y);
        self.x.resize(front.size(), 0.0);
        if !front.is_leaf() {
            let count = self.counts.pop().unwrap_or(0) + self.counts.pop().unwrap_or(0);
            let below = self.waiting.len() - count;
            let places = &plan.maps[front.map as usize..][..count];
            add(&mut self.x, places, &self.waiting[below..]);
            self.waiting.truncate(below);
        }
        forward_front(columns, y.len(), &mut self.x);
        let (pivots, border) = self.x.split_at(y.len());
        y.copy_from_slice(pivots);
        self.waiting.extend_from_slice(border);
        self.counts.push(border.len());
    }

    /// What the last front left on its border.
    pub fn rest(self) -> Vec<f64> {
        self.waiting
    }
}

fn add(x: &mut [f64], places: &[u32], values: &[f64]) {
    for (&place, value) in places.iter().zip(values) {
        x[place as usize] += value;
    }
}

/// y := L⁻¹ y in a front above two parts, which left `below`; returns what it leaves on the border.
pub(super) fn forward_above<T: Number>(
    plan: &Plan,
    columns: &[T],
    y: &mut [f64],
    below: [&[f64]; 2],
) -> Vec<f64> {
    let mut x = vec![0.0; plan.fronts[0].size()];
    x[..y.len()].copy_from_slice(y);
    let (in_left, in_right) = plan.maps.split_at(below[0].len());
    add(&mut x, in_left, below[0]);
    add(&mut x, in_right, below[1]);
    forward_front(columns, y.len(), &mut x);
    y.copy_from_slice(&x[..y.len()]);
    x.split_off(y.len())
}

/// x := L⁻¹ x in one front; `x` are what comes to its pivots and to its border.
fn forward_front<T: Number>(mut columns: &[T], pivots: usize, mut x: &mut [f64]) {
    for _ in 0..pivots / FOUR {
        let (four, others) = columns.split_at(FOUR * x.len() - 6);
        let [a, b, c, d] = four_columns(four, x.len());
        let (heads, tail) = x.split_at_mut(FOUR);
        heads[0] *= a[0].wide();
        heads[1] = (heads[1] - a[1].wide() * heads[0]) * b[0].wide();
        heads[2] = (heads[2] - (a[2].wide() * heads[0] + b[1].wide() * heads[1])) * c[0].wide();
        let of_others = a[3].wide() * heads[0] + b[2].wide() * heads[1] + c[1].wide() * heads[2];
        heads[3] = (heads[3] - of_others) * d[0].wide();
        let rows = a[4..].iter().zip(&b[3..]).zip(&c[2..]).zip(&d[1..]);
        for (x, (((a, b), c), d)) in tail.iter_mut().zip(rows) {
            *x -= (a.wide() * heads[0] + b.wide() * heads[1])
                + (c.wide() * heads[2] + d.wide() * heads[3]);
        }
        (columns, x) = (others, tail);
    }
    for _ in 0..pivots % FOUR {
        let (column, others) = columns.split_at(x.len());
        let (head, tail) = x.split_at_mut(1);
        head[0] *= column[0].wide();
        for (x, l) in tail.iter_mut().zip(&column[1..]) {
            *x -= l.wide() * head[0];
        }
        (columns, x) = (others, tail);
    }
}

/// x := L⁻ᵀ x in one front; `x` are y of its pivots and the values on its border.
fn backward_front<T: Number>(mut columns: &[T], pivots: usize, x: &mut [f64]) {
    let single = pivots - pivots % FOUR;
    for j in (single..pivots).rev() {
        let (others, column) = columns.split_at(columns.len() - (x.len() - j));
        columns = others;
        let (head, tail) = x[j..].split_at_mut(1);
        head[0] = (head[0] - dot(&column[1..], tail)) * column[0].wide();
    }
    for j in (0..single).step_by(FOUR).rev() {
        let x = &mut x[j..];
        let (others, four) = columns.split_at(columns.len() - (FOUR * x.len() - 6));
        columns = others;
        let [a, b, c, d] = four_columns(four, x.len());
        let (heads, tail) = x.split_at_mut(FOUR);
        let of_tail = dots([&a[4..], &b[3..], &c[2..], &d[1..]], tail);
        heads[3] = (heads[3] - of_tail[3]) * d[0].wide();
        heads[2] = (heads[2] - (of_tail[2] + c[1].wide() * heads[3])) * c[0].wide();
        let of_others = b[1].wide() * heads[2] + b[2].wide() * heads[3];
        heads[1] = (heads[1] - (of_tail[1] + of_others)) * b[0].wide();
        let of_others = a[1].wide() * heads[1] + a[2].wide() * heads[2] + a[3].wide() * heads[3];
        heads[0] = (heads[0] - (of_tail[0] + of_others)) * a[0].wide();
    }
}

/// So many columns at a time: what they are multiplied with is read once for all of them.
const FOUR: usize = 4;

/// Four columns, of which the first has `length` entries and each other one less than the one before.
fn four_columns<T>(columns: &[T], length: usize) -> [&[T]; FOUR] {
    let (a, rest) = columns.split_at(length);
    let (b, rest) = rest.split_at(length - 1);
    let (c, d) = rest.split_at(length - 2);
    [a, b, c, d]
}

/// The products of four vectors with one.
fn dots<T: Number>(vectors: [&[T]; FOUR], x: &[f64]) -> [f64; FOUR] {
    let [a, b, c, d] = vectors.map(|vector| vector.as_chunks::<2>());
    let (x2, x_rest) = x.as_chunks::<2>();
    let mut sums = [[0.0; 2]; FOUR];
    let pairs = a.0.iter().zip(b.0).zip(c.0).zip(d.0);
    for ((((a, b), c), d), x) in pairs.zip(x2) {
        for (sum, l) in sums.iter_mut().zip([a, b, c, d]) {
            sum[0] += l[0].wide() * x[0];
            sum[1] += l[1].wide() * x[1];
        }
    }
    let mut all = sums.map(|[even, odd]| even + odd);
    for (sum, rest) in all.iter_mut().zip([a.1, b.1, c.1, d.1]) {
        for (l, x) in rest.iter().zip(x_rest) {
            *sum += l.wide() * x;
        }
    }
    all
}

/// y := L⁻¹ y of a part; returns what it leaves on the border.
pub(super) fn forward<T: Number>(plan: &Plan, columns: &[T], y: &mut [f64]) -> Vec<f64> {
    let Some(halves) = &plan.halves else {
        return forward_all(plan, columns, y);
    };
    let (left, right) = (&halves[0], &halves[1]);
    let (of_left, others) = columns.split_at(left.entries);
    let (of_right, columns) = others.split_at(right.entries);
    let (y_left, y_rest) = y.split_at_mut(left.pivots);
    let (y_right, y_own) = y_rest.split_at_mut(right.pivots);
    let (a, b) = rayon::join(
        || forward(left, of_left, y_left),
        || forward(right, of_right, y_right),
    );
    forward_above(plan, columns, y_own, [&a, &b])
}

fn forward_all<T: Number>(plan: &Plan, mut columns: &[T], mut y: &mut [f64]) -> Vec<f64> {
    let mut sides = Sides::default();
    for front in &plan.fronts {
        let (own, other) = columns.split_at(front.entries());
        columns = other;
        let (pivots, others) = y.split_at_mut(front.pivots as usize);
        y = others;
        sides.forward(plan, front, own, pivots);
    }
    sides.rest()
}

/// y := L⁻ᵀ y of a part, `border` the values on its border.
pub(super) fn backward<T: Number>(plan: &Plan, columns: &[T], y: &mut [f64], border: &[f64]) {
    let Some(halves) = &plan.halves else {
        return backward_all(plan, columns, y, border);
    };
    let (left, right) = (&halves[0], &halves[1]);
    let (of_left, others) = columns.split_at(left.entries);
    let (of_right, columns) = others.split_at(right.entries);
    let (y_left, y_rest) = y.split_at_mut(left.pivots);
    let (y_right, y_own) = y_rest.split_at_mut(right.pivots);
    let mut x = [&*y_own, border].concat();
    backward_front(columns, y_own.len(), &mut x);
    y_own.copy_from_slice(&x[..y_own.len()]);
    let (in_left, in_right) = plan.maps.split_at(left.border);
    rayon::join(
        || backward(left, of_left, y_left, &take(&x, in_left)),
        || backward(right, of_right, y_right, &take(&x, in_right)),
    );
}

fn backward_all<T: Number>(plan: &Plan, mut columns: &[T], mut y: &mut [f64], border: &[f64]) {
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
        if !front.is_leaf() {
            let maps = &plan.maps[front.map as usize..map_end];
            map_end = front.map as usize;
            waiting.extend(maps.iter().map(|&place| x[place as usize]));
        }
    }
}

/// The values at `places`.
fn take(x: &[f64], places: &[u32]) -> Vec<f64> {
    places.iter().map(|&place| x[place as usize]).collect()
}
