//! Meshes: as a file holds them ([`Mesh`]), and as the solver needs them.

pub mod bisect;
pub mod check;
mod data;
pub mod generate;
mod geometry;
mod hanging;
mod kind;
mod labels;
pub mod refine;
mod simplex;
mod topology;
mod triangulation;

pub use data::{Field, Support, Values};
pub use geometry::{CellPartitions, Entity, Geometry, Partitions, Periodic, PointRun};
pub use kind::{CellKind, OtherKind, Shape};
pub use labels::CellGroups;
pub use simplex::{CellGeometry, Metric};
pub use triangulation::{FaceGroup, NONE, Triangulation, local_edges};

/// A mesh as a file holds it: points, cells of any type, named groups of cells, and fields.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Coordinates, one row a point; planar meshes have z = 0.
    pub points: Vec<[f64; 3]>,
    /// The file's own number of each point; empty when the file numbers them 1, 2, 3, ….
    pub point_tags: Vec<u64>,
    /// Cells in the order of the file; a cell's index counts through all blocks.
    pub blocks: Vec<CellBlock>,
    /// Physical groups (Gmsh), labels (FreeFEM, Medit): each a set of cells. Ascending in dimension and tag.
    pub groups: Vec<Group>,
    /// Values on points and cells.
    pub fields: Vec<Field>,
    /// The geometry behind the mesh, as Gmsh tells it.
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

impl CellBlock {
    /// A block without tags and entities.
    pub fn new(kind: CellKind, nodes: Vec<u32>) -> Self {
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

    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Point indices of each cell in turn.
    pub fn cells(&self) -> std::slice::ChunksExact<'_, u32> {
        self.nodes.chunks_exact(self.kind.points())
    }
}

impl Mesh {
    /// Number of cells of all types.
    pub fn cell_count(&self) -> usize {
        self.blocks.iter().map(CellBlock::len).sum()
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

    /// The file's number of a point.
    pub fn point_tag(&self, point: u32) -> u64 {
        self.point_tags
            .get(point as usize)
            .copied()
            .unwrap_or(u64::from(point) + 1)
    }

    /// The file's numbers of all cells in order.
    pub fn cell_tags(&self) -> impl Iterator<Item = u64> {
        let mut next = 1u64;
        self.blocks.iter().flat_map(move |block| {
            let first = next;
            next += block.len() as u64;
            (0..block.len()).map(move |i| block.tags.get(i).copied().unwrap_or(first + i as u64))
        })
    }

    /// The one coordinate plane all points lie in, as the index of the constant coordinate (0: x, 1: y, 2: z).
    /// Where more than one is constant the last is named.
    pub fn plane(&self) -> Option<usize> {
        let first = self.points.first()?;
        (0..3)
            .rev()
            .find(|&axis| self.points.iter().all(|point| point[axis] == first[axis]))
    }

    /// Checks what the types cannot: that indices, lengths and orders are as the fields' comments say.
    /// Every reader answers with a mesh that passes, and every writer asks before it writes.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn validate(&self) -> Result<(), String> {
        let (points, cells) = (self.points.len(), self.cell_count());
        if u32::try_from(points).is_err() || u32::try_from(cells).is_err() {
            return Err("more than 2^32 - 1 points or cells".into());
        }
        if let Some(i) = self
            .points
            .iter()
            .position(|p| !p.iter().all(|x| x.is_finite()))
        {
            return Err(format!(
                "point {} has a coordinate that is not finite",
                self.point_tag(i as u32)
            ));
        }
        if !self.point_tags.is_empty() && self.point_tags.len() != points {
            return Err(format!(
                "{} point tags for {points} points",
                self.point_tags.len()
            ));
        }
        for block in &self.blocks {
            let (kind, len) = (block.kind, block.len());
            if block.nodes.len() % kind.points() != 0 {
                return Err(format!(
                    "{} nodes do not make {kind} cells",
                    block.nodes.len()
                ));
            }
            if block.nodes.iter().any(|&node| node as usize >= points) {
                return Err(format!("a {kind} has a node beyond the {points} points"));
            }
            if (!block.tags.is_empty() && block.tags.len() != len)
                || (!block.entities.is_empty() && block.entities.len() != len)
            {
                return Err(format!(
                    "tags or entities of the {kind} cells are not one a cell"
                ));
            }
        }
        self.validate_groups()?;
        for field in &self.fields {
            if field.expected_len(self) != Some(field.values.len())
                || !field.at.is_sorted_by(|a, b| a < b)
            {
                return Err(format!("field {:?} does not fit the mesh", field.name));
            }
        }
        self.validate_geometry()
    }

    fn validate_groups(&self) -> Result<(), String> {
        if !self
            .groups
            .is_sorted_by(|a, b| (a.dim, a.tag) < (b.dim, b.tag))
        {
            return Err(
                "groups are not in ascending order of dimension and tag, or one is there twice"
                    .into(),
            );
        }
        let mut ends = Vec::with_capacity(self.blocks.len());
        let mut end = 0;
        for block in &self.blocks {
            end += block.len();
            ends.push(end);
        }
        for group in &self.groups {
            let bad = |what| {
                Err(format!(
                    "group {} of dimension {} {what}",
                    group.tag, group.dim
                ))
            };
            if !group.cells.is_sorted_by(|a, b| a < b) {
                return bad("has cells twice or not in ascending order");
            }
            // Both the cells and the blocks ascend, so that one pass along the two finds each cell's block.
            let mut block = 0;
            for &cell in &group.cells {
                while ends.get(block).is_some_and(|&end| end <= cell as usize) {
                    block += 1;
                }
                match self.blocks.get(block) {
                    None => return bad("has a cell beyond the last"),
                    Some(found) if found.kind.dim() != group.dim => {
                        return bad("has a cell of another dimension");
                    }
                    Some(_) => {}
                }
            }
        }
        Ok(())
    }

    fn validate_geometry(&self) -> Result<(), String> {
        let (points, cells) = (self.points.len(), self.cell_count());
        let runs = &self.geometry.point_runs;
        if !runs.is_empty() && runs.iter().map(|run| run.count).sum::<usize>() != points {
            return Err("the runs of points on entities do not add up to all points".into());
        }
        let misfit = |run: &PointRun| {
            run.parameters
                .as_ref()
                .is_some_and(|p| p.len() != run.count * usize::from(run.dim))
                || run.dim > 3
        };
        if runs.iter().any(misfit) {
            return Err("the parameters of points on entities are not one a dimension".into());
        }
        let mut pairs = self
            .geometry
            .periodic
            .iter()
            .flat_map(|link| link.pairs.iter().flatten());
        if pairs.any(|&point| point as usize >= points) {
            return Err("a periodic link names a point beyond the last".into());
        }
        if self
            .geometry
            .partitions
            .cells
            .iter()
            .any(|c| c.cell as usize >= cells)
        {
            return Err("a partition names a cell beyond the last".into());
        }
        Ok(())
    }
}
