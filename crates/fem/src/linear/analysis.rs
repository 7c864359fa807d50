//! Which unknown is eliminated when, and what the fronts look like (J. Liu, SIAM Review 34, 1992):
//! everything about the factorisation that does not depend on values.
//!
//! The tree of [`super::bisection`] cuts the elements. A front belongs to each of its parts: the
//! unknowns that are complete there, having all their elements in the part but not in either half,
//! are its *pivots* and are eliminated; the others that the part shares with the rest are its
//! *border*. Kept unknowns are never complete, so that they arrive in the border of the whole, or
//! of the parts of [`super::frontier`], above which all is left to [`super::lu`].

use std::sync::Arc;

use rayon::prelude::*;

use super::bisection::Tree;
use super::frontier::{Count, STEPS, cholesky, frontier};
use super::lu_plan::LuPlan;
use super::schur::Entry;
use super::{Elements, Role};

const NONE: u32 = u32::MAX;
/// Seconds of one core, fitted as [`Analysis::seconds`] says.
const OF_UNKNOWN: f64 = 8e-7;
const OF_FLOP: f64 = 5e-11;

/// Elements that one task looks at.
const TASK: usize = 1 << 12;

/// The tree is walked by at most about twice so many tasks, whatever the number of threads.
const TASKS: usize = 64;

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
    /// Places in a front, of the borders below it.
    pub maps: Vec<u32>,
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
}

/// The order of elimination and the fronts.
#[derive(Debug)]
pub struct Analysis {
    /// The kept unknowns, ascending: the order of the Schur complement. Beside those that were to be kept they are what is
    /// complete above the frontier.
    pub kept: Vec<u32>,
    /// The eliminated unknowns in their order.
    pub order: Vec<u32>,
    /// The elements that are eliminated, in the order of the tree.
    pub(super) elements: Vec<u32>,
    /// Elements without an unknown to be eliminated: they are part of the Schur complement as they are.
    pub(super) aside: Vec<u32>,
    /// The parts of the frontier, and the places of their borders in `kept`.
    pub(super) blocks: Vec<(Plan, Vec<u32>)>,
    /// How the Schur complement is factored.
    pub(super) lu: Arc<LuPlan>,
}

impl Analysis {
    /// `roles` of all unknowns; `ties` couple kept ones beside the elements, fixed ones in them do not matter. Where `is_whole`
    /// nothing else is kept.
    pub fn new(elements: &impl Elements, roles: &[Role], ties: &[&[u32]], is_whole: bool) -> Self {
        // What is done with each element: eliminated with any of its unknowns, or else kept with one.
        let of_elements: Vec<Role> = (0..elements.count())
            .into_par_iter()
            .with_min_len(TASK)
            .map(|e| {
                let mut of_unknowns = elements.of(e).iter().map(|&k| roles[k as usize]);
                if of_unknowns.clone().any(|role| role == Role::Eliminated) {
                    Role::Eliminated
                } else {
                    of_unknowns
                        .find(|role| *role == Role::Kept)
                        .unwrap_or(Role::Fixed)
                }
            })
            .collect();
        let is_inside = |e: u32| of_elements[e as usize] == Role::Eliminated;
        let members: Vec<u32> = (0..elements.count() as u32)
            .filter(|&e| of_elements[e as usize] != Role::Fixed)
            .collect();
        let tree = Tree::new(&members, |e| elements.centre(e as usize));
        let (first_at, last_at) = spans(elements, &tree, roles);
        let (owners, leaf_at, above) = owners(&tree, &first_at, &last_at);
        // Of one element aside alone: it can be eliminated before all others.
        let is_private = |k: usize| {
            let [first, last] = [first_at[k], last_at[k]];
            roles[k] == Role::Kept
                && first == last
                && first != NONE
                && !is_inside(tree.order[first as usize])
        };
        let mut counts = vec![Count::default(); tree.parts.len()];
        let is_condensed = roles.contains(&Role::Kept) && !is_whole;
        if is_condensed {
            for (k, &owner) in owners
                .iter()
                .enumerate()
                .filter(|(_, owner)| **owner != NONE)
            {
                let count = &mut counts[owner as usize];
                count.eliminated += u32::from(roles[k] == Role::Eliminated);
                count.kept += u32::from(roles[k] == Role::Kept && !is_private(k));
            }
            count_borders(elements, &tree, &owners, &leaf_at, &above, &mut counts);
        }
        let within = frontier(&tree, &counts, !is_condensed);
        let mut eliminated = owners.clone();
        // What is kept, by the front that eliminates it: alone by its element, or by a part.
        let (mut alone, mut of_parts) = (Vec::new(), Vec::new());
        let mut kept = Vec::new();
        for (k, owner) in eliminated.iter_mut().enumerate() {
            let part = if *owner == NONE {
                None
            } else {
                within[*owner as usize]
            };
            match roles[k] {
                Role::Fixed => continue,
                Role::Eliminated if part.is_some() || *owner == NONE => continue,
                _ if is_private(k) => alone.push((first_at[k], kept.len() as u32)),
                // An unknown of no element has ties alone, and comes last.
                _ => of_parts.push((part.unwrap_or(*owner), kept.len() as u32)),
            }
            *owner = NONE;
            kept.push(k as u32);
        }
        let groups = [grouped(alone), grouped(of_parts)].concat();
        let separate = || {
            let mut before = Vec::with_capacity(tree.order.len() + 1);
            before.push(0);
            let (mut inside, mut aside) = (Vec::new(), Vec::new());
            for &e in &tree.order {
                if is_inside(e) {
                    &mut inside
                } else {
                    &mut aside
                }
                .push(e);
                before.push(inside.len() as u32);
            }
            (before, inside, aside)
        };
        let ((firsts, order), (before, inside, aside)) =
            rayon::join(|| eliminate(&eliminated, tree.parts.len()), separate);
        let mut numbers = vec![NONE; roles.len()];
        for (number, &k) in order.iter().chain(&kept).enumerate() {
            numbers[k as usize] = number as u32;
        }
        let numbering = Numbering {
            elements,
            tree: &tree,
            inside: &inside,
            before: &before,
            numbers: &numbers,
            firsts: &firsts,
            grain: (tree.order.len() / TASKS).max(256),
        };
        let roots: Vec<usize> = (0..tree.parts.len())
            .filter(|&k| within[k] == Some(k as u32) && !numbering.inside_of(k).is_empty())
            .collect();
        let blocks: Vec<(Plan, Vec<u32>)> = roots
            .into_par_iter()
            .map(|root| {
                let (plan, mut border) = numbering.plan(root);
                border
                    .iter_mut()
                    .for_each(|place| *place -= order.len() as u32);
                (plan, border)
            })
            .collect();
        let place = |k: &u32| kept.binary_search(k).ok().map(|place| place as u32);
        let places = |unknowns: &[u32]| unknowns.iter().filter_map(place).collect();
        let of_elements = aside.iter().map(|&e| places(elements.of(e as usize)));
        let lu = LuPlan::new(
            groups,
            blocks.iter().map(|(_, border)| &border[..]),
            of_elements.chain(ties.iter().map(|tie| places(tie))),
        );
        Analysis {
            order,
            elements: inside,
            aside,
            blocks,
            lu: Arc::new(lu),
            kept,
        }
    }

    /// The elements without an eliminated unknown, as entries of the Schur complement.
    pub(super) fn aside(&self, elements: &impl Elements) -> Vec<Entry> {
        let size = elements.size();
        let mut matrix = vec![0.0; size * size];
        let mut entries = Vec::with_capacity(self.aside.len() * size * size);
        for &e in &self.aside {
            elements.matrix(e as usize, &mut matrix);
            let place = |k: &u32| self.kept.binary_search(k).ok();
            let places: Vec<_> = elements.of(e as usize).iter().map(place).collect();
            for (column, &j) in matrix.chunks_exact(size).zip(&places) {
                for (value, &i) in column.iter().zip(&places) {
                    if let (Some(i), Some(j)) = (i, j) {
                        entries.push((i as u32, j as u32, *value));
                    }
                }
            }
        }
        entries
    }

    /// Entries of the factor.
    pub fn entries(&self) -> usize {
        self.blocks.iter().map(|(plan, _)| plan.entries).sum()
    }

    /// Those of the fronts.
    pub fn flops_once(&self) -> f64 {
        self.blocks.iter().map(|(plan, _)| plan.flops).sum()
    }

    /// Multiplications and additions of a whole solution: of what is done once, and of what is done again for contact.
    pub fn flops(&self) -> f64 {
        self.flops_once() + STEPS * self.lu.flops
    }

    /// Seconds that a whole solution takes one core, whose unit is the one that iterations are predicted in: what each
    /// unknown takes in sweeps over the cells, what each row and entry takes where contact is factored and solved with, and
    /// the operations. Fitted to `cargo bench --bench solvers -- --shapes`.
    pub(super) fn seconds(&self) -> f64 {
        let unknowns = (self.order.len() + self.kept.len()) as f64;
        let contact = 1.9e-7 * self.lu.rows as f64 + 3e-9 * self.lu.entries as f64;
        OF_UNKNOWN * unknowns + OF_FLOP * self.flops() + STEPS * contact
    }

    /// Less than [`Analysis::seconds`] but for meshes of very uneven density, from the fronts on one path down the tree, a
    /// tenth of the work of an analysis; nothing in the plane, where the whole costs little.
    pub(super) fn seconds_at_least(elements: &impl Elements, roles: &[Role]) -> f64 {
        const MOST: u8 = 8;
        let count = elements.count();
        let heights = [0, count / 2, count - 1].map(|e| elements.centre(e)[2]);
        if heights.iter().all(|height| *height == heights[0]) {
            return 0.0;
        }
        let members: Vec<u32> = (0..count as u32).collect();
        // The least and the greatest depth among the elements of each unknown.
        let mut depths = vec![[MOST, 0]; roles.len()];
        for (e, depth) in Tree::depths(&members, |e| elements.centre(e as usize), MOST) {
            for &k in elements.of(e as usize) {
                let [least, greatest] = &mut depths[k as usize];
                (*least, *greatest) = (depth.min(*least), depth.max(*greatest));
            }
        }
        let unknowns = roles.iter().filter(|role| **role != Role::Fixed).count();
        let (mut pivots, mut border) = ([0.0; MOST as usize], [0.0; MOST as usize + 1]);
        for (&[least, greatest], role) in depths.iter().zip(roles) {
            if least < greatest && *role == Role::Eliminated {
                pivots[least as usize] += 1.0;
                let below = least as usize + 1..=greatest as usize;
                border[below].iter_mut().for_each(|count| *count += 1.0);
            }
        }
        // Of as many fronts as a depth has this one is in a corner, where borders are shortest.
        let fronts = (0..).zip(pivots).zip(border);
        let flops: f64 = fronts
            .map(|((depth, pivots), border)| f64::powi(2.0, depth) * cholesky(pivots, border))
            .sum();
        OF_UNKNOWN * unknowns as f64 + OF_FLOP * flops
    }

    /// Bytes that factor, updates, Schur complement and its factorisation take with numbers of `size` bytes.
    pub fn bytes(&self, size: usize) -> usize {
        let waiting = self.blocks.iter().map(|(plan, _)| plan.waiting).max();
        let dense: usize = self
            .blocks
            .iter()
            .map(|(_, border)| border.len().pow(2))
            .sum();
        (self.entries() + waiting.unwrap_or(0)) * size
            + (dense + self.lu.entries + self.lu.largest) * 8
    }
}

/// The values with the same key together, ascending by key.
fn grouped(mut pairs: Vec<(u32, u32)>) -> Vec<Vec<u32>> {
    pairs.sort_unstable();
    let groups = pairs.chunk_by(|a, b| a.0 == b.0);
    groups
        .map(|group| group.iter().map(|pair| pair.1).collect())
        .collect()
}

/// The first and the last position in the tree of the elements of each unknown; none of fixed ones.
fn spans(elements: &impl Elements, tree: &Tree, roles: &[Role]) -> (Vec<u32>, Vec<u32>) {
    let last_of = |at: &mut dyn Iterator<Item = (usize, &u32)>| {
        let mut positions = vec![NONE; roles.len()];
        for (position, &e) in at {
            for &k in elements.of(e as usize) {
                if roles[k as usize] != Role::Fixed {
                    positions[k as usize] = position as u32;
                }
            }
        }
        positions
    };
    let all = || tree.order.iter().enumerate();
    rayon::join(|| last_of(&mut all().rev()), || last_of(&mut all()))
}

/// The part in which each unknown is complete: the smallest that holds all its elements. With it the leaf at each position,
/// and the part above each.
fn owners(tree: &Tree, first_at: &[u32], last_at: &[u32]) -> (Vec<u32>, Vec<u32>, Vec<u32>) {
    let mut leaf_at = vec![0u32; tree.order.len()];
    let mut above = vec![NONE; tree.parts.len()];
    for (k, part) in tree.parts.iter().enumerate() {
        match part.left() {
            None => leaf_at[part.from as usize..part.to as usize].fill(k as u32),
            Some(left) => {
                above[left] = k as u32;
                above[k - 1] = k as u32;
            }
        }
    }
    let owners = first_at
        .par_iter()
        .zip(last_at)
        .with_min_len(TASK)
        .map(|(&first, &last)| {
            if first == NONE {
                return NONE;
            }
            let mut part = leaf_at[first as usize];
            while tree.parts[part as usize].to <= last {
                part = above[part as usize];
            }
            part
        })
        .collect();
    (owners, leaf_at, above)
}

/// How many unknowns each part with kept ones shares with the rest: those that have elements in it and are complete above.
/// The others are below any frontier whatever they cost.
fn count_borders(
    elements: &impl Elements,
    tree: &Tree,
    owners: &[u32],
    leaf_at: &[u32],
    above: &[u32],
    counts: &mut [Count],
) {
    // The smallest part with kept unknowns that each is in; itself, if it has some.
    let mut has_kept: Vec<bool> = counts.iter().map(|count| count.kept > 0).collect();
    for k in 0..above.len() {
        if above[k] != NONE {
            has_kept[above[k] as usize] |= has_kept[k];
        }
    }
    let mut nearest: Vec<u32> = (0..above.len() as u32).collect();
    for k in (0..above.len()).rev() {
        if !has_kept[k] && above[k] != NONE {
            nearest[k] = nearest[above[k] as usize];
        }
    }
    // Parts above have larger numbers.
    let is_on_border = |nearest: u32, k: u32| {
        let owner = owners[k as usize];
        owner != NONE && owner > nearest
    };
    let of_task = |(task, members): (usize, &[u32])| {
        let mut on_borders = Vec::new();
        for (position, &e) in (task * TASK..).zip(members) {
            let nearest = nearest[leaf_at[position] as usize];
            let unknowns = elements.of(e as usize).iter();
            let on_border = unknowns.filter(|&&k| is_on_border(nearest, k));
            on_borders.extend(on_border.map(|&k| (position as u32, k)));
        }
        on_borders
    };
    let on_borders: Vec<Vec<(u32, u32)>> = tree
        .order
        .par_chunks(TASK)
        .enumerate()
        .map(of_task)
        .collect();
    let mut last = vec![NONE; owners.len()];
    for &(position, k) in on_borders.iter().flatten() {
        // Parts that hold the element before are counted, and none if it is this one.
        let before = std::mem::replace(&mut last[k as usize], position);
        let mut part = nearest[leaf_at[position as usize] as usize];
        while part != owners[k as usize]
            && (before == NONE || tree.parts[part as usize].from > before)
        {
            counts[part as usize].border += 1;
            part = above[part as usize];
        }
    }
}

/// The unknowns sorted by owner, and where those of each owner start.
fn eliminate(owners: &[u32], parts: usize) -> (Vec<u32>, Vec<u32>) {
    let mut firsts = vec![0u32; parts + 1];
    for &owner in owners.iter().filter(|&&owner| owner != NONE) {
        firsts[owner as usize + 1] += 1;
    }
    for k in 0..parts {
        firsts[k + 1] += firsts[k];
    }
    let mut next = firsts.clone();
    let mut order = vec![0; firsts[parts] as usize];
    for (k, &owner) in owners
        .iter()
        .enumerate()
        .filter(|(_, owner)| **owner != NONE)
    {
        let slot = &mut next[owner as usize];
        order[*slot as usize] = k as u32;
        *slot += 1;
    }
    (firsts, order)
}

/// Numbers of elimination, from which the fronts are merged.
struct Numbering<'a, E> {
    elements: &'a E,
    tree: &'a Tree,
    /// The elements that are eliminated, and how many of them stand before each position.
    inside: &'a [u32],
    before: &'a [u32],
    /// Of each unknown; the kept ones have the last.
    numbers: &'a [u32],
    /// The first pivot of each part.
    firsts: &'a [u32],
    /// Parts up to this size are planned as one.
    grain: usize,
}

impl<E: Elements> Numbering<'_, E> {
    /// The elements of a part that are eliminated.
    fn inside_of(&self, part: usize) -> &[u32] {
        let part = self.tree.parts[part];
        &self.inside
            [self.before[part.from as usize] as usize..self.before[part.to as usize] as usize]
    }

    /// The plan of a part, and the numbers on its border, ascending.
    fn plan(&self, root: usize) -> (Plan, Vec<u32>) {
        let part = self.tree.parts[root];
        let mut plan = Plan {
            from: self.before[part.from as usize] as usize,
            ..Plan::default()
        };
        let border = match part.left() {
            Some(left) if part.len() > self.grain => {
                let (a, b) = rayon::join(|| self.plan(left), || self.plan(root - 1));
                let mut front = Vec::new();
                merge(&a.1, &b.1, &mut front, &mut plan.maps);
                let border = self.close(&mut plan, root, 0, Front::OF_HALVES, &front);
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
        // Borders of parts that wait for their other half.
        let mut borders: Vec<Vec<u32>> = Vec::new();
        let (mut front, mut waiting) = (Vec::new(), 0);
        for k in first..=root {
            front.clear();
            let map = if self.tree.parts[k].left().is_none() {
                let map = plan.places.len();
                self.gather(k, &mut front, &mut plan.places);
                map
            } else {
                let (b, a) = (borders.pop(), borders.pop());
                let (a, b) = (a.unwrap_or_default(), b.unwrap_or_default());
                let map = plan.maps.len();
                merge(&a, &b, &mut front, &mut plan.maps);
                waiting -= a.len().pow(2) / 2 + b.len().pow(2) / 2;
                map
            };
            let elements = match self.tree.parts[k].left() {
                None => self.inside_of(k).len() as u32,
                Some(_) => Front::OF_HALVES,
            };
            let border = self.close(plan, k, map, elements, &front);
            waiting += border.len().pow(2) / 2;
            plan.waiting = plan.waiting.max(waiting + front.len().pow(2));
            borders.push(border);
        }
        borders.pop().unwrap_or_default()
    }

    /// The unknowns of a leaf's elements, and their places.
    fn gather(&self, leaf: usize, front: &mut Vec<u32>, places: &mut Vec<u8>) {
        let elements = self.inside_of(leaf);
        let numbers = || {
            let unknowns = elements.iter().flat_map(|&e| self.elements.of(e as usize));
            unknowns.map(|&k| self.numbers[k as usize])
        };
        front.extend(numbers().filter(|&number| number != NONE));
        front.sort_unstable();
        front.dedup();
        places.extend(numbers().map(|number| {
            let place = front.iter().position(|&other| other == number);
            place.map_or(Plan::FIXED, |place| place as u8)
        }));
    }

    /// Adds the front of a part and returns its border.
    fn close(
        &self,
        plan: &mut Plan,
        part: usize,
        map: usize,
        elements: u32,
        front: &[u32],
    ) -> Vec<u32> {
        let pivots = (self.firsts[part + 1] - self.firsts[part]) as usize;
        debug_assert!(
            front[..pivots]
                .iter()
                .copied()
                .eq(self.firsts[part]..self.firsts[part + 1])
        );
        let border = front[pivots..].to_vec();
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

/// The union of two ascending lists, and the places of both in it.
fn merge(a: &[u32], b: &[u32], union: &mut Vec<u32>, places: &mut Vec<u32>) {
    let start = places.len();
    places.resize(start + a.len() + b.len(), 0);
    let (in_a, in_b) = places[start..].split_at_mut(a.len());
    let (mut i, mut j) = (0, 0);
    while i < a.len() || j < b.len() {
        let next = match (a.get(i), b.get(j)) {
            (Some(&x), Some(&y)) => x.min(y),
            (Some(&x), None) | (None, Some(&x)) => x,
            (None, None) => break,
        };
        if a.get(i) == Some(&next) {
            in_a[i] = union.len() as u32;
            i += 1;
        }
        if b.get(j) == Some(&next) {
            in_b[j] = union.len() as u32;
            j += 1;
        }
        union.push(next);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::Network;
    use super::*;

    /// On a grid with more springs than one task looks at, against a look at every part's elements.
    #[test]
    fn borders_are_what_parts_share_with_the_rest() {
        let side = 60;
        let mut grid = Network::path(side * side);
        grid.springs.clear();
        for k in 0..side * side {
            grid.points[k as usize] = [f64::from(k % side), f64::from(k / side), 0.0];
            let ahead = [(1, k % side + 1 < side), (side, k / side + 1 < side)];
            let springs = ahead.iter().filter(|(_, inside)| *inside);
            grid.springs
                .extend(springs.map(|(step, _)| ([k, k + step], 1.0)));
        }
        assert!(grid.count() > TASK);
        let role = |k: u32| {
            if k < 2 * side && k.is_multiple_of(3) {
                Role::Kept
            } else {
                Role::Eliminated
            }
        };
        let roles: Vec<Role> = (0..side * side).map(role).collect();
        let members: Vec<u32> = (0..grid.count() as u32).collect();
        let tree = Tree::new(&members, |e| grid.centre(e as usize));
        let (first_at, last_at) = spans(&grid, &tree, &roles);
        let (owners, leaf_at, above) = owners(&tree, &first_at, &last_at);
        let mut counts = vec![Count::default(); tree.parts.len()];
        for (owner, role) in owners.iter().zip(&roles) {
            counts[*owner as usize].kept += u32::from(*role == Role::Kept);
        }
        count_borders(&grid, &tree, &owners, &leaf_at, &above, &mut counts);
        let mut with_kept = 0;
        for (k, part) in tree.parts.iter().enumerate() {
            let elements = &tree.order[part.from as usize..part.to as usize];
            let mut unknowns: Vec<u32> = elements
                .iter()
                .flat_map(|&e| grid.of(e as usize))
                .copied()
                .collect();
            unknowns.sort_unstable();
            unknowns.dedup();
            // Complete in the part or below it, or shared.
            let complete = |unknown: &&u32| owners[**unknown as usize] <= k as u32;
            let has_kept = unknowns
                .iter()
                .filter(complete)
                .any(|&u| roles[u as usize] == Role::Kept);
            let shared = unknowns.len() - unknowns.iter().filter(complete).count();
            let expected = if has_kept { shared as u32 } else { 0 };
            assert_eq!(counts[k].border, expected, "part {k}");
            with_kept += usize::from(has_kept);
        }
        assert!(with_kept > 20 && with_kept < tree.parts.len() / 2);
    }
}
