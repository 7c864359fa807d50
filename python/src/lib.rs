//! `faceoff_fem._core`: what the Python package `faceoff_fem` is built on. Its Python files are the interface; here are
//! meshes, comparisons and the program itself, without the GIL.

mod arrays;
mod call;
mod error;
mod found;
mod mesh;
mod systems;

use pyo3::prelude::*;

/// Runs the program `faceoff` with these arguments, the first of which is its name, and returns its exit code. The process has
/// to end then.
#[pyfunction]
fn main(py: Python<'_>, arguments: Vec<String>) -> u8 {
    py.detach(|| faceoff::cli::main(arguments.into_iter().map(Into::into)))
}

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<mesh::Mesh>()?;
    module.add_class::<found::Found>()?;
    module.add_function(wrap_pyfunction!(main, module)?)?;
    module.add_function(wrap_pyfunction!(found::compare, module)?)?;
    module.add_function(wrap_pyfunction!(systems::compare_systems, module)?)?;
    module.add_function(wrap_pyfunction!(mesh::read, module)?)?;
    module.add_function(wrap_pyfunction!(mesh::parse, module)?)?;
    module.add_function(wrap_pyfunction!(mesh::write, module)?)?;
    module.add_function(wrap_pyfunction!(mesh::reference_nodes, module)?)
}
