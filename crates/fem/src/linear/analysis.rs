//! Which unknown is eliminated when, and what the fronts look like (J. Liu, SIAM Review 34, 1992):
//! everything about the factorisation that does not depend on values.
//!
//! The tree of [`super::bisection`] cuts the elements. A front belongs to each of its parts: the
//! unknowns that are complete there, having all their elements in the part but not in either half,
//! are its *pivots* and are eliminated; the others that the part shares with the rest are its
//! *border*. Kept unknowns are never complete, so that they arrive in the border of the whole, or
//! of the parts of [`super::frontier`], above which all is left to [`super::lu`].

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use super::Entry;
use super::bisection::Tree;
use super::frontier::{self, Counts, STEPS, cholesky};
use super::lu_plan::LuPlan;
use super::plan::{Numbering, Plan};
use super::{Elements, Role};
use faceoff_mesh::counting::sort_by_key;
use faceoff_mesh::parallel;
use rayon::prelude::*;

const NONE: u32 = u32::MAX;
/// Seconds on one core, fitted as described in [`Analysis::seconds`].
const OF_UNKNOWN: f64 = 8e-7;
const OF_FLOP: f64 = 5e-11;

/// Elements that one task looks at.
const TASK: usize = 1 << 12;

/// The tree is walked by at most about twice this many tasks, for any number of threads.
const TASKS: usize = 64;

/// The order of elimination and the fronts.
#[derive(Debug)]
pub struct Analysis {
    /// The kept unknowns, ascending: the order of the Schur complement. Besides those that were to be kept, these are the ones
    /// complete above the frontier.
    pub kept: Vec<u32>,
    /// The eliminated unknowns in their order.
    pub order: Vec<u32>,
    /// The place of each unknown in the order, behind which the kept ones come; none of fixed ones.
    pub(super) numbers: Vec<u32>,
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
    /// `roles` of all unknowns; `ties` couple kept ones in addition to the elements; fixed ones in them do not matter. Where `is_whole`
    /// nothing else is kept.
    pub fn new(elements: &impl Elements, roles: &[Role], ties: &[&[u32]], is_whole: bool) -> Self {
        // What is done with each element: eliminated with any of its unknowns, or else kept with one.
        let of_element = |e: usize| {
            let mut of_unknowns = elements.of(e).iter().map(|&k| roles[k as usize]);
            if of_unknowns.clone().any(|role| role == Role::Eliminated) {
                Role::Eliminated
            } else {
                of_unknowns
                    .find(|role| *role == Role::Kept)
                    .unwrap_or(Role::Fixed)
            }
        };
        let of_elements = parallel::chunks(elements.count(), TASK, |chunk| {
            chunk.map(of_element).collect()
        });
        let is_inside = |e: u32| of_elements[e as usize] == Role::Eliminated;
        let members = numbers_of(elements.count(), |e| of_elements[e] != Role::Fixed);
        let tree = Tree::new(&members, |e| elements.centre(e as usize));
        let positions = inverse(&[&tree.order], elements.count());
        let (first_at, last_at) = spans(elements, &positions, roles);
        let (mut owners, leaf_at, above) = owners(&tree, &first_at, &last_at);
        // It belongs to only one element: it can be eliminated before all others.
        let is_private = |k: usize| {
            let [first, last] = [first_at[k], last_at[k]];
            roles[k] == Role::Kept
                && first == last
                && first != NONE
                && !is_inside(tree.order[first as usize])
        };
        let mut counts = Counts::new(tree.parts.len());
        let mut near = Vec::new();
        if roles.contains(&Role::Kept) && !is_whole {
            let is_counted = |k: usize| roles[k] == Role::Kept && !is_private(k);
            let to_keep = numbers_of(roles.len(), is_counted);
            let places = Places {
                positions: &positions,
                owners: &owners,
                leaf_at: &leaf_at,
                above: &above,
            };
            near = places.count(elements, &tree, roles, &to_keep, &mut counts);
        }
        drop(positions);
        let open = frontier::open(&tree, &counts, &near, &above);
        let is_above = |owner: u32| owner != NONE && open[owner as usize];
        let is_kept = |k: usize| match roles[k] {
            Role::Fixed => false,
            Role::Kept => true,
            Role::Eliminated => is_above(owners[k]),
        };
        let kept = numbers_of(roles.len(), is_kept);
        // What is kept, by the front that eliminates it: that of its single element, or of a part.
        let (mut alone, mut of_parts) = (Vec::new(), Vec::new());
        for (number, &k) in (0..).zip(&kept) {
            let owner = std::mem::replace(&mut owners[k as usize], NONE);
            if is_private(k as usize) {
                alone.push((first_at[k as usize], number));
            } else {
                // An unknown of no element has only ties, and comes last. Below the frontier one is carried up to it.
                let mut part = owner;
                while part != NONE
                    && above[part as usize] != NONE
                    && !is_above(above[part as usize])
                {
                    part = above[part as usize];
                }
                of_parts.push((part, number));
            }
        }
        let groups = [grouped(alone), grouped(of_parts)].concat();
        let aside_at = numbers_of(tree.order.len(), |at| !is_inside(tree.order[at]));
        let aside: Vec<u32> = aside_at.iter().map(|&at| tree.order[at as usize]).collect();
        let inside = parallel::chunks(tree.order.len(), TASK, |chunk| {
            let elements = tree.order[chunk].iter().copied();
            elements.filter(|&e| is_inside(e)).collect()
        });
        let (firsts, order) = sort_by_key(&owners, tree.parts.len());
        let numbers = inverse(&[&order, &kept], roles.len());
        let numbering = Numbering {
            elements,
            tree: &tree,
            inside: &inside,
            aside_at: &aside_at,
            numbers: &numbers,
            firsts: &firsts,
            grain: (tree.order.len() / TASKS)
                .max(256)
                .min(u16::MAX as usize / elements.size()),
        };
        let opened = near.iter().filter(|&&k| is_above(k));
        let halves = opened.flat_map(|&k| {
            let left = tree.parts[k as usize].left();
            left.into_iter()
                .flat_map(move |left| [left, k as usize - 1])
        });
        let mut roots: Vec<usize> = halves.chain(tree.parts.len().checked_sub(1)).collect();
        roots.retain(|&k| !open[k] && !numbering.inside_of(k).is_empty());
        roots.sort_unstable();
        let blocks = parallel::map(roots, |root| {
            let (plan, mut border) = numbering.plan(root);
            border
                .iter_mut()
                .for_each(|place| *place -= order.len() as u32);
            (plan, border)
        });
        let place = |k: &u32| kept.binary_search(k).ok().map(|place| place as u32);
        let places = |unknowns: &[u32]| unknowns.iter().filter_map(place).collect::<Vec<u32>>();
        let of_elements = aside.iter().map(|&e| places(elements.of(e as usize)));
        let lu = LuPlan::new(
            groups,
            blocks.iter().map(|(_, border)| &border[..]),
            of_elements.chain(ties.iter().map(|tie| places(tie))),
        );
        Analysis {
            order,
            numbers,
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
    /// tenth of the work of an analysis; nothing in 2D, where the whole costs little.
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

    /// Bytes that factor, updates, Schur complement and its factorisation take, with numbers of `size` bytes below the
    /// diagonal of the factor.
    pub fn bytes(&self, size: usize) -> usize {
        let waiting = self.blocks.iter().map(|(plan, _)| plan.waiting).max();
        let dense: usize = self
            .blocks
            .iter()
            .map(|(_, border)| border.len().pow(2))
            .sum();
        let wide = self.order.len() + waiting.unwrap_or(0) + dense;
        (self.entries() - self.order.len()) * size + (wide + self.lu.entries + self.lu.largest) * 8
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

/// Those of 0, 1, …, `count` - 1 that are wanted, ascending.
fn numbers_of(count: usize, is_wanted: impl Fn(usize) -> bool + Sync) -> Vec<u32> {
    parallel::chunks(count, TASK, |chunk| {
        let wanted = chunk.filter(|&k| is_wanted(k));
        wanted.map(|k| k as u32).collect()
    })
}

/// The position of each of `count` numbers in these lists, one after the other; none for others.
fn inverse(lists: &[&[u32]], count: usize) -> Vec<u32> {
    // Each place is written once; atomic, as all cores write.
    let places: Vec<AtomicU32> = (0..count).map(|_| AtomicU32::new(NONE)).collect();
    let mut first = 0;
    for list in lists {
        let tasks = (first..).step_by(TASK).zip(list.chunks(TASK));
        parallel::map(tasks, |(first, list)| {
            for (k, &number) in (first as u32..).zip(list) {
                places[number as usize].store(k, Ordering::Relaxed);
            }
        });
        first += list.len();
    }
    places.into_iter().map(AtomicU32::into_inner).collect()
}

/// The first and the last position in the tree of the elements of each unknown; none of fixed ones.
fn spans(elements: &impl Elements, positions: &[u32], roles: &[Role]) -> (Vec<u32>, Vec<u32>) {
    let of_all = |none: u32, is_nearer: fn(u32, u32) -> bool| {
        let mut found = vec![none; roles.len()];
        // In the order of their numbers, in which neighbours are often near each other in memory.
        for (e, &position) in positions.iter().enumerate() {
            for &k in elements.of(e) {
                let found = &mut found[k as usize];
                if position != NONE && is_nearer(position, *found) {
                    *found = position;
                }
            }
        }
        found
    };
    let (mut first_at, last_at) = rayon::join(
        || of_all(NONE, |position, first| position < first),
        || of_all(0, |position, last| position > last),
    );
    parallel::update(&mut first_at, |k, first| match roles[k] {
        Role::Fixed => NONE,
        _ => first,
    });
    (first_at, last_at)
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
    // Together, as they are read together and from anywhere.
    let mut ends = vec![(0, 0); tree.parts.len()];
    parallel::update(&mut ends, |k, _| (tree.parts[k].to, above[k]));
    let mut owners = vec![NONE; first_at.len()];
    parallel::update(&mut owners, |k, none| {
        if first_at[k] == NONE {
            return none;
        }
        let mut part = leaf_at[first_at[k] as usize];
        while ends[part as usize].0 <= last_at[k] {
            part = ends[part as usize].1;
        }
        part
    });
    (owners, leaf_at, above)
}

/// The position of elements and unknowns in the tree.
struct Places<'a> {
    /// The position of each element.
    positions: &'a [u32],
    /// See [`owners`].
    owners: &'a [u32],
    leaf_at: &'a [u32],
    above: &'a [u32],
}

impl Places<'_> {
    /// How many unknowns each part with some of `to_keep` keeps and eliminates, and how many it shares with the rest: those that
    /// have elements in it and are complete above. Returns these parts, ascending; the others are below any frontier whatever
    /// they cost.
    fn count(
        &self,
        elements: &impl Elements,
        tree: &Tree,
        roles: &[Role],
        to_keep: &[u32],
        counts: &mut Counts,
    ) -> Vec<u32> {
        let mut has_kept = vec![false; self.above.len()];
        let mut near = Vec::new();
        for k in to_keep.iter().map(|&k| k as usize) {
            let mut part = self.owners[k];
            if part != NONE {
                counts.kept[part as usize] += 1;
            }
            while part != NONE && !has_kept[part as usize] {
                has_kept[part as usize] = true;
                near.push(part);
                part = self.above[part as usize];
            }
        }
        near.sort_unstable();
        // What is complete in other parts is on no border of these.
        let is_seen = |k: usize| {
            let owner = self.owners[k];
            owner != NONE && has_kept[owner as usize]
        };
        let mut sees = vec![false; roles.len()];
        for k in numbers_of(roles.len(), is_seen) {
            let k = k as usize;
            sees[k] = true;
            let is_eliminated = roles[k] == Role::Eliminated;
            counts.eliminated[self.owners[k] as usize] += u32::from(is_eliminated);
        }
        let seen = |e: usize| {
            let position = self.positions[e];
            let leaf = self.leaf_at.get(position as usize).copied();
            // Unknowns of only one leaf are on no border.
            let is_shared =
                move |k: &u32| leaf.is_some_and(|leaf| self.owners[*k as usize] != leaf);
            let seen = elements.of(e).iter().filter(|&&k| sees[k as usize]);
            seen.copied().filter(is_shared).map(move |k| (k, position))
        };
        let mut seen = parallel::chunks(elements.count(), TASK, |chunk| {
            chunk.flat_map(seen).collect()
        });
        seen.par_sort_unstable();
        let mut last = (NONE, NONE);
        for (k, position) in seen {
            // Parts that hold the unknown's element before are counted, and none if it is this one.
            let before = if last.0 == k { last.1 } else { NONE };
            last = (k, position);
            let mut part = self.leaf_at[position as usize];
            while part != self.owners[k as usize]
                && (before == NONE || tree.parts[part as usize].from > before)
            {
                counts.border[part as usize] += u32::from(has_kept[part as usize]);
                part = self.above[part as usize];
            }
        }
        near
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
            if k < 15 * side && !k.is_multiple_of(3) {
                Role::Kept
            } else {
                Role::Eliminated
            }
        };
        let roles: Vec<Role> = (0..side * side).map(role).collect();
        let members: Vec<u32> = (0..grid.count() as u32).collect();
        let tree = Tree::new(&members, |e| grid.centre(e as usize));
        let positions = inverse(&[&tree.order], grid.count());
        let (first_at, last_at) = spans(&grid, &positions, &roles);
        let (owners, leaf_at, above) = owners(&tree, &first_at, &last_at);
        let mut counts = Counts::new(tree.parts.len());
        let to_keep = numbers_of(roles.len(), |u| roles[u] == Role::Kept);
        let places = Places {
            positions: &positions,
            owners: &owners,
            leaf_at: &leaf_at,
            above: &above,
        };
        let near = places.count(&grid, &tree, &roles, &to_keep, &mut counts);
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
            assert_eq!(counts.border[k], expected, "part {k}");
            let own = (0..roles.len()).filter(|&u| owners[u] == k as u32);
            let kept = own.clone().filter(|&u| roles[u] == Role::Kept).count();
            assert_eq!(counts.kept[k], kept as u32, "part {k}");
            let eliminated = own.filter(|&u| roles[u] == Role::Eliminated).count();
            let expected = if has_kept { eliminated as u32 } else { 0 };
            assert_eq!(counts.eliminated[k], expected, "part {k}");
            assert_eq!(near.contains(&(k as u32)), has_kept, "part {k}");
        }
        assert!(near.len() > 20 && near.len() < tree.parts.len() / 2);
    }
}
