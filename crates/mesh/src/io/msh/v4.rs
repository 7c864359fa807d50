//! Nodes and elements of MSH 4.0 and 4.1: blocks, each on one entity.

use super::bulk::{self, Word};
use super::elements_v2::unknown_type;
use super::layout::{Layout, Reader};
use crate::error::Result;
use crate::io::builder::{Numbering, no_such_node};
use crate::io::rows::append;
use crate::io::scan::{Numbers, Scan};
use crate::mesh::{CellKind, PointRun, all_finite};

/// `$Nodes`. A block has, in 4.1, the numbers of its nodes before their coordinates; in 4.0 each number
/// comes before its coordinates and is 32 bits wide.
pub fn nodes(reader: &mut Reader<'_>, layout: Layout) -> Result<()> {
    let (scan, builder, content) = reader.parts();
    let (blocks, count, range) = head(scan, layout, "nodes", 8)?;
    let mut tags = Numbering::default();
    let mut runs: Vec<PointRun> = Vec::new();
    for _ in 0..blocks {
        let (dim, entity, parametric) = block_head(scan, layout)?;
        if !matches!(parametric, 0 | 1) {
            return Err(scan.error(format!(
                "the mark of parametric nodes is 0 or 1, not {parametric}"
            )));
        }
        let in_block = scan.count(
            "nodes in a block",
            if layout == Layout::V41 { 8 } else { 7 },
        )?;
        let extra = if parametric == 1 { usize::from(dim) } else { 0 };
        let first = tags.len();
        if in_block > count - first {
            return Err(scan.error(format!(
                "a block has {in_block} nodes where {} are left",
                count - first
            )));
        }
        if layout == Layout::V41 {
            sizes(scan, in_block, &mut tags)?;
        }
        let mut parameters = Vec::new();
        if layout == Layout::V41 && extra == 0 && scan.numbers != Numbers::Ascii {
            coordinates(scan, in_block, builder.mesh.points.to_mut())?;
        } else {
            for _ in 0..in_block {
                if layout != Layout::V41 {
                    tags.push(scan.tag()?);
                }
                let point = scan.xyz()?;
                builder.mesh.points.to_mut().push(point);
                for _ in 0..extra {
                    parameters.push(scan.f64()?);
                }
            }
        }
        runs.push(PointRun {
            dim,
            entity,
            count: in_block,
            parameters: (parametric == 1).then_some(parameters),
        });
    }
    if tags.len() != count {
        return Err(scan.error(format!(
            "{count} nodes are declared, but the blocks have {}",
            tags.len()
        )));
    }
    let warnings = &mut content.warnings;
    warn_range("$Nodes declares node", range, &tags, warnings);
    builder.mesh.geometry.point_runs = runs;
    builder.finish_points(scan, tags)
}

/// `$Elements`. A block has number and nodes of each element, of 32 bits in 4.0.
pub fn elements(reader: &mut Reader<'_>, layout: Layout) -> Result<()> {
    let physicals = reader.physicals();
    let (scan, builder, content) = reader.parts();
    let Some(points) = builder.points.take() else {
        return Err(scan.error("the elements come before the nodes"));
    };
    let (blocks, count, range) = head(scan, layout, "elements", 4)?;
    let mut numbers = Numbering::default();
    let mut left = count;
    let mut memberships = 0usize;
    for _ in 0..blocks {
        let (dim, entity, number) = block_head(scan, layout)?;
        let kind = CellKind::from_gmsh(number).ok_or_else(|| unknown_type(scan, number))?;
        if kind.dim() != dim {
            return Err(scan.error(format!("a {kind} belongs to an entity of dimension {dim}")));
        }
        let width = scan.least(2, if layout == Layout::V41 { 8 } else { 4 });
        let row = kind.points() + 1;
        let in_block = scan.count("elements in a block", width * row)?;
        if in_block > left {
            return Err(scan.error(format!(
                "a block has {in_block} elements where {left} are left"
            )));
        }
        left -= in_block;
        if in_block == 0 {
            continue;
        }
        let block = builder.block(kind);
        if layout == Layout::V41 && scan.numbers != Numbers::Ascii {
            let start = scan.clone();
            let (words, _) = scan.bytes(in_block, 8 * row)?.as_chunks::<8>();
            let expected = numbers.next().unwrap_or(0);
            let new = bulk::elements(words, row, 1, &points, expected, scan.numbers);
            let new = new.map_err(|word| {
                let mut place = start;
                place.advance(8 * word);
                let number = |word: usize| words.get(word).map_or(0, |it| it.number(place.numbers));
                no_such_node(&place, number(word / row * row), number(word))
            })?;
            if new.count_on && numbers.next().is_some() {
                numbers.count_on(in_block);
            } else {
                numbers.append(bulk::first_words(words, row, scan.numbers));
            }
            append(block.nodes.to_mut(), new.nodes);
        } else {
            let nodes = block.nodes.to_mut();
            for _ in 0..in_block {
                let element = tag(scan, layout)?;
                numbers.push(element);
                for _ in 1..row {
                    let node = tag(scan, layout)?;
                    let point = points.get(node);
                    nodes.push(point.ok_or_else(|| no_such_node(scan, element, node))?);
                }
            }
        }
        block.entities.resize(block.len(), entity);
        let groups = physicals.get(&(dim, entity)).map_or(&[][..], Vec::as_slice);
        // Otherwise a list of groups shared by many blocks could take far more memory than the file.
        memberships = memberships.saturating_add(groups.len().saturating_mul(in_block));
        if memberships > 2 * scan.len() {
            return Err(scan.error(
                "the elements are in more groups than is plausible for a file of this size",
            ));
        }
        builder.appended(in_block as u32, dim, groups);
    }
    if left > 0 {
        return Err(scan.error(format!(
            "{count} elements are declared, but {left} of them are in no block"
        )));
    }
    builder.points = Some(points);
    let warnings = &mut content.warnings;
    warn_range("$Elements declares element", range, &numbers, warnings);
    builder.numbers = numbers;
    builder.finish_cells(scan)
}

/// The lowest and the highest number of an item.
type Range = (u64, u64);

/// Numbers of blocks and of items, and in 4.1 the lowest and highest number of an item.
fn head(
    scan: &mut Scan<'_>,
    layout: Layout,
    of: &str,
    bytes: usize,
) -> Result<(u64, usize, Option<Range>)> {
    let (blocks, count) = (scan.u64()?, scan.u64()?);
    let range = if layout == Layout::V41 {
        Some((scan.u64()?, scan.u64()?))
    } else {
        None
    };
    Ok((blocks, scan.believe(count, of, bytes)?, range))
}

/// Dimension and number of the entity, and what follows: the mark of parametric nodes, or the type of elements.
fn block_head(scan: &mut Scan<'_>, layout: Layout) -> Result<(u8, i32, i32)> {
    let (first, second, third) = (scan.i32()?, scan.i32()?, scan.i32()?);
    let (dim, entity) = if layout == Layout::V41 {
        (first, second)
    } else {
        (second, first)
    };
    match u8::try_from(dim) {
        Ok(dim @ 0..=3) => Ok((dim, entity, third)),
        _ => Err(scan.error(format!("the dimension of an entity is 0 to 3, not {dim}"))),
    }
}

/// The number of a node or element, which has 64 bits in 4.1.
#[inline]
pub fn tag(scan: &mut Scan<'_>, layout: Layout) -> Result<u64> {
    match layout {
        Layout::V41 => scan.u64(),
        _ => scan.tag(),
    }
}

/// Appends `count` numbers of 64 bits.
fn sizes(scan: &mut Scan<'_>, count: usize, to: &mut Numbering) -> Result<()> {
    match scan.numbers {
        Numbers::Ascii => {
            for _ in 0..count {
                to.push(scan.u64()?);
            }
        }
        numbers => {
            let (words, _) = scan.bytes(count, 8)?.as_chunks::<8>();
            match to.next() {
                Some(first) if bulk::count_on(words, 1, first, numbers) => to.count_on(count),
                _ => to.append(bulk::first_words(words, 1, numbers)),
            }
        }
    }
    Ok(())
}

/// Appends the coordinates of `count` points of a binary file.
fn coordinates(scan: &mut Scan<'_>, count: usize, to: &mut Vec<[f64; 3]>) -> Result<()> {
    let numbers = scan.numbers;
    let new = bulk::points(scan.bytes(count, 24)?, 0, numbers);
    if !all_finite(new.as_flattened()) {
        let odd = new.as_flattened().iter().find(|x| !x.is_finite());
        let odd = odd.copied().unwrap_or(f64::NAN);
        return Err(scan.error(format!("expected a finite coordinate, found {odd}")));
    }
    append(to, new);
    Ok(())
}

/// Warns if a section declares another range of numbers than there is.
fn warn_range(of: &str, range: Option<Range>, tags: &Numbering, warnings: &mut Vec<String>) {
    if let (Some((low, high)), Some((first, last))) = (range, tags.range())
        && (first, last) != (low, high)
    {
        warnings.push(format!(
            "{of} numbers from {low} to {high}, but they go from {first} to {last}"
        ));
    }
}
