//! Meshes as a file holds them ([`Mesh`]) and as the solver needs them ([`Triangulation`]).

mod array;
pub mod bisect;
pub mod check;
mod data;
mod faces;
pub mod generate;
mod geometry;
mod hanging;
mod kind;
mod labels;
mod polyhedra;
pub mod quality;
pub mod refine;
mod simplex;
pub(crate) mod topology;
mod triangulation;
mod union;
mod validate;

pub use array::Array;
pub use data::{Field, Support, Values};
pub use geometry::{CellPartitions, Entity, Geometry, Partitions, Periodic, PointRun};
pub use hanging::{carriers, hanging_nodes};
pub use kind::{CellKind, OtherKind, Shape, VtkKind};
pub use labels::CellGroups;
pub use polyhedra::Polyhedra;
pub use simplex::{CellGeometry, Metric};
pub use topology::sides;
pub use triangulation::{FaceGroup, NONE, Triangulation, local_edges, quadratic_edges};
pub use union::Union;
pub(crate) use validate::{all_finite, highest};

use std::ops::Range;

/// A mesh as a file holds it: points, cells of any type, named groups of cells, and fields.
///
/// ```
/// use faceoff_mesh::{CellBlock, CellKind, Mesh};
///
/// let mesh = Mesh {
///     points: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]].into(),
///     blocks: vec![CellBlock::new(CellKind::Triangle, vec![0, 1, 2, 0, 2, 3])],
///     ..Mesh::default()
/// };
/// assert_eq!(mesh.validate(), Ok(()));
/// assert_eq!((mesh.dim(), mesh.cell_count()), (2, 2));
/// assert_eq!(mesh.cell(1), Some((CellKind::Triangle, &[0, 2, 3][..])));
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Coordinates, one row per point; planar meshes have z = 0.
    pub points: Array<[f64; 3]>,
    /// The file's own number of each point; empty when the file numbers them 1, 2, 3, ….
    pub point_tags: Vec<u64>,
    /// Cells in the order of the file; a cell's index counts through all blocks.
    pub blocks: Vec<CellBlock>,
    /// The faces of the polyhedra among the cells, in their order.
    pub polyhedra: Polyhedra,
    /// Physical groups (Gmsh), labels (FreeFEM, Medit): each a set of cells. Ascending in dimension and tag.
    pub groups: Vec<Group>,
    /// Values on points and cells.
    pub fields: Vec<Field>,
    /// The geometry behind the mesh, from Gmsh.
    pub geometry: Geometry,
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
    /// Their type, by which the nodes of each are counted and ordered.
    pub kind: CellKind,
    /// Point indices from 0, `kind.points()` per cell, in Gmsh's order of nodes (VTK's for [`CellKind::Vtk`]).
    pub nodes: Array<u32>,
    /// The file's own number of each cell; empty when it numbers cells 1, 2, 3, … through all blocks.
    pub tags: Vec<u64>,
    /// The elementary (geometrical) entity of each cell; empty when the file has none.
    pub entities: Vec<i32>,
}

/// A numbered set of cells, which may have a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Dimension of its cells: 0 to 3.
    pub dim: u8,
    /// Its number; groups of other dimensions may have the same.
    pub tag: i64,
    /// Its name, where the file gives one.
    pub name: Option<String>,
    /// Cell indices counted through all blocks, ascending.
    pub cells: Vec<u32>,
}

impl Group {
    /// A group without name and cells.
    pub fn new(dim: u8, tag: i64) -> Self {
        Group {
            dim,
            tag,
            name: None,
            cells: Vec::new(),
        }
    }
}

impl CellBlock {
    /// A block without tags and entities.
    pub fn new(kind: CellKind, nodes: Vec<u32>) -> Self {
        CellBlock::of(kind, nodes.into())
    }

    /// A block without tags and entities, of nodes that may be lent.
    pub fn of(kind: CellKind, nodes: Array<u32>) -> Self {
        CellBlock {
            kind,
            nodes,
            tags: Vec::new(),
            entities: Vec::new(),
        }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.nodes.len() / self.kind.points()
    }

    /// Whether it has no cells.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Point indices of each cell in turn.
    pub fn cells(&self) -> std::slice::ChunksExact<'_, u32> {
        self.nodes.chunks_exact(self.kind.points())
    }
}

impl Mesh {
    /// A digest of coordinates, cells and groups, in hexadecimal.
    pub fn digest(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for x in self.points.iter().flatten() {
            hasher.update(&x.to_le_bytes());
        }
        for block in &self.blocks {
            hasher.update(format!("{:?} {}", block.kind, block.len()).as_bytes());
            for node in &block.nodes {
                hasher.update(&node.to_le_bytes());
            }
        }
        for group in &self.groups {
            hasher.update(format!("{} {} {:?}", group.dim, group.tag, group.name).as_bytes());
            for cell in &group.cells {
                hasher.update(&cell.to_le_bytes());
            }
        }
        hasher.finalize().to_hex()[..16].to_owned()
    }

    /// Number of cells of all types.
    pub fn cell_count(&self) -> usize {
        self.blocks.iter().map(CellBlock::len).sum()
    }

    /// The number of cells up to the end of each block.
    pub(crate) fn block_ends(&self) -> Vec<usize> {
        let ends = self.blocks.iter().scan(0, |end, block| {
            *end += block.len();
            Some(*end)
        });
        ends.collect()
    }

    /// The blocks, each with its cells.
    pub(crate) fn ranges(&self) -> impl Iterator<Item = (Range<u32>, &CellBlock)> {
        self.blocks.iter().scan(0, |end, block| {
            let start = std::mem::replace(end, *end + block.len() as u32);
            Some((start..*end, block))
        })
    }

    /// How many points or cells there are.
    pub(crate) fn items(&self, on: Support) -> usize {
        match on {
            Support::Points => self.points.len(),
            Support::Cells | Support::CellPoints => self.cell_count(),
        }
    }

    /// Number of cells of one type.
    pub fn count(&self, kind: CellKind) -> usize {
        let blocks = self.blocks.iter().filter(|block| block.kind == kind);
        blocks.map(CellBlock::len).sum()
    }

    /// The highest dimension of any cell; 0 for a mesh without cells.
    pub fn dim(&self) -> u8 {
        let blocks = self.blocks.iter().filter(|block| !block.is_empty());
        blocks.map(|block| block.kind.dim()).max().unwrap_or(0)
    }

    /// All cells in order: index, type and point indices.
    pub fn cells(&self) -> impl Iterator<Item = (u32, CellKind, &[u32])> {
        let cells = self
            .blocks
            .iter()
            .flat_map(|block| block.cells().map(|nodes| (block.kind, nodes)));
        (0u32..)
            .zip(cells)
            .map(|(index, (kind, nodes))| (index, kind, nodes))
    }

    /// The [`Mesh::cells`] of one type.
    pub fn cells_of(&self, kind: CellKind) -> impl Iterator<Item = (u32, CellKind, &[u32])> {
        self.cells().filter(move |(_, found, _)| *found == kind)
    }

    /// The file's number of a point.
    pub fn point_tag(&self, point: u32) -> u64 {
        self.point_tags
            .get(point as usize)
            .copied()
            .unwrap_or(u64::from(point) + 1)
    }

    /// The file's numbers of all cells in order; cells without one are numbered on from the highest.
    pub fn cell_tags(&self) -> impl Iterator<Item = u64> {
        let highest = self.blocks.iter().flat_map(|block| &block.tags).max();
        let mut next = highest.copied().unwrap_or(0);
        self.blocks.iter().flat_map(move |block| {
            let first = next;
            if block.tags.is_empty() {
                next = next.saturating_add(block.len() as u64);
            }
            let number = move |i: usize| first.saturating_add(i as u64 + 1);
            (0..block.len()).map(move |i| block.tags.get(i).copied().unwrap_or_else(|| number(i)))
        })
    }

    /// The coordinate plane that contains all points, as the index of the constant coordinate (0: x, 1: y, 2: z).
    /// If several are constant, the last.
    pub fn plane(&self) -> Option<usize> {
        let first = self.points.first()?;
        (0..3)
            .rev()
            .find(|&axis| self.points.iter().all(|point| point[axis] == first[axis]))
    }
}
