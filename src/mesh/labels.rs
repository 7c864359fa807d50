//! From groups, which list their cells, to cells, which list their groups.

use std::collections::HashMap;

use super::Mesh;

/// The set of groups that each cell is in, each different set once.
pub struct CellGroups {
    /// Index into `sets`, for each cell; 0 is the empty set.
    pub set_of: Vec<u32>,
    /// Indices into [`Mesh::groups`], ascending.
    pub sets: Vec<Vec<u32>>,
}

impl CellGroups {
    pub fn new(mesh: &Mesh) -> Self {
        let mut set_of = vec![0u32; mesh.cell_count()];
        let mut sets: Vec<Vec<u32>> = vec![Vec::new()];
        for (group, index) in mesh.groups.iter().zip(0u32..) {
            // What adding this group makes of each set.
            let mut with: HashMap<u32, u32> = HashMap::new();
            let mut last = None;
            for &cell in &group.cells {
                let Some(set) = set_of.get_mut(cell as usize) else {
                    continue;
                };
                let next = match last {
                    Some((from, to)) if from == *set => to,
                    _ => *with.entry(*set).or_insert_with(|| {
                        let mut grown = sets.get(*set as usize).cloned().unwrap_or_default();
                        grown.push(index);
                        sets.push(grown);
                        sets.len() as u32 - 1
                    }),
                };
                last = Some((*set, next));
                *set = next;
            }
        }
        CellGroups { set_of, sets }
    }

    /// The groups of a cell.
    pub fn of(&self, cell: usize) -> &[u32] {
        let set = self.set_of.get(cell).copied().unwrap_or(0);
        self.sets.get(set as usize).map_or(&[], Vec::as_slice)
    }

    /// The first group of each set, as formats want it that give a cell one label; and how many cells have more.
    pub fn single(&self) -> (Vec<Option<u32>>, usize) {
        let first = self.sets.iter().map(|set| set.first().copied()).collect();
        let many = |set: &u32| {
            self.sets
                .get(*set as usize)
                .is_some_and(|set| set.len() > 1)
        };
        (first, self.set_of.iter().filter(|set| many(set)).count())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{CellBlock, CellKind, Group};

    #[test]
    fn sets_are_told_apart() {
        let group = |tag, cells: &[u32]| Group {
            dim: 1,
            tag,
            name: None,
            cells: cells.to_vec(),
        };
        let mesh = Mesh {
            points: vec![[0.0; 3]; 2],
            blocks: vec![CellBlock::new(CellKind::Line, [0, 1].repeat(4))],
            groups: vec![group(1, &[0, 1]), group(2, &[1, 2])],
            ..Mesh::default()
        };
        let groups = CellGroups::new(&mesh);
        let sets: Vec<&[u32]> = (0..4).map(|cell| groups.of(cell)).collect();
        assert_eq!(sets, [&[0][..], &[0, 1], &[1], &[]]);
        assert_eq!(groups.single().1, 1);
    }
}
