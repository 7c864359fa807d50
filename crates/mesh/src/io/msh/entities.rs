//! The geometry in MSH files: entities, their parts, periodic links, ghost cells.

use std::collections::HashMap;

use super::layout::{Layout, Reader};
use super::v4::tag;
use crate::error::Result;
use crate::io::scan::{Numbers, Scan};
use crate::mesh::{CellPartitions, Entity, Periodic};

impl Reader<'_> {
    /// The groups of each entity, by dimension and number.
    pub fn physicals(&mut self) -> HashMap<(u8, i32), Vec<i64>> {
        let mut physicals: HashMap<(u8, i32), Vec<i64>> = HashMap::new();
        for entity in &self.builder.mesh.geometry.entities {
            let groups = physicals.entry((entity.dim, entity.tag)).or_default();
            groups.extend(entity.physicals.iter().map(|&tag| i64::from(tag).abs()));
            groups.sort_unstable();
            groups.dedup();
        }
        // A group exists even if its entities have no cells.
        for (&(dim, _), groups) in &physicals {
            for &tag in groups {
                self.builder.group(dim, tag);
            }
        }
        physicals
    }
}

/// `$PartitionedEntities`: the parts of entities, and those that hold only ghost cells.
pub fn partitioned_entities(reader: &mut Reader<'_>, layout: Layout) -> Result<()> {
    let Reader { scan, builder, .. } = reader;
    let partitions = &mut builder.mesh.geometry.partitions;
    partitions.count = scan.u64()?;
    let ghosts = scan.count("ghost entities", 4)?;
    for _ in 0..ghosts {
        partitions.ghost_entities.push([scan.i32()?, scan.i32()?]);
    }
    entities(reader, layout, true)
}

/// `$Entities`: points, curves, surfaces and volumes; or their `parts`.
pub fn entities(reader: &mut Reader<'_>, layout: Layout, parts: bool) -> Result<()> {
    let Reader { scan, builder, .. } = reader;
    let entities = &mut builder.mesh.geometry.entities;
    let counts = [scan.u64()?, scan.u64()?, scan.u64()?, scan.u64()?];
    for (dim, declared) in (0u8..).zip(counts) {
        let count = scan.believe(declared, "entities", 10)?;
        for _ in 0..count {
            let mut entity = Entity {
                dim,
                tag: scan.i32()?,
                ..Entity::default()
            };
            if parts {
                entity.parent = Some((scan.i32()?, scan.i32()?));
                entity.partitions = list(scan, "partitions")?;
            }
            let low = bound(scan)?;
            // A point has a position; only 4.0 writes it as a box.
            let high = if dim == 0 && layout == Layout::V41 {
                low
            } else {
                bound(scan)?
            };
            entity.bounds = [low, high];
            entity.physicals = list(scan, "physical tags")?;
            if dim > 0 {
                entity.boundary = list(scan, "bounding entities")?;
            }
            entities.push(entity);
        }
    }
    Ok(())
}

/// A corner of a bounding box. Gmsh writes infinity for entities without a box; nothing depends on it.
fn bound(scan: &mut Scan<'_>) -> Result<[f64; 3]> {
    let finite = |x: f64| if x.is_finite() { x } else { 0.0 };
    Ok([
        finite(scan.any_f64()?),
        finite(scan.any_f64()?),
        finite(scan.any_f64()?),
    ])
}

fn list(scan: &mut Scan<'_>, of: &str) -> Result<Vec<i32>> {
    let count = scan.count(of, scan.least(2, 4))?;
    (0..count).map(|_| scan.i32()).collect()
}

/// `$Periodic`: for each link the two entities, a transformation, and pairs of nodes.
pub fn periodic(reader: &mut Reader<'_>, layout: Layout) -> Result<()> {
    let Reader { scan, builder, .. } = reader;
    let Some(points) = &builder.points else {
        return Err(scan.error("the periodic links come before the nodes"));
    };
    let numbers = scan.numbers;
    // In 2.x this section is text in binary files too.
    if layout < Layout::V40 {
        scan.numbers = Numbers::Ascii;
    }
    let links = scan.count("periodic links", 6)?;
    for _ in 0..links {
        let dim = scan.i32()?;
        let dim = u8::try_from(dim).map_err(|_| scan.error(format!("{dim} is not a dimension")))?;
        let mut link = Periodic {
            dim,
            entity: scan.i32()?,
            master: scan.i32()?,
            ..Periodic::default()
        };
        link.affine = affine(scan, layout)?;
        let pairs = scan.count("periodic pairs", 4)?;
        for _ in 0..pairs {
            let mut pair = [0; 2];
            for place in &mut pair {
                let node = tag(scan, layout)?;
                let index = points.get(node);
                *place =
                    index.ok_or_else(|| scan.error(format!("the node {node} does not exist")))?;
            }
            link.pairs.push(pair);
        }
        builder.mesh.geometry.periodic.push(link);
    }
    scan.numbers = numbers;
    Ok(())
}

/// The transformation of a link: counted in 4.1, after a word in older text, after a negative number in 4.0 binary.
fn affine(scan: &mut Scan<'_>, layout: Layout) -> Result<Vec<f64>> {
    let count =
        if layout == Layout::V41 {
            scan.count("numbers of a transformation", scan.least(2, 8))?
        } else if scan.numbers == Numbers::Ascii {
            if !scan
                .peek()
                .is_some_and(|word| word.eq_ignore_ascii_case(b"affine"))
            {
                return Ok(Vec::new());
            }
            scan.word();
            let line = scan.line();
            let mut numbers = Scan::new(scan.path, line);
            let mut affine = Vec::new();
            while numbers.peek().is_some() {
                affine.push(numbers.f64().map_err(|_| {
                    scan.error("a transformation has something that is not a number")
                })?);
            }
            return Ok(affine);
        } else {
            let peeked = scan.clone().u64()? as i64;
            if peeked >= 0 {
                return Ok(Vec::new());
            }
            scan.u64()?;
            scan.believe(peeked.unsigned_abs(), "numbers of a transformation", 8)?
        };
    (0..count).map(|_| scan.f64()).collect()
}

/// `$GhostElements`: for each cell its owner and the partitions that know it as a ghost.
pub fn ghosts(reader: &mut Reader<'_>, layout: Layout) -> Result<()> {
    let Reader { scan, builder, .. } = reader;
    let count = scan.count("ghost elements", 6)?;
    for _ in 0..count {
        let element = tag(scan, layout)?;
        let cell = builder.index_cells().by_tag.get(element);
        let cell =
            cell.ok_or_else(|| scan.error(format!("the element {element} does not exist")))?;
        let owners = vec![scan.i32()?];
        let ghosts = list(scan, "partitions")?;
        builder.mesh.geometry.partitions.cells.push(CellPartitions {
            cell,
            owners,
            ghosts,
        });
    }
    Ok(())
}
