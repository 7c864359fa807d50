//! A finite element space: an element's dofs numbered on a mesh.

use std::sync::Arc;

use super::{DofEntities, Element, MAX_DOFS};
use faceoff_mesh::mesh::{CellGeometry, Triangulation, local_edges};
use nalgebra::Vector3;

/// V_h before boundary conditions. Copies share the numbering.
#[derive(Clone)]
pub struct Space<'a> {
    /// The mesh.
    pub mesh: &'a Triangulation,
    /// The same on every cell.
    pub element: &'static dyn Element,
    numbering: Numbering<'a>,
    /// Dofs on vertices, which come first.
    vertex_dofs: usize,
    /// Dofs on one cell.
    pub local_dofs: usize,
    /// Number of dofs.
    pub dofs: usize,
    /// Barycentric coordinates of the local nodes.
    pub nodes: Vec<[f64; 4]>,
}

/// Dofs of the cells, `local_dofs` each: vertices, then edges, then faces.
#[derive(Clone)]
enum Numbering<'a> {
    /// The mesh's own.
    Mesh(&'a [u32]),
    /// Vertices and edges, and the vertices of each edge.
    Own(Arc<[u32]>, Arc<[[u32; 2]]>),
}

impl<'a> Space<'a> {
    /// The dofs of an element on a mesh.
    pub fn new(mesh: &'a Triangulation, element: &'static dyn Element) -> Self {
        let on = element.on();
        let nodes = nodes(element, mesh.dim);
        let (numbering, dofs) = match (on.vertices, on.edges, on.faces) {
            (true, false, false) => (Numbering::Mesh(mesh.all_cells()), mesh.points.len()),
            (false, false, true) => (Numbering::Mesh(mesh.all_cell_faces()), mesh.face_count()),
            _ => number(mesh, on),
        };
        Space {
            mesh,
            element,
            numbering,
            vertex_dofs: if on.vertices { mesh.points.len() } else { 0 },
            local_dofs: nodes.len(),
            dofs,
            nodes,
        }
    }

    /// Dofs of a cell in the order of the local nodes.
    pub fn cell_dofs(&self, cell: usize) -> &[u32] {
        self.dofs_of_cells(cell..cell + 1)
    }

    /// The dofs of cells that follow one another.
    pub fn dofs_of_cells(&self, cells: std::ops::Range<usize>) -> &[u32] {
        let all = match &self.numbering {
            Numbering::Mesh(all) => all,
            Numbering::Own(all, _) => &all[..],
        };
        &all[self.local_dofs * cells.start..self.local_dofs * cells.end]
    }

    /// Where a dof is the value of the function.
    pub fn point(&self, dof: usize) -> [f64; 3] {
        let mut first = self.vertex_dofs;
        if dof < first {
            return self.mesh.points[dof];
        }
        if let Numbering::Own(_, edges) = &self.numbering {
            if let Some(&[a, b]) = edges.get(dof - first) {
                let (p, q) = (self.mesh.points[a as usize], self.mesh.points[b as usize]);
                return std::array::from_fn(|k| 0.5 * (p[k] + q[k]));
            }
            first += edges.len();
        }
        self.mesh.face_midpoint(dof - first)
    }

    /// The vertices of what carries a dof: a vertex, an edge or a face.
    pub fn carrier(&self, dof: usize) -> Vec<u32> {
        self.vertex_values(dof).map(|(vertex, _)| vertex).collect()
    }

    /// The values at a dof of the P1 functions that do not vanish there: it is the midpoint of a vertex, an edge or a face.
    #[inline]
    pub(crate) fn vertex_values(&self, dof: usize) -> impl Iterator<Item = (u32, f64)> + use<> {
        let (mut vertices, mut count) = ([dof as u32; 3], 1);
        if let Some(beyond) = dof.checked_sub(self.vertex_dofs) {
            let edges = match &self.numbering {
                Numbering::Own(_, edges) => &edges[..],
                Numbering::Mesh(_) => &[],
            };
            let carrier = match edges.get(beyond) {
                Some(edge) => edge,
                None => self.mesh.face(beyond - edges.len()),
            };
            count = carrier.len();
            vertices[..count].copy_from_slice(carrier);
        }
        let value = 1.0 / count as f64;
        vertices.into_iter().take(count).map(move |k| (k, value))
    }

    /// The points of all dofs.
    pub fn points(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        (0..self.dofs).map(|dof| self.point(dof))
    }

    /// Dofs whose nodes lie on a face of a cell.
    pub fn face_dofs(&self, cell: usize, local_face: usize) -> impl Iterator<Item = u32> + '_ {
        self.cell_dofs(cell)
            .iter()
            .zip(&self.nodes)
            .filter(move |(_, node)| node[local_face] == 0.0)
            .map(|(&dof, _)| dof)
    }

    /// u at the dofs of one cell.
    pub fn local(&self, cell: usize, u: &[f64]) -> [f64; MAX_DOFS] {
        let mut local = [0.0; MAX_DOFS];
        for (value, &dof) in local.iter_mut().zip(self.cell_dofs(cell)) {
            *value = u[dof as usize];
        }
        local
    }

    /// Σ_i u_i φ_i at a point, from u at the dofs of the cell.
    pub fn value(&self, lambda: &[f64; 4], local: &[f64; MAX_DOFS]) -> f64 {
        let phi = self.element.values(self.mesh.dim, lambda);
        phi.iter().zip(local).map(|(phi, u)| phi * u).sum()
    }

    /// Σ_i u_i ∇φ_i at a point, from u at the dofs of the cell.
    pub fn slope(
        &self,
        geometry: &CellGeometry,
        lambda: &[f64; 4],
        local: &[f64; MAX_DOFS],
    ) -> Vector3<f64> {
        let derivatives = self.element.derivatives(geometry.dim, lambda);
        let rows = || derivatives.iter().zip(local).take(self.local_dofs);
        (0..=geometry.dim).fold(Vector3::zeros(), |slope, j| {
            slope + rows().map(|(row, u)| row[j] * u).sum::<f64>() * geometry.gradients[j]
        })
    }

    /// ∇φ_i at a point: Σ_j ∂φ_i/∂λ_j ∇λ_j.
    pub fn gradients(
        &self,
        geometry: &CellGeometry,
        lambda: &[f64; 4],
    ) -> [Vector3<f64>; MAX_DOFS] {
        let derivatives = self.element.derivatives(geometry.dim, lambda);
        let mut gradients = [Vector3::zeros(); MAX_DOFS];
        for (gradient, row) in gradients.iter_mut().zip(&derivatives).take(self.local_dofs) {
            for j in 0..=geometry.dim {
                *gradient += row[j] * geometry.gradients[j];
            }
        }
        gradients
    }
}

/// Numbers the entities that the mesh does not number.
fn number<'a>(mesh: &Triangulation, on: DofEntities) -> (Numbering<'a>, usize) {
    let (edges, cell_edges) = if on.edges {
        mesh.edges()
    } else {
        (Vec::new(), Vec::new())
    };
    let per_cell = local_edges(mesh.dim).len();
    let first_edge = if on.vertices { mesh.points.len() } else { 0 };
    let first_face = first_edge + edges.len();
    let dofs = first_face + if on.faces { mesh.face_count() } else { 0 };
    let mut all = Vec::new();
    for cell in 0..mesh.cell_count() {
        if on.vertices {
            all.extend_from_slice(mesh.cell(cell));
        }
        if on.edges {
            let numbers = &cell_edges[per_cell * cell..per_cell * (cell + 1)];
            all.extend(numbers.iter().map(|&e| e + first_edge as u32));
        }
        if on.faces {
            let numbers = mesh.cell_faces(cell).iter();
            all.extend(numbers.map(|&f| f + first_face as u32));
        }
    }
    (Numbering::Own(all.into(), edges.into()), dofs)
}

/// Barycentric coordinates of the local nodes: vertices, edge midpoints, face centroids.
pub(super) fn nodes(element: &dyn Element, dim: usize) -> Vec<[f64; 4]> {
    let on = element.on();
    let mut nodes = Vec::new();
    if on.vertices {
        for i in 0..=dim {
            let mut node = [0.0; 4];
            node[i] = 1.0;
            nodes.push(node);
        }
    }
    if on.edges {
        for &[a, b] in local_edges(dim) {
            let mut node = [0.0; 4];
            node[a] = 0.5;
            node[b] = 0.5;
            nodes.push(node);
        }
    }
    if on.faces {
        for i in 0..=dim {
            let mut node = [0.0; 4];
            node[..=dim].fill(1.0 / dim as f64);
            node[i] = 0.0;
            nodes.push(node);
        }
    }
    nodes
}
