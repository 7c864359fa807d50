//! Medit's ASCII `.mesh`, in two and three dimensions: keywords, each with a count and rows that end in a label.
//!
//! The format has no names of groups: they are kept in comment lines, which other readers skip.

use std::collections::HashMap;
use std::path::Path;

use super::labels::{Labels, Rows};
use super::loss::Losses;
use super::out::Out;
use super::scan::Scan;
use super::{Content, Native, Options, refuse_unsound};
use crate::error::Result;
use crate::field::GlobalArray;
use crate::mesh::{CellKind, Group, Mesh};

pub static FORMAT: Native = Native {
    title: "Medit",
    names: &["medit"],
    suffixes: &["mesh"],
    has_binary: false,
    holds_whole: false,
    recognises,
    read,
    write,
};

/// Keywords of cells, and the order of Gmsh's nodes among Medit's.
pub const CELLS: [(&str, CellKind); 7] = [
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

/// The word that files start with.
const FIRST: &[u8] = b"MeshVersionFormatted";

fn recognises(bytes: &[u8]) -> bool {
    Scan::with_comments(Path::new(""), bytes, b'#').word() == Some(FIRST)
}

/// Begins to read a file: its version.
pub fn version(scan: &mut Scan<'_>) -> Result<u64> {
    if scan.word() != Some(FIRST) {
        return Err(scan.error("the file does not start with MeshVersionFormatted"));
    }
    scan.u64()
}

/// The next keyword, which is the section that errors name from here on.
pub fn keyword(scan: &mut Scan<'_>) -> Result<String> {
    scan.section.clear();
    let Some(word) = scan.peek() else {
        return Err(scan.error("End is missing"));
    };
    scan.section = String::from_utf8_lossy(word.get(..80).unwrap_or(word)).into_owned();
    scan.word();
    Ok(scan.section.clone())
}

/// The dimension, which is not `known` so far.
pub fn dimension(scan: &mut Scan<'_>, known: Option<usize>) -> Result<usize> {
    match scan.u64()? {
        found @ (2 | 3) if known.is_none() => Ok(found as usize),
        other => Err(scan.error(format!(
            "the dimension must be 2 or 3 and given once, not {other}"
        ))),
    }
}

/// Reads a mesh from its bytes.
fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut scan = Scan::with_comments(path, bytes, b'#');
    let mut content = Content {
        format: "medit".into(),
        version: Some(version(&mut scan)?.to_string()),
        encoding: "ascii".into(),
        ..Content::default()
    };
    let mut known = None;
    let mut rows = Rows::default();
    let mut has_vertices = false;
    loop {
        let word = keyword(&mut scan)?;
        let cell = CELLS.iter().find(|(name, _)| *name == word);
        match (word.as_str(), cell) {
            ("End", _) => break,
            ("Dimension", _) => known = Some(dimension(&mut scan, known)?),
            ("Vertices", _) => {
                let dimension =
                    known.ok_or_else(|| scan.error("the vertices come before the dimension"))?;
                if has_vertices {
                    return Err(scan.error("the vertices appear twice"));
                }
                has_vertices = true;
                let count = scan.count("vertices", 2 * dimension + 2)?;
                rows.points(&mut scan, count, dimension)?;
            }
            (_, Some((_, kind))) => {
                if !has_vertices {
                    return Err(scan.error("cells come before the vertices"));
                }
                let count = scan.count("cells", 2 * kind.points() + 2)?;
                rows.cells(&mut scan, count, *kind)?;
            }
            (mark, None) if MARKS.contains(&mark) => {
                content.warnings.push(format!("{mark} was skipped"));
                skip(&mut scan)?;
            }
            (other, None) => {
                content.unread.push(format!("the section {other}"));
                skip(&mut scan)?;
            }
        }
    }
    if !has_vertices {
        return Err(scan.error("the file has no vertices"));
    }
    content.mesh = rows.finish();
    name_groups(&mut content.mesh.groups, bytes);
    Ok(content)
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
fn write(path: &Path, mesh: &Mesh, _: &[GlobalArray], options: &Options) -> Result<Vec<String>> {
    refuse_unsound(path, mesh)?;
    let mut losses = Losses::default();
    let mut labels = Labels::of_cells(mesh, &mut losses);
    let held =
        |kind: CellKind| CELLS.iter().any(|(_, known)| *known == kind) || kind == CellKind::Vertex;
    let rest = mesh.cells().filter(|(_, kind, _)| !held(*kind)).count();
    losses.lose_some(rest, "cells of second or higher order");
    labels.label_points(&mut losses);
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
    labels.write_points(&mut out, dimension);
    for (keyword, kind) in CELLS {
        let count = mesh.count(kind);
        if count > 0 {
            out.text(&format!("{keyword}\n{count}\n"));
            labels.write_cells(&mut out, kind);
        }
    }
    out.text("End\n");
    let warnings = losses.settle(path, FORMAT.title, options.lossy)?;
    out.save(path)?;
    Ok(warnings)
}
