//! A continuous piecewise linear v that keeps the constraints with the lifts, v = g on Γ_D and v ≤ ψ on Γ_C, from any
//! discrete field.

use super::data::PreparedData;
use super::refusal;
use crate::assembly::Stiffness;
use crate::contact::Problem;
use crate::element::{P1, Space};
use crate::interval::Interval;
use faceoff_mesh::error::Result;

/// Steps on the P1 energy. Averages alone cost up to a factor of 100 on slivers.
const STEPS: usize = 10;

/// Where g and ψ meet their intervals are no wider than this for rounding, relative to the largest value.
const ROUNDING: f64 = 1e-12;

/// What is known of a vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Bound {
    Free,
    /// g
    Fixed(Interval),
    /// At most this, so that v is nowhere above ψ.
    Below(f64),
}

/// v at the vertices, for u in the data's unit: the averages of u_h over the cells around, as high as may be where λ < 0
/// (so that <λ, v-ψ> vanishes), brought nearer to the least energy by a few steps of conjugate gradients preconditioned
/// by the diagonal. An interval on Γ_D alone, where no f64 may be g.
///
/// # Errors
/// g above ψ where Γ_D meets Γ_C: then no function keeps both.
pub(super) fn admissible(
    problem: &Problem,
    u: &[f64],
    lambda: &[f64],
    data: &PreparedData,
) -> Result<Vec<Interval>> {
    let bounds = bounds(problem, data)?;
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
            Bound::Fixed(g) => (*v, *held) = (g.mid(), true),
            Bound::Below(ceiling) => {
                *held |= *v >= ceiling;
                *v = if *held { ceiling } else { *v };
            }
        }
    }
    descend(problem, &held, loads(problem, data), &mut v);
    let pairs = v.into_iter().zip(bounds);
    Ok(pairs
        .map(|(v, bound)| match bound {
            Bound::Free => Interval::at(v),
            Bound::Fixed(g) => g,
            Bound::Below(ceiling) => Interval::at(v.min(ceiling)),
        })
        .collect())
}

fn bounds(problem: &Problem, data: &PreparedData) -> Result<Vec<Bound>> {
    let mesh = problem.space.mesh;
    let mut bounds = vec![Bound::Free; mesh.points.len()];
    for (contact, obstacle) in problem.contact.iter().zip(&data.obstacles) {
        for (&vertex, ceiling) in mesh.face(contact.face).iter().zip(obstacle.ceiling) {
            let bound = &mut bounds[vertex as usize];
            *bound = Bound::Below(match *bound {
                Bound::Below(other) => ceiling.min(other),
                _ => ceiling,
            });
        }
    }
    for (bound, g) in bounds.iter_mut().zip(&data.dirichlet) {
        if let Some(g) = g {
            *bound = Bound::Fixed(*g);
        }
    }
    // Where both meet g has to be below ψ; what cannot be told apart is read as equal.
    let values = data.obstacles.iter().flat_map(|obstacle| &obstacle.values);
    let values = values.chain(data.dirichlet.iter().flatten());
    let size = values.fold(0.0, |m: f64, value| m.max(value.magnitude()));
    for (contact, obstacle) in problem.contact.iter().zip(&data.obstacles) {
        let corners = mesh.face(contact.face).iter().zip(&obstacle.ceiling);
        for ((&vertex, ceiling), psi) in corners.zip(obstacle.values) {
            let Some(g) = data.dirichlet[vertex as usize] else {
                continue;
            };
            if g.low > psi.high {
                return Err(refusal(
                    format!(
                        "no function is g on Γ_D and below ψ on Γ_C: at {} g = {} and ψ = {}",
                        mesh.vertex_label(vertex),
                        g.mid(),
                        psi.mid()
                    ),
                    "give data with g ≤ ψ where Γ_D meets Γ_C",
                ));
            }
            if !obstacle.is_lifted && g.high > ceiling + ROUNDING * size {
                return Err(refusal(
                    format!(
                        "ψ is too steep beside Γ_D, at {}: no function that is g there is shown to stay below it",
                        mesh.vertex_label(vertex)
                    ),
                    "refine the mesh there, or give an obstacle with a smaller slope",
                ));
            }
        }
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

/// (f, λ_i) + <t, λ_i>_N
fn loads(problem: &Problem, data: &PreparedData) -> Vec<f64> {
    let mesh = problem.space.mesh;
    let mut r = vec![0.0; mesh.points.len()];
    for (cell, load) in data.loads.iter().enumerate() {
        let measure = mesh.geometry(cell).measure();
        for (i, &vertex) in mesh.cell(cell).iter().enumerate() {
            r[vertex as usize] += measure * load.moment(mesh.dim, i);
        }
    }
    for traction in &data.tractions {
        for (&vertex, moment) in mesh.cell(traction.cell).iter().zip(traction.moments) {
            r[vertex as usize] += moment.mid();
        }
    }
    r
}

/// Conjugate gradients for (∇v, ∇λ_i) = r_i where `held` does not hold v.
pub(super) fn descend(problem: &Problem, held: &[bool], mut r: Vec<f64>, v: &mut [f64]) {
    let mesh = problem.space.mesh;
    let space = Space::new(mesh, &P1);
    let stiffness = Stiffness::new(&space);
    let mut diagonal = vec![0.0; v.len()];
    let corners = mesh.dim + 1;
    let mut matrix = vec![0.0; corners * corners];
    for cell in 0..mesh.cell_count() {
        stiffness.cell_matrix(cell, &mut matrix);
        for (i, &vertex) in mesh.cell(cell).iter().enumerate() {
            diagonal[vertex as usize] += matrix[i * corners + i];
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
