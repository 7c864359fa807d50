//! The mesh of a form: cells of one shape, with their facets.
//!
//! Triangles and tetrahedra are simplices, quadrangles and hexahedra are cubes. A position in a reference cell is an array `at` of four numbers:
//! x, y and z are `at[1]`, `at[2]` and `at[3]`, and `at[0]` is 1 - x - y - z. So for a simplex the numbers are barycentric coordinates.

use faceoff_fem::quadrature::{self, Rule};
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::{
    CellGeometry, CellKind, Mesh, NONE, Shape as MeshShape, Triangulation, hanging_nodes,
};

/// The shape of all cells of a mesh, in 2D and in 3D.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Cells {
    /// Triangles or tetrahedra.
    Simplices,
    /// Quadrangles or hexahedra. The coordinates 0 and 1 of corner i are the binary digits of i, the lowest first; facet 2k + s is where
    /// coordinate k is s.
    Cubes,
}

/// Cells on which the Jacobian is at most this fraction of its largest value are flat or folded.
const FLAT: f64 = 1e-12;

/// The corners of a quadrangle or hexahedron in a file, listed cyclically, in the order of [`Cells::Cubes`].
const IN_TURN: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];

impl Cells {
    /// The name of a cell in messages.
    pub fn name(self, dim: usize) -> &'static str {
        match (self, dim) {
            (Cells::Simplices, 2) => "triangle",
            (Cells::Simplices, _) => "tetrahedron",
            (Cells::Cubes, 2) => "quadrangle",
            (Cells::Cubes, _) => "hexahedron",
        }
    }

    /// The plural.
    pub fn names(self, dim: usize) -> &'static str {
        match (self, dim) {
            (Cells::Simplices, 2) => "triangles",
            (Cells::Simplices, _) => "tetrahedra",
            (Cells::Cubes, 2) => "quadrangles",
            (Cells::Cubes, _) => "hexahedra",
        }
    }

    /// The corresponding shape of mesh files.
    pub fn shape(self, dim: usize) -> MeshShape {
        match (self, dim) {
            (Cells::Simplices, 2) => MeshShape::Triangle,
            (Cells::Simplices, _) => MeshShape::Tetrahedron,
            (Cells::Cubes, 2) => MeshShape::Quadrangle,
            (Cells::Cubes, _) => MeshShape::Hexahedron,
        }
    }

    /// The kind of the cells of a mesh, and of its facets.
    pub fn kinds(self, dim: usize) -> [CellKind; 2] {
        match (self, dim) {
            (Cells::Simplices, 2) => [CellKind::Triangle, CellKind::Line],
            (Cells::Simplices, _) => [CellKind::Tetrahedron, CellKind::Triangle],
            (Cells::Cubes, 2) => [CellKind::Quadrangle, CellKind::Line],
            (Cells::Cubes, _) => [CellKind::Hexahedron, CellKind::Quadrangle],
        }
    }

    /// The number of corners of a cell.
    pub fn corners(self, dim: usize) -> usize {
        match self {
            Cells::Simplices => dim + 1,
            Cells::Cubes => 1 << dim,
        }
    }

    /// The number of facets of a cell.
    pub fn facets(self, dim: usize) -> usize {
        match self {
            Cells::Simplices => dim + 1,
            Cells::Cubes => 2 * dim,
        }
    }

    /// The measure of the reference cell.
    pub fn volume(self, dim: usize) -> f64 {
        match self {
            Cells::Simplices => [1.0, 1.0, 0.5, 1.0 / 6.0][dim.min(3)],
            Cells::Cubes => 1.0,
        }
    }

    /// Is a corner on a facet?
    pub fn is_on(self, corner: usize, facet: usize) -> bool {
        match self {
            Cells::Simplices => corner != facet,
            Cells::Cubes => corner >> (facet / 2) & 1 == facet % 2,
        }
    }

    /// The position of a corner in the reference cell.
    pub fn corner(self, corner: usize) -> [f64; 4] {
        let mut at = [0.0; 4];
        match self {
            Cells::Simplices => at[corner] = 1.0,
            Cells::Cubes => (0..3).for_each(|k| at[k + 1] = f64::from((corner >> k & 1) as u8)),
        }
        at
    }

    /// The corner at the origin of the reference cell, and those on its axes.
    pub fn frame(self) -> [u8; 4] {
        match self {
            Cells::Simplices => [0, 1, 2, 3],
            Cells::Cubes => [0, 1, 2, 4],
        }
    }

    /// The weights of the corners at a position: the linear or multilinear functions that are 1 at one corner.
    pub fn parts(self, dim: usize, at: &[f64; 4]) -> [f64; 8] {
        let mut parts = [0.0; 8];
        match self {
            Cells::Simplices => parts[..=dim].copy_from_slice(&at[..=dim]),
            Cells::Cubes => {
                for (i, part) in parts.iter_mut().enumerate().take(1 << dim) {
                    *part = (0..dim).map(|k| along(i, k, at)).product();
                }
            }
        }
        parts
    }

    /// The rule with this name on cells of a dimension: for quadrangles and hexahedra, the product of one on an interval.
    fn rule(self, dim: usize, name: &str) -> Option<Rule> {
        match self {
            Cells::Simplices => quadrature::rule(dim, name),
            Cells::Cubes => quadrature::product(dim, name),
        }
    }

    /// All rules on cells of a dimension: those of forms, and those that codes use by default.
    pub fn rules(self, dim: usize) -> Vec<Rule> {
        let of = if self == Cells::Cubes { 1 } else { dim };
        let names = quadrature::names(of).iter().chain(quadrature::foreign(of));
        names.filter_map(|name| self.rule(dim, name)).collect()
    }

    /// The highest degree of the rules for forms, on cells of a dimension.
    pub fn most_degree(self, dim: usize) -> usize {
        match (self, dim) {
            (Cells::Cubes, _) | (_, 1) => 9,
            _ => 5,
        }
    }

    /// The rule with the fewest points that integrates polynomials of this degree exactly; for a quadrangle or hexahedron, of this degree in each coordinate.
    pub fn exact(self, dim: usize, degree: usize) -> Rule {
        match self {
            Cells::Simplices => quadrature::exact(dim, degree),
            Cells::Cubes => {
                let rule = quadrature::exact(1, degree);
                self.rule(dim, rule.name).unwrap_or(rule)
            }
        }
    }
}

/// The linear function of coordinate k that is 1 at a corner of the unit cube and 0 on the other side.
fn along(corner: usize, k: usize, at: &[f64; 4]) -> f64 {
    match corner >> k & 1 {
        1 => at[k + 1],
        _ => 1.0 - at[k + 1],
    }
}

/// A conforming mesh of cells of one shape.
#[derive(Debug)]
pub struct Grid {
    /// The shape of all cells.
    pub shape: Cells,
    /// 2 or 3.
    pub dim: usize,
    /// Coordinates of the vertices; in 2D the third is 0.
    pub points: Vec<[f64; 3]>,
    cells: Vec<u32>,
    /// Vertices of the facets, as [`key`] orders them; the facets ascend.
    faces: Vec<u32>,
    cell_faces: Vec<u32>,
    face_cells: Vec<[u32; 2]>,
}

/// The map from the reference cell to a cell of a mesh, at one position.
#[derive(Debug, Clone, Copy)]
pub struct Map {
    /// ∇ξ_j, the gradients of the reference coordinates: the rows of the inverse of the Jacobian matrix.
    pub slopes: [[f64; 3]; 3],
    /// |det J| times the measure of the reference cell.
    pub measure: f64,
}

impl Map {
    /// The outward unit normal on a facet of a quadrangle or hexahedron.
    pub fn normal(&self, facet: usize) -> [f64; 3] {
        let slope = self.slopes[facet / 2];
        let sign = if facet % 2 == 1 { 1.0 } else { -1.0 };
        slope.map(|x| sign * x / norm(&slope))
    }

    /// The ratio of the area of a facet of a quadrangle or hexahedron here to that of the unit cube.
    pub fn face_measure(&self, facet: usize) -> f64 {
        self.measure * norm(&self.slopes[facet / 2])
    }
}

fn norm(x: &[f64; 3]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

impl Grid {
    /// Builds the topology of a mesh and checks that a form can be solved on it; `name` is its name in messages.
    ///
    /// # Errors
    /// Cells of several shapes, or curved ones; cells that are flat or folded; a facet of three cells; a vertex inside a facet, or in no cell.
    pub fn new(name: &str, mesh: &Mesh) -> Result<Self> {
        let dim = usize::from(mesh.dim());
        let of_dim = |shape: Cells| mesh.count(shape.kinds(dim)[0]);
        if !(2..=3).contains(&dim) || of_dim(Cells::Cubes) == 0 {
            return Ok(Triangulation::new(name, mesh)?.into());
        }
        if of_dim(Cells::Simplices) > 0 {
            let [cubes, simplices] = [Cells::Cubes, Cells::Simplices]
                .map(|shape| format!("{} {}", of_dim(shape), shape.names(dim)));
            return Err(refuse(
                name,
                format!(
                    "it has {cubes} and {simplices}, and a form is solved on cells of one shape"
                ),
                "mesh the domain with one of them (Gmsh: Mesh.RecombineAll, Mesh.SubdivisionAlgorithm)",
            ));
        }
        Grid::of_cubes(name, dim, mesh)
    }

    fn of_cubes(name: &str, dim: usize, mesh: &Mesh) -> Result<Self> {
        let shape = Cells::Cubes;
        let [cell_kind, face_kind] = shape.kinds(dim);
        for block in mesh.blocks.iter().filter(|block| !block.is_empty()) {
            let is_known = [cell_kind, face_kind].contains(&block.kind);
            if !is_known && usize::from(block.kind.dim()) + 1 >= dim {
                let what = format!(
                    "it has {} {} cells among its {}",
                    block.len(),
                    block.kind,
                    shape.names(dim)
                );
                let remedy = "mesh the domain with cells of one shape and first order (Gmsh: Mesh.ElementOrder = 1)";
                return Err(refuse(name, what, remedy));
            }
        }
        if dim == 2 && mesh.points.iter().any(|p| p[2] != mesh.points[0][2]) {
            let what = "its quadrangles do not lie in one plane z = constant".into();
            return Err(refuse(
                name,
                what,
                "give a planar mesh, or one of hexahedra",
            ));
        }
        let count = shape.corners(dim);
        let mut cells = Vec::with_capacity(mesh.count(cell_kind) * count);
        for (_, _, nodes) in mesh.cells_of(cell_kind) {
            cells.extend(IN_TURN.iter().take(count).map(|k| nodes[*k]));
        }
        if let Some(node) = cells.iter().find(|k| **k as usize >= mesh.points.len()) {
            let what = format!(
                "a cell names vertex {node}, and there are {}",
                mesh.points.len()
            );
            return Err(refuse(name, what, "repair the file"));
        }
        let mut grid = Grid {
            shape,
            dim,
            points: mesh.points.to_vec(),
            cells,
            faces: Vec::new(),
            cell_faces: Vec::new(),
            face_cells: Vec::new(),
        };
        grid.check_cells(name)?;
        grid.number_faces(name)?;
        grid.check_hanging(name)?;
        Ok(grid)
    }

    /// Rejects cells on which the map of the unit cube has no inverse, and vertices of no cell.
    fn check_cells(&self, name: &str) -> Result<()> {
        let mut used = vec![false; self.points.len()];
        let steps = 3_usize.pow(self.dim as u32);
        for cell in 0..self.cell_count() {
            cancel::check()?;
            self.cell(cell)
                .iter()
                .for_each(|k| used[*k as usize] = true);
            let vertices = self.vertices(cell);
            let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
            for place in 0..steps {
                let digit = |k: u32| 0.5 * (place / 3_usize.pow(k) % 3) as f64;
                let at = [0.0, digit(0), digit(1), digit(2)];
                let det = determinant(self.dim, &jacobian(self.dim, &vertices, &at));
                least = least.min(det);
                most = most.max(det);
            }
            let size = least.abs().max(most.abs());
            // Negated so that NaN is rejected.
            if !(least > FLAT * size || most < -FLAT * size) {
                let what = format!(
                    "cell {cell} (vertices {:?}) is flat, folded or not convex: the map of the unit {} has no inverse there",
                    self.cell(cell),
                    if self.dim == 2 { "square" } else { "cube" },
                );
                return Err(refuse(name, what, "move its vertices"));
            }
        }
        match used.iter().position(|used| !used) {
            None => Ok(()),
            Some(vertex) => Err(refuse(
                name,
                format!(
                    "vertex {vertex} at {:?} belongs to no cell",
                    self.points[vertex]
                ),
                "remove orphan vertices (in Gmsh: save only the physical groups, with every surface in one)",
            )),
        }
    }

    fn number_faces(&mut self, name: &str) -> Result<()> {
        let (shape, dim) = (self.shape, self.dim);
        let width = 1 << (dim - 1);
        let mut found: Vec<([u32; 4], u32)> = Vec::new();
        for cell in 0..self.cell_count() {
            for facet in 0..shape.facets(dim) {
                let corners = (0..shape.corners(dim)).filter(|i| shape.is_on(*i, facet));
                let mut nodes: Vec<u32> = corners.map(|i| self.cell(cell)[i]).collect();
                if dim == 3 {
                    // In cyclic order.
                    nodes.swap(2, 3);
                }
                let number = cell * shape.facets(dim) + facet;
                found.push((key(&nodes), number as u32));
            }
        }
        found.sort_unstable();
        self.cell_faces = vec![0; found.len()];
        for same in found.chunk_by(|a, b| a.0 == b.0) {
            let cells: Vec<u32> = same
                .iter()
                .map(|(_, k)| k / shape.facets(dim) as u32)
                .collect();
            let face = &same[0].0[..width];
            if cells.len() > 2 {
                let what = format!("face {face:?} belongs to {} cells: {cells:?}", cells.len());
                let remedy = "a face has one or two cells; remove duplicate or overlapping cells";
                return Err(refuse(name, what, remedy));
            }
            for (_, k) in same {
                self.cell_faces[*k as usize] = self.face_cells.len() as u32;
            }
            self.faces.extend(face);
            self.face_cells
                .push([cells[0], cells.get(1).copied().unwrap_or(NONE)]);
        }
        Ok(())
    }

    /// Rejects vertices inside of facets of the boundary, where the mesh does not conform.
    fn check_hanging(&self, name: &str) -> Result<()> {
        let outside: Vec<Vec<u32>> = (0..self.face_count())
            .filter(|face| self.is_boundary(*face))
            .map(|face| {
                let mut nodes = self.face(face).to_vec();
                if self.dim == 3 {
                    nodes.swap(2, 3);
                }
                nodes
            })
            .collect();
        let all: Vec<&[u32]> = outside.iter().map(Vec::as_slice).collect();
        match hanging_nodes(&self.points, &all)?.first() {
            None => Ok(()),
            Some((vertex, face)) => Err(refuse(
                name,
                format!(
                    "vertex {vertex} at {:?} lies inside the face {:?}: the mesh does not conform",
                    self.points[*vertex as usize], all[*face]
                ),
                "split the cells at the hanging vertex, or merge duplicate vertices",
            )),
        }
    }

    /// The number of cells.
    pub fn cell_count(&self) -> usize {
        self.cells.len() / self.shape.corners(self.dim)
    }

    /// The number of facets.
    pub fn face_count(&self) -> usize {
        self.face_cells.len()
    }

    /// Vertices of a cell.
    #[inline]
    pub fn cell(&self, cell: usize) -> &[u32] {
        let k = self.shape.corners(self.dim);
        &self.cells[k * cell..k * (cell + 1)]
    }

    /// Facets of a cell; that of a simplex is opposite to the vertex with its number.
    #[inline]
    pub fn cell_faces(&self, cell: usize) -> &[u32] {
        let k = self.shape.facets(self.dim);
        &self.cell_faces[k * cell..k * (cell + 1)]
    }

    /// Vertices of a facet: those of a simplex ascend; for a quadrangle the smallest comes first, then its neighbours, the smaller one first.
    pub fn face(&self, face: usize) -> &[u32] {
        let k = self.faces.len() / self.face_cells.len().max(1);
        &self.faces[k * face..k * (face + 1)]
    }

    /// The cells adjacent to a facet; the second is [`NONE`] on the boundary.
    pub fn face_cells(&self, face: usize) -> [u32; 2] {
        self.face_cells[face]
    }

    /// Does this facet belong to only one cell?
    pub fn is_boundary(&self, face: usize) -> bool {
        self.face_cells[face][1] == NONE
    }

    /// The local number of a facet in one of its cells; 0 if it is not one of its facets.
    pub fn local_face(&self, cell: usize, face: usize) -> usize {
        let mut all = self.cell_faces(cell).iter();
        all.position(|own| *own as usize == face).unwrap_or(0)
    }

    /// The facet with these vertices, in the order of a cell in a file.
    pub fn find_face(&self, nodes: &[u32]) -> Option<usize> {
        let width = self.faces.len() / self.face_count().max(1);
        let key = key(nodes);
        let key = key.get(..nodes.len())?;
        let at = |face: usize| &self.faces[width * face..width * (face + 1)];
        let (mut low, mut high) = (0, self.face_count());
        while low < high {
            let middle = low + (high - low) / 2;
            match at(middle).cmp(key) {
                std::cmp::Ordering::Less => low = middle + 1,
                std::cmp::Ordering::Greater => high = middle,
                std::cmp::Ordering::Equal => return Some(middle),
            }
        }
        None
    }

    /// Coordinates of a cell's vertices; missing ones are 0.
    #[inline]
    pub fn vertices(&self, cell: usize) -> [[f64; 3]; 8] {
        let mut all = [[0.0; 3]; 8];
        for (at, vertex) in all.iter_mut().zip(self.cell(cell)) {
            *at = self.points[*vertex as usize];
        }
        all
    }

    /// The image of a position of the reference cell in the cell with these vertices; for a vertex exactly its coordinates.
    pub fn place(&self, vertices: &[[f64; 3]; 8], at: &[f64; 4]) -> [f64; 3] {
        let mut place = [0.0; 3];
        let parts = self.shape.parts(self.dim, at).into_iter().zip(vertices);
        for (part, vertex) in parts.filter(|(part, _)| *part != 0.0) {
            (0..3).for_each(|k| place[k] += part * vertex[k]);
        }
        place
    }

    /// The gradients and the measure of a simplex.
    pub fn geometry(&self, cell: usize) -> CellGeometry {
        CellGeometry::new(self.dim, &self.vertices(cell)[..4])
    }

    /// The map of the reference cell to the cell with these vertices at a position.
    pub fn map(&self, vertices: &[[f64; 3]; 8], at: &[f64; 4]) -> Map {
        let dim = self.dim;
        if self.shape == Cells::Simplices {
            let geometry = CellGeometry::new(dim, &vertices[..4]);
            return Map {
                slopes: [1, 2, 3].map(|j| geometry.gradients[j].into()),
                measure: geometry.measure(),
            };
        }
        let [a, b, c] = jacobian(dim, vertices, at);
        let det = determinant(dim, &[a, b, c]);
        let rows = [cross(&b, &c), cross(&c, &a), cross(&a, &b)];
        Map {
            slopes: rows.map(|row| row.map(|x| x / det)),
            measure: det.abs(),
        }
    }

    /// The longest distance between two vertices of a cell.
    pub fn diameter(&self, vertices: &[[f64; 3]; 8]) -> f64 {
        let all = &vertices[..self.shape.corners(self.dim)];
        let mut most = 0.0_f64;
        for (i, p) in all.iter().enumerate() {
            for q in &all[..i] {
                most = most.max(norm(&[0, 1, 2].map(|k| p[k] - q[k])));
            }
        }
        most
    }

    /// The longest edge of a facet of a quadrangle or hexahedron.
    pub fn facet_length(&self, vertices: &[[f64; 3]; 8], facet: usize) -> f64 {
        let own = (0..self.shape.corners(self.dim)).filter(|i| self.shape.is_on(*i, facet));
        let ends = own.flat_map(|i| (0..self.dim).map(move |k| (i, i | 1 << k)));
        let edges = ends.filter(|(i, j)| i != j && self.shape.is_on(*j, facet));
        edges.fold(0.0, |most: f64, (i, j)| {
            most.max(norm(&[0, 1, 2].map(|k| vertices[i][k] - vertices[j][k])))
        })
    }
}

impl From<Triangulation> for Grid {
    fn from(mesh: Triangulation) -> Self {
        let faces = 0..mesh.face_count();
        Grid {
            shape: Cells::Simplices,
            dim: mesh.dim,
            cells: mesh.all_cells().to_vec(),
            faces: faces
                .clone()
                .flat_map(|face| mesh.face(face))
                .copied()
                .collect(),
            cell_faces: mesh.all_cell_faces().to_vec(),
            face_cells: faces.map(|face| mesh.face_cells(face)).collect(),
            points: mesh.points,
        }
    }
}

/// Vertices of a facet in the order that all its cells have: for a quadrangle, whose corners are listed cyclically, the smallest, its neighbours, of
/// which the smaller comes first, and the opposite one; all others ascend.
fn key(nodes: &[u32]) -> [u32; 4] {
    let mut key = [u32::MAX; 4];
    if let [_, _, _, _] = nodes {
        let first = (0..4).min_by_key(|k| nodes[*k]).unwrap_or(0);
        let [b, c] = [1, 3].map(|step| nodes[(first + step) % 4]);
        return [nodes[first], b.min(c), b.max(c), nodes[(first + 2) % 4]];
    }
    for (key, node) in key.iter_mut().zip(nodes) {
        *key = *node;
    }
    key.sort_unstable();
    key
}

/// The columns ∂x/∂ξ_j of the Jacobian matrix of a quadrangle or hexahedron, completed by e_z in 2D.
fn jacobian(dim: usize, vertices: &[[f64; 3]; 8], at: &[f64; 4]) -> [[f64; 3]; 3] {
    let mut columns = [[0.0; 3], [0.0; 3], [0.0, 0.0, 1.0]];
    for (j, column) in columns.iter_mut().enumerate().take(dim) {
        *column = [0.0; 3];
        for (i, vertex) in vertices.iter().enumerate().take(1 << dim) {
            let sign = if i >> j & 1 == 1 { 1.0 } else { -1.0 };
            let others = (0..dim).filter(|k| *k != j).map(|k| along(i, k, at));
            let slope = sign * others.product::<f64>();
            (0..dim).for_each(|k| column[k] += slope * vertex[k]);
        }
    }
    columns
}

fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn determinant(dim: usize, [a, b, c]: &[[f64; 3]; 3]) -> f64 {
    match dim {
        2 => a[0] * b[1] - a[1] * b[0],
        _ => cross(a, b).iter().zip(c).map(|(x, y)| x * y).sum(),
    }
}

fn refuse(name: &str, what: String, remedy: &str) -> Error {
    Error::Mesh {
        mesh: name.to_owned(),
        what,
        remedy: remedy.to_owned(),
    }
}
