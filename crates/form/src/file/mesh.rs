//! The groups of a mesh and their positions: a form may integrate over them, and prescribe values there.

use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::{CellGroups, Mesh};

use crate::grid::{Cells, Grid};
use crate::problem::{Domain, Group};

/// The properties of a mesh that a form depends on.
pub(super) struct Marks {
    /// 2 or 3.
    pub dim: usize,
    /// The shape of its cells.
    pub cells: Cells,
    /// The groups of the mesh, in its order.
    pub groups: Vec<Group>,
    /// The number of facets of the boundary in no group.
    pub unmarked: usize,
}

impl Marks {
    /// Checks the mesh and finds its groups.
    ///
    /// # Errors
    /// A mesh with unsupported cell shapes, or on which the form cannot be solved; groups that overlap, since a cell or facet has one
    /// number in most codes.
    pub fn new(name: &str, mesh: &Mesh) -> Result<Self> {
        let grid = Grid::new(name, mesh)?;
        let label = |k: usize| {
            let group = &mesh.groups[k];
            group.name.clone().unwrap_or_else(|| group.tag.to_string())
        };
        let sets = CellGroups::new(mesh).sets;
        if let Some(set) = sets.iter().find(|set| set.len() > 1) {
            let names: Vec<String> = set.iter().map(|k| label(*k as usize)).collect();
            return Err(Error::Mesh {
                mesh: name.to_owned(),
                what: format!(
                    "the groups {} overlap, and in most codes a cell or facet is in one group",
                    names.join(" and ")
                ),
                remedy: "make disjoint groups, and name several in a measure: ds(a, b)".into(),
            });
        }
        let dim = grid.dim;
        let mut marked = vec![false; grid.face_count()];
        let mut groups = Vec::with_capacity(mesh.groups.len());
        for (k, group) in mesh.groups.iter().enumerate() {
            let mut on = (usize::from(group.dim) == dim).then_some(Domain::Cells);
            if usize::from(group.dim) + 1 == dim {
                let cells = group.cells.iter().filter_map(|cell| mesh.cell(*cell));
                let faces = cells.filter_map(|(_, nodes)| grid.find_face(nodes));
                let faces: Vec<usize> = faces.collect();
                let outside = faces.iter().filter(|f| grid.is_boundary(**f));
                on = match outside.count() {
                    0 => Some(Domain::Interior),
                    count if count == faces.len() => Some(Domain::Boundary),
                    _ => None,
                };
                faces.into_iter().for_each(|face| marked[face] = true);
            }
            groups.push(Group {
                name: label(k),
                tag: group.tag,
                dim: group.dim.into(),
                on,
            });
        }
        let faces = 0..grid.face_count();
        Ok(Marks {
            dim,
            cells: grid.shape,
            groups,
            unmarked: faces
                .filter(|face| grid.is_boundary(*face) && !marked[*face])
                .count(),
        })
    }
}
