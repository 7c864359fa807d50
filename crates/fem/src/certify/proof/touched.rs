//! Windows that certainly hold a point of contact.
//!
//! For a hat z ≥ 0 on Γ_C that vanishes on Γ_D,
//!
//! ```text
//! <∂ₙu, z>_C = (∇u, ∇z) - (f, z) - <t, z>_N ≤ (G, ∇z) - (f, z) - <t, z>_N + R ‖∇z‖
//! ```
//!
//! and where that is below 0, ∂ₙu is not 0 on all of z's support, so u = ψ somewhere in it. That all of a window is in
//! contact cannot be proved this way.

use super::super::cells::CellFields;
use super::super::goal::Known;
use super::super::simplex::{Simplex, dot, length, plus, up};
use super::super::{load_of_cell, load_of_face};
use super::{Line, Touched};
use crate::interval::Interval;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Triangulation;
use std::collections::BTreeSet;

/// Radii of hats, in lengths of a contact face.
const HATS: [f64; 10] = [1.5, 2.0, 2.5, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0];
/// No more hats than that along Γ_C.
const MOST_HATS: usize = 200;

impl Line {
    /// Windows with contact, joined where they overlap.
    pub fn touched(&self, fields: &CellFields, known: &Known) -> Result<Vec<Touched>> {
        let mesh = fields.problem.space.mesh;
        let around = cells_around(mesh);
        let pressed: Vec<&(usize, [f64; 2])> = self
            .faces
            .iter()
            .filter(|(k, _)| fields.lambda[*k] < 0.0)
            .collect();
        let stride = pressed.len().div_ceil(MOST_HATS).max(1);
        let mut windows: Vec<[f64; 2]> = Vec::new();
        for (k, [from, to]) in pressed.iter().step_by(stride) {
            cancel::check()?;
            let face = fields.problem.contact[*k].face;
            for hat in HATS {
                let radius = hat * (to - from);
                let window = hat_proves(fields, known, &around, mesh.face(face), self.axis, radius);
                if let Some(window) = window {
                    windows.push(window);
                    break;
                }
            }
        }
        // Only the smallest: none that has another inside.
        windows.sort_by(|a, b| a[1].total_cmp(&b[1]).then(b[0].total_cmp(&a[0])));
        let mut smallest: Vec<[f64; 2]> = Vec::new();
        for window in windows {
            if smallest.last().is_none_or(|last| window[0] > last[0]) {
                smallest.push(window);
            }
        }
        let mut groups: Vec<Touched> = Vec::new();
        let mut last = [f64::NEG_INFINITY; 2];
        for window in smallest {
            match groups.last_mut() {
                Some(group) if window[0] <= last[1] => {
                    group.to = window[1];
                    group.window = group.window.max(up(window[1], -last[0]));
                }
                _ => groups.push(Touched {
                    from: window[0],
                    to: window[1],
                    window: up(window[1], -window[0]),
                }),
            }
            last = window;
        }
        Ok(groups)
    }
}

/// Whether there is contact in the support of the hat about a face. Its ends along the axis.
pub(super) fn hat_proves(
    fields: &CellFields,
    known: &Known,
    around: &[Vec<u32>],
    face: &[u32],
    axis: usize,
    radius: f64,
) -> Option<[f64; 2]> {
    let mesh = fields.problem.space.mesh;
    let [a, b] = [0, 1].map(|i| mesh.points[face[i] as usize]);
    let centre = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
    let hat = |v: u32| -> f64 {
        if fields.data.dirichlet[v as usize].is_some() {
            return 0.0;
        }
        let x = mesh.points[v as usize];
        (1.0 - (x[0] - centre[0]).hypot(x[1] - centre[1]) / radius).max(0.0)
    };
    // The cells where z is not 0, from the face outward.
    let (mut cells, mut seen) = (BTreeSet::new(), BTreeSet::new());
    let mut next: Vec<u32> = face.to_vec();
    while let Some(vertex) = next.pop() {
        if hat(vertex) > 0.0 && seen.insert(vertex) {
            for &cell in &around[vertex as usize] {
                if cells.insert(cell) {
                    next.extend(mesh.cell(cell as usize));
                }
            }
        }
    }
    let (mut sum, mut square) = (Interval::ZERO, Vec::new());
    for &cell in &cells {
        let cell = cell as usize;
        let simplex = Simplex::new(mesh, cell);
        let mut z = [Interval::ZERO; 4];
        for (value, &vertex) in z.iter_mut().zip(mesh.cell(cell)) {
            *value = Interval::at(hat(vertex));
        }
        let slope = simplex.gradient(&z);
        // G's mean; its bubble, with mean not 0, is charged below.
        let [a, b, c, _] = fields.gradient_at_corners(&simplex, cell);
        let g = plus(&a, &plus(&b, &c)).map(|sum| sum / Interval::at(3.0));
        let bubble = 0.5 * fields.norm_of_bubble(&simplex, cell);
        let own = (dot(&slope, &slope, 2) * simplex.measure).root();
        sum += dot(&g, &slope, 2) * simplex.measure
            + Interval::around_zero((own * Interval::at(bubble)).high)
            - load_of_cell(fields, &simplex, cell, &z, None);
        for traction in fields.data.tractions.iter().filter(|t| t.cell == cell) {
            sum += -load_of_face(fields, traction, &z);
        }
        square.push(own.high);
    }
    let upper = sum + Interval::at(known.of_g) * Interval::at(length(square));
    if !(upper.high < 0.0) {
        return None;
    }
    let mut window = [f64::INFINITY, f64::NEG_INFINITY];
    for contact in &fields.problem.contact {
        let vertices = mesh.face(contact.face);
        if vertices.iter().any(|&v| hat(v) > 0.0) {
            for &v in vertices {
                let s = mesh.points[v as usize][axis];
                window = [window[0].min(s), window[1].max(s)];
            }
        }
    }
    Some(window)
}

/// The cells at each vertex.
pub(super) fn cells_around(mesh: &Triangulation) -> Vec<Vec<u32>> {
    let mut around = vec![Vec::new(); mesh.points.len()];
    for cell in 0..mesh.cell_count() {
        let vertices = mesh.cell(cell).iter();
        vertices.for_each(|&vertex| around[vertex as usize].push(cell as u32));
    }
    around
}
