//! A continuous piecewise linear v that keeps the constraints, v = g at the vertices of Γ_D and v ≤ ψ at those of
//! Γ_C, from any discrete field.

use super::data::PreparedData;
use super::{largest, refusal};
use crate::assembly::{Stiffness, value_at};
use crate::contact::Problem;
use crate::element::{P1, Space};
use crate::scene::Part;
use faceoff_mesh::error::Result;

/// Steps on the P1 energy. Averages alone cost up to a factor of 100 on slivers.
const STEPS: usize = 10;

/// What may be rounding where g meets ψ, relative to the largest of both.
const ROUNDING: f64 = 1e-12;

/// What is known of a vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Bound {
    Free,
    /// g
    Fixed(f64),
    /// ψ
    Below(f64),
}

/// v at the vertices: the averages of u_h over the cells around, ψ where λ < 0 (so that <λ, v-ψ> vanishes),
/// brought nearer to the least energy by a few steps of conjugate gradients preconditioned by the diagonal.
///
/// # Errors
/// g above ψ where Γ_D meets Γ_C: then no function keeps both.
pub(super) fn admissible(
    problem: &Problem,
    u: &[f64],
    lambda: &[f64],
    data: &PreparedData,
) -> Result<Vec<f64>> {
    let bounds = bounds(problem)?;
    let mut v = averages(problem, u);
    let mut held = vec![false; v.len()];
    for (face, lambda) in problem.contact.iter().zip(lambda) {
        if *lambda < 0.0 {
            for &vertex in problem.space.mesh.face(face.face) {
                held[vertex as usize] = true;
            }
        }
    }
    for ((v, bound), held) in v.iter_mut().zip(&bounds).zip(&mut held) {
        match *bound {
            Bound::Free => {}
            Bound::Fixed(g) => (*v, *held) = (g, true),
            Bound::Below(psi) => {
                *held |= *v >= psi;
                *v = if *held { psi } else { *v };
            }
        }
    }
    descend(problem, &held, data, &mut v);
    for (v, bound) in v.iter_mut().zip(&bounds) {
        if let Bound::Below(psi) = bound {
            *v = v.min(*psi);
        }
    }
    Ok(v)
}

fn bounds(problem: &Problem) -> Result<Vec<Bound>> {
    let mesh = problem.space.mesh;
    let data = problem.scene.data();
    let mut bounds = vec![Bound::Free; mesh.points.len()];
    let of = |part: Part| {
        let faces = (0..mesh.face_count()).filter(move |&f| problem.parts[f] == Some(part));
        faces.flat_map(|face| mesh.face(face)).copied()
    };
    for vertex in of(Part::Contact) {
        let psi = value_at(&data.psi, "psi", mesh.points[vertex as usize])?;
        bounds[vertex as usize] = Bound::Below(psi);
    }
    let points = |part| of(part).map(|vertex| mesh.points[vertex as usize]);
    let size =
        largest(&data.g, points(Part::Dirichlet)) + largest(&data.psi, points(Part::Contact));
    for vertex in of(Part::Dirichlet) {
        let mut g = value_at(&data.g, "g", mesh.points[vertex as usize])?;
        if let Bound::Below(psi) = bounds[vertex as usize] {
            if g - psi > ROUNDING * size {
                return Err(refusal(
                    format!(
                        "no function is g on Γ_D and below ψ on Γ_C: at {} g = {g} and ψ = {psi}",
                        mesh.vertex_label(vertex)
                    ),
                    "give data with g ≤ ψ where Γ_D meets Γ_C",
                ));
            }
            g = g.min(psi);
        }
        bounds[vertex as usize] = Bound::Fixed(g);
    }
    Ok(bounds)
}

fn averages(problem: &Problem, u: &[f64]) -> Vec<f64> {
    let (space, mesh) = (&problem.space, problem.space.mesh);
    let corners: Vec<_> = (0..=mesh.dim)
        .map(|i| {
            let mut lambda = [0.0; 4];
            lambda[i] = 1.0;
            space.element.values(mesh.dim, &lambda)
        })
        .collect();
    let (mut v, mut count) = (vec![0.0; mesh.points.len()], vec![0.0; mesh.points.len()]);
    for cell in 0..mesh.cell_count() {
        let local = space.local(cell, u);
        for (&vertex, phi) in mesh.cell(cell).iter().zip(&corners) {
            v[vertex as usize] += phi.iter().zip(&local).map(|(p, u)| p * u).sum::<f64>();
            count[vertex as usize] += 1.0;
        }
    }
    v.iter_mut().zip(count).for_each(|(v, count)| *v /= count);
    v
}

/// Conjugate gradients for (∇v, ∇λ_i) = (f, λ_i) + <t, λ_i>_N where `held` does not hold v.
fn descend(problem: &Problem, held: &[bool], data: &PreparedData, v: &mut [f64]) {
    let mesh = problem.space.mesh;
    let space = Space::new(mesh, &P1);
    let stiffness = Stiffness::new(&space);
    let (mut r, mut diagonal) = (vec![0.0; v.len()], vec![0.0; v.len()]);
    let corners = mesh.dim + 1;
    let mut matrix = vec![0.0; corners * corners];
    for (cell, load) in data.loads.iter().enumerate() {
        stiffness.cell_matrix(cell, &mut matrix);
        let measure = mesh.geometry(cell).measure();
        for (i, &vertex) in mesh.cell(cell).iter().enumerate() {
            r[vertex as usize] += measure * load.moment(mesh.dim, i);
            diagonal[vertex as usize] += matrix[i * corners + i];
        }
    }
    for traction in &data.tractions {
        for (&vertex, moment) in mesh.cell(traction.cell).iter().zip(traction.moments) {
            r[vertex as usize] += moment;
        }
    }
    for (r, y) in r.iter_mut().zip(stiffness.times(v)) {
        *r -= y;
    }
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let precondition = |r: &[f64]| -> Vec<f64> {
        let rows = r.iter().zip(&diagonal).zip(held);
        rows.map(|((r, d), held)| if *held { 0.0 } else { r / d })
            .collect()
    };
    let mut z = precondition(&r);
    let mut p = z.clone();
    let mut product = dot(&r, &z);
    for _ in 0..STEPS {
        let mut y = stiffness.times(&p);
        y.iter_mut()
            .zip(held)
            .for_each(|(y, held)| *y = if *held { 0.0 } else { *y });
        let curvature = dot(&p, &y);
        if !(curvature > 0.0 && product > 0.0) {
            return;
        }
        let length = product / curvature;
        for k in 0..v.len() {
            v[k] += length * p[k];
            r[k] -= length * y[k];
        }
        z = precondition(&r);
        let next = dot(&r, &z);
        let ratio = next / product;
        product = next;
        for (p, z) in p.iter_mut().zip(&z) {
            *p = z + ratio * *p;
        }
    }
}
