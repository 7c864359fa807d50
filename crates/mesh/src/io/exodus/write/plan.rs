//! Decides what becomes a block, and what a set of sides, nodes or elements.

use std::collections::{HashMap, HashSet};

use super::{Block, Plan, element};
use crate::error::Result;
use crate::io::exodus::cells;
use crate::io::loss::Losses;
use crate::mesh::topology::{all_sides, corners, key};
use crate::mesh::{CellGroups, CellKind, Group, Mesh, Support};

pub(super) fn plan<'a>(mesh: &'a Mesh, dimension: usize, losses: &mut Losses) -> Result<Plan<'a>> {
    let dim = mesh.dim();
    let mut carries = vec![false; mesh.cell_count()];
    for field in mesh
        .fields
        .iter()
        .filter(|field| field.on == Support::Cells)
    {
        let values = field.values.to_f64();
        for (k, row) in values.chunks(field.components.max(1)).enumerate() {
            let cell = field.at.get(k).map_or(k, |&cell| cell as usize);
            carries[cell] |= row.iter().any(|value| !value.is_nan());
        }
    }
    let mut plan = Plan::default();
    let mut others: Vec<u32> = Vec::new();
    let mut in_sets = vec![false; mesh.cell_count()];
    let owners = owners(mesh, dim)?;
    for (group, k) in mesh.groups.iter().zip(0..) {
        let free = group.dim < dim && !group.cells.iter().any(|&cell| carries[cell as usize]);
        let sides = match free && group.dim + 1 == dim && dim > 1 {
            true => sides_of(mesh, group, &owners, dimension),
            false => None,
        };
        if let Some(sides) = sides {
            plan.side_sets.push((group, sides));
        } else if free && group.dim == 0 {
            plan.node_sets.push(group);
        } else {
            others.push(k);
            continue;
        }
        group
            .cells
            .iter()
            .for_each(|&cell| in_sets[cell as usize] = true);
    }
    let sides = plan
        .side_sets
        .iter()
        .flat_map(|(group, sides)| group.cells.iter().copied().zip(sides.iter().copied()));
    losses.note_twice(sides);
    let sets = CellGroups::new(mesh);
    let kept = |set: &Vec<u32>| -> Vec<u32> {
        set.iter()
            .copied()
            .filter(|k| others.binary_search(k).is_ok())
            .collect()
    };
    let kept: Vec<Vec<u32>> = sets.sets.iter().map(kept).collect();
    let mut places: HashMap<(CellKind, &[u32]), usize> = HashMap::new();
    let mut ends = mesh.ranges().map(|(cells, block)| (block.kind, cells.end));
    let (mut kind, mut end) = (CellKind::Vertex, 0);
    // The block of the last cell, which is mostly that of the next.
    let mut last: Option<(CellKind, u32, usize)> = None;
    for (cells, set) in sets.runs_from(0) {
        let groups = kept[set as usize].as_slice();
        for cell in cells {
            while cell >= end {
                let Some(next) = ends.next() else { break };
                (kind, end) = next;
            }
            if groups.is_empty() && in_sets[cell as usize] {
                continue;
            }
            if last.is_none_or(|(of, in_set, _)| (of, in_set) != (kind, set)) {
                let place = *places.entry((kind, groups)).or_insert_with(|| {
                    plan.blocks.push(Block {
                        kind,
                        cells: Vec::new(),
                        group: None,
                        of: groups.to_vec(),
                        tag: NO_TAG,
                    });
                    plan.blocks.len() - 1
                });
                last = Some((kind, set, place));
            }
            if let Some((.., place)) = last {
                plan.blocks[place].cells.push(cell);
            }
        }
    }
    for block in &mut plan.blocks {
        let mut groups = block.of.iter().map(|&k| &mesh.groups[k as usize]);
        block.group = groups.find(|group| group.cells.len() == block.cells.len());
    }
    let unknown = plan
        .blocks
        .iter()
        .filter(|block| element(block.kind, dimension).is_none());
    let unknown: Vec<CellKind> = unknown.map(|block| block.kind).collect();
    for kind in unknown {
        losses.lose(format!("{kind} cells"));
    }
    plan.blocks
        .retain(|block| element(block.kind, dimension).is_some());
    if plan.blocks.iter().any(|block| block.group.is_none()) {
        losses.note(
            "cells in no group or in several are blocks, which are groups when they are read again",
        );
    }
    number(mesh, &mut plan, &others, losses);
    Ok(plan)
}

const NO_TAG: i64 = -1;

/// Gives the blocks their numbers, and the groups that are none to element sets.
fn number<'a>(mesh: &'a Mesh, plan: &mut Plan<'a>, others: &[u32], losses: &mut Losses) {
    let fits = |tag: i64| tag >= 0 && i32::try_from(tag).is_ok();
    let mut taken: HashSet<i64> = HashSet::new();
    for block in &mut plan.blocks {
        let tag = block.group.map_or(NO_TAG, |group| group.tag);
        block.tag = if fits(tag) && taken.insert(tag) {
            tag
        } else {
            NO_TAG
        };
    }
    let mut next = mesh
        .groups
        .iter()
        .map(|group| group.tag)
        .filter(|&tag| fits(tag))
        .max()
        .unwrap_or(0);
    for block in plan.blocks.iter_mut().filter(|block| block.tag == NO_TAG) {
        next += 1;
        block.tag = next;
        if let Some(group) = block.group {
            losses.note(format!(
                "the group {} of dimension {} is numbered {next}",
                group.tag, group.dim
            ));
        }
    }
    let is_block = |group: &Group| {
        plan.blocks
            .iter()
            .any(|block| block.group.is_some_and(|g| std::ptr::eq(g, group)))
    };
    plan.element_sets = others
        .iter()
        .map(|&k| &mesh.groups[k as usize])
        .filter(|group| !is_block(group))
        .collect();
    let numbered = plan.node_sets.iter().chain(&plan.element_sets);
    let odd = numbered
        .chain(plan.side_sets.iter().map(|(group, _)| group))
        .filter(|group| !fits(group.tag));
    losses.lose_some(
        odd.count(),
        "numbers of groups that are negative or exceed 32 bits",
    );
}

type Owners = HashMap<[u32; 4], u32>;

/// A cell of the highest dimension behind each of its sides.
fn owners(mesh: &Mesh, dim: u8) -> Result<Owners> {
    let needed = mesh
        .groups
        .iter()
        .any(|group| group.dim + 1 == dim && dim > 1);
    let sides = if needed {
        all_sides(mesh, dim)?
    } else {
        Vec::new()
    };
    Ok(sides
        .into_iter()
        .rev()
        .map(|side| (side.key, side.cell))
        .collect())
}

/// The cells of a group as sides of others; none if one is not.
fn sides_of(
    mesh: &Mesh,
    group: &Group,
    owners: &Owners,
    dimension: usize,
) -> Option<Vec<(u32, usize)>> {
    let side = |&cell: &u32| {
        let (kind, nodes) = mesh.cell(cell)?;
        let of = corners(kind, nodes)?;
        let wanted = key(of.iter().copied());
        let owner = *owners.get(&wanted)?;
        let (kind, nodes) = mesh.cell(owner)?;
        element(kind, dimension)?;
        let all = cells::sides(kind.shape(), dimension == 3);
        let number = all
            .iter()
            .position(|side| key(side.iter().map(|&k| nodes[k])) == wanted)?;
        Some((owner, number + 1))
    };
    group.cells.iter().map(side).collect()
}
