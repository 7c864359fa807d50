//! The finite element codes that a problem is written for, as a script that runs on its own.
//!
//! All scripts use the same quadrature points and the same start of Newton's method, and write the values of all unknowns at the nodes of
//! the cells to a VTU file. [`CODES`] is the list; a new code is one file here, with one entry in it.

mod dolfinx;
mod fields;
mod frame;
mod freefem;
mod getfem;
mod ngsolve;
mod nutils;
mod python;
mod scikit_fem;
mod spelling;
#[cfg(test)]
mod tests;
mod ufl;

use std::path::{Path, PathBuf};

use faceoff_mesh::error::Result;
use faceoff_mesh::io::{self, Format, Options, msh};
use faceoff_mesh::mesh::Mesh;

use crate::problem::Problem;

/// A finite element code, and how its scripts are run.
#[derive(Debug)]
pub struct Code {
    /// Its name in form files and commands.
    pub name: &'static str,
    /// What follows the problem's name in that of the script: `.edp`, `_dolfinx.py`.
    pub suffix: &'static str,
    /// The words before the script in a command.
    pub command: &'static [&'static str],
    /// The format of the mesh, by the name that face-offs have for it, and the suffix of its files.
    pub mesh: (&'static str, &'static str),
    script: Script,
}

#[derive(Debug)]
enum Script {
    Own(fn(&mut Problem) -> std::result::Result<String, String>),
    Of(&'static frame::Table),
}

/// All codes that forms are written for.
pub const CODES: [Code; 6] = [
    freefem::CODE,
    dolfinx::CODE,
    scikit_fem::CODE,
    ngsolve::CODE,
    getfem::CODE,
    nutils::CODE,
];

/// The templates, and what they have in common.
const FRAMES: [(&str, &str); 11] = [
    ("head.py", include_str!("frames/head.py")),
    ("lists.py", include_str!("frames/lists.py")),
    ("newton.py", include_str!("frames/newton.py")),
    ("read.py", include_str!("frames/read.py")),
    ("write_vtu.py", include_str!("frames/write_vtu.py")),
    ("dolfinx.py", include_str!("frames/dolfinx.py")),
    ("freefem.edp", include_str!("frames/freefem.edp")),
    ("getfem.py", include_str!("frames/getfem.py")),
    ("ngsolve.py", include_str!("frames/ngsolve.py")),
    ("nutils.py", include_str!("frames/nutils.py")),
    ("scikit_fem.py", include_str!("frames/scikit_fem.py")),
];

impl Code {
    /// The code of this name.
    pub fn of_name(name: &str) -> Option<&'static Code> {
        CODES.iter().find(|code| code.name == name)
    }

    /// The file name of its script for a problem.
    pub fn file(&self, problem: &Problem) -> String {
        format!("{}{}", problem.name, self.suffix)
    }

    /// The script. Run alone it reads the mesh `NAME.mesh` or `NAME.msh` beside it and writes a VTU file beside it, called like the script;
    /// two words behind it name other files.
    ///
    /// # Errors
    /// What the code lacks for this problem.
    pub fn script(&self, problem: &Problem) -> std::result::Result<String, String> {
        let mut script = match self.script {
            Script::Own(write) => write(&mut problem.clone())?,
            Script::Of(table) => table.script(problem, &self.file(problem))?,
        };
        // Between parts are at most two empty lines.
        while script.contains("\n\n\n\n") {
            script = script.replace("\n\n\n\n", "\n\n\n");
        }
        Ok(script)
    }

    /// Writes the mesh that the script reads when it runs alone into a folder, and returns its path.
    ///
    /// # Errors
    /// A mesh that the format cannot hold, or a file that cannot be written.
    pub fn write_mesh(&self, folder: &Path, problem: &Problem, mesh: &Mesh) -> Result<PathBuf> {
        let path = folder.join(format!("{}.{}", problem.name, self.mesh.1));
        let options = Options {
            format: Format::of_name(if self.mesh.0 == "msh2" {
                "msh"
            } else {
                self.mesh.0
            }),
            msh_version: msh::Version::V22,
            lossy: true,
            ..Options::default()
        };
        io::write(&path, mesh, &options)?;
        Ok(path)
    }
}
