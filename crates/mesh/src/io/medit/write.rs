//! Writes meshes, as text or in binary.

use super::binary::Binary;
use super::{NAME, SWAPPED, cells, sol};
use crate::error::Result;
use crate::io::Job;
use crate::io::labels::Labels;
use crate::io::loss::Losses;
use crate::io::out::Out;
use crate::io::scalar::Scalar;
use crate::mesh::{CellKind, Mesh};

/// Writes a mesh, with two coordinates if it lies in the plane z = 0; in binary if asked to, or by the suffix `.meshb`. Fields
/// are in a separate file next to it.
pub fn write(job: Job<'_>) -> Result<Vec<String>> {
    let Job {
        path,
        mesh,
        options,
        mut losses,
        ..
    } = job;
    let mut labels = Labels::of_cells(mesh, &mut losses);
    let held =
        |kind: CellKind| cells().any(|(.., known)| known == kind) || kind == CellKind::Vertex;
    let rest = mesh.cells().filter(|(_, kind, _)| !held(*kind)).count();
    losses.lose_some(rest, "cells of the kinds that it has no keyword for");
    let fields = labels.label_points(&mut losses);
    losses.note_gmsh(mesh);

    // FreeFEM and dolfinx expect a planar mesh to have two coordinates.
    let flat = mesh.is_flat();
    let dimension = if flat { 2 } else { 3 };
    let mut out = Out::to(path)?;
    let is_meshb = path
        .extension()
        .is_some_and(|suffix| suffix.eq_ignore_ascii_case("meshb"));
    let is_binary = options.binary || is_meshb;
    let values = sol::write(path, mesh, dimension, &fields, is_binary, &mut losses)?;
    if is_binary {
        labels.lose_names(&mut losses);
        write_binary(&mut out, &labels, mesh, dimension);
    } else {
        write_text(&mut out, &labels, mesh, dimension, &mut losses);
    }
    losses.settle(path, || {
        if let Some((path, values)) = values {
            values.save(&path)?;
        }
        out.save(path)
    })
}

/// Where each node of a cell in Medit's order is in ours.
fn order(kind: CellKind) -> Vec<usize> {
    let mut order: Vec<usize> = (0..kind.points()).collect();
    if kind == CellKind::Tetrahedron10 {
        order.swap(SWAPPED.0, SWAPPED.1);
    }
    order
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
    for (keyword, _, kind) in cells() {
        let count = mesh.count(kind);
        if count > 0 {
            out.text(&format!("{keyword}\n{count}\n"));
            let order = order(kind);
            for (nodes, label) in labels.cells(kind) {
                order.iter().for_each(|&place| {
                    out.int(nodes[place] + 1);
                });
                out.int(label).end();
            }
        }
    }
    out.text("End\n");
}

fn write_binary(out: &mut Out, labels: &Labels<'_>, mesh: &Mesh, dimension: usize) {
    let mut binary = Binary::new(out, dimension);
    let points = mesh.points.len();
    let size = 8 * dimension + 4;
    binary.begin(4, points, points * size);
    binary.out.rows(points, size, |first, bytes| {
        let rows = bytes.chunks_exact_mut(size).zip(labels.points(first));
        for (row, (point, label)) in rows {
            let (reals, end) = row.split_at_mut(8 * dimension);
            f64::put_le(point, reals);
            i32::put_le(&[label], end);
        }
    });
    for (_, keyword, kind) in cells() {
        let count = mesh.count(kind);
        if count > 0 {
            let (width, order) = (kind.points(), order(kind));
            let size = 4 * (width + 1);
            binary.begin(keyword, count, count * size);
            for (start, block) in labels.blocks(kind) {
                binary.out.rows(block.len(), size, |first, bytes| {
                    let cells = block.nodes[first * width..].chunks_exact(width);
                    let rows = bytes.chunks_exact_mut(size).zip(cells);
                    for ((row, nodes), label) in rows.zip(labels.from(start + first as u32)) {
                        let (end, words) = row.as_chunks_mut().0.split_last_mut().expect("a label");
                        *end = label.to_le_bytes();
                        let each = words.iter_mut().zip(&order);
                        each.for_each(|(to, &place)| *to = (nodes[place] + 1).to_le_bytes());
                    }
                });
            }
        }
    }
    binary.end();
}
