//! The positions of dofs.

use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::io::DofTable;
use faceoff_mesh::mesh::{Field, Support, Values};

use super::assemble::Assembler;
use super::element::{Shape, carriers};
use super::output::output;
use super::read::read;

/// The unknown, the component and the position of each dof.
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

/// The table of all dofs: their positions, and their values for constant fields.
///
/// # Errors
/// More unknowns, or more components, than a table allows.
pub fn dof_table(assembler: &Assembler) -> Result<DofTable> {
    let Assembler { problem, mesh, .. } = assembler;
    let count = assembler.dofs.count();
    let mut all = DofTable {
        names: problem
            .unknowns
            .iter()
            .map(|unknown| unknown.name.clone())
            .collect(),
        direction: vec![[0.0; 3]; count],
        ..DofTable::default()
    };
    for (dof, (unknown, component, at)) in places(assembler).into_iter().enumerate() {
        let field = u16::try_from(unknown)
            .map_err(|_| Error::usage("there are too many unknowns", "use fewer"))?;
        all.field.push(field);
        all.at.push(at);
        if !problem.unknowns[unknown].space.element.is_vector() {
            let Some(along) = all.direction[dof].get_mut(component) else {
                let what = format!(
                    "{} has more than three components, for which a table of dofs has no directions",
                    problem.unknowns[unknown].name
                );
                return Err(Error::usage(what, "compare its fields"));
            };
            *along = 1.0;
        }
    }
    let is_moment = |dof: usize| {
        problem.unknowns[usize::from(all.field[dof])]
            .space
            .element
            .is_vector()
    };
    let moments: Vec<usize> = (0..count).filter(|dof| is_moment(*dof)).collect();
    if moments.is_empty() {
        return Ok(all);
    }
    let (mut cells, fields) = output(assembler, &vec![0.0; count]);
    for axis in 0..mesh.dim {
        let constant = |field: &Field| {
            let width = field.components;
            let values: Vec<f64> = (0..cells.points.len() * width)
                .map(|k| if k % width == axis { 1.0 } else { 0.0 })
                .collect();
            Field::new(
                field.name.clone(),
                Support::Points,
                width,
                Values::F64(values.into()),
            )
        };
        let constants = fields.iter().map(constant).collect();
        cells.fields = constants;
        let values = read(assembler, &cells, f64::EPSILON)?;
        moments
            .iter()
            .for_each(|dof| all.direction[*dof][axis] = values[*dof]);
    }
    Ok(all)
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
