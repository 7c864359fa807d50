//! MSH 2.2: the version that most codes read.

use std::collections::HashMap;

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
    for (point, index) in mesh.points.iter().zip(0u32..) {
        let tag = point_tag(index);
        if writer.binary {
            writer.i32(tag as i32)
        } else {
            writer.u64(tag)
        }
        point.iter().for_each(|&x| writer.f64(x));
        writer.end();
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
    point_tag: &impl Fn(u32) -> u64,
    physical_of_set: &[i32],
) {
    let mesh = writer.mesh;
    let partitions = partitions(mesh);
    let mut cell = 0usize;
    let mut tags = Vec::new();
    for block in &mesh.blocks {
        let number = i32::from(block.kind.gmsh());
        let rows: Vec<&[u32]> = block.cells().collect();
        let mut start = 0;
        while start < rows.len() {
            // In binary a block of elements shares the number of tags.
            let same = |i: usize| {
                partitions
                    .get(&((cell + i) as u32))
                    .map_or(0, |ids| ids.len() + 1)
            };
            let tag_count = same(0);
            let run = if partitions.is_empty() {
                rows.len() - start
            } else {
                (0..rows.len() - start)
                    .take_while(|&i| same(i) == tag_count)
                    .count()
            };
            if writer.binary {
                [number, run as i32, 2 + tag_count as i32]
                    .into_iter()
                    .for_each(|value| writer.i32(value));
            }
            for nodes in rows.iter().skip(start).take(run) {
                let set = writer.groups.set_of.get(cell).copied().unwrap_or(0);
                tags.clear();
                tags.push(physical_of_set.get(set as usize).copied().unwrap_or(0));
                tags.push(writer.entity_of.get(cell).copied().unwrap_or(0));
                if let Some(ids) = partitions.get(&(cell as u32)) {
                    tags.push(ids.len() as i32);
                    tags.extend(ids);
                }
                let tag = cell_tags.get(cell).copied().unwrap_or(0);
                if writer.binary {
                    writer.i32(tag as i32);
                } else {
                    writer.out.int(tag).int(number).int(tags.len());
                }
                tags.iter().for_each(|&tag| writer.i32(tag));
                for &node in *nodes {
                    let tag = point_tag(node);
                    if writer.binary {
                        writer.i32(tag as i32)
                    } else {
                        writer.u64(tag)
                    }
                }
                writer.end();
                cell += 1;
            }
            start += run;
        }
    }
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
