//! A face-off file: any problem, solved by codes of one's own on one mesh or on their own, field by field against each other.
//!
//! ```toml
//! name = "cantilever"
//! [mesh]
//! file = "cantilever.msh"
//! n = [1, 2]
//! [parameters]
//! E = 2.1e11
//! [codes.freefem]
//! command = ["FreeFem++-nw", "cantilever.edp", "-mesh", "{mesh}", "-E", "{E}", "-out", "{out}"]
//! mesh = "msh2"
//! result = "u.vtu"
//! [codes.dolfinx]
//! command = ["python3", "cantilever.py", "{mesh}", "{out}", "--E", "{E}"]
//! mesh = "xdmf"
//! result = "u.xdmf"
//! [fields.u]
//! same = "discretisation"
//! rtol = 1e-10
//! ```
//!
//! The file of a weak form has `[form]` instead of commands: the codes that it uses get their scripts from the form.

mod code;
mod form;
mod formula;
mod integrals;
mod level;
mod parameters;
mod source;
mod spectra;
mod sweep;
mod tables;
mod times;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

pub use code::Code;
pub use form::FormFile;
pub use formula::{Formula, words};
pub use level::{Label, Level};
pub use spectra::Spectrum;
pub use sweep::{DT, Point, Sweep, place, rounded};
pub use times::Judged;

use faceoff_fem::contact::Method;
use faceoff_form::Problem;
use faceoff_form::elastic;
use faceoff_form::grid::Cells;
use faceoff_form::image::Image;
use faceoff_judge::{On, UpTo};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::file;
use faceoff_mesh::io;
use faceoff_mesh::mesh::generate::{Cuboid, lattice_mesh, union_mesh};
use faceoff_mesh::mesh::{Group, Mesh, refine};
use level::Axis;
use tables::Reader;

/// A problem, the codes that solve it, and what they are asked for.
pub struct FaceOff {
    /// As the file has it.
    pub name: String,
    /// What the problem is, in the file's words; may be empty.
    pub about: String,
    /// The weak form from which codes get their scripts.
    pub form: Option<Problem>,
    mesh: Option<Source>,
    /// Along which levels lie, refinements ascending; none where the mesh is taken as it is and no parameter is a list.
    axes: Vec<Axis>,
    /// As commands get them; of one that is a list, the first.
    pub parameters: BTreeMap<String, String>,
    /// The names of those that are real numbers.
    pub reals: BTreeSet<String>,
    /// At least two, each of another name.
    pub codes: Vec<Code>,
    /// Those that are compared.
    pub fields: Vec<Asked>,
    /// Those that are compared.
    pub numbers: Vec<Asked>,
    /// Those that are compared.
    pub spectra: Vec<Spectrum>,
    /// The values for which all is solved again.
    pub sweep: Option<Sweep>,
    /// Those that the data of the user's own codes have.
    pub symmetries: Vec<Image>,
    /// All that the file has, and who reads it: it is read again with other values.
    tables: toml::Table,
    reader: Reader,
}

/// Where the mesh comes from.
#[derive(Debug, Clone)]
enum Source {
    Given(Arc<Mesh>),
    File(PathBuf),
    Generated(Cuboid, Cells),
    /// A file that the program carries.
    Carried(String, &'static [u8]),
}

/// A field, or a number, that all codes have.
#[derive(Debug, Clone)]
pub struct Asked {
    /// As reports call it.
    pub name: String,
    /// Where a code calls it otherwise.
    pub names: BTreeMap<String, String>,
    /// What the codes share, which decides how it is judged.
    pub same: Same,
    /// Relative to the largest value; where codes share the problem only, to the norm on the finest mesh. Infinite where
    /// differences are told and not judged.
    pub rtol: f64,
    /// In the unit of the field or number.
    pub atol: f64,
    /// What must carry it; none: anything may.
    pub on: Option<On>,
    /// How many a field must have; in the plane, 2 may stand as 3.
    pub components: Option<usize>,
    /// The solution, a formula for each component; of a number, its value.
    pub exact: Vec<Formula>,
    /// How far a number on the finest mesh may be from the exact one, relative to it.
    pub exact_rtol: Option<f64>,
    /// The orders of theory in L² and H¹.
    pub orders: [Option<f64>; 2],
    /// The part of either mesh that the other need not cover.
    pub uncovered: Option<f64>,
    /// Of a field.
    pub times: Judged,
    /// Of a field: what its problem leaves open.
    pub up_to: Vec<UpTo>,
    /// Of a number of a form: the integral that it is. Of a field of a form that is derived on facets: an integral for each component.
    pub value: Vec<String>,
    /// Is it a number?
    pub is_number: bool,
}

/// What codes share.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Same {
    /// The discrete problem: their answers are equal but for rounding.
    Discretisation,
    /// The continuous one: their answers differ by the error of either.
    Problem,
}

impl Asked {
    /// What a code calls it.
    pub fn name_in(&self, code: &str) -> &str {
        self.names.get(code).unwrap_or(&self.name)
    }

    /// Is it a field of means on facets, which is derived here from the result of each code?
    pub fn is_on_facets(&self) -> bool {
        !self.is_number && !self.value.is_empty()
    }
}

/// What a scene has not.
const KINDS: [&str; 4] = ["codes", "form", "eigen", "elastic"];

/// Is this a scene of elasticity, by its name or file? What cannot be read is none.
pub fn is_elastic(path: &Path) -> bool {
    let is_builtin = path
        .to_str()
        .is_some_and(|name| elastic::builtin(name).is_some());
    is_builtin || file::text(path).is_ok_and(|text| elastic::is_elastic(&text))
}

/// Is this the file of a face-off, of a form, or of a scene of elasticity, which is one too, or the name of such a scene, rather than another scene? What cannot
/// be read is none of them.
pub fn is_face_off(path: &Path) -> bool {
    if path
        .to_str()
        .is_some_and(|name| elastic::builtin(name).is_some())
    {
        return true;
    }
    let table = file::text(path)
        .ok()
        .and_then(|text| text.parse::<toml::Table>().ok());
    table.is_some_and(|table| KINDS.iter().any(|key| table.contains_key(*key)))
}

impl FaceOff {
    /// What codes are asked on a level.
    pub fn problem(&self, level: &Level, mesh: Option<&Mesh>) -> Value {
        json!({
            "parameters": level.parameters(&self.parameters),
            "n": level.n,
            "mesh digest": mesh.map(Mesh::digest),
        })
    }

    /// Reads a face-off file; its relative paths start beside it.
    ///
    /// # Errors
    /// A file that cannot be read, unknown keys, what could not be judged, placeholders that are not known.
    pub fn read(path: &Path) -> Result<Self> {
        FaceOff::read_by(path, &Method::cr(), &[])
    }

    /// The same; a scene of elasticity is solved by this method in these codes, where none is named in our solver and in those with a scheme by hand.
    ///
    /// # Errors
    /// As [`FaceOff::read`].
    pub fn read_by(path: &Path, method: &Method, codes: &[String]) -> Result<Self> {
        let (reader, text) = Reader::open(path, method, codes)?;
        reader.read(&text)
    }

    /// Of the text of a form without a mesh, on this one.
    ///
    /// # Errors
    /// As [`FaceOff::read`].
    pub fn on(text: &str, mesh: Mesh) -> Result<Self> {
        let reader = Reader {
            origin: "form.toml".to_owned(),
            home: ".".into(),
            given: Some(Arc::new(mesh)),
            scene: None,
            is_carried: false,
        };
        reader.read(text)
    }

    /// Takes out the codes of a form that cannot solve it here, and returns them with the reasons.
    pub fn without_missing(&mut self) -> Vec<(String, String)> {
        let all = std::mem::take(&mut self.codes);
        let (missing, there) = all.into_iter().partition(|code| code.missing().is_some());
        self.codes = there;
        let missing: Vec<Code> = missing;
        let told = missing.iter().map(|code| {
            let why = code.missing().unwrap_or_default();
            (code.name().to_owned(), why.to_owned())
        });
        told.collect()
    }

    /// With other refinements.
    ///
    /// # Errors
    /// Not as many as a parameter has values.
    pub fn with_n(mut self, mut n: Vec<usize>) -> Result<Self> {
        n.sort_unstable();
        let list: Vec<i64> = n.iter().map(|n| *n as i64).collect();
        let mesh = self.tables.entry("mesh");
        let mesh = mesh.or_insert_with(|| toml::Table::new().into());
        if let Some(mesh) = mesh.as_table_mut() {
            mesh.insert("n".to_owned(), list.into());
        }
        sweep::forget(&mut self.tables, [&"n".to_owned()].into_iter());
        self.axes.retain(|axis| !axis.is_refinement());
        self.axes.splice(0..0, Axis::refinements(&n));
        Level::all(&self.axes).map_err(|what| {
            let remedy = "give one refinement, or as many as the parameter has values";
            Error::usage(what, remedy)
        })?;
        Ok(self)
    }

    /// Of a scene of elasticity: the parameter that is its friction.
    pub fn friction(&self) -> Option<String> {
        let given = self.reader.scene.as_ref()?.friction.clone()?;
        self.parameters.contains_key(&given).then_some(given)
    }

    /// What to run, the coarsest first; one level where the mesh is as it is and no parameter is a list.
    pub fn levels(&self) -> Vec<Level> {
        // Their lengths were checked when they were given.
        Level::all(&self.axes).unwrap_or_default()
    }

    /// The names of real parameters that its levels do not vary.
    pub fn free(&self) -> BTreeSet<&str> {
        let varying: Vec<&Axis> = self.axes.iter().filter(|a| a.values.len() > 1).collect();
        let is_free = |name: &&str| !varying.iter().any(|axis| axis.name == *name);
        self.reals
            .iter()
            .map(String::as_str)
            .filter(is_free)
            .collect()
    }

    /// The mesh at a refinement; none where every code makes its own.
    ///
    /// # Errors
    /// A file that cannot be read or refined so often; [`Error::Ended`].
    pub fn mesh(&self, n: Option<usize>) -> Result<Option<Mesh>> {
        let source = self.mesh.as_ref();
        source.map(|source| source.mesh(&self.name, n)).transpose()
    }
}

impl Source {
    /// The mesh at a refinement, of the file of this name.
    fn mesh(&self, name: &str, n: Option<usize>) -> Result<Mesh> {
        let mut mesh = match self {
            Source::Given(mesh) => Mesh::clone(mesh),
            Source::Generated(cuboid, Cells::Simplices) => union_mesh(n.unwrap_or(16), cuboid)?,
            Source::Generated(cuboid, Cells::Cubes) => lattice_mesh(n.unwrap_or(16), cuboid)?,
            Source::File(_) | Source::Carried(..) => {
                let mut mesh = match self {
                    Source::Carried(name, bytes) => io::parse(name.as_ref(), bytes, None)?.mesh,
                    Source::File(path) => io::read(path)?,
                    Source::Generated(..) | Source::Given(_) => Mesh::default(),
                };
                let times = n.unwrap_or(1);
                if !times.is_power_of_two() {
                    return Err(Error::Scene {
                        scene: name.to_owned(),
                        place: "mesh".into(),
                        what: format!("n = {times} is no power of two"),
                        remedy: "give n of 1, 2, 4, …: how often each edge of the file's mesh is divided"
                            .into(),
                    });
                }
                for _ in 0..times.trailing_zeros() {
                    (mesh, _) = refine::refine(name, &mesh)?;
                }
                mesh
            }
        };
        group_cells(&mut mesh);
        Ok(mesh)
    }
}

/// Some readers, as that of dolfinx, leave out cells that are in no group: where no cell is, all are in one.
fn group_cells(mesh: &mut Mesh) {
    let dim = mesh.dim();
    if mesh.groups.iter().any(|group| group.dim == dim) {
        return;
    }
    let mut start = 0;
    let mut group = Group::new(dim, 1);
    group.name = Some("domain".to_owned());
    for block in &mesh.blocks {
        let cells = start..start + block.len() as u32;
        start = cells.end;
        if block.kind.dim() == dim {
            group.cells.extend(cells);
        }
    }
    mesh.groups.push(group);
}
