//! Writes meshes, as text or in binary.

use std::path::Path;

use super::{CELLS, FORMAT, NAME, SWAPPED};
use crate::error::Result;
use crate::field::GlobalArray;
use crate::io::labels::Labels;
use crate::io::loss::Losses;
use crate::io::out::Out;
use crate::io::{Options, refuse_unsound};
use crate::mesh::{CellKind, Mesh};

/// Writes a mesh, with two coordinates if it lies in the plane z = 0; in binary if asked to, or by the suffix `.meshb`.
pub fn write(
    path: &Path,
    mesh: &Mesh,
    _: &[GlobalArray],
    options: &Options,
) -> Result<Vec<String>> {
    refuse_unsound(path, mesh)?;
    let mut losses = Losses::default();
    let mut labels = Labels::of_cells(mesh, &mut losses);
    let held =
        |kind: CellKind| CELLS.iter().any(|(.., known)| *known == kind) || kind == CellKind::Vertex;
    let rest = mesh.cells().filter(|(_, kind, _)| !held(*kind)).count();
    losses.lose_some(rest, "cells of the kinds that it has no keyword for");
    labels.label_points(&mut losses);
    losses.note_gmsh(mesh);

    // FreeFEM and dolfinx expect a planar mesh to have two coordinates.
    let flat = mesh.dim() <= 2 && mesh.points.iter().all(|point| point[2] == 0.0);
    let dimension = if flat { 2 } else { 3 };
    let mut out = Out::to(path)?;
    let is_meshb = path
        .extension()
        .is_some_and(|suffix| suffix.eq_ignore_ascii_case("meshb"));
    if options.binary || is_meshb {
        labels.lose_names(&mut losses);
        write_binary(&mut out, &labels, mesh, dimension);
    } else {
        write_text(&mut out, &labels, mesh, dimension, &mut losses);
    }
    let warnings = losses.settle(path, FORMAT.title, options.lossy)?;
    out.save(path)?;
    Ok(warnings)
}

/// The nodes of a cell in Medit's order, counted from 1.
fn numbers(kind: CellKind, nodes: &[u32]) -> impl Iterator<Item = u32> {
    let mut nodes = nodes.to_vec();
    if kind == CellKind::Tetrahedron10 {
        nodes.swap(SWAPPED.0, SWAPPED.1);
    }
    nodes.into_iter().map(|node| node + 1)
}

fn write_text(
    out: &mut Out,
    labels: &Labels<'_>,
    mesh: &Mesh,
    dimension: usize,
    losses: &mut Losses,
) {
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
    labels.write_points(out, dimension);
    for (keyword, _, kind) in CELLS {
        let count = mesh.count(kind);
        if count > 0 {
            out.text(&format!("{keyword}\n{count}\n"));
            for (nodes, label) in labels.cells(kind) {
                numbers(kind, nodes).for_each(|node| {
                    out.int(node);
                });
                out.int(label).end();
            }
        }
    }
    out.text("End\n");
}

/// Version 3: binary64, whole numbers of 32 bits, and 64 bits for where sections are.
fn write_binary(out: &mut Out, labels: &Labels<'_>, mesh: &Mesh, dimension: usize) {
    let ints =
        |out: &mut Out, ints: &[i32]| ints.iter().for_each(|it| out.append(&it.to_le_bytes()));
    ints(out, &[1, 3, 3]);
    let mut at = 24u64;
    out.append(&at.to_le_bytes());
    ints(out, &[dimension as i32]);
    // A section: keyword, place of the next one, number of its rows.
    let mut begin = |out: &mut Out, keyword: i32, count: usize, row: usize| {
        at += 16 + (count * row) as u64;
        ints(out, &[keyword]);
        out.append(&at.to_le_bytes());
        ints(out, &[count as i32]);
    };
    begin(out, 4, mesh.points.len(), 8 * dimension + 4);
    for (point, label) in labels.points() {
        point[..dimension]
            .iter()
            .for_each(|x| out.append(&x.to_le_bytes()));
        ints(out, &[label]);
    }
    for (_, keyword, kind) in CELLS {
        let count = mesh.count(kind);
        if count > 0 {
            begin(out, keyword, count, 4 * (kind.points() + 1));
            for (nodes, label) in labels.cells(kind) {
                numbers(kind, nodes).for_each(|node| out.append(&node.to_le_bytes()));
                ints(out, &[label]);
            }
        }
    }
    ints(out, &[54]);
    out.append(&0u64.to_le_bytes());
}
