//! FreeFEM's own two-dimensional `.msh`: numbers only, without a keyword to recognise it by.
//!
//! Numbers of vertices, triangles and boundary edges; then x, y and label of each vertex; three vertices and
//! the region of each triangle; two vertices and the label of each edge. Label 0 stands for none.

use std::path::Path;

use super::labels::{Labels, Rows};
use super::out::Out;
use super::scan::Scan;
use super::{Content, Job, Native, Read};
use crate::error::Result;
use crate::mesh::CellKind;

pub static FORMAT: Native = Native {
    title: "FreeFEM's .msh",
    names: &["freefem"],
    // Most files that end in .msh are Gmsh's.
    suffixes: &[],
    has_binary: false,
    holds_whole: false,
    recognises,
    read: Read::Once(read),
    write,
};

/// Whether bytes look like this format: a line of three numbers, a line of three numbers, and counts that fit.
fn recognises(bytes: &[u8]) -> bool {
    // A binary file may have no end of a line.
    let head = bytes.get(..1 << 12).unwrap_or(bytes);
    let mut scan = Scan::new(Path::new(""), head);
    scan.skip_blanks();
    // AVS' UCD begins with five numbers.
    let words = scan.clone().line().split(u8::is_ascii_whitespace);
    if words.filter(|word| !word.is_empty()).count() != 3 {
        return false;
    }
    let counts = (scan.u64(), scan.u64(), scan.u64());
    let (Ok(points), Ok(triangles), Ok(edges)) = counts else {
        return false;
    };
    let rows = points
        .checked_add(triangles)
        .and_then(|n| n.checked_add(edges));
    let plausible = points >= 3 && rows.is_some_and(|rows| rows <= bytes.len() as u64);
    plausible && scan.f64().is_ok() && scan.f64().is_ok() && scan.i32().is_ok()
}

/// Reads a mesh from its bytes.
fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut scan = Scan::new(path, bytes);
    scan.section = "head".into();
    let (points, triangles, edges) = (scan.u64()?, scan.u64()?, scan.u64()?);
    let points = scan.believe(points, "vertices", 6)?;
    let triangles = scan.believe(triangles, "triangles", 8)?;
    let edges = scan.believe(edges, "edges", 6)?;

    let mut rows = Rows::default();
    scan.section = "vertices".into();
    rows.points(&mut scan, points, 2)?;
    scan.section = "triangles".into();
    rows.cells(&mut scan, triangles, CellKind::Triangle)?;
    scan.section = "edges".into();
    rows.cells(&mut scan, edges, CellKind::Line)?;
    if scan.peek().is_some() {
        scan.section = "end".into();
        return Err(scan.error(format!(
            "expected the end of the file, found {}",
            scan.shown()
        )));
    }
    Ok(Content {
        mesh: rows.finish(),
        ..Content::default()
    })
}

/// Writes a planar mesh of triangles and lines; cells are written triangles first.
fn write(job: Job<'_>) -> Result<Vec<String>> {
    let Job {
        path,
        mesh,
        mut losses,
        ..
    } = job;
    let mut labels = Labels::of_cells(mesh, &mut losses);
    labels.lose_names(&mut losses);
    let rest = mesh.cells().filter(|(_, kind, _)| {
        !matches!(kind, CellKind::Triangle | CellKind::Line | CellKind::Vertex)
    });
    losses.lose_some(
        rest.count(),
        "cells other than triangles, lines and vertices",
    );
    let raised = mesh.points.iter().filter(|point| point[2] != 0.0).count();
    losses.lose_some(raised, "points with a third coordinate");
    let fields = labels.label_points(&mut losses);
    losses.lose_fields(fields);
    losses.note_gmsh(mesh);

    let mut out = Out::to(path)?;
    out.int(mesh.points.len())
        .int(mesh.count(CellKind::Triangle))
        .int(mesh.count(CellKind::Line))
        .end();
    labels.write_points(&mut out, 2);
    labels.write_cells(&mut out, CellKind::Triangle);
    labels.write_cells(&mut out, CellKind::Line);
    losses.settle(path, || out.save(path))
}
