//! Recursive coordinate bisection of points: the binary tree that elimination follows
//! (George 1973 on grids; M. Berger, S. Bokhari, IEEE Trans. Comput. 36, 1987).
//!
//! The points are sorted along each axis once, and each part keeps its points in all these orders (J. Bentley, J. Friedman,
//! ACM Comput. Surv. 11, 1979): a cut halves the order along its axis, and sends each point of the others to its side.

use faceoff_mesh::parallel;

/// A part with at most this many points is not cut further.
const LEAF: usize = 4;
/// Parts from this size on are cut by several threads; the result does not depend on how many.
const PARALLEL: usize = 1 << 13;
/// Points that one task looks at.
const TASK: usize = 1 << 12;
/// [`Tree::depths`] does not cut parts up to this size.
const SMALL: usize = 1024;
/// How far a cut may move off the median to fall into a gap, in points of a row across.
const ROWS: f32 = 8.0;

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

/// The tree, its parts in postorder: a part comes after the two that it was cut into.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Tree {
    /// Indices of the points, those of a part side by side.
    pub order: Vec<u32>,
    pub parts: Vec<Part>,
}

impl Tree {
    /// Cuts the points across their longest extent near the median, where a gap between the
    /// points is widest, so that on a regular mesh the cuts follow its lines.
    ///
    /// `members` are the numbers of the points, ascending, `place` their coordinates.
    pub fn new(members: &[u32], place: impl Fn(u32) -> [f64; 3] + Sync) -> Self {
        let unit = UnitCube::around(members, &place);
        if unit.is_flat() {
            Orders::<2>::new(members, |k| unit.of(place(k))).tree()
        } else {
            Orders::<3>::new(members, |k| unit.of(place(k))).tree()
        }
    }

    /// How many cuts each point in space stays with the lower part, of `most`; small parts are not cut.
    pub fn depths(
        members: &[u32],
        place: impl Fn(u32) -> [f64; 3] + Sync,
        most: u8,
    ) -> Vec<(u32, u8)> {
        let unit = UnitCube::around(members, &place);
        let mut orders = Orders::<3>::new(members, |k| unit.of(place(k)));
        let mut part = orders.whole();
        let mut depths = Vec::with_capacity(members.len());
        for depth in 0..most {
            if part.len() <= SMALL {
                break;
            }
            let (low, high) = part.cut();
            depths.extend(high.indices().map(|index| (index, depth)));
            part = low;
        }
        depths.extend(part.indices().map(|index| (index, most)));
        depths
    }
}

/// The map of points into the unit cube.
struct UnitCube {
    low: [f64; 3],
    high: [f64; 3],
    scale: f64,
}

impl UnitCube {
    fn around(members: &[u32], place: &(impl Fn(u32) -> [f64; 3] + Sync)) -> Self {
        let nothing = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let join = |a: ([f64; 3], [f64; 3]), b: ([f64; 3], [f64; 3])| {
            (
                std::array::from_fn(|k| a.0[k].min(b.0[k])),
                std::array::from_fn(|k| a.1[k].max(b.1[k])),
            )
        };
        let of_some = |members: &[u32]| {
            let places = members.iter().map(|&k| place(k));
            places.fold(nothing, |all, at| join(all, (at, at)))
        };
        let found = parallel::map(members.chunks(TASK), of_some);
        let (low, high) = found.into_iter().fold(nothing, join);
        let extent = (0..3).fold(0.0, |e: f64, k| e.max(high[k] - low[k]));
        let scale = if extent > 0.0 { 1.0 / extent } else { 1.0 };
        UnitCube { low, high, scale }
    }

    fn is_flat(&self) -> bool {
        !(self.high[2] > self.low[2])
    }

    fn of<const D: usize>(&self, at: [f64; 3]) -> [f32; D] {
        std::array::from_fn(|k| ((at[k] - self.low[k]) * self.scale) as f32)
    }
}

#[derive(Debug, Clone, Copy)]
struct Point<const D: usize> {
    at: [f32; D],
    index: u32,
}

impl<const D: usize> Point<D> {
    /// Its place in the order along an axis. Coordinates are not negative, so that their bits are in their order.
    fn key(&self, axis: usize) -> u64 {
        u64::from(self.at[axis].to_bits()) << u32::BITS | u64::from(self.index)
    }
}

/// All points, sorted along each axis, and room for as many.
struct Orders<const D: usize> {
    orders: [Vec<Point<D>>; D],
    spare: Vec<Point<D>>,
}

impl<const D: usize> Orders<D> {
    fn new(members: &[u32], place: impl Fn(u32) -> [f32; D] + Sync) -> Self {
        debug_assert!(members.is_sorted());
        let point = |&index: &u32| Point {
            at: place(index),
            index,
        };
        let spare = parallel::chunks(members.len(), TASK, |chunk| {
            members[chunk].iter().map(point).collect()
        });
        let mut orders = std::array::from_fn(|_| Vec::new());
        parallel::map(orders.iter_mut().enumerate(), |(axis, order)| {
            order.clone_from(&spare);
            // Stable: points that do not differ are in the order of their indices.
            radsort::sort_by_key(order, |point| point.at[axis].to_bits());
        });
        Orders { orders, spare }
    }

    fn whole(&mut self) -> Points<'_, D> {
        Points {
            orders: self.orders.each_mut().map(|order| &mut order[..]),
            spare: &mut self.spare,
        }
    }

    fn tree(mut self) -> Tree {
        let mut order = vec![0; self.spare.len()];
        let parts = match order.is_empty() {
            true => Vec::new(),
            false => self.whole().parts(&mut order, 0),
        };
        Tree { order, parts }
    }
}

/// The points of a part, sorted along each axis, and room for as many.
struct Points<'a, const D: usize> {
    orders: [&'a mut [Point<D>]; D],
    spare: &'a mut [Point<D>],
}

impl<'a, const D: usize> Points<'a, D> {
    fn len(&self) -> usize {
        self.spare.len()
    }

    fn indices(&self) -> impl Iterator<Item = u32> {
        self.orders[0].iter().map(|point| point.index)
    }

    /// Its parts, the first point of which is number `from` in the order; `order` is that of its points.
    /// The depth is bounded by the logarithm of their number: no part is larger than 3/4 of the whole and two points.
    fn parts(self, order: &mut [u32], from: usize) -> Vec<Part> {
        let count = self.len();
        let mut parts = Vec::with_capacity(count);
        if count < PARALLEL {
            self.parts_into(order, from, &mut parts);
            return parts;
        }
        let (low, high) = self.cut();
        let middle = low.len();
        let (low_order, high_order) = order.split_at_mut(middle);
        let (first, second) = rayon::join(
            || low.parts(low_order, from),
            || high.parts(high_order, from + middle),
        );
        let left = first.len() as u32;
        parts.extend(first);
        parts.extend(second.into_iter().map(|mut part| {
            if part.left != NONE {
                part.left += left;
            }
            part
        }));
        parts.push(Part {
            from: from as u32,
            to: (from + count) as u32,
            left: left - 1,
        });
        parts
    }

    fn parts_into(self, order: &mut [u32], from: usize, parts: &mut Vec<Part>) {
        let count = self.len();
        let mut left = NONE;
        if count > LEAF {
            let (low, high) = self.cut();
            let middle = low.len();
            let (low_order, high_order) = order.split_at_mut(middle);
            low.parts_into(low_order, from, parts);
            left = parts.len() as u32 - 1;
            high.parts_into(high_order, from + middle, parts);
        } else {
            for (place, index) in order.iter_mut().zip(self.indices()) {
                *place = index;
            }
        }
        parts.push(Part {
            from: from as u32,
            to: (from + count) as u32,
            left,
        });
    }

    /// The lower and the upper part, neither of which is empty; there are two points or more.
    fn cut(self) -> (Self, Self) {
        let (axis, middle) = self.place();
        let first_above = self.orders[axis][middle].key(axis);
        let Points {
            mut orders,
            mut spare,
        } = self;
        for (_, order) in (0..D).zip(&mut orders).filter(|(other, _)| *other != axis) {
            let mut below = 0;
            for (k, point) in order.iter().enumerate() {
                let is_above = point.key(axis) >= first_above;
                let place = if is_above { middle + k - below } else { below };
                spare[place] = *point;
                below += usize::from(!is_above);
            }
            std::mem::swap(order, &mut spare);
        }
        let (low_spare, high_spare) = spare.split_at_mut(middle);
        let high = Points {
            orders: orders
                .each_mut()
                .map(|order| order.split_off_mut(middle..).unwrap_or_default()),
            spare: high_spare,
        };
        let low = Points {
            orders,
            spare: low_spare,
        };
        (low, high)
    }

    /// The axis and the number of points below the cut: near the median, where the gap is widest.
    fn place(&self) -> (usize, usize) {
        let count = self.len();
        let extents: [f32; D] = std::array::from_fn(|k| {
            let order = &self.orders[k];
            order[count - 1].at[k] - order[0].at[k]
        });
        let axis = longest(extents);
        let across = match D == 3 && extents[D - 1] > 0.0 {
            true => (count as f32).cbrt(),
            false => (count as f32).sqrt(),
        };
        let slack = ((ROWS / across * count as f32) as usize).clamp(1, count / 4 + 1);
        let half = count / 2;
        let lowest = half.saturating_sub(slack).max(1);
        let highest = (half + slack).min(count - 1);
        let mut best = (half, 0.0);
        let pairs = self.orders[axis][lowest - 1..=highest].windows(2);
        for (k, pair) in (lowest..).zip(pairs) {
            let gap = pair[1].at[axis] - pair[0].at[axis];
            let value = gap * (1.0 - 0.5 * k.abs_diff(half) as f32 / slack as f32);
            if value > best.1 {
                best = (k, value);
            }
        }
        (axis, best.0)
    }
}

/// The axis of the longest extent. A tie, as on a square, is decided for the higher axis whatever the rounding.
fn longest<const D: usize>(extents: [f32; D]) -> usize {
    (0..D - 1).rev().fold(D - 1, |best, k| {
        if extents[k] > 1.0001 * extents[best] {
            k
        } else {
            best
        }
    })
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
        let flat: Vec<_> = scattered
            .iter()
            .map(|[x, y, _]| [*x, 0.5 * y, 3.0])
            .collect();
        let some = [
            &scattered[..],
            &scattered[..1],
            &on_one_spot,
            &half,
            &flat,
            &[],
        ];
        for points in some {
            let tree = tree(points);
            let bounds = |part: &Part, axis: usize| {
                let part = tree.order[part.from as usize..part.to as usize].iter();
                let nothing = (f64::INFINITY, f64::NEG_INFINITY);
                part.map(|i| points[*i as usize][axis])
                    .fold(nothing, |(low, high), at| (at.min(low), at.max(high)))
            };
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
                assert!(4 * a.len() + 6 >= part.len() && 4 * b.len() + 6 >= part.len());
                let extents = [0, 1, 2]
                    .map(|axis| bounds(part, axis))
                    .map(|(low, high)| high - low);
                let longest = extents.into_iter().fold(0.0, f64::max);
                // As far as f32 distinguishes coordinates.
                let is_across = |axis: usize| {
                    extents[axis] > 0.999 * longest - 1e-6
                        && bounds(&a, axis).1 < bounds(&b, axis).0 + 1e-6
                };
                assert!((0..3).any(is_across), "{part:?}");
            }
        }
    }

    /// Against the tree.
    #[test]
    fn depths_are_those_on_the_way_to_the_first_part() {
        let place = |k: u32| {
            [
                f64::from(k % 31),
                f64::from(k / 31 % 29),
                f64::from(k / 899),
            ]
        };
        let members: Vec<u32> = (0..31 * 29 * 23).collect();
        let tree = Tree::new(&members, place);
        let mut depths = Tree::depths(&members, place, 3);
        let mut expected = Vec::new();
        let mut part = tree.parts.len() - 1;
        for depth in 0..3 {
            let Part { from, to, .. } = tree.parts[part - 1];
            let cut_off = tree.order[from as usize..to as usize].iter();
            expected.extend(cut_off.map(|&index| (index, depth)));
            part = tree.parts[part].left().unwrap();
        }
        expected.extend(
            tree.order[..tree.parts[part].to as usize]
                .iter()
                .map(|&index| (index, 3)),
        );
        depths.sort_unstable();
        expected.sort_unstable();
        assert_eq!(depths, expected);
    }

    /// In any direction.
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
