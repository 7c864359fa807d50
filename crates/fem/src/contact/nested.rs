//! Where iterations start: from the contact set of P1 ⊂ CR.

use super::iteration::Iteration;
use super::method::{Law, Method};
use super::solve::{Stop, solve_by};
use super::{Discretisation, Problem};
use crate::element::{P1, Space};
use crate::linear::{Settings, Solver};
use faceoff_mesh::error::{Error, Result};

/// More exact than P1 itself is no start's need.
const ROUGH: f64 = 1e-3;

/// u of the variational inequality on P1, which has nearly the same contact set at a third of the unknowns in the plane and
/// a tenth in space; g on Γ_D. None without contact, where P1 has no fewer unknowns, and where it is not solved.
///
/// # Errors
/// What `progress` returns; its steps count as 0.
pub(super) fn start(
    problem: &Problem,
    progress: &mut dyn FnMut(usize, f64) -> Result<()>,
) -> Result<Option<Vec<f64>>> {
    let mesh = problem.space.mesh;
    if problem.conditions.is_empty() || problem.space.dofs <= mesh.points.len() {
        return Ok(None);
    }
    let method = Method {
        element: &P1,
        law: Law::Variational,
    };
    let stop = Stop {
        increment: ROUGH,
        ..Stop::default()
    };
    let settings = Settings {
        solver: Solver::Iterative,
        ..Settings::default()
    };
    let discretisation = Discretisation {
        method,
        ..problem.discretisation.clone()
    };
    let coarse = Problem::new(problem.scene, mesh, &discretisation)?;
    let told = |_: usize, increment| progress(0, increment);
    let found = match solve_by(&coarse, Iteration::Newton, stop, settings, told) {
        Ok(found) => found.u,
        Err(Error::Solver { .. }) => return Ok(None),
        Err(other) => return Err(other),
    };
    let values = VertexValues::new(&problem.space);
    let u = (0..).zip(&problem.dirichlet).map(|(dof, g)| {
        let embedded = values
            .of(dof)
            .map(|(vertex, value)| value * found[vertex as usize]);
        g.unwrap_or_else(|| embedded.sum())
    });
    Ok(Some(u.collect()))
}

/// The values of P1's basis functions at the dofs.
pub(super) struct VertexValues<'a> {
    space: &'a Space<'a>,
    /// A cell and local number of each dof.
    place: Vec<(u32, u8)>,
}

impl<'a> VertexValues<'a> {
    pub fn new(space: &'a Space<'a>) -> Self {
        let mut place = vec![(0, 0); space.dofs];
        for cell in 0..space.mesh.cell_count() {
            for (local, &dof) in (0..).zip(space.cell_dofs(cell)) {
                place[dof as usize] = (cell as u32, local);
            }
        }
        VertexValues { space, place }
    }

    pub fn of(&self, dof: u32) -> impl Iterator<Item = (u32, f64)> + '_ {
        let (cell, local) = self.place[dof as usize];
        let node = self.space.nodes[local as usize];
        let vertices = self.space.mesh.cell(cell as usize);
        let values = vertices.iter().copied().zip(node);
        values.filter(|(_, value)| *value != 0.0)
    }
}
