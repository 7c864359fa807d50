//! Linear systems of two codes.

use faceoff::why::Systems;
use faceoff_judge::systems::{Settings, System};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::io::{Coordinates, DofTable};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::call::run;
use crate::error::raised;

/// `faceoff_fem._systems.Arrays`: rows, columns and values of the matrix, the right-hand side, and the columns of the table of dofs.
#[derive(FromPyObject)]
pub struct Given<'py> {
    name: String,
    rows: PyReadonlyArray1<'py, u32>,
    columns: PyReadonlyArray1<'py, u32>,
    values: PyReadonlyArray1<'py, f64>,
    load: PyReadonlyArray1<'py, f64>,
    names: Vec<String>,
    field: PyReadonlyArray1<'py, u16>,
    at: PyReadonlyArray2<'py, f64>,
    direction: PyReadonlyArray2<'py, f64>,
    answer: Option<PyReadonlyArray1<'py, f64>>,
}

/// Compares two systems: do they agree, the sentence, and the JSON of what was found.
#[pyfunction]
#[pyo3(signature = (a, b, rtol = 0.0, volume = None))]
pub fn compare_systems(
    py: Python<'_>,
    a: Given<'_>,
    b: Given<'_>,
    rtol: f64,
    volume: Option<f64>,
) -> PyResult<(bool, String, String)> {
    let [a, b] = [
        a.system().map_err(|e| raised(py, &e))?,
        b.system().map_err(|e| raised(py, &e))?,
    ];
    run(py, || {
        let settings = Settings {
            rtol,
            volume,
            ..Settings::default()
        };
        let found = Systems::with(&a, &b, None, &settings)?;
        Ok((
            found.compared.verdict.passes(),
            found.sentence.to_string(),
            found.json()?,
        ))
    })
}

impl Given<'_> {
    fn system(&self) -> Result<System> {
        let load = self.load.as_array().to_vec();
        let count = load.len();
        let refuse = |what: String| {
            Error::engine(
                &self.name,
                what,
                "give one entry per dof in each column of the table",
            )
        };
        let three = |of: &PyReadonlyArray2<'_, f64>| -> Vec<[f64; 3]> {
            of.as_array()
                .rows()
                .into_iter()
                .map(|row| std::array::from_fn(|k| row.get(k).copied().unwrap_or(0.0)))
                .collect()
        };
        let (rows, columns, values) = (
            self.rows.as_array(),
            self.columns.as_array(),
            self.values.as_array(),
        );
        let outside = rows
            .iter()
            .chain(columns.iter())
            .find(|k| **k as usize >= count);
        if let Some(k) = outside {
            return Err(refuse(format!(
                "its matrix has an entry in row or column {k}, and its right-hand side {count} rows"
            )));
        }
        let entries = rows
            .iter()
            .zip(&columns)
            .zip(&values)
            .map(|((row, column), value)| (*row, *column, *value));
        let dofs = DofTable {
            names: self.names.clone(),
            field: self.field.as_array().to_vec(),
            at: three(&self.at),
            direction: three(&self.direction),
            values: self
                .answer
                .as_ref()
                .map(|answer| answer.as_array().to_vec()),
        };
        let lengths = [
            dofs.field.len(),
            dofs.at.len(),
            dofs.direction.len(),
            dofs.values.as_ref().map_or(count, Vec::len),
        ];
        if lengths.iter().any(|length| *length != count)
            || dofs
                .field
                .iter()
                .any(|k| usize::from(*k) >= dofs.names.len())
        {
            return Err(refuse(format!(
                "its right-hand side has {count} rows, and the columns of its table {lengths:?}"
            )));
        }
        System::new(
            &self.name,
            Coordinates {
                rows: count,
                columns: count,
                entries: entries.collect(),
            },
            load,
            dofs,
        )
    }
}
