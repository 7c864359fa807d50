//! The mesh as the solver needs it: conforming simplices, their faces, and which groups the
//! boundary faces carry. Everything here is linear in the number of cells.

mod groups;

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::parallel;

use super::faces::{self, Crowded};
use super::hanging::hanging_nodes;
use super::simplex::{diameter, dihedral_angles, signed_measure, thickness};
use super::{CellGeometry, CellKind, Group, Mesh};
use crate::cancel;
use crate::error::{Error, Result};
pub use groups::FaceGroup;

/// Instead of the second cell of a boundary face.
pub const NONE: u32 = u32::MAX;

/// Vertices, or cells, of one task.
const TASK: usize = 1 << 12;
/// The gradients of a cell flatter than this (measure over diameter^dim) are unusable.
const DEGENERATE: f64 = 1e-14;
/// In a tetrahedron thinner than this, see `thickness`, half of the digits of a gradient are lost.
const SLIVER: f64 = 1e-8;

/// A conforming simplicial mesh. Local face i of a cell lies opposite its local vertex i.
///
/// ```
/// use faceoff_mesh::{Triangulation, mesh::generate::union_jack};
///
/// # fn main() -> faceoff_mesh::Result<()> {
/// let mesh = Triangulation::new("square", &union_jack(2, [1.0, 1.0]))?;
/// assert_eq!((mesh.cell_count(), mesh.face_count()), (8, 16));
/// for &face in &mesh.groups[0].faces {
///     assert!(mesh.is_boundary(face as usize));
///     assert_eq!(mesh.face_midpoint(face as usize)[1], 0.0);
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Triangulation {
    /// The name of the mesh in messages: a path or a generator.
    pub name: String,
    /// 2 or 3.
    pub dim: usize,
    /// Coordinates of the vertices; in 2D the third is 0.
    pub points: Vec<[f64; 3]>,
    /// Vertices of the cells, `dim + 1` each, positively oriented.
    cells: Vec<u32>,
    /// Vertices of the faces, `dim` each, ascending.
    faces: Vec<u32>,
    /// Faces of the cells, `dim + 1` each.
    cell_faces: Vec<u32>,
    /// The one or two cells of each face; the second is [`NONE`] on the boundary.
    face_cells: Vec<[u32; 2]>,
    /// Groups of boundary faces, as the file or generator names them.
    pub groups: Vec<FaceGroup>,
    /// Groups of cells; their numbers are those of the cells here.
    pub regions: Vec<Group>,
}

impl Triangulation {
    /// How many cells there are.
    pub fn cell_count(&self) -> usize {
        self.cells.len() / (self.dim + 1)
    }

    /// How many faces there are.
    pub fn face_count(&self) -> usize {
        self.face_cells.len()
    }

    /// Vertices of a cell.
    #[inline]
    pub fn cell(&self, cell: usize) -> &[u32] {
        let k = self.dim + 1;
        &self.cells[k * cell..k * (cell + 1)]
    }

    /// Vertices of all cells, `dim + 1` each.
    pub fn all_cells(&self) -> &[u32] {
        &self.cells
    }

    /// Faces of all cells, `dim + 1` each.
    pub fn all_cell_faces(&self) -> &[u32] {
        &self.cell_faces
    }

    /// Faces of a cell; face i lies opposite vertex i.
    #[inline]
    pub fn cell_faces(&self, cell: usize) -> &[u32] {
        let k = self.dim + 1;
        &self.cell_faces[k * cell..k * (cell + 1)]
    }

    /// Vertices of a face, ascending.
    pub fn face(&self, face: usize) -> &[u32] {
        &self.faces[self.dim * face..self.dim * (face + 1)]
    }

    /// The cells behind a face; the second is [`NONE`] on the boundary.
    pub fn face_cells(&self, face: usize) -> [u32; 2] {
        self.face_cells[face]
    }

    /// Whether this face has only one cell.
    pub fn is_boundary(&self, face: usize) -> bool {
        self.face_cells[face][1] == NONE
    }

    /// The local number of a face in one of its cells.
    pub fn local_face(&self, cell: usize, face: usize) -> usize {
        self.cell_faces(cell)
            .iter()
            .position(|&f| f as usize == face)
            .expect("invariant: the face belongs to the cell")
    }

    /// Coordinates of a cell's vertices in the first `dim + 1` of four entries.
    #[inline]
    pub fn vertices(&self, cell: usize) -> [[f64; 3]; 4] {
        self.points_of(self.cell(cell))
    }

    /// The coordinates of a face's vertices, in their order; what is not there is 0.
    pub fn face_vertices(&self, face: usize) -> [[f64; 3]; 4] {
        self.points_of(self.face(face))
    }

    #[inline]
    fn points_of(&self, vertices: &[u32]) -> [[f64; 3]; 4] {
        let (all, mut points) = (&self.points[..], [[0.0; 3]; 4]);
        for (point, &vertex) in points.iter_mut().zip(vertices) {
            *point = all[vertex as usize];
        }
        points
    }

    /// |κ|
    #[inline]
    pub fn measure(&self, cell: usize) -> f64 {
        signed_measure(self.dim, &self.vertices(cell)).abs()
    }

    /// The gradients and the volume of a cell.
    pub fn geometry(&self, cell: usize) -> CellGeometry {
        CellGeometry::new(self.dim, &self.vertices(cell))
    }

    /// Centroid of a cell.
    pub fn cell_midpoint(&self, cell: usize) -> [f64; 3] {
        let vertices = self.vertices(cell);
        std::array::from_fn(|k| vertices.iter().map(|x| x[k]).sum::<f64>() / (self.dim + 1) as f64)
    }

    /// Centroid of a face.
    pub fn face_midpoint(&self, face: usize) -> [f64; 3] {
        let mut midpoint = [0.0; 3];
        for &vertex in self.face(face) {
            for (m, x) in midpoint.iter_mut().zip(self.points[vertex as usize]) {
                *m += x / self.dim as f64;
            }
        }
        midpoint
    }

    /// All edges: the two vertices of each, ascending, and the edges of each cell in the order
    /// of [`local_edges`]. In 2D an edge is a face, and keeps its number.
    pub fn edges(&self) -> (Vec<[u32; 2]>, Vec<u32>) {
        if self.dim == 2 {
            let edges = self.faces.chunks_exact(2).map(|f| [f[0], f[1]]).collect();
            return (edges, self.cell_faces.clone());
        }
        let local = local_edges(self.dim);
        let mut numbers = HashMap::with_capacity(2 * self.cell_count());
        let mut edges = Vec::new();
        let mut cell_edges = Vec::with_capacity(local.len() * self.cell_count());
        for cell in 0..self.cell_count() {
            let vertices = self.cell(cell);
            for &[a, b] in local {
                let (a, b) = (vertices[a], vertices[b]);
                let edge = [a.min(b), a.max(b)];
                let number = *numbers.entry(edge).or_insert_with(|| {
                    edges.push(edge);
                    edges.len() as u32 - 1
                });
                cell_edges.push(number);
            }
        }
        (edges, cell_edges)
    }

    /// Builds the topology of a mesh and checks that the problem can be solved on it.
    ///
    /// # Errors
    /// A cell that is not a simplex of the mesh's dimension, is degenerate or a duplicate; a face
    /// with three cells or with both cells on one side; a hanging or orphan vertex; a marked line
    /// or triangle that is not a face.
    pub fn new(name: &str, mesh: &Mesh) -> Result<Self> {
        let top = mesh.blocks.iter().filter(|b| !b.is_empty());
        let dim = usize::from(mesh.dim());
        let mut triangulation = Triangulation {
            name: name.to_owned(),
            dim,
            points: mesh.points.to_vec(),
            cells: Vec::new(),
            faces: Vec::new(),
            cell_faces: Vec::new(),
            face_cells: Vec::new(),
            groups: Vec::new(),
            regions: Vec::new(),
        };
        let (cell_kind, face_kind) = match dim {
            2 => (CellKind::Triangle, CellKind::Line),
            3 => (CellKind::Tetrahedron, CellKind::Triangle),
            _ => {
                return Err(triangulation.refuse(
                    "it has neither triangles nor tetrahedra".into(),
                    "give a mesh of triangles or of tetrahedra",
                ));
            }
        };
        for block in top {
            let allowed = block.kind == cell_kind
                || block.kind == face_kind
                || (block.kind.dim() as usize) + 1 < dim;
            if !allowed {
                return Err(triangulation.refuse(
                    format!(
                        "it has {} cells of type {:?}, and the elements are linear simplices",
                        block.len(),
                        block.kind
                    ),
                    "mesh the domain with linear triangles or tetrahedra (Gmsh: Mesh.ElementOrder = 1)",
                ));
            }
        }
        if dim == 2
            && let Some(k) = mesh.points.iter().position(|p| p[2] != mesh.points[0][2])
        {
            return Err(triangulation.refuse(
                format!("its triangles do not lie in one plane z = constant (vertex {k})"),
                "give a planar mesh, or a mesh of tetrahedra",
            ));
        }

        triangulation.take_cells(mesh, cell_kind)?;
        triangulation.number_faces()?;
        triangulation.check_hanging()?;
        triangulation.take_groups(mesh, face_kind)?;
        triangulation.take_regions(mesh, cell_kind)?;
        Ok(triangulation)
    }

    fn refuse(&self, what: String, remedy: &str) -> Error {
        Error::Mesh {
            mesh: self.name.clone(),
            what,
            remedy: remedy.to_owned(),
        }
    }

    /// How messages name a vertex.
    pub fn vertex_label(&self, vertex: u32) -> String {
        format!(
            "vertex {vertex} at {}",
            self.place(&self.points[vertex as usize])
        )
    }

    /// How messages name a face.
    pub fn face_label(&self, face: usize) -> String {
        let place = self.place(&self.face_midpoint(face));
        format!("face {:?} at {place}", self.face(face))
    }

    /// As many coordinates as there are dimensions: `(x, y)`.
    fn place(&self, point: &[f64; 3]) -> String {
        let coordinates = point[..self.dim].iter().map(f64::to_string);
        format!("({})", coordinates.collect::<Vec<_>>().join(", "))
    }

    fn take_cells(&mut self, mesh: &Mesh, cell_kind: CellKind) -> Result<()> {
        let blocks = || mesh.blocks.iter().filter(|b| b.kind == cell_kind);
        self.cells
            .reserve_exact(blocks().map(|b| b.nodes.len()).sum());
        for block in blocks() {
            cancel::check()?;
            self.cells.extend_from_slice(&block.nodes);
        }
        let used: Vec<AtomicBool> = self.points.iter().map(|_| AtomicBool::new(false)).collect();
        let is_absent = |node: &&u32| match used.get(**node as usize) {
            Some(used) => {
                used.store(true, Ordering::Relaxed);
                false
            }
            None => true,
        };
        let absent = parallel::map(self.cells.chunks(TASK), |nodes| {
            nodes.iter().find(is_absent)
        });
        let absent = absent.into_iter().flatten().next();
        if let Some(node) = absent {
            return Err(self.refuse(
                format!("a cell names vertex {node}, and there are {}", used.len()),
                "repair the file",
            ));
        }
        let used: Vec<bool> = used.into_iter().map(AtomicBool::into_inner).collect();
        let flat = self.orient_cells();
        cancel::check()?;
        if let Some(cell) = flat {
            return Err(self.refuse(
                self.what_is_flat(cell),
                "remove the cell or move its vertices",
            ));
        }
        if let Some(vertex) = used.iter().position(|used| !used) {
            let orphans = used.iter().filter(|used| !**used).count();
            return Err(self.refuse(
                format!(
                    "{} belongs to no cell ({orphans} such)",
                    self.vertex_label(vertex as u32)
                ),
                "remove orphan vertices (in Gmsh: save only the physical groups, with every surface in one)",
            ));
        }
        Ok(())
    }

    /// Describes a cell that is degenerate or a sliver.
    fn what_is_flat(&self, cell: usize) -> String {
        let geometry = self.geometry(cell);
        let mut what = format!("cell {cell} (vertices {:?}) is ", self.cell(cell));
        let vertices = self.vertices(cell);
        let is_sliver = geometry.measure() > DEGENERATE * geometry.diameter.powi(self.dim as i32);
        what += &if self.dim == 3 && is_sliver {
            let thickness = thickness(&vertices);
            format!("a sliver: its height is {thickness:.1e} of its shortest edge")
        } else {
            format!(
                "degenerate: measure {:e} at diameter {:e}",
                geometry.measure(),
                geometry.diameter
            )
        };
        if self.dim == 3 {
            let angles = dihedral_angles(&vertices);
            let low = angles.iter().copied().fold(f64::INFINITY, f64::min);
            let high = angles.iter().copied().fold(0.0, f64::max);
            what += &format!(", dihedral angles from {low:.2e}° to {high:.6}°");
        }
        what
    }

    /// Orients all cells positively, as the order of a cell's vertices has no meaning. Returns the first
    /// cell that is degenerate or a sliver, if any.
    fn orient_cells(&mut self) -> Option<usize> {
        let (dim, local) = (self.dim, self.dim + 1);
        let points = &self.points;
        let degenerate = |(cell, nodes): (usize, &mut [u32])| {
            if cancel::cause().is_some() {
                return None;
            }
            let mut vertices = [[0.0; 3]; 4];
            for (vertex, &node) in vertices.iter_mut().zip(nodes.iter()) {
                *vertex = points[node as usize];
            }
            let measure = signed_measure(dim, &vertices);
            let size = diameter(dim, &vertices);
            let flat = DEGENERATE * size * size * if dim == 2 { 1.0 } else { size };
            if measure < 0.0 {
                nodes.swap(dim - 1, dim);
            }
            // Negated so that NaN is refused as well.
            let sound = measure.abs() > flat
                && measure.is_finite()
                && (dim == 2 || thickness(&vertices) > SLIVER);
            (!sound).then_some(cell)
        };
        let tasks = self.cells.chunks_mut(TASK * local).enumerate();
        let first = parallel::map(tasks, |(task, cells)| {
            let cells = (task * TASK..).zip(cells.chunks_exact_mut(local));
            cells.filter_map(degenerate).min()
        });
        first.into_iter().flatten().min()
    }

    fn number_faces(&mut self) -> Result<()> {
        let faces = match self.dim {
            2 => faces::number::<2>(&self.cells, self.points.len())?,
            _ => faces::number::<3>(&self.cells, self.points.len())?,
        };
        let faces = faces.map_err(|Crowded { face, cells }| {
            self.refuse(
                format!("face {face:?} belongs to {} cells: {cells:?}", cells.len()),
                "a face has one or two cells; remove duplicate or overlapping cells",
            )
        })?;
        self.faces = faces.vertices;
        self.face_cells = faces.cells;
        self.cell_faces = faces.of_cells;
        let Some(face) = faces.folded else {
            return Ok(());
        };
        let [a, b] = self.face_cells(face);
        Err(self.refuse(
            format!(
                "cells {a} and {b} lie on the same side of {}: one of them is inverted",
                self.face_label(face)
            ),
            "untangle the mesh",
        ))
    }

    /// Refuses vertices inside boundary faces, where the mesh does not conform.
    fn check_hanging(&self) -> Result<()> {
        let boundary: Vec<&[u32]> = (0..self.face_count())
            .filter(|&face| self.is_boundary(face))
            .map(|face| self.face(face))
            .collect();
        match hanging_nodes(&self.points, &boundary)?.first() {
            None => Ok(()),
            Some(&(vertex, face)) => Err(self.refuse(
                format!(
                    "{} lies inside the face {:?}: the mesh does not conform",
                    self.vertex_label(vertex),
                    boundary[face]
                ),
                "split the cells at the hanging vertex, or merge duplicate vertices",
            )),
        }
    }

    /// The face with these vertices, ascending: faces are numbered in that order.
    pub fn find_face(&self, vertices: &[u32]) -> Option<usize> {
        let found = match self.dim {
            2 => (self.faces.as_chunks::<2>().0).binary_search_by(|face| face[..].cmp(vertices)),
            _ => (self.faces.as_chunks::<3>().0).binary_search_by(|face| face[..].cmp(vertices)),
        };
        found.ok()
    }

    /// For each cell the number of its connected part (cells connect through faces), and the
    /// number of parts.
    pub fn components(&self) -> (Vec<u32>, usize) {
        // Each cell points to an earlier one of its part, the first to itself (B. Galler, M. Fischer, Commun. ACM 7, 1964).
        let mut before: Vec<u32> = (0..self.cell_count() as u32).collect();
        let first_of = |before: &mut [u32], mut cell: u32| {
            while before[cell as usize] != cell {
                let next = before[before[cell as usize] as usize];
                before[cell as usize] = next;
                cell = next;
            }
            cell
        };
        for &[a, b] in self.face_cells.iter().filter(|[_, b]| *b != NONE) {
            let [a, b] = [a, b].map(|cell| first_of(&mut before, cell));
            before[a.max(b) as usize] = a.min(b);
        }
        let mut parts = 0;
        for cell in 0..before.len() {
            before[cell] = match before[cell] as usize {
                own if own == cell => {
                    parts += 1;
                    parts - 1
                }
                // Already the number of its part.
                earlier => before[earlier],
            };
        }
        (before, parts as usize)
    }

    /// A digest of coordinates, cells and groups, in hexadecimal.
    pub fn digest(&self) -> String {
        // Many numbers at a time: of few bytes each update takes longer than the digest.
        const BLOCK: usize = 1 << 13;
        let mut hasher = blake3::Hasher::new();
        for block in self.points.as_flattened().chunks(BLOCK) {
            let bytes: Vec<u8> = block.iter().flat_map(|x| x.to_le_bytes()).collect();
            hasher.update(&bytes);
        }
        for block in self.cells.chunks(BLOCK) {
            let bytes: Vec<u8> = block.iter().flat_map(|v| v.to_le_bytes()).collect();
            hasher.update(&bytes);
        }
        for group in &self.groups {
            hasher.update(&group.tag.to_le_bytes());
            for face in &group.faces {
                hasher.update(&face.to_le_bytes());
            }
        }
        hasher.finalize().to_hex()[..16].to_owned()
    }
}

/// Local vertices of the local edges of a simplex: in 2D edge i lies opposite vertex i.
pub fn local_edges(dim: usize) -> &'static [[usize; 2]] {
    match dim {
        2 => &[[1, 2], [0, 2], [0, 1]],
        _ => &[[2, 3], [1, 3], [1, 2], [0, 3], [0, 2], [0, 1]],
    }
}

/// Local vertices of the edges whose midpoints follow the corners of a `Triangle6` or `Tetrahedron10`, in Gmsh's order.
pub fn quadratic_edges(dim: usize) -> &'static [[usize; 2]] {
    match dim {
        2 => &[[0, 1], [1, 2], [0, 2]],
        _ => &[[0, 1], [1, 2], [0, 2], [0, 3], [2, 3], [1, 3]],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::generate::{union_cube, union_jack};
    use crate::mesh::{CellBlock, Group};

    fn triangles(points: &[[f64; 2]], nodes: &[u32]) -> Mesh {
        Mesh {
            points: points.iter().map(|p| [p[0], p[1], 0.0]).collect(),
            blocks: vec![CellBlock::new(CellKind::Triangle, nodes.to_vec())],
            ..Mesh::default()
        }
    }

    fn refusal(mesh: &Mesh) -> String {
        Triangulation::new("test", mesh).unwrap_err().to_string()
    }

    #[test]
    fn union_jack_has_the_faces_euler_counts() {
        let n = 6;
        let t = Triangulation::new("uj", &union_jack(n, [1.0, 1.0])).unwrap();
        assert_eq!(t.cell_count(), 2 * n * n);
        assert_eq!(t.face_count(), 3 * n * n + 2 * n);
        assert_eq!(t.groups.iter().map(|g| g.faces.len()).sum::<usize>(), 4 * n);
        let area: f64 = (0..t.cell_count()).map(|c| t.geometry(c).measure()).sum();
        assert!((area - 1.0).abs() < 1e-14);
        assert_eq!(t.components().1, 1);
    }

    /// On more vertices and small squares or cubes than one task has.
    #[test]
    fn faces_and_cells_know_each_other() {
        for (dim, n, mesh) in [
            (2, 70, union_jack(70, [1.0, 1.0])),
            (3, 17, union_cube(17, [1.0; 3])),
        ] {
            let t = Triangulation::new("large", &mesh).unwrap();
            let volume: f64 = (0..t.cell_count()).map(|c| t.measure(c)).sum();
            assert!((volume - 1.0).abs() < 1e-12, "{n}: {volume}");
            let mut sides = vec![0; t.face_count()];
            for cell in 0..t.cell_count() {
                for (i, &face) in t.cell_faces(cell).iter().enumerate() {
                    let mut opposite = t.cell(cell).to_vec();
                    opposite.remove(i);
                    opposite.sort_unstable();
                    assert_eq!(t.face(face as usize), opposite);
                    assert!(t.face_cells(face as usize).contains(&(cell as u32)));
                    sides[face as usize] += 1;
                }
            }
            let is_right =
                |(face, sides): (usize, &u8)| *sides == 2 - u8::from(t.is_boundary(face));
            assert!(sides.iter().enumerate().all(is_right));
            let on_boundary = sides.iter().filter(|sides| **sides == 1).count();
            let of_groups: usize = t.groups.iter().map(|g| g.faces.len()).sum();
            assert_eq!(
                (on_boundary, of_groups),
                ([4 * n, 12 * n * n][dim - 2], on_boundary)
            );
        }
    }

    /// Parts are numbered by their first cells, also where these are far from each other in the mesh.
    #[test]
    fn parts_are_those_that_faces_connect() {
        // Three squares side by side and one apart, two triangles each; the middle one comes last.
        let points: Vec<[f64; 2]> = (0..6)
            .flat_map(|k| [0.0, 1.0].map(|y| [f64::from(k), y]))
            .collect();
        let lower = [4, 6, 7, 0, 2, 3, 8, 10, 11];
        let upper = [4, 7, 5, 0, 3, 1, 8, 11, 9];
        let mesh = triangles(
            &points,
            &[&lower[..], &upper[..], &[2, 4, 5, 2, 5, 3]].concat(),
        );
        let t = Triangulation::new("squares", &mesh).unwrap();
        assert_eq!(t.components(), (vec![0, 0, 1, 0, 0, 1, 0, 0], 2));
    }

    #[test]
    fn bad_meshes_are_refused_with_the_place() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.0]];
        assert!(refusal(&triangles(&square, &[0, 1, 2, 0, 2, 3])).contains("vertex 4"));
        assert!(refusal(&triangles(&square[..3], &[0, 1, 7])).contains("vertex 7"));
        let twice = refusal(&triangles(&square[..4], &[0, 1, 2, 0, 2, 3, 0, 2, 1]));
        assert!(twice.contains("belongs to 3 cells"), "{twice}");
        let flat = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]];
        assert!(refusal(&triangles(&flat, &[0, 1, 2])).contains("degenerate"));
        let nan = [[0.0, 0.0], [1.0, f64::NAN], [0.0, 1.0]];
        assert!(refusal(&triangles(&nan, &[0, 1, 2])).contains("degenerate"));
        // Folded over the shared edge: the second triangle lies on the first one's side.
        let fold = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.9, 0.9]];
        let folded = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.2, 0.2]];
        assert!(Triangulation::new("ok", &triangles(&fold, &[0, 1, 2, 1, 2, 3])).is_ok());
        assert!(refusal(&triangles(&folded, &[0, 1, 2, 1, 2, 3])).contains("inverted"));
        // Two small triangles above one long edge: vertex 4 hangs.
        let hanging = [
            [0.0, 0.0],
            [1.0, 0.0],
            [0.5, -1.0],
            [0.0, 1.0],
            [0.5, 0.0],
            [1.0, 1.0],
        ];
        let nodes = [0, 2, 1, 0, 4, 3, 4, 1, 5, 4, 5, 3];
        assert!(refusal(&triangles(&hanging, &nodes)).contains("vertex 4"));
    }

    #[test]
    fn the_order_of_a_cells_vertices_carries_no_meaning() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let t = Triangulation::new("cw", &triangles(&square, &[0, 2, 1, 0, 2, 3])).unwrap();
        assert!((0..2).all(|c| t.geometry(c).signed_measure > 0.0));
    }

    #[test]
    fn a_marked_line_that_is_no_face_is_an_orphan() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let mut mesh = triangles(&square, &[0, 1, 2, 0, 2, 3]);
        mesh.blocks
            .push(CellBlock::new(CellKind::Line, vec![1, 3, 0, 2]));
        mesh.groups.push(Group {
            dim: 1,
            tag: 5,
            name: None,
            cells: vec![2],
        });
        assert!(refusal(&mesh).contains("group 5"));
        mesh.groups[0].cells = vec![3];
        assert!(
            Triangulation::new("diagonal", &mesh)
                .unwrap()
                .groups
                .is_empty()
        );
    }
}
