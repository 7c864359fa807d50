//! Comparisons.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use faceoff::cli::compare::{self as cli, Side};
use faceoff::report::{Output, deliver, text};
use faceoff_judge::On;
use faceoff_mesh::io::of_content;
use numpy::{PyArray2, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::arrays::Arrays;
use crate::call::run;
use crate::error::raised;
use crate::mesh::Mesh;

/// What `compare` found: the verdict, and what is to be said of it.
#[pyclass(frozen, module = "faceoff_fem._core")]
pub struct Found(cli::Found);

/// One side as Python has it.
#[derive(FromPyObject)]
pub enum Given {
    Path(PathBuf),
    Mesh(Py<Mesh>),
    Arrays(Arrays),
}

/// `faceoff compare` with these options, as they are typed, of two paths, meshes or [`Arrays`], which are taken out of the list;
/// returns what was found, and what was left out.
#[pyfunction]
pub fn compare(
    py: Python<'_>,
    sides: &Bound<'_, PyList>,
    options: Vec<String>,
) -> PyResult<(Found, Vec<String>)> {
    let take = || -> PyResult<Given> { sides.call_method1("pop", (0,))?.extract() };
    let [a, b] = [take()?, take()?];
    let told = Mutex::new(Vec::new());
    let found = run(py, || {
        let tell = |what| {
            told.lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(what)
        };
        let side = |given: Given| {
            let content = match given {
                Given::Path(path) => return Ok(Side::Path(path)),
                Given::Mesh(mesh) => {
                    let mesh = mesh.get();
                    (mesh.source.clone(), mesh.content.clone())
                }
                Given::Arrays(mut arrays) => {
                    if let Some(rows) = arrays.rows() {
                        return Ok(Side::Here(Box::new(rows)));
                    }
                    arrays.content()?
                }
            };
            let (source, content) = content;
            of_content(source.as_ref(), content).map(|results| Side::Here(Box::new(results)))
        };
        cli::compare(&options, [side(a)?, side(b)?], &tell)
    })?;
    let told = told.into_inner().unwrap_or_else(PoisonError::into_inner);
    Ok((Found(found), told))
}

#[pymethods]
impl Found {
    #[getter]
    fn agree(&self) -> bool {
        self.0.verdict().passes()
    }

    #[getter]
    fn verdict(&self) -> &'static str {
        self.0.verdict().word()
    }

    /// What the program writes on a terminal.
    fn text(&self, py: Python<'_>) -> PyResult<String> {
        let report = self.0.report().map_err(|e| raised(py, &e))?;
        Ok(format!("{}\n{}", text(&report).trim_end(), report.headline))
    }

    /// What the program writes with --json.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        Ok(self.0.report().map_err(|e| raised(py, &e))?.json)
    }

    /// Writes the page with figures and data into a folder, which is new, empty or an earlier report's.
    fn write(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        run(py, || {
            let output = Output {
                command: "compare",
                judges: true,
                report: Some(&folder),
                quiet: true,
                ..Output::default()
            };
            deliver(&self.0.report()?, &output)
        })
    }

    /// Places and values of a - b: for each kind of carrier its name, an array of places, and fields by name.
    fn differences<'py>(&self, py: Python<'py>) -> PyResult<Vec<Located<'py>>> {
        let cli::Found::One(comparison, of_a) = &self.0 else {
            return Ok(Vec::new());
        };
        let located = comparison.differences.iter().map(|of| {
            let on = match of.on {
                On::Points => "points",
                On::Cells => "cells",
                On::Corners => "corners",
                On::Whole => "whole",
                On::Functions => "functions",
                On::Domain => "domain",
                On::Unread => "unread",
            };
            let table = |values: &[f64], columns: usize| {
                let flat = numpy::PyArray1::from_slice(py, values);
                flat.reshape([values.len() / columns.max(1), columns.max(1)])
            };
            let fields = of.fields.iter();
            let fields = fields.map(|(name, n, values)| Ok((name.clone(), table(values, *n)?)));
            Ok((
                on,
                table(of.places(of_a).as_flattened(), 3)?,
                fields.collect::<PyResult<_>>()?,
            ))
        });
        located.collect()
    }
}

type Located<'py> = (
    &'static str,
    Bound<'py, PyArray2<f64>>,
    Vec<(String, Bound<'py, PyArray2<f64>>)>,
);
