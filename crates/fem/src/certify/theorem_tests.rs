//! That σ is what the theorem asks for, and that the bounds are put together as it says.

use super::tests::{certified, solved, square};
use super::*;
use crate::contact::{Discretisation, Problem};
use crate::scene::Part;

/// The solution, but for noise wherever it is not given.
fn rough(problem: &Problem) -> Vec<f64> {
    let mut random = crate::Random::new(3);
    let rough = |(u, g): (f64, &Option<f64>)| g.unwrap_or(u + 2.0 * random.next() - 1.0);
    let u = solved(problem).into_iter().zip(&problem.dirichlet);
    u.map(rough).collect()
}

/// λ = σ·n is nowhere above 0 on Γ_C however rough u_h is, and half of its mean at least; σ·n on Γ_N is what it was without s.
#[test]
fn the_stream_keeps_the_signs_and_means_of_fluxes() {
    let scene = square("-1", "0", "0", "0");
    let mesh = scene.triangulation(Some(8)).unwrap();
    let discretisation = Discretisation::of(&scene, "p2".parse().unwrap());
    let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
    let (_, fields) = certified(&problem, &rough(&problem)).unwrap();
    let stream = fields.stream.as_ref().unwrap();
    let mut at_most = 0;
    for contact in &problem.contact {
        let local = mesh.local_face(contact.cell, contact.face);
        let total = fields.fluxes_of(&fields.fluxes, contact.cell)[local];
        let off = 4.0 * stream.faces[contact.face].abs();
        assert!(
            total <= 0.0 && off <= -0.5 * total * (1.0 + 1e-12),
            "{total} {off}"
        );
        at_most += usize::from(total < 0.0 && off > -0.49 * total);
    }
    assert!(at_most > 0);
    for face in (0..mesh.face_count()).filter(|&f| problem.parts[f] == Some(Part::Neumann)) {
        let [a, b] = [0, 1].map(|k| stream.vertices[mesh.face(face)[k] as usize]);
        assert!(a == b && stream.faces[face] == 0.0, "{a} {b}");
    }
}

/// η = A/2 + √(A²/4 + B), R² = M²/4 + B + Lη and J(v) - J(u) ≤ M²/2 + B + Lη, from what the cells and faces have; L is between
/// the larger of ‖o‖ and ‖Q‖ and their sum.
#[test]
fn bounds_are_put_together_as_the_theorem_says() {
    let t = "if(abs(y-0.43)<0.01,20,0)*sin(9*y)";
    // v passes below the spike of ψ, so that B is not 0.
    let psi = "-0.1*max(0,1-abs(x-0.53)*500)";
    let scene = square("4+if(x+y<0.7,3,0)*sin(9*x)", t, "0", psi);
    let mesh = scene.triangulation(Some(4)).unwrap();
    let discretisation = Discretisation::of(&scene, "p2".parse().unwrap());
    let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
    let (found, fields) = certified(&problem, &rough(&problem)).unwrap();
    let Parts {
        misfit,
        contact,
        oscillation,
        unknown,
    } = found.parts;
    assert!(
        [contact, oscillation, unknown].iter().all(|of| *of > 1e-6),
        "{:?}",
        found.parts
    );
    let root = (found.local.iter().sum::<f64>() - 2.0 * contact).sqrt();
    let eta = 0.5 * root + (0.25 * root * root + contact).sqrt();
    assert!((found.v / eta - 1.0).abs() < 1e-9, "{} {eta}", found.v);
    let ends = [oscillation.max(unknown), oscillation + unknown];
    let between = |value: f64, of: &dyn Fn(f64) -> f64| {
        let [least, most] = ends.map(|rest| of(rest * eta));
        assert!(
            least * (1.0 - 1e-9) <= value && value <= most * (1.0 + 1e-9),
            "{least} {value} {most}"
        );
    };
    between(found.g.powi(2), &|rest| {
        0.25 * misfit * misfit + contact + rest
    });
    let [low, high] = found.energy;
    // J(v) is known up to a width of its own.
    assert!(high - low >= 0.5 * misfit * misfit + contact + ends[0] * eta);
    // ‖o‖ and ‖Q‖ are those of cells and faces.
    let (norms, _) = fields.all_norms().unwrap();
    let errors: Vec<f64> = norms.iter().map(|cell| cell.error).collect();
    let on_faces = &fields.data.tractions;
    let given: Vec<_> = on_faces.iter().map(|t| (t.face, t.error)).collect();
    let [_, mut q] = Fluxes::new(&problem).majorant(&errors, &given).unwrap();
    let mut o: Vec<f64> = norms.iter().map(|cell| cell.oscillation).collect();
    for (q, cell) in q.iter_mut().zip(&norms) {
        *q += cell.spread;
    }
    for t in on_faces {
        o[t.cell] += t.oscillation;
        q[t.cell] += t.spread;
    }
    for (said, of) in [(oscillation, o), (unknown, q)] {
        let sum: f64 = of.iter().map(|x| x * x).sum();
        assert!((said / sum.sqrt() - 1.0).abs() < 1e-9, "{said} {sum}");
    }
    assert!(norms.iter().any(|cell| cell.spread > 1e-6));
    assert!(on_faces.iter().any(|t| t.spread > 1e-6));
}
