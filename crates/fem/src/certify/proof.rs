//! Proofs about the contact set of u itself, not of a discrete solution.

mod free;
#[cfg(test)]
mod tests;
mod touched;

use serde::Serialize;

use super::cells::CellFields;
use super::goal::Known;
use faceoff_mesh::error::Result;

/// Proved of the contact set: coordinates along Γ_C.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ContactProof {
    /// u < ψ on each of these, from here to there.
    pub free: Vec<[f64; 2]>,
    /// Where contact is.
    pub touched: Vec<Touched>,
}

/// Every window of this length between these ends has a point of contact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Touched {
    /// The lower end, as a coordinate along Γ_C.
    pub from: f64,
    /// The upper end.
    pub to: f64,
    /// The length of a window, rounded up.
    pub window: f64,
}

/// On more cells than that nothing is looked for: each ball is a dual problem.
const MANY: usize = 20_000;

/// What is proved about the contact set, in 2D where Γ_C lies on one line parallel to an axis; else nothing.
///
/// # Errors
/// The errors of the linear solver.
pub(super) fn contact(fields: &CellFields, known: &Known) -> Result<Option<ContactProof>> {
    let mesh = fields.problem.space.mesh;
    if mesh.dim != 2 || mesh.cell_count() > MANY {
        return Ok(None);
    }
    let Some(line) = Line::of(fields) else {
        return Ok(None);
    };
    Ok(Some(ContactProof {
        touched: line.touched(fields, known)?,
        free: line.free(fields, known)?,
    }))
}

/// Γ_C on a line parallel to an axis, with the domain on one side of it.
struct Line {
    /// The axis, and the other coordinate.
    axis: usize,
    level: f64,
    /// Indices of the contact faces in order, with their ends.
    faces: Vec<(usize, [f64; 2])>,
}

impl Line {
    fn of(fields: &CellFields) -> Option<Self> {
        let mesh = fields.problem.space.mesh;
        let contact = &fields.problem.contact;
        let points = || {
            contact
                .iter()
                .flat_map(|c| mesh.face(c.face))
                .map(|&v| mesh.points[v as usize])
        };
        let first = points().next()?;
        let axis = (0..2).find(|&axis| points().all(|p| p[1 - axis] == first[1 - axis]))?;
        let mut faces: Vec<(usize, [f64; 2])> = contact
            .iter()
            .enumerate()
            .map(|(k, contact)| {
                let ends = [0, 1].map(|i| mesh.points[mesh.face(contact.face)[i] as usize][axis]);
                (k, [ends[0].min(ends[1]), ends[0].max(ends[1])])
            })
            .collect();
        faces.sort_by(|a, b| a.1[0].total_cmp(&b.1[0]));
        // The domain is only on one side of the line: no two bodies, and no two sides of a crack.
        let level = first[1 - axis];
        let is_above = |k: usize| {
            let geometry = mesh.geometry(contact[k].cell);
            geometry.point(&geometry.centroid())[1 - axis] > level
        };
        let is_one_side = faces.iter().all(|(k, _)| is_above(*k) == is_above(0));
        let is_apart = faces.windows(2).all(|pair| pair[0].1[1] <= pair[1].1[0]);
        if !(is_one_side && is_apart) {
            return None;
        }
        Some(Line { axis, level, faces })
    }

    fn point(&self, s: f64) -> [f64; 3] {
        let mut x = [0.0; 3];
        (x[self.axis], x[1 - self.axis]) = (s, self.level);
        x
    }
}
