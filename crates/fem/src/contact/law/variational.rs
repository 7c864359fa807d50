//! The variational inequality.

use std::collections::BTreeMap;

use super::formula::{Formula, OnContact};
use crate::assembly::value_at;
use crate::contact::condition::Condition;
use faceoff_mesh::error::Result;
use faceoff_mesh::parallel;

/// The variational inequality over { v ∈ V_h : v ≤ ψ at every dof on Γ_C }: at the vertices
/// for P1; for CR the mean on every face (D. Hua, L. Wang, J. Comput. Math. 25, 2007).
pub(super) struct Variational;

impl Formula for Variational {
    fn thetas(&self) -> [f64; 2] {
        [0.0, 1.0]
    }

    /// γ only scales the rows.
    fn gamma0(&self) -> Option<f64> {
        Some(1.0)
    }

    fn replaces_rows(&self) -> bool {
        true
    }

    fn conditions(&self, on: &OnContact) -> Result<Vec<Condition>> {
        let OnContact {
            space,
            faces,
            psi,
            stiffness,
            load,
            dirichlet,
        } = *on;
        let mut constraints: BTreeMap<u32, Constraint> = BTreeMap::new();
        for face in faces {
            let local = space.mesh.local_face(face.cell, face.face);
            let dofs: Vec<u32> = space.face_dofs(face.cell, local).collect();
            let mass = face.measure / dofs.len() as f64;
            for &dof in dofs
                .iter()
                .filter(|&&dof| dirichlet[dof as usize].is_none())
            {
                let constraint = constraints.entry(dof).or_default();
                constraint.mass += mass;
                constraint.gamma += mass * face.gamma;
                constraint.psi = if space.element.on().faces {
                    let terms = face.points.iter().map(|p| p.weight * p.psi);
                    terms.sum::<f64>() / face.measure
                } else {
                    value_at(psi, "psi", space.point(dof as usize))?
                };
            }
        }
        let mut is_held = vec![false; space.dofs];
        for &dof in constraints.keys() {
            is_held[dof as usize] = true;
        }
        let near = |cell: &usize| {
            space
                .cell_dofs(*cell)
                .iter()
                .any(|&dof| is_held[dof as usize])
        };
        let count = space.mesh.cell_count();
        let cells = parallel::chunks(count, parallel::share(count), |cells| {
            cells.filter(near).collect()
        });
        stiffness.for_each(cells.into_iter(), |row, column, value| {
            if let Some(constraint) = constraints.get_mut(&row) {
                *constraint.row.entry(column).or_default() += value;
            }
        });
        let condition = |(dof, c): (u32, Constraint)| Condition {
            weight: c.mass,
            gamma: c.gamma / c.mass,
            displacement: c
                .row
                .keys()
                .map(|&d| f64::from(u8::from(d == dof)))
                .collect(),
            flux: c.row.values().map(|a| a / c.mass).collect(),
            flux_at_rest: -load[dof as usize] / c.mass,
            dofs: c.row.into_keys().collect(),
            psi: c.psi,
            thetas: self.thetas(),
            row: None,
        };
        Ok(constraints.into_iter().map(condition).collect())
    }
}

/// A dof of degree 1 on Γ_C while its condition is put together.
#[derive(Default)]
struct Constraint {
    /// ∫_C φ
    mass: f64,
    /// Σ_F γ_F ∫_F φ
    gamma: f64,
    /// Its row of the stiffness matrix.
    row: BTreeMap<u32, f64>,
    psi: f64,
}
