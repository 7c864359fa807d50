//! The errors of a discrete solution against what is known of u: a formula, or the mesh-free solution.

mod conforming;
mod nonconforming;

use std::sync::OnceLock;

pub use conforming::fine_errors;
pub use nonconforming::{Function, distance, transitions};

use crate::contact::{Errors, Problem, errors, quantities};
use crate::scene::{Exact, Expression, MeshFree, Part, Scene};
use crate::truth::{DEFAULT_RESOLUTION, Reference};
use faceoff_mesh::error::{Error, Result};

/// u of a scene.
#[derive(Debug, Clone)]
pub enum Truth {
    /// u as a closed expression in the coordinates.
    Formula(Expression),
    /// u of the paper's square by separation of variables, to about 1e-13 of max |u|.
    MeshFree(&'static Reference),
}

impl Truth {
    /// u, if the scene defines it; its name has no meaning.
    ///
    /// # Errors
    /// A mesh-free solution that cannot be computed.
    pub fn of(scene: &Scene) -> Result<Option<Self>> {
        let truth = |exact: &Exact| {
            Ok(match exact {
                Exact::Formula(u) => Truth::Formula(u.clone()),
                Exact::MeshFree(MeshFree::OneZone) => Truth::MeshFree(one_zone()?),
            })
        };
        scene.exact().map(truth).transpose()
    }

    /// The relative errors of u (values at all dofs) in the energy norm and in L².
    ///
    /// Against the mesh-free solution Crouzeix–Raviart by its face means; conforming elements, which vanish on Γ_D, by
    /// Green's formula.
    ///
    /// # Errors
    /// An exact solution that is not finite, or not known on all of the mesh.
    pub fn errors(&self, problem: &Problem, u: &[f64]) -> Result<Errors> {
        let space = &problem.space;
        match self {
            Truth::Formula(exact) => errors(space, u, exact),
            Truth::MeshFree(_) if !is_papers_square(problem) => Err(Error::Scene {
                scene: problem.scene.name().to_owned(),
                place: "exact.reference".into(),
                what: format!(
                    "it is known on the unit square with contact at the bottom and u = 0 at the top, which mesh {} is not",
                    space.mesh.name
                ),
                remedy: "give that domain, or remove the key".into(),
            }),
            Truth::MeshFree(truth) => Ok(mesh_free_errors(problem, u, truth)),
        }
    }
}

/// Computed once.
fn one_zone() -> Result<&'static Reference> {
    static ONE_ZONE: OnceLock<Reference> = OnceLock::new();
    if let Some(known) = ONE_ZONE.get() {
        return Ok(known);
    }
    let found = Reference::one_zone(DEFAULT_RESOLUTION)?;
    Ok(ONE_ZONE.get_or_init(|| found))
}

/// Whether the domain is the unit square, with contact at the bottom and u = 0 at the top.
fn is_papers_square(problem: &Problem) -> bool {
    let mesh = problem.space.mesh;
    let inside = |p: &[f64; 3]| p[..2].iter().all(|x| (0.0..=1.0).contains(x));
    let cells = (0..mesh.cell_count()).map(|cell| mesh.measure(cell));
    let has_part = |(face, part): (usize, &Option<Part>)| {
        part.is_none_or(|part| match mesh.face_midpoint(face)[1] {
            0.0 => part == Part::Contact,
            1.0 => part == Part::Dirichlet,
            _ => part == Part::Neumann,
        })
    };
    mesh.dim == 2
        && mesh.points.iter().all(inside)
        && (cells.sum::<f64>() - 1.0).abs() < 1e-9
        && problem.parts.iter().enumerate().all(has_part)
}

fn mesh_free_errors(problem: &Problem, u: &[f64], truth: &Reference) -> Errors {
    let element = problem.space.element;
    if element.on().faces && element.degree() == 1 {
        distance(&problem.space, u, truth)
    } else {
        fine_errors(problem, u, &quantities(problem, u), truth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Discretisation, Iteration, Method, Stop, solve};
    use crate::scene::MeshSource;
    use faceoff_mesh::mesh::Triangulation;
    use faceoff_mesh::mesh::generate::{Cuboid, union_cube, union_jack};

    /// The closed form and the mesh-free solution are two ways to one truth, and the elements' errors to the latter are
    /// computed in two ways.
    #[test]
    fn all_ways_to_the_truth_agree() {
        let scene = Scene::find("three-zones").unwrap();
        let closed = Truth::of(&scene).unwrap().unwrap();
        assert!(matches!(closed, Truth::Formula(_)));
        let reference = Reference::zones(3, DEFAULT_RESOLUTION).unwrap();
        let mesh = scene.triangulation(Some(20)).unwrap();
        for method in [Method::cr(), "p1".parse().unwrap(), Method::p2()] {
            let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method)).unwrap();
            let solution = solve(&problem, Iteration::Newton, Stop::default(), |_, _| Ok(()));
            let u = solution.unwrap().u;
            let a = closed.errors(&problem, &u).unwrap();
            let b = mesh_free_errors(&problem, &u, &reference);
            assert!((a.h1 / b.h1 - 1.0).abs() < 5e-3, "{method}: {a:?} {b:?}");
            assert!((a.l2 / b.l2 - 1.0).abs() < 2e-2, "{method}: {a:?} {b:?}");
        }
    }

    #[test]
    fn a_changed_scene_does_not_keep_the_truth_and_a_name_does_not_give_it() {
        let scene = Scene::find("one-zone").unwrap();
        let is_known = |scene: &Scene| Truth::of(scene).unwrap().is_some();
        assert!(is_known(&scene) && is_known(&scene.renamed("mine").unwrap()));
        assert!(!is_known(&scene.with_data(scene.data().clone())));
        assert!(!is_known(&scene.with_boundary(scene.boundary().clone())));
        assert!(!is_known(
            &scene.with_source(scene.source().clone()).unwrap()
        ));
        let plate = Scene::find("plate").unwrap();
        assert!(!is_known(&plate) && !is_known(&plate.renamed("one-zone").unwrap()));
        assert!(scene.renamed("../mine").is_err() && scene.renamed("").is_err());
        let cuboid = Cuboid::new([0.0; 2], [1.0, 0.0]);
        assert!(
            scene
                .with_source(MeshSource::Union { n: 4, cuboid })
                .is_err()
        );
        let cuboid = Cuboid::new([0.0; 2], [1.0; 2]);
        assert!(
            scene
                .with_source(MeshSource::Union { n: 0, cuboid })
                .is_err()
        );
    }

    #[test]
    fn the_mesh_free_solution_is_for_the_papers_square_alone() {
        let scene = Scene::find("one-zone").unwrap();
        let mut turned = scene.boundary().clone();
        std::mem::swap(&mut turned.dirichlet, &mut turned.contact);
        let turned = scene.with_boundary(turned);
        let boxed = Scene::find("one-zone-3d").unwrap();
        let found = [
            (&scene, union_jack(4, [1.0; 2])),
            (&scene, union_jack(4, [0.5, 1.0])),
            (&scene, union_jack(4, [2.0, 0.5])),
            (&turned, union_jack(4, [1.0; 2])),
            (&boxed, union_cube(2, [1.0; 3])),
        ]
        .map(|(scene, mesh)| {
            let mesh = Triangulation::new("m", &mesh).unwrap();
            let discretisation = Discretisation::of(scene, Method::p2());
            let problem = Problem::new(scene, &mesh, &discretisation).unwrap();
            let truth = Truth::MeshFree(one_zone().unwrap());
            truth.errors(&problem, &problem.start()).is_ok()
        });
        assert_eq!(found, [true, false, false, false, false]);
    }
}
