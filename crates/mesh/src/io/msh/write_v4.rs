//! MSH 4.1, which holds everything.

use std::collections::HashSet;

use super::write::Writer;
use super::write_entities_v4::{all_entities, entities, list};
use crate::io::loss::Losses;
use crate::io::out::Out;
use crate::mesh::{CellBlock, Entity, Mesh, PointRun};

pub fn encode(mut writer: Writer<'_>, losses: &mut Losses) -> Out {
    let mesh = writer.mesh;
    let geometry = &mesh.geometry;
    for group in mesh
        .groups
        .iter()
        .filter(|group| i32::try_from(group.tag).is_err() || group.tag < 0)
    {
        losses.lose(format!(
            "group {} of dimension {}, whose number is not 0 to 2^31 - 1",
            group.tag, group.dim
        ));
    }
    if writer.split > 0 {
        losses.note(format!(
            "{} entities with cells of different groups were split",
            writer.split
        ));
    }
    let (parts, wholes): (Vec<Entity>, Vec<Entity>) = all_entities(&writer)
        .into_iter()
        .partition(|entity| entity.parent.is_some());
    let partitioned = !parts.is_empty() || !geometry.partitions.ghost_entities.is_empty();
    if !partitioned && !geometry.partitions.cells.is_empty() {
        losses.note("the partitions of cells are not written, as 4.1 assigns them to entities and these have none");
    }

    writer.header("4.1");
    let on_entities: HashSet<(u8, i64)> = wholes
        .iter()
        .chain(&parts)
        .flat_map(|entity| {
            entity
                .physicals
                .iter()
                .map(|&tag| (entity.dim, i64::from(tag).abs()))
        })
        .collect();
    writer.names(|dim, tag| on_entities.contains(&(dim, tag)), losses);
    entities(&mut writer, "Entities", &wholes);
    if partitioned {
        entities(&mut writer, "PartitionedEntities", &parts);
    }
    nodes(&mut writer, &wholes);
    elements(&mut writer);
    if !geometry.periodic.is_empty() {
        periodic(&mut writer);
    }
    if partitioned {
        ghosts(&mut writer);
    }
    writer.fields(|point| mesh.point_tag(point), true, losses);
    writer.out
}

fn nodes(writer: &mut Writer<'_>, wholes: &[Entity]) {
    let mesh = writer.mesh;
    let count = mesh.points.len();
    let one_run: [PointRun; 1];
    let runs = if mesh.geometry.point_runs.is_empty() && count > 0 {
        // Without further knowledge, all points lie on an entity of the highest dimension.
        let top = wholes
            .iter()
            .max_by_key(|entity| entity.dim)
            .map_or((0, 1), |entity| (entity.dim, entity.tag));
        one_run = [PointRun {
            dim: top.0,
            entity: top.1,
            count,
            parameters: None,
        }];
        &one_run[..]
    } else {
        &mesh.geometry.point_runs
    };
    let (low, high) = range(&mesh.point_tags, count);
    writer.out.text("$Nodes\n");
    [runs.len() as u64, count as u64, low, high]
        .into_iter()
        .for_each(|value| writer.u64(value));
    writer.end();
    let mut first = 0;
    for run in runs {
        writer.i32(i32::from(run.dim));
        writer.i32(run.entity);
        writer.i32(i32::from(run.parameters.is_some()));
        writer.u64(run.count as u64);
        writer.end();
        let extra = usize::from(run.dim);
        let points = mesh.points.get(first..first + run.count);
        let points = points.unwrap_or_default();
        if writer.binary && run.parameters.is_none() {
            writer.out.rows(run.count, 8, |row, rows| {
                let places = rows.as_chunks_mut::<8>().0.iter_mut();
                for (place, point) in places.zip((first + row) as u32..) {
                    *place = mesh.point_tag(point).to_le_bytes();
                }
            });
            writer.binary_points(points);
            first += run.count;
            continue;
        }
        for point in first..first + run.count {
            writer.u64(mesh.point_tag(point as u32));
            writer.end();
        }
        for (i, point) in points.iter().enumerate() {
            point.iter().for_each(|&x| writer.f64(x));
            if let Some(parameters) = &run.parameters {
                let parameters = parameters.iter().skip(i * extra).take(extra);
                parameters.for_each(|&x| writer.f64(x));
            }
            writer.end();
        }
        first += run.count;
    }
    writer.end_section("Nodes");
}

fn range(tags: &[u64], count: usize) -> (u64, u64) {
    match (tags.iter().min(), tags.iter().max()) {
        (Some(&low), Some(&high)) => (low, high),
        _ => (u64::from(count > 0), count as u64),
    }
}

/// The lowest and the highest number of a cell; 0 where there are none.
fn range_of_cells(mesh: &Mesh) -> (u64, u64) {
    let mut before = 0;
    let mut range: Option<(u64, u64)> = None;
    for block in mesh.blocks.iter().filter(|block| !block.is_empty()) {
        let (mut low, mut high) = range_of_block(block, before);
        if let Some(so_far) = range {
            (low, high) = (low.min(so_far.0), high.max(so_far.1));
        }
        range = Some((low, high));
        before += block.len() as u64;
    }
    range.unwrap_or((0, 0))
}

/// [`range_of_cells`] of one block; `before` cells precede it.
fn range_of_block(block: &CellBlock, before: u64) -> (u64, u64) {
    match (block.tags.iter().min(), block.tags.iter().max()) {
        (Some(&low), Some(&high)) => (low, high),
        _ => (before + 1, before + block.len() as u64),
    }
}

fn elements(writer: &mut Writer<'_>) {
    let mesh = writer.mesh;
    let (low, high) = range_of_cells(mesh);
    writer.out.text("$Elements\n");
    [
        writer.runs.len() as u64,
        mesh.cell_count() as u64,
        low,
        high,
    ]
    .into_iter()
    .for_each(|value| writer.u64(value));
    writer.end();
    let mut before = 0;
    let mut last_block = 0;
    for run in std::mem::take(&mut writer.runs) {
        let Some(block) = mesh.blocks.get(run.block) else {
            continue;
        };
        if run.block != last_block {
            (last_block, before) = (run.block, run.cells.start);
        }
        writer.i32(i32::from(block.kind.dim()));
        writer.i32(run.entity);
        writer.i32(i32::from(block.kind.gmsh()));
        writer.u64(run.cells.len() as u64);
        writer.end();
        let width = block.kind.points();
        // The elements from the place of one in the run on: number and nodes of each.
        let from = |place: usize| {
            let cells = run.cells.start + place..run.cells.end;
            let nodes = block.nodes.get(width * (cells.start - before)..);
            let nodes = nodes.unwrap_or_default().chunks_exact(width);
            cells.zip(nodes).map(|(cell, nodes)| {
                let own = block.tags.get(cell - before).copied();
                (own.unwrap_or(cell as u64 + 1), nodes)
            })
        };
        if writer.binary {
            writer
                .out
                .rows(run.cells.len(), 8 * (1 + width), |first, rows| {
                    let rows = rows.as_chunks_mut::<8>().0.chunks_exact_mut(1 + width);
                    for (row, (number, nodes)) in rows.zip(from(first)) {
                        let words = nodes.iter().map(|&node| mesh.point_tag(node));
                        let words = std::iter::once(number).chain(words);
                        for (place, word) in row.iter_mut().zip(words) {
                            *place = word.to_le_bytes();
                        }
                    }
                });
        } else {
            for (number, nodes) in from(0) {
                writer.u64(number);
                nodes
                    .iter()
                    .for_each(|&node| writer.u64(mesh.point_tag(node)));
                writer.end();
            }
        }
    }
    writer.end_section("Elements");
}

fn periodic(writer: &mut Writer<'_>) {
    let mesh: &Mesh = writer.mesh;
    writer.out.text("$Periodic\n");
    writer.u64(mesh.geometry.periodic.len() as u64);
    writer.end();
    for link in &mesh.geometry.periodic {
        writer.i32(i32::from(link.dim));
        writer.i32(link.entity);
        writer.i32(link.master);
        writer.end();
        writer.u64(link.affine.len() as u64);
        link.affine.iter().for_each(|&x| writer.f64(x));
        writer.end();
        writer.u64(link.pairs.len() as u64);
        writer.end();
        for pair in &link.pairs {
            pair.iter()
                .for_each(|&point| writer.u64(mesh.point_tag(point)));
            writer.end();
        }
    }
    writer.end_section("Periodic");
}

fn ghosts(writer: &mut Writer<'_>) {
    let cell_tags: Vec<u64> = writer.mesh.cell_tags().collect();
    let cells = &writer.mesh.geometry.partitions.cells;
    writer.out.text("$GhostElements\n");
    writer.u64(cells.len() as u64);
    writer.end();
    for cell in cells {
        writer.u64(cell_tags.get(cell.cell as usize).copied().unwrap_or(0));
        writer.i32(cell.owners.first().copied().unwrap_or(0));
        list(writer, &cell.ghosts);
        writer.end();
    }
    writer.end_section("GhostElements");
}
