//! Recursive coordinate bisection of points: the binary tree that elimination follows
//! (George 1973 on grids; M. Berger, S. Bokhari, IEEE Trans. Comput. 36, 1987).

use rayon::prelude::*;

/// A part with at most so many points is not cut further.
const LEAF: usize = 4;
/// Parts from this size on are cut by several threads; the result does not depend on how many.
const PARALLEL: usize = 1 << 14;
/// Parts up to this size are sorted along each axis, larger ones are counted into bins.
const SORTED: usize = 1024;
const BINS: usize = 1024;
/// About so many points tell where the median is.
const SAMPLE: usize = 1 << 12;
/// How far a cut may move off the median to fall into a gap, in points of a row across.
const ROWS: f64 = 8.0;

const NONE: u32 = u32::MAX;

/// A part of the points: a leaf, or two parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Part {
    /// Its points are `order[from..to]`.
    pub from: u32,
    pub to: u32,
    /// The first of the two parts, none in a leaf; the second is the node just before this one.
    left: u32,
}

impl Part {
    pub fn left(&self) -> Option<usize> {
        (self.left != NONE).then_some(self.left as usize)
    }

    pub fn len(&self) -> usize {
        (self.to - self.from) as usize
    }
}

/// The tree, its parts in postorder: a part stands behind the two that it was cut into.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Tree {
    /// Indices of the points, those of a part side by side.
    pub order: Vec<u32>,
    pub parts: Vec<Part>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Point {
    at: [f32; 3],
    index: u32,
}

impl Tree {
    /// How many cuts each point stays with the lower part, of `most`; small parts are not cut.
    pub fn depths(
        members: &[u32],
        place: impl Fn(u32) -> [f64; 3] + Sync,
        most: u8,
    ) -> Vec<(u32, u8)> {
        let mut points = points(members, place);
        let mut spare = room(points.len());
        let mut depths = Vec::with_capacity(points.len());
        let mut rest = &mut points[..];
        for depth in 0..most {
            if rest.len() <= SORTED {
                break;
            }
            let room = &mut spare[..rest.len()];
            let middle = split(rest, room);
            let (low, high) = rest.split_at_mut(middle);
            depths.extend(high.iter().map(|point| (point.index, depth)));
            rest = low;
        }
        depths.extend(rest.iter().map(|point| (point.index, most)));
        depths
    }

    /// Cuts the points across their longest extent near the median, where a gap between the
    /// points is widest, so that on a regular mesh the cuts follow its lines.
    ///
    /// `members` are the numbers of the points, `place` their coordinates.
    pub fn new(members: &[u32], place: impl Fn(u32) -> [f64; 3] + Sync) -> Self {
        let mut points = points(members, place);
        let mut spare = room(points.len());
        let parts = if points.is_empty() {
            Vec::new()
        } else {
            cut(&mut points, &mut spare, 0)
        };
        Tree {
            order: points.par_iter().map(|p| p.index).collect(),
            parts,
        }
    }
}

/// Room for so many points, which all cores have written.
fn room(count: usize) -> Vec<Point> {
    let points = rayon::iter::repeat_n(Point::default(), count);
    points.with_min_len(PARALLEL).collect()
}

/// The points in the unit cube.
fn points(members: &[u32], place: impl Fn(u32) -> [f64; 3] + Sync) -> Vec<Point> {
    let nothing = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let (low, high) = members
        .par_iter()
        .fold(
            || nothing,
            |(low, high), &member| {
                let at = place(member);
                (
                    std::array::from_fn(|k| at[k].min(low[k])),
                    std::array::from_fn(|k| at[k].max(high[k])),
                )
            },
        )
        .reduce(
            || nothing,
            |a, b| {
                (
                    std::array::from_fn(|k| a.0[k].min(b.0[k])),
                    std::array::from_fn(|k| a.1[k].max(b.1[k])),
                )
            },
        );
    let extent = (0..3).fold(0.0, |e: f64, k| e.max(high[k] - low[k]));
    let scale = if extent > 0.0 { 1.0 / extent } else { 1.0 };
    members
        .par_iter()
        .map(|&index| {
            let at = place(index);
            Point {
                at: std::array::from_fn(|k| ((at[k] - low[k]) * scale) as f32),
                index,
            }
        })
        .collect()
}

/// Cuts `points`, which start at `from` in the order; `spare` is room for as many. The depth is
/// bounded by the logarithm of their number: no part is larger than 7/8 of the whole.
fn cut(points: &mut [Point], spare: &mut [Point], from: usize) -> Vec<Part> {
    let mut parts = Vec::with_capacity(4 * points.len() / LEAF + 1);
    if points.len() < PARALLEL {
        cut_into(points, spare, from, &mut parts);
        return parts;
    }
    let middle = split(points, spare);
    let (low, high) = points.split_at_mut(middle);
    let (low_spare, high_spare) = spare.split_at_mut(middle);
    let (first, second) = rayon::join(
        || cut(low, low_spare, from),
        || cut(high, high_spare, from + middle),
    );
    let left = first.len();
    parts.extend(first);
    parts.extend(second.into_iter().map(|mut part| {
        if part.left != NONE {
            part.left += left as u32;
        }
        part
    }));
    parts.push(Part {
        from: from as u32,
        to: (from + points.len()) as u32,
        left: left as u32 - 1,
    });
    parts
}

fn cut_into(points: &mut [Point], spare: &mut [Point], from: usize, parts: &mut Vec<Part>) {
    if points.len() <= SORTED {
        return Sorted::new(points).cut(points, from, parts);
    }
    let middle = split(points, spare);
    let (low, high) = points.split_at_mut(middle);
    let (low_spare, high_spare) = spare.split_at_mut(middle);
    cut_into(low, low_spare, from, parts);
    let left = parts.len() as u32 - 1;
    cut_into(high, high_spare, from + middle, parts);
    parts.push(Part {
        from: from as u32,
        to: (from + points.len()) as u32,
        left,
    });
}

/// The points of a small part, and their order along each axis, which its own parts keep (J. Bentley, J. Friedman,
/// ACM Comput. Surv. 11, 1979): only once is anything sorted.
struct Sorted {
    points: [Point; SORTED],
    orders: [[u16; SORTED]; 3],
    /// Along how many axes they are sorted.
    axes: usize,
    /// Does a point belong to the upper part of the last cut?
    is_above: [bool; SORTED],
    /// Room for those of one order.
    above: [u16; SORTED],
}

impl Sorted {
    fn new(points: &[Point]) -> Self {
        let mut sorted = Sorted {
            points: [Point::default(); SORTED],
            orders: [[0; SORTED]; 3],
            axes: 2 + usize::from(points.iter().any(|point| point.at[2] != points[0].at[2])),
            is_above: [false; SORTED],
            above: [0; SORTED],
        };
        sorted.points[..points.len()].copy_from_slice(points);
        let mut keys = [0_u64; SORTED];
        let keys = &mut keys[..points.len()];
        for (axis, order) in sorted.orders[..sorted.axes].iter_mut().enumerate() {
            for ((place, key), point) in (0..).zip(&mut *keys).zip(points) {
                // Coordinates are not negative, so that their bits are in their order.
                *key = u64::from(point.at[axis].to_bits()) << u16::BITS | place;
            }
            keys.sort_unstable();
            for (place, key) in order.iter_mut().zip(&*keys) {
                *place = *key as u16;
            }
        }
        sorted
    }

    /// Puts the points into the order of their parts.
    fn cut(mut self, points: &mut [Point], from: usize, parts: &mut Vec<Part>) {
        self.cut_range(0, points.len(), from, parts);
        for (point, place) in points.iter_mut().zip(self.orders[0]) {
            *point = self.points[place as usize];
        }
    }

    fn at(&self, place: usize, axis: usize) -> f32 {
        self.points[self.orders[axis][place] as usize].at[axis]
    }

    fn cut_range(&mut self, start: usize, end: usize, from: usize, parts: &mut Vec<Part>) {
        let count = end - start;
        let mut left = NONE;
        if count > LEAF {
            let extents = [0, 1, 2].map(|axis| self.at(end - 1, axis) - self.at(start, axis));
            let axis = longest(extents);
            let slack = slack(count, extents);
            let lowest = (count / 2).saturating_sub(slack).max(1);
            let highest = (count / 2 + slack).min(count - 1);
            let mut best = (count / 2, 0.0);
            for k in lowest..=highest {
                let gap = self.at(start + k, axis) - self.at(start + k - 1, axis);
                let value = score(gap, k.abs_diff(count / 2), slack);
                if value > best.1 {
                    best = (k, value);
                }
            }
            let middle = start + best.0;
            for k in start..end {
                self.is_above[self.orders[axis][k] as usize] = k >= middle;
            }
            for other in (0..self.axes).filter(|other| *other != axis) {
                let order = &mut self.orders[other][start..end];
                let (mut below, mut above) = (0, 0);
                for k in 0..count {
                    let place = order[k];
                    let is_above = self.is_above[place as usize];
                    order[below] = place;
                    self.above[above] = place;
                    above += usize::from(is_above);
                    below += usize::from(!is_above);
                }
                order[below..].copy_from_slice(&self.above[..above]);
            }
            self.cut_range(start, middle, from, parts);
            left = parts.len() as u32 - 1;
            self.cut_range(middle, end, from, parts);
        }
        parts.push(Part {
            from: (from + start) as u32,
            to: (from + end) as u32,
            left,
        });
    }
}

/// The axis of the longest extent. A tie, as on a square, is decided for the higher axis whatever the rounding.
fn longest(extents: [f32; 3]) -> usize {
    (0..2).rev().fold(2, |best, k| {
        if extents[k] > 1.0001 * extents[best] {
            k
        } else {
            best
        }
    })
}

/// By how many points a cut may be off the median.
fn slack(count: usize, extents: [f32; 3]) -> usize {
    let across = match extents[2] > 0.0 {
        true => (count as f64).cbrt(),
        false => (count as f64).sqrt(),
    };
    ((ROWS / across * count as f64) as usize).clamp(1, count / 4 + 1)
}

/// Puts the lower part first and returns its length, which is neither nothing nor all.
fn split(points: &mut [Point], spare: &mut [Point]) -> usize {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for Point { at, .. } in points.iter() {
        // One instruction each; f32::min also looks for what is not a number.
        for k in 0..3 {
            low[k] = if at[k] < low[k] { at[k] } else { low[k] };
            high[k] = if at[k] > high[k] { at[k] } else { high[k] };
        }
    }
    let extents = std::array::from_fn(|k| high[k] - low[k]);
    let axis = longest(extents);
    let count = points.len();
    if !(extents[axis] > 0.0) {
        return count / 2;
    }
    let slack = slack(count, extents);
    let at = place(points, axis, low[axis], high[axis], slack);
    let (mut below, mut above) = (0, 0);
    // Stable, so that the result is the same however the points came to stand here.
    for k in 0..count {
        let point = points[k];
        let is_above = point.at[axis] >= at;
        points[below] = point;
        spare[above] = point;
        above += usize::from(is_above);
        below += usize::from(!is_above);
    }
    points[below..].copy_from_slice(&spare[..above]);
    if below < count / 8 || above < count / 8 {
        // More points on one spot than bins can separate.
        points.sort_unstable_by(|a, b| a.at[axis].total_cmp(&b.at[axis]));
        return count / 2;
    }
    below
}

/// Wide gaps near the median are good.
fn score(gap: f32, off: usize, slack: usize) -> f32 {
    gap * (1.0 - 0.5 * off as f32 / slack as f32)
}

/// Where to cut, from counts in bins: first of a sample, then of the points around the median.
fn place(points: &[Point], axis: usize, low: f32, high: f32, slack: usize) -> f32 {
    let half = points.len() / 2;
    let step = (points.len() / SAMPLE).max(1);
    let sample = Bins::new(points.iter().step_by(step), axis, low, high);
    let (from, to) = sample.around(half / step, (2 * slack).div_ceil(step));
    if !(to > from) {
        return from;
    }
    Bins::new(points.iter(), axis, from, to).gap(half, slack)
}

/// Numbers of points by coordinate.
struct Bins {
    low: f32,
    width: f32,
    /// Bin 0 counts what lies below all bins, the last what lies above.
    counts: [u32; BINS + 2],
}

impl Bins {
    fn new<'p>(points: impl Iterator<Item = &'p Point>, axis: usize, low: f32, high: f32) -> Self {
        let scale = BINS as f32 / (high - low);
        let mut counts = [0; BINS + 2];
        let (mut below, mut above) = (0, 0);
        for point in points {
            let bin = (point.at[axis] - low) * scale;
            below += u32::from(bin < 0.0);
            above += u32::from(bin >= BINS as f32);
            if bin >= 0.0 && bin < BINS as f32 {
                counts[bin as usize + 1] += 1;
            }
        }
        counts[0] = below;
        counts[BINS + 1] = above;
        Bins {
            low,
            width: (high - low) / BINS as f32,
            counts,
        }
    }

    /// The lower edge of a bin.
    fn edge(&self, bin: usize) -> f32 {
        self.low + (bin as f32 - 1.0) * self.width
    }

    /// An interval with `count` points and `margin` more on either side of it, if there are.
    fn around(&self, count: usize, margin: usize) -> (f32, f32) {
        let (mut from, mut to, mut sum) = (1, BINS + 1, 0);
        for bin in 0..=BINS + 1 {
            if sum + margin <= count {
                from = bin.max(1);
            }
            sum += self.counts[bin] as usize;
            if sum >= count + margin {
                to = (bin + 1).min(BINS + 1);
                break;
            }
        }
        (self.edge(from), self.edge(to))
    }

    /// The middle of the widest run of empty bins near the point number `half`; without any, the
    /// edge next to that point.
    fn gap(&self, half: usize, slack: usize) -> f32 {
        let (mut best, mut nearest) = ((0.0, self.low), usize::MAX);
        let (mut sum, mut empty) = (self.counts[0] as usize, 0);
        for bin in 1..=BINS {
            let off = sum.abs_diff(half);
            if best.0 == 0.0 && off < nearest {
                (nearest, best.1) = (off, self.edge(bin));
            }
            if self.counts[bin] == 0 {
                empty += 1;
                continue;
            }
            if empty > 0 && off <= slack {
                let value = score(empty as f32, off, slack);
                if value > best.0 {
                    best = (value, 0.5 * (self.edge(bin - empty) + self.edge(bin)));
                }
            }
            empty = 0;
            sum += self.counts[bin] as usize;
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(points: &[[f64; 3]]) -> Tree {
        let members: Vec<u32> = (0..points.len() as u32).collect();
        Tree::new(&members, |k| points[k as usize])
    }

    #[test]
    fn parts_are_cut_in_two_down_to_leaves() {
        let random = |k: usize| (12.9898 * k as f64).sin() * 43758.5 % 1.0;
        let scattered: Vec<_> = (0..40_000)
            .map(|k| [random(3 * k), random(3 * k + 1), random(3 * k + 2)])
            .collect();
        let on_one_spot = vec![[1e6, -3.0, 0.0]; 5000];
        let mut half = scattered.clone();
        half[..30_000].fill([0.5; 3]);
        for points in [&scattered[..], &scattered[..1], &on_one_spot, &half, &[]] {
            let tree = tree(points);
            let mut sorted = tree.order.clone();
            sorted.sort_unstable();
            assert!(sorted.iter().enumerate().all(|(k, i)| k == *i as usize));
            for (k, part) in tree.parts.iter().enumerate() {
                let Some(left) = part.left() else {
                    assert!(part.len() <= LEAF);
                    continue;
                };
                let (a, b) = (tree.parts[left], tree.parts[k - 1]);
                assert_eq!((a.from, a.to, b.to), (part.from, b.from, part.to));
                assert!(8 * a.len() + 8 >= part.len() && 8 * b.len() + 8 >= part.len());
            }
        }
    }

    /// Also a part that is small enough to be sorted.
    #[test]
    fn a_column_is_cut_across() {
        for axis in 0..3 {
            let mut points = Vec::new();
            for k in 0..180_u32 {
                let mut point = [f64::from(k % 3), f64::from(k / 3 % 3), 0.0];
                point[2] = point[axis];
                point[axis] = f64::from(k / 9);
                points.push(point);
            }
            let tree = tree(&points);
            let (low, high) = tree.order.split_at(90);
            let at = |k: &u32| points[*k as usize][axis];
            assert!(low.iter().all(|k| at(k) < 9.5) && high.iter().all(|k| at(k) > 9.5));
        }
    }

    /// On a grid whose columns are 1 and 2 apart in turn, every cut of a larger part goes through
    /// a wide gap: no column is torn.
    #[test]
    fn cuts_follow_the_lines_of_a_grid() {
        let n = 300;
        let place = |i: usize| (3 * (i / 2) + i % 2) as f64;
        let points: Vec<_> = (0..n * n)
            .map(|k| [place(k % n), 0.1 + place(k / n), 0.0])
            .collect();
        let tree = tree(&points);
        for (k, part) in tree.parts.iter().enumerate() {
            let Some(left) = part.left().filter(|_| part.len() > 64) else {
                continue;
            };
            let bounds = |part: &Part, axis: usize| {
                let at = |i: &u32| points[*i as usize][axis];
                let all = tree.order[part.from as usize..part.to as usize].iter();
                let low = all.clone().map(at).fold(f64::INFINITY, f64::min);
                (low, all.map(at).fold(f64::NEG_INFINITY, f64::max))
            };
            let (a, b) = (&tree.parts[left], &tree.parts[k - 1]);
            let gap = (0..2).map(|axis| bounds(b, axis).0 - bounds(a, axis).1);
            assert_eq!(gap.fold(0.0, f64::max), 2.0, "{part:?}");
        }
    }
}
