//! A result on the cells of a form's mesh, with the means on each cell of what is derived from it, such as the stress.

use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::{Field, Mesh, Support, Values};

use super::functional::Functionals;
use super::output::output;
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
    let (assembler, u) = all.read(source, result, unit)?;
    let sums = all.on_cells(&assembler, &u);
    let means = sums.chunks(all.count).flat_map(|of_cell| {
        let measure = of_cell[all.count - 1];
        of_cell[..all.count - 1]
            .iter()
            .map(move |sum| sum / measure)
    });
    let means = Values::F64(means.collect::<Vec<f64>>().into());
    let (mut cells, mut fields) = output(&assembler, &u);
    // The test function without a name.
    fields.truncate(problem.unknowns.len());
    fields.push(Field::new(name, Support::Cells, components.len(), means));
    cells.fields = fields;
    Ok(cells)
}
