//! The fronts of a tree of elimination: which unknowns each has, and the position in it of those of the fronts below
//! (J. Liu, SIAM Review 34, 1992).

use super::Elements;
use super::bisection::Tree;
use super::frontier::cholesky;

const NONE: u32 = u32::MAX;

/// A front of the tree: a dense matrix of its pivots and its border.
#[derive(Debug, Clone, Copy)]
pub(super) struct Front {
    pub pivots: u32,
    pub border: u32,
    /// Elements of a leaf, [`Front::OF_HALVES`] otherwise.
    pub elements: u32,
    /// Where its maps start: of a leaf, the places of its elements' unknowns; otherwise the
    /// places of the borders of its two halves, one after the other.
    pub map: u32,
}

impl Front {
    pub const OF_HALVES: u32 = u32::MAX;

    pub fn is_leaf(&self) -> bool {
        self.elements != Front::OF_HALVES
    }

    pub fn size(&self) -> usize {
        (self.pivots + self.border) as usize
    }

    /// Entries of its columns of the factor.
    pub fn entries(&self) -> usize {
        let (p, b) = (self.pivots as usize, self.border as usize);
        p * (p + 1) / 2 + p * b
    }

    /// The same without their diagonals.
    pub fn below(&self) -> usize {
        self.entries() - self.pivots as usize
    }

    /// Multiplications and additions of its elimination.
    fn flops(&self) -> f64 {
        cholesky(f64::from(self.pivots), f64::from(self.border))
    }
}

/// The fronts of a part of the tree: those of a small part in postorder, or one front above two
/// parts that are independent of each other.
#[derive(Debug, Default)]
pub(super) struct Plan {
    pub halves: Option<Box<[Plan; 2]>>,
    pub fronts: Vec<Front>,
    /// Places in the fronts of a small part, of the borders below each.
    pub maps: Vec<u16>,
    /// The same in a front above two parts.
    pub above: Vec<u32>,
    /// Places in the front of a leaf, of the unknowns of its elements; [`Plan::FIXED`] for none.
    pub places: Vec<u8>,
    /// The part's first element in the order of elements.
    pub from: usize,
    /// Pivots and entries of the factor, of this part with its halves.
    pub pivots: usize,
    pub entries: usize,
    pub flops: f64,
    /// Border of the last front.
    pub border: usize,
    /// Most entries that updates of fronts wait in at one time.
    pub waiting: usize,
}

impl Plan {
    pub const FIXED: u8 = u8::MAX;

    /// Entries of the factor below its diagonal.
    pub fn below(&self) -> usize {
        self.entries - self.pivots
    }
}

/// Numbers of elimination, from which the fronts are merged.
pub(super) struct Numbering<'a, E> {
    pub elements: &'a E,
    pub tree: &'a Tree,
    /// The elements that are eliminated, and the positions of the others.
    pub inside: &'a [u32],
    pub aside_at: &'a [u32],
    /// Of each unknown; the kept ones have the last.
    pub numbers: &'a [u32],
    /// The first pivot of each part.
    pub firsts: &'a [usize],
    /// Parts up to this size are planned as one; their fronts have no more unknowns than a u16 counts.
    pub grain: usize,
}

impl<E: Elements> Numbering<'_, E> {
    /// The elements of a part that are eliminated.
    pub fn inside_of(&self, part: usize) -> &[u32] {
        let part = self.tree.parts[part];
        &self.inside[self.before(part.from)..self.before(part.to)]
    }

    /// The number of eliminated elements before this position.
    fn before(&self, position: u32) -> usize {
        position as usize - self.aside_at.partition_point(|at| *at < position)
    }

    /// The plan of a part, and the numbers on its border, ascending.
    pub fn plan(&self, root: usize) -> (Plan, Vec<u32>) {
        let part = self.tree.parts[root];
        let mut plan = Plan {
            from: self.before(part.from),
            ..Plan::default()
        };
        let border = match part.left() {
            Some(left) if part.len() > self.grain => {
                let (a, b) = rayon::join(|| self.plan(left), || self.plan(root - 1));
                let mut front = Vec::new();
                merge(&a.1, &b.1, &mut front, &mut plan.above);
                let border = self
                    .close(&mut plan, root, 0, Front::OF_HALVES, &front)
                    .to_vec();
                plan.entries += a.0.entries + b.0.entries;
                plan.pivots += a.0.pivots + b.0.pivots;
                plan.flops += a.0.flops + b.0.flops;
                let below = a.0.waiting + b.0.waiting;
                let added = (a.0.border.pow(2) + b.0.border.pow(2)) / 2;
                plan.waiting = below.max(added + front.len().pow(2));
                plan.halves = Some(Box::new([a.0, b.0]));
                border
            }
            _ => self.plan_all(&mut plan, root),
        };
        plan.border = border.len();
        plan.fronts.shrink_to_fit();
        plan.maps.shrink_to_fit();
        plan.places.shrink_to_fit();
        (plan, border)
    }

    /// Plans all fronts below and including `root` one after the other.
    fn plan_all(&self, plan: &mut Plan, root: usize) -> Vec<u32> {
        let mut first = root;
        while let Some(left) = self.tree.parts[first].left() {
            first = left;
        }
        // Borders of parts that wait for their other half, the last one on top, and how long each is.
        let (mut borders, mut counts) = (Vec::new(), Vec::new());
        let (mut front, mut numbers, mut places) = (Vec::new(), Vec::new(), Vec::new());
        let mut waiting = 0;
        let mut element = plan.from;
        let of_part = |at: &u32| *at < self.tree.parts[first].from;
        let mut aside = &self.aside_at[self.aside_at.partition_point(of_part)..];
        for k in first..=root {
            front.clear();
            let part = self.tree.parts[k];
            let (map, elements) = if part.left().is_none() {
                let mut count = part.len();
                while aside.first().is_some_and(|at| *at < part.to) {
                    (aside, count) = (&aside[1..], count - 1);
                }
                numbers.clear();
                for &e in &self.inside[element..element + count] {
                    let unknowns = self.elements.of(e as usize).iter();
                    numbers.extend(unknowns.map(|&k| self.numbers[k as usize]));
                }
                element += count;
                let map = plan.places.len();
                sort(&numbers, &mut front, &mut plan.places);
                (map, count as u32)
            } else {
                let (q, p) = (counts.pop().unwrap_or(0), counts.pop().unwrap_or(0));
                let start = borders.len() - p - q;
                let (a, b) = borders[start..].split_at(p);
                let map = plan.maps.len();
                merge(a, b, &mut front, &mut places);
                plan.maps.extend(places.iter().map(|&place| place as u16));
                borders.truncate(start);
                waiting -= p.pow(2) / 2 + q.pow(2) / 2;
                (map, Front::OF_HALVES)
            };
            let border = self.close(plan, k, map, elements, &front);
            waiting += border.len().pow(2) / 2;
            plan.waiting = plan.waiting.max(waiting + front.len().pow(2));
            borders.extend_from_slice(border);
            counts.push(border.len());
        }
        borders
    }

    /// Adds the front of a part and returns its border.
    fn close<'f>(
        &self,
        plan: &mut Plan,
        part: usize,
        map: usize,
        elements: u32,
        front: &'f [u32],
    ) -> &'f [u32] {
        let pivots = self.firsts[part + 1] - self.firsts[part];
        debug_assert!(
            front[..pivots]
                .iter()
                .copied()
                .eq(self.firsts[part] as u32..self.firsts[part + 1] as u32)
        );
        let border = &front[pivots..];
        let front = Front {
            pivots: pivots as u32,
            border: border.len() as u32,
            elements,
            map: map as u32,
        };
        plan.pivots += pivots;
        plan.entries += front.entries();
        plan.flops += front.flops();
        plan.fronts.push(front);
        border
    }
}

/// The numbers ascending, each once and [`NONE`] not at all, and the place of each in that list.
fn sort(numbers: &[u32], front: &mut Vec<u32>, places: &mut Vec<u8>) {
    front.extend(numbers.iter().filter(|number| **number != NONE));
    front.sort_unstable();
    front.dedup();
    places.extend(numbers.iter().map(|number| {
        let place = front.iter().position(|other| other == number);
        place.map_or(Plan::FIXED, |place| place as u8)
    }));
}

/// The union of two ascending lists, and the places of both in it.
fn merge(a: &[u32], b: &[u32], union: &mut Vec<u32>, places: &mut Vec<u32>) {
    places.resize(a.len() + b.len(), 0);
    let (in_a, in_b) = places.split_at_mut(a.len());
    let (mut i, mut j) = (0, 0);
    while i < a.len() && j < b.len() {
        let place = union.len() as u32;
        let (x, y) = (a[i], b[j]);
        union.push(x.min(y));
        // The last one written is the right one; without branches, as nobody could foretell them.
        (in_a[i], in_b[j]) = (place, place);
        i += usize::from(x <= y);
        j += usize::from(y <= x);
    }
    for (rest, places) in [(&a[i..], &mut in_a[i..]), (&b[j..], &mut in_b[j..])] {
        let first = union.len() as u32;
        union.extend_from_slice(rest);
        (first..).zip(places).for_each(|(k, place)| *place = k);
    }
}
