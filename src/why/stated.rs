//! Compares the linear system of a code with the form: finds the changed form whose equations it contains.

use serde::Serialize;

use super::changes::{CauseTold, Names};
use crate::text::{Text, text};
use faceoff_form::Problem;
use faceoff_form::judge::equations;
use faceoff_form::own;
use faceoff_judge::systems::{Both, Settings, System};
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Mesh;

/// The equations of a code in relation to a form.
#[derive(Debug, Clone, Serialize)]
pub struct Stated {
    /// The name of the code.
    pub code: String,
    /// Are its equations those of the form? If the form is nonlinear: is its residual that of the form at a state?
    pub is_form: bool,
    /// If the form is nonlinear: is its matrix the derivative of the form at that state?
    #[serde(skip_serializing_if = "Option::is_none")]
    pub is_derivative: Option<bool>,
    /// The largest difference of a row from that of the form, relative to its size.
    pub left: f64,
    /// The changes that turn the form into that of the code; empty if they are equal, or none is known.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub explanations: Vec<CauseTold>,
    /// The changes as text; empty if no such form is known.
    pub sentence: Text,
}

impl Stated {
    /// Compares a system whose dofs are those of a form.
    ///
    /// # Errors
    /// Dofs that are not those of the form; errors of [`equations`].
    pub fn new(problem: &Problem, mesh: &Mesh, system: &System) -> Result<Option<Self>> {
        let (matrix, load, dofs) = own::system(problem, mesh)?;
        let form = System::new("the form", matrix, load, dofs)?;
        let both = Both::new(&form, system)?;
        // A code with more dofs than the form does not solve it.
        if !std::ptr::eq(both.a, &form) {
            return Ok(None);
        }
        let count = both.is_held.len();
        let mut rows = vec![None; count];
        // If the form is nonlinear, the load is the residual at the state; otherwise the matrix contains all information.
        let u = match problem.clone().is_linear() {
            false => {
                let loads = &both.loads[1];
                both.free
                    .iter()
                    .for_each(|row| rows[*row] = Some(-loads[*row]));
                own::state(&form.dofs)
            }
            true => {
                // Multiples of the golden ratio modulo 1: no two are equal, and none is small.
                let generic = |row: usize| 1.0 + (row as f64 * 0.618_033_988_749_895).fract();
                let all = (0..count).map(|row| match both.is_held[row] {
                    true => [0.0, both.held(1, row)],
                    false => [generic(row); 2],
                });
                let (free, u): (Vec<f64>, Vec<f64>) = all.map(|[free, u]| (free, u)).unzip();
                let (product, _) = both.times(1, &free);
                for row in &both.free {
                    rows[*row] = Some(product[*row] - both.load(1, *row).0);
                }
                u
            }
        };
        let found = equations(problem, mesh, u, &rows)?;
        let compared = both.compare(&Settings::default())?;
        // The rows of prescribed dofs are not among those equations.
        let is_held_alike = compared.constrained.only == [0, 0] && compared.constrained.values == 0;
        let names = Names {
            problem,
            terms: &found.terms,
        };
        let code = &system.name;
        let is_form = found.left <= found.limit && is_held_alike && !both.free.is_empty();
        let exact = found.explanation.as_ref().filter(|found| found.is_exact);
        let is_derivative = match problem.clone().is_linear() {
            true => None,
            false => {
                let mut blocks = compared.matrix.iter();
                Some(blocks.all(|block| block.differs.rows == 0))
            }
        };
        let what = match is_derivative {
            None => "equations",
            Some(_) => "residual",
        };
        let sentence = match (exact, is_derivative) {
            (_, Some(true)) if is_form => {
                text!("{code} has the residual of the form and its derivative")
            }
            (_, Some(false)) if is_form => {
                text!("{code} has the residual of the form, but not its derivative")
            }
            _ if is_form => text!("{code} has the equations of the form"),
            (Some(known), _) => {
                let cause = names.sentence(&known.causes);
                text!("{code} has the {what} of the form as if {cause}")
            }
            (None, _) => Text::default(),
        };
        Ok(Some(Stated {
            code: code.clone(),
            is_form,
            is_derivative,
            left: found.left,
            explanations: exact
                .map_or_else(Vec::new, |known| names.told(&known.causes, known.left)),
            sentence,
        }))
    }
}
