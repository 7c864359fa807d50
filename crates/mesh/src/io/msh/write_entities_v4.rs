//! `$Entities` and `$PartitionedEntities` of MSH 4.1: the entities of cells, and their groups.

use std::collections::{HashMap, HashSet};

use crate::parallel;

use super::write::Writer;
use crate::mesh::Entity;

/// The entities of the file that was read and further ones that cells need, with the present groups.
pub fn all_entities(writer: &Writer<'_>) -> Vec<Entity> {
    let mesh = writer.mesh;
    let mut entities = mesh.geometry.entities.clone();
    let index: HashMap<(u8, i32), usize> = entities
        .iter()
        .enumerate()
        .map(|(i, e)| ((e.dim, e.tag), i))
        .collect();
    let ghosts: HashSet<i32> = mesh
        .geometry
        .partitions
        .ghost_entities
        .iter()
        .map(|ghost| ghost[0])
        .collect();
    let mut boxes = HashMap::new();
    for &(dim, tag, set) in &writer.entities {
        let set = writer
            .groups
            .sets
            .get(set as usize)
            .map_or(&[][..], Vec::as_slice);
        let groups = set
            .iter()
            .filter_map(|&group| mesh.groups.get(group as usize));
        let tags = groups.filter_map(|group| i32::try_from(group.tag).ok().filter(|tag| *tag >= 0));
        match index.get(&(dim, tag)).and_then(|&i| entities.get_mut(i)) {
            Some(entity) => {
                let old = std::mem::take(&mut entity.physicals);
                let mut new: Vec<i32> = tags.collect();
                // Signs and order are kept if the groups are still the same.
                let mut before: Vec<i32> = old.iter().map(|tag| tag.wrapping_abs()).collect();
                before.sort_unstable();
                before.dedup();
                let same = before == new;
                for tag in &mut new {
                    if old.contains(&tag.wrapping_neg()) && !old.contains(tag) {
                        *tag = tag.wrapping_neg();
                    }
                }
                entity.physicals = if same { old } else { new };
            }
            // Cells on ghost entities are in no group, and the ghost entity is declared elsewhere.
            None if ghosts.contains(&tag) => {}
            None => {
                boxes.insert((dim, tag), entities.len());
                entities.push(Entity {
                    physicals: tags.collect(),
                    ..Entity::without_points(dim, tag)
                });
            }
        }
    }
    bound(writer, &boxes, &mut entities);
    entities
}

/// Bounding boxes of entities that had none.
fn bound(writer: &Writer<'_>, boxes: &HashMap<(u8, i32), usize>, entities: &mut [Entity]) {
    if boxes.is_empty() {
        return;
    }
    let mut first = 0;
    let mut last_block = 0;
    let mesh = writer.mesh;
    for run in &writer.runs {
        if run.block != last_block {
            (first, last_block) = (run.cells.start, run.block);
        }
        let Some(block) = mesh.blocks.get(run.block) else {
            continue;
        };
        let place = boxes.get(&(block.kind.dim(), run.entity));
        let Some(entity) = place.and_then(|&place| entities.get_mut(place)) else {
            continue;
        };
        let width = block.kind.points();
        let nodes = width * (run.cells.start - first)..width * (run.cells.end - first);
        let nodes = block.nodes.get(nodes).unwrap_or_default();
        let points = |nodes: &[u32]| {
            let mut part = Entity::without_points(0, 0);
            let points = nodes
                .iter()
                .filter_map(|&node| mesh.points.get(node as usize));
            points.for_each(|point| part.extend(point));
            part
        };
        let parts = parallel::map(nodes.chunks(1 << 16), points);
        let corners = parts.iter().flat_map(|part| &part.bounds);
        corners.for_each(|corner| entity.extend(corner));
    }
}

pub fn entities(writer: &mut Writer<'_>, section: &str, entities: &[Entity]) {
    writer.out.text(&format!("${section}\n"));
    if section == "PartitionedEntities" {
        let partitions = &writer.mesh.geometry.partitions;
        let ghosts = &partitions.ghost_entities;
        writer.u64(partitions.count).end();
        writer.u64(ghosts.len() as u64).end();
        for &[tag, partition] in ghosts {
            writer.i32(tag).i32(partition).end();
        }
    }
    for dim in 0..4 {
        writer.u64(entities.iter().filter(|entity| entity.dim == dim).count() as u64);
    }
    writer.end();
    for dim in 0..4u8 {
        for entity in entities.iter().filter(|entity| entity.dim == dim) {
            writer.i32(entity.tag);
            if let Some((parent_dim, parent)) = entity.parent {
                writer.i32(parent_dim).i32(parent).list(&entity.partitions);
            }
            let corners = if dim == 0 { 1 } else { 2 };
            writer.f64s(entity.bounds[..corners].as_flattened());
            writer.list(&entity.physicals);
            if dim > 0 {
                writer.list(&entity.boundary);
            }
            writer.end();
        }
    }
    writer.end_section(section);
}
