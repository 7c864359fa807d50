//! Nodes and elements of MSH 1.0 and 2.x.

use std::collections::HashMap;

use rayon::prelude::*;

use super::builder::{Builder, EntityGroup};
use super::bulk;
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
    if scan.numbers != Numbers::Ascii {
        let tags = binary_nodes(scan, builder, count)?;
        return builder.finish_points(scan, tags);
    }
    let mut tags = Vec::with_capacity(count);
    builder.mesh.points.reserve_exact(count);
    for _ in 0..count {
        tags.push(tag(scan)?);
        let point = scan.xyz()?;
        builder.mesh.points.push(point);
    }
    builder.finish_points(scan, tags)
}

/// [`nodes`] of a binary file, all at once; their numbers.
fn binary_nodes(scan: &mut Scan<'_>, builder: &mut Builder, count: usize) -> Result<Vec<u64>> {
    let numbers = scan.numbers;
    let start = scan.clone();
    let (rows, _) = scan.bytes(count, 28)?.as_chunks::<28>();
    let parts = |row: &[u8; 28]| {
        let (number, rest) = row.split_first_chunk::<4>()?;
        let words = rest.as_chunks::<8>().0.first_chunk::<3>()?;
        Some((*number, *words))
    };
    let tags: Vec<i32> = (rows.par_iter().with_min_len(1024))
        .map(|row| parts(row).map_or(0, |(number, _)| bulk::signed(number, numbers)))
        .collect();
    let points: Vec<[f64; 3]> = (rows.par_iter().with_min_len(1024))
        .map(|row| parts(row).map_or([0.0; 3], |(_, words)| bulk::coordinates(words, numbers)))
        .collect();
    let is_bad = |(&tag, point): (&i32, &[f64; 3])| tag < 0 || !point.iter().all(|x| x.is_finite());
    if let Some(bad) = tags.iter().zip(&points).position(is_bad) {
        let mut place = start;
        place.advance(28 * bad);
        tag(&mut place)?;
        place.xyz()?;
    }
    builder.mesh.points = points;
    Ok(tags.into_iter().map(|tag| tag as u64).collect())
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
    let mixed = builder.reverse_groups(&tags.reversed);
    if mixed > 0 {
        content.unread.push(format!(
            "the minus signs, which mark reversed elements, of the groups of {mixed} elements on entities whose other elements have none"
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
    /// How many elements of each entity have a minus sign before the number of their group.
    reversed: HashMap<EntityGroup, usize>,
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

    /// The group of a physical tag, which a minus sign may stand before; 0 means none.
    #[inline]
    fn group(&mut self, dim: u8, entity: i32, physical: i32) -> i64 {
        let group = i64::from(physical).abs();
        if physical < 0 {
            *self.reversed.entry((dim, entity, group)).or_insert(0) += 1;
        }
        group
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
    let entity = tags.values.get(1).copied().unwrap_or(0);
    block.entities.push(entity);
    builder.points = Some(points);
    let cell = builder.cell_count();
    let physical = tags.values.first().copied().unwrap_or(0);
    let group = tags.group(kind.dim(), entity, physical);
    builder.appended(1, kind.dim(), &[group][usize::from(group == 0)..]);
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
    let numbers = scan.numbers;
    let row = 1 + tag_count + kind.points();
    let start = scan.clone();
    let (words, _) = scan.bytes(count, 4 * row)?.as_chunks::<4>();
    // The error at a word of these.
    let refuse = |word: usize, what: String| {
        let mut place = start.clone();
        place.advance(4 * word);
        place.error(what)
    };
    let numbers_of_cells = bulk::first_words(words, row, numbers);
    if let Some(bad) = numbers_of_cells
        .iter()
        .position(|&number| number > i32::MAX as u64)
    {
        let number = numbers_of_cells.get(bad).map_or(0, |&number| number as i64);
        return Err(refuse(
            bad * row,
            format!("{number} is no number of an element"),
        ));
    }
    let nodes = bulk::nodes(words, row, 1 + tag_count, &points, numbers).map_err(|word| {
        let node = words
            .get(word)
            .map_or(0, |&node| bulk::signed(node, numbers));
        let number = numbers_of_cells.get(word / row).copied().unwrap_or(0);
        refuse(
            word,
            format!("element {number} has the node {node}, which does not exist"),
        )
    })?;
    let block = builder.block(kind);
    append(&mut block.nodes, nodes);
    append(&mut block.tags, numbers_of_cells);
    block.entities.reserve(count);
    // Runs of elements in the same group.
    let mut runs: Vec<(i64, u32)> = Vec::new();
    for words in words.chunks_exact(row) {
        let head = |place: usize| {
            words
                .get(place)
                .map_or(0, |&word| bulk::signed(word, numbers))
        };
        let physical = if tag_count > 0 { head(1) } else { 0 };
        let entity = if tag_count > 1 { head(2) } else { 0 };
        block.entities.push(entity);
        let group = tags.group(kind.dim(), entity, physical);
        match runs.last_mut() {
            Some((last, count)) if *last == group => *count += 1,
            _ => runs.push((group, 1)),
        }
    }
    builder.points = Some(points);
    for (group, count) in runs {
        builder.appended(count, kind.dim(), &[group][usize::from(group == 0)..]);
    }
    Ok(())
}

/// Appends what is new; where there is nothing yet it is not copied.
pub fn append<T>(all: &mut Vec<T>, mut new: Vec<T>) {
    if all.is_empty() {
        *all = new;
    } else {
        all.append(&mut new);
    }
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
