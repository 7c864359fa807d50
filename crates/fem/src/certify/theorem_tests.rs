//! Tests that σ satisfies the assumptions of the theorem, and that the bounds are assembled as in the theorem.

use super::tests::{certified, lifted, sigma, solved, square};
use super::*;
use crate::contact::{Discretisation, Problem};
use crate::quadrature::exact;
use crate::scene::Part;

/// The solution, but for noise wherever it is not given.
fn rough(problem: &Problem, seed: u64) -> Vec<f64> {
    let mut random = crate::Random::new(seed);
    let rough = |(u, g): (f64, &Option<f64>)| g.unwrap_or(u + 2.0 * random.next() - 1.0);
    let u = solved(problem).into_iter().zip(problem.dirichlet.iter());
    u.map(rough).collect()
}

/// λ = σ·n is nowhere above 0 on Γ_C however rough u_h is, and half of its mean at least; σ·n on Γ_N is what it was without s.
#[test]
fn the_stream_keeps_the_signs_and_means_of_fluxes() {
    let scene = square("-1", "0", "0", "0");
    let mesh = scene.triangulation(Some(8)).unwrap();
    let discretisation = Discretisation::of(&scene, "p2".parse().unwrap());
    let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
    let (_, fields) = certified(&problem, &rough(&problem, 3)).unwrap();
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
    let (found, fields) = certified(&problem, &rough(&problem, 3)).unwrap();
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
    // J(v) is known up to a separate width.
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

/// B is no less than ∫ |λ| (ψ-v) face by face, where λ = σ·n is linear: v passes below spikes of ψ, and is there farthest from it
/// where λ may be largest.
#[test]
fn no_pressure_on_a_gap_is_above_its_bound() {
    let mut above_means = 0;
    for seed in 0..20 {
        let spike = ["0.53", "0.02", "0.98", "0.27"][seed as usize % 4];
        let psi = format!("-0.1*max(0,1-abs(x-{spike})*500)");
        let scene = square("4+20*x", "0", "0", &psi);
        let mesh = scene.triangulation(Some(4)).unwrap();
        let discretisation = Discretisation::of(&scene, "p2".parse().unwrap());
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let (_, fields) = certified(&problem, &rough(&problem, seed)).unwrap();
        let bounds = contact_terms(&fields);
        let pairs = problem.contact.iter().zip(&fields.data.obstacles);
        for ((contact, obstacle), bound) in pairs.zip(bounds) {
            if obstacle.is_lifted {
                continue;
            }
            let geometry = mesh.geometry(contact.cell);
            let local = mesh.local_face(contact.cell, contact.face);
            let normal = -geometry.gradients[local].normalize();
            let sigma = sigma(&fields, contact.cell);
            let ends = [(local + 1) % 3, (local + 2) % 3];
            let v = fields.corner_values(contact.cell);
            let b = fields.bubbles[contact.face];
            let [mut product, mut gaps, mut pressures] = [0.0; 3];
            let count = 1000;
            for s in (0..count).map(|k| (f64::from(k) + 0.5) / f64::from(count)) {
                let mut lambda = [0.0; 4];
                (lambda[ends[0]], lambda[ends[1]]) = (1.0 - s, s);
                let line: f64 = (0..3).map(|i| lambda[i] * v[i].mid()).sum();
                let psi = scene.data().psi.value(geometry.point(&lambda));
                let gap = psi - line - 4.0 * b * s * (1.0 - s);
                let pressure = -sigma(&lambda).dot(&normal);
                assert!(
                    gap > -1e-12 && pressure > -1e-12,
                    "{seed} {s} {gap} {pressure}"
                );
                product += gap * pressure;
                gaps += gap;
                pressures += pressure;
            }
            let share = contact.measure / f64::from(count);
            // Midpoints are good for three digits.
            assert!(share * product <= 1.01 * bound + 1e-15, "{product} {bound}");
            above_means += usize::from(product > 1.05 * gaps * pressures / f64::from(count));
        }
    }
    assert!(above_means > 0);
}

/// What lifts and τ are apart from G is charged to its bound, half of both as they are parts of ∇v and σ; and J(v) counts the
/// load of the lifts.
#[test]
fn lifts_are_part_of_what_is_known() {
    let scene = square("40+if(x+y<0.7,3,0)", "0", "sin(7*x)", "2");
    let mesh = scene.triangulation(Some(4)).unwrap();
    let discretisation = Discretisation::of(&scene, "p2".parse().unwrap());
    let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
    let (certificate, fields) = certified(&problem, &solved(&problem)).unwrap();
    let (_, known) = bounds(&fields, &mut Fluxes::new(&problem)).unwrap();
    let (parts, _) = fields.all_norms().unwrap();
    let (mut square, mut lifts) = (0.0, 0.0);
    for (cell, parts) in parts.iter().enumerate() {
        let of_lifts = fields.data.lifts_of(cell).iter();
        let of_lifts: f64 = of_lifts
            .map(|lift| lift.norms(&fields.simplex(cell))[0])
            .sum();
        square += (of_lifts + parts.tau).powi(2);
        lifts += of_lifts;
    }
    assert!(lifts > 0.0 && parts.iter().any(|cell| cell.tau > 0.0));
    let charged = known.of_g - certificate.g;
    assert!(
        (charged / (0.5 * square.sqrt()) - 1.0).abs() < 1e-9,
        "{charged} {square}"
    );
    // -(f, w), w = r δ(s): only this, as nothing else of J(v) is given here.
    let load = energy(&fields, Interval::ZERO);
    let mut truth = 0.0;
    for lift in &fields.data.lifts {
        let geometry = mesh.geometry(lift.cell);
        for sector in &lift.sectors {
            let piece = lift.piece(sector);
            for (inner, weight) in exact(2, 5).iter() {
                let at = std::array::from_fn(|i| (0..3).map(|k| inner[k] * piece[k][i]).sum());
                let (w, _) = lifted(&geometry, lift, &scene.data().g, &at);
                let share = (sector.to - sector.from) * geometry.measure();
                truth -= weight * share * scene.data().f.value(geometry.point(&at)) * w;
            }
        }
    }
    assert!(
        truth.abs() > 1e-6 && load.contains(truth),
        "{load:?} {truth}"
    );
}
