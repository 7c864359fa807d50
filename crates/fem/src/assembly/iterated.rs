//! (∇u, ∇φ_i)_h = b_i on dofs whose values are not given, by iterations that P1 ⊂ CR, P2 preconditions.

use super::Stiffness;
use crate::element::Space;
use crate::linear::{
    Choice, Csr, Embedded, KrylovStop, Precision, Solver, Sweeps, conjugate_gradients,
};
use faceoff_mesh::error::Result;

/// The dofs whose values are not given, and P1 at them.
pub(crate) struct Free<'a> {
    space: &'a Space<'a>,
    /// Free number of each dof, and the dof of each free number.
    pub number: Vec<Option<u32>>,
    pub dofs: Vec<u32>,
    /// The vertices where P1 functions vanish because u is given.
    held: Vec<bool>,
}

impl<'a> Free<'a> {
    pub fn new(space: &'a Space<'a>, is_given: impl Fn(usize) -> bool) -> Self {
        let mut number = vec![None; space.dofs];
        let mut dofs = Vec::with_capacity(space.dofs);
        let mut held = vec![false; space.mesh.points.len()];
        for (dof, number) in number.iter_mut().enumerate() {
            if is_given(dof) {
                let vertices = space.vertex_values(dof);
                vertices.for_each(|(vertex, _)| held[vertex as usize] = true);
            } else {
                *number = Some(dofs.len() as u32);
                dofs.push(dof as u32);
            }
        }
        Free {
            space,
            number,
            dofs,
            held,
        }
    }

    /// P1 functions that vanish where u is given and at the `closed` dofs, with the matrix on all vertices; none where that does
    /// not coarsen.
    pub fn embedded(&self, closed: &[u32], on_vertices: &Csr) -> Option<Embedded> {
        let _span = tracing::debug_span!("P1 matrix").entered();
        let mut held = self.held.clone();
        let values = |dof: u32| self.space.vertex_values(dof as usize);
        for (vertex, _) in closed.iter().flat_map(|&dof| values(dof)) {
            held[vertex as usize] = true;
        }
        let mut number = vec![None; held.len()];
        let mut count = 0;
        for vertex in (0..held.len()).filter(|&vertex| !held[vertex]) {
            number[vertex] = Some(count);
            count += 1;
        }
        let embedding = Csr::by_chunks(
            self.dofs.len(),
            count as usize,
            || (),
            |(), rows, part| {
                for &dof in &self.dofs[rows] {
                    part.end_row(values(dof).filter_map(|(vertex, value)| {
                        number[vertex as usize].map(|column| (column, value))
                    }));
                }
            },
        );
        Embedded::new(embedding, on_vertices.submatrix(&number))
    }
}

/// Data that are reused for many b.
pub(crate) struct Iterated {
    sweeps: Sweeps,
    embedded: Embedded,
    dofs: Vec<u32>,
}

/// Most iterations.
const STEPS: usize = 200;

impl Iterated {
    /// None if P1 does not coarsen.
    ///
    /// # Errors
    /// The errors of [`Csr::sum`].
    pub fn new(
        stiffness: &Stiffness,
        is_given: impl Fn(usize) -> bool,
        on_vertices: &Csr,
    ) -> Result<Option<Self>> {
        let free = Free::new(stiffness.space(), is_given);
        let Some(embedded) = free.embedded(&[], on_vertices) else {
            return Ok(None);
        };
        Ok(Some(Iterated {
            sweeps: Sweeps::new(Csr::sum(stiffness, &free.number, |_| false)?),
            embedded,
            dofs: free.dofs,
        }))
    }

    /// u with a residual of this norm at most, and 0 where it is given; none where no iteration reaches that.
    pub fn solution(&mut self, b: &[f64], residual: f64) -> Option<Vec<f64>> {
        let (sweeps, matrix) = (&self.sweeps, self.sweeps.matrix());
        let of_free: Vec<f64> = self.dofs.iter().map(|&dof| b[dof as usize]).collect();
        let mut found = vec![0.0; of_free.len()];
        let ended = conjugate_gradients(
            |x, y| matrix.times(x, y),
            |r, z| self.embedded.apply(sweeps, r, z, None, None),
            &of_free,
            &mut found,
            KrylovStop {
                residual,
                steps: STEPS,
            },
        );
        tracing::debug!(?ended, "iterations for a flux");
        let mut u = vec![0.0; b.len()];
        let values = self.dofs.iter().zip(found);
        values.for_each(|(&dof, value)| u[dof as usize] = value);
        ended.reached.then_some(u)
    }
}

/// Seconds that an operation on sparse vectors takes, fitted as those of a factorisation are.
const ITERATED_FLOP: f64 = 1e-9;
/// Additional costs of iterations, on a mesh of any size.
const ITERATED: f64 = 6e-3;
/// Bytes of a dof: twenty vectors in f32, a dozen in f64, the embedding of P1 and its transpose.
const OF_DOF: usize = 250;

/// The predicted cost of `count` iterations; `beside` is the operations and bytes of everything else.
pub(crate) fn iterations(stiffness: &Stiffness, count: f64, beside: (f64, usize)) -> Choice {
    let Space { mesh, dofs, .. } = stiffness.space();
    let entries = entries(stiffness);
    // Two sweeps, a residual and a product; the hierarchy below takes about half as much again.
    let flops = count * 6.0 * entries as f64 + beside.0;
    // The matrix in f64 and in f32, and once more while it is put together; what is kept of the cells; the rest.
    let of_cells = 4 * mesh.dim * (mesh.dim + 1) * mesh.cell_count();
    let bytes = 32 * entries + of_cells + dofs * OF_DOF + beside.1;
    Choice {
        solver: Solver::Iterative,
        precision: Precision::F64,
        entries,
        flops,
        predicted_mb: bytes as f64 / 1e6,
        predicted_seconds: ITERATED + ITERATED_FLOP * flops,
    }
}

/// Entries of the stiffness, with those where u is given.
fn entries(stiffness: &Stiffness) -> usize {
    let Space {
        mesh,
        element,
        dofs,
        local_dofs,
        ..
    } = stiffness.space();
    let cells = mesh.cell_count();
    if element.degree() == 2 {
        // Pairs on a common edge, also on a common face, and in a common cell.
        let edges = dofs - mesh.points.len();
        let of_cells = match mesh.dim {
            2 => 12 * cells,
            _ => 12 * mesh.face_count() + 6 * cells,
        };
        return dofs + 6 * edges + of_cells;
    }
    // Each cell ties each of its dofs to each other; on the diagonal they meet.
    cells * local_dofs * (local_dofs - 1) + dofs
}
