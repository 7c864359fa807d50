//! MSH 4.1, which holds everything.

use std::collections::HashSet;

use super::write_entities_v4::{all_entities, entities};
use super::writer::Writer;
use crate::io::loss::Losses;
use crate::io::out::Out;
use crate::mesh::{Entity, Mesh, PointRun};

pub fn encode(mut writer: Writer<'_>, losses: &mut Losses) -> Out {
    let mesh = writer.mesh;
    let geometry = &mesh.geometry;
    writer.lose_groups(0, losses);
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
    let (low, high) = range(mesh.point_tags.iter().copied(), count);
    writer.out.text("$Nodes\n");
    writer.u64(runs.len() as u64).u64(count as u64);
    writer.u64(low).u64(high).end();
    let mut first = 0;
    for run in runs {
        let parametric = i32::from(run.parameters.is_some());
        writer.i32(run.dim.into()).i32(run.entity).i32(parametric);
        writer.u64(run.count as u64).end();
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
            writer.u64(mesh.point_tag(point as u32)).end();
        }
        for (i, point) in points.iter().enumerate() {
            writer.f64s(point);
            if let Some(parameters) = &run.parameters {
                writer.f64s(&parameters[i * extra..(i + 1) * extra]);
            }
            writer.end();
        }
        first += run.count;
    }
    writer.end_section("Nodes");
}

/// The lowest and the highest of `count` numbers, which are 1, 2, 3, … if the file has none.
fn range(own: impl Iterator<Item = u64>, count: usize) -> (u64, u64) {
    let wider = |range: Option<(u64, u64)>, tag: u64| {
        let (low, high) = range.unwrap_or((tag, tag));
        Some((low.min(tag), high.max(tag)))
    };
    own.fold(None, wider)
        .unwrap_or((u64::from(count > 0), count as u64))
}

fn elements(writer: &mut Writer<'_>) {
    let mesh = writer.mesh;
    let count = mesh.cell_count();
    let has_own = mesh.blocks.iter().any(|block| !block.tags.is_empty());
    let own = mesh.cell_tags().take(if has_own { count } else { 0 });
    let (low, high) = range(own, count);
    writer.out.text("$Elements\n");
    writer.u64(writer.runs.len() as u64).u64(count as u64);
    writer.u64(low).u64(high).end();
    let mut before = 0;
    let mut last_block = 0;
    for run in std::mem::take(&mut writer.runs) {
        let Some(block) = mesh.blocks.get(run.block) else {
            continue;
        };
        if run.block != last_block {
            (last_block, before) = (run.block, run.cells.start);
        }
        writer.i32(block.kind.dim().into()).i32(run.entity);
        writer.i32(block.kind.gmsh().into());
        writer.u64(run.cells.len() as u64).end();
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
                for &node in nodes {
                    writer.u64(mesh.point_tag(node));
                }
                writer.end();
            }
        }
    }
    writer.end_section("Elements");
}

fn periodic(writer: &mut Writer<'_>) {
    let mesh: &Mesh = writer.mesh;
    writer.out.text("$Periodic\n");
    writer.u64(mesh.geometry.periodic.len() as u64).end();
    for link in &mesh.geometry.periodic {
        writer.i32(link.dim.into()).i32(link.entity);
        writer.i32(link.master).end();
        writer.u64(link.affine.len() as u64);
        writer.f64s(&link.affine).end();
        writer.u64(link.pairs.len() as u64).end();
        for pair in &link.pairs {
            let [own, of_master] = pair.map(|point| mesh.point_tag(point));
            writer.u64(own).u64(of_master).end();
        }
    }
    writer.end_section("Periodic");
}

fn ghosts(writer: &mut Writer<'_>) {
    let cell_tags: Vec<u64> = writer.mesh.cell_tags().collect();
    let cells = &writer.mesh.geometry.partitions.cells;
    writer.out.text("$GhostElements\n");
    writer.u64(cells.len() as u64).end();
    for cell in cells {
        writer.u64(cell_tags.get(cell.cell as usize).copied().unwrap_or(0));
        writer.i32(cell.owners.first().copied().unwrap_or(0));
        writer.list(&cell.ghosts).end();
    }
    writer.end_section("GhostElements");
}
