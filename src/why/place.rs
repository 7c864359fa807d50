//! The position of a fault in the mesh.

use serde::Serialize;

use crate::text::{Number, Text, text};
use faceoff_fem::contact::Problem;

/// A vertex, an edge or a face.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spot {
    /// Its vertices, ascending.
    pub vertices: Vec<u32>,
    /// Its centroid, with one coordinate per dimension of the mesh.
    pub midpoint: Vec<f64>,
    /// The largest backward error of a row there.
    pub error: f64,
}

/// The most places that a sentence names.
const NAMED: usize = 3;

impl Spot {
    /// The entity that carries a dof.
    pub(super) fn of_dof(problem: &Problem, dof: usize, error: f64) -> Self {
        let space = &problem.space;
        Spot {
            vertices: space.carrier(dof),
            midpoint: space.point(dof)[..space.mesh.dim].to_vec(),
            error,
        }
    }

    /// A face; the error is that of the worst row of the adjacent cell.
    pub(super) fn of_face(problem: &Problem, face: usize, errors: &[f64]) -> Self {
        let mesh = problem.space.mesh;
        let cell = mesh.face_cells(face)[0] as usize;
        let rows = problem.space.cell_dofs(cell).iter();
        Spot {
            vertices: mesh.face(face).to_vec(),
            midpoint: mesh.face_midpoint(face)[..mesh.dim].to_vec(),
            // NaN counts as the largest.
            error: rows
                .map(|row| errors[*row as usize])
                .max_by(|a, b| a.abs().total_cmp(&b.abs()))
                .unwrap_or(0.0),
        }
    }

    /// `face [6, 7] at (0.2031, 0.0000)`
    pub fn words(&self) -> Text {
        let at = self.midpoint.iter().map(|x| Number::fixed(*x, 4));
        text!("{} at ({})", self.carrier(), Text::joined(at, ", "))
    }

    /// `face [6, 7]`
    pub fn carrier(&self) -> String {
        let kind = match self.vertices.len() {
            1 => "vertex",
            n if n == self.midpoint.len() => "face",
            _ => "edge",
        };
        format!("{kind} {:?}", self.vertices)
    }

    /// The first of them by name, the rest by their number.
    pub(super) fn list(spots: &[Spot]) -> Text {
        let named = Text::joined(spots.iter().take(NAMED).map(Spot::words), ", ");
        match spots.len().saturating_sub(NAMED) {
            0 => named,
            more => text!("{} and {} more", named, more),
        }
    }
}
