//! `$Elements` of MSH 2.2.

use std::collections::{HashMap, HashSet};

use super::writer::Writer;
use crate::mesh::{CellBlock, Mesh};

/// Data common to all elements.
struct Context<'a, P> {
    /// The numbers of elements; none if they count from 1.
    numbers: Vec<u64>,
    point_tag: &'a P,
    /// The physical tag of each set of groups.
    physical_of_set: &'a [i32],
    reversed: HashSet<(u8, i32, i32)>,
}

pub fn elements<P: Fn(u32) -> u64 + Sync>(
    writer: &mut Writer<'_>,
    keep_numbers: bool,
    point_tag: &P,
    physical_of_set: &[i32],
) {
    let mesh = writer.mesh;
    let partitions = partitions(mesh);
    let has_own = keep_numbers && mesh.blocks.iter().any(|block| !block.tags.is_empty());
    let context = Context {
        numbers: if has_own {
            mesh.cell_tags().collect()
        } else {
            Vec::new()
        },
        point_tag,
        physical_of_set,
        reversed: reversed(mesh),
    };
    let mut before = 0;
    for block in mesh.blocks.iter().filter(|block| !block.is_empty()) {
        if writer.binary && partitions.is_empty() {
            context.binary(writer, block, before);
        } else {
            context.one_by_one(writer, block, before, &partitions);
        }
        before += block.len();
    }
}

impl<P: Fn(u32) -> u64 + Sync> Context<'_, P> {
    #[inline]
    fn number(&self, cell: usize) -> u64 {
        self.numbers.get(cell).copied().unwrap_or(cell as u64 + 1)
    }

    /// The physical tag, with a minus sign where the group holds the entity reversed.
    fn physical(&self, block: &CellBlock, place: usize, set: u32) -> i32 {
        let physical = self.physical_of_set.get(set as usize).copied().unwrap_or(0);
        let is_reversed = !self.reversed.is_empty()
            && block.entities.get(place).is_some_and(|&entity| {
                let key = (block.kind.dim(), entity, physical);
                self.reversed.contains(&key)
            });
        if is_reversed { -physical } else { physical }
    }

    /// A binary block of elements, each with its group and its entity.
    fn binary(&self, writer: &mut Writer<'_>, block: &CellBlock, before: usize) {
        let width = block.kind.points();
        let head = [i32::from(block.kind.gmsh()), block.len() as i32, 2];
        let mut out = std::mem::take(&mut writer.out);
        out.append(head.map(i32::to_le_bytes).as_flattened());
        let writer_of_runs = &*writer;
        out.rows(block.len(), 4 * (3 + width), |first, rows| {
            let mut rows = rows.as_chunks_mut::<4>().0.chunks_exact_mut(3 + width);
            let count = rows.len();
            let nodes = block.nodes.get(first * width..).unwrap_or_default();
            let mut nodes = nodes.chunks_exact(width);
            let end = before + first + count;
            for (cells, run) in writer_of_runs.runs_from(before + first) {
                if cells.start >= end {
                    break;
                }
                let physical = self.physical(block, cells.start - before, run.set);
                for cell in cells.start..cells.end.min(end) {
                    let (Some(row), Some(nodes)) = (rows.next(), nodes.next()) else {
                        return;
                    };
                    let number = self.number(cell) as i32;
                    let (head, places) = row.split_at_mut(3);
                    head.copy_from_slice(&[number, physical, run.entity].map(i32::to_le_bytes));
                    for (place, &node) in places.iter_mut().zip(nodes) {
                        *place = ((self.point_tag)(node) as i32).to_le_bytes();
                    }
                }
            }
        });
        writer.out = out;
    }

    /// Elements as text, or in binary with their partitions.
    fn one_by_one(
        &self,
        writer: &mut Writer<'_>,
        block: &CellBlock,
        before: usize,
        partitions: &HashMap<u32, Vec<i32>>,
    ) {
        let kind = i32::from(block.kind.gmsh());
        let parts_of = |place: usize| partitions.get(&((before + place) as u32));
        let tags_of = |place: usize| parts_of(place).map_or(0, |ids| ids.len() + 1);
        let runs: Vec<(usize, i32, u32)> = (writer.runs_from(before))
            .take_while(|(cells, _)| cells.start < before + block.len())
            .map(|(cells, run)| (cells.end - before, run.entity, run.set))
            .collect();
        let mut run = 0;
        let mut same_count = 0;
        for (place, nodes) in block.cells().enumerate() {
            while runs.get(run).is_some_and(|(end, _, _)| *end <= place) {
                run += 1;
            }
            let (_, entity, set) = runs.get(run).copied().unwrap_or_default();
            let tag_count = tags_of(place);
            if writer.binary && same_count == 0 {
                // Elements that share the number of tags make a block.
                let rest = place..block.len();
                same_count = rest
                    .take_while(|&place| tags_of(place) == tag_count)
                    .count();
                writer.i32(kind).i32(same_count as i32);
                writer.i32(2 + tag_count as i32);
            }
            writer.tag(self.number(before + place));
            if writer.binary {
                same_count -= 1;
            } else {
                writer.i32(kind).i32(2 + tag_count as i32);
            }
            writer.i32(self.physical(block, place, set)).i32(entity);
            if let Some(ids) = parts_of(place) {
                writer.i32(ids.len() as i32);
                for &id in ids {
                    writer.i32(id);
                }
            }
            for &node in nodes {
                writer.tag((self.point_tag)(node));
            }
            writer.end();
        }
    }
}

/// Dimension and number of each entity that a group holds reversed, with the number of the group.
fn reversed(mesh: &Mesh) -> HashSet<(u8, i32, i32)> {
    let entities = mesh.geometry.entities.iter();
    let reversed = entities.flat_map(|entity| {
        let groups = entity.physicals.iter().filter(|&&tag| tag < 0);
        groups.map(|tag| (entity.dim, entity.tag, tag.wrapping_neg()))
    });
    reversed.collect()
}

/// The partitions of each cell that has any: its owners and, negative, those in which it is a ghost.
fn partitions(mesh: &Mesh) -> HashMap<u32, Vec<i32>> {
    let mut of_cell: HashMap<u32, Vec<i32>> = HashMap::new();
    let entities = mesh.geometry.entities.iter();
    let parts: HashMap<(u8, i32), &[i32]> = entities
        .filter(|entity| !entity.partitions.is_empty())
        .map(|e| ((e.dim, e.tag), e.partitions.as_slice()))
        .collect();
    if !parts.is_empty() {
        let entities = mesh.blocks.iter().flat_map(|block| {
            let entity = |i: usize| block.entities.get(i).copied().unwrap_or(0);
            (0..block.len()).map(move |i| (block.kind.dim(), entity(i)))
        });
        for (cell, entity) in (0u32..).zip(entities) {
            if let Some(ids) = parts.get(&entity) {
                of_cell.insert(cell, ids.to_vec());
            }
        }
    }
    for cell in &mesh.geometry.partitions.cells {
        let ghosts = cell.ghosts.iter().map(|id| id.wrapping_neg());
        of_cell.insert(
            cell.cell,
            cell.owners.iter().copied().chain(ghosts).collect(),
        );
    }
    of_cell
}
