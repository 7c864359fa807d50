//! Admissible v on the contact faces for one field.
//!
//! A lift of ψ is part of v whether v touches ψ or not. Where a line below ψ costs less than a lift the line takes its place.

use std::borrow::Cow;

use super::data::PreparedData;
use super::simplex::Simplex;
use crate::contact::Problem;
use crate::interval::Interval;

/// The data for a field near v of P2 whose flux on the contact faces is λ: without the lifts that cost more than a line below ψ.
///
/// Known data aside, ‖∇u-G‖² is at most (M² + 4B)/4. Moving v by δ_i at a vertex or in the middle of a face adds about δ_i² ‖∇φ_i‖²
/// to M², with ‖∇φ_i‖² in `diagonal`; a gap adds 4 <λ, v-ψ>.
pub(super) fn fitted<'a>(
    problem: &Problem,
    data: Cow<'a, PreparedData>,
    lambda: &[f64],
    v: &[f64],
    diagonal: &[f64],
) -> Cow<'a, PreparedData> {
    let mesh = problem.space.mesh;
    let mut lines = Vec::new();
    for (k, (contact, obstacle)) in problem.contact.iter().zip(&data.obstacles).enumerate() {
        let face = mesh.face(contact.face);
        let ends = [face[0] as usize, face[1] as usize];
        if !obstacle.is_lifted {
            continue;
        }
        let psi = [0, 1].map(|i| obstacle.values[i].low);
        // v = g at an end on Γ_D, which may be above other lines.
        let line = match ends.iter().any(|&end| data.dirichlet[end].is_some()) {
            true => obstacle.line,
            false => Some(line_below(
                &obstacle.polygon,
                [0, 1].map(|i| v[ends[i]].min(psi[i])),
            )),
        };
        let Some(line) = line else { continue };
        let middle = mesh.points.len() + contact.face;
        let bubble = v[middle] - 0.5 * (v[ends[0]] + v[ends[1]]);
        // Of lowering v's ends to a line, and its b to what is left below it.
        let cost = |line: [f64; 2], bend: f64| {
            let gaps = [0, 1].map(|i| line[i] - v[ends[i]]);
            let of_ends = [0, 1].map(|i| diagonal[ends[i]] * gaps[i].min(0.0).powi(2));
            let room = bend + 0.25 * gaps.iter().map(|gap| gap.max(0.0)).sum::<f64>();
            let over = (bubble - room).max(0.0);
            of_ends[0] + of_ends[1] + diagonal[middle] * over * over
        };
        let lifts = data.lifts_of(contact.cell).iter();
        let own = lifts.filter(|lift| lift.face(mesh) == contact.face);
        let simplex = Simplex::new(mesh, contact.cell);
        let of_lift: f64 = own.map(|lift| lift.norms(&simplex)[0].powi(2)).sum();
        let of_v = [0, 1].map(|i| line[i].min(v[ends[i]]));
        let below = obstacle.mean.mid() - 0.5 * (of_v[0] + of_v[1]);
        let pressure = 4.0 * lambda[k].abs() * contact.measure * below.max(0.0);
        if cost(line, 0.0) + pressure < of_lift + cost(psi, data.bend(contact.face)) {
            lines.push((k, line));
        }
    }
    if lines.is_empty() {
        return data;
    }
    let mut data = data.into_owned();
    let mut is_left = vec![true; mesh.face_count()];
    for (k, line) in lines {
        let (obstacle, face) = (&mut data.obstacles[k], problem.contact[k].face);
        obstacle.ceiling[..2].copy_from_slice(&line);
        obstacle.is_lifted = false;
        data.bends[face] = 0.0;
        is_left[face] = false;
    }
    data.lifts.retain(|lift| is_left[lift.face(mesh)]);
    Cow::Owned(data)
}

/// Values at both ends of a line that is nowhere above the polygon: `near` with one end lowered, or with both lowered alike,
/// whichever loses least; then raised until it touches.
fn line_below(polygon: &[[f64; 2]], near: [f64; 2]) -> [f64; 2] {
    let at = Interval::at;
    // How far the line is above the polygon at most.
    let above = |line: [f64; 2]| {
        let off = polygon.iter().map(|[s, psi]| {
            let on_line = (Interval::ONE - at(*s)) * at(line[0]) + at(*s) * at(line[1]);
            (on_line - at(*psi)).high
        });
        off.fold(f64::NEG_INFINITY, f64::max)
    };
    let lowered = |end: usize| {
        let mut line = near;
        for [s, psi] in polygon {
            let [own, other] = if end == 0 {
                [1.0 - s, *s]
            } else {
                [*s, 1.0 - s]
            };
            if own > 0.0 {
                line[end] = line[end].min((psi - other * near[1 - end]) / own);
            }
        }
        line
    };
    let lines = [near, lowered(0), lowered(1)].map(|line| {
        let off = above(line);
        line.map(|end| (at(end) - at(off)).low)
    });
    let lost = |line: &[f64; 2]| {
        let of = [0, 1].map(|i| (near[i] - line[i]).max(0.0));
        of[0] * of[0] + of[1] * of[1]
    };
    let [first, second, third] = lines;
    [second, third].into_iter().fold(first, |best, line| {
        if lost(&line) < lost(&best) {
            line
        } else {
            best
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::certify::certify;
    use crate::certify::tests::{certified, solved};
    use crate::contact::{Discretisation, Method};
    use crate::scene::{Data, Expression, Scene};

    fn with_psi(base: &str, psi: &str) -> Scene {
        let scene = Scene::find(base).unwrap();
        scene.with_data(Data {
            psi: Expression::parse(psi).unwrap(),
            ..scene.data().clone()
        })
    }

    /// ψ next to a corner with Γ_D, where v is nearly ψ: what jumps, falls, or has a kink or a spike on the first faces.
    const AT_CORNERS: [&str; 7] = [
        "if(x<0.07,0.1,-0.05)",
        "if(x<0.93,-0.05,0.1)",
        "if(x<0.04,10*x^2-0.3*x,0.5)",
        "0.1-5*max(0,1-abs(x-0.05)*5000)",
        "0.2*sin(2+5*x)+0.1*abs(x-0.06)",
        "-sqrt(x)",
        "if(x<0.07,0.1,-0.05)-0.2*abs(x-0.95)",
    ];

    /// Γ_D on the sides, with g = ψ at the corners but where ψ's slope has no bound.
    fn pressed(psi: &str) -> Scene {
        let gap = if psi.contains("sqrt") { 0.02 } else { 0.0 };
        Scene::parse(&format!(
            "name = \"pressed\"\n[mesh]\ngenerator = \"union-jack\"\nn = 2\n[boundary]\n\
             dirichlet = [\"left\", \"right\"]\nneumann = [\"top\"]\ncontact = [\"bottom\"]\n[data]\nf = \"1\"\n\
             psi = \"{psi}\"\ng = \"-{gap}+{psi}+y\"\n"
        ))
        .unwrap()
    }

    /// Between the ceilings at the vertices no point of a face is above ψ, whatever ψ does between them, and whatever field
    /// they are for.
    #[test]
    fn ceilings_are_nowhere_above_the_obstacle() {
        for (base, psi) in [
            ("one-zone", "0.01+abs(x-0.53)"),
            ("one-zone", "0.1*(x-0.43)^2"),
            ("one-zone", "-0.1*(x-0.43)^2"),
            ("one-zone", "0.3*sin(14*x)-max(0,x-0.6)"),
            ("one-zone", "0.05-0.5*max(0,1-abs(x-0.53)*5000)"),
            ("one-zone", "if(x<0.53,0.2,-0.1)"),
            ("one-zone", "if(sin(1e7*x)<0,-1,0)"),
            ("one-zone-3d", "(x-0.1)^2"),
            ("one-zone-3d", "0.1*(x-0.4)^2+0.2*sin(5*x)*cos(4*y)"),
            ("one-zone-3d", "0.1*x+abs(y-0.3)"),
        ]
        .into_iter()
        .chain(AT_CORNERS.map(|psi| ("pressed", psi)))
        {
            let scene = match base {
                "pressed" => pressed(psi),
                _ => with_psi(base, psi),
            };
            let psi = &scene.data().psi;
            let mesh = scene.triangulation(Some(4)).unwrap();
            let discretisation = Discretisation::of(&scene, Method::cr_fc());
            let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
            let data = PreparedData::new(&problem).unwrap();
            let mut random = crate::Random::new(1);
            let mut any = |count: usize| -> Vec<f64> {
                let values = (0..count).map(|_| 0.5 * random.next() - 0.4);
                values.collect()
            };
            // For random fields, some of them above ψ in part, they differ where ψ has lifts.
            let fields = (0..20).map(|k| {
                let near = any(mesh.points.len() + mesh.face_count());
                let diagonal = vec![1.0; near.len()];
                // Where λ is not 0 a lift is often worth it.
                let lambda = any(problem.contact.len());
                let lambda: Vec<f64> = lambda.iter().map(|l| l * f64::from(k % 2)).collect();
                fitted(&problem, Cow::Borrowed(&data), &lambda, &near, &diagonal).into_owned()
            });
            let obstacles = |data: PreparedData| {
                for (contact, obstacle) in problem.contact.iter().zip(&data.obstacles) {
                    // Bubbles are counted from that of ψ where it is lifted.
                    assert!(obstacle.is_lifted || data.bend(contact.face) == 0.0);
                }
                data.obstacles
            };
            let all: Vec<_> = fields.map(obstacles).collect();
            let obstacles = all.iter().flatten().chain(&data.obstacles);
            let contact = problem.contact.iter().cycle();
            let mut lowered = 0;
            for (contact, obstacle) in contact.zip(obstacles) {
                if obstacle.is_lifted {
                    continue;
                }
                let vertices = mesh.face(contact.face);
                let mut random = crate::Random::new(contact.face as u64);
                // Corners, edges and what is between them, and points anywhere.
                let steps = (0..13 * 13).map(|k| [f64::from(k % 13), f64::from(k / 13)]);
                let even = steps.filter(|[a, b]| a + b <= 12.0 && (mesh.dim == 3 || a + b == 12.0));
                let even = even.map(|[a, b]| [a, b, 12.0 - a - b, 0.0]);
                let even: Vec<[f64; 4]> = even.collect();
                let anywhere = (0..500).map(|_| [random.next(), random.next(), random.next(), 0.0]);
                for mut weights in even.into_iter().chain(anywhere) {
                    weights[mesh.dim..].fill(0.0);
                    let all: f64 = weights.iter().sum();
                    let (mut x, mut ceiling) = ([0.0; 3], 0.0);
                    for ((&vertex, weight), own) in
                        vertices.iter().zip(weights).zip(obstacle.ceiling)
                    {
                        let at = mesh.points[vertex as usize];
                        (0..3).for_each(|k| x[k] += weight / all * at[k]);
                        ceiling += weight / all * own;
                    }
                    assert!(ceiling <= psi.value(x) + 1e-12, "{} at {x:?}", psi.text());
                }
                let corners = obstacle.ceiling.iter().zip(obstacle.values).take(mesh.dim);
                lowered += usize::from(corners.into_iter().any(|(c, psi)| *c < psi.low - 1e-9));
            }
            assert!(lowered > 0 || base == "pressed", "{}", psi.text());
        }
    }

    /// An obstacle out of reach costs nothing, for any shape: 60 times the bound where its kink is lifted.
    #[test]
    fn an_obstacle_out_of_reach_costs_nothing() {
        let bound = |psi: &str| {
            let scene = with_psi("one-zone", psi);
            let mesh = scene.triangulation(Some(32)).unwrap();
            let problem =
                Problem::new(&scene, &mesh, &Discretisation::of(&scene, Method::p2())).unwrap();
            certify(&problem, &solved(&problem)).unwrap().v
        };
        let [flat, bent] = ["1", "1+abs(x-0.53)"].map(bound);
        assert!((bent - flat).abs() < 1e-9 * flat, "{flat} {bent}");
    }

    /// v of any field is nowhere above ψ, with its bubbles, and its lift where it has one.
    #[test]
    fn no_field_is_above_the_obstacle() {
        let mut lifted = [0, 0];
        let apart = [
            "-0.1*(x-0.43)^2",
            "0.05*abs(x-0.53)-0.01",
            "-0.05*abs(x-0.53)",
            "0.02*sin(9*x)",
        ];
        let apart = apart.map(|psi| with_psi("one-zone", psi));
        for scene in apart.into_iter().chain(AT_CORNERS.map(pressed)) {
            let psi = &scene.data().psi;
            let mesh = scene.triangulation(Some(6)).unwrap();
            let discretisation = Discretisation::of(&scene, Method::p2());
            let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
            let (u, mut random) = (solved(&problem), crate::Random::new(7));
            for noise in (0..16).map(|k| [0.0, 0.001, 0.01, 0.1][k % 4]) {
                let off = u
                    .iter()
                    .zip(problem.dirichlet.iter())
                    .map(|(u, g)| match g {
                        Some(_) => *u,
                        None => u + noise * (random.next() - 0.5),
                    });
                let off: Vec<f64> = off.collect();
                let (_, fields) = certified(&problem, &off).unwrap();
                for (contact, obstacle) in problem.contact.iter().zip(&fields.data.obstacles) {
                    lifted[usize::from(obstacle.is_lifted)] += 1;
                    let face = mesh.face(contact.face);
                    let [a, b] = [0, 1].map(|i| mesh.points[face[i] as usize]);
                    let at = |s: f64| std::array::from_fn(|k| (1.0 - s) * a[k] + s * b[k]);
                    let line = |s: f64, ends: [f64; 2]| (1.0 - s) * ends[0] + s * ends[1];
                    let v = [0, 1].map(|i| fields.v[face[i] as usize].high);
                    for s in (0..=40).map(|k| f64::from(k) / 40.0) {
                        let beyond = if obstacle.is_lifted {
                            let bent = 4.0 * fields.data.bend(contact.face) * s * (1.0 - s);
                            psi.value(at(s)) - line(s, [a, b].map(|x| psi.value(x))) - bent
                        } else {
                            0.0
                        };
                        let bubble = 4.0 * fields.bubbles[contact.face] * s * (1.0 - s);
                        let above = line(s, v) + bubble + beyond - psi.value(at(s));
                        assert!(above <= 1e-12, "{} {noise} {s} {above}", psi.text());
                    }
                }
            }
        }
        assert!(lifted.iter().all(|count| *count > 10), "{lifted:?}");
    }

    /// The line loses as little as one that is nowhere above a kink can, and touches it.
    #[test]
    fn lines_are_below_the_polygon() {
        let kink = [[0.0, 1.0], [0.25, 0.0], [0.25, 0.0], [1.0, 0.0]];
        for (near, expected) in [
            ([-1.0, -3.0], [0.5, -1.5]),
            ([0.0, 0.0], [0.0, 0.0]),
            ([0.5, 0.0], [0.0, 0.0]),
            ([0.0, 5.0], [0.0, 0.0]),
        ] {
            let line = line_below(&kink, near);
            for (value, expected) in line.iter().zip(expected) {
                assert!((value - expected).abs() < 1e-15, "{near:?} {line:?}");
            }
        }
    }
}
