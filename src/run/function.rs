//! A function of a finite element space on cells with separate nodes, so that a file or a viewer represents jumps.

use faceoff_fem::contact::Problem;
use faceoff_mesh::mesh::{CellBlock, CellKind, Field, Mesh, Support, Values, quadratic_edges};

/// u as a field of this name on the points of a mesh with separate nodes per cell.
pub fn broken(problem: &Problem, name: &str, u: &[f64]) -> (Mesh, Field) {
    let values = Values::F64(at_nodes(problem, u).into());
    (
        broken_mesh(problem),
        Field::new(name.to_owned(), Support::Points, 1, values),
    )
}

/// The cells with separate nodes.
pub fn broken_mesh(problem: &Problem) -> Mesh {
    let source = problem.space.mesh;
    let (kind, places) = nodes(problem);
    let at_cell = |cell| {
        let vertices = source.vertices(cell);
        places
            .iter()
            .map(move |lambda| at_vertices(lambda, &vertices))
    };
    let points: Vec<_> = (0..source.cell_count()).flat_map(at_cell).collect();
    let nodes = (0..points.len() as u32).collect();
    block(points, kind, nodes)
}

/// u at the nodes of each cell in turn.
pub fn at_nodes(problem: &Problem, u: &[f64]) -> Vec<f64> {
    let space = &problem.space;
    let (_, places) = nodes(problem);
    let mut values = Vec::with_capacity(space.mesh.cell_count() * places.len());
    for cell in 0..space.mesh.cell_count() {
        let local = space.local(cell, u);
        values.extend(places.iter().map(|lambda| -> f64 {
            let phi = space.element.values(space.mesh.dim, lambda);
            phi.iter().zip(&local).map(|(p, u)| p * u).sum()
        }));
    }
    values
}

/// The cells that represent a function of the problem's space, quadratic ones for P2, and their nodes in barycentric coordinates λ.
pub fn nodes(problem: &Problem) -> (CellKind, Vec<[f64; 4]>) {
    let dim = problem.space.mesh.dim;
    let mut nodes = vec![[0.0; 4]; dim + 1];
    (0..=dim).for_each(|corner| nodes[corner][corner] = 1.0);
    let is_quadratic = problem.space.element.degree() == 2;
    if is_quadratic {
        nodes.extend(quadratic_edges(dim).iter().map(|&[a, b]| {
            let mut middle = [0.0; 4];
            (middle[a], middle[b]) = (0.5, 0.5);
            middle
        }));
    }
    let kind = match (dim, is_quadratic) {
        (2, false) => CellKind::Triangle,
        (2, true) => CellKind::Triangle6,
        (_, false) => CellKind::Tetrahedron,
        (_, true) => CellKind::Tetrahedron10,
    };
    (kind, nodes)
}

/// Σ λ_i x_i; for a vertex exactly its coordinates.
pub fn at_vertices<const N: usize>(lambda: &[f64; 4], of_vertices: &[[f64; N]; 4]) -> [f64; N] {
    let mut sum = [0.0; N];
    for (lambda, of_vertex) in lambda.iter().zip(of_vertices).filter(|(l, _)| **l != 0.0) {
        sum.iter_mut()
            .zip(of_vertex)
            .for_each(|(sum, x)| *sum += lambda * x);
    }
    sum
}

/// A mesh of one block of cells.
pub fn block(points: Vec<[f64; 3]>, kind: CellKind, nodes: Vec<u32>) -> Mesh {
    Mesh {
        points: points.into(),
        blocks: vec![CellBlock::new(kind, nodes)],
        ..Mesh::default()
    }
}
