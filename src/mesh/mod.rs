//! Meshes: as a file holds them ([`Mesh`]), and as the solver needs them.

pub mod generate;
mod simplex;
mod triangulation;

pub use simplex::CellGeometry;
pub use triangulation::{FaceGroup, NONE, Triangulation, local_edges};

/// A mesh as a file holds it: points, cells of any type, and named groups of cells.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Coordinates, one row a point; planar meshes have z = 0.
    pub points: Vec<[f64; 3]>,
    /// The file's own number of each point; empty when the file numbers them 1, 2, 3, ….
    pub point_tags: Vec<u64>,
    /// Cells in the order of the file; a cell's index counts through all blocks.
    pub blocks: Vec<CellBlock>,
    /// Physical groups (Gmsh), labels (FreeFEM, Medit): each a set of cells.
    pub groups: Vec<Group>,
}

impl Mesh {
    /// Type and points of a cell, counted through all blocks.
    pub fn cell(&self, cell: u32) -> Option<(CellKind, &[u32])> {
        let mut index = cell as usize;
        for block in &self.blocks {
            if index < block.len() {
                let k = block.kind.points();
                return Some((block.kind, &block.nodes[k * index..k * (index + 1)]));
            }
            index -= block.len();
        }
        None
    }
}

/// Cells of one type.
#[derive(Debug, Clone, PartialEq)]
pub struct CellBlock {
    pub kind: CellKind,
    /// Point indices from 0, `kind.points()` a cell, in Gmsh's order of nodes.
    pub nodes: Vec<u32>,
    /// The file's own number of each cell; empty when it numbers cells 1, 2, 3, … through all blocks.
    pub tags: Vec<u64>,
    /// The elementary (geometrical) entity of each cell; empty when the file has none.
    pub entities: Vec<i32>,
}

/// A set of cells that carries a number and perhaps a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Dimension of its cells: 0 to 3.
    pub dim: u8,
    pub tag: i64,
    pub name: Option<String>,
    /// Cell indices counted through all blocks, ascending.
    pub cells: Vec<u32>,
}

/// The cell types that meshes of the supported formats hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum CellKind {
    Vertex,
    Line,
    Triangle,
    Quadrangle,
    Tetrahedron,
    Hexahedron,
    Prism,
    Pyramid,
    Line3,
    Triangle6,
    Quadrangle8,
    Quadrangle9,
    Tetrahedron10,
}

impl CellKind {
    /// Number of points of one cell.
    pub fn points(self) -> usize {
        match self {
            CellKind::Vertex => 1,
            CellKind::Line => 2,
            CellKind::Triangle | CellKind::Line3 => 3,
            CellKind::Quadrangle | CellKind::Tetrahedron => 4,
            CellKind::Pyramid => 5,
            CellKind::Prism | CellKind::Triangle6 => 6,
            CellKind::Hexahedron | CellKind::Quadrangle8 => 8,
            CellKind::Quadrangle9 => 9,
            CellKind::Tetrahedron10 => 10,
        }
    }

    /// Topological dimension.
    pub fn dim(self) -> u8 {
        match self {
            CellKind::Vertex => 0,
            CellKind::Line | CellKind::Line3 => 1,
            CellKind::Triangle
            | CellKind::Quadrangle
            | CellKind::Triangle6
            | CellKind::Quadrangle8
            | CellKind::Quadrangle9 => 2,
            CellKind::Tetrahedron
            | CellKind::Hexahedron
            | CellKind::Prism
            | CellKind::Pyramid
            | CellKind::Tetrahedron10 => 3,
        }
    }
}

impl CellBlock {
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.nodes.len() / self.kind.points()
    }

    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Point indices of each cell in turn.
    pub fn cells(&self) -> std::slice::ChunksExact<'_, u32> {
        self.nodes.chunks_exact(self.kind.points())
    }
}
