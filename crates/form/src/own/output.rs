//! A solution as a file has it: the values of all unknowns at the nodes of cells.

use faceoff_mesh::mesh::{CellBlock, CellKind, Field, Mesh, Support, Values, quadratic_edges};

use super::assemble::Assembler;
use super::dofs::sign;
use super::element::{Shape, carriers, vectors};
use super::held::place;
use crate::problem::Element;

/// The cells of a result, each with nodes of its own, and fields with the names of the unknowns.
pub fn output(assembler: &Assembler, u: &[f64]) -> (Mesh, Vec<Field>) {
    let mesh = &assembler.mesh;
    let (kind, nodes) = nodes(assembler.problem.output(), mesh.dim);
    let mut points = Vec::with_capacity(nodes.len() * mesh.cell_count());
    for cell in 0..mesh.cell_count() {
        let vertices = mesh.vertices(cell);
        points.extend(nodes.iter().map(|lambda| place(&vertices, lambda)));
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
    let table = Shape::of(space.element).table(mesh.dim, points);
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

/// The cells that hold functions of an element, and their nodes, in the order of [`CellKind`].
pub fn nodes(element: Element, dim: usize) -> (CellKind, Vec<[f64; 4]>) {
    let shape = if dim == 2 {
        faceoff_mesh::mesh::Shape::Triangle
    } else {
        faceoff_mesh::mesh::Shape::Tetrahedron
    };
    let degree = element.degree().max(1);
    let kind = CellKind::complete(shape, degree).unwrap_or(CellKind::Triangle);
    let corner = |i: usize| {
        let mut node = [0.0; 4];
        node[i] = 1.0;
        node
    };
    let mut all: Vec<[f64; 4]> = (0..=dim).map(corner).collect();
    let mix = |parts: &[(usize, f64)]| {
        let mut node = [0.0; 4];
        parts.iter().for_each(|(i, l)| node[*i] = *l);
        node
    };
    match degree {
        2 => all.extend(
            quadratic_edges(dim)
                .iter()
                .map(|[a, b]| mix(&[(*a, 0.5), (*b, 0.5)])),
        ),
        3 => {
            let (third, rest) = (1.0 / 3.0, 2.0 / 3.0);
            // Gmsh's edges have directions, and its faces an order.
            let edges: &[[usize; 2]] = match dim {
                2 => &[[0, 1], [1, 2], [2, 0]],
                _ => &[[0, 1], [1, 2], [2, 0], [3, 0], [3, 2], [3, 1]],
            };
            for [a, b] in edges {
                all.push(mix(&[(*a, rest), (*b, third)]));
                all.push(mix(&[(*a, third), (*b, rest)]));
            }
            let faces: &[[usize; 3]] = match dim {
                2 => &[[0, 1, 2]],
                _ => &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [3, 1, 2]],
            };
            all.extend(
                faces
                    .iter()
                    .map(|[a, b, c]| mix(&[(*a, third), (*b, third), (*c, third)])),
            );
        }
        _ => {}
    }
    (kind, all)
}
