//! AVS' UCD (unstructured cell data), text and binary: materials are groups, data of nodes and cells are fields. meshio
//! writes it.

use std::path::Path;

use super::builder::{Builder, Lookup, Numbering};
use super::scan::{Numbers, Scan};
use super::{Content, Native, Read, meshio};
use crate::error::Result;
use crate::field::Tell;
use crate::mesh::{CellKind, Field, Mesh, Support, Values};

pub static FORMAT: Native = Native {
    title: "AVS' UCD",
    names: &["avsucd", "ucd"],
    suffixes: &["avs", "ucd"],
    has_binary: false,
    holds_whole: false,
    recognises: |bytes| byte_order(bytes).is_some() || is_text(bytes),
    read: Read::Once(read),
    write: |job| meshio::write(job, "avsucd"),
};

/// Types by name, in the order of their numbers in binary files, and the places of their nodes in Gmsh's order.
const TYPES: [(&str, CellKind, &[usize]); 8] = [
    ("pt", CellKind::Vertex, &[0]),
    ("line", CellKind::Line, &[0, 1]),
    ("tri", CellKind::Triangle, &[0, 1, 2]),
    ("quad", CellKind::Quadrangle, &[0, 1, 2, 3]),
    ("tet", CellKind::Tetrahedron, &[0, 1, 2, 3]),
    // The tip comes first.
    ("pyr", CellKind::Pyramid, &[4, 0, 1, 2, 3]),
    ("prism", CellKind::Prism, &[0, 1, 2, 3, 4, 5]),
    ("hex", CellKind::Hexahedron, &[0, 1, 2, 3, 4, 5, 6, 7]),
];

/// The data that were read, with a note on data for the whole mesh.
fn finish(mut content: Content, builder: Builder, for_all: usize) -> Content {
    if for_all > 0 {
        content
            .unread
            .tell("model data", "the data about the model as a whole");
    }
    content.mesh = builder.finish();
    let turned = turn_over(&mut content.mesh);
    if turned > 0 {
        content.warnings.push(format!(
            "{turned} cells have their top first and are turned over"
        ));
    }
    content
}

/// Turns over the cells that are inside out: after AVS' manual the top of a cell comes first, and as many programs write
/// the bottom first. How many.
fn turn_over(mesh: &mut Mesh) -> usize {
    let mut turned = 0;
    for block in &mut mesh.blocks {
        // Corners whose edges span the cell, and what is where afterwards.
        let (corners, order): ([usize; 4], &[usize]) = match block.kind {
            CellKind::Tetrahedron => ([0, 1, 2, 3], &[0, 1, 3, 2]),
            CellKind::Prism => ([0, 1, 2, 3], &[3, 4, 5, 0, 1, 2]),
            CellKind::Hexahedron => ([0, 1, 3, 4], &[4, 5, 6, 7, 0, 1, 2, 3]),
            _ => continue,
        };
        for cell in block.nodes.to_mut().chunks_exact_mut(order.len()) {
            let [o, a, b, c] =
                corners.map(|corner| nalgebra::Vector3::from(mesh.points[cell[corner] as usize]));
            if (a - o).cross(&(b - o)).dot(&(c - o)) < 0.0 {
                let old = cell.to_vec();
                cell.iter_mut()
                    .zip(order)
                    .for_each(|(node, &place)| *node = old[place]);
                turned += 1;
            }
        }
    }
    turned
}

/// The first byte of binary files.
const MAGIC: u8 = 7;
/// Bytes of the labels, and of the units, of the fields of binary files.
const LABELS: usize = 1024;

/// The numbers in the head: nodes, cells, numbers at each node, at each cell, for all.
type Head = [usize; 5];

/// Whether the first line that is not a comment contains only five integers, and the next a node.
fn is_text(bytes: &[u8]) -> bool {
    let mut scan = Scan::with_comments(Path::new(""), bytes, b'#');
    scan.skip_blanks();
    let mut words = |count: usize| {
        let mut row = scan.row().unwrap_or_else(|| Scan::new(Path::new(""), b""));
        let head = (0..count.min(5)).all(|place| match count {
            5 => row.u64().is_ok(),
            _ if place == 0 => row.u64().is_ok(),
            _ => row.f64().is_ok(),
        });
        head && row.peek().is_none()
    };
    words(5) && words(4)
}

/// The byte order in which the head of a binary file fits its length.
fn byte_order(bytes: &[u8]) -> Option<(Numbers, Head, usize)> {
    let words = bytes
        .strip_prefix(&[MAGIC])?
        .first_chunk::<24>()?
        .as_chunks::<4>()
        .0;
    let fits = |numbers, read: fn([u8; 4]) -> u32| {
        let words: Vec<usize> = words.iter().map(|&word| read(word) as usize).collect();
        let &[nodes, cells, at_nodes, at_cells, for_all, listed] = words.as_slice() else {
            return None;
        };
        let data = |fields: usize, rows: usize| match fields {
            0 => 0,
            // Labels, units, how many components each field has, least and largest values, values, marks.
            _ => 2 * LABELS + 4 * (4 * fields + 1) + 4 * fields.saturating_mul(rows),
        };
        let mesh = 25usize
            + 16usize.saturating_mul(cells)
            + 4usize.saturating_mul(listed)
            + 12usize.saturating_mul(nodes);
        let all = mesh
            .saturating_add(data(at_nodes, nodes))
            .saturating_add(data(at_cells, cells));
        (nodes > 0 && all <= bytes.len()).then_some((
            numbers,
            [nodes, cells, at_nodes, at_cells, for_all],
            listed,
        ))
    };
    fits(Numbers::Little, u32::from_le_bytes).or_else(|| fits(Numbers::Big, u32::from_be_bytes))
}

fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut content = Content::default();
    if let Some((numbers, head, listed)) = byte_order(bytes) {
        content.encoding = numbers.encoding();
        let mut scan = Scan::new(path, bytes);
        scan.advance(25);
        scan.numbers = numbers;
        scan.single = true;
        return binary(scan, head, listed, content);
    }
    let mut scan = Scan::with_comments(path, bytes, b'#');
    let mut head: Head = [0; 5];
    for (number, (of, bytes)) in head.iter_mut().zip([
        ("nodes", 8),
        ("cells", 6),
        ("numbers", 0),
        ("numbers", 0),
        ("numbers", 0),
    ]) {
        *number = scan.count(of, bytes)?;
    }
    let [nodes, cells, at_nodes, at_cells, for_all] = head;
    let mut builder = Builder::default();
    let mut numbers = Numbering::default();
    scan.section = "nodes".into();
    for _ in 0..nodes {
        // Nodes and cells may be counted from 0.
        numbers.push(scan.u64()?);
        let point = scan.xyz()?;
        builder.mesh.points.to_mut().push(point);
    }
    builder.finish_points(&scan, numbers)?;
    let Some(points) = builder.points.take() else {
        return Err(scan.error("there are no nodes"));
    };
    scan.section = "cells".into();
    let mut cell_numbers = Vec::new();
    for _ in 0..cells {
        let (number, material) = (scan.u64()?, scan.i32()?);
        cell_numbers.push(number);
        let mut word = scan.word().unwrap_or_default();
        // Some writers put a material of several words or none.
        if word.is_empty() {
            word = b"?";
        }
        let known = TYPES
            .iter()
            .find(|(name, ..)| name.as_bytes().eq_ignore_ascii_case(word));
        let Some((_, kind, places)) = known else {
            return Err(scan.error(format!(
                "{:?} is not a type of cells",
                String::from_utf8_lossy(word)
            )));
        };
        let mut found = [0; 8];
        for &place in *places {
            let node = scan.u64()?;
            let point = points.get(node);
            let point = point.ok_or_else(|| {
                scan.error(format!(
                    "cell {number} has the node {node}, which does not exist"
                ))
            })?;
            found[place] = point;
        }
        builder.cell(*kind, &found[..places.len()], number, material.into());
    }
    builder.points = Some(points);
    // deal.II counts the cells on the boundary from 1 again.
    let distinct = Lookup::new(&cell_numbers).is_ok();
    if !distinct {
        builder.numbers = Numbering::default();
        content
            .warnings
            .push("several cells have the same number: all are numbered anew".into());
    }
    builder.finish_cells(&scan)?;
    for (on, rows, components) in [
        (Support::Points, nodes, at_nodes),
        (Support::Cells, cells, at_cells),
    ] {
        if components > 0 {
            text_fields(&mut scan, &mut builder, on, rows, distinct)?;
        }
    }
    Ok(finish(content, builder, for_all))
}

/// Sizes and names of the fields, then a row of all of them for each node or cell.
fn text_fields(
    scan: &mut Scan<'_>,
    builder: &mut Builder,
    on: Support,
    rows: usize,
    distinct: bool,
) -> Result<()> {
    scan.section = format!("data on {on}");
    let count = scan.count("fields", 2)?;
    let mut sizes = Vec::new();
    for _ in 0..count {
        sizes.push(scan.count("components", 2)?);
    }
    scan.line();
    let names: Vec<String> = (0..count)
        .map(|_| {
            let line = String::from_utf8_lossy(scan.line()).into_owned();
            line.split(',').next().unwrap_or_default().trim().to_owned()
        })
        .collect();
    let width: usize = sizes.iter().sum();
    scan.believe(rows as u64, "rows", 2 * width + 2)?;
    if on == Support::Cells {
        builder.index_cells();
    }
    let index = builder.cell_index.as_ref().filter(|_| on == Support::Cells);
    let lookup = index.map_or(builder.points.as_ref(), |index| Some(&index.by_tag));
    let mut values: Vec<Vec<f64>> = sizes
        .iter()
        .map(|size| vec![f64::NAN; size * rows])
        .collect();
    for row in 0..rows as u32 {
        let number = scan.u64()?;
        let row = match on {
            Support::Cells if !distinct => Some(row),
            _ => lookup.and_then(|lookup| lookup.get(number)),
        };
        let row = row
            .ok_or_else(|| scan.error(format!("a value for {number}, which does not exist")))?
            as usize;
        for (values, &size) in values.iter_mut().zip(&sizes) {
            for value in values.iter_mut().skip(row * size).take(size) {
                *value = scan.any_f64()?;
            }
        }
    }
    for ((name, values), size) in names.into_iter().zip(values).zip(sizes) {
        if size > 0 {
            builder
                .mesh
                .fields
                .push(Field::new(name, on, size, Values::F64(values.into())));
        }
    }
    Ok(())
}

/// A file of binary32 and integers of 32 bits.
fn binary(mut scan: Scan<'_>, head: Head, listed: usize, content: Content) -> Result<Content> {
    let [nodes, cells, at_nodes, at_cells, for_all] = head;
    let mut builder = Builder::default();
    scan.believe(cells as u64, "cells", 16)?;
    let mut types = Vec::with_capacity(cells);
    scan.section = "cells".into();
    for _ in 0..cells {
        let (_number, material, count, kind) = (scan.i32()?, scan.i32()?, scan.i32()?, scan.i32()?);
        let known = usize::try_from(kind).ok().and_then(|kind| TYPES.get(kind));
        let known = known.filter(|(_, kind, _)| usize::try_from(count) == Ok(kind.points()));
        let known = known.ok_or_else(|| {
            scan.error(format!(
                "there is no cell of type {kind} with {count} nodes"
            ))
        })?;
        types.push((material, known.1, known.2));
    }
    let end = scan.position().saturating_add(4 * listed) as u64;
    for (material, kind, places) in types {
        let mut found = [0; 8];
        for &place in places {
            found[place] = scan.vertex(nodes)?;
        }
        let number = builder.new_number();
        builder.cell(kind, &found[..places.len()], number, material.into());
    }
    scan.go(end)?;
    scan.believe(nodes as u64, "nodes", 12)?;
    builder.mesh.points = vec![[0.0; 3]; nodes].into();
    for axis in 0..3 {
        for point in builder.mesh.points.to_mut() {
            point[axis] = scan.real()?;
        }
    }
    builder.finish_cells(&scan)?;
    for (on, rows, components) in [
        (Support::Points, nodes, at_nodes),
        (Support::Cells, cells, at_cells),
    ] {
        if components == 0 {
            continue;
        }
        scan.section = format!("data on {on}");
        let labels = scan.bytes(LABELS, 1)?;
        let labels = labels.split(|&byte| byte == 0).next().unwrap_or_default();
        let mut names = labels
            .split(|&byte| byte == b'.')
            .map(|name| String::from_utf8_lossy(name).trim().to_owned());
        scan.bytes(LABELS, 1)?;
        let count = scan.uint()?;
        let count = usize::try_from(count)
            .ok()
            .filter(|&count| count <= components);
        let count = count.ok_or_else(|| scan.error("there are more fields than numbers"))?;
        let sizes: Vec<u64> = (0..components)
            .map(|_| scan.uint())
            .collect::<Result<_>>()?;
        scan.bytes(2 * components, 4)?;
        let mut left = components;
        for &size in sizes.iter().take(count) {
            let size = usize::try_from(size)
                .ok()
                .filter(|size| (1..=left).contains(size));
            let size = size.ok_or_else(|| scan.error("the sizes of the fields do not add up"))?;
            left -= size;
            scan.believe((size * rows) as u64, "values", 4)?;
            let values = (0..size * rows).map(|_| scan.any_real().map(|value| value as f32));
            let name = names.next().unwrap_or_default();
            builder.mesh.fields.push(Field::new(
                name,
                on,
                size,
                Values::F32(values.collect::<Result<_>>()?),
            ));
        }
        scan.bytes(left * rows + components, 4)?;
    }
    Ok(finish(content, builder, for_all))
}
