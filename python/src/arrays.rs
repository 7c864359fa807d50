//! Arrays of numpy become a mesh, or rows of a table, and nothing is believed of them.
//!
//! They are copied once, while the GIL is held, and that copy is what is compared: nothing copies it again. Looked at in place they
//! could be changed by another thread as soon as the GIL is released, whatever flags are set, and by their owner before the result
//! that speaks of them is shown.

use faceoff_mesh::CellKind;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{GlobalArray, ResultField, Results};
use faceoff_mesh::io::Content;
use faceoff_mesh::mesh::{CellBlock, Field, Group, Mesh, Support, Values};
use numpy::{PyArray1, PyArrayMethods as _};
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
    whole: Vec<(String, Numbers)>,
}

/// One flat array.
struct Numbers(Values);

impl<'py> FromPyObject<'_, 'py> for Numbers {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        macro_rules! any {
            ($($variant:ident $of:ty),*) => {
                $(if let Ok(array) = given.cast::<PyArray1<$of>>() {
                    return Ok(Numbers(Values::$variant(array.to_vec()?)));
                })*
            };
        }
        any!(F64 f64, F32 f32, U32 u32, I64 i64, I32 i32, U64 u64, I8 i8, U8 u8, I16 i16, U16 u16);
        let name = given.get_type().name()?;
        Err(pyo3::exceptions::PyTypeError::new_err(format!(
            "{name} is no flat array of numbers"
        )))
    }
}

/// Three numbers a point, flat.
struct Places(Vec<[f64; 3]>);

impl<'py> FromPyObject<'_, 'py> for Places {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let array = given.cast::<PyArray1<f64>>()?.readonly();
        let (points, _) = array.as_slice()?.as_chunks();
        Ok(Places(points.to_vec()))
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
            blocks.push(CellBlock::new(kind, nodes));
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
                cells,
                ..Group::new(dim, tag)
            });
        }
        groups.sort_by_key(|group| (group.dim, group.tag));
        let whole = self.whole.into_iter();
        let whole = whole.map(|(name, Numbers(values))| GlobalArray::numbers(name, values));
        let mesh = Mesh {
            points: points.map_or(Vec::new(), |Places(points)| points),
            blocks,
            groups,
            fields,
            ..Mesh::default()
        };
        mesh.validate().map_err(refuse)?;
        let content = Content {
            mesh,
            whole: whole.collect(),
            format: "arrays".into(),
            ..Content::default()
        };
        Ok((source, content))
    }
}
