//! P1 at the dofs of another element.

use crate::element::Space;

/// The values of P1's basis functions at the dofs.
pub(crate) struct VertexValues<'a> {
    space: &'a Space<'a>,
    /// A cell and local number of each dof.
    place: Vec<(u32, u8)>,
}

impl<'a> VertexValues<'a> {
    pub fn new(space: &'a Space<'a>) -> Self {
        let mut place = vec![(0, 0); space.dofs];
        for cell in 0..space.mesh.cell_count() {
            for (local, &dof) in (0..).zip(space.cell_dofs(cell)) {
                place[dof as usize] = (cell as u32, local);
            }
        }
        VertexValues { space, place }
    }

    pub fn of(&self, dof: u32) -> impl Iterator<Item = (u32, f64)> + '_ {
        let (cell, local) = self.place[dof as usize];
        let node = self.space.nodes[local as usize];
        let vertices = self.space.mesh.cell(cell as usize);
        let values = vertices.iter().copied().zip(node);
        values.filter(|(_, value)| *value != 0.0)
    }
}
