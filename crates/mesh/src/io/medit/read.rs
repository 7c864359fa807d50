//! Reads meshes.

use std::collections::HashMap;
use std::path::Path;

use super::sections::Sections;
use super::{NAME, SWAPPED, cells};
use crate::error::Result;
use crate::field::Tell;
use crate::io::Content;
use crate::io::labels::Rows;
use crate::io::scan::Numbers;
use crate::mesh::{CellKind, Group};

/// Keywords that mark points and cells or relate them to a geometry; skipped, as they hold no part of the mesh.
const MARKS: [&str; 17] = [
    "AngleOfCornerBound",
    "Corners",
    "EdgeOnGeometricEdge",
    "Geometry",
    "Identifier",
    "MaximalAngleOfCorner",
    "RequiredEdges",
    "RequiredQuadrilaterals",
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

/// Keywords of the curves that bamg makes meshes of; no mesher writes them.
const GEOMETRY: [&str; 5] = [
    "AngleOfCornerBound",
    "MaximalAngleOfCorner",
    "SubDomain",
    "MetricVertices",
    "hVertices",
];

/// Reads a mesh from its bytes.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut sections = Sections::new(path, bytes)?;
    let mut content = Content {
        version: Some(sections.version.to_string()),
        encoding: sections.scan.numbers.encoding(),
        ..Content::default()
    };
    let mut rows = Rows::default();
    let (mut has_vertices, mut curves, mut values) = (false, false, false);
    while let Some(word) = sections.next()? {
        curves |= GEOMETRY.contains(&word.as_str());
        values |= word.starts_with("SolAt");
        let cell = cells().find(|(name, ..)| *name == word);
        match (word.as_str(), cell) {
            ("Vertices", _) => {
                let dimension = sections.dimension;
                if dimension == 0 {
                    return Err(sections
                        .scan
                        .error("the vertices come before the dimension"));
                }
                if has_vertices {
                    return Err(sections.scan.error("the vertices appear twice"));
                }
                has_vertices = true;
                let count = sections.count("vertices", 1, dimension)?;
                rows.points(&mut sections.scan, count, dimension)?;
            }
            (_, Some((.., kind))) => {
                if !has_vertices {
                    return Err(sections.scan.error("cells come before the vertices"));
                }
                let count = sections.count("cells", kind.points() + 1, 0)?;
                rows.cells(&mut sections.scan, count, kind)?;
                if kind == CellKind::Tetrahedron10 {
                    rows.swap(SWAPPED.0, SWAPPED.1);
                }
            }
            (mark, None) if MARKS.contains(&mark) => {
                content.warnings.push(format!("{mark} was skipped"));
                sections.skip()?;
            }
            (other, None) => {
                content.unread.tell(other, format!("the section {other}"));
                sections.skip()?;
            }
        }
    }
    let scan = &sections.scan;
    if !has_vertices {
        let (what, remedy) = match values {
            true => (
                "these are values on a mesh, not a mesh",
                "give the mesh, which has the same name and the suffix .mesh or .meshb",
            ),
            false => ("the file has no vertices", "give a file with a mesh"),
        };
        return Err(scan.error_with(what, remedy));
    }
    if curves && rows.dims().all(|dim| dim < 2) {
        return Err(scan.error_with(
            "this is a geometry for bamg, the curves around a mesh, not a mesh",
            "give the mesh that bamg makes of it",
        ));
    }
    if !sections.ended {
        content
            .warnings
            .push("the file has no End: it may be cut short".into());
    }
    content.mesh = rows.finish();
    if scan.numbers == Numbers::Ascii {
        name_groups(&mut content.mesh.groups, bytes);
    }
    Ok(content)
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
