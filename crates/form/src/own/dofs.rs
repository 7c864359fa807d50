//! The degrees of freedom of all unknowns on a mesh, and the pattern of matrices.
//!
//! Components of a vector share their nodes: a node has one dof, or one for each component. Nodes are numbered in the order in which the loop over
//! cells reaches them, those of all unknowns together, so that neighbours in the mesh are near in memory.

use std::collections::HashMap;

use faceoff_mesh::parallel;

use super::element::{Shape, carriers};
use crate::grid::{Cells, Grid};
use crate::problem::{Element, Problem};

/// No node yet.
const NONE: u32 = u32::MAX;

/// The entity that carries a node of an unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Carrier {
    /// A vertex.
    Vertex(u32),
    /// An edge by its vertices, ascending, and the index of the node, counted from the first.
    Edge([u32; 2], u8),
    /// A facet of a cell.
    Facet(u32),
    /// The interior of a cell, and the index of the node.
    Cell(u32, u8),
}

/// The dofs.
#[derive(Debug)]
pub struct Dofs {
    /// The nodes of each cell, by unknown: one per basis function.
    pub cell_nodes: Vec<Vec<u32>>,
    /// The number of basis functions of a cell, by unknown.
    pub counts: Vec<usize>,
    /// The first dof of each node, and the number of dofs at the end.
    pub first: Vec<u32>,
    /// The unknown of each node.
    pub unknown: Vec<u32>,
}

impl Dofs {
    /// Numbers the nodes of all unknowns.
    pub fn new(problem: &Problem, mesh: &Grid) -> Self {
        let dim = mesh.dim;
        let all: Vec<Vec<Local>> = problem
            .unknowns
            .iter()
            .map(|u| locals(u.space.element, mesh.shape, dim))
            .collect();
        let counts: Vec<usize> = all.iter().map(Vec::len).collect();
        let mut numbers: Vec<HashMap<Carrier, u32>> = vec![HashMap::new(); counts.len()];
        let mut dofs = Dofs {
            cell_nodes: counts
                .iter()
                .map(|n| Vec::with_capacity(n * mesh.cell_count()))
                .collect(),
            counts,
            first: vec![0],
            unknown: Vec::new(),
        };
        let mut vertices: Vec<Vec<u32>> = vec![vec![NONE; mesh.points.len()]; all.len()];
        for cell in 0..mesh.cell_count() {
            for (k, locals) in all.iter().enumerate() {
                let space = problem.unknowns[k].space;
                let size = if space.element.is_vector() {
                    1
                } else {
                    space.count()
                } as u32;
                for local in locals {
                    let carrier = carrier(mesh, cell, *local);
                    let place = match carrier {
                        Carrier::Vertex(vertex) => &mut vertices[k][vertex as usize],
                        // No other cell has it.
                        Carrier::Cell(..) => &mut { NONE },
                        _ => numbers[k].entry(carrier).or_insert(NONE),
                    };
                    if *place == NONE {
                        *place = dofs.unknown.len() as u32;
                        dofs.unknown.push(k as u32);
                        let next = dofs.first[dofs.first.len() - 1] + size;
                        dofs.first.push(next);
                    }
                    dofs.cell_nodes[k].push(*place);
                }
            }
        }
        dofs
    }

    /// The number of dofs.
    pub fn count(&self) -> usize {
        self.first[self.first.len() - 1] as usize
    }

    /// The number of nodes.
    pub fn nodes(&self) -> usize {
        self.unknown.len()
    }

    /// The dofs of a node.
    pub fn of_node(&self, node: u32) -> std::ops::Range<usize> {
        self.first[node as usize] as usize..self.first[node as usize + 1] as usize
    }

    /// The nodes of an unknown in a cell.
    pub fn of_cell(&self, unknown: usize, cell: usize) -> &[u32] {
        let count = self.counts[unknown];
        &self.cell_nodes[unknown][count * cell..count * (cell + 1)]
    }
}

fn carrier(mesh: &Grid, cell: usize, local: Local) -> Carrier {
    let vertices = mesh.cell(cell);
    match local {
        Local::Vertex(i) => Carrier::Vertex(vertices[i]),
        Local::Edge([a, b], nearer_to_b, n) => {
            let [a, b] = [vertices[a], vertices[b]];
            let from_a = u8::from(nearer_to_b);
            let is_turned = n > 1 && a > b;
            let number = if is_turned { 1 - from_a } else { from_a };
            Carrier::Edge([a.min(b), a.max(b)], number)
        }
        Local::Facet(i) => Carrier::Facet(mesh.cell_faces(cell)[i]),
        Local::Cell(i) => Carrier::Cell(cell as u32, i),
    }
}

/// The position of the node of a basis function of a cell.
#[derive(Debug, Clone, Copy)]
enum Local {
    Vertex(usize),
    /// Between two vertices, nearer to the second: the index, and the number of intervals.
    Edge([usize; 2], bool, usize),
    Facet(usize),
    Cell(u8),
}

fn locals(element: Element, cells: Cells, dim: usize) -> Vec<Local> {
    match element {
        Element::Broken(_) => {
            let count = Shape::of(element, cells).count(dim) as u8;
            (0..count).map(Local::Cell).collect()
        }
        Element::CrouzeixRaviart | Element::RaviartThomas => (0..=dim).map(Local::Facet).collect(),
        Element::Nedelec => {
            let edges = carriers(element, dim).into_iter();
            edges.map(|edge| Local::Edge(edge, false, 1)).collect()
        }
        Element::Continuous(degree) => {
            let lattice = Shape::of(element, cells).lattice(dim).into_iter();
            lattice
                .map(|node| local(node, degree, cells, dim))
                .collect()
        }
    }
}

/// The entity that carries a node of a continuous function.
fn local(node: [u8; 4], degree: u8, cells: Cells, dim: usize) -> Local {
    // The corners of the smallest face of the cell that contains the node.
    let corners = match cells {
        Cells::Simplices => (0..=dim).filter(|i| node[*i] > 0).collect(),
        Cells::Cubes => {
            let is_near = |i: usize, k: usize| match i >> k & 1 {
                1 => node[k + 1] > 0,
                _ => node[k + 1] < degree,
            };
            let near = (0..1 << dim).filter(|i| (0..dim).all(|k| is_near(*i, k)));
            near.collect::<Vec<usize>>()
        }
    };
    match corners[..] {
        [i] => Local::Vertex(i),
        [a, b] => {
            // On cubes the only node of an edge is its midpoint.
            let nearer_to_b = cells == Cells::Simplices && node[b] > node[a];
            Local::Edge([a, b], nearer_to_b, usize::from(degree) - 1)
        }
        _ if corners.len() == cells.corners(dim) => Local::Cell(0),
        _ => {
            let is_it = |facet: &usize| corners.iter().all(|i| cells.is_on(*i, *facet));
            Local::Facet((0..cells.facets(dim)).find(is_it).unwrap_or(0))
        }
    }
}

/// Does the basis function of a cell belong to one of its facets, so that a prescribed value on the facet determines it?
pub fn is_on_facet(element: Element, cells: Cells, dim: usize, i: usize, facet: usize) -> bool {
    match element {
        Element::CrouzeixRaviart | Element::RaviartThomas => i == facet,
        Element::Broken(degree) | Element::Continuous(degree) => {
            let node = Shape::of(element, cells).lattice(dim)[i];
            degree > 0
                && match cells {
                    Cells::Simplices => node[facet] == 0,
                    Cells::Cubes => {
                        usize::from(node[facet / 2 + 1]) == facet % 2 * usize::from(degree)
                    }
                }
        }
        Element::Nedelec => !carriers(element, dim)[i].contains(&facet),
    }
}

/// Groups of nodes that a kind of integral couples: the nodes of a cell, or of both cells of a facet.
#[derive(Debug)]
pub struct Coupling {
    /// All groups, concatenated.
    pub nodes: Vec<u32>,
    /// The number of nodes in a group.
    pub size: usize,
    /// For the unknowns of a row's and a column's node.
    pub coupled: Vec<Vec<bool>>,
}

/// The pattern of a matrix by nodes: which nodes are coupled to each node.
#[derive(Debug, Default)]
pub struct Pattern {
    /// The start of the coupled nodes of each node, and their number at the end.
    pub starts: Vec<usize>,
    /// Ascending for each node.
    pub nodes: Vec<u32>,
    /// For each of them the number of columns before it in the row.
    columns: Vec<u32>,
    /// The number of columns in the rows of each node.
    pub widths: Vec<u32>,
    /// The start of the values in the first row of each node, and their number at the end.
    pub rows: Vec<usize>,
}

impl Pattern {
    /// From the coupled groups; a node is always coupled with itself.
    pub fn new(dofs: &Dofs, all: &[Coupling]) -> Self {
        // The groups of each node, by their start.
        let places = all.iter().map(|coupling| {
            let mut starts = vec![0_usize; dofs.nodes() + 1];
            let nodes = || coupling.nodes.iter().enumerate();
            nodes().for_each(|(_, node)| starts[*node as usize + 1] += 1);
            for k in 0..dofs.nodes() {
                starts[k + 1] += starts[k];
            }
            let mut next = starts.clone();
            let mut found = vec![0_u32; coupling.nodes.len()];
            for (k, node) in nodes() {
                found[next[*node as usize]] = (k / coupling.size * coupling.size) as u32;
                next[*node as usize] += 1;
            }
            (starts, found)
        });
        let places: Vec<_> = places.collect();
        let rows = |range: std::ops::Range<usize>| {
            let mut found = Vec::with_capacity(range.len());
            for node in range {
                let mut others = vec![node as u32];
                for (coupling, (starts, places)) in all.iter().zip(&places) {
                    let own = &coupling.coupled[dofs.unknown[node] as usize];
                    for at in &places[starts[node]..starts[node + 1]] {
                        let at = *at as usize;
                        let nodes = coupling.nodes[at..at + coupling.size].iter();
                        others.extend(nodes.filter(|k| own[dofs.unknown[**k as usize] as usize]));
                    }
                }
                others.sort_unstable();
                others.dedup();
                found.push(others);
            }
            found
        };
        let count = dofs.nodes();
        let found = parallel::chunks(count, parallel::share(count), rows);
        let mut pattern = Pattern {
            starts: vec![0],
            nodes: Vec::with_capacity(found.iter().map(Vec::len).sum()),
            rows: vec![0],
            ..Pattern::default()
        };
        let mut values = 0;
        for (node, others) in found.iter().enumerate() {
            let mut width = 0;
            for other in others {
                pattern.nodes.push(*other);
                pattern.columns.push(width);
                width += dofs.of_node(*other).len() as u32;
            }
            values += width as usize * dofs.of_node(node as u32).len();
            pattern.starts.push(pattern.nodes.len());
            pattern.widths.push(width);
            pattern.rows.push(values);
        }
        pattern
    }

    /// The number of values; 0 if there is no pattern.
    pub fn values(&self) -> usize {
        self.rows.last().copied().unwrap_or(0)
    }

    /// Calls `with` with each dof's row, its columns in ascending order, and the start of its values.
    pub fn for_rows(&self, dofs: &Dofs, mut with: impl FnMut(usize, &[u32], usize)) {
        let mut columns = Vec::new();
        for node in 0..dofs.nodes() {
            columns.clear();
            for other in &self.nodes[self.starts[node]..self.starts[node + 1]] {
                columns.extend(dofs.of_node(*other).map(|dof| dof as u32));
            }
            for (k, dof) in dofs.of_node(node as u32).enumerate() {
                with(dof, &columns, self.rows[node] + k * columns.len());
            }
        }
    }

    /// The number of columns before those of `other` in the rows of `node`; `None` if the two are not coupled.
    pub fn find(&self, node: u32, other: u32) -> Option<usize> {
        let range = self.starts[node as usize]..self.starts[node as usize + 1];
        let found = self.nodes[range.clone()].binary_search(&other).ok()?;
        Some(self.columns[range.start + found] as usize)
    }
}

/// The sign of a basis function of vectors: its normal points out of the first cell of a facet, its edge is directed from the smaller vertex to the
/// larger one.
pub fn sign(mesh: &Grid, cell: usize, [a, b]: [usize; 2]) -> f64 {
    let is_along = match a == b {
        true => mesh.face_cells(mesh.cell_faces(cell)[a] as usize)[0] as usize == cell,
        false => mesh.cell(cell)[a] < mesh.cell(cell)[b],
    };
    if is_along { 1.0 } else { -1.0 }
}
