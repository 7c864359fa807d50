//! Reads a field from a file of any code as a function of a finite element space.
//!
//! The entities that carry the values determine the space: points of linear or quadratic cells, corners of cells, faces, or positions.
//! A function that is linear on each cell is P1 if it is continuous, CR if it is continuous at the midpoints of faces, and
//! otherwise neither. Nothing is projected: the function is that in the file, or it is rejected.

mod cells;
mod field;
mod parts;
mod table;

use std::path::Path;

use serde::Serialize;

use super::written::Written;
use crate::engine::meshio_python;
use faceoff_fem::contact::{Method, Problem};
use faceoff_fem::element::Element;
use faceoff_fem::scene::{MeshSource, Scene};
use faceoff_mesh::error::{Error, Place, Result};
use faceoff_mesh::field::{ResultField, Results};
use faceoff_mesh::file;
use faceoff_mesh::io;
use faceoff_mesh::mesh::Triangulation;
use parts::divide;

/// The relative tolerance, with respect to the largest value, for numbers in binary64 and for those that a code rounded to binary32.
const NEAR: [f64; 2] = [1e-9, 1e-6];
/// Values on Γ_D that agree with g up to this, relative to the largest value, are replaced by g.
const TAKEN: f64 = 1e-6;
/// Deviations below this are rounding, and not reported.
const ROUNDING: f64 = 1e-12;
/// No point, or no number.
const NONE: u32 = u32::MAX;

/// How a file is to be read if it does not determine that.
#[derive(Default)]
pub struct Options<'a> {
    /// The name of the field; `None`: the only one.
    pub field: Option<&'a str>,
    /// The method whose function it is; `None`: determined from the values.
    pub element: Option<&'static dyn Element>,
    /// The mesh of the result, instead of that in the file.
    pub mesh: Option<&'a Path>,
    /// The refinement of the scene's mesh, for a file without one.
    pub n: Option<usize>,
}

/// A field of a file as a function u of the space of an element on a mesh.
pub struct Foreign {
    /// The one that u is on.
    pub mesh: Triangulation,
    /// The one whose function u is.
    pub element: &'static dyn Element,
    /// u at all dofs.
    pub u: Vec<f64>,
    /// The precision of the values in the file.
    pub written: Written,
    /// How the file was read, for the report.
    pub understood: Understood,
}

/// How a file was read.
#[derive(Debug, Clone, Serialize)]
pub struct Understood {
    /// The name of the field in the file.
    pub field: String,
    /// `P1`, `P2` or `CR`.
    pub element: &'static str,
    /// The entities that carry the values: points, corners, faces, vertices, places.
    pub values: &'static str,
    /// The name of the mesh: that of a file, or of the scene's mesh.
    pub mesh: String,
    /// The parts of the boundary are those of the mesh's groups, or of the scene's mesh at the same position.
    pub boundary: &'static str,
}

impl Understood {
    /// The description on one line.
    pub fn sentence(&self) -> String {
        format!(
            "field `{}`, values at {}, is a function of {} on mesh {}; the parts of its boundary are by {}",
            self.field, self.values, self.element, self.mesh, self.boundary
        )
    }
}

impl Foreign {
    /// Reads the result of a scene.
    ///
    /// # Errors
    /// A file that cannot be read; no field of the requested name, or too many; a field that is not a function of P1, P2 or CR; a mesh
    /// that is not of the scene's domain.
    pub fn read(path: &Path, scene: &Scene, options: &Options) -> Result<Self> {
        let bytes = file::read(path)?;
        let held = io::read_results(path, &bytes, meshio_python().as_deref())?;
        drop(bytes);
        let given = options.mesh.map(|mesh| on_file(scene, mesh)).transpose()?;
        let top = held.dimensions().last().copied().map(usize::from);
        let of_given = given.as_ref().map(|mesh| mesh.dim);
        let dim = of_given.or_else(|| scene.source().dim());
        let dim = dim.or(top).unwrap_or(2);
        let reader = Reader {
            path,
            held: &held,
            options,
            dim,
        };
        let own = |given: Option<Triangulation>| match given {
            Some(mesh) => Ok(mesh),
            None => scene.triangulation(options.n),
        };
        let mut found = match top {
            Some(top) if top == dim => reader.cells(given)?,
            Some(top) if top + 1 == dim => reader.faces(own(given)?)?,
            None | Some(0) if held.width > 1 => reader.faces(own(given)?)?,
            None | Some(0) => reader.table(own(given)?)?,
            Some(top) => {
                return Err(reader.refuse(
                    format!(
                        "its cells are of dimension {top}, and scene {} is {dim}D",
                        scene.name()
                    ),
                    "give a result of this scene",
                ));
            }
        };
        found.understood.boundary = divide(scene, &mut found.mesh)?;
        Ok(found)
    }

    /// The usual method of the field's element. The bounds are valid for any; the flux on Γ_C that they use is the method's.
    pub fn method(&self) -> Method {
        let name = self.element.name().to_lowercase();
        name.parse()
            .expect("invariant: every element names a method")
    }
}

/// Replaces the values on Γ_D by g if all agree up to rounding, also to binary32; returns the largest deviation relative
/// to the largest value, if it is worth reporting.
pub fn take_boundary_values(problem: &Problem, u: &mut [f64]) -> Option<f64> {
    let largest = largest(u);
    let held = || problem.dirichlet.iter().enumerate();
    let held = || held().filter_map(|(dof, g)| Some((dof, (*g)?)));
    let off = held().fold(0.0, |most: f64, (dof, g)| match (u[dof] - g).abs() {
        0.0 => most,
        // Negated so that NaN is not replaced by g.
        off if !(off <= TAKEN * largest.max(g.abs())) => f64::INFINITY,
        off => most.max(off / largest.max(g.abs())),
    });
    if off.is_infinite() {
        return None;
    }
    for (dof, g) in held() {
        u[dof] = g;
    }
    Some(off).filter(|off| *off > ROUNDING)
}

/// A mesh file instead of the scene's, as for `solve --mesh`.
fn on_file(scene: &Scene, path: &Path) -> Result<Triangulation> {
    let source = MeshSource::File {
        path: path.to_owned(),
        n: None,
        dim: scene.source().dim(),
    };
    scene.with_source(source)?.triangulation(None)
}

/// A file with the settings for reading it.
struct Reader<'a> {
    path: &'a Path,
    held: &'a Results,
    options: &'a Options<'a>,
    dim: usize,
}

impl Reader<'_> {
    fn refuse(&self, what: String, remedy: impl Into<String>) -> Error {
        Error::file(self.path, Place::Whole, what, remedy)
    }

    fn row(&self, field: &ResultField, item: u32, what: &str) -> Result<f64> {
        let value = field.row_of(item).and_then(|row| field.values.get(row));
        value.copied().ok_or_else(|| {
            let what = format!("`{}` has no value at {what} {item}", field.name);
            self.refuse(what, "give a field of the whole domain")
        })
    }

    fn found(
        &self,
        mesh: Triangulation,
        element: &'static dyn Element,
        u: Vec<f64>,
        (values, field): (&'static str, &ResultField),
    ) -> Foreign {
        let understood = Understood {
            field: field.name.clone(),
            element: element.name(),
            values,
            mesh: mesh.name.clone(),
            boundary: "",
        };
        Foreign {
            mesh,
            element,
            u,
            written: Written::of(&field.values),
            understood,
        }
    }
}

fn largest(values: &[f64]) -> f64 {
    values
        .iter()
        .fold(0.0, |most: f64, value| most.max(value.abs()))
}

/// Are all of these binary32?
fn is_rounded<'a>(mut values: impl Iterator<Item = &'a f64>) -> bool {
    values.all(|x| f64::from(*x as f32) == *x)
}

/// The distance up to which points are at the same position.
fn near(points: &[[f64; 3]]) -> f64 {
    let extent = |k: usize| {
        let of = points.iter().map(|p| p[k]);
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = of.fold(ends, |(low, high), x| (low.min(x), high.max(x)));
        high - low
    };
    let rounded = is_rounded(points.iter().flatten());
    NEAR[usize::from(rounded)] * (0..3).map(extent).fold(0.0, f64::max)
}
