//! Face-off files: any problem, solved by the user's codes on one mesh or on separate ones, and compared field by field.
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
//! A form file has `[form]` instead of commands: the codes that it uses get their scripts from the form.

mod asked;
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

/// A problem, the codes that solve it, and the results to compare.
pub struct FaceOff {
    /// The name in the file.
    pub name: String,
    /// The description in the file; may be empty.
    pub about: String,
    /// The weak form from which codes get their scripts.
    pub form: Option<Problem>,
    mesh: Option<Source>,
    /// The axes of the levels, refinements ascending; empty if the mesh is used unrefined and no parameter is a list.
    axes: Vec<Axis>,
    /// As text for commands; for a list, the first value.
    pub parameters: BTreeMap<String, String>,
    /// The names of those that are real numbers.
    pub reals: BTreeSet<String>,
    /// At least two, with distinct names.
    pub codes: Vec<Code>,
    /// The fields to compare.
    pub fields: Vec<Asked>,
    /// The numbers to compare.
    pub numbers: Vec<Asked>,
    /// The spectra to compare.
    pub spectra: Vec<Spectrum>,
    /// The values for which everything is solved again.
    pub sweep: Option<Sweep>,
    /// Those that the data of the user's own codes have.
    pub symmetries: Vec<Image>,
    /// All that the file has, and who reads it: it is read again with other values.
    tables: toml::Table,
    reader: Reader,
}

/// The source of the mesh.
#[derive(Debug, Clone)]
enum Source {
    Given(Arc<Mesh>),
    File(PathBuf),
    Generated(Cuboid, Cells),
    /// A file that is built into the program.
    Carried(String, &'static [u8]),
}

/// A field, or a number, that all codes have.
#[derive(Debug, Clone)]
pub struct Asked {
    /// The name in reports.
    pub name: String,
    /// The names in codes that use a different one.
    pub names: BTreeMap<String, String>,
    /// What the codes share, which decides how it is judged.
    pub same: Same,
    /// Relative to the largest value; if codes only share the problem, to the norm on the finest mesh. Infinite if
    /// differences are reported and not judged.
    pub rtol: f64,
    /// Absolute, in the unit of the field or number.
    pub atol: f64,
    /// The entities that must carry it; `None`: any.
    pub on: Option<On>,
    /// The number of components that a field must have; in 2D, 3 are accepted for 2.
    pub components: Option<usize>,
    /// The exact solution, one formula per component; for a number, its value.
    pub exact: Vec<Formula>,
    /// The tolerance of a number on the finest mesh with respect to the exact one, relative to it.
    pub exact_rtol: Option<f64>,
    /// The theoretical orders in L² and H¹.
    pub orders: [Option<f64>; 2],
    /// The part of either mesh that the other need not cover.
    pub uncovered: Option<f64>,
    /// The times of a field to compare.
    pub times: Judged,
    /// What the problem leaves open in a field.
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
    /// The discrete problem: their answers are equal up to rounding.
    Discretisation,
    /// The continuous problem: their answers differ by the discretisation errors.
    Problem,
}

impl Asked {
    /// The name in a code.
    pub fn name_in(&self, code: &str) -> &str {
        self.names.get(code).unwrap_or(&self.name)
    }

    /// Is it a field of means on facets, which is derived here from the result of each code?
    pub fn is_on_facets(&self) -> bool {
        !self.is_number && !self.value.is_empty()
    }
}

/// Keys that a scene does not have.
const KINDS: [&str; 4] = ["codes", "form", "eigen", "elastic"];

/// Is this a scene of elasticity, by its name or file? False if it cannot be read.
pub fn is_elastic(path: &Path) -> bool {
    let is_builtin = path
        .to_str()
        .is_some_and(|name| elastic::builtin(name).is_some());
    is_builtin || file::text(path).is_ok_and(|text| elastic::is_elastic(&text))
}

/// Is this a face-off file, a form file, or a scene of elasticity (by its name or file), rather than another scene? False if it cannot
/// be read.
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
    /// The task of the codes on a level.
    pub fn problem(&self, level: &Level, mesh: Option<&Mesh>) -> Value {
        json!({
            "parameters": level.parameters(&self.parameters),
            "n": level.n,
            "mesh digest": mesh.map(Mesh::digest),
        })
    }

    /// Reads a face-off file; its relative paths refer to its folder.
    ///
    /// # Errors
    /// A file that cannot be read, unknown keys, settings that could not be judged, unknown placeholders.
    pub fn read(path: &Path) -> Result<Self> {
        FaceOff::read_by(path, &Method::cr(), &[])
    }

    /// The same; a scene of elasticity is solved by this method in these codes, or if none is named in our solver and in those with a handwritten scheme.
    ///
    /// # Errors
    /// Errors of [`FaceOff::read`].
    pub fn read_by(path: &Path, method: &Method, codes: &[String]) -> Result<Self> {
        let (reader, text) = Reader::open(path, method, codes)?;
        reader.read(&text)
    }

    /// From the text of a form without a mesh, on this one.
    ///
    /// # Errors
    /// Errors of [`FaceOff::read`].
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

    /// Removes the codes of a form that cannot solve it here, or only those that cannot solve it anywhere, and returns them with the reasons.
    pub fn without_missing(&mut self, only_unable: bool) -> Vec<(String, String)> {
        let all = std::mem::take(&mut self.codes);
        let is_out = |code: &Code| match only_unable {
            true => code.is_unable(),
            false => code.missing().is_some(),
        };
        let (missing, there) = all.into_iter().partition(is_out);
        self.codes = there;
        let missing: Vec<Code> = missing;
        let told = missing.iter().map(|code| {
            let why = code.missing().unwrap_or_default();
            (code.name().to_owned(), why.to_owned())
        });
        told.collect()
    }

    /// With different refinements.
    ///
    /// # Errors
    /// A number of refinements that differs from that of a parameter's values.
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

    /// The mesh at a refinement; `None` if every code makes a separate one.
    ///
    /// # Errors
    /// A file that cannot be read or refined to this level; [`Error::Ended`].
    pub fn mesh(&self, n: Option<usize>) -> Result<Option<Mesh>> {
        let source = self.mesh.as_ref();
        source.map(|source| source.mesh(&self.name, n)).transpose()
    }
}

impl Source {
    /// The mesh at a refinement, from the file of this name.
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
                        what: format!("n = {times} is not a power of two"),
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

/// Some readers, such as that of dolfinx, skip cells that are in no group; if no cell is in one, one group gets all cells.
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
