//! Proofs for contact sets that are known.

use super::super::numbers::friedrichs;
use super::super::{Fluxes, PreparedData, bounds};
use super::free::Search;
use super::touched::{cells_around, hat_proves};
use super::*;
use crate::contact::{Discretisation, Iteration, Method, Problem, Stop, solve};
use crate::scene::{Data, Expression, Scene};
use faceoff_mesh::mesh::generate::union_jack;
use faceoff_mesh::mesh::{Mesh, Triangulation};
use std::borrow::Cow;

fn scene([f, t, g, psi]: [&str; 4]) -> Scene {
    let [f, t, g, psi] = [f, t, g, psi].map(|text| Expression::parse(text).unwrap());
    Scene::find("one-zone")
        .unwrap()
        .with_data(Data { f, t, g, psi })
}

/// Calls `look` with the fields that solve a scene on a mesh, and their bounds.
fn solved<T>(scene: &Scene, mesh: &Mesh, look: impl FnOnce(&CellFields, &Known) -> T) -> T {
    let mesh = Triangulation::new("mesh", mesh).unwrap();
    let discretisation = Discretisation::of(scene, Method::cr_fc());
    let problem = Problem::new(scene, &mesh, &discretisation).unwrap();
    let u = solve(&problem, Iteration::Newton, Stop::default(), |_, _| Ok(()))
        .unwrap()
        .u;
    let data = Cow::Owned(PreparedData::new(&problem).unwrap());
    let mut solver = Fluxes::new(&problem);
    let fields = CellFields::new(&problem, &u, data, &mut solver).unwrap();
    let (_, mut known) = bounds(&fields, &mut solver).unwrap();
    known.friedrichs = friedrichs(&fields, &mut solver).unwrap();
    look(&fields, &known)
}

/// u = -2 ((x-½)² + y²) touches ψ = 0 only at (½, 0), and f = 8 bends it there: the mean over a half-ball is below 0,
/// and only the term of F shows that the point is not free.
#[test]
fn a_point_that_touches_without_a_force_is_not_free() {
    let scene = scene(["8", "-2", "-2*((x-0.5)^2+y^2)", "0"]);
    solved(&scene, &union_jack(48, [1.0; 2]), |fields, known| {
        let line = Line::of(fields).unwrap();
        let mut search = Search::new(&line, fields, known);
        assert_eq!(search.ball(0.5, f64::INFINITY).unwrap(), None);
        assert!(search.ball(0.25, f64::INFINITY).unwrap().is_some());
    });
}

/// A hat proves contact where ∇u is known well enough, and only there.
#[test]
fn a_hat_proves_no_more_than_what_is_known_of_the_gradient() {
    let scene = scene(["20*(x-0.5)", "0", "0", "0"]);
    solved(&scene, &union_jack(32, [1.0; 2]), |fields, known| {
        let mesh = fields.problem.space.mesh;
        let around = cells_around(mesh);
        let proves = |known: &Known| {
            let contact = fields.problem.contact.iter();
            let faces = contact.map(|contact| mesh.face(contact.face));
            let proved =
                faces.filter(|face| hat_proves(fields, known, &around, face, 0, 0.1).is_some());
            proved.count()
        };
        // |<∂ₙu, z>| of a hat with ‖∇z‖ of 1 or so is below 0.2.
        let rough = Known {
            of_g: 0.2,
            ..*known
        };
        assert!(proves(known) > 5 && proves(&rough) == 0);
    });
}

/// Two bodies with Γ_C on one line: the ball about a point would be in both.
#[test]
fn a_line_between_two_bodies_is_left_alone() {
    let scene = scene(["-1", "0", "0", "0"]);
    let below = union_jack(4, [1.0; 2]);
    assert!(solved(&scene, &below, |fields, _| Line::of(fields).is_some()));
    let mut both = below.clone();
    let points = below.points.len() as u32;
    let cells: u32 = below
        .blocks
        .iter()
        .map(|b| b.nodes.len() as u32 / b.kind.points() as u32)
        .sum();
    both.points
        .to_mut()
        .extend(below.points.iter().map(|[x, y, z]| [*x, -y, *z]));
    both.blocks
        .extend(below.blocks.iter().cloned().map(|mut block| {
            block
                .nodes
                .to_mut()
                .iter_mut()
                .for_each(|node| *node += points);
            block
        }));
    for (group, other) in both.groups.iter_mut().zip(&below.groups) {
        group
            .cells
            .extend(other.cells.iter().map(|cell| cell + cells));
    }
    assert!(solved(&scene, &both, |fields, _| Line::of(fields).is_none()));
}
