//! Triangular solves with the columns that [`super::multifrontal`] writes, by the same tree.

use super::kernels::{Number, dot};
use super::plan::{Front, Plan};

/// The columns of a part with its share of a vector: what is below their diagonals, these inverted, and y.
pub(super) struct Share<'a, T> {
    pub below: &'a [T],
    pub inverse: &'a [f64],
    pub y: &'a mut [f64],
}

impl<'a, T> Share<'a, T> {
    /// Those of the first pivots, of whose columns `below` entries are, and those of the others.
    pub fn split_at(self, below: usize, pivots: usize) -> (Self, Self) {
        let (below, other_below) = self.below.split_at(below);
        let (inverse, other_inverse) = self.inverse.split_at(pivots);
        let (y, other_y) = self.y.split_at_mut(pivots);
        let others = Share {
            below: other_below,
            inverse: other_inverse,
            y: other_y,
        };
        (Share { below, inverse, y }, others)
    }

    /// Those of the two halves, and of the front above them.
    fn thirds(self, [left, right]: &[Plan; 2]) -> [Self; 3] {
        let (of_left, others) = self.split_at(left.below(), left.pivots);
        let (of_right, own) = others.split_at(right.below(), right.pivots);
        [of_left, of_right, own]
    }
}

/// The columns of a front, below their diagonals.
#[derive(Clone, Copy)]
pub(super) enum Columns<'a, T> {
    /// As they are stored, one behind the other.
    Stored(&'a [T]),
    /// In a front that has just been eliminated, by columns with a given number of rows.
    InFront(&'a [T], usize),
}

impl<'a, T: Copy> Columns<'a, T> {
    /// Column j of a front with `size` rows.
    #[inline(always)]
    fn at(self, j: usize, size: usize) -> &'a [T] {
        match self {
            Columns::Stored(columns) => {
                let start = j * size - j * (j + 1) / 2;
                &columns[start..start + size - j - 1]
            }
            Columns::InFront(columns, rows) => &columns[j * rows + j + 1..(j + 1) * rows],
        }
    }

    /// Four that follow one another.
    #[inline(always)]
    fn four(self, j: usize, size: usize) -> [&'a [T]; FOUR] {
        std::array::from_fn(|k| self.at(j + k, size))
    }
}

/// Right-hand sides in the fronts of a part that are done one after the other.
#[derive(Default)]
pub(super) struct Sides {
    /// Contributions that wait for their other half, the last one on top, and their sizes.
    waiting: Vec<f64>,
    counts: Vec<usize>,
    /// Of one front.
    x: Vec<f64>,
}

impl Sides {
    /// y := L⁻¹ y in the next front of the part.
    pub fn forward<T: Number>(
        &mut self,
        plan: &Plan,
        front: &Front,
        columns: Columns<T>,
        inverse: &[f64],
        y: &mut [f64],
    ) {
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
        forward_front(columns, inverse, &mut self.x);
        let (pivots, border) = self.x.split_at(y.len());
        y.copy_from_slice(pivots);
        self.waiting.extend_from_slice(border);
        self.counts.push(border.len());
    }

    /// The values of the last front on its border.
    pub fn rest(self) -> Vec<f64> {
        self.waiting
    }
}

fn add<P: Copy + Into<u32>>(x: &mut [f64], places: &[P], values: &[f64]) {
    for (&place, value) in places.iter().zip(values) {
        x[place.into() as usize] += value;
    }
}

/// y := L⁻¹ y in a front above two parts, which left `below`; returns what it leaves on the border.
pub(super) fn forward_above<T: Number>(
    plan: &Plan,
    columns: Columns<T>,
    inverse: &[f64],
    y: &mut [f64],
    below: [&[f64]; 2],
) -> Vec<f64> {
    let mut x = vec![0.0; plan.fronts[0].size()];
    x[..y.len()].copy_from_slice(y);
    let (in_left, in_right) = plan.above.split_at(below[0].len());
    add(&mut x, in_left, below[0]);
    add(&mut x, in_right, below[1]);
    forward_front(columns, inverse, &mut x);
    y.copy_from_slice(&x[..y.len()]);
    x.split_off(y.len())
}

/// x := L⁻¹ x in one front; `x` are what comes to its pivots and to its border.
fn forward_front<T: Number>(columns: Columns<T>, inverse: &[f64], x: &mut [f64]) {
    let size = x.len();
    let single = inverse.len() - inverse.len() % FOUR;
    for j in (0..single).step_by(FOUR) {
        let [a, b, c, d] = columns.four(j, size);
        let (heads, tail) = x[j..].split_at_mut(FOUR);
        heads[0] *= inverse[j];
        heads[1] = (heads[1] - a[0].wide() * heads[0]) * inverse[j + 1];
        heads[2] = (heads[2] - (a[1].wide() * heads[0] + b[0].wide() * heads[1])) * inverse[j + 2];
        let of_others = a[2].wide() * heads[0] + b[1].wide() * heads[1] + c[0].wide() * heads[2];
        heads[3] = (heads[3] - of_others) * inverse[j + 3];
        let rows = a[3..].iter().zip(&b[2..]).zip(&c[1..]).zip(d);
        for (x, (((a, b), c), d)) in tail.iter_mut().zip(rows) {
            *x -= (a.wide() * heads[0] + b.wide() * heads[1])
                + (c.wide() * heads[2] + d.wide() * heads[3]);
        }
    }
    for j in single..inverse.len() {
        let (head, tail) = x[j..].split_at_mut(1);
        head[0] *= inverse[j];
        for (x, l) in tail.iter_mut().zip(columns.at(j, size)) {
            *x -= l.wide() * head[0];
        }
    }
}

/// x := L⁻ᵀ x in one front; `x` are y of its pivots and the values on its border.
fn backward_front<T: Number>(columns: &[T], inverse: &[f64], x: &mut [f64]) {
    let (columns, size) = (Columns::Stored(columns), x.len());
    let single = inverse.len() - inverse.len() % FOUR;
    for j in (single..inverse.len()).rev() {
        let (head, tail) = x[j..].split_at_mut(1);
        head[0] = (head[0] - dot(columns.at(j, size), tail)) * inverse[j];
    }
    for j in (0..single).step_by(FOUR).rev() {
        let [a, b, c, d] = columns.four(j, size);
        let (heads, tail) = x[j..].split_at_mut(FOUR);
        let of_tail = dots([&a[3..], &b[2..], &c[1..], d], tail);
        heads[3] = (heads[3] - of_tail[3]) * inverse[j + 3];
        heads[2] = (heads[2] - (of_tail[2] + c[0].wide() * heads[3])) * inverse[j + 2];
        let of_others = b[0].wide() * heads[2] + b[1].wide() * heads[3];
        heads[1] = (heads[1] - (of_tail[1] + of_others)) * inverse[j + 1];
        let of_others = a[0].wide() * heads[1] + a[1].wide() * heads[2] + a[2].wide() * heads[3];
        heads[0] = (heads[0] - (of_tail[0] + of_others)) * inverse[j];
    }
}

/// The number of columns at a time: the vector that they multiply is read once for all of them.
const FOUR: usize = 4;

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
pub(super) fn forward<T: Number>(plan: &Plan, share: Share<T>) -> Vec<f64> {
    let Some(halves) = &plan.halves else {
        return forward_all(plan, share);
    };
    let [of_left, of_right, own] = share.thirds(halves);
    let (a, b) = rayon::join(
        || forward(&halves[0], of_left),
        || forward(&halves[1], of_right),
    );
    let columns = Columns::Stored(own.below);
    forward_above(plan, columns, own.inverse, own.y, [&a, &b])
}

fn forward_all<T: Number>(plan: &Plan, mut share: Share<T>) -> Vec<f64> {
    let mut sides = Sides::default();
    for front in &plan.fronts {
        let (own, others) = share.split_at(front.below(), front.pivots as usize);
        share = others;
        sides.forward(plan, front, Columns::Stored(own.below), own.inverse, own.y);
    }
    sides.rest()
}

/// y := L⁻ᵀ y of a part, `border` the values on its border.
pub(super) fn backward<T: Number>(plan: &Plan, share: Share<T>, border: &[f64]) {
    let Some(halves) = &plan.halves else {
        return backward_all(plan, share, border);
    };
    let [of_left, of_right, own] = share.thirds(halves);
    let mut x = [&*own.y, border].concat();
    backward_front(own.below, own.inverse, &mut x);
    own.y.copy_from_slice(&x[..own.y.len()]);
    let (in_left, in_right) = plan.above.split_at(halves[0].border);
    rayon::join(
        || backward(&halves[0], of_left, &take(&x, in_left)),
        || backward(&halves[1], of_right, &take(&x, in_right)),
    );
}

fn backward_all<T: Number>(plan: &Plan, mut share: Share<T>, border: &[f64]) {
    // Values on the borders of the fronts to come, the next one's last.
    let mut waiting = border.to_vec();
    let (mut x, mut map_end) = (Vec::new(), plan.maps.len());
    for front in plan.fronts.iter().rev() {
        let pivots = front.pivots as usize;
        let (below, before) = (share.below.len() - front.below(), share.y.len() - pivots);
        let (rest, own) = share.split_at(below, before);
        share = rest;
        let start = waiting.len() - front.border as usize;
        x.clear();
        x.extend_from_slice(own.y);
        x.extend_from_slice(&waiting[start..]);
        waiting.truncate(start);
        backward_front(own.below, own.inverse, &mut x);
        own.y.copy_from_slice(&x[..pivots]);
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
