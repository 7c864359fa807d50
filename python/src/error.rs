//! Errors of Rust as exceptions of Python, which are classes of `faceoff_fem.errors`.

use faceoff_mesh::error::Error;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

/// The exception for an error, with its parts as attributes.
pub fn raised(py: Python<'_>, error: &Error) -> PyErr {
    let (class, place, what, remedy) = match error {
        Error::Ended(cause) => return PyKeyboardInterrupt::new_err(cause.to_string()),
        Error::Usage { what, remedy } => {
            ("UsageError", String::new(), what.clone(), remedy.clone())
        }
        Error::File {
            path,
            place,
            what,
            remedy,
        } => {
            let place = format!("{}{place}", path.display());
            ("FileError", place, what.clone(), remedy.clone())
        }
        Error::Io {
            path,
            action,
            source,
        } => (
            "FileError",
            path.display().to_string(),
            format!("cannot {action}: {source}"),
            "check that the path exists and that you may use it".into(),
        ),
        Error::Mesh { mesh, what, remedy } => ("Error", mesh.clone(), what.clone(), remedy.clone()),
        Error::Scene {
            scene,
            place,
            what,
            remedy,
        } => (
            "Error",
            format!("{scene}, {place}"),
            what.clone(),
            remedy.clone(),
        ),
        Error::Compare { a, b, what, remedy } => {
            ("Error", format!("{a}, {b}"), what.clone(), remedy.clone())
        }
        Error::Engine {
            engine,
            what,
            remedy,
        } => ("Error", engine.clone(), what.clone(), remedy.clone()),
        Error::Solver { what, remedy } => ("Error", String::new(), what.clone(), remedy.clone()),
        Error::Certificate { because, remedy } => {
            ("Error", String::new(), because.clone(), remedy.clone())
        }
        Error::Contradiction { what } => {
            let remedy = "report it with the command".into();
            ("Error", String::new(), what.clone(), remedy)
        }
    };
    let made = py
        .import("faceoff_fem.errors")
        .and_then(|module| module.getattr(class))
        .and_then(|class| class.call1((error.to_string(), what, place, remedy)));
    made.map_or_else(|e| e, PyErr::from_value)
}

/// For what is wrong with arguments.
pub fn usage(py: Python<'_>, what: impl Into<String>, remedy: &str) -> PyErr {
    raised(py, &Error::usage(what, remedy))
}
