//! Where dofs are.

use faceoff_mesh::io::DofTable;

use super::assemble::Assembler;
use super::element::{Shape, carriers};

/// The unknown, the component and the place of each dof.
pub fn places(assembler: &Assembler) -> Vec<(usize, usize, [f64; 3])> {
    let Assembler {
        problem,
        mesh,
        dofs,
        ..
    } = assembler;
    let mut all = vec![(0, 0, [0.0; 3]); dofs.count()];
    for (k, unknown) in problem.unknowns.iter().enumerate() {
        let element = unknown.space.element;
        let nodes: Vec<[f64; 4]> = match element.is_vector() {
            false => Shape::of(element, mesh.shape).nodes(mesh.dim),
            true => carriers(element, mesh.dim)
                .into_iter()
                .map(|carrier| centre(mesh.dim, carrier))
                .collect(),
        };
        for cell in 0..mesh.cell_count() {
            let vertices = mesh.vertices(cell);
            for (node, lambda) in dofs.of_cell(k, cell).iter().zip(&nodes) {
                for (component, dof) in dofs.of_node(*node).enumerate() {
                    all[dof] = (k, component, mesh.place(&vertices, lambda));
                }
            }
        }
    }
    all
}

/// The table of all dofs of spaces that have values at nodes; none of moments on facets or edges.
pub fn dof_table(assembler: &Assembler) -> Option<DofTable> {
    let unknowns = &assembler.problem.unknowns;
    if unknowns.iter().any(|unknown| unknown.space.element.is_vector()) {
        return None;
    }
    let mut all = DofTable {
        names: unknowns.iter().map(|unknown| unknown.name.clone()).collect(),
        ..DofTable::default()
    };
    for (unknown, component, at) in places(assembler) {
        let mut direction = [0.0; 3];
        *direction.get_mut(component)? = 1.0;
        all.field.push(u16::try_from(unknown).ok()?);
        all.at.push(at);
        all.direction.push(direction);
    }
    Some(all)
}

/// The centre of a facet or edge that carries a dof.
pub fn centre(dim: usize, [a, b]: [usize; 2]) -> [f64; 4] {
    let mut lambda = [0.0; 4];
    match a == b {
        true => {
            lambda[..=dim].fill(1.0 / dim as f64);
            lambda[a] = 0.0;
        }
        false => (lambda[a], lambda[b]) = (0.5, 0.5),
    }
    lambda
}
