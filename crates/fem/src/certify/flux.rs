//! An equilibrated flux σ: -div σ = Π₁f on every cell, σ·n continuous, the mean of t on Γ_N, λ ≤ 0 on Γ_C.
//!
//! L. D. Marini, SIAM J. Numer. Anal. 22 (1985): if w ∈ CR solves (∇w, ∇φ_F) = (f, φ_F) + <t, φ_F>_N + <λ, φ_F>_C
//! for every face F off Γ_D, the Raviart–Thomas flux with
//!
//! ```text
//! ∫_F σ·n = (∇w, ∇φ_F)_κ - (f, φ_F)_κ - <t, φ_F>_{∂κ∩Γ_N}     out of κ through F
//! ```
//!
//! has the same value, with the other sign, from the other side, and -div σ = Π₀f, since the φ_F of a
//! cell sum to 1. On Γ_N itself t is counted once, not taken away.

use super::data::PreparedData;
use crate::assembly::Stiffness;
use crate::contact::Problem;
use crate::element::{CR, Space};
use crate::linear::{Role, Settings, condense};
use crate::quadrature;
use crate::scene::Part;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::CellGeometry;
use nalgebra::Vector3;

/// σ·n on the contact faces that u_h says: its flux where P(u_h) ≤ 0, with the cell's height for γ
/// (with γ itself the paper's law has a spurious flux where nothing touches), and never positive.
pub(super) fn contact_fluxes(problem: &Problem, u: &[f64]) -> Vec<f64> {
    let mesh = problem.space.mesh;
    let flux = |face: &crate::contact::ContactFace| {
        let local = problem.space.local(face.cell, u);
        let (mut flux, mut gap) = (0.0, 0.0);
        for point in &face.points {
            let trace = point.trace(face.gamma, &local);
            flux += point.weight / face.measure * trace.flux;
            gap += point.weight / face.measure * trace.gap;
        }
        let height = mesh.dim as f64 * mesh.geometry(face.cell).measure() / face.measure;
        if height * flux - gap <= 0.0 {
            flux.min(0.0)
        } else {
            0.0
        }
    };
    problem.contact.iter().map(flux).collect()
}

/// ∫_F σ·n out of each cell, by its local faces: `dim + 1` numbers a cell.
///
/// Takes u_h itself for w where it solves these equations to rounding, as `cr-fc` does where the rule of
/// its load is exact; else solves them.
///
/// # Errors
/// Those of the linear solver.
pub(super) fn equilibrated(
    problem: &Problem,
    u: &[f64],
    lambda: &[f64],
    data: &PreparedData,
) -> Result<Vec<f64>> {
    let mesh = problem.space.mesh;
    let (dim, corners) = (mesh.dim, mesh.dim + 1);
    let space = Space::new(mesh, &CR);
    let stiffness = Stiffness::new(&space);
    let measure = |cell: usize| mesh.geometry(cell).measure();
    // (f, φ)_κ, and <t, φ> on the faces of κ that are not on Γ_N.
    let mut cells = vec![0.0; corners * mesh.cell_count()];
    for (cell, (of_cell, load)) in cells.chunks_exact_mut(corners).zip(&data.loads).enumerate() {
        let measure = measure(cell);
        for (i, b) in of_cell.iter_mut().enumerate() {
            *b = measure * load.on_face(dim, i);
        }
    }
    let mut b = vec![0.0; space.dofs];
    for traction in &data.tractions {
        b[traction.face] += traction.total;
        for (i, &face) in mesh.cell_faces(traction.cell).iter().enumerate() {
            if face as usize != traction.face {
                let on_other = traction.total - dim as f64 * traction.moments[i];
                cells[corners * traction.cell + i] += on_other;
            }
        }
    }
    for cell in 0..mesh.cell_count() {
        for (&face, part) in mesh.cell_faces(cell).iter().zip(&cells[corners * cell..]) {
            b[face as usize] += part;
        }
    }
    for (face, lambda) in problem.contact.iter().zip(lambda) {
        b[face.face] += lambda * face.measure;
    }

    let own = (problem.space.element.name() == "CR")
        .then(|| u.to_vec())
        .filter(|w| is_solution(problem, &stiffness, w, &b));
    let w = match own {
        Some(w) => w,
        None => solution(problem, &stiffness, &b)?,
    };

    let mut fluxes = vec![0.0; cells.len()];
    let mut matrix = vec![0.0; corners * corners];
    for cell in 0..mesh.cell_count() {
        stiffness.cell_matrix(cell, &mut matrix);
        let local = space.local(cell, &w);
        for i in 0..corners {
            let row = &matrix[corners * i..corners * (i + 1)];
            let out: f64 = row.iter().zip(&local).map(|(a, w)| a * w).sum();
            fluxes[corners * cell + i] = out - cells[corners * cell + i];
        }
    }
    // What is given is given, not equal up to rounding.
    for (face, lambda) in problem.contact.iter().zip(lambda) {
        let local = mesh.local_face(face.cell, face.face);
        fluxes[corners * face.cell + local] = lambda * face.measure;
    }
    Ok(fluxes)
}

/// Do the rows off Γ_D hold to rounding?
fn is_solution(problem: &Problem, stiffness: &Stiffness, w: &[f64], b: &[f64]) -> bool {
    let (product, sizes) = (stiffness.times(w), stiffness.sizes(w));
    (0..w.len()).all(|face| {
        problem.parts[face] == Some(Part::Dirichlet)
            || (product[face] - b[face]).abs() <= 1e-13 * (sizes[face] + b[face].abs())
    })
}

fn solution(problem: &Problem, stiffness: &Stiffness, b: &[f64]) -> Result<Vec<f64>> {
    let g = &problem.scene.data().g;
    let mesh = problem.space.mesh;
    let mut w = vec![0.0; b.len()];
    let mut roles = vec![Role::Eliminated; b.len()];
    let rule = quadrature::exact(mesh.dim - 1, 5);
    for (face, part) in problem.parts.iter().enumerate() {
        if *part == Some(Part::Dirichlet) {
            roles[face] = Role::Fixed;
            let vertices = mesh.face(face);
            for (lambda, weight) in rule.iter() {
                let x: [f64; 3] = std::array::from_fn(|k| {
                    let corners = vertices.iter().zip(lambda);
                    corners.map(|(&v, l)| l * mesh.points[v as usize][k]).sum()
                });
                w[face] += weight * g.value(x);
            }
        }
    }
    let rest = |w: &[f64]| -> Vec<f64> {
        let product = stiffness.times(w);
        b.iter().zip(product).map(|(b, y)| b - y).collect()
    };
    let condensed = condense(stiffness, &roles, rest(&w), Settings::default(), None)?;
    let Some((factor, reduced, ..)) = condensed else {
        return Err(Error::Solver {
            what: "no solver was chosen for the flux".into(),
            remedy: "report this".into(),
        });
    };
    // The second solve takes away the rounding of the first.
    let mut add = |reduced: &crate::linear::Reduced| {
        let mut step = vec![0.0; w.len()];
        factor.expand(reduced, &[], &mut step);
        for ((w, step), role) in w.iter_mut().zip(step).zip(&roles) {
            if *role != Role::Fixed {
                *w += step;
            }
        }
        rest(&w)
    };
    let left = add(&reduced);
    add(&factor.reduce(&left));
    Ok(w)
}

/// σ on one cell: the Raviart–Thomas part Σ_i flux_i (x - x_i)/(d|κ|), and τ = -1/(d+1) Σ_i a_i λ_i (x - x_i)
/// with a_i the slopes of Π₁f, which has no normal trace on any face and -div τ = Π₁f - Π₀f.
pub(super) fn value(
    cell: &CellGeometry,
    fluxes: &[f64],
    slopes: &[f64; 4],
    lambda: &[f64; 4],
) -> Vector3<f64> {
    let d = cell.dim as f64;
    let x = Vector3::from(cell.point(lambda));
    let mut sigma = Vector3::zeros();
    for (i, flux) in fluxes.iter().enumerate() {
        let weight = flux / (d * cell.measure()) - slopes[i] * lambda[i] / (d + 1.0);
        sigma += weight * (x - cell.vertices[i]);
    }
    sigma
}
