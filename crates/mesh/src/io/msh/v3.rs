//! MSH 3.0 as text, which Gmsh wrote before 4.0: nodes with the entity they lie on, elements with the number of their nodes.

use super::elements_v2::unknown_type;
use super::layout::Reader;
use super::nodes_v2::text_count;
use crate::error::Result;
use crate::field::Tell;
use crate::io::builder::{Numbering, no_such_node};
use crate::mesh::{CellKind, Entity};

/// Elements that are parts of others, cut along a surface: Gmsh's number of the type and what it is.
const PARTS: [(i32, CellKind); 4] = [
    (133, CellKind::Vertex),
    (134, CellKind::Line),
    (135, CellKind::Triangle),
    (136, CellKind::Tetrahedron),
];

/// `$Entities`: of each its number, what bounds it unless it is a point, and its groups.
pub fn entities(reader: &mut Reader<'_>) -> Result<()> {
    let Reader { scan, builder, .. } = reader;
    let counts = [scan.u64()?, scan.u64()?, scan.u64()?, scan.u64()?];
    for (dim, declared) in (0u8..).zip(counts) {
        for _ in 0..scan.believe(declared, "entities", 4)? {
            let mut entity = Entity::without_points(dim, scan.i32()?);
            let mut list = |of: &str| -> Result<Vec<i32>> {
                let count = scan.count(of, 2)?;
                (0..count).map(|_| scan.i32()).collect()
            };
            if dim > 0 {
                entity.boundary = list("bounding entities")?;
            }
            entity.physicals = list("groups")?;
            entity.physicals.retain(|&group| group != 0);
            builder.mesh.geometry.entities.push(entity);
        }
    }
    Ok(())
}

/// `$Nodes`: number, coordinates, and the dimension of an entity: if not 0, its number and the coordinates on it follow.
pub fn nodes(reader: &mut Reader<'_>) -> Result<()> {
    let (scan, builder, content) = reader.parts();
    let count = text_count(scan, "nodes", 10)?;
    let mut tags = Numbering::default();
    let mut lying = 0;
    for _ in 0..count {
        tags.push(scan.u64()?);
        let point = scan.xyz()?;
        builder.mesh.points.to_mut().push(point);
        let more = scan.line();
        lying += usize::from(more.trim_ascii() != b"0");
    }
    if lying > 0 {
        content.unread.tell(
            "entities of nodes",
            format!("the entities that {lying} nodes lie on"),
        );
    }
    builder.finish_points(scan, tags)
}

/// `$Elements`: number, type, entity, how many nodes, nodes; a part has what it is a part of at its end.
pub fn elements(reader: &mut Reader<'_>) -> Result<()> {
    let physicals = reader.physicals();
    let (scan, builder, content) = reader.parts();
    let Some(points) = builder.points.take() else {
        return Err(scan.error("the elements come before the nodes"));
    };
    let count = text_count(scan, "elements", 8)?;
    let (mut parts, mut memberships) = (0, 0);
    for _ in 0..count {
        let (number, code, entity) = (scan.u64()?, scan.i32()?, scan.i32()?);
        let part = PARTS
            .iter()
            .find(|(known, _)| *known == code)
            .map(|(_, kind)| *kind);
        let kind = part.or_else(|| CellKind::from_gmsh(code));
        let kind = kind.ok_or_else(|| unknown_type(scan, code))?;
        let mut left = scan.u64()?;
        if left < kind.points() as u64 {
            return Err(scan.error(format!("element {number}, a {kind}, has {left} nodes")));
        }
        let block = builder.block(kind);
        let nodes = block.nodes.to_mut();
        for _ in 0..kind.points() {
            let node = scan.u64()?;
            let point = points.get(node);
            nodes.push(point.ok_or_else(|| no_such_node(scan, number, node))?);
        }
        block.entities.push(entity);
        left -= kind.points() as u64;
        parts += usize::from(left > 0);
        for _ in 0..left {
            scan.u64()?;
        }
        builder.numbers.push(number);
        let groups = physicals
            .get(&(kind.dim(), entity))
            .map_or(&[][..], Vec::as_slice);
        memberships += groups.len();
        if memberships > 2 * scan.len() {
            return Err(scan.error(
                "the elements are in more groups than is plausible for a file of this size",
            ));
        }
        builder.appended(1, kind.dim(), groups);
    }
    if parts > 0 {
        content.unread.tell(
            "parts of elements",
            format!("which elements {parts} others are parts of"),
        );
    }
    builder.points = Some(points);
    builder.finish_cells(scan)
}
