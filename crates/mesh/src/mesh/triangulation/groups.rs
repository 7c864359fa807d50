//! The groups of a mesh: of boundary faces, and of cells.

use super::super::{CellKind, Group, Mesh};
use super::Triangulation;
use crate::cancel;
use crate::error::Result;

/// A named or numbered set of faces.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceGroup {
    /// Its number in the file.
    pub tag: i64,
    /// Its name, where it has one.
    pub name: Option<String>,
    /// Face indices, ascending.
    pub faces: Vec<u32>,
}

impl FaceGroup {
    /// How messages name the group.
    pub fn label(&self) -> String {
        match &self.name {
            Some(name) => format!("\"{name}\" ({})", self.tag),
            None => self.tag.to_string(),
        }
    }
}

impl Triangulation {
    pub(super) fn take_groups(&mut self, mesh: &Mesh, face_kind: CellKind) -> Result<()> {
        let mut groups = Vec::new();
        // Where each block ends: a mesh may have as many blocks as cells.
        let ends = mesh.block_ends();
        let cell_of = |cell: u32| {
            let at = ends.partition_point(|&end| end <= cell as usize);
            let block = mesh.blocks.get(at)?;
            let nodes = block.cells().nth(cell as usize + block.len() - ends[at])?;
            Some((block.kind, nodes))
        };
        for group in mesh
            .groups
            .iter()
            .filter(|g| g.dim as usize + 1 == self.dim)
        {
            let mut faces = Vec::with_capacity(group.cells.len());
            for &cell in &group.cells {
                cancel::check()?;
                let Some((kind, nodes)) = cell_of(cell) else {
                    return Err(self.refuse(
                        format!(
                            "group {} names cell {cell}, which does not exist",
                            group.tag
                        ),
                        "repair the file",
                    ));
                };
                if kind != face_kind {
                    continue;
                }
                let mut key = nodes.to_vec();
                key.sort_unstable();
                // A marked face inside the domain has no boundary condition; a marked line
                // that belongs to no cell is an orphan.
                match self.find_face(&key) {
                    Some(face) if self.is_boundary(face) => faces.push(face as u32),
                    Some(_) => {}
                    None => {
                        return Err(self.refuse(
                            format!(
                                "the marked face {nodes:?} of group {} is a face of no cell",
                                group.tag
                            ),
                            "remove orphan lines or triangles, or mesh the domain next to them",
                        ));
                    }
                }
            }
            faces.sort_unstable();
            faces.dedup();
            if !faces.is_empty() {
                groups.push(FaceGroup {
                    tag: group.tag,
                    name: group.name.clone(),
                    faces,
                });
            }
        }
        self.groups = groups;
        Ok(())
    }

    pub(super) fn take_regions(&mut self, mesh: &Mesh, cell_kind: CellKind) -> Result<()> {
        // The cells here are those of this kind, in their order.
        let mut numbers: Vec<u32> = Vec::new();
        let groups = mesh.groups.iter();
        for group in groups.filter(|group| usize::from(group.dim) == self.dim) {
            cancel::check()?;
            if numbers.is_empty() {
                numbers.extend(mesh.cells_of(cell_kind).map(|(number, ..)| number));
            }
            let mut region = Group::new(group.dim, group.tag);
            region.name.clone_from(&group.name);
            let places = group.cells.iter().map(|cell| numbers.binary_search(cell));
            region.cells = places.flatten().map(|place| place as u32).collect();
            if !region.cells.is_empty() {
                self.regions.push(region);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{CellBlock, CellKind, Group, Mesh};
    use super::Triangulation;

    /// Regions count only the triangles, wherever lines are among the cells.
    #[test]
    fn regions_have_the_numbers_of_the_triangulation() {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let mut mesh = Mesh {
            points: corners.iter().map(|p| [p[0], p[1], 0.0]).collect(),
            blocks: vec![
                CellBlock::new(CellKind::Line, vec![0, 1, 1, 2]),
                CellBlock::new(CellKind::Triangle, vec![0, 1, 2]),
                CellBlock::new(CellKind::Line, vec![2, 3]),
                CellBlock::new(CellKind::Triangle, vec![0, 2, 3]),
            ],
            ..Mesh::default()
        };
        let mut group = |tag: i64, cells: &[u32]| {
            let mut group = Group::new(2, tag);
            group.cells = cells.to_vec();
            mesh.groups.push(group);
        };
        group(7, &[4]);
        group(8, &[2, 4]);
        group(9, &[]);
        let mesh = Triangulation::new("mesh", &mesh).unwrap();
        let regions = mesh.regions.iter();
        let regions: Vec<_> = regions.map(|of| (of.tag, of.cells.clone())).collect();
        assert_eq!(regions, [(7, vec![1]), (8, vec![0, 1])]);
    }
}
