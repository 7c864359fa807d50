//! Medit's ASCII `.mesh`, in two and three dimensions: keywords, each with a count and rows that end in a label.
//!
//! The format has no names of groups: they are kept in comment lines, which other readers skip.

use std::collections::HashMap;
use std::path::Path;

use super::Content;
use super::labels::{CellLabels, POINT_LABEL, group_cells, point_labels, point_labels_of};
use super::loss::Losses;
use super::out::Out;
use super::scan::Scan;
use crate::error::{Error, Place, Result};
use crate::mesh::{CellBlock, CellKind, Field, Group, Mesh, Support, Values};

/// Keywords of cells, and the order of Gmsh's nodes among Medit's.
const CELLS: [(&str, CellKind); 7] = [
    ("Edges", CellKind::Line),
    ("Triangles", CellKind::Triangle),
    ("Quadrilaterals", CellKind::Quadrangle),
    ("Tetrahedra", CellKind::Tetrahedron),
    ("Hexahedra", CellKind::Hexahedron),
    ("Prisms", CellKind::Prism),
    ("Pyramids", CellKind::Pyramid),
];

/// Keywords that mark points and cells or relate them to a geometry; skipped, as they hold no part of the mesh.
const MARKS: [&str; 15] = [
    "AngleOfCornerBound",
    "Corners",
    "EdgeOnGeometricEdge",
    "Geometry",
    "Identifier",
    "RequiredEdges",
    "RequiredTriangles",
    "RequiredVertices",
    "Ridges",
    "SubDomainFromGeom",
    "SubDomainFromMesh",
    "SubDomain",
    "VertexOnGeometricEdge",
    "VertexOnGeometricVertex",
    "VertexOnSupportVertex",
];

/// Starts the comment that names a group; dimension, label and name follow.
const NAME: &[u8] = b"# faceoff group ";

pub fn recognises(bytes: &[u8]) -> bool {
    let mut scan = Scan::with_comments(Path::new(""), bytes, b'#');
    scan.word()
        .is_some_and(|word| word == b"MeshVersionFormatted")
}

/// Reads a mesh from its bytes.
///
/// # Errors
/// Any violation of the format, with keyword and line.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut scan = Scan::with_comments(path, bytes, b'#');
    let mut content = Content {
        format: "medit".into(),
        encoding: "ascii".into(),
        ..Content::default()
    };
    let mut dimension = None;
    let mut points: Option<(Vec<[f64; 3]>, Vec<i32>)> = None;
    let mut blocks: Vec<(CellBlock, Vec<i32>)> = Vec::new();
    if scan.word() != Some(b"MeshVersionFormatted") {
        return Err(scan.error("the file does not start with MeshVersionFormatted"));
    }
    content.version = Some(scan.u64()?.to_string());
    loop {
        scan.section.clear();
        let Some(word) = scan.peek() else {
            return Err(scan.error("End is missing"));
        };
        let word = String::from_utf8_lossy(word.get(..80).unwrap_or(word)).into_owned();
        scan.section.clone_from(&word);
        scan.word();
        let cell = CELLS.iter().find(|(name, _)| *name == word);
        let mark = MARKS.contains(&word.as_str());
        match (word.as_str(), cell, mark) {
            ("End", _, _) => break,
            ("Dimension", ..) => match scan.u64()? {
                found @ (2 | 3) if dimension.is_none() => dimension = Some(found as usize),
                other => {
                    return Err(scan.error(format!(
                        "the dimension must be 2 or 3 and given once, not {other}"
                    )));
                }
            },
            ("Vertices", ..) => {
                let dimension = dimension
                    .ok_or_else(|| scan.error("the vertices come before the dimension"))?;
                if points.is_some() {
                    return Err(scan.error("the vertices appear twice"));
                }
                points = Some(vertices(&mut scan, dimension)?);
            }
            (_, Some((_, kind)), false) => {
                let count = points.as_ref().map(|(points, _)| points.len());
                let count = count.ok_or_else(|| scan.error("cells come before the vertices"))?;
                blocks.push(cells(&mut scan, *kind, count)?);
            }
            (.., true) => {
                content.warnings.push(format!("{word} was skipped"));
                skip(&mut scan)?;
            }
            _ => {
                content.unread.push(format!("the section {word}"));
                skip(&mut scan)?;
            }
        }
    }
    let Some((points, labels)) = points else {
        return Err(scan.error("the file has no vertices"));
    };
    let mesh = &mut content.mesh;
    mesh.points = points;
    if labels.iter().any(|&label| label != 0) {
        mesh.fields.push(Field::new(
            POINT_LABEL,
            Support::Points,
            1,
            Values::I32(labels),
        ));
    }
    let items: Vec<(u8, &[i32])> = blocks
        .iter()
        .map(|(block, labels)| (block.kind.dim(), labels.as_slice()))
        .collect();
    mesh.groups = group_cells(&items);
    mesh.blocks = blocks
        .into_iter()
        .map(|(block, _)| block)
        .filter(|block| !block.is_empty())
        .collect();
    name_groups(&mut mesh.groups, bytes);
    Ok(content)
}

fn vertices(scan: &mut Scan<'_>, dimension: usize) -> Result<(Vec<[f64; 3]>, Vec<i32>)> {
    let count = scan.count("vertices", 2 * dimension + 2)?;
    let mut points = Vec::with_capacity(count);
    let mut labels = Vec::with_capacity(count);
    for _ in 0..count {
        let z = |scan: &mut Scan<'_>| if dimension == 3 { scan.f64() } else { Ok(0.0) };
        points.push([scan.f64()?, scan.f64()?, z(scan)?]);
        labels.push(scan.i32()?);
    }
    Ok((points, labels))
}

fn cells(scan: &mut Scan<'_>, kind: CellKind, points: usize) -> Result<(CellBlock, Vec<i32>)> {
    let count = scan.count("cells", 2 * kind.points() + 2)?;
    let mut nodes = Vec::with_capacity(count * kind.points());
    let mut labels = Vec::with_capacity(count);
    for _ in 0..count {
        for _ in 0..kind.points() {
            nodes.push(scan.vertex(points)?);
        }
        labels.push(scan.i32()?);
    }
    Ok((CellBlock::new(kind, nodes), labels))
}

/// Skips an unknown section: everything up to the next word that is not a number.
fn skip(scan: &mut Scan<'_>) -> Result<()> {
    while let Some(word) = scan.peek() {
        if word.starts_with(b"\"") {
            scan.skip_blanks();
            scan.advance(1);
            if !scan.seek(b"\"") {
                return Err(scan.error("a quoted text does not end"));
            }
            scan.advance(1);
            continue;
        }
        if word.first().is_some_and(u8::is_ascii_alphabetic) {
            return Ok(());
        }
        scan.word();
    }
    Err(scan.error("the file ends inside a section"))
}

/// Gives groups the names in the comments.
fn name_groups(groups: &mut [Group], bytes: &[u8]) {
    let mut names: HashMap<(u8, i64), String> = HashMap::new();
    for start in memchr::memmem::find_iter(bytes, NAME) {
        let rest = bytes.get(start + NAME.len()..).unwrap_or_default();
        let end = memchr::memchr(b'\n', rest).unwrap_or(rest.len());
        let Some(Ok(line)) = rest.get(..end).map(std::str::from_utf8) else {
            continue;
        };
        let mut parts = line.strip_suffix('\r').unwrap_or(line).splitn(3, ' ');
        let dim = parts.next().and_then(|word| word.parse().ok());
        let tag = parts.next().and_then(|word| word.parse().ok());
        if let (Some(dim), Some(tag), Some(name)) = (dim, tag, parts.next()) {
            names.insert((dim, tag), name.to_owned());
        }
    }
    for group in groups {
        group.name = names.remove(&(group.dim, group.tag));
    }
}

/// Writes a mesh of first-order cells, with two coordinates if it lies in the plane z = 0.
///
/// # Errors
/// The mesh is not sound, the format cannot hold it, or the file cannot be written.
pub fn write(path: &Path, mesh: &Mesh, lossy: bool) -> Result<Vec<String>> {
    let refuse = |what: String| {
        Error::file(
            path,
            Place::Whole,
            what,
            "repair the mesh before it is written",
        )
    };
    mesh.validate().map_err(refuse)?;
    let mut losses = Losses::default();
    let labels = CellLabels::new(mesh, &mut losses);
    let held =
        |kind: CellKind| CELLS.iter().any(|(_, known)| *known == kind) || kind == CellKind::Vertex;
    let rest = mesh.cells().filter(|(_, kind, _)| !held(*kind)).count();
    losses.lose_some(rest, "cells of second or higher order");
    let point_labels = point_labels(mesh, &labels, &mut losses);
    losses.note_gmsh(mesh);

    // FreeFEM and dolfinx expect a planar mesh to have two coordinates.
    let flat = mesh.dim() <= 2 && mesh.points.iter().all(|point| point[2] == 0.0);
    let dimension = if flat { 2 } else { 3 };
    let mut out = Out::to(path)?;
    out.text("MeshVersionFormatted 2\n");
    for group in &mesh.groups {
        if let Some(name) = &group.name {
            if name.contains(['\n', '\r']) {
                losses.lose(format!("the name {name:?}, which has a line end"));
                continue;
            }
            out.text(&String::from_utf8_lossy(NAME))
                .int(group.dim)
                .int(group.tag)
                .text(name)
                .text("\n");
        }
    }
    out.text(&format!(
        "Dimension {dimension}\nVertices\n{}\n",
        mesh.points.len()
    ));
    for (index, point) in mesh.points.iter().enumerate() {
        point.iter().take(dimension).for_each(|&x| {
            out.float(x);
        });
        out.int(point_labels_of(&point_labels, index)).end();
    }
    for (keyword, wanted) in CELLS {
        let count = mesh.count(wanted);
        if count == 0 {
            continue;
        }
        out.text(&format!("{keyword}\n{count}\n"));
        for (cell, _, nodes) in mesh.cells().filter(|(_, kind, _)| *kind == wanted) {
            nodes.iter().for_each(|&node| {
                out.int(node + 1);
            });
            out.int(labels.of(cell)).end();
        }
    }
    out.text("End\n");
    let warnings = losses.settle(path, "Medit", lossy)?;
    out.save(path)?;
    Ok(warnings)
}
