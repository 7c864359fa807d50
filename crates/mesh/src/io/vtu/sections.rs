//! The sections of polygonal data: vertices, lines, polygons.

use crate::mesh::{CellKind, Mesh, Values};

/// The dimension of cells that polygonal data have; `None` for those that they have not.
pub(super) fn section(kind: CellKind) -> Option<usize> {
    match kind {
        CellKind::Vertex => Some(0),
        CellKind::Line => Some(1),
        CellKind::Triangle | CellKind::Quadrangle | CellKind::Polygon(_) => Some(2),
        _ => None,
    }
}

/// The nodes of the cells of a section, and where those of each cell end, of the same width, as VTK wants them.
pub(super) fn nodes_and_ends(mesh: &Mesh, of: usize) -> [Values; 2] {
    let blocks = mesh
        .blocks
        .iter()
        .filter(|block| section(block.kind) == Some(of));
    let (mut nodes, mut ends) = (Vec::new(), Vec::new());
    for block in blocks {
        let (width, first) = (block.kind.points(), nodes.len());
        nodes.extend_from_slice(&block.nodes);
        ends.extend((1..=block.len()).map(|cell| first + cell * width));
    }
    if nodes.len().max(mesh.points.len()) <= i32::MAX as usize {
        let nodes = nodes.into_iter().map(|node| node as i32);
        let ends = ends.into_iter().map(|end| end as i32);
        return [nodes.collect(), ends.collect()].map(Values::I32);
    }
    let nodes = nodes.into_iter().map(i64::from);
    let ends = ends.into_iter().map(|end| end as i64);
    [nodes.collect(), ends.collect()].map(Values::I64)
}

/// Sections that polygonal data lack.
pub(super) fn check(mesh: &Mesh) -> Result<(), String> {
    let blocks = mesh.blocks.iter().filter(|block| !block.is_empty());
    match blocks
        .map(|block| block.kind)
        .find(|&kind| section(kind).is_none())
    {
        None => Ok(()),
        Some(kind) => Err(format!("polygonal data have no cells that are {kind}")),
    }
}
