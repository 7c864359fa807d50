//! The numbers of a form and its fields on facets: integrals of what each code has found, all taken here, so that codes need not write them; and its
//! results as meshes.

use std::collections::BTreeMap;

use super::{Asked, Code, FaceOff};
use crate::engine::{self, Facets, Left, with};
use crate::run::Written;
use faceoff_form::Problem;
use faceoff_form::own::{Functionals, OnFacets, with_means};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::Results;
use faceoff_mesh::io::{self, Content};
use faceoff_mesh::mesh::{CellBlock, Field, Mesh, Support, Values};

/// What is wrong with a number or a field on facets, with its place, and what to do; `None` if nothing is.
fn fault(form: &Problem, texts: &[String], of_number: bool) -> Option<(String, String)> {
    let (k, fault) = match texts {
        [text] if of_number => (0, Functionals::new(form).add(text).err()?),
        _ if of_number => {
            let what = "a number has one value".to_owned();
            return Some((what, "give one integral of the solution".to_owned()));
        }
        texts => OnFacets::new(form, texts).err()?,
    };
    let component = match texts {
        [_] => String::new(),
        _ => format!(" {}", k + 1),
    };
    let what = format!(
        "value{component}, character {}: {}",
        fault.at + 1,
        fault.what
    );
    Some((what, fault.remedy))
}

impl FaceOff {
    /// Adds the numbers of the form, on this mesh, and its fields on facets to what a code left, or why it has none.
    pub fn integrate(
        &self,
        code: &Code,
        mesh: Option<&Mesh>,
        parameters: &BTreeMap<String, String>,
        left: &mut Left,
    ) {
        let (Some(form), Some(mesh)) = (&self.form, mesh) else {
            return;
        };
        let form = with(form, parameters);
        for asked in self.fields.iter().filter(|asked| asked.is_on_facets()) {
            let found = self.on_facets(code, mesh, &form, left, asked);
            let found = found.map_err(|error| error.to_string());
            left.on_facets.insert(asked.name.clone(), found);
        }
        if self.numbers.is_empty() {
            return;
        }
        match self.integrals(code, mesh, &form, left) {
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
        for text in self.numbers.iter().flat_map(|asked| &asked.value) {
            all.add(text)
                .map_err(|fault| Error::usage(fault.what, fault.remedy))?;
        }
        self.first(code, left, |result, unit| all.of(source, result, unit))
    }

    /// A field on facets at the last time.
    fn on_facets(
        &self,
        code: &Code,
        source: &Mesh,
        form: &Problem,
        left: &Left,
        asked: &Asked,
    ) -> Result<Facets> {
        let of = OnFacets::new(form, &asked.value)
            .map_err(|(_, fault)| Error::usage(fault.what, fault.remedy))?;
        let name = &asked.name;
        let found = self.first(code, left, |result, unit| of.of(name, source, result, unit))?;
        let time = left.results.iter().find_map(|file| file.times.last());
        let content = Content {
            mesh: found.mesh,
            ..Content::default()
        };
        let origin = format!("`{name}` of {}", code.name());
        let results = io::of_content(origin.as_ref(), content)?;
        Ok(Facets {
            written: engine::Written::made(results, time.copied().flatten()),
            scale: found.scale,
        })
    }

    /// What a code has found in a scene of elasticity: u and the mean stress of each cell; and on Γ_C the fields that codes are compared by, and the
    /// reaction.
    ///
    /// # Errors
    /// A result that is not there, or is not a function of the form's space.
    pub fn solution(
        &self,
        code: &Code,
        mesh: &Mesh,
        parameters: &BTreeMap<String, String>,
        left: &Left,
    ) -> Result<[Mesh; 2]> {
        let refuse = || Error::usage("it is no scene of elasticity", "verify it");
        let form = self.form.as_ref().ok_or_else(refuse)?;
        let parts = form.parts.as_ref().ok_or_else(refuse)?;
        let form = with(form, parameters);
        let all = 0..form.dim;
        let pairs = all.clone().map(|i| (i, i));
        let pairs = pairs.chain(
            all.clone()
                .flat_map(|i| (i + 1..form.dim).map(move |j| (i, j))),
        );
        let stress: Vec<String> = pairs.map(|(i, j)| format!("sigma(u)[{i}, {j}]")).collect();
        let cells = self.first(code, left, |result, unit| {
            with_means(&form, ("sigma", &stress), mesh, result, unit)
        })?;
        let reaction = [format!("reaction*ds([{}])", parts.contact.join(", "))];
        let mut facets: Option<Mesh> = None;
        let derived = self.fields.iter().filter(|asked| asked.is_on_facets());
        let derived = derived.map(|asked| (&*asked.name, &asked.value[..]));
        for (name, value) in [("reaction", &reaction[..])].into_iter().chain(derived) {
            let of = OnFacets::new(&form, value)
                .map_err(|(_, fault)| Error::usage(fault.what, fault.remedy))?;
            let found = self.first(code, left, |result, unit| of.of(name, mesh, result, unit))?;
            match &mut facets {
                // They are of the same facets, in the same order.
                Some(facets) => facets.fields.extend(found.mesh.fields),
                None => facets = Some(found.mesh),
            }
        }
        Ok([cells, facets.unwrap_or_default()])
    }

    /// What the first result of a code that has it says: a mesh whose fields are called as the face-off calls them, at the last time, and the
    /// relative error with which its numbers were written.
    ///
    /// # Errors
    /// The error of the last result, or that there is none.
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
        // A field without values at some points is not a function.
        for field in fields.iter().filter(|field| field.at.is_none()) {
            let values = Values::F64(field.values.clone());
            let field = Field::new(field.name.as_str(), on, field.components, values);
            mesh.fields.push(field);
        }
    }
    mesh
}

/// What is wrong with the `value` of a field, or of a number of a form or of other files, and what to do. The numbers of a form are integrals, as its
/// scripts write fields only; those of other files are written by the codes. A field of a form with a value is one on facets.
pub(super) fn misplaced(
    value: &[String],
    form: Option<&Problem>,
    of_number: bool,
) -> Option<(String, String)> {
    let (what, remedy) = match (value.is_empty(), form, of_number) {
        (false, Some(form), _) => return fault(form, value, of_number),
        (false, None, _) => (
            "only numbers of a form have a value, and fields on facets",
            "leave value out",
        ),
        (true, Some(_), true) => (
            "scripts of forms write fields only, and this is a number",
            "give an integral of the solution, as in value = \"u*dx\"",
        ),
        (true, ..) => return None,
    };
    Some((what.to_owned(), remedy.to_owned()))
}
