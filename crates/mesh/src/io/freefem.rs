//! FreeFEM's own two-dimensional `.msh`: numbers only, without a keyword to recognise it by.
//!
//! Numbers of vertices, triangles and boundary edges; then x, y and label of each vertex; three vertices and
//! the region of each triangle; two vertices and the label of each edge. Label 0 stands for none.

use std::path::Path;

use super::Content;
use super::labels::{CellLabels, POINT_LABEL, group_cells, point_labels, point_labels_of};
use super::loss::Losses;
use super::out::Out;
use super::scan::Scan;
use crate::error::{Error, Place, Result};
use crate::mesh::{CellBlock, CellKind, Field, Mesh, Support, Values};

/// Whether bytes look like this format: a line of three numbers, a line of three numbers, and counts that fit.
pub fn recognises(bytes: &[u8]) -> bool {
    let mut scan = Scan::new(Path::new(""), bytes);
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
///
/// # Errors
/// Any violation of the format, with its line.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut scan = Scan::new(path, bytes);
    scan.section = "head".into();
    let (points, triangles, edges) = (scan.u64()?, scan.u64()?, scan.u64()?);
    let points = scan.believe(points, "vertices", 6)?;
    let triangles = scan.believe(triangles, "triangles", 8)?;
    let edges = scan.believe(edges, "edges", 6)?;

    let mut mesh = Mesh::default();
    let mut labels = Vec::with_capacity(points);
    scan.section = "vertices".into();
    mesh.points.reserve_exact(points);
    for _ in 0..points {
        mesh.points.push([scan.f64()?, scan.f64()?, 0.0]);
        labels.push(scan.i32()?);
    }
    scan.section = "triangles".into();
    let triangles = cells(&mut scan, CellKind::Triangle, triangles, points)?;
    scan.section = "edges".into();
    let edges = cells(&mut scan, CellKind::Line, edges, points)?;
    if scan.peek().is_some() {
        scan.section = "end".into();
        return Err(scan.error(format!(
            "expected the end of the file, found {}",
            scan.shown()
        )));
    }
    mesh.groups = group_cells(&[(2, &triangles.1), (1, &edges.1)]);
    mesh.blocks.extend(
        [triangles.0, edges.0]
            .into_iter()
            .filter(|block| !block.is_empty()),
    );
    if labels.iter().any(|&label| label != 0) {
        mesh.fields.push(Field::new(
            POINT_LABEL,
            Support::Points,
            1,
            Values::I32(labels),
        ));
    }
    Ok(Content {
        mesh,
        format: "freefem".into(),
        encoding: "ascii".into(),
        ..Content::default()
    })
}

fn cells(
    scan: &mut Scan<'_>,
    kind: CellKind,
    count: usize,
    points: usize,
) -> Result<(CellBlock, Vec<i32>)> {
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

/// Writes a planar mesh of triangles and lines; cells are written triangles first.
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
    let point_labels = point_labels(mesh, &labels, &mut losses);
    losses.note_gmsh(mesh);

    let mut out = Out::to(path)?;
    out.int(mesh.points.len())
        .int(mesh.count(CellKind::Triangle))
        .int(mesh.count(CellKind::Line))
        .end();
    for (index, point) in mesh.points.iter().enumerate() {
        out.float(point[0])
            .float(point[1])
            .int(point_labels_of(&point_labels, index))
            .end();
    }
    for wanted in [CellKind::Triangle, CellKind::Line] {
        for (cell, _, nodes) in mesh.cells().filter(|(_, kind, _)| *kind == wanted) {
            nodes.iter().for_each(|&node| {
                out.int(node + 1);
            });
            out.int(labels.of(cell)).end();
        }
    }
    let warnings = losses.settle(path, "FreeFEM's .msh", lossy)?;
    out.save(path)?;
    Ok(warnings)
}
