//! The numbers of a form: integrals of what each code has found, all taken here, so that codes need not write them; and its results as meshes.

use std::collections::BTreeMap;

use super::{Code, FaceOff};
use crate::engine::{Left, with};
use crate::run::Written;
use faceoff_form::Problem;
use faceoff_form::own::Functionals;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::Results;
use faceoff_mesh::mesh::{CellBlock, Field, Mesh, Support, Values};

/// What is wrong with a number, with its place, and what to do; `None` if nothing is.
fn fault(form: &Problem, text: &str) -> Option<(String, String)> {
    let fault = Functionals::new(form).add(text).err()?;
    let what = format!("value, character {}: {}", fault.at + 1, fault.what);
    Some((what, fault.remedy))
}

impl FaceOff {
    /// Adds the numbers of the form, on this mesh, to what a code left, or why it has none.
    pub fn integrate(
        &self,
        code: &Code,
        mesh: Option<&Mesh>,
        parameters: &BTreeMap<String, String>,
        left: &mut Left,
    ) {
        let (Some(form), Some(mesh), false) = (&self.form, mesh, self.numbers.is_empty()) else {
            return;
        };
        match self.integrals(code, mesh, &with(form, parameters), left) {
            Ok(values) => {
                let names = self.numbers.iter().map(|asked| asked.name_in(code.name()));
                left.numbers.extend(names.map(str::to_owned).zip(values));
            }
            Err(error) => left.numberless = Some(error.to_string()),
        }
    }

    fn integrals(
        &self,
        code: &Code,
        source: &Mesh,
        form: &Problem,
        left: &Left,
    ) -> Result<Vec<f64>> {
        let mut all = Functionals::new(form);
        for text in self.numbers.iter().filter_map(|asked| asked.value.as_ref()) {
            all.add(text)
                .map_err(|fault| Error::usage(fault.what, fault.remedy))?;
        }
        self.first(code, left, |result, unit| all.of(source, result, unit))
    }

    /// What the first result of a code that has it says: a mesh whose fields are called as the face-off calls them, at the last time, and the
    /// relative error with which its numbers were written.
    ///
    /// # Errors
    /// That of the last result, or that there is none.
    pub fn first<T>(
        &self,
        code: &Code,
        left: &Left,
        ask: impl Fn(&Mesh, f64) -> Result<T>,
    ) -> Result<T> {
        let mut found = Err(Error::usage("it left no result", "let it write its fields"));
        for file in &left.results {
            let mut result = mesh(&*file.at(file.times.len() - 1)?);
            for asked in &self.fields {
                let called = asked.name_in(code.name());
                let mut fields = result.fields.iter_mut();
                if let Some(field) = fields.find(|field| field.name == called) {
                    field.name.clone_from(&asked.name);
                }
            }
            let units = result
                .fields
                .iter()
                .map(|field| Written::of(&field.values.to_f64()).unit());
            found = ask(&result, units.fold(0.0, f64::max));
            if found.is_ok() {
                break;
            }
        }
        found
    }
}

/// The mesh of a result with its fields on points and cells.
fn mesh(results: &Results) -> Mesh {
    let mut mesh = Mesh {
        points: results.points.clone(),
        ..Mesh::default()
    };
    let mut start = 0;
    for (kind, count) in &results.kinds {
        let cells = start..start + count;
        let nodes = cells.flat_map(|cell| results.cell(cell));
        mesh.blocks.push(CellBlock::new(*kind, nodes.collect()));
        start += count;
    }
    let supports = [
        (Support::Points, &results.on_points),
        (Support::Cells, &results.on_cells),
    ];
    for (on, fields) in supports {
        // What not all points have is no function.
        for field in fields.iter().filter(|field| field.at.is_none()) {
            let values = Values::F64(field.values.clone());
            let field = Field::new(field.name.as_str(), on, field.components, values);
            mesh.fields.push(field);
        }
    }
    mesh
}

/// What is wrong with the `value` of a field, or of a number of a form or of other files, and what to do. The numbers of a form are integrals, as its
/// scripts write fields only; those of other files are written by the codes.
pub(super) fn misplaced(
    value: Option<&str>,
    form_of_number: Option<&Problem>,
) -> Option<(String, String)> {
    let (what, remedy) = match (value, form_of_number) {
        (Some(text), Some(form)) => return fault(form, text),
        (Some(_), None) => ("only numbers of a form have a value", "leave value out"),
        (None, Some(_)) => (
            "scripts of forms write fields only, and this is a number",
            "give an integral of the solution, as in value = \"u*dx\"",
        ),
        (None, None) => return None,
    };
    Some((what.to_owned(), remedy.to_owned()))
}
