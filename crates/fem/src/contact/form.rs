//! The form (2.4), of which (3.2) is the penalty-free member.

use std::sync::{Arc, OnceLock};

use super::condition::Condition;
use super::discretisation::Discretisation;
use super::face::ContactFace;
use super::held::Held;
use super::law::{Law, OnContact};
use super::method::Method;
use crate::assembly::{self, Stiffness, value_at};
use crate::element::{P1, Space};
use crate::linear::{Csr, zeros};
use crate::quadrature::Rule;
use crate::scene::{HRule, Part, Scene};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::{CellGeometry, Triangulation};
use faceoff_mesh::parallel;

/// The discrete problem: find u_h with A_h(u_h; v) = L(v) for all v that vanish on Γ_D, (3.1).
pub struct Problem<'a> {
    /// The continuous problem.
    pub scene: &'a Scene,
    /// The discretisation that makes it a scheme.
    pub discretisation: Discretisation,
    /// V_h, on all of the mesh and without boundary conditions.
    pub space: Space<'a>,
    /// The part of each boundary face.
    pub parts: Vec<Option<Part>>,
    /// Contact faces, ascending: what is read off a solution on Γ_C.
    pub contact: Vec<ContactFace>,
    /// (∇φ_j, ∇φ_i)_h, all dofs.
    pub stiffness: Stiffness<'a>,
    /// The contact condition as the method imposes it.
    pub conditions: Vec<Condition>,
    /// L(φ_i) = (f, φ_i) + <t, φ_i>_N, all dofs.
    pub load: Vec<f64>,
    /// The value of g at each dof on Γ_D, none elsewhere.
    pub dirichlet: Held,
    /// Where there are parts of the domain that Γ_D does not hold: that part, of each dof.
    pub floating: Option<Vec<Option<u32>>>,
    /// The connected part of the mesh of each dof, and how many there are.
    pub bodies: (Vec<u32>, usize),
    /// The rule for (f, v), by which the scheme is defined.
    pub cell_rule: Rule,
    /// The same for Γ_C and Γ_N.
    pub face_rule: Rule,
    /// The stiffness of P1, if requested.
    on_vertices: Arc<OnceLock<Csr>>,
}

impl<'a> Problem<'a> {
    /// The discrete problem of a scene on a mesh.
    ///
    /// # Errors
    /// A discretisation that does not exist in the mesh's dimension, boundary parts that do not fit the mesh, data that are not
    /// finite, a connected part of the domain that nothing holds.
    pub fn new(
        scene: &'a Scene,
        mesh: &'a Triangulation,
        discretisation: &Discretisation,
    ) -> Result<Self> {
        let parts = scene.parts(mesh)?;
        let space = Space::new(mesh, discretisation.method.element);
        let [cell_rule, face_rule] = discretisation.checked(scene, mesh.dim)?;
        let mut load = zeros(space.dofs);
        let (added, components) = rayon::join(
            || assembly::add_load(&space, &scene.data().f, &cell_rule, &mut load),
            || mesh.components(),
        );
        added?;
        for face in (0..parts.len()).filter(|&face| parts[face] == Some(Part::Neumann)) {
            assembly::add_traction(&space, &scene.data().t, face, &face_rule, &mut load)?;
        }
        let stiffness = Stiffness::new(&space);
        Problem::with_load(
            scene,
            discretisation,
            stiffness,
            space,
            parts,
            load,
            components,
        )
    }

    /// The variational inequality on P1, whose functions are in V_h, with L at them by these rules.
    ///
    /// # Errors
    /// The errors of [`Problem::new`].
    pub(super) fn on_p1(&self) -> Result<Self> {
        let discretisation = Discretisation {
            method: Method {
                element: &P1,
                law: Law::Variational,
            },
            ..self.discretisation.clone()
        };
        let mesh = self.space.mesh;
        let space = Space::new(mesh, &P1);
        let mut load = vec![0.0; space.dofs];
        for (dof, of_dof) in self.load.iter().enumerate() {
            for (vertex, value) in self.space.vertex_values(dof) {
                load[vertex as usize] += value * of_dof;
            }
        }
        let stiffness = self.stiffness.on(&space);
        self.again(&discretisation, stiffness, space, load)
    }

    /// The same problem with other L(φ_i).
    ///
    /// # Errors
    /// The errors of [`Problem::new`].
    pub(crate) fn loaded_by(&self, load: Vec<f64>) -> Result<Self> {
        let stiffness = self.stiffness.on(&self.space);
        self.again(&self.discretisation, stiffness, self.space.clone(), load)
    }

    fn again(
        &self,
        discretisation: &Discretisation,
        stiffness: Stiffness<'a>,
        space: Space<'a>,
        load: Vec<f64>,
    ) -> Result<Self> {
        let body = |cell| self.bodies.0[self.space.cell_dofs(cell)[0] as usize];
        let body_of = parallel::collect(space.mesh.cell_count(), body);
        let (parts, components) = (self.parts.clone(), (body_of, self.bodies.1));
        let mut problem = Problem::with_load(
            self.scene,
            discretisation,
            stiffness,
            space,
            parts,
            load,
            components,
        )?;
        problem.on_vertices = Arc::clone(&self.on_vertices);
        Ok(problem)
    }

    /// The stiffness of P1 on all vertices, put together once for this problem and [`Problem::on_p1`] of it. Those of contact
    /// cells have all their ties.
    ///
    /// # Errors
    /// The errors of [`Csr::sum`].
    pub(crate) fn vertex_stiffness(&self) -> Result<&Csr> {
        if let Some(matrix) = self.on_vertices.get() {
            return Ok(matrix);
        }
        let mesh = self.space.mesh;
        let mut near = vec![false; mesh.points.len()];
        for face in &self.contact {
            for &vertex in mesh.cell(face.cell) {
                near[vertex as usize] = true;
            }
        }
        let all: Vec<Option<u32>> = (0..near.len() as u32).map(Some).collect();
        let stiffness = self.stiffness.on(&Space::new(mesh, &P1));
        let matrix = Csr::sum(&stiffness, &all, |row| near[row])?;
        Ok(self.on_vertices.get_or_init(|| matrix))
    }

    /// The rest of the problem, of what its data are on the boundary.
    fn with_load(
        scene: &'a Scene,
        discretisation: &Discretisation,
        stiffness: Stiffness<'a>,
        space: Space<'a>,
        parts: Vec<Option<Part>>,
        load: Vec<f64>,
        (body_of, count): (Vec<u32>, usize),
    ) -> Result<Self> {
        let (mesh, method) = (space.mesh, discretisation.method);
        let [cell_rule, face_rule] = discretisation.checked(scene, mesh.dim)?;
        let mut given = Vec::new();
        let mut contact = Vec::new();
        let largest = match discretisation.h {
            HRule::Local => 0.0,
            HRule::Global => {
                let diameter = |cell| mesh.geometry(cell).diameter;
                let diameters = parallel::collect(mesh.cell_count(), diameter);
                diameters.into_iter().fold(0.0, f64::max)
            }
        };
        for (face, part) in parts.iter().enumerate() {
            match part {
                None | Some(Part::Neumann) => {}
                Some(Part::Dirichlet) => {
                    let cell = mesh.face_cells(face)[0] as usize;
                    for dof in space.face_dofs(cell, mesh.local_face(cell, face)) {
                        let x = space.point(dof as usize);
                        given.push((dof, value_at(&scene.data().g, "g", x)?));
                    }
                }
                Some(Part::Contact) => {
                    let gamma = |geometry: &CellGeometry, measure: f64| {
                        let h = match discretisation.h {
                            _ if method.law.gamma0().is_some() => {
                                mesh.dim as f64 * geometry.measure() / measure
                            }
                            HRule::Local => geometry.diameter,
                            HRule::Global => largest,
                        };
                        discretisation.gamma0() * h
                    };
                    let psi = &scene.data().psi;
                    contact.push(ContactFace::new(&space, face, psi, gamma, &face_rule)?);
                }
            }
        }
        let dirichlet = Held::new(space.dofs, given);
        method.law.prepare(&space, &load, &mut contact);
        let conditions = method.law.conditions(&OnContact {
            space: &space,
            faces: &contact,
            psi: &scene.data().psi,
            stiffness: &stiffness,
            load: &load,
            dirichlet: &dirichlet,
        })?;
        let mut bodies = (vec![0; space.dofs], count);
        if count > 1 {
            for (cell, body) in body_of.iter().enumerate() {
                for dof in space.cell_dofs(cell) {
                    bodies.0[*dof as usize] = *body;
                }
            }
        }
        let mut problem = Problem {
            scene,
            discretisation: discretisation.clone(),
            stiffness,
            space,
            parts,
            contact,
            conditions,
            load,
            dirichlet,
            floating: None,
            bodies,
            cell_rule,
            face_rule,
            on_vertices: Arc::default(),
        };
        problem.floating = problem.check_held(&body_of)?;
        Ok(problem)
    }

    /// The method of the discretisation.
    pub fn method(&self) -> Method {
        self.discretisation.method
    }

    /// Every connected part needs Γ_D, or contact and a total load that presses it on; what
    /// [`Problem::floating`] is.
    fn check_held(&self, part_of: &[u32]) -> Result<Option<Vec<Option<u32>>>> {
        let mesh = self.space.mesh;
        let count = self.bodies.1;
        let mut held = vec![false; count];
        let mut touching = vec![false; count];
        for (face, part) in self.parts.iter().enumerate() {
            let component = part_of[mesh.face_cells(face)[0] as usize] as usize;
            match part {
                Some(Part::Dirichlet) => held[component] = true,
                Some(Part::Contact) => touching[component] = true,
                _ => {}
            }
        }
        if held.iter().all(|h| *h) {
            return Ok(None);
        }
        // Each dof belongs to one component, and the φ_i of a component sum to 1.
        let (mut total, mut sizes) = (vec![0.0; count], vec![0.0; count]);
        let mut counted = vec![false; self.space.dofs];
        for cell in 0..mesh.cell_count() {
            for &dof in self.space.cell_dofs(cell) {
                if !std::mem::replace(&mut counted[dof as usize], true) {
                    total[part_of[cell] as usize] += self.load[dof as usize];
                    sizes[part_of[cell] as usize] += self.load[dof as usize].abs();
                }
            }
        }
        for component in 0..count {
            // A total that is rounding presses nothing.
            let presses = total[component] > 64.0 * f64::EPSILON * sizes[component];
            if held[component] || (touching[component] && presses) {
                continue;
            }
            let cell = part_of
                .iter()
                .position(|&p| p as usize == component)
                .expect("invariant: a component has a cell");
            let place = mesh.vertex_label(mesh.cell(cell)[0]);
            let what = if touching[component] {
                format!(
                    "the part of the domain with {place} has no Dirichlet face, and its total load {:e} does not press it into contact",
                    total[component]
                )
            } else {
                format!(
                    "the part of the domain with {place} has neither a Dirichlet nor a contact face, so nothing fixes u there"
                )
            };
            return Err(Error::Scene {
                scene: self.scene.name().to_owned(),
                place: "boundary.dirichlet".into(),
                what,
                remedy: "name a group of that part under dirichlet".into(),
            });
        }
        let mut floating = vec![None; self.space.dofs];
        for cell in 0..mesh.cell_count() {
            let part = part_of[cell];
            for &dof in self.space.cell_dofs(cell) {
                floating[dof as usize] = Some(part).filter(|p| !held[*p as usize]);
            }
        }
        Ok(Some(floating))
    }

    /// u = 0 but for g on Γ_D: where every engine starts.
    pub fn start(&self) -> Vec<f64> {
        let mut u = zeros(self.space.dofs);
        for (dof, g) in self.dirichlet.given() {
            u[dof] = g;
        }
        u
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a graded mesh, whose largest cell is somewhere.
    #[test]
    fn h_is_of_the_cell_or_the_largest_of_all() {
        let scene = Scene::find("plate").unwrap();
        let mesh = scene.triangulation(None).unwrap();
        let diameter = |cell: usize| mesh.geometry(cell).diameter;
        let largest = (0..mesh.cell_count()).map(diameter).fold(0.0, f64::max);
        for h in [HRule::Local, HRule::Global] {
            let discretisation = Discretisation {
                h,
                ..Discretisation::of(&scene, "cr".parse().unwrap())
            };
            let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
            for face in &problem.contact {
                let h = match h {
                    HRule::Local => diameter(face.cell),
                    HRule::Global => largest,
                };
                assert_eq!(face.gamma, discretisation.gamma0() * h);
            }
        }
    }
}
