//! A result on the cells of a form's mesh, with the means on each cell of what is derived from it, such as the stress.

use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::{Field, Mesh, Support, Values};

use super::assemble::{Assembler, Wanted};
use super::batch::State;
use super::functional::Functionals;
use super::output::output;
use super::read::read;
use crate::problem::Problem;

/// The unknowns of a result, whose numbers were written with this relative error, and a field of the means of formulas, one for each component.
///
/// # Errors
/// A formula that is not in the language; a result on another mesh, fields that are missing or are not functions of the spaces.
pub fn with_means(
    problem: &Problem,
    (name, components): (&str, &[String]),
    source: &Mesh,
    result: &Mesh,
    unit: f64,
) -> Result<Mesh> {
    let mut all = Functionals::new(problem);
    // The last one is the measure of a cell.
    for text in components.iter().map(String::as_str).chain(["1"]) {
        all.add(&format!("({text})*dx"))
            .map_err(|fault| Error::usage(fault.what, fault.remedy))?;
    }
    let assembler = Assembler::of(&all.problem, source, &all.integrals, false)?;
    let Assembler { mesh, dofs, .. } = &assembler;
    let u = read(&assembler, result, unit)?;
    let parameters: Vec<f64> = all.problem.parameters.iter().map(|p| p.value).collect();
    let state = State {
        u: &u,
        old: &[],
        parameters: &parameters,
    };
    let weight = all.problem.unknowns.len() - 1;
    let mut sums = vec![0.0; mesh.cell_count() * all.count];
    for (k, owner) in all.owners.iter().enumerate() {
        let system = assembler.assemble_only(k, state, Wanted::Residual);
        for cell in 0..mesh.cell_count() {
            let nodes = dofs.of_cell(weight, cell).iter();
            let of_cell = nodes.flat_map(|node| dofs.of_node(*node));
            let sum: f64 = of_cell.map(|dof| system.residual[dof]).sum();
            sums[cell * all.count + owner] += sum;
        }
    }
    let means = sums.chunks(all.count).flat_map(|of_cell| {
        let measure = of_cell[all.count - 1];
        of_cell[..all.count - 1]
            .iter()
            .map(move |sum| sum / measure)
    });
    let means = Values::F64(means.collect::<Vec<f64>>().into());
    let (mut cells, mut fields) = output(&assembler, &u);
    // The test function without a name.
    fields.truncate(weight);
    fields.push(Field::new(name, Support::Cells, components.len(), means));
    cells.fields = fields;
    Ok(cells)
}
