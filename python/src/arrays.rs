//! Arrays of numpy become a mesh, or rows of a table, and nothing is believed of them.
//!
//! They are lent, so that what is compared is their own memory: see [`Lent`] for who may write to it meanwhile. What is told of
//! them later is of a copy.

use std::sync::Arc;

use faceoff_mesh::CellKind;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{ResultField, Results};
use faceoff_mesh::io::Content;
use faceoff_mesh::mesh::{Array, CellBlock, Field, Group, Mesh, Support, Values};
use numpy::{Element, PyArrayDyn, PyArrayMethods as _};
use pyo3::prelude::*;

/// `faceoff_fem._arrays.Arrays`, taken over.
#[derive(FromPyObject)]
pub struct Arrays {
    source: String,
    /// Three coordinates a point; none for rows of a table.
    points: Option<Places>,
    /// Gmsh's number of a type of cells, and their points.
    cells: Vec<(i32, Numbers)>,
    /// Name, carrier, components, values.
    fields: Vec<(String, Carrier, usize, Numbers)>,
    /// Name, dimension, number, cells.
    groups: Vec<(Option<String>, u8, i64, Numbers)>,
}

/// The rows of one array, flat.
struct Numbers(Values);

impl<'py> FromPyObject<'_, 'py> for Numbers {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        macro_rules! any {
            ($($variant:ident $of:ty),*) => {
                $(if let Ok(array) = given.cast::<PyArrayDyn<$of>>() {
                    return Ok(Numbers(Values::$variant(Array::lent(Lent::new(&array)?))));
                })*
            };
        }
        any!(F64 f64, F32 f32, U32 u32, I64 i64, I32 i32, U64 u64, I8 i8, U8 u8, I16 i16, U16 u16);
        let name = given.get_type().name()?;
        Err(pyo3::exceptions::PyTypeError::new_err(format!(
            "{name} is no array of numbers"
        )))
    }
}

/// Three numbers a point.
struct Places(Array<[f64; 3]>);

impl<'py> FromPyObject<'_, 'py> for Places {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let array = given.cast::<PyArrayDyn<f64>>()?;
        Ok(Places(Array::lent(Lent::new(&array)?)))
    }
}

/// The memory of an array, which is alive. That nobody writes to it while it is compared is for the caller to see to, as with every
/// function of numpy that releases the GIL, and so stands in the text of `compare`.
struct Lent<T> {
    /// Keeps the memory.
    _array: Py<PyArrayDyn<T>>,
    start: *const T,
    len: usize,
}

// SAFETY: Numbers that are only read, and a reference that any thread may give back.
#[expect(unsafe_code)]
unsafe impl<T: Element> Send for Lent<T> {}
// SAFETY: As above.
#[expect(unsafe_code)]
unsafe impl<T: Element> Sync for Lent<T> {}

impl<T: Element> Lent<T> {
    fn new(array: &Bound<'_, PyArrayDyn<T>>) -> PyResult<Arc<Self>> {
        let numbers = array.readonly();
        let numbers = numbers.as_slice()?;
        if !numbers.as_ptr().is_aligned() {
            let what =
                "an array that is not aligned: copy it, as by numpy.require(u, requirements='A')";
            return Err(pyo3::exceptions::PyValueError::new_err(what));
        }
        Ok(Arc::new(Lent {
            start: numbers.as_ptr(),
            len: numbers.len(),
            _array: array.clone().unbind(),
        }))
    }
}

impl<T> AsRef<[T]> for Lent<T> {
    fn as_ref(&self) -> &[T] {
        // SAFETY: This is where the numbers of the array are, which is alive, aligned and contiguous, and numpy moves none that
        // others refer to, but with `resize(refcheck=False)`. Nobody changes them meanwhile: so the caller promises. Who
        // breaks that promise has a race, which Rust leaves undefined; what is read is an old or a new number then, and every
        // number that is an index is checked where it is used.
        #[expect(unsafe_code)]
        unsafe {
            std::slice::from_raw_parts(self.start, self.len)
        }
    }
}

impl AsRef<[[f64; 3]]> for Lent<f64> {
    fn as_ref(&self) -> &[[f64; 3]] {
        let numbers: &[f64] = self.as_ref();
        numbers.as_chunks().0
    }
}

/// What values belong to.
struct Carrier(Support);

impl<'py> FromPyObject<'_, 'py> for Carrier {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        Ok(Carrier(match given.extract::<String>()?.as_str() {
            "cells" => Support::Cells,
            "corners" => Support::CellPoints,
            _ => Support::Points,
        }))
    }
}

impl Arrays {
    /// The same with memory of their own.
    pub fn owned(mut self) -> Self {
        self.points
            .iter_mut()
            .for_each(|Places(points)| _ = points.to_mut());
        let cells = self.cells.iter_mut().map(|(_, nodes)| nodes);
        let fields = self.fields.iter_mut().map(|(.., values)| values);
        cells
            .chain(fields)
            .for_each(|Numbers(numbers)| numbers.own());
        self
    }

    /// Rows without a key, as those of a table; `None` where there are points.
    pub fn rows(&mut self) -> Option<Results> {
        if self.points.is_some() {
            return None;
        }
        let fields = std::mem::take(&mut self.fields).into_iter();
        let on_points: Vec<ResultField> = fields
            .map(|(name, _, components, Numbers(values))| ResultField {
                name,
                components,
                rest: values.rest(),
                single: matches!(values, Values::F32(_)),
                values: values.into_f64(),
                at: None,
                scaled_by: None,
            })
            .collect();
        let rows = on_points.iter().map(ResultField::len).max().unwrap_or(0);
        Some(Results {
            source: self.source.clone(),
            ids: (0..rows as u32).collect(),
            on_points,
            ..Results::default()
        })
    }

    /// What messages call it, and the mesh.
    ///
    /// # Errors
    /// Arrays that are no mesh.
    pub fn content(self) -> Result<(String, Content)> {
        let Arrays { source, points, .. } = self;
        let refuse = |what: String| Error::Mesh {
            mesh: source.clone(),
            what,
            remedy: "see `faceoff_fem.compare` for what arrays are to be".into(),
        };
        let mut blocks = Vec::new();
        for (number, Numbers(nodes)) in self.cells {
            let (Some(kind), Values::U32(nodes)) = (CellKind::from_gmsh(number), nodes) else {
                return Err(refuse(format!("Gmsh has no cells of type {number}")));
            };
            if nodes.len() % kind.points() != 0 {
                return Err(refuse(format!("{kind} has {} points", kind.points())));
            }
            blocks.push(CellBlock {
                nodes,
                ..CellBlock::new(kind, Vec::new())
            });
        }
        let fields = self.fields.into_iter();
        let fields = fields
            .map(|(name, Carrier(on), components, Numbers(values))| {
                Field::new(name, on, components, values)
            })
            .collect();
        let mut groups = Vec::new();
        for (name, dim, tag, Numbers(cells)) in self.groups {
            let Values::U32(cells) = cells else {
                return Err(refuse(format!(
                    "the group {tag} has cells that are no numbers"
                )));
            };
            groups.push(Group {
                name,
                cells: cells.into_vec(),
                ..Group::new(dim, tag)
            });
        }
        groups.sort_by_key(|group| (group.dim, group.tag));
        let mesh = Mesh {
            points: points.map(|Places(points)| points).unwrap_or_default(),
            blocks,
            groups,
            fields,
            ..Mesh::default()
        };
        mesh.validate().map_err(refuse)?;
        let content = Content {
            mesh,
            format: "arrays".into(),
            ..Content::default()
        };
        Ok((source, content))
    }
}
