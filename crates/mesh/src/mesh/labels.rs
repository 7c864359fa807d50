//! The groups of each cell, from groups that list their cells.

use std::collections::HashMap;
use std::ops::Range;

use super::{Group, Mesh};

/// The set of groups of each cell; equal sets are stored once.
pub struct CellGroups {
    /// Runs of consecutive cells in the same groups, without gaps: the end of each run, and an index into `sets`.
    pub runs: Vec<(u32, u32)>,
    /// Indices into [`Mesh::groups`], ascending. The first is the empty set.
    pub sets: Vec<Vec<u32>>,
}

impl CellGroups {
    /// The groups of a valid mesh.
    pub fn new(mesh: &Mesh) -> Self {
        // Where groups begin and end to hold cells, from the first cell to the last.
        let mut changes: Vec<(u32, u32)> = Vec::new();
        for (group, index) in mesh.groups.iter().zip(0u32..) {
            for cells in consecutive(&group.cells) {
                changes.extend([(cells.start, index), (cells.end, index)]);
            }
        }
        changes.sort_unstable();
        let mut groups = CellGroups {
            runs: Vec::new(),
            sets: vec![Vec::new()],
        };
        let mut known: HashMap<Vec<u32>, u32> = HashMap::from([(Vec::new(), 0)]);
        let mut active: Vec<u32> = Vec::new();
        let mut set = 0;
        for changes in changes.chunk_by(|a, b| a.0 == b.0) {
            let cell = changes.first().map_or(0, |change| change.0);
            groups.end_run(cell, set);
            for &(_, group) in changes {
                match active.binary_search(&group) {
                    Ok(place) => drop(active.remove(place)),
                    Err(place) => active.insert(place, group),
                }
            }
            set = *known.entry(active.clone()).or_insert_with(|| {
                groups.sets.push(active.clone());
                groups.sets.len() as u32 - 1
            });
        }
        groups.end_run(mesh.cell_count() as u32, set);
        groups
    }

    fn end_run(&mut self, end: u32, set: u32) {
        if end > self.runs.last().map_or(0, |run| run.0) {
            self.runs.push((end, set));
        }
    }

    /// The runs from this cell on: each with its cells and the index of its set.
    pub fn runs_from(&self, cell: u32) -> impl Iterator<Item = (Range<u32>, u32)> {
        let first = self.runs.partition_point(|run| run.0 <= cell);
        let runs = self.runs.get(first..).unwrap_or_default().iter();
        runs.scan(cell, |start, &(end, set)| {
            Some((std::mem::replace(start, end)..end, set))
        })
    }

    /// The index of the set of a cell.
    pub fn set_of(&self, cell: u32) -> u32 {
        self.runs_from(cell).next().map_or(0, |(_, set)| set)
    }

    /// The groups of a cell.
    pub fn of(&self, cell: usize) -> &[u32] {
        let set = self.set_of(cell as u32) as usize;
        self.sets.get(set).map_or(&[], Vec::as_slice)
    }

    /// The first group of each set, for formats with one label per cell, and how many cells have more.
    pub fn single<'a>(&self, mesh: &'a Mesh) -> (Vec<Option<&'a Group>>, usize) {
        let first = |set: &Vec<u32>| mesh.groups.get(*set.first()? as usize);
        let first = self.sets.iter().map(first).collect();
        let many = |set: u32| self.sets.get(set as usize).is_some_and(|set| set.len() > 1);
        let runs = self.runs_from(0).filter(|(_, set)| many(*set));
        (first, runs.map(|(cells, _)| cells.len()).sum())
    }
}

/// Runs of integers, each one more than the one before, in an ascending list.
fn consecutive(cells: &[u32]) -> impl Iterator<Item = Range<u32>> {
    let mut rest = cells;
    std::iter::from_fn(move || {
        let &first = rest.first()?;
        // Ascending numbers without a gap: the last one is known from the first.
        let reaches = |place: usize| {
            let cell = rest.get(place).copied();
            cell.is_some_and(|cell| (cell - first) as usize == place)
        };
        let mut step = 1;
        while reaches(step) {
            step *= 2;
        }
        let (mut inside, mut outside) = (step / 2, step.min(rest.len()));
        while outside - inside > 1 {
            let middle = inside.midpoint(outside);
            *if reaches(middle) {
                &mut inside
            } else {
                &mut outside
            } = middle;
        }
        rest = rest.split_at(outside).1;
        Some(first..first + outside as u32)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{CellBlock, CellKind};

    #[test]
    fn sets_are_told_apart() {
        let group = |tag, cells: &[u32]| Group {
            dim: 1,
            tag,
            name: None,
            cells: cells.to_vec(),
        };
        let mesh = Mesh {
            points: vec![[0.0; 3]; 2].into(),
            blocks: vec![CellBlock::new(CellKind::Line, [0, 1].repeat(4))],
            groups: vec![group(1, &[0, 1]), group(2, &[1, 2])],
            ..Mesh::default()
        };
        let groups = CellGroups::new(&mesh);
        let sets: Vec<&[u32]> = (0..4).map(|cell| groups.of(cell)).collect();
        assert_eq!(sets, [&[0][..], &[0, 1], &[1], &[]]);
        assert_eq!(groups.single(&mesh).1, 1);
    }

    #[test]
    fn runs_end_where_numbers_are_left_out() {
        let mut random = 1u32;
        for length in (0..70).chain([1000]) {
            let cells: Vec<u32> = (0..length)
                .filter(|_| {
                    random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    random >> 29 != 0
                })
                .collect();
            let plain = cells.chunk_by(|a, b| a + 1 == *b);
            let plain: Vec<Range<u32>> =
                plain.map(|run| run[0]..run[0] + run.len() as u32).collect();
            assert_eq!(consecutive(&cells).collect::<Vec<_>>(), plain);
        }
    }
}
