//! MFEM by its wrapper for Python: its meshes, maps, basis functions and dofs; the form as functions of NumPy arrays, with our derivative.

use super::python::RESERVED as PYTHON;
use super::scikit_fem;
use super::table::Code;
use crate::problem::{Element, Problem, Space};

/// PyMFEM 4.
pub const CODE: Code = Code {
    name: "mfem",
    suffix: "_mfem.py",
    frame: include_str!("frames/mfem.py"),
    reserved: &[PYTHON, RESERVED],
    element,
    lacks: |problem| match problem.has_second() {
        true => Err("scripts for MFEM have no second derivatives".into()),
        false => Ok(()),
    },
    ..scikit_fem::CODE
};

/// Names that the frame imports or defines.
const RESERVED: &str = "each k size mfem SimpleNamespace types mesh here vertices_of marked outside corners diameter space spaces sizes first dofs_of_cells others rule facet_rule rule2 rule3 rule4 rule5 rule6 rule7 rule8 \
    sample Field field unknown functions given sums chosen count side sides residual derivative held goal total hold part free before number nodes out at rows whole wanted border both scipy splu w place";

/// An MFEM collection for the components, with equidistant nodes as in the other codes.
fn element(problem: &Problem, space: Space) -> Result<String, String> {
    let dim = problem.dim;
    Ok(match space.element {
        Element::Continuous(degree) => {
            format!("mfem.H1_FECollection({degree}, {dim}, mfem.BasisType.ClosedUniform)")
        }
        Element::Broken(0) => format!("mfem.L2_FECollection(0, {dim})"),
        Element::Broken(degree) => {
            format!("mfem.L2_FECollection({degree}, {dim}, mfem.BasisType.ClosedUniform)")
        }
        Element::CrouzeixRaviart if dim == 2 => "mfem.CrouzeixRaviartFECollection()".into(),
        other => {
            return Err(format!(
                "scripts for MFEM have no {} in {dim}D",
                other.name()
            ));
        }
    })
}
