//! The rows of contact cells as one block. A law that adds to them, instead of replacing one of each face, makes them
//! nonsymmetric and, where γ is far from h, of another size than the stiffness: no sweep over single rows reduces that.

use super::condensed::of_contact_cells;
use super::condition::Condition;
use super::form::Problem;
use super::system::Weights;
use crate::linear::{Analysis, Entry, Role, Schur, SchurLu, Settings, Solver, condense};
use faceoff_mesh::error::Result;

/// The stiffness of the dofs of contact cells.
pub(super) struct Layer(Schur);

impl Layer {
    /// # Errors
    /// Memory that is not there.
    pub fn new(problem: &Problem) -> Result<Option<Self>> {
        let settings = Settings {
            solver: Solver::Multifrontal,
            ..Settings::default()
        };
        let zero = vec![0.0; problem.space.dofs];
        let ties = ties(problem);
        let found = condense(
            &problem.stiffness,
            &roles(problem),
            &ties,
            zero,
            settings,
            None,
        )?;
        Ok(found.map(|(_, _, block, _)| Layer(block)))
    }

    /// Its dofs, ascending.
    pub fn dofs(&self) -> &[u32] {
        self.0.kept()
    }

    /// The block with these laws, factored in the memory of an `old` one.
    pub fn lu(&self, conditions: &[Condition], laws: &[Weights], old: Option<SchurLu>) -> SchurLu {
        let mut entries: Vec<Entry> = Vec::new();
        for (condition, law) in conditions.iter().zip(laws) {
            let place = |dof: &u32| self.dofs().binary_search(dof).map(|k| k as u32);
            let places: Vec<_> = condition.dofs.iter().map(place).collect();
            condition.for_each_local_entry(*law, |i, j, value| {
                if let (Ok(i), Ok(j)) = (places[i], places[j]) {
                    entries.push((i, j, value));
                }
            });
        }
        self.0.lu(&entries, old)
    }

    /// Multiplications and additions of its factorisations, and bytes.
    pub fn predicted(problem: &Problem) -> (f64, usize) {
        let analysis = Analysis::new(&problem.stiffness, &roles(problem), &ties(problem), false);
        (analysis.flops(), analysis.bytes(8))
    }
}

fn ties<'a>(problem: &'a Problem) -> Vec<&'a [u32]> {
    problem.conditions.iter().map(|c| &c.dofs[..]).collect()
}

/// Everything else stays where it is.
fn roles(problem: &Problem) -> Vec<Role> {
    let mut roles = vec![Role::Fixed; problem.space.dofs];
    for dof in of_contact_cells(problem) {
        if problem.dirichlet[dof as usize].is_none() {
            roles[dof as usize] = Role::Kept;
        }
    }
    roles
}
