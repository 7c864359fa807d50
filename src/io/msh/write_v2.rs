//! MSH 2.2: the version that most codes read.

use std::collections::{HashMap, HashSet};

use super::write::Writer;
use crate::io::loss::Losses;
use crate::io::out::Out;
use crate::mesh::Mesh;

pub fn encode(mut writer: Writer<'_>, losses: &mut Losses) -> Out {
    let mesh = writer.mesh;
    let point_tags = fitting(&mesh.point_tags, "points", losses);
    let cell_tags: Vec<u64> = mesh.cell_tags().collect();
    let cell_tags = match fitting(&cell_tags, "cells", losses) {
        [] => (1..=cell_tags.len() as u64).collect(),
        tags => tags.to_vec(),
    };
    let point_tag = |point: u32| {
        point_tags
            .get(point as usize)
            .copied()
            .unwrap_or(u64::from(point) + 1)
    };
    let physical_of_set = physicals(&writer, losses);
    let geometry = &mesh.geometry;
    if geometry
        .point_runs
        .iter()
        .any(|run| run.parameters.as_ref().is_some_and(|p| !p.is_empty()))
    {
        losses.note("the parametric coordinates of points are not written");
    }
    if writer.split > 0 {
        losses.note(format!(
            "{} entities with cells of different groups were split",
            writer.split
        ));
    }

    writer.header("2.2");
    writer.names(|_, _| false, losses);
    writer.out.text(&format!("$Nodes\n{}\n", mesh.points.len()));
    if writer.binary {
        writer.out.rows(mesh.points.len(), 28, |index, row| {
            let (number, coordinates) = row.split_at_mut(4);
            number.copy_from_slice(&(point_tag(index as u32) as i32).to_le_bytes());
            let (places, _) = coordinates.as_chunks_mut::<8>();
            let point = mesh.points.get(index).into_iter().flatten();
            places
                .iter_mut()
                .zip(point)
                .for_each(|(place, x)| *place = x.to_le_bytes());
        });
    } else {
        for (point, index) in mesh.points.iter().zip(0u32..) {
            writer.u64(point_tag(index));
            point.iter().for_each(|&x| writer.f64(x));
            writer.end();
        }
    }
    writer.end_section("Nodes");

    writer
        .out
        .text(&format!("$Elements\n{}\n", cell_tags.len()));
    elements(&mut writer, &cell_tags, &point_tag, &physical_of_set);
    writer.end_section("Elements");
    if !geometry.periodic.is_empty() {
        periodic(&mut writer.out, mesh, &point_tag);
    }
    writer.fields(point_tag, &cell_tags, losses);
    writer.out
}

/// The tags themselves, or nothing when one of them does not fit 32 bits: then all are numbered anew.
fn fitting<'t>(tags: &'t [u64], of: &str, losses: &mut Losses) -> &'t [u64] {
    if tags.iter().all(|&tag| i32::try_from(tag).is_ok()) {
        return tags;
    }
    losses.note(format!(
        "the {of} are numbered anew, as their numbers exceed 32 bits"
    ));
    &[]
}

/// The one physical tag that 2.2 gives a cell, for each set of groups; 0 means none.
fn physicals(writer: &Writer<'_>, losses: &mut Losses) -> Vec<i32> {
    let (first, many) = writer.groups.single();
    losses.lose_some(many, "cells that are in several groups");
    let tag_of = |tag: i64| i32::try_from(tag).ok().filter(|tag| *tag > 0);
    for group in writer
        .mesh
        .groups
        .iter()
        .filter(|group| tag_of(group.tag).is_none())
    {
        losses.lose(format!(
            "group {} of dimension {}, whose number is not 1 to 2^31 - 1",
            group.tag, group.dim
        ));
    }
    let group = |index: u32| writer.mesh.groups.get(index as usize);
    let tag = |first: Option<u32>| {
        first
            .and_then(group)
            .and_then(|group| tag_of(group.tag))
            .unwrap_or(0)
    };
    first.into_iter().map(tag).collect()
}

fn elements(
    writer: &mut Writer<'_>,
    cell_tags: &[u64],
    point_tag: &(impl Fn(u32) -> u64 + Sync),
    physical_of_set: &[i32],
) {
    let mesh = writer.mesh;
    let partitions = partitions(mesh);
    let reversed = reversed(mesh);
    let set_of = std::mem::take(&mut writer.groups.set_of);
    let entity_of = std::mem::take(&mut writer.entity_of);
    let mut first = 0usize;
    for block in &mesh.blocks {
        let number = i32::from(block.kind.gmsh());
        let width = block.kind.points();
        // Number, group and entity of a cell of this block.
        let head = |index: usize| {
            let cell = first + index;
            let set = set_of.get(cell).copied().unwrap_or(0);
            let physical = physical_of_set.get(set as usize).copied().unwrap_or(0);
            let is_reversed = !reversed.is_empty()
                && block.entities.get(index).is_some_and(|&entity| {
                    reversed.contains(&(block.kind.dim(), entity, physical))
                });
            let tag = cell_tags.get(cell).copied().unwrap_or(0);
            let physical = if is_reversed { -physical } else { physical };
            (tag, [physical, entity_of.get(cell).copied().unwrap_or(0)])
        };
        let nodes = |index: usize| {
            let nodes = block.nodes.iter().skip(width * index).take(width);
            nodes.map(|&node| point_tag(node))
        };
        if writer.binary && partitions.is_empty() && !block.is_empty() {
            let head_of_block = [number, block.len() as i32, 2];
            let out = &mut writer.out;
            out.bytes
                .extend(head_of_block.map(i32::to_le_bytes).as_flattened());
            out.rows(block.len(), 4 * (3 + width), |index, row| {
                let (tag, [physical, entity]) = head(index);
                let nodes = nodes(index).map(|node| node as i32);
                let words = [tag as i32, physical, entity].into_iter().chain(nodes);
                let (places, _) = row.as_chunks_mut::<4>();
                places
                    .iter_mut()
                    .zip(words)
                    .for_each(|(place, word)| *place = word.to_le_bytes());
            });
            first += block.len();
            continue;
        }
        let mut start = 0;
        while start < block.len() {
            // In binary a block of elements shares the number of tags.
            let parts_of = |index: usize| partitions.get(&((first + index) as u32));
            let tags_of = |index: usize| parts_of(index).map_or(0, |ids| ids.len() + 1);
            let tag_count = tags_of(start);
            let run = if partitions.is_empty() {
                block.len() - start
            } else {
                let rest = start..block.len();
                rest.take_while(|&index| tags_of(index) == tag_count)
                    .count()
            };
            if writer.binary {
                let head_of_block = [number, run as i32, 2 + tag_count as i32];
                head_of_block
                    .into_iter()
                    .for_each(|value| writer.i32(value));
            }
            for index in start..start + run {
                let (tag, groups) = head(index);
                if writer.binary {
                    writer.i32(tag as i32);
                } else {
                    writer.out.int(tag).int(number).int(2 + tag_count);
                }
                groups.into_iter().for_each(|tag| writer.i32(tag));
                if let Some(ids) = parts_of(index) {
                    writer.i32(ids.len() as i32);
                    ids.iter().for_each(|&id| writer.i32(id));
                }
                for node in nodes(index) {
                    if writer.binary {
                        writer.i32(node as i32)
                    } else {
                        writer.u64(node)
                    }
                }
                writer.end();
            }
            start += run;
        }
        first += block.len();
    }
}

/// Dimension and number of each entity that a group holds reversed, and the number of the group.
fn reversed(mesh: &Mesh) -> HashSet<(u8, i32, i32)> {
    let entities = mesh.geometry.entities.iter();
    let reversed = entities.flat_map(|entity| {
        let groups = entity.physicals.iter().filter(|&&tag| tag < 0);
        groups.map(|tag| (entity.dim, entity.tag, tag.wrapping_neg()))
    });
    reversed.collect()
}

/// The partitions of each cell that has some: those that own it, and with a minus sign those it is a ghost in.
fn partitions(mesh: &Mesh) -> HashMap<u32, Vec<i32>> {
    let mut of_cell: HashMap<u32, Vec<i32>> = HashMap::new();
    let parts = mesh
        .geometry
        .entities
        .iter()
        .filter(|entity| !entity.partitions.is_empty());
    let parts: HashMap<(u8, i32), &[i32]> = parts
        .map(|e| ((e.dim, e.tag), e.partitions.as_slice()))
        .collect();
    if !parts.is_empty() {
        let entities = mesh.blocks.iter().flat_map(|block| {
            (0..block.len()).map(|i| {
                (
                    block.kind.dim(),
                    block.entities.get(i).copied().unwrap_or(0),
                )
            })
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

/// `$Periodic`, which is text in binary files too.
fn periodic(out: &mut Out, mesh: &Mesh, point_tag: &impl Fn(u32) -> u64) {
    out.text("$Periodic\n")
        .int(mesh.geometry.periodic.len())
        .end();
    for link in &mesh.geometry.periodic {
        out.int(link.dim).int(link.entity).int(link.master).end();
        if !link.affine.is_empty() {
            out.text("Affine ");
            link.affine.iter().for_each(|&x| {
                out.float(x);
            });
            out.end();
        }
        out.int(link.pairs.len()).end();
        for pair in &link.pairs {
            out.int(point_tag(pair[0])).int(point_tag(pair[1])).end();
        }
    }
    out.text("$EndPeriodic\n");
}
