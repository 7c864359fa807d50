//! A continuous v that keeps the constraints with the lifts, v = g on Γ_D and v ≤ ψ on Γ_C, from any discrete field: linear on
//! the cells, or of second order with 4 b λ_a λ_b on each face ([`super::second_order`]).

use super::data::PreparedData;
use super::refusal;
use crate::assembly::{Stiffness, sum_over_cells};
use crate::contact::{ContactFace, Problem};
use crate::element::Space;
use crate::interval::Interval;
use crate::linear::{KrylovStop, conjugate_gradients};
use crate::scene::Part;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Triangulation;
use faceoff_mesh::parallel;

/// Steps on the energy. Averages without these steps cost up to a factor of 100 on slivers.
const STEPS: usize = 10;
/// Those for P2, from few on large meshes to more on small ones: with about this many dofs in all of them. At n = 64 the bound of G
/// is 5 % above that of 30 steps with 6, and 3 % with 10.
const STEPS_OF_SECOND_ORDER: std::ops::RangeInclusive<usize> = 6..=10;
const DOFS: usize = 400_000;

/// Where g and ψ meet their intervals are no wider than this for rounding, relative to the largest value.
const ROUNDING: f64 = 1e-12;

/// What is known about a vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Bound {
    Free,
    /// g
    Fixed(Interval),
    /// At most this, so that v is nowhere above ψ.
    Below(f64),
}

/// v at the vertices, and b on the faces where it is of second order.
pub(super) struct Admissible {
    /// An interval only on Γ_D, where no f64 may equal g.
    pub vertices: Vec<Interval>,
    /// Empty where all are 0.
    pub faces: Vec<f64>,
}

/// v from what is near u in its space: raised to ψ where λ < 0 and that costs less than <λ, v-ψ>, and brought nearer to the least
/// energy by a few steps of conjugate gradients preconditioned by the diagonal.
///
/// # Errors
/// g above ψ where Γ_D meets Γ_C: then no function keeps both.
pub(super) fn admissible(
    problem: &Problem,
    mut v: Vec<f64>,
    lambda: &[f64],
    data: &PreparedData,
    stiffness: &Stiffness,
    diagonal: &[f64],
) -> Result<Admissible> {
    let (mesh, space) = (problem.space.mesh, stiffness.space());
    let bounds = bounds(problem, data)?;
    let is_quadratic = space.element.degree() == 2;
    let first = mesh.points.len();
    // -<λ, φ_i>_C
    let mut pressure = vec![0.0; first];
    for (contact, lambda) in problem.contact.iter().zip(lambda) {
        for &vertex in mesh.face(contact.face) {
            pressure[vertex as usize] -= lambda * contact.measure / mesh.dim as f64;
        }
    }
    let mut held = vec![false; v.len()];
    for (i, (v, bound)) in v.iter_mut().zip(&bounds).enumerate() {
        match *bound {
            Bound::Free => {}
            Bound::Fixed(g) => (*v, held[i]) = (g.mid(), true),
            Bound::Below(ceiling) => {
                // Raised to ψ v adds ‖∇φ_i‖² gap² to M² where u_h was right; left where it is, 4 |<λ, φ_i>| gap to 4B.
                let gap = ceiling - *v;
                if gap <= 0.0 || 4.0 * pressure[i] > diagonal[i] * gap {
                    (*v, held[i]) = (ceiling, true);
                }
            }
        }
    }
    let is_pressed = |(contact, lambda): (&ContactFace, &f64)| {
        let mut ends = mesh.face(contact.face).iter();
        *lambda < 0.0 && ends.all(|&vertex| held[vertex as usize])
    };
    let pressed: Vec<bool> = problem.contact.iter().zip(lambda).map(is_pressed).collect();
    if is_quadratic {
        let mut faces = bubbles(space, &v);
        for face in constrain(problem, data, &pressed, &v, &mut faces) {
            let dof = first + face;
            (v[dof], held[dof]) = (flat(mesh, face, &v) + faces[face], true);
        }
    }
    let b = loads(space, data);
    descend(stiffness, diagonal, &held, &[], b, &mut v, steps(space));
    let pairs = v.iter().zip(bounds);
    let vertices = pairs.map(|(v, bound)| match bound {
        Bound::Free => Interval::at(*v),
        Bound::Fixed(g) => g,
        Bound::Below(ceiling) => Interval::at(v.min(ceiling)),
    });
    let vertices: Vec<Interval> = vertices.collect();
    let mut faces = Vec::new();
    if is_quadratic {
        faces = bubbles(space, &v);
        let highest: Vec<f64> = vertices.iter().map(|v| v.high).collect();
        constrain(problem, data, &pressed, &highest, &mut faces);
    }
    Ok(Admissible { vertices, faces })
}

/// u_h in the space of v, without any constraint: itself where it is of P2, else averaged over the cells around.
pub(super) fn near(problem: &Problem, u: &[f64], space: &Space) -> Vec<f64> {
    let mesh = problem.space.mesh;
    if space.element.degree() == 2 && problem.space.element.degree() == 2 {
        return u.to_vec();
    }
    let mut v = averages(problem, u);
    if v.len() < space.dofs {
        let first = v.len();
        v.resize(space.dofs, 0.0);
        let (vertices, middles) = v.split_at_mut(first);
        parallel::update(middles, |face, _| flat(mesh, face, vertices));
    }
    v
}

/// Half the sum of the values at the ends of a face.
fn flat(mesh: &Triangulation, face: usize, v: &[f64]) -> f64 {
    0.5 * mesh
        .face(face)
        .iter()
        .map(|&vertex| v[vertex as usize])
        .sum::<f64>()
}

/// b of a function of P2: its dofs are the vertices, and in 2D the midpoints of the faces.
pub(super) fn bubbles(space: &Space, v: &[f64]) -> Vec<f64> {
    let (vertices, middles) = v.split_at(space.mesh.points.len());
    parallel::collect(middles.len(), |face| {
        middles[face] - flat(space.mesh, face, vertices)
    })
}

/// Makes b that of g on Γ_D, and that of ψ on pressed faces; elsewhere on Γ_C no larger than where v is below ψ for sure: the
/// coefficients of Bernstein of v and of the linear function of the ceilings are compared. Returns the faces whose b that gives.
fn constrain(
    problem: &Problem,
    data: &PreparedData,
    pressed: &[bool],
    vertices: &[f64],
    faces: &mut [f64],
) -> Vec<usize> {
    let mesh = problem.space.mesh;
    let on_dirichlet =
        (0..faces.len()).filter(|&face| problem.parts[face] == Some(Part::Dirichlet));
    let mut held: Vec<usize> = on_dirichlet.collect();
    held.iter().for_each(|&face| faces[face] = data.bend(face));
    let pairs = problem.contact.iter().zip(&data.obstacles).zip(pressed);
    for ((contact, obstacle), &is_pressed) in pairs {
        let ends = mesh.face(contact.face).iter().zip(obstacle.ceiling);
        let gaps: Interval = ends
            .map(|(&vertex, ceiling)| {
                Interval::at(ceiling) - Interval::at(vertices[vertex as usize])
            })
            .sum();
        let bend = data.bend(contact.face);
        let most = (Interval::at(bend) + 0.25 * gaps).low;
        let b = &mut faces[contact.face];
        if is_pressed || *b >= most {
            *b = if is_pressed { bend.min(most) } else { most };
            held.push(contact.face);
        }
    }
    held
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
    // Where both meet g has to be below ψ; values that cannot be distinguished are taken as equal.
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
                        "at {}, where Γ_D meets Γ_C, no function that is g is shown to stay below ψ: ψ is too steep there, or g too near it",
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
    let values = |cell: usize| -> [f64; 4] {
        let local = space.local(cell, u);
        let mut values = [0.0; 4];
        for (value, phi) in values.iter_mut().zip(&corners) {
            *value = phi.iter().zip(&local).map(|(p, u)| p * u).sum();
        }
        values
    };
    let values = parallel::collect(mesh.cell_count(), values);
    let (mut v, mut count) = (vec![0.0; mesh.points.len()], vec![0.0; mesh.points.len()]);
    for (cell, values) in values.iter().enumerate() {
        for (&vertex, value) in mesh.cell(cell).iter().zip(values) {
            v[vertex as usize] += value;
            count[vertex as usize] += 1.0;
        }
    }
    v.iter_mut().zip(count).for_each(|(v, count)| *v /= count);
    v
}

/// (f, φ_i) + <t, φ_i>_N. P2's function of a vertex is λ_i less half the bubbles of its faces.
pub(super) fn loads(space: &Space, data: &PreparedData) -> Vec<f64> {
    let mesh = space.mesh;
    let is_quadratic = space.element.degree() == 2;
    let mut r = sum_over_cells(space, |cells, vectors| {
        for (cell, r) in cells.zip(vectors.chunks_exact_mut(space.local_dofs)) {
            let (load, measure) = (&data.loads[cell], mesh.measure(cell));
            let bubbles = if is_quadratic { load.bubbles } else { [0.0; 3] };
            let all: f64 = bubbles.iter().sum();
            let (at_vertices, in_middles) = r.split_at_mut(mesh.dim + 1);
            for (i, r) in at_vertices.iter_mut().enumerate() {
                let others = all - bubbles.get(i).copied().unwrap_or(0.0);
                *r = measure * (load.moment(mesh.dim, i) - 0.5 * others);
            }
            for (r, bubble) in in_middles.iter_mut().zip(bubbles) {
                *r = measure * bubble;
            }
        }
    });
    for traction in &data.tractions {
        let bubble = if is_quadratic {
            traction.bubble.mid()
        } else {
            0.0
        };
        for (&vertex, moment) in mesh.cell(traction.cell).iter().zip(traction.moments) {
            let is_end = mesh.face(traction.face).contains(&vertex);
            r[vertex as usize] += moment.mid() - if is_end { 0.5 * bubble } else { 0.0 };
        }
        if is_quadratic {
            r[mesh.points.len() + traction.face] += bubble;
        }
    }
    r
}

/// How many steps v takes.
pub(super) fn steps(space: &Space) -> usize {
    let (least, most) = STEPS_OF_SECOND_ORDER.into_inner();
    match space.element.degree() {
        1 => STEPS,
        _ => (DOFS / space.dofs.max(1)).clamp(least, most),
    }
}

/// A given number of steps for (∇v, ∇φ_i) = b_i where `held` does not fix v; fixed dofs in one of `parts` move with all of that part.
pub(super) fn descend(
    stiffness: &Stiffness,
    diagonal: &[f64],
    held: &[bool],
    parts: &[&[usize]],
    b: Vec<f64>,
    v: &mut [f64],
    steps: usize,
) {
    let space = stiffness.space();
    // (∇χ, ∇χ) of what is 1 on a part.
    let of_parts: Vec<f64> = parts
        .iter()
        .map(|part| {
            let mut one = vec![0.0; space.dofs];
            part.iter().for_each(|&dof| one[dof] = 1.0);
            let product = stiffness.times(&one);
            part.iter().map(|&dof| product[dof]).sum()
        })
        .collect();
    conjugate_gradients(
        |x, y| stiffness.times_into(x, y),
        |r, z| {
            // Fixed dofs have no residual, and so no step.
            parallel::update(z, |i, _| if held[i] { 0.0 } else { r[i] / diagonal[i] });
            for (part, square) in parts.iter().zip(&of_parts) {
                let step = part.iter().map(|&dof| r[dof]).sum::<f64>() / square;
                part.iter().for_each(|&dof| z[dof] = step);
            }
        },
        &b,
        v,
        KrylovStop {
            residual: 0.0,
            steps,
        },
    );
}
