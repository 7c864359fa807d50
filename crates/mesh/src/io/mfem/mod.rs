//! MFEM's own mesh: conforming with straight or curved cells, and non-conforming (NC) by its leaves. Read, not written.
//!
//! Attributes are groups, and named sets of attributes too. A grid function of nodes of order 2 makes cells of second
//! order; of higher orders the corners are read. NURBS have no cells before they are cut, and are refused.

mod broken;
mod build;
mod inline;
mod nodes;
mod sections;

use std::collections::HashMap;
use std::path::Path;

use super::scan::Scan;
use super::{Content, Native, Read, read_only};
use crate::error::Result;
use crate::mesh::CellKind;
use nodes::Nodes;

pub static FORMAT: Native = Native {
    title: "MFEM's mesh",
    names: &["mfem"],
    suffixes: &[],
    has_binary: false,
    holds_whole: false,
    recognises: |bytes| bytes.trim_ascii_start().starts_with(b"MFEM "),
    read: Read::Once(read),
    write: read_only,
};

/// An element: its attribute, its linear and quadratic kinds, its vertices.
struct Element {
    attribute: i64,
    kinds: (CellKind, CellKind),
    vertices: Vec<u32>,
}

/// A named set of attributes.
type Set = (String, Vec<i64>);

/// The contents of the file.
#[derive(Default)]
struct Raw {
    elements: Vec<Element>,
    boundary: Vec<Element>,
    /// Coordinates of the vertices.
    points: Vec<[f64; 3]>,
    /// The vertices in the middle of two others, which non-conforming meshes have.
    parents: HashMap<u32, [u32; 2]>,
    /// Whether a version before NC has vertices in the middle of edges, where dofs are numbered in another way.
    hanging: bool,
    nodes: Option<Nodes>,
    sets: Vec<Set>,
    boundary_sets: Vec<Set>,
}

/// Reads a mesh from its bytes.
fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut scan = Scan::with_comments(path, bytes, b'#');
    let mut title = scan.line();
    while title.trim_ascii().is_empty() && scan.peek().is_some() {
        title = scan.line();
    }
    let title = String::from_utf8_lossy(title.trim_ascii()).into_owned();
    let (kind, version) = title.rsplit_once(" v").unwrap_or((&title, ""));
    let mut content = Content {
        version: Some(version.to_owned()),
        ..Content::default()
    };
    let non_conforming = match kind {
        "MFEM mesh" => false,
        "MFEM NC mesh" => true,
        "MFEM INLINE mesh" => {
            content.mesh = inline::read(&mut scan)?;
            return Ok(content);
        }
        _ => {
            return Err(scan.error_with(
                format!("{kind:?} has no cells before its patches are cut"),
                "save it from MFEM as a mesh with nodes of order 2",
            ));
        }
    };
    let raw = Raw::read(&mut scan, non_conforming, &mut content)?;
    content.mesh = raw.build(&scan, &mut content.unread)?;
    Ok(content)
}
