//! Elements of MSH 1.0 and 2.x.

use super::bulk;
use super::layout::{Layout, Reader};
use super::nodes_v2::text_count;
use super::tags_v2::Tags;
use crate::error::Result;
use crate::field::Tell;
use crate::io::builder::{Builder, no_such_node};
use crate::io::rows::append;
use crate::io::scan::{Numbers, Scan};
use crate::mesh::CellKind;

/// `$ELM`, `$Elements`: their number, then number, type, tags and nodes of each.
pub fn elements(reader: &mut Reader<'_>, layout: Layout) -> Result<()> {
    let (scan, builder, content) = reader.parts();
    if builder.points.is_none() {
        return Err(scan.error("the elements come before the nodes"));
    }
    let count = text_count(scan, "elements", scan.least(8, 12))?;
    let mut tags = Tags::default();
    if scan.numbers == Numbers::Ascii {
        for _ in 0..count {
            let number = scan.tag()?;
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
                let number = scan.tag()?;
                tags.read(scan, tag_count)?;
                element(scan, builder, kind, number, &mut tags, layout)?;
            }
        }
    }
    if tags.odd > 0 {
        content.unread.tell(
            "element tags",
            format!(
                "the third and later tags of {} elements, which are not partitions",
                tags.odd
            ),
        );
    }
    let mixed = builder.reverse_groups(&tags.reversed);
    if mixed > 0 {
        content.unread.tell("minus signs", format!(
            "the minus signs, which mark reversed elements, of the groups of {mixed} elements on entities whose other elements have none"
        ));
    }
    builder.finish_cells(scan)
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
        return Err(scan.error("the elements come before the nodes"));
    };
    let block = builder.block(kind);
    let nodes = block.nodes.to_mut();
    for _ in 0..kind.points() {
        let node = scan.tag()?;
        let point = points.get(node);
        nodes.push(point.ok_or_else(|| no_such_node(scan, number, node))?);
    }
    let entity = tags.values.get(1).copied().unwrap_or(0);
    block.entities.push(entity);
    builder.numbers.push(number);
    builder.points = Some(points);
    let cell = builder.cell_count();
    let physical = tags.values.first().copied().unwrap_or(0);
    let group = tags.group(kind.dim(), entity, physical, 1);
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

/// [`element`] for a binary block of elements that have at most group and entity as tags, as in most large files.
fn plain_block(
    scan: &mut Scan<'_>,
    builder: &mut Builder,
    kind: CellKind,
    count: usize,
    tag_count: usize,
    tags: &mut Tags,
) -> Result<()> {
    let Some(points) = builder.points.take() else {
        return Err(scan.error("the elements come before the nodes"));
    };
    let numbers = scan.numbers;
    let row = 1 + tag_count + kind.points();
    let start = scan.clone();
    let (words, _) = scan.bytes(count, 4 * row)?.as_chunks::<4>();
    // The position of a word.
    let place = |word: usize| {
        let mut place = start.clone();
        place.advance(4 * word);
        place
    };
    let expected = builder.numbers.next().unwrap_or(0);
    let new = bulk::elements(words, row, 1 + tag_count, &points, expected, numbers);
    builder.points = Some(points);
    let new = new.map_err(|word| {
        let value = |word: usize| words.get(word).map_or(0, |&it| bulk::signed(it, numbers));
        no_such_node(&place(word), value(word / row * row), value(word))
    })?;
    if new.count_on && builder.numbers.next().is_some() {
        builder.numbers.count_on(count);
    } else {
        let own = bulk::first_words(words, row, numbers);
        if let Some(bad) = own.iter().position(|&number| number > i32::MAX as u64) {
            let number = own.get(bad).map_or(0, |&number| number as i64);
            let what = format!("{number} is not the number of an element");
            return Err(place(bad * row).error(what));
        }
        builder.numbers.append(own);
    }
    // Runs of elements in the same group and on the same entity, often all of them.
    let tags_of = |words: &[[u8; 4]]| {
        let value = |place: usize| match words.get(place) {
            Some(&word) if place <= tag_count => bulk::signed(word, numbers),
            _ => 0,
        };
        (value(1), value(2))
    };
    let mut runs: Vec<((i32, i32), usize)> = Vec::new();
    if new.alike {
        runs.push((tags_of(words), count));
    } else {
        for words in words.chunks_exact(row) {
            match runs.last_mut() {
                Some((last, count)) if *last == tags_of(words) => *count += 1,
                _ => runs.push((tags_of(words), 1)),
            }
        }
    }
    let block = builder.block(kind);
    append(block.nodes.to_mut(), new.nodes);
    for &((_, entity), count) in &runs {
        block.entities.resize(block.entities.len() + count, entity);
    }
    for ((physical, entity), count) in runs {
        let group = tags.group(kind.dim(), entity, physical, count);
        builder.appended(
            count as u32,
            kind.dim(),
            &[group][usize::from(group == 0)..],
        );
    }
    Ok(())
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
        _ => format!("{number} is not a known element type"),
    };
    scan.error_with(what, "save the mesh with standard element types")
}
