//! Polygonal data, `.vtp`: what is a surface, with lines and vertices on it.

use super::layout::Topology;
use super::merge::select;
use super::write::save;
use crate::error::Result;
use crate::io::Job;
use crate::io::loss::Losses;
use crate::mesh::{CellBlock, Field, Group, Mesh, Support};
use std::borrow::Cow;
use std::ops::Range;

/// Writes a mesh of vertices, lines and polygons; its cells are in this order there.
pub(super) fn write(job: Job<'_>) -> Result<Vec<String>> {
    let (path, mut losses) = (job.path, job.losses);
    let mesh = by_dimension(job.mesh, &mut losses);
    let encoding = job.options.vtu;
    losses.settle(path, || {
        save(path, &mesh, &[], job.whole, encoding, Topology::Sections)
    })
}

/// The mesh with its cells in the order of their dimensions.
fn by_dimension<'m>(mesh: &'m Mesh, losses: &mut Losses) -> Cow<'m, Mesh> {
    if mesh.blocks.is_sorted_by_key(|block| block.kind.dim()) {
        return Cow::Borrowed(mesh);
    }
    losses.note("the cells stand in the order of their dimensions");
    let mut blocks: Vec<(Range<u32>, &CellBlock)> = mesh.ranges().collect();
    blocks.sort_by_key(|(_, block)| block.kind.dim());
    // The old number of each cell, and the new one.
    let old = blocks.iter().flat_map(|(cells, _)| cells.clone());
    let old: Vec<usize> = old.map(|cell| cell as usize).collect();
    let mut new = vec![0u32; old.len()];
    for (place, &cell) in old.iter().enumerate() {
        new[cell] = place as u32;
    }
    let renumbered = |cells: &[u32]| -> (Vec<u32>, Vec<usize>) {
        let mut order: Vec<usize> = (0..cells.len()).collect();
        order.sort_by_key(|&place| new[cells[place] as usize]);
        (
            order
                .iter()
                .map(|&place| new[cells[place] as usize])
                .collect(),
            order,
        )
    };
    let group = |group: &Group| Group {
        cells: renumbered(&group.cells).0,
        ..group.clone()
    };
    let mut fields = Vec::new();
    for field in &mesh.fields {
        let (at, order) = match field.at.is_empty() {
            true => (Vec::new(), old.clone()),
            false => renumbered(&field.at),
        };
        match field.on {
            Support::Points => fields.push(field.clone()),
            Support::Cells => fields.push(Field {
                values: select(&field.values, field.components, order.into_iter()),
                at,
                ..field.clone()
            }),
            Support::CellPoints => {
                losses.lose(format!("the field {:?} on cell points", field.name))
            }
        }
    }
    let mut geometry = mesh.geometry.clone();
    for cell in &mut geometry.partitions.cells {
        cell.cell = new[cell.cell as usize];
    }
    geometry.partitions.cells.sort_by_key(|cell| cell.cell);
    Cow::Owned(Mesh {
        points: mesh.points.clone(),
        point_tags: mesh.point_tags.clone(),
        blocks: blocks.into_iter().map(|(_, block)| block.clone()).collect(),
        polyhedra: mesh.polyhedra.clone(),
        groups: mesh.groups.iter().map(group).collect(),
        fields,
        geometry,
    })
}
