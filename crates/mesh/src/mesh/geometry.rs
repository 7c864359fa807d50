//! The geometry behind a mesh in a Gmsh file, kept so that it can be written back.

use serde::{Deserialize, Serialize};

/// The geometry behind a mesh; everything is empty for meshes of other formats.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Geometry {
    /// Points, curves, surfaces and volumes.
    pub entities: Vec<Entity>,
    /// The points in runs, each on one entity; the counts add up to all points, or there are no runs.
    pub point_runs: Vec<PointRun>,
    /// Entities that repeat others.
    pub periodic: Vec<Periodic>,
    /// Which processes have which cells.
    pub partitions: Partitions,
}

/// A point, curve, surface or volume of the geometry, or the part of one that a partition holds.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Entity {
    /// 0 for a point, to 3 for a volume.
    pub dim: u8,
    /// Its number among those of its dimension.
    pub tag: i32,
    /// The corners of the bounding box; for a point its position, twice.
    #[serde(with = "bits")]
    pub bounds: [[f64; 3]; 2],
    /// Physical tags; a negative one means that the group holds this entity reversed.
    pub physicals: Vec<i32>,
    /// The facets of this entity; negative: reversed.
    pub boundary: Vec<i32>,
    /// For a part: the dimension and tag of the whole.
    pub parent: Option<(i32, i32)>,
    /// For a part: the partitions it belongs to.
    pub partitions: Vec<i32>,
}

impl Entity {
    /// An entity whose bounding box is the first point that it is extended by.
    pub fn without_points(dim: u8, tag: i32) -> Self {
        Entity {
            dim,
            tag,
            bounds: [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]],
            ..Entity::default()
        }
    }

    /// Makes the bounding box large enough for a point.
    pub fn extend(&mut self, point: &[f64; 3]) {
        let [low, high] = &mut self.bounds;
        for (axis, &x) in point.iter().enumerate() {
            low[axis] = low[axis].min(x);
            high[axis] = high[axis].max(x);
        }
    }

    /// Whether a group holds this entity reversed.
    pub fn is_reversed(&self) -> bool {
        self.physicals.iter().any(|&tag| tag < 0)
    }
}

/// Consecutive points on one entity.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct PointRun {
    /// The dimension of the entity.
    pub dim: u8,
    /// Its tag.
    pub entity: i32,
    /// How many points there are in the run.
    pub count: usize,
    /// The parameters of each point on its entity, `dim` per point (none on a point); `None` if not given.
    pub parameters: Option<Vec<f64>>,
}

/// Points of one entity that are periodic images of those of another.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Periodic {
    /// The dimension of both entities.
    pub dim: u8,
    /// The tag of the one that repeats.
    pub entity: i32,
    /// The tag of the one that is repeated.
    pub master: i32,
    /// The transformation from master to entity, a 4 by 4 matrix by rows, or empty.
    pub affine: Vec<f64>,
    /// Indices of points: of the entity, of the master.
    pub pairs: Vec<[u32; 2]>,
}

/// How the cells are distributed among processes.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Partitions {
    /// How many partitions there are; 0 where the mesh is whole.
    pub count: u64,
    /// Tag and partition of each entity that holds only ghost cells.
    pub ghost_entities: Vec<[i32; 2]>,
    /// Cells that the file assigns, ascending.
    pub cells: Vec<CellPartitions>,
}

/// The partitions of one cell: its owners, and those in which it is a ghost.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct CellPartitions {
    /// Counted from 0 through all blocks.
    pub cell: u32,
    /// Partitions that own it, from 1.
    pub owners: Vec<i32>,
    /// Partitions that see it as a neighbour's, from 1.
    pub ghosts: Vec<i32>,
}

/// Boxes as the bits of their numbers: JSON has no infinity, which bounds what has no points.
mod bits {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(bounds: &[[f64; 3]; 2], to: S) -> Result<S::Ok, S::Error> {
        bounds.map(|corner| corner.map(f64::to_bits)).serialize(to)
    }

    pub fn deserialize<'d, D: Deserializer<'d>>(from: D) -> Result<[[f64; 3]; 2], D::Error> {
        let bits = <[[u64; 3]; 2]>::deserialize(from)?;
        Ok(bits.map(|corner| corner.map(f64::from_bits)))
    }
}
