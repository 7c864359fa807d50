//! The fronts of [`super::lu`]: what of it does not depend on values.

use std::ops::Range;

use super::Entry;
use super::frontier;

/// The fronts are walked by at most about twice this many tasks, for any number of threads.
const TASKS: f64 = 64.0;

/// The fronts, all that does not depend on values.
#[derive(Debug, Default)]
pub(super) struct LuPlan {
    /// In postorder.
    pub fronts: Vec<Front>,
    /// Fronts one after the other, a small part of the tree or one of those above, whose halves are in earlier levels.
    pub levels: Vec<Vec<Range<usize>>>,
    /// The number of each unknown in the order of elimination, and the front of each number.
    pub numbers: Vec<u32>,
    owners: Vec<u32>,
    /// Places in the fronts.
    pub places: Vec<u32>,
    /// Entries that are stored, and multiplications and additions.
    pub entries: usize,
    pub flops: f64,
    /// Most entries of one front.
    pub largest: usize,
    /// Pivots and borders of all fronts.
    pub rows: usize,
}

#[derive(Debug, Default)]
pub(super) struct Front {
    pub pivots: usize,
    /// Numbers of the pivots and of the border, ascending.
    pub unknowns: Vec<u32>,
    /// Blocks that are added to it, and fronts.
    pub blocks: Vec<u32>,
    pub below: Vec<u32>,
    /// Where the places of the unknowns of those blocks, and then of the borders of those fronts, begin in the plan's.
    pub places: usize,
}

impl Front {
    pub fn border(&self) -> &[u32] {
        &self.unknowns[self.pivots..]
    }
}

impl LuPlan {
    /// `groups` are eliminated one after the other; each block and each tie couples its unknowns.
    pub fn new<'a>(
        groups: Vec<Vec<u32>>,
        blocks: impl Iterator<Item = &'a [u32]>,
        ties: impl Iterator<Item: AsRef<[u32]>>,
    ) -> Self {
        let size = groups.iter().map(Vec::len).sum();
        let mut plan = LuPlan {
            owners: vec![0; size],
            numbers: vec![0; size],
            ..LuPlan::default()
        };
        for (number, (owner, &k)) in (0..groups.len() as u32)
            .zip(&groups)
            .flat_map(|(owner, group)| group.iter().map(move |k| (owner, k)))
            .enumerate()
        {
            plan.owners[number] = owner;
            plan.numbers[k as usize] = number as u32;
        }
        let numbered = |unknowns: &[u32]| -> Vec<u32> {
            let numbers = unknowns.iter().map(|&k| plan.numbers[k as usize]);
            numbers.collect()
        };
        // What is coupled comes into the front that eliminates the first of it.
        let mut tied: Vec<Vec<u32>> = vec![Vec::new(); groups.len()];
        let mut of_blocks = vec![Vec::new(); groups.len()];
        let first = |tie: &[u32]| tie.iter().min().map(|&k| plan.owners[k as usize] as usize);
        let blocks: Vec<Vec<u32>> = blocks.map(numbered).collect();
        for (block, border) in (0..).zip(&blocks) {
            if let Some(first) = first(border) {
                of_blocks[first].push(block);
                tied[first].extend(border);
            }
        }
        for tie in ties {
            let numbers = tie.as_ref().iter().map(|&k| plan.numbers[k as usize]);
            if let Some(first) = numbers.clone().min() {
                tied[plan.owners[first as usize] as usize].extend(numbers);
            }
        }
        let mut below: Vec<Vec<u32>> = vec![Vec::new(); groups.len()];
        let mut next = 0;
        for (g, pivots) in groups.iter().map(Vec::len).enumerate() {
            let mut unknowns: Vec<u32> = (next..next + pivots as u32).collect();
            next += pivots as u32;
            unknowns.append(&mut tied[g]);
            for &half in &below[g] {
                unknowns.extend(plan.fronts[half as usize].border());
            }
            unknowns.sort_unstable();
            unknowns.dedup();
            let places = plan.places.len();
            let place = |k: &u32| unknowns.partition_point(|other| other < k) as u32;
            let of_blocks = std::mem::take(&mut of_blocks[g]);
            let parts = of_blocks
                .iter()
                .map(|&block: &u32| &blocks[block as usize][..]);
            let halves = below[g]
                .iter()
                .map(|&half| plan.fronts[half as usize].border());
            let found: Vec<u32> = parts.chain(halves).flatten().map(place).collect();
            plan.places.extend(found);
            if let Some(&first) = unknowns.get(pivots) {
                let parent = plan.owners[first as usize] as usize;
                below[parent].push(g as u32);
            }
            let (p, b) = (pivots, unknowns.len() - pivots);
            plan.entries += p * p + 2 * p * b;
            plan.flops += frontier::lu(p as f64, b as f64);
            plan.largest = plan.largest.max(unknowns.len().pow(2));
            plan.rows += unknowns.len();
            plan.fronts.push(Front {
                pivots,
                unknowns,
                blocks: of_blocks,
                below: std::mem::take(&mut below[g]),
                places,
            });
        }
        plan.in_postorder()
    }

    /// Puts the fronts into postorder, where what one hands up is soon added, and shares them out among tasks.
    fn in_postorder(mut self) -> Self {
        let count = self.fronts.len();
        let (mut sizes, mut work) = (vec![1; count], vec![0.0; count]);
        let mut is_below = vec![false; count];
        for (g, front) in self.fronts.iter().enumerate() {
            let (p, size) = (front.pivots as f64, front.unknowns.len() as f64);
            work[g] = frontier::lu(p, size - p) + frontier::overhead(size);
            for half in front.below.iter().map(|&half| half as usize) {
                sizes[g] += sizes[half];
                work[g] += work[half];
                is_below[half] = true;
            }
        }
        let whole = (0..count).filter(|&g| !is_below[g]);
        let grain = whole.map(|g| work[g]).sum::<f64>() / TASKS;
        // Each comes after those below it, which end where the next one begins.
        let mut ends = vec![0; count];
        let (mut end, mut level_of) = (count, vec![0; count]);
        for g in (0..count).rev() {
            if !is_below[g] {
                ends[g] = end;
                end -= sizes[g];
            }
            let mut end = ends[g] - 1;
            for half in self.fronts[g].below.iter().rev().map(|&half| half as usize) {
                ends[half] = end;
                end -= sizes[half];
            }
        }
        for (g, front) in self.fronts.iter().enumerate() {
            let halves = front.below.iter().map(|&half| half as usize);
            let is_small = work[g] <= grain;
            if !is_small {
                level_of[g] = halves
                    .clone()
                    .map(|half| level_of[half] + 1)
                    .max()
                    .unwrap_or(0);
            }
            let small = halves.filter(|&half| !is_small && work[half] <= grain);
            let whole = (is_small && !is_below[g]).then_some(g);
            let parts = small
                .chain(whole)
                .map(|part| (ends[part] - sizes[part]..ends[part], 0));
            let own = (!is_small).then(|| (ends[g] - 1..ends[g], level_of[g]));
            for (task, level) in parts.chain(own) {
                let levels = self.levels.len().max(level + 1);
                self.levels.resize(levels, Vec::new());
                self.levels[level].push(task);
            }
        }
        let mut fronts: Vec<Front> = (0..count).map(|_| Front::default()).collect();
        for (g, mut front) in std::mem::take(&mut self.fronts).into_iter().enumerate() {
            let halves = front.below.iter_mut();
            halves.for_each(|half| *half = ends[*half as usize] as u32 - 1);
            fronts[ends[g] - 1] = front;
        }
        self.fronts = fronts;
        let owners = self.owners.iter_mut();
        owners.for_each(|owner| *owner = ends[*owner as usize] as u32 - 1);
        self
    }

    /// Entries, with numbers, by the front that they come into.
    pub fn sorted<'e>(
        &self,
        entries: impl Iterator<Item = &'e Entry> + Clone,
    ) -> (Vec<usize>, Vec<Entry>) {
        let front = |entry: &Entry| {
            let number = |k: u32| self.numbers[k as usize];
            self.owners[number(entry.0).min(number(entry.1)) as usize] as usize
        };
        let mut starts = vec![0; self.fronts.len() + 1];
        for entry in entries.clone() {
            starts[front(entry) + 1] += 1;
        }
        for g in 0..self.fronts.len() {
            starts[g + 1] += starts[g];
        }
        let mut next = starts.clone();
        let mut sorted = vec![(0, 0, 0.0); next[self.fronts.len()]];
        for entry in entries {
            let place = &mut next[front(entry)];
            let (i, j, value) = *entry;
            sorted[*place] = (self.numbers[i as usize], self.numbers[j as usize], value);
            *place += 1;
        }
        (starts, sorted)
    }
}
