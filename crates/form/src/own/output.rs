//! A solution in the form of files: the values of all unknowns at the nodes of cells.

use faceoff_mesh::io::reference_nodes;
use faceoff_mesh::mesh::{CellBlock, CellKind, Field, Mesh, Support, Values};

use super::assemble::Assembler;
use super::dofs::sign;
use super::element::{Shape, carriers, vectors};
use crate::grid::Cells;
use crate::problem::Element;

/// The cells of a result, each with separate nodes, and fields with the names of the unknowns.
pub fn output(assembler: &Assembler, u: &[f64]) -> (Mesh, Vec<Field>) {
    let mesh = &assembler.mesh;
    let (kind, nodes) = nodes(assembler.problem.output(), mesh.shape, mesh.dim);
    let mut points = Vec::with_capacity(nodes.len() * mesh.cell_count());
    for cell in 0..mesh.cell_count() {
        let vertices = mesh.vertices(cell);
        points.extend(nodes.iter().map(|lambda| mesh.place(&vertices, lambda)));
    }
    let numbers = (0..points.len() as u32).collect();
    let fields = assembler
        .problem
        .unknowns
        .iter()
        .enumerate()
        .map(|(k, unknown)| {
            let of = Values::F64(values(assembler, u, k, &nodes).into());
            Field::new(
                unknown.name.clone(),
                Support::Points,
                unknown.space.count(),
                of,
            )
        });
    let fields = fields.collect();
    let cells = Mesh {
        points: points.into(),
        blocks: vec![CellBlock::new(kind, numbers)],
        ..Mesh::default()
    };
    (cells, fields)
}

/// The values of an unknown at points of each cell in turn, component after component.
pub fn values(assembler: &Assembler, u: &[f64], unknown: usize, points: &[[f64; 4]]) -> Vec<f64> {
    let Assembler {
        problem,
        mesh,
        dofs,
        ..
    } = assembler;
    let space = problem.unknowns[unknown].space;
    let table = Shape::of(space.element, mesh.shape).table(mesh.dim, points);
    let size = space.count();
    let mut all = Vec::with_capacity(mesh.cell_count() * points.len() * size);
    let mut local = vec![0.0; table.count * size];
    for cell in 0..mesh.cell_count() {
        let nodes = dofs.of_cell(unknown, cell);
        if space.element.is_vector() {
            local.fill(0.0);
            let geometry = mesh.geometry(cell);
            for (carrier, node) in carriers(space.element, mesh.dim).into_iter().zip(nodes) {
                let value = u[dofs.first[*node as usize] as usize] * sign(mesh, cell, carrier);
                for (j, vector) in vectors(space.element, &geometry, carrier)
                    .iter()
                    .enumerate()
                    .take(table.count)
                {
                    for c in 0..size {
                        local[j * size + c] += value * vector[c];
                    }
                }
            }
        } else {
            for (i, node) in nodes.iter().enumerate() {
                local[i * size..(i + 1) * size].copy_from_slice(&u[dofs.of_node(*node)]);
            }
        }
        for q in 0..points.len() {
            let phi = table.row(0, q);
            all.extend((0..size).map(|c| -> f64 {
                phi.iter()
                    .enumerate()
                    .map(|(i, p)| p * local[i * size + c])
                    .sum()
            }));
        }
    }
    all
}

/// The cells that represent functions of an element, and the positions of their nodes, in the order of [`CellKind`].
pub fn nodes(element: Element, cells: Cells, dim: usize) -> (CellKind, Vec<[f64; 4]>) {
    let linear = cells.kinds(dim)[0];
    let kind = CellKind::complete(cells.shape(dim), element.degree().max(1)).unwrap_or(linear);
    let nodes = reference_nodes(kind).unwrap_or_default();
    let place = |[x, y, z]: [f64; 3]| [1.0 - (x + y + z), x, y, z];
    (kind, nodes.into_iter().map(place).collect())
}
