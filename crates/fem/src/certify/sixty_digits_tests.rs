//! The whole chain in arithmetic of 60 digits, by other formulas, from the numbers that define v, σ and q: the bounds of each
//! cell holds for the exact fields, rounding included, and is no more than rounding above them.

use super::quadratic::{Linear, Quadratic};
use super::simplex::{EDGES, Vector};
use super::tests::{moved, solved, square};
use super::*;
use crate::contact::Discretisation;
use crate::scene::Part;
use crate::sixty_digits::Big;
use faceoff_mesh::mesh::Triangulation;

type Pair = [Big; 2];

fn zero() -> Pair {
    [Big::of(0.0), Big::of(0.0)]
}

fn plus(a: &Pair, b: &Pair) -> Pair {
    [&a[0] + &b[0], &a[1] + &b[1]]
}

fn times(s: &Big, a: &Pair) -> Pair {
    [s * &a[0], s * &a[1]]
}

fn dot(a: &Pair, b: &Pair) -> Big {
    &a[0] * &b[0] + &a[1] * &b[1]
}

/// A triangle.
struct Cell {
    vertices: [Pair; 3],
    /// 2|κ| with the sign of the orientation, and |κ|
    determinant: Big,
    measure: Big,
    gradients: [Pair; 3],
}

impl Cell {
    fn new(mesh: &Triangulation, cell: usize) -> Cell {
        let all = mesh.vertices(cell);
        let vertices: [Pair; 3] = std::array::from_fn(|i| [0, 1].map(|k| Big::of(all[i][k])));
        let edge = |i: usize, j: usize| plus(&vertices[j], &times(&Big::of(-1.0), &vertices[i]));
        let [a, b] = [edge(0, 1), edge(0, 2)];
        let determinant = &a[0] * &b[1] - &a[1] * &b[0];
        // ∇λ_i is the opposite edge turned by a right angle, over 2|κ|.
        let gradients = std::array::from_fn(|i| {
            let [x, y] = edge((i + 1) % 3, (i + 2) % 3);
            [-y / determinant.clone(), x / determinant.clone()]
        });
        Cell {
            measure: determinant.abs() / Big::of(2.0),
            vertices,
            determinant,
            gradients,
        }
    }

    fn point(&self, lambda: &[f64; 3]) -> Pair {
        let terms = lambda.iter().zip(&self.vertices);
        terms.fold(zero(), |sum, (l, x)| plus(&sum, &times(&Big::of(*l), x)))
    }

    /// ∇(Σ a_i λ_i + Σ_F 4 b_F λ_j λ_k) at a point.
    fn slope(&self, a: &[f64; 3], b: &[f64; 3], lambda: &[f64; 3]) -> Pair {
        (0..3).fold(zero(), |sum, i| {
            let [j, k] = [(i + 1) % 3, (i + 2) % 3];
            let of_a = times(&Big::of(a[i]), &self.gradients[i]);
            let mixed = plus(
                &times(&Big::of(lambda[j]), &self.gradients[k]),
                &times(&Big::of(lambda[k]), &self.gradients[j]),
            );
            plus(&sum, &plus(&of_a, &times(&Big::of(4.0 * b[i]), &mixed)))
        })
    }

    /// Σ_i c_i (x-x_i) at a point.
    fn radial(&self, c: &[Big; 3], lambda: &[f64; 3]) -> Pair {
        let x = self.point(lambda);
        (0..3).fold(zero(), |sum, i| {
            let away = plus(&x, &times(&Big::of(-1.0), &self.vertices[i]));
            plus(&sum, &times(&c[i], &away))
        })
    }
}

/// The corners and the midpoints opposite them.
const NODES: [[f64; 3]; 6] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.5, 0.5],
    [0.5, 0.0, 0.5],
    [0.5, 0.5, 0.0],
];

/// ‖·‖² of a quadratic field from its values at the nodes, by the mass matrix of P2.
fn square_of(cell: &Cell, values: &[Pair; 6]) -> Big {
    let mass = |i: usize, j: usize| match (i < 3, j < 3) {
        (true, true) => {
            if i == j {
                6.0
            } else {
                -1.0
            }
        }
        (false, false) => {
            if i == j {
                32.0
            } else {
                16.0
            }
        }
        _ => {
            if i % 3 == j % 3 {
                -4.0
            } else {
                0.0
            }
        }
    };
    let mut sum = Big::of(0.0);
    for i in 0..6 {
        for j in 0..6 {
            sum = sum + Big::of(mass(i, j)) * dot(&values[i], &values[j]);
        }
    }
    sum * cell.measure.clone() / Big::of(180.0)
}

#[test]
fn the_exact_fields_are_within_what_is_said_of_them() {
    let [c0, c1, c2] = [-1.1, -0.3, 0.7];
    let scene = square(&format!("{c0}+({c1})*x+{c2}*y"), "0", "0", "0");
    for (method, seed) in [("cr", 1), ("cr-fc", 2), ("p1", 3), ("p2", 4)] {
        let mesh = moved(&scene, 4, seed);
        let discretisation = Discretisation::of(&scene, method.parse().unwrap());
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let u = solved(&problem);
        let data = PreparedData::new(&problem).unwrap();
        let mut solver = Fluxes::new(&problem);
        let fields = CellFields::new(&problem, &u, Cow::Owned(data), &mut solver).unwrap();
        let norms: Vec<_> = (0..mesh.cell_count())
            .map(|cell| fields.norms(&fields.simplex(cell), cell))
            .collect();
        let errors: Vec<f64> = norms.iter().map(|cell| cell.parts.error).collect();
        let [q, _] = solver.majorant(&errors, &[]).unwrap();
        let mut misfit = Big::of(0.0);
        for (cell, norms) in norms.iter().enumerate() {
            let of = Cell::new(&mesh, cell);
            let faces = mesh.cell_faces(cell);
            let corners = |all: &dyn Fn(usize) -> f64| -> [f64; 3] {
                std::array::from_fn(|i| all(mesh.cell(cell)[i] as usize))
            };
            let v = corners(&|vertex| fields.v[vertex].mid());
            let b = std::array::from_fn(|i| fields.bubbles[faces[i] as usize]);
            let stream = fields.stream.as_ref().unwrap();
            let (s, of_s) = (
                corners(&|vertex| stream.vertices[vertex]),
                std::array::from_fn(|i| stream.faces[faces[i] as usize]),
            );
            let flux = |all: &[f64]| -> [Big; 3] {
                std::array::from_fn(|i| {
                    Big::of(all[3 * cell + i]) / (Big::of(2.0) * of.measure.clone())
                })
            };
            let (own, slopes) = (flux(&fields.fluxes), fields.data.loads[cell].slopes);
            let both: [[Pair; 2]; 6] = std::array::from_fn(|n| {
                let at = &NODES[n];
                let bubble: [Big; 3] =
                    std::array::from_fn(|i| Big::of(-slopes[i] * at[i]) / Big::of(3.0));
                let [x, y] = of.slope(&s, &of_s, at);
                let sigma = plus(
                    &plus(&of.radial(&own, at), &of.radial(&bubble, at)),
                    &[y, -x],
                );
                [of.slope(&v, &b, at), sigma]
            });
            let sum = |factor: f64| {
                both.each_ref()
                    .map(|[v, sigma]| plus(v, &times(&Big::of(factor), sigma)))
            };
            let half = square_of(&of, &sum(1.0)).sqrt() / Big::of(2.0);
            let said = norms.gradient;
            assert!(
                half.at_least(said.low)
                    && half.at_most(said.high)
                    && said.high <= said.low * (1.0 + 1e-9),
                "{method} {cell}: {said:?}"
            );
            let square = square_of(&of, &sum(-1.0));
            let said = norms.parts.misfit;
            let exact = square.sqrt();
            assert!(exact.at_most(said), "{method} {cell}: {said}");
            assert!(
                exact.at_least(said * (1.0 - 1e-9)),
                "{method} {cell}: {said}"
            );
            misfit = misfit + square;

            // f + div σ is linear: its mean, and what is off it.
            let sum = own.iter().cloned().sum::<Big>() * Big::of(2.0);
            let rest: Vec<Big> = NODES[..3]
                .iter()
                .map(|at| {
                    let [x, y] = of.point(at);
                    let f = Big::of(c0) + Big::of(c1) * x + Big::of(c2) * y;
                    let of_bubble: Big = (0..3)
                        .map(|i| Big::of(slopes[i]) * Big::of(3.0 * at[i] - 1.0))
                        .sum();
                    f + sum.clone() - of_bubble / Big::of(3.0)
                })
                .collect();
            let mean = rest.iter().cloned().sum::<Big>() / Big::of(3.0);
            assert!(mean.abs().at_most(norms.parts.error), "{method} {cell}");
            let outward = -(flux(&q).iter().cloned().sum::<Big>() * Big::of(2.0));
            assert!(outward.at_least(norms.parts.error), "{method} {cell}");
            assert!(!(of.determinant.at_least(0.0) && of.determinant.at_most(0.0)));
        }
        // ∫ λ v on each contact face by Simpson's rule, exact for what is of degree 3.
        let mut touching = Big::of(0.0);
        for contact in &problem.contact {
            let of = Cell::new(&mesh, contact.cell);
            let local = mesh.local_face(contact.cell, contact.face);
            let [j, k] = [(local + 1) % 3, (local + 2) % 3];
            let total = Big::of(fields.fluxes[3 * contact.cell + local]);
            let turned = if of.determinant.at_least(0.0) {
                4.0
            } else {
                -4.0
            };
            let bent = Big::of(turned * fields.stream.as_ref().unwrap().faces[contact.face]);
            let [a, c] =
                [j, k].map(|i| Big::of(fields.v[mesh.cell(contact.cell)[i] as usize].mid()));
            let middle = (&a + &c) / Big::of(2.0) + Big::of(fields.bubbles[contact.face]);
            let lambda = [&total + &bent, total.clone(), &total - &bent];
            assert!(lambda.iter().all(|l| l.at_most(0.0)), "{method}");
            assert!([&a, &middle, &c].iter().all(|v| v.at_most(0.0)), "{method}");
            let [first, between, last] = lambda;
            touching =
                touching + (first * a + Big::of(4.0) * between * middle + last * c) / Big::of(6.0);
        }
        let (certificate, _) = bounds(&fields, &mut solver).unwrap();
        assert!(touching.at_most(certificate.parts.contact), "{method}");
        let least = (misfit / Big::of(4.0) + touching).sqrt();
        assert!(least.at_most(certificate.g), "{method} {}", certificate.g);
        assert!(
            least.at_least(certificate.g * (1.0 - 1e-6)),
            "{method} {}",
            certificate.g
        );
        assert!(problem.parts.contains(&Some(Part::Neumann)));
    }
}

/// Fields on slivers far from the origin, whose cofactors cancel, and fields that are nothing but sums: their exact values at
/// the corners, and the mean of their squares, are in the intervals, which are hardly wider than rounding asks.
#[test]
fn fields_on_slivers_are_within_their_rounding() {
    let scene = square("-1", "0", "0", "0");
    let mut random = crate::Random::new(11);
    let mut random = move || 2.0 * random.next() - 1.0;
    for (seed, [width, height, shear], [x, y], known_to) in [
        (1, [1.0, 1.0, 0.0], [0.0, 0.0], 1e-13),
        (2, [1.0, 1e-5, 0.0], [1e3, 7.0], 1e-12),
        (3, [1e-7, 1.0, 0.0], [-3.0, 1e5], 1e-12),
        // The determinant is a small difference.
        (4, [0.3, 1e-9, 0.3], [0.1, 0.7], 1e-4),
    ] {
        let mut mesh = moved(&scene, 4, seed);
        for point in &mut mesh.points {
            let [p, q, _] = *point;
            *point = [x + width * p, y + shear * p + height * q, 0.0];
        }
        for cell in 0..mesh.cell_count() {
            let (of, simplex) = (Cell::new(&mesh, cell), Simplex::new(&mesh, cell));
            let mut three = || -> [f64; 3] { std::array::from_fn(|_| random()) };
            let (fluxes, v, b, bend) = (three(), three(), three(), three());
            let fields = [
                Linear::<2>::raviart_thomas(&simplex, &fluxes),
                Linear::gradient(
                    &simplex,
                    &[v[0], v[1], v[2], 0.0].map(Interval::at),
                    Some(&b),
                ),
            ];
            let c: [Big; 3] =
                std::array::from_fn(|i| Big::of(fluxes[i]) / (Big::of(2.0) * of.measure.clone()));
            let exact = |at: &[f64; 3]| [of.radial(&c, at), of.slope(&v, &b, at)];
            let holds = |found: Vector, exact: &Pair, most: f64| {
                for (found, exact) in found.iter().zip(exact) {
                    let place = format!("{seed}, cell {cell}: {found:?}");
                    assert!(
                        exact.at_least(found.low) && exact.at_most(found.high),
                        "{place}"
                    );
                    assert!(found.radius() <= most, "{place}");
                }
            };
            let sum = fields[0].plus(-0.7, &fields[1]);
            let all = [&fields[0], &fields[1], &sum].map(Linear::at_corners);
            let largest = |of: &[Vector; 4]| {
                of.iter()
                    .flatten()
                    .fold(0.0, |m: f64, w| m.max(w.magnitude()))
            };
            for n in 0..3 {
                let [first, second] = exact(&NODES[n]);
                let both = plus(&first, &times(&Big::of(-0.7), &second));
                for (found, exact) in all.iter().zip([&first, &second, &both]) {
                    holds(found[n], exact, known_to * largest(found));
                }
            }
            let flat =
                Linear::<2>::gradient(&simplex, &[v[0], v[1], v[2], 0.0].map(Interval::at), None);
            let found = flat.at_corners();
            let slope = of.slope(&v, &[0.0; 3], &NODES[0]);
            holds(found[0], &slope, known_to * largest(&found));
            // With a bubble in the middle of each edge.
            let mut field = Quadratic::of(&sum);
            for (k, [i, j]) in EDGES.into_iter().enumerate().take(3) {
                field.bend(k, bend[k], &simplex.edge(i, j));
            }
            let values: [Pair; 6] = std::array::from_fn(|n| {
                let [first, second] = exact(&NODES[n]);
                let mut value = plus(&first, &times(&Big::of(-0.7), &second));
                let middle = EDGES[..3]
                    .iter()
                    .position(|[i, j]| n >= 3 && n - 3 + i + j == 3);
                if let Some(edge) = middle {
                    let [i, j] = EDGES[edge];
                    let [p, q] = [&of.vertices[i], &of.vertices[j]];
                    let along = plus(q, &times(&Big::of(-1.0), p));
                    value = plus(&value, &times(&Big::of(bend[edge]), &along));
                }
                value
            });
            let mean = square_of(&of, &values) / of.measure.clone();
            let found = field.mean_square(2);
            assert!(
                mean.at_least(found.low) && mean.at_most(found.high),
                "{seed}: {found:?}"
            );
            assert!(
                found.radius() <= 100.0 * known_to * found.high,
                "{seed}: {found:?}"
            );
        }
    }
}

/// Sums of exact fields are known up to only rounding, and what is not known of an argument stays unknown.
#[test]
fn a_sum_of_exact_fields_has_its_rounding_and_what_its_terms_did_not_know() {
    let mut random = crate::Random::new(12);
    for _ in 0..500 {
        let mut field = |radius: f64| -> [[Interval; 3]; 4] {
            std::array::from_fn(|_| {
                std::array::from_fn(|_| {
                    let x = 2.0 * random.next() - 1.0;
                    Interval::new(x - radius, x + radius)
                })
            })
        };
        let (a, b) = (field(0.0), field(1e-9));
        let factor = 2.0 * b[0][0].mid() + 0.1;
        let found = Linear::<3>::new(&a)
            .plus(factor, &Linear::new(&b))
            .at_corners();
        let exact = Linear::<3>::new(&a)
            .plus(factor, &Linear::new(&a))
            .at_corners();
        for corner in 0..4 {
            for k in 0..3 {
                let (a, b) = (&a[corner][k], &b[corner][k]);
                for end in [b.low, b.high] {
                    let sum = Big::of(a.mid()) + Big::of(factor) * Big::of(end);
                    let found = found[corner][k];
                    assert!(
                        sum.at_least(found.low) && sum.at_most(found.high),
                        "{found:?}"
                    );
                }
                let sum = Big::of(a.mid()) + Big::of(factor) * Big::of(a.mid());
                let found = exact[corner][k];
                assert!(
                    sum.at_least(found.low) && sum.at_most(found.high),
                    "{found:?}"
                );
                assert!(found.radius() < 1e-14, "{found:?}");
            }
        }
    }
}
