//! Meshes with their fields: as a file holds them, and as Python sees them.

use std::path::PathBuf;

use faceoff::cli::mesh::options_of;
use faceoff::engine::meshio_python;
use faceoff_mesh::CellKind;
use faceoff_mesh::field::GlobalValues;
use faceoff_mesh::io::{self, Content};
use faceoff_mesh::mesh::{Shape, Values};
use numpy::ndarray::ArrayView2;
use numpy::{Element, PyArray2, PyArrayMethods as _};
use pyo3::prelude::*;

use crate::arrays::Arrays;
use crate::call::run;
use crate::error::{raised, usage};

/// A mesh with its fields. Its arrays show its own memory, which cannot be changed.
#[pyclass(frozen, module = "faceoff_fem._core")]
pub struct Mesh {
    pub source: String,
    pub content: Content,
}

/// A field: name, carrier, values, the numbers of those that carry it where not all do, and its time.
type Shown<'py> = (
    String,
    String,
    Bound<'py, PyAny>,
    Option<Bound<'py, PyAny>>,
    Option<f64>,
);

/// A group: name, dimension, number, cells.
type Grouped<'py> = (Option<String>, u8, i64, Bound<'py, PyAny>);

/// Data about the whole: name, and numbers or texts.
type About<'py> = (String, Bound<'py, PyAny>);

#[pymethods]
impl Mesh {
    #[new]
    fn new(py: Python<'_>, arrays: Arrays) -> PyResult<Self> {
        // It lives on, and who gave the arrays may change them.
        let (source, content) = arrays.owned().content().map_err(|e| raised(py, &e))?;
        Ok(Mesh { source, content })
    }

    #[getter]
    fn source(&self) -> &str {
        &self.source
    }

    #[getter]
    fn format(&self) -> &str {
        &self.content.format
    }

    /// Oddities of the file, and what it holds but the mesh does not.
    #[getter]
    fn remarks(&self) -> Vec<String> {
        let unread = self.content.unread.iter();
        let unread = unread.map(|part| format!("not read: {part}"));
        self.content
            .warnings
            .iter()
            .cloned()
            .chain(unread)
            .collect()
    }

    /// Coordinates, three a point.
    #[getter]
    fn points<'py>(this: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        shown(this, 3, this.get().content.mesh.points.as_flattened())
    }

    /// The cells block by block: the name of their type, Gmsh's number of it (0 where it has none), and their points.
    #[getter]
    fn cells<'py>(this: &Bound<'py, Self>) -> PyResult<Vec<(String, u8, Bound<'py, PyAny>)>> {
        let blocks = this.get().content.mesh.blocks.iter();
        let cells = blocks.map(|block| {
            let nodes = shown(this, block.kind.points(), &block.nodes)?;
            Ok((block.kind.to_string(), block.kind.gmsh(), nodes))
        });
        cells.collect()
    }

    #[getter]
    fn fields<'py>(this: &Bound<'py, Self>) -> PyResult<Vec<Shown<'py>>> {
        let fields = this.get().content.mesh.fields.iter();
        let fields = fields.map(|field| {
            let values = values(this, field.components, &field.values)?;
            let at = match field.at.is_empty() {
                true => None,
                false => Some(shown(this, 1, &field.at)?),
            };
            Ok((
                field.name.clone(),
                field.on.to_string(),
                values,
                at,
                field.time,
            ))
        });
        fields.collect()
    }

    #[getter]
    fn groups<'py>(this: &Bound<'py, Self>) -> PyResult<Vec<Grouped<'py>>> {
        let groups = this.get().content.mesh.groups.iter();
        let groups = groups.map(|group| {
            let cells = shown(this, 1, &group.cells)?;
            Ok((group.name.clone(), group.dim, group.tag, cells))
        });
        groups.collect()
    }

    #[getter]
    fn whole<'py>(this: &Bound<'py, Self>) -> PyResult<Vec<About<'py>>> {
        let whole = this.get().content.whole.iter();
        let whole = whole.map(|data| {
            let values = match &data.values {
                GlobalValues::Numbers(numbers) => values(this, data.components, numbers)?,
                GlobalValues::Text(texts) => texts.into_pyobject(this.py())?.into_any(),
            };
            Ok((data.name.clone(), values))
        });
        whole.collect()
    }
}

/// The numbers in their own type.
fn values<'py>(
    this: &Bound<'py, Mesh>,
    columns: usize,
    values: &Values,
) -> PyResult<Bound<'py, PyAny>> {
    match values {
        Values::F64(values) => shown(this, columns, values),
        Values::F32(values) => shown(this, columns, values),
        Values::I8(values) => shown(this, columns, values),
        Values::U8(values) => shown(this, columns, values),
        Values::I16(values) => shown(this, columns, values),
        Values::U16(values) => shown(this, columns, values),
        Values::I32(values) => shown(this, columns, values),
        Values::U32(values) => shown(this, columns, values),
        Values::I64(values) => shown(this, columns, values),
        Values::U64(values) => shown(this, columns, values),
    }
}

/// An array of the memory of `this`, which it keeps alive and which cannot be written to.
fn shown<'py, T: Element>(
    this: &Bound<'py, Mesh>,
    columns: usize,
    values: &[T],
) -> PyResult<Bound<'py, PyAny>> {
    let columns = columns.max(1);
    let view = ArrayView2::from_shape((values.len() / columns, columns), values);
    let view = view.map_err(|e| usage(this.py(), e.to_string(), "report this"))?;
    // SAFETY: `values` are part of `this`, which is frozen, so that they neither move nor change, and which the array owns.
    #[expect(unsafe_code)]
    let array = unsafe { PyArray2::borrow_from_array(&view, this.clone().into_any()) };
    array.readwrite().make_nonwriteable();
    Ok(array.into_any())
}

/// What was read; `python` is an interpreter that has meshio.
#[pyfunction]
#[pyo3(signature = (path, python=None))]
pub fn read(py: Python<'_>, path: PathBuf, python: Option<PathBuf>) -> PyResult<Mesh> {
    let content = run(py, || {
        io::open(&path, python.or_else(meshio_python).as_deref())
    })?;
    Ok(Mesh {
        source: path.display().to_string(),
        content,
    })
}

/// A file whose bytes are in memory; `source` is its name, by whose suffix it is known.
#[pyfunction]
pub fn parse(py: Python<'_>, source: String, bytes: &[u8]) -> PyResult<Mesh> {
    let content = run(py, || io::parse(source.as_ref(), bytes, None))?;
    Ok(Mesh { source, content })
}

/// Writes a mesh with options of `faceoff mesh convert`; returns what the file does not hold.
#[pyfunction]
#[pyo3(signature = (path, mesh, options, python=None))]
pub fn write(
    py: Python<'_>,
    path: PathBuf,
    mesh: &Bound<'_, Mesh>,
    options: Vec<String>,
    python: Option<PathBuf>,
) -> PyResult<Vec<String>> {
    let content = &mesh.get().content;
    run(py, || {
        let options = options_of(&options, &path, python.or_else(meshio_python))?;
        io::write_with(&path, &content.mesh, &content.whole, &options)
    })
}

/// The nodes of the complete element of this shape and order, in Gmsh's order, with coordinates of the unit cell; and Gmsh's
/// number of it.
#[pyfunction]
pub fn reference_nodes(py: Python<'_>, shape: &str, order: usize) -> PyResult<(u8, Vec<[f64; 3]>)> {
    let kind = SHAPES.iter().find(|(name, _)| *name == shape);
    let kind = kind.and_then(|(_, shape)| CellKind::complete(*shape, order));
    let found = kind.and_then(|kind| Some((kind.gmsh(), io::reference_nodes(kind)?)));
    found.ok_or_else(|| {
        let what = format!("there is no {shape} of order {order} here");
        usage(
            py,
            what,
            "interpolate into a space of lower degree, or compare files",
        )
    })
}

/// Shapes that have complete elements.
const SHAPES: [(&str, Shape); 6] = [
    ("line", Shape::Line),
    ("triangle", Shape::Triangle),
    ("quadrangle", Shape::Quadrangle),
    ("tetrahedron", Shape::Tetrahedron),
    ("hexahedron", Shape::Hexahedron),
    ("prism", Shape::Prism),
];
