//! Nodes and elements of MSH 1.0 and 2.x.

use super::builder::Builder;
use super::read::{Layout, Reader};
use crate::error::Result;
use crate::io::scan::{Numbers, Scan};
use crate::mesh::{CellKind, CellPartitions, PointRun};

/// `$NOD`, `$Nodes`: their number, then number and coordinates of each.
pub fn nodes(reader: &mut Reader<'_>) -> Result<()> {
    let Reader { scan, builder, .. } = reader;
    if builder.points.is_some() {
        return Err(scan.error("the nodes are there twice"));
    }
    let count = text_count(
        scan,
        "nodes",
        if scan.numbers == Numbers::Ascii {
            8
        } else {
            28
        },
    )?;
    let mut tags = Vec::with_capacity(count);
    builder.mesh.points.reserve_exact(count);
    for _ in 0..count {
        tags.push(tag(scan)?);
        let point = scan.xyz()?;
        builder.mesh.points.push(point);
    }
    builder.finish_points(scan, tags)
}

/// `$ParametricNodes`: nodes that also tell the entity they lie on and their coordinates on it.
pub fn parametric_nodes(reader: &mut Reader<'_>) -> Result<()> {
    let Reader { scan, builder, .. } = reader;
    if builder.points.is_some() {
        return Err(scan.error("the nodes are there twice"));
    }
    let count = text_count(
        scan,
        "nodes",
        if scan.numbers == Numbers::Ascii {
            12
        } else {
            36
        },
    )?;
    let mut tags = Vec::with_capacity(count);
    let mut runs: Vec<PointRun> = Vec::new();
    for _ in 0..count {
        tags.push(tag(scan)?);
        let point = scan.xyz()?;
        builder.mesh.points.push(point);
        let (dim, entity) = (scan.i32()?, scan.i32()?);
        let dim = u8::try_from(dim).ok().filter(|dim| *dim <= 3);
        let dim = dim.ok_or_else(|| scan.error("the dimension of an entity is 0 to 3"))?;
        if runs
            .last()
            .is_none_or(|run| (run.dim, run.entity) != (dim, entity))
        {
            runs.push(PointRun {
                dim,
                entity,
                count: 0,
                parameters: Some(Vec::new()),
            });
        }
        if let Some(PointRun {
            count,
            parameters: Some(parameters),
            ..
        }) = runs.last_mut()
        {
            *count += 1;
            // Gmsh gives the coordinates on curves and surfaces; points and volumes have none here.
            for _ in 0..if dim == 3 { 0 } else { dim } {
                parameters.push(scan.f64()?);
            }
        }
    }
    for run in runs.iter_mut().filter(|run| run.dim == 3) {
        run.parameters = None;
    }
    builder.mesh.geometry.point_runs = runs;
    builder.finish_points(scan, tags)
}

/// `$ELM`, `$Elements`: their number, then number, type, tags and nodes of each.
pub fn elements(reader: &mut Reader<'_>, layout: Layout) -> Result<()> {
    let Reader {
        scan,
        builder,
        content,
        ..
    } = reader;
    if builder.elements_seen {
        return Err(scan.error("the elements are there twice"));
    }
    if builder.points.is_none() {
        return Err(scan.error("the elements stand before the nodes"));
    }
    builder.elements_seen = true;
    let count = text_count(
        scan,
        "elements",
        if scan.numbers == Numbers::Ascii {
            8
        } else {
            12
        },
    )?;
    let mut tags = Tags::default();
    if scan.numbers == Numbers::Ascii {
        for _ in 0..count {
            let number = tag(scan)?;
            let kind = kind(scan)?;
            if layout == Layout::V1 {
                let physical = scan.i32()?;
                let entity = scan.i32()?;
                tags.values = vec![physical, entity];
                let nodes = scan.i32()?;
                if usize::try_from(nodes) != Ok(kind.points()) {
                    return Err(
                        scan.error(format!("element {number}, a {kind}, has {nodes} nodes"))
                    );
                }
            } else {
                let tag_count = scan.count("tags", 2)?;
                tags.read(scan, tag_count)?;
            }
            element(scan, builder, kind, number, &mut tags, layout)?;
        }
    } else {
        // Elements come in blocks that share type and number of tags.
        let mut left = count;
        while left > 0 {
            let kind = kind(scan)?;
            let (in_block, tag_count) = (scan.i32()?, scan.i32()?);
            let tag_count =
                scan.believe(u64::try_from(tag_count).unwrap_or(u64::MAX), "tags", 4)?;
            let size = 4 * (1 + tag_count + kind.points());
            let in_block = scan.believe(
                u64::try_from(in_block).unwrap_or(u64::MAX),
                "elements",
                size,
            )?;
            if in_block == 0 || in_block > left {
                return Err(scan.error(format!(
                    "a block has {in_block} elements where {left} are left"
                )));
            }
            left -= in_block;
            if tag_count <= 2 {
                plain_block(scan, builder, kind, in_block, tag_count, &mut tags)?;
                continue;
            }
            for _ in 0..in_block {
                let number = tag(scan)?;
                tags.read(scan, tag_count)?;
                element(scan, builder, kind, number, &mut tags, layout)?;
            }
        }
    }
    if tags.odd > 0 {
        content.unread.push(format!(
            "the third and later tags of {} elements, which do not tell partitions",
            tags.odd
        ));
    }
    if tags.negative > 0 {
        content.warnings.push(format!(
            "the numbers of the groups of {} elements are negative: the minus sign, which marks reversed elements, is not kept",
            tags.negative
        ));
    }
    builder.finish_cells(scan)
}

/// The tags of one element, and how many elements had tags that are not kept as they are.
#[derive(Default)]
struct Tags {
    values: Vec<i32>,
    /// Elements whose further tags say nothing known.
    odd: usize,
    /// Elements whose group has a minus sign.
    negative: usize,
}

impl Tags {
    #[inline]
    fn read(&mut self, scan: &mut Scan<'_>, count: usize) -> Result<()> {
        self.values.clear();
        for _ in 0..count {
            self.values.push(scan.i32()?);
        }
        Ok(())
    }

    /// The partitions among the tags: in 2.2 their number and they, a negative one being a ghost's.
    fn partitions(&mut self, cell: u32, layout: Layout) -> Option<CellPartitions> {
        let ids = match (layout, self.values.get(2..)?) {
            (_, []) => return None,
            (Layout::V22, [count, ids @ ..]) if usize::try_from(*count) == Ok(ids.len()) => ids,
            (Layout::V2, ids @ [_]) => ids,
            _ => {
                self.odd += 1;
                return None;
            }
        };
        let (owners, ghosts): (Vec<i32>, Vec<i32>) =
            ids.iter().filter(|id| **id != 0).partition(|id| **id > 0);
        let ghosts: Vec<i32> = ghosts.into_iter().map(i32::wrapping_neg).collect();
        (!owners.is_empty() || !ghosts.is_empty()).then_some(CellPartitions {
            cell,
            owners,
            ghosts,
        })
    }
}

#[inline]
fn element(
    scan: &mut Scan<'_>,
    builder: &mut Builder,
    kind: CellKind,
    number: u64,
    tags: &mut Tags,
    layout: Layout,
) -> Result<()> {
    let Some(points) = builder.points.take() else {
        return Err(scan.error("the elements stand before the nodes"));
    };
    let block = builder.block(kind);
    for _ in 0..kind.points() {
        let node = tag(scan)?;
        let Some(index) = points.get(node) else {
            return Err(scan.error(format!(
                "element {number} has the node {node}, which does not exist"
            )));
        };
        block.nodes.push(index);
    }
    block.tags.push(number);
    block
        .entities
        .push(tags.values.get(1).copied().unwrap_or(0));
    builder.points = Some(points);
    let cell = builder.cell_count();
    // A tag of zero means none. Gmsh marks reversed cells by a negative tag; the group is the same.
    match tags.values.first() {
        None | Some(0) => builder.appended(1, kind.dim(), &[]),
        Some(physical) => {
            tags.negative += usize::from(*physical < 0);
            builder.appended(1, kind.dim(), &[i64::from(*physical).abs()]);
        }
    }
    if tags.values.len() > 2
        && let Some(partitions) = tags.partitions(cell, layout)
    {
        let known = &mut builder.mesh.geometry.partitions;
        let highest = partitions
            .owners
            .iter()
            .chain(&partitions.ghosts)
            .max()
            .copied()
            .unwrap_or(0);
        known.count = known.count.max(u64::try_from(highest).unwrap_or(0));
        known.cells.push(partitions);
    }
    Ok(())
}

/// [`element`] for a binary block of elements with no more tags than group and entity, which is what large files have.
fn plain_block(
    scan: &mut Scan<'_>,
    builder: &mut Builder,
    kind: CellKind,
    count: usize,
    tag_count: usize,
    tags: &mut Tags,
) -> Result<()> {
    let Some(points) = builder.points.take() else {
        return Err(scan.error("the elements stand before the nodes"));
    };
    let block = builder.block(kind);
    block.nodes.reserve(count * kind.points());
    block.tags.reserve(count);
    block.entities.reserve(count);
    let little = scan.numbers == Numbers::Little;
    let int = |word: [u8; 4]| {
        if little {
            i32::from_le_bytes(word)
        } else {
            i32::from_be_bytes(word)
        }
    };
    // Runs of elements in the same group.
    let mut runs: Vec<(i32, u32)> = Vec::new();
    let row = 1 + tag_count + kind.points();
    let mut left = count;
    while left > 0 {
        // In pieces, so that an error is not far from its place.
        let rows = left.min(256);
        left -= rows;
        let here = scan.clone();
        let (words, _) = scan.bytes(rows, 4 * row)?.as_chunks::<4>();
        for words in words.chunks_exact(row) {
            let (head, nodes) = words.split_at(1 + tag_count);
            let [number, head @ ..] = head else { continue };
            let number = number_of(&here, int(*number))?;
            for &node in nodes {
                let node = number_of(&here, int(node))?;
                block.nodes.push(points.get(node).ok_or_else(|| {
                    here.error(format!(
                        "element {number} has the node {node}, which does not exist"
                    ))
                })?);
            }
            block.tags.push(number);
            block
                .entities
                .push(head.get(1).map_or(0, |&word| int(word)));
            let physical = head.first().map_or(0, |&word| int(word));
            tags.negative += usize::from(physical < 0);
            match runs.last_mut() {
                Some((last, count)) if *last == physical => *count += 1,
                _ => runs.push((physical, 1)),
            }
        }
    }
    builder.points = Some(points);
    for (physical, count) in runs {
        let group = [i64::from(physical).abs()];
        builder.appended(count, kind.dim(), &group[usize::from(physical == 0)..]);
    }
    Ok(())
}

fn number_of(scan: &Scan<'_>, value: i32) -> Result<u64> {
    u64::try_from(value)
        .map_err(|_| scan.error(format!("{value} is no number of a node or element")))
}

/// The number of a node or element, which is at least 1... in ASCII of up to 64 bits.
#[inline]
fn tag(scan: &mut Scan<'_>) -> Result<u64> {
    if scan.numbers == Numbers::Ascii {
        return scan.u64();
    }
    let value = scan.i32()?;
    number_of(scan, value)
}

#[inline]
fn kind(scan: &mut Scan<'_>) -> Result<CellKind> {
    let number = scan.i32()?;
    CellKind::from_gmsh(number).ok_or_else(|| unknown_type(scan, number))
}

#[cold]
pub fn unknown_type(scan: &Scan<'_>, number: i32) -> crate::error::Error {
    let what = match number {
        34 | 35 => "polygons and polyhedra without a fixed number of nodes are not read".into(),
        _ => format!("{number} is no known type of element"),
    };
    scan.error_with(what, "save the mesh with standard element types")
}

/// A count that is text even in binary files; the rest of its line is passed.
fn text_count(scan: &mut Scan<'_>, of: &str, bytes: usize) -> Result<usize> {
    let numbers = std::mem::replace(&mut scan.numbers, Numbers::Ascii);
    let declared = scan.u64()?;
    if numbers != Numbers::Ascii {
        scan.line();
    }
    scan.numbers = numbers;
    scan.believe(declared, of, bytes)
}
