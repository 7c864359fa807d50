//! v and σ of second order on triangles.
//!
//! Where u_h is of first order they make G more accurate than u_h, so that the bound of u_h is hardly above its error.
//!
//! v = Σ v_i λ_i + Σ_F 4 b_F λ_a λ_b, F = ab, and σ + rot s with a continuous s of the same form, rot s = (∂₂s, -∂₁s). rot s has
//! no divergence, and its flux through a face is s's derivative along it: none where s is constant, as on Γ_N, and one of mean 0
//! on a face of Γ_C whose ends have the same value. So nothing changes of the balance of σ and of its mean on any face of Γ_N or
//! Γ_C. s is that of the least ‖∇v-σ-rot s‖: (∇s, ∇w) = (∇v-σ, rot w), a problem of P2 with a separate constant on each
//! connected part of Γ_N and Γ_C. Any s will do, and what rot s has to make good changes from cell to cell: a few steps of
//! conjugate gradients are nearly as good as the solution.
//!
//! λ = σ·n is then linear on a contact face, ≤ 0, and nowhere smaller in size than half its mean.

use super::admissible::{bubbles, descend};
use super::data::is_second_order;
use super::quadratic::{Linear, Quadratic};
use super::simplex::Simplex;
use crate::assembly::{Stiffness, sum_over_cells};
use crate::contact::Problem;
use crate::element::{Element, P2, Space};
use crate::interval::Interval;
use crate::quadrature::{WHOLE, exact};
use crate::scene::Part;
use faceoff_mesh::mesh::Triangulation;
use nalgebra::Vector3;
use std::collections::{BTreeSet, HashMap};

/// A function of P2 by its values at the vertices and its bubbles.
#[derive(Debug, Clone)]
pub(super) struct Stream {
    pub vertices: Vec<f64>,
    pub faces: Vec<f64>,
}

/// Steps for s. With 10 the bound of G would be 0.4 % smaller at n = 64, and 1 % next to a reentrant corner.
const STEPS: usize = 6;
/// On a contact face λ is off its mean by no more than this part of it.
const OFF_MEAN: f64 = 0.5;
/// Connected parts of Γ_N and Γ_C beyond this number have the constant 0.
const MOST_PARTS: usize = 12;

/// P2 where they are.
pub(super) fn space<'a>(problem: &Problem<'a>) -> Option<Space<'a>> {
    let Space { mesh, element, .. } = problem.space;
    match (is_second_order(problem), element.degree()) {
        (false, _) => None,
        (true, 2) => Some(problem.space.clone()),
        (true, _) => Some(Space::new(mesh, &P2)),
    }
}

/// b on the faces of a cell, by the vertex opposite.
pub(super) fn on_cell(mesh: &Triangulation, faces: &[f64], cell: usize) -> [f64; 3] {
    std::array::from_fn(|i| faces[mesh.cell_faces(cell)[i] as usize])
}

impl Stream {
    /// rot s on a cell.
    pub fn rot<const D: usize>(
        &self,
        mesh: &Triangulation,
        cell: usize,
        simplex: &Simplex,
    ) -> Linear<D> {
        let mut values = [Interval::ZERO; 4];
        for (value, &vertex) in values.iter_mut().zip(mesh.cell(cell)) {
            *value = Interval::at(self.vertices[vertex as usize]);
        }
        let faces = on_cell(mesh, &self.faces, cell);
        Linear::gradient(simplex, &values, Some(&faces)).turned()
    }

    /// s for v and σ, given by their values at the points of cells, where λ is that of u_h.
    pub fn new(
        problem: &Problem,
        stiffness: &Stiffness,
        diagonal: &[f64],
        u: &[f64],
        lambda: &[f64],
        misfit: impl Fn(usize, &Simplex) -> Quadratic<2> + Sync,
    ) -> Self {
        let (mesh, space) = (problem.space.mesh, stiffness.space());
        let b = load(space, misfit);
        let parts = Parts::of(problem, space);
        let mut s = vec![0.0; space.dofs];
        let on_contact = on_contact(problem, u, lambda);
        for (contact, b) in problem.contact.iter().zip(&on_contact) {
            s[mesh.points.len() + contact.face] = *b;
        }
        // Any s will do.
        let free: Vec<&[usize]> = parts
            .free
            .iter()
            .map(|&part| &parts.all[part][..])
            .collect();
        descend(stiffness, diagonal, &parts.held, &free, b, &mut s, STEPS);
        // What is constant is exactly so.
        for dofs in &parts.all {
            // Vertices have the first numbers.
            let value = dofs.first().map_or(0.0, |&dof| s[dof]);
            let vertices = dofs.iter().filter(|&&dof| dof < mesh.points.len());
            vertices.for_each(|&dof| s[dof] = value);
        }
        let mut faces = bubbles(space, &s);
        let vertices = s[..mesh.points.len()].to_vec();
        for (face, part) in problem.parts.iter().enumerate() {
            if *part == Some(Part::Neumann) {
                faces[face] = 0.0;
            }
        }
        for (contact, b) in problem.contact.iter().zip(on_contact) {
            faces[contact.face] = b;
        }
        Stream { vertices, faces }
    }
}

/// (d, rot φ_i) of a field that is quadratic on each cell.
fn load(space: &Space, field: impl Fn(usize, &Simplex) -> Quadratic<2> + Sync) -> Vec<f64> {
    let mesh = space.mesh;
    // The means of ψ_n ∂φ_i/∂λ_j, ψ_n the functions of P2 as [`Quadratic`] orders their points.
    let mut means = [[[0.0; 6]; 3]; 6];
    for (point, weight) in exact(2, 3).iter() {
        let (values, derivatives) = (P2.values(2, &point), P2.derivatives(2, &point));
        for (means, of) in means.iter_mut().zip(&derivatives) {
            for (means, of) in means.iter_mut().zip(of) {
                // P2's dofs: the corners, and the middles opposite them.
                let values = [0, 1, 2, 5, 4, 3].map(|n| values[n]);
                let products = means.iter_mut().zip(values);
                products.for_each(|(mean, value)| *mean += weight * of * value);
            }
        }
    }
    sum_over_cells(space, |cells, vectors| {
        for (cell, sums) in cells.zip(vectors.chunks_exact_mut(space.local_dofs)) {
            let simplex = Simplex::new(mesh, cell);
            let field = field(cell, &simplex);
            let points = field.corners[..3].iter().chain(&field.middles[..3]);
            // d · rot λ_j at the points, times |κ|.
            let mut along = [[0.0; 6]; 3];
            for (n, d) in points.enumerate() {
                for (along, [x, y, _]) in along.iter_mut().zip(simplex.slopes) {
                    along[n] = simplex.measure.mid() * (d[0] * y - d[1] * x);
                }
            }
            for (sum, means) in sums.iter_mut().zip(&means) {
                let all = means.iter().flatten().zip(along.iter().flatten());
                *sum = all.map(|(mean, along)| mean * along).sum();
            }
        }
    })
}

/// b on the contact faces, so that λ has the slope of u_h's flux, as far as it may.
fn on_contact(problem: &Problem, u: &[f64], lambda: &[f64]) -> Vec<f64> {
    let (space, mesh) = (&problem.space, problem.space.mesh);
    let pairs = problem.contact.iter().zip(lambda);
    pairs
        .map(|(contact, lambda)| {
            let geometry = mesh.geometry(contact.cell);
            let local = mesh.local_face(contact.cell, contact.face);
            let [j, k] = [(local + 1) % 3, (local + 2) % 3];
            let values = space.local(contact.cell, u);
            // n |F| is -2 |κ| ∇λ of the vertex opposite; s grows along τ = (-n₂, n₁).
            let normal = -2.0 * geometry.measure() * geometry.gradients[local];
            let flux = |corner: usize| {
                let gradients = space.gradients(&geometry, &WHOLE[corner]);
                let slope: Vector3<f64> = gradients.iter().zip(values).map(|(g, u)| *g * u).sum();
                slope.dot(&normal)
            };
            let edge = geometry.vertices[k] - geometry.vertices[j];
            let along = normal.x * edge.y - normal.y * edge.x;
            let most = 0.25 * OFF_MEAN * (lambda * contact.measure).abs();
            (along.signum() * (flux(j) - flux(k)) / 8.0).clamp(-most, most)
        })
        .collect()
}

/// Connected parts of Γ_N and Γ_C, on each of which s is constant at the vertices.
struct Parts {
    all: Vec<Vec<usize>>,
    /// Those whose constant is looked for: all but one in each part of the domain.
    free: Vec<usize>,
    /// By dofs.
    held: Vec<bool>,
}

impl Parts {
    fn of(problem: &Problem, space: &Space) -> Self {
        let mesh = problem.space.mesh;
        let (body_of, count) = mesh.components();
        let mut held = vec![false; space.dofs];
        // Each dof with the first that is found of its part.
        let mut leader: Vec<u32> = (0..space.dofs as u32).collect();
        let faces = 0..mesh.face_count();
        let faces: Vec<usize> = faces
            .filter(|&face| matches!(problem.parts[face], Some(Part::Neumann | Part::Contact)))
            .collect();
        let middle_of = |face: usize| (mesh.points.len() + face) as u32;
        for &face in &faces {
            for &dof in mesh.face(face).iter().chain([&middle_of(face)]) {
                held[dof as usize] = true;
                let [a, b] = [dof, middle_of(face)].map(|dof| first(&mut leader, dof));
                leader[a.max(b) as usize] = a.min(b);
            }
        }
        let mut numbers = HashMap::new();
        let mut all: Vec<Vec<usize>> = Vec::new();
        for dof in (0..space.dofs).filter(|&dof| held[dof]) {
            let part = *numbers
                .entry(first(&mut leader, dof as u32))
                .or_insert(all.len());
            if part == all.len() {
                all.push(Vec::new());
            }
            all[part].push(dof);
        }
        // One constant is given in each body: by the first part that it has, or at a vertex.
        let mut bodies = vec![BTreeSet::new(); all.len()];
        for face in faces {
            let part = numbers[&first(&mut leader, middle_of(face))];
            bodies[part].insert(body_of[mesh.face_cells(face)[0] as usize] as usize);
        }
        let mut is_held = vec![false; count];
        let mut free = Vec::new();
        for (part, bodies) in bodies.iter().enumerate() {
            if bodies.iter().all(|&body| is_held[body]) && free.len() < MOST_PARTS {
                free.push(part);
            }
            bodies.iter().for_each(|&body| is_held[body] = true);
        }
        for (cell, body) in body_of.iter().enumerate() {
            if !std::mem::replace(&mut is_held[*body as usize], true) {
                held[space.cell_dofs(cell)[0] as usize] = true;
            }
        }
        Parts { all, free, held }
    }
}

/// The first dof of a part, with shorter ways to it.
fn first(leader: &mut [u32], mut dof: u32) -> u32 {
    while leader[dof as usize] != dof {
        leader[dof as usize] = leader[leader[dof as usize] as usize];
        dof = leader[dof as usize];
    }
    dof
}
