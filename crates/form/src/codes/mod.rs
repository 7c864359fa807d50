//! The finite element codes for which a problem is written as an independent script.
//!
//! All scripts use the same quadrature points and the same initial guess of Newton's method, and write the values of all unknowns at the nodes of
//! the cells to a VTU file. [`CODES`] is the list; a new code is a table of its spellings, a template in `frames`, and an entry in it.

mod dolfinx;
mod fields;
mod frame;
mod freefem;
mod getfem;
mod mfem;
mod ngsolve;
mod nutils;
mod points;
mod python;
mod scikit_fem;
mod speaker;
mod spelling;
mod strong;
mod table;
#[cfg(test)]
mod tests;
mod ufl;

use std::path::{Path, PathBuf};

use faceoff_mesh::error::Result;
use faceoff_mesh::io::{self, Format, Options, msh};
use faceoff_mesh::mesh::Mesh;

use self::speaker::Speaker;
pub use self::table::Code;
use crate::problem::{Element, Problem};

/// All codes for which forms are written.
pub const CODES: [Code; 7] = [
    freefem::CODE,
    dolfinx::CODE,
    scikit_fem::CODE,
    ngsolve::CODE,
    getfem::CODE,
    nutils::CODE,
    mfem::CODE,
];

/// The codes that solve contact in elasticity by a handwritten scheme.
pub const BY_HAND: [Code; 2] = [freefem::ELASTIC, dolfinx::ELASTIC];

impl Code {
    /// The code with this name and a handwritten scheme.
    pub fn by_hand(name: &str) -> Option<&'static Code> {
        BY_HAND.iter().find(|code| code.name == name)
    }

    /// The Python module that its scripts import; `None` for a program.
    pub fn module(&self) -> Option<&'static str> {
        let is_python = self.command.first()?.ends_with("python3");
        is_python.then_some(match self.name {
            "scikit-fem" => "skfem",
            "fenicsx" => "dolfinx",
            other => other,
        })
    }

    /// Does its script have the text of the form, edited, rather than what was made of it?
    pub fn has_text(&self) -> bool {
        self.module() == Some("dolfinx")
    }

    /// The code of this name.
    pub fn of_name(name: &str) -> Option<&'static Code> {
        CODES.iter().find(|code| code.name == name)
    }

    /// The file name of its script for a problem.
    pub fn file(&self, problem: &Problem) -> String {
        format!("{}{}", problem.name, self.suffix)
    }

    /// The file name of the mesh that its script reads: `NAME.mesh` or `NAME.msh`, or with the code's name in it if that is the name of a user's file.
    pub fn mesh_file(&self, problem: &Problem, own: Option<&Path>) -> String {
        let usual = format!("{}.{}", problem.name, self.mesh.1);
        match own
            .and_then(Path::file_name)
            .is_some_and(|own| own == &*usual)
        {
            true => format!("{}-{}.{}", problem.name, self.name, self.mesh.1),
            false => usual,
        }
    }

    /// The script. Run without arguments, it reads the mesh `NAME.mesh` or `NAME.msh` in its folder and writes a VTU file there, with the name of the script;
    /// two arguments name other files.
    ///
    /// # Errors
    /// Has the code what this problem needs?
    pub fn has(&self, problem: &Problem) -> bool {
        (self.lacks)(problem).is_ok()
    }

    /// What the code lacks for this problem.
    pub fn script(&self, problem: &Problem) -> std::result::Result<String, String> {
        self.script_reading(problem, &self.mesh_file(problem, None), false)
    }

    /// The script that also writes the linear system of the form to the folder of its result: `A.mtx`, `b.mtx` and `dofs.csv`, with rows of the identity for prescribed
    /// dofs, and values at nodes if the code's basis is hierarchical. For a nonlinear form it is the system of Newton's method at the state
    /// of [`own::state`](crate::own::state).
    ///
    /// # Errors
    /// Errors of [`Code::script`]; a form with time steps; dofs that a table cannot distinguish.
    pub fn script_with_system(&self, problem: &Problem) -> std::result::Result<String, String> {
        self.script_reading(problem, &self.mesh_file(problem, None), true)
    }

    /// The script that, run without arguments, reads a mesh with this name, with its linear system or without.
    ///
    /// # Errors
    /// Errors of [`Code::script`] and [`Code::script_with_system`].
    pub fn script_reading(
        &self,
        problem: &Problem,
        mesh: &str,
        has_system: bool,
    ) -> std::result::Result<String, String> {
        if has_system {
            self.may_write_system(problem)?;
        }
        self.filled(problem, mesh, has_system)
    }

    fn may_write_system(&self, problem: &Problem) -> std::result::Result<(), String> {
        if self.name == nutils::CODE.name {
            return Err("scripts for nutils write no linear system".into());
        }
        if problem.eigen.is_some() {
            return Err("an eigenproblem has two matrices, and no linear system".into());
        }
        if problem.time.is_some() {
            return Err("a form with steps in time has no one linear system".into());
        }
        for space in problem.unknowns.iter().map(|unknown| unknown.space) {
            if matches!(space.element, Element::Broken(1..)) {
                let name = space.element.name();
                return Err(format!(
                    "dofs of {name} share places, and no table of dofs tells them apart"
                ));
            }
            if space.size > Some(3) {
                return Err(
                    "a table of dofs has three directions, and an unknown has more components"
                        .into(),
                );
            }
        }
        Ok(())
    }

    fn filled(
        &self,
        problem: &Problem,
        mesh: &str,
        has_system: bool,
    ) -> std::result::Result<String, String> {
        if problem.eigen.is_some() && !self.has_eigen {
            let names = CODES
                .iter()
                .filter(|code| code.has_eigen)
                .map(|code| code.name);
            let names = names.collect::<Vec<_>>().join(", ");
            return Err(format!(
                "scripts for {} solve no eigenproblems, only those for {names}",
                self.name
            ));
        }
        (self.lacks)(problem)?;
        let fields = fields::fields(&mut Speaker::new(self, problem), mesh, has_system)?;
        let mut script = frame::fill(self.name, fields)?;
        // At most two empty lines separate parts.
        while script.contains("\n\n\n\n") {
            script = script.replace("\n\n\n\n", "\n\n\n");
        }
        Ok(script)
    }

    /// Writes the mesh that the script reads without arguments into a folder, and returns its path.
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
