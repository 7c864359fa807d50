//! The scheme in the form in which it is solved.
//!
//! The rows of the penalty-free law on CR, as (3.2) has them, all contain γ∂ₙu ∂ₙφ: if γ is far from
//! h, the stiffness drowns in it, or it in the stiffness. Combined within each contact cell they state
//! the same without that (derived in `law::flux_corrected`; C are the contact faces of the cell κ):
//!
//! ```text
//! F in C      mean_F max(u-ψ, γ∂ₙu) = m_F,   Σ_{G ∈ C} (∇φ_G,∇φ_F)_κ m_G = L(φ_F)
//! G not in C  (∇u,∇φ_G) = L(φ_G) - Σ_{F ∈ C} |F| m_F ∂ₙφ_G|_F
//! ```
//!
//! With ψ + m and ∂ₙu - m/γ for ψ and ∂ₙu the right-hand side m_F becomes 0. Where all of F has one
//! status γ is not a part of it any more, and h_F, the height of κ over F, serves as well. The
//! corrected flux has m = 0 from the beginning. Every other law is solved unchanged.

use std::borrow::Cow;

use super::condition::{Condition, Row};
use super::face::ContactFace;
use super::form::Problem;
use super::law::Law;
use super::system::Weights;
use crate::linear;
use faceoff_mesh::parallel;

pub(super) struct Scheme<'a> {
    pub problem: &'a Problem<'a>,
    pub conditions: Cow<'a, [Condition]>,
    /// The changes of the load by the conditions: (dof, change).
    changes: Vec<(u32, f64)>,
}

impl<'a> Scheme<'a> {
    pub fn new(problem: &'a Problem<'a>) -> Self {
        Scheme::at(problem, 1.0)
    }

    /// The scheme with γ times `factor`.
    pub fn at(problem: &'a Problem<'a>, factor: f64) -> Self {
        let mut scheme = Scheme::as_it_stands(problem);
        if factor != 1.0 {
            for condition in scheme.conditions.to_mut() {
                condition.gamma *= factor;
            }
        }
        let rows = is_face_law(problem).then(|| by_faces(problem, &scheme.conditions));
        rows.flatten().unwrap_or(scheme)
    }

    /// The same scheme unchanged, for iterations that are defined by its rows.
    pub fn as_it_stands(problem: &'a Problem<'a>) -> Self {
        Scheme {
            problem,
            conditions: Cow::Borrowed(&problem.conditions),
            changes: Vec::new(),
        }
    }

    /// L(φ_i) less what the conditions take of it, all dofs.
    pub fn load(&self) -> Vec<f64> {
        let given = &self.problem.load;
        let mut load = vec![0.0; given.len()];
        parallel::update(&mut load, |dof, _| given[dof]);
        for &(dof, change) in &self.changes {
            load[dof as usize] += change;
        }
        load
    }

    /// The residual of all rows, from the stiffness times u; those of Γ_D are 0.
    pub fn residual(&self, product: Vec<f64>, u: &[f64]) -> Vec<f64> {
        self.residual_with(product, |_, condition, r| condition.add_to(u, r))
    }

    /// The same with these laws, see [`Condition::add_law_to`].
    pub fn linear_residual(&self, product: Vec<f64>, laws: &[Weights], u: &[f64]) -> Vec<f64> {
        self.residual_with(product, |k, condition, r| {
            condition.add_law_to(laws[k], u, r)
        })
    }

    fn residual_with(
        &self,
        product: Vec<f64>,
        add: impl Fn(usize, &Condition, &mut [f64]),
    ) -> Vec<f64> {
        let mut r = product;
        linear::add(&mut r, &self.problem.load, -1.0);
        for &(dof, change) in &self.changes {
            r[dof as usize] -= change;
        }
        clear_rows(&self.conditions, &mut r);
        for (k, condition) in self.conditions.iter().enumerate() {
            add(k, condition, &mut r);
        }
        for (dof, _) in self.problem.dirichlet.given() {
            r[dof] = 0.0;
        }
        r
    }
}

/// Rows that have the whole law of a face have nothing else, but for rounding.
pub(super) fn clear_rows(conditions: &[Condition], r: &mut [f64]) {
    for condition in conditions {
        if let Some(row) = condition.row {
            r[condition.dofs[row.local] as usize] = 0.0;
        }
    }
}

/// The penalty-free law, on CR.
fn is_face_law(problem: &Problem) -> bool {
    let law = problem.method().law;
    let penalty_free = law.is_nitsche() && law.thetas() == [1.0, 0.0];
    let element = problem.space.element;
    penalty_free && element.on().faces && element.degree() == 1
}

/// None if all faces of a cell are contact faces: then the m of its faces do not exist.
fn by_faces<'a>(problem: &'a Problem<'a>, conditions: &[Condition]) -> Option<Scheme<'a>> {
    let mut conditions = conditions.to_vec();
    let mut changes = Vec::new();
    let mut points = 0..0;
    for face in &problem.contact {
        let siblings: Vec<&ContactFace> = siblings(problem, face).collect();
        if siblings.len() > problem.space.mesh.dim {
            return None;
        }
        let local = own_dof(problem, face);
        points = points.end..points.end + face.points.len();
        let geometry = problem.space.mesh.geometry(face.cell);
        for condition in &mut conditions[points.clone()] {
            condition.row = Some(Row {
                local,
                height: problem.space.mesh.dim as f64 * geometry.measure() / face.measure,
                points: face.points.len(),
            });
        }
        if problem.method().law == Law::FluxCorrected {
            continue;
        }
        let m = right_side(problem, face, &siblings)?;
        for condition in &mut conditions[points.clone()] {
            condition.psi += m;
            condition.flux_at_rest = -m / condition.gamma;
        }
        let on_contact: Vec<usize> = siblings.iter().map(|f| own_dof(problem, f)).collect();
        for (j, &dof) in problem.space.cell_dofs(face.cell).iter().enumerate() {
            if !on_contact.contains(&j) {
                changes.push((dof, -face.measure * m * face.points[0].dn[j]));
            }
        }
    }
    Some(Scheme {
        problem,
        conditions: Cow::Owned(conditions),
        changes,
    })
}

/// The contact faces of the cell of `face`, itself included.
fn siblings<'a>(problem: &'a Problem, face: &ContactFace) -> impl Iterator<Item = &'a ContactFace> {
    let mut faces = problem.space.mesh.cell_faces(face.cell).to_vec();
    faces.sort_unstable();
    faces.into_iter().filter_map(|f| {
        let place = problem
            .contact
            .binary_search_by_key(&(f as usize), |c| c.face);
        place.ok().map(|k| &problem.contact[k])
    })
}

/// The local number of a face's own dof.
fn own_dof(problem: &Problem, face: &ContactFace) -> usize {
    problem.space.mesh.local_face(face.cell, face.face)
}

/// m_F; none where the system is singular.
fn right_side(problem: &Problem, face: &ContactFace, siblings: &[&ContactFace]) -> Option<f64> {
    let size = siblings.len();
    // (∇φ_G,∇φ_F)_κ = |F| ∂ₙφ_G|_F
    let gram = nalgebra::DMatrix::from_fn(size, size, |i, j| {
        siblings[i].measure * siblings[i].points[0].dn[own_dof(problem, siblings[j])]
    });
    let dofs = problem.space.cell_dofs(face.cell);
    let load = nalgebra::DVector::from_fn(size, |i, _| {
        problem.load[dofs[own_dof(problem, siblings[i])] as usize]
    });
    let place = siblings.iter().position(|f| f.face == face.face)?;
    gram.lu().solve(&load).map(|m| m[place])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Discretisation, Method};
    use crate::scene::Scene as Described;

    /// A last step of refinement would hide it in u.
    #[test]
    fn the_load_is_that_of_the_problem_and_the_changes() {
        let scene = Described::find("one-zone").unwrap();
        let mesh = scene.triangulation(Some(4)).unwrap();
        let method: Method = "cr".parse().unwrap();
        let discretisation = Discretisation::of(&scene, method);
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let scheme = Scheme::new(&problem);
        assert!(scheme.changes.iter().any(|(_, change)| *change != 0.0));
        let mut expected = problem.load.clone();
        for (dof, change) in &scheme.changes {
            expected[*dof as usize] += change;
        }
        assert_eq!(scheme.load(), expected);
    }
}
