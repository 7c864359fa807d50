//! The remainder of t on a face of Γ_N after σ·n has taken its mean.
//!
//! In 2D, on a face F = ab of a triangle with c opposite, t's constants on the leaves of F are normal traces of an
//! explicit flux without divergence: where the halves of a segment differ from its mean by ±δ, it is δ |F|/(2|κ|) times
//! (a-c) in the child at a, (c-b) in the child at b, (a-b) in the middle one, of the triangle cut in four; so on each
//! level, on triangles nested at F. What is linear on a leaf with mean 0, and all of it in 3D, is bounded by the trace
//! inequality.

use super::balance::poincare;
use super::simplex::{
    Simplex, Vector, ZERO, dot, length, mean_square_of_linear, norm, plus, root_of_product, times,
    up,
};
use super::tree::Tree;
use crate::interval::{Interval, above_of_all, above_of_product};

/// The bounds of one face.
pub(super) struct Patch {
    pub oscillation: f64,
    pub error: f64,
    pub spread: f64,
}

/// The patch of the face opposite vertex `local`, its corners `corners` in the cell, for σ·n = `flux` on it.
pub(super) fn patch(
    cell: &Simplex,
    local: usize,
    corners: &[usize],
    tree: &Tree,
    flux: Interval,
) -> Patch {
    let dim = cell.dim - 1;
    let count = dim + 1;
    let measure = cell.face_measure(local).high;
    let scale = trace(cell, local).high;
    let nodes = 1 + tree.rest.len();
    let (mut means, mut errors, mut depths) = (vec![0.0; nodes], vec![0.0; nodes], vec![0; nodes]);
    let (mut leaves, mut plain, mut waves) = (Vec::new(), Vec::new(), Vec::new());
    for node in 0..nodes as u32 {
        for half in tree.below_of(node).into_iter().flatten() {
            depths[half as usize] = depths[node as usize] + 1;
        }
    }
    tree.for_each(&mut |node, _, share| {
        let leaf = tree.leaf(node);
        let values = leaf.values[..count].iter().map(|v| Interval::at(*v));
        let mean = values.clone().sum::<Interval>() / Interval::at(count as f64);
        let off: Vec<Interval> = values.clone().map(|v| v - mean).collect();
        // In 2D the trace inequality holds on a triangle that is smaller by 2^-depth, and C_F² with it.
        let smaller = if dim == 1 {
            0.5_f64.powi(depths[node as usize])
        } else {
            1.0
        };
        let own = above_of_product(scale, Interval::at(smaller).root().high);
        let size = |square: f64| root_of_product(above_of_product(share, measure), square);
        leaves.push(above_of_product(
            own,
            size(mean_square_of_linear(&off).high),
        ));
        let from_mean: Vec<Interval> = values.map(|v| v - flux).collect();
        plain.push(size(mean_square_of_linear(&from_mean).high));
        waves.push(above_of_product(
            own,
            size(Interval::at(leaf.swell).square().high),
        ));
        means[node as usize] = mean.mid();
        errors[node as usize] = up(leaf.unknown(), mean.radius());
    });
    let waves = length(waves);
    let plain = above_of_product(scale, length(plain));
    if !tree.is_cut() || dim != 1 {
        // What the mean differs from σ·n by is unknown as well, not oscillation: it is not a function of mean 0.
        let off = tree.mean(|node| Interval::at(means[node as usize])) - flux;
        let worst = errors.iter().copied().fold(0.0, f64::max);
        let mean_error = if tree.is_cut() {
            tree.mean(|node| Interval::at(errors[node as usize])).high
        } else {
            worst
        };
        let mut away = Vec::new();
        tree.for_each(&mut |node, _, share| {
            let off = Interval::at(errors[node as usize]) - Interval::at(mean_error);
            away.push(above_of_product(share, off.square().high));
        });
        let spread = if tree.is_cut() {
            root_of_product(measure, above_of_all(away))
        } else {
            0.0
        };
        return Patch {
            oscillation: up(plain, waves),
            error: up(mean_error, off.magnitude()),
            spread: above_of_product(scale, spread),
        };
    }
    let means = tree.averages(means);
    let known = means[0];
    let [a, b] = [corners[0], corners[1]];
    let quotient = cell.face_measure(local) / (2.0 * cell.measure);
    let nested = Nested {
        cell,
        tree,
        toward_a: times(quotient, &cell.edge(local, a)),
        toward_b: times(quotient, &cell.edge(b, local)),
        along: times(quotient, &cell.edge(b, a)),
    };
    let mut off = vec![0.0; nodes];
    let square = nested.square(
        0,
        cell.measure,
        ZERO,
        Interval::ZERO,
        &means,
        &mut |node, represented| {
            let missing = Interval::at(means[node as usize]) - (Interval::at(known) + represented);
            off[node as usize] = missing.magnitude();
        },
    );
    let by_flux = up(square.root().high, length(leaves));
    for (error, off) in errors.iter_mut().zip(off) {
        *error = up(*error, off);
    }
    let bounds = tree.averages(errors.clone());
    let mut rounding = 0.0_f64;
    let square = nested.square(
        0,
        cell.measure,
        ZERO,
        Interval::ZERO,
        &bounds,
        &mut |node, represented| {
            let missing =
                Interval::at(bounds[node as usize]) - (Interval::at(bounds[0]) + represented);
            rounding = rounding.max(missing.magnitude());
        },
    );
    let mut away = Vec::new();
    tree.for_each(&mut |node, _, share| {
        let off = Interval::at(bounds[node as usize]) - Interval::at(bounds[0]);
        away.push(above_of_product(share, off.square().high));
    });
    let of_face = above_of_product(scale, root_of_product(measure, above_of_all(away)));
    let unbalanced = (Interval::at(known) - flux).magnitude();
    Patch {
        oscillation: up(by_flux.min(plain), waves),
        error: up(up(bounds[0], rounding), unbalanced),
        spread: of_face.min(square.root().high),
    }
}

struct Nested<'a> {
    cell: &'a Simplex,
    tree: &'a Tree,
    /// (a-c), (c-b) and (a-b) times |F|/(2|κ|)
    toward_a: Vector,
    toward_b: Vector,
    along: Vector,
}

impl Nested<'_> {
    /// ∫ |flux|² over the triangle at this node, with what the levels above put there.
    fn square(
        &self,
        node: u32,
        area: Interval,
        above: Vector,
        represented: Interval,
        means: &[f64],
        leaf: &mut impl FnMut(u32, Interval),
    ) -> Interval {
        let dim = self.cell.dim;
        let Some([at_a, at_b]) = self.tree.below_of(node) else {
            leaf(node, represented);
            return area * dot(&above, &above, dim);
        };
        let delta = Interval::at(means[at_a as usize] - means[node as usize]);
        let quarter = area / Interval::at(4.0);
        let middle = plus(&above, &times(delta, &self.along));
        let own = dot(&above, &above, dim) + dot(&middle, &middle, dim);
        let inside = |v: &Vector| plus(&above, &times(delta, v));
        let (toward_a, toward_b) = (inside(&self.toward_a), inside(&self.toward_b));
        quarter * own
            + self.square(at_a, quarter, toward_a, represented + delta, means, leaf)
            + self.square(at_b, quarter, toward_b, represented - delta, means, leaf)
    }
}

/// C_F: ‖z - z̄‖_F ≤ C_F ‖∇z‖_κ.
fn trace(cell: &Simplex, local: usize) -> Interval {
    let length = (0..=cell.dim)
        .filter(|&i| i != local)
        .map(|i| norm(&cell.edge(local, i), cell.dim).high);
    let length = Interval::at(length.fold(0.0, f64::max));
    let c = poincare(cell.dim) * Interval::at(cell.diameter);
    let ratio = cell.face_measure(local) / cell.measure;
    let sum = c + length * Interval::at(2.0) / Interval::at(cell.dim as f64);
    (ratio * c * sum).root()
}

#[cfg(test)]
mod tests {
    use super::super::tests::moved;
    use super::super::tree::Leaf;
    use super::*;
    use crate::quadrature::exact;
    use crate::scene::Scene;
    use faceoff_mesh::mesh::CellGeometry;
    use nalgebra::{DMatrix, DVector, Vector3};

    /// A face cut into halves, quarters, … on which t's model is `leaf` at the leaf's midpoint.
    fn tree(depth: u32, leaf: &dyn Fn(f64) -> Leaf) -> Tree {
        let count = (2_usize << depth) - 1;
        let first_leaf = count / 2;
        let nodes = (0..count).map(|node| {
            let own = Leaf {
                edge: [0, 1],
                ..Leaf::default()
            };
            if node < first_leaf {
                return Leaf {
                    parts: 2 * node as u32 + 1,
                    at: 0.5,
                    ..own
                };
            }
            let middle = ((node - first_leaf) as f64 + 0.5) / (first_leaf + 1) as f64;
            Leaf {
                edge: [0, 1],
                parts: 0,
                ..leaf(middle)
            }
        });
        let nodes: Vec<Leaf> = nodes.collect();
        Tree {
            whole: nodes[0],
            rest: nodes[1..].to_vec(),
            ..Tree::default()
        }
    }

    /// The largest <z, w>_F / ‖∇w‖_κ of all polynomials w of degree 3, for z on F of mean 0 that is constant on 16 parts of it.
    fn reach(geometry: &CellGeometry, [a, b]: [usize; 2], z: &dyn Fn(f64) -> f64) -> f64 {
        let powers: Vec<[i32; 2]> = (0..=3)
            .flat_map(|i| (0..=3 - i).map(move |j| [i, j]))
            .filter(|p| *p != [0, 0])
            .collect();
        let centre = geometry.point(&[1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 0.0]);
        let local = |x: [f64; 3]| [0, 1].map(|k| (x[k] - centre[k]) / geometry.diameter);
        let slope = |[i, j]: [i32; 2], x: [f64; 2]| {
            let of = |n: i32, x: f64| f64::from(n) * x.powi((n - 1).max(0));
            Vector3::new(of(i, x[0]) * x[1].powi(j), x[0].powi(i) * of(j, x[1]), 0.0)
                / geometry.diameter
        };
        let mut stiffness = DMatrix::<f64>::zeros(powers.len(), powers.len());
        for (lambda, weight) in exact(2, 5).iter() {
            let x = local(geometry.point(&lambda));
            for (m, p) in powers.iter().enumerate() {
                for (n, q) in powers.iter().enumerate() {
                    let product = slope(*p, x).dot(&slope(*q, x));
                    stiffness[(m, n)] += weight * geometry.measure() * product;
                }
            }
        }
        let mut load = DVector::<f64>::zeros(powers.len());
        let length = (geometry.vertices[b] - geometry.vertices[a]).norm();
        for part in 0..16 {
            for (lambda, weight) in exact(1, 5).iter() {
                let s = (f64::from(part) + lambda[1]) / 16.0;
                let x = geometry.vertices[a] + s * (geometry.vertices[b] - geometry.vertices[a]);
                for (m, [i, j]) in powers.iter().enumerate() {
                    let x = local(x.into());
                    load[m] += weight * length / 16.0 * z(s) * x[0].powi(*i) * x[1].powi(*j);
                }
            }
        }
        let found = stiffness
            .cholesky()
            .expect("no constant is among them")
            .solve(&load);
        load.dot(&found).sqrt()
    }

    /// Each part of the remainder of t by itself: no polynomial of degree 3 makes more of it than its bound.
    #[test]
    fn no_part_of_a_traction_is_above_its_bound() {
        let mesh = moved(&Scene::find("one-zone").unwrap(), 2, 7);
        for cell in 0..mesh.cell_count() {
            let (simplex, geometry) = (Simplex::new(&mesh, cell), mesh.geometry(cell));
            for local in 0..3 {
                let ends = [(local + 1) % 3, (local + 2) % 3];
                let bounds = |depth: u32, flux: f64, leaf: &dyn Fn(f64) -> Leaf| {
                    patch(
                        &simplex,
                        local,
                        &ends,
                        &tree(depth, leaf),
                        Interval::at(flux),
                    )
                };
                let constant = |value: f64| Leaf {
                    values: [value; 4],
                    ..Leaf::default()
                };
                let check = |what: &str, bound: f64, least: f64| {
                    assert!(bound >= least * (1.0 - 1e-12), "{what}: {bound} {least}");
                };
                for depth in 0..=2 {
                    // The sign of a wave on leaves of 2^-depth, of mean 0 on each.
                    let parts = f64::from(2 << depth);
                    let sign = |s: f64| {
                        if (s * parts) as i32 % 2 == 0 {
                            1.0
                        } else {
                            -1.0
                        }
                    };
                    let of = bounds(depth, 1.5, &|_| Leaf {
                        wave: 0.7,
                        swell: 0.7,
                        ..constant(1.5)
                    });
                    check("waves", of.oscillation, 0.7 * reach(&geometry, ends, &sign));
                    let of = bounds(depth, 1.5, &|_| constant(1.75));
                    check("what σ·n is off", of.error, 0.25);
                    let of = bounds(depth, 1.5, &|_| Leaf {
                        error: 0.25,
                        ..constant(1.5)
                    });
                    check("what is not known", of.error, 0.25);
                }
                for depth in 1..=2 {
                    let parts = f64::from(1 << depth);
                    for values in [
                        [1.0, -1.0, 1.0, -1.0],
                        [1.0, 1.0, -1.0, -1.0],
                        [3.0, -1.0, -1.0, -1.0],
                    ] {
                        let at = |s: f64| values[(s * parts) as usize];
                        let mean = (0..1 << depth).map(|k| values[k]).sum::<f64>() / parts;
                        let least = reach(&geometry, ends, &|s| at(s) - mean);
                        let of = bounds(depth, mean, &|s| constant(at(s)));
                        check("steps", of.oscillation, least);
                        let error = |s: f64| Leaf {
                            error: 3.0 + at(s),
                            ..constant(0.0)
                        };
                        let of = bounds(depth, 0.0, &error);
                        check("steps of what is not known", of.spread, least);
                        check("their mean", of.error, 3.0 + mean);
                    }
                }
            }
        }
    }

    /// C_F² = (|F|/|κ|) C h (C h + 2ℓ/d) by the edges' lengths, and no quadratic z of mean 0 has a larger ‖z‖_F/‖∇z‖_κ.
    #[test]
    fn traces_are_bounded() {
        for (name, poincare) in [
            ("one-zone", 1.0 / 3.831_705_970_207_512_3),
            ("one-zone-3d", 1.0 / std::f64::consts::PI),
        ] {
            let mesh = moved(&Scene::find(name).unwrap(), 2, 7);
            let dim = mesh.dim;
            let inside = exact(dim, 4);
            let on_face = exact(dim - 1, 4);
            let mut random = crate::Random::new(11);
            for cell in 0..mesh.cell_count() {
                let (simplex, geometry) = (Simplex::new(&mesh, cell), mesh.geometry(cell));
                let vertices = mesh.vertices(cell);
                let distance = |i: usize, j: usize| {
                    let squares = (0..3).map(|k| (vertices[i][k] - vertices[j][k]).powi(2));
                    squares.sum::<f64>().sqrt()
                };
                let others = |local: usize| (0..=dim).filter(move |&i| i != local);
                for local in 0..=dim {
                    let measure = geometry.face_measure(local);
                    let longest = others(local)
                        .map(|i| distance(local, i))
                        .fold(0.0, f64::max);
                    let known = poincare * geometry.diameter;
                    let square =
                        measure / geometry.measure() * known * (known + 2.0 * longest / dim as f64);
                    let bound = trace(&simplex, local);
                    assert!(
                        (bound.mid() / square.sqrt() - 1.0).abs() < 1e-12,
                        "{name} {cell} {local}"
                    );
                    for _ in 0..20 {
                        let c: [f64; 9] = std::array::from_fn(|_| random.next() - 0.5);
                        let z = |x: [f64; 3]| {
                            c[0] * x[0]
                                + c[1] * x[1]
                                + c[2] * x[2]
                                + c[3] * x[0] * x[0]
                                + c[4] * x[1] * x[1]
                                + c[5] * x[2] * x[2]
                                + c[6] * x[0] * x[1]
                                + c[7] * x[1] * x[2]
                                + c[8] * x[2] * x[0]
                        };
                        let slope = |x: [f64; 3]| {
                            let of = [
                                c[0] + 2.0 * c[3] * x[0] + c[6] * x[1] + c[8] * x[2],
                                c[1] + 2.0 * c[4] * x[1] + c[6] * x[0] + c[7] * x[2],
                                c[2] + 2.0 * c[5] * x[2] + c[7] * x[1] + c[8] * x[0],
                            ];
                            of[..dim].iter().map(|d| d * d).sum::<f64>()
                        };
                        let mean: f64 = inside
                            .iter()
                            .map(|(at, w)| w * z(geometry.point(&at)))
                            .sum();
                        let slopes: f64 = inside
                            .iter()
                            .map(|(at, w)| w * slope(geometry.point(&at)))
                            .sum();
                        let of_trace: f64 = on_face
                            .iter()
                            .map(|(at, w)| {
                                let mut lambda = [0.0; 4];
                                others(local)
                                    .zip(at)
                                    .for_each(|(i, value)| lambda[i] = value);
                                w * (z(geometry.point(&lambda)) - mean).powi(2)
                            })
                            .sum();
                        let (left, right) = (measure * of_trace, geometry.measure() * slopes);
                        assert!(
                            left <= bound.high.powi(2) * right,
                            "{name} {cell} {local}: {left} {right}"
                        );
                    }
                }
            }
        }
    }
}
