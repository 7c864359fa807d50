//! Values at the nodes of cells: the mesh, and the first of P1, CR and P2 that contains the function.

use std::collections::HashMap;

use super::field::Carried;
use super::{Foreign, NEAR, NONE, Reader, is_rounded, largest, near};
use faceoff_fem::element::{CR, Element, P1, P2, Space};
use faceoff_judge::{first_at_place, partners};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::{
    CellBlock, CellKind, Mesh, Shape, Triangulation, local_edges, quadratic_edges,
};

/// A function on the cells of a mesh, with separate values in each cell.
struct OnCells {
    /// 1 or 2
    degree: usize,
    /// Vertices of each cell, `dim + 1`, in the numbering of the mesh and in the order of the file.
    vertices: Vec<u32>,
    /// At the nodes of each cell: the vertices, and for degree 2 the midpoints of [`quadratic_edges`].
    values: Vec<f64>,
    /// The mesh's number of each cell.
    cells: Vec<u32>,
}

/// The place and size of the largest jump between neighbours.
#[derive(Default)]
struct Jump {
    size: f64,
    dof: usize,
}
impl Reader<'_> {
    /// Values at the nodes of the cells of a mesh.
    pub(super) fn cells(&self, given: Option<Triangulation>) -> Result<Foreign> {
        let (held, dim) = (self.held, self.dim);
        let degree = self.degree()?;
        let all: [Carried; 2] = [("points", &held.on_points), ("corners", &held.on_corners)];
        let (on, field) = self.field(&all, &["u"])?;
        let (mut nodes, mut values, mut corner) = (Vec::new(), Vec::new(), 0);
        for (cell, of) in held.cell_dimensions().into_iter().enumerate() {
            cancel::check()?;
            for point in held.cell(cell) {
                if usize::from(of) == dim {
                    nodes.push(point);
                    values.push(match on {
                        "points" => self.row(field, point, "point")?,
                        _ => self.row(field, corner, "corner")?,
                    });
                }
                corner += 1;
            }
        }
        let per_cell = nodes_of(dim, degree);
        if degree == 2 {
            self.refuse_curved(&nodes, per_cell)?;
        }
        let (points, number) = self.vertices(&nodes, per_cell)?;
        let corners = nodes.chunks_exact(per_cell).flat_map(|c| &c[..=dim]);
        let mut vertices: Vec<u32> = corners.map(|&p| number[p as usize]).collect();
        let (mesh, cells) = match given {
            None => {
                let mesh = self.own_mesh(points, &number)?;
                let cells = (0..mesh.cell_count() as u32).collect();
                (mesh, cells)
            }
            Some(mesh) => {
                let cells = self.cells_among(&mesh, &points, &mut vertices)?;
                (mesh, cells)
            }
        };
        let function = OnCells {
            degree,
            vertices,
            values,
            cells,
        };
        let (element, u) = self.function(&mesh, &function, &field.name)?;
        Ok(self.found(mesh, element, u, (on, field)))
    }

    /// The degree of functions on the cells, from their nodes.
    fn degree(&self) -> Result<usize> {
        let mut degree = None;
        let kinds = self.held.kinds.iter();
        for (kind, count) in kinds.filter(|(k, n)| usize::from(k.dim()) == self.dim && *n > 0) {
            let of = match kind {
                CellKind::Triangle | CellKind::Tetrahedron => 1,
                CellKind::Triangle6 | CellKind::Tetrahedron10 => 2,
                _ => {
                    return Err(self.refuse(
                        format!("it has {count} cells of type {kind}, and P1, P2 and CR are of simplices with nodes at vertices, or at vertices and midpoints of edges"),
                        "write such cells",
                    ));
                }
            };
            if degree.replace(of).is_some_and(|other| other != of) {
                return Err(self.refuse(
                    "some of its cells are linear, others quadratic".into(),
                    "write cells of one kind",
                ));
            }
        }
        Ok(degree.unwrap_or(1))
    }

    /// Quadratic cells whose edges are not straight, or not halved by their nodes, are not accepted for P2.
    fn refuse_curved(&self, nodes: &[u32], per_cell: usize) -> Result<()> {
        let at = |point: u32| self.held.points[point as usize];
        let near = near(&self.held.points);
        for (cell, nodes) in nodes.chunks_exact(per_cell).enumerate() {
            cancel::check()?;
            let middles = &nodes[self.dim + 1..];
            for (&[a, b], &middle) in quadratic_edges(self.dim).iter().zip(middles) {
                let (p, q, m) = (at(nodes[a]), at(nodes[b]), at(middle));
                if (0..3).any(|k| (0.5 * (p[k] + q[k]) - m[k]).abs() > near) {
                    return Err(self.refuse(
                        format!("its cell {cell} is curved: the node at {m:?} is not the midpoint of its edge"),
                        "mesh the domain with straight edges",
                    ));
                }
            }
        }
        Ok(())
    }

    /// The vertices of the cells, and the number of each point among them. If every cell has separate points, as in
    /// discontinuous output, those at one position are one vertex.
    fn vertices(&self, nodes: &[u32], per_cell: usize) -> Result<(Vec<[f64; 3]>, Vec<u32>)> {
        let points = &self.held.points;
        let mut seen = vec![false; points.len()];
        let is_once = |&node: &u32| !std::mem::replace(&mut seen[node as usize], true);
        let is_broken = nodes.len() > per_cell && nodes.iter().all(is_once);
        cancel::check()?;
        let first = match is_broken {
            // Each cell may have rounded its points differently.
            true => first_at_place(points)?,
            false => (0..points.len() as u32).collect(),
        };
        let mut number = vec![NONE; points.len()];
        for &corner in nodes.chunks_exact(per_cell).flat_map(|c| &c[..=self.dim]) {
            number[first[corner as usize] as usize] = 0;
        }
        let mut vertices = Vec::new();
        for (number, point) in number.iter_mut().zip(points).filter(|(n, _)| **n == 0) {
            *number = vertices.len() as u32;
            vertices.push(*point);
        }
        let number = first.iter().map(|&first| number[first as usize]).collect();
        Ok((vertices, number))
    }

    /// The mesh of the file: its cells, and those of its boundary that are in groups.
    fn own_mesh(&self, points: Vec<[f64; 3]>, number: &[u32]) -> Result<Triangulation> {
        let (held, dim) = (self.held, self.dim);
        let has_groups = held.groups.iter().any(|g| usize::from(g.dim) + 1 == dim);
        let mut blocks = Vec::new();
        let mut cell = 0;
        for &(kind, count) in &held.kinds {
            let cells = cell..cell + count;
            cell += count;
            let shape = kind.shape();
            // Without groups the other cells contain no information; with groups the numbers of these count them.
            if usize::from(shape.dim()) != dim && !has_groups {
                continue;
            }
            let linear = match shape {
                Shape::Vertex => CellKind::Vertex,
                Shape::Line => CellKind::Line,
                Shape::Triangle => CellKind::Triangle,
                Shape::Tetrahedron => CellKind::Tetrahedron,
                _ => kind,
            };
            let corners = cells.flat_map(|c| held.cell(c).take(linear.points()));
            let nodes = corners.map(|p| number[p as usize]).collect();
            blocks.push(CellBlock::new(linear, nodes));
        }
        let mesh = Mesh {
            points: points.into(),
            blocks,
            groups: match has_groups {
                true => held.groups.clone(),
                false => Vec::new(),
            },
            ..Mesh::default()
        };
        Triangulation::new(&held.source, &mesh)
    }

    /// The number that another mesh has for each cell; the cells' vertices are renumbered to those of that mesh.
    fn cells_among(
        &self,
        mesh: &Triangulation,
        points: &[[f64; 3]],
        vertices: &mut [u32],
    ) -> Result<Vec<u32>> {
        let counts = |cells, points| format!("{cells} cells with {points} vertices");
        let corners = self.dim + 1;
        let other = "give the mesh that the result was computed on";
        let (cells, own) = (vertices.len() / corners, mesh.points.len());
        if cells != mesh.cell_count() || points.len() != own {
            let (it, has) = (counts(cells, points.len()), counts(mesh.cell_count(), own));
            let what = format!("it has {it}, and mesh {} {has}", mesh.name);
            return Err(self.refuse(what, other));
        }
        let partner = partners(points, &mesh.points)?;
        for vertex in vertices.iter_mut() {
            *vertex = partner[*vertex as usize].ok_or_else(|| {
                let at = points[*vertex as usize];
                let what = format!("mesh {} has no single vertex at {at:?}", mesh.name);
                self.refuse(what, other)
            })?;
        }
        let key = |cell: &[u32]| {
            let mut key = [NONE; 4];
            key[..corners].copy_from_slice(cell);
            key.sort_unstable();
            key
        };
        let of_mesh = mesh.all_cells().chunks_exact(corners).map(key);
        let known: HashMap<[u32; 4], u32> = of_mesh.zip(0..).collect();
        let found = vertices.chunks_exact(corners).map(|cell| {
            cancel::check()?;
            known.get(&key(cell)).copied().ok_or_else(|| {
                let what = format!("its cell {cell:?} is not a cell of mesh {}", mesh.name);
                self.refuse(what, other)
            })
        });
        found.collect()
    }

    /// The first space that contains a function on cells.
    fn function(
        &self,
        mesh: &Triangulation,
        function: &OnCells,
        name: &str,
    ) -> Result<(&'static dyn Element, Vec<f64>)> {
        let of_degree: &[&'static dyn Element] = match function.degree {
            1 => &[&P1, &CR],
            _ => &[&P2],
        };
        let asked = self.options.element.as_slice();
        if let Some(element) = asked.iter().find(|e| e.degree() < function.degree) {
            return Err(self.refuse(
                format!(
                    "`{name}` is of degree 2 on its cells, and no function of {}",
                    element.name()
                ),
                "leave out --element, or write the function on linear cells",
            ));
        }
        let largest = largest(&function.values);
        let near = NEAR[usize::from(is_rounded(function.values.iter()))];
        let mut jumps = Vec::new();
        for &element in if asked.is_empty() { of_degree } else { asked } {
            let space = Space::new(mesh, element);
            let (u, jump) = function.at_dofs(&space)?;
            if jump.size <= near * largest {
                return Ok((element, u));
            }
            let at = space.point(jump.dof);
            jumps.push(format!(
                "no function of {}, as it jumps by {:.1e} at ({}, {}, {})",
                element.name(),
                jump.size,
                at[0],
                at[1],
                at[2]
            ));
        }
        Err(self.refuse(
            format!("`{name}`, of which the largest value is {largest:e}, is {}", jumps.join("; and ")),
            "write the values of P1 or P2 at the nodes, or those of CR at the corners of each cell, with all digits",
        ))
    }
}

impl OnCells {
    /// The function at the dofs of a space, and the largest difference of its values there between cells.
    fn at_dofs(&self, space: &Space) -> Result<(Vec<f64>, Jump)> {
        let dim = space.mesh.dim;
        let given: &dyn Element = match self.degree {
            1 => &P1,
            _ => &P2,
        };
        let mut u = vec![f64::NAN; space.dofs];
        let mut jump = Jump::default();
        let values = self.values.chunks_exact(nodes_of(dim, self.degree));
        let cells = self.vertices.chunks_exact(dim + 1).zip(values);
        for ((vertices, values), &cell) in cells.zip(&self.cells) {
            cancel::check()?;
            let local = in_order(dim, vertices, values, space.mesh.cell(cell as usize));
            for (node, &dof) in space.nodes.iter().zip(space.cell_dofs(cell as usize)) {
                let phi = given.values(dim, node);
                let value: f64 = phi.iter().zip(&local).map(|(phi, u)| phi * u).sum();
                let known = &mut u[dof as usize];
                let size = (value - *known).abs();
                if known.is_nan() {
                    *known = value;
                } else if size > jump.size {
                    let dof = dof as usize;
                    jump = Jump { size, dof };
                }
            }
        }
        Ok((u, jump))
    }
}

/// A cell's values in the order of the mesh, whose vertex order may differ from that of the file.
fn in_order(dim: usize, vertices: &[u32], values: &[f64], of_mesh: &[u32]) -> [f64; 10] {
    let mut local = [0.0; 10];
    let mut place = [0; 4];
    for (i, vertex) in of_mesh.iter().enumerate() {
        let own = vertices.iter().position(|v| v == vertex);
        place[i] = own.expect("invariant: it is the same cell");
        local[i] = values[place[i]];
    }
    let edges = quadratic_edges(dim);
    let middles = &values[dim + 1..];
    if middles.len() == edges.len() {
        for (k, &[a, b]) in local_edges(dim).iter().enumerate() {
            let (a, b) = (place[a], place[b]);
            let own = edges.iter().position(|e| *e == [a, b] || *e == [b, a]);
            local[dim + 1 + k] = middles[own.expect("invariant: any two vertices have an edge")];
        }
    }
    local
}

/// Number of nodes of a cell.
fn nodes_of(dim: usize, degree: usize) -> usize {
    match degree {
        1 => dim + 1,
        _ => dim + 1 + quadratic_edges(dim).len(),
    }
}
