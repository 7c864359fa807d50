//! The remainder of f on a cell after σ has taken its moments: explicit fluxes for what has mean 0 on the cell.
//!
//! Let r be f + div σ on a cell κ whose tree was cut. Its mean m on κ, and the part that the tree does not know, go to
//! the majorant flux. Constants on leaves that have mean 0 on κ are the divergence of an explicit flux τ without normal
//! trace on ∂κ. In a simplex T cut at the share t of its edge ab, with δ and ε the means on its parts relative to T's,
//! t δ + (1-t) ε = 0,
//!
//! ```text
//! τ = -δ (x-a)/d in the part at a,   -ε (x-b)/d in that at b
//! ```
//!
//! has no flux through ∂T, where x-a or x-b is a tangent, and the flux t δ |T| into the part at a, the same all over what
//! both have in common. Summed over all levels -div τ is r's constants, and τ is added to σ: no Poincaré inequality, and a
//! peak of width w in a cell of size h costs (log h/w)^½ where that would cost h/w. What is linear on a leaf with mean 0,
//! Σ a_i λ_i, is -div of
//!
//! ```text
//! Σ_{i<j} (a_j - a_i)/(d+1) λ_i λ_j (x_j - x_i)
//! ```
//!
//! there, as div(λ_i λ_j (x_i - x_j)) = λ_j - λ_i, without a normal trace on its boundary. The wave s of the model is bounded by
//! Poincaré's inequality on the leaf. Where that inequality on all of κ is good enough there is no τ.

use super::carried::Carried;
use super::quadratic::{Linear, Quadratic};
use super::simplex::{Simplex, length, mean_square_of_linear, norm, root_of_product, up};
use super::tree::Tree;
use crate::interval::{Interval, above_of_all, above_of_product};
use crate::quadrature::{Piece, WHOLE};

/// Coefficients of a vector Σ b_i x_i, Σ b_i = 0, of the cell's vertices x_i.
pub(super) type Coefficients = [Interval; 4];

/// ‖w - w̄‖_κ ≤ C h_κ ‖∇w‖_κ: C = 1/π on convex cells (L. E. Payne, H. F. Weinberger, Arch. Rational Mech.
/// Anal. 5, 1960), 1/j₁₁ on triangles (R. S. Laugesen, B. A. Siudeja, J. Differential Equations 249, 2010).
/// j₁₁ = 3.8317059702075123…, the first positive zero of the Bessel function J₁.
pub(super) fn poincare(dim: usize) -> Interval {
    if dim == 2 {
        Interval::new(3.831_705_970_207_512, 3.831_705_970_207_513).recip()
    } else {
        Interval::PI.recip()
    }
}

/// The remainder of f on one cell.
#[derive(Debug, Clone, Default)]
pub(super) struct Balance {
    /// |(left, w)| ≤ oscillation ‖∇w‖_κ for what is known and not in τ.
    pub oscillation: f64,
    /// ē: the mean over κ of what bounds the unknown.
    pub error: f64,
    /// |(e - ē, |w|)| ≤ spread ‖∇w‖_κ
    pub spread: f64,
    /// τ by leaves; empty if there is none.
    pub tau: Vec<Tau>,
    /// ‖τ‖_κ, of what the tree carries where there is no other.
    pub norm: f64,
    /// Of what the tree carries.
    pub carried: Option<Carried>,
}

/// τ on a leaf.
#[derive(Debug, Clone)]
pub(super) struct Tau {
    pub piece: Piece,
    pub share: f64,
    /// The linear part, at the corners …
    corners: [Coefficients; 4],
    /// … and the a_i of the rest, which is 0 there.
    slopes: [f64; 4],
}

impl Tau {
    /// The field on the leaf.
    pub fn field<const D: usize>(&self, cell: &Simplex) -> Quadratic<D> {
        let corners = self.corners.map(|b| cell.vector(&b));
        let mut field = Quadratic::of(&Linear::new(&corners));
        field.add_bubble(cell.dim, &self.slopes, |i, j| {
            let [from, to] = [i, j].map(|corner| self.piece[corner].map(Interval::at));
            cell.vector(&std::array::from_fn(|k| to[k] - from[k]))
        });
        field
    }

    /// The mean of |τ|² over the leaf.
    fn mean_square(&self, cell: &Simplex) -> Interval {
        match cell.dim {
            2 => self.field::<2>(cell).mean_square(2),
            dim => self.field::<3>(cell).mean_square(dim),
        }
    }
}

/// The balance of a cell: the tree of f, and f + div σ at a leaf's corners from p there.
pub(super) fn balance(
    cell: &Simplex,
    tree: &Tree,
    enough: f64,
    left: impl Fn(&[f64; 4], f64) -> Interval,
) -> Balance {
    let (dim, count) = (cell.dim, cell.dim + 1);
    let scale = poincare(dim) * Interval::at(cell.diameter);
    let measure = cell.measure.high;
    if !tree.is_cut() {
        let leaf = &tree.whole;
        let most = (0..count).map(|j| left(&WHOLE[j], leaf.values[j]).magnitude());
        let of_cell = wave(scale.high, measure, leaf.swell);
        let mut found = Balance {
            oscillation: of_cell,
            error: up(leaf.unknown(), most.fold(0.0, f64::max)),
            spread: wave(scale.high, measure, Interval::at(leaf.spots[1]).root().high),
            ..Balance::default()
        };
        if let Some(carried) = tree.carried.as_deref() {
            let norm = wave(1.0, measure, carried.square.root().high);
            if norm < of_cell {
                found.oscillation = 0.0;
                (found.norm, found.carried) = (norm, Some(*carried));
            }
        }
        return found;
    }
    let nodes = 1 + tree.rest.len();
    let mut found = Leaves {
        cell,
        tree,
        left,
        means: vec![Interval::ZERO; nodes],
        errors: vec![0.0; nodes],
        away: Vec::new(),
        plain: Vec::new(),
    };
    found.look(0, &WHOLE, 1.0);
    let Leaves {
        means: exact,
        mut errors,
        away: of_leaves,
        plain,
        ..
    } = found;
    let means = tree.averages(exact.iter().map(|m| m.mid()).collect());
    let known = means[0];
    // Poincaré's inequality on the whole cell, or on the leaves after τ.
    let away = plain.iter().map(|(share, values)| {
        let off: Vec<Interval> = values[..count]
            .iter()
            .map(|r| *r - Interval::at(known))
            .collect();
        above_of_product(*share, mean_square_of_linear(&off).high)
    });
    let of_cell = above_of_product(scale.high, root_of_product(measure, above_of_all(away)));
    // With the constants of `means` and what is linear on leaves, in their order.
    let of_means =
        |means: &[f64], slopes: &[[f64; 4]], missing: &mut dyn FnMut(usize, u32, Interval)| {
            let mut tau = Vec::new();
            let mut flux = Flux {
                tree,
                dim,
                means,
                leaves: &mut |node: u32,
                              piece: &Piece,
                              share: f64,
                              corners: [Coefficients; 4],
                              represented: Interval| {
                    missing(tau.len(), node, Interval::at(means[0]) + represented);
                    tau.push(Tau {
                        piece: *piece,
                        share,
                        corners,
                        slopes: slopes.get(tau.len()).copied().unwrap_or_default(),
                    });
                },
            };
            flux.below(0, &WHOLE, 1.0, [[Interval::ZERO; 4]; 4], Interval::ZERO);
            let squares = tau
                .iter()
                .map(|on: &Tau| above_of_product(on.share, on.mean_square(cell).high));
            let norm = root_of_product(measure, above_of_all(squares));
            (tau, norm)
        };
    let (mut known_part, mut tau, mut norm) = (of_cell, Vec::new(), 0.0);
    // What rounding leaves of the mean.
    let off = |node: u32| exact[node as usize] - Interval::at(known);
    let mut rounding = tree.mean(off).magnitude();
    if of_cell > enough {
        let own = errors.clone();
        let slopes = plain.iter().map(|(_, values)| slopes(&values[..count]));
        let slopes: Vec<[f64; 4]> = slopes.collect();
        let (with, of_tau) = of_means(&means, &slopes, &mut |leaf, node, represented| {
            // What rounding leaves between r and the divergence of τ, which is linear.
            let (values, slopes) = (&plain[leaf].1, slopes[leaf].map(Interval::at));
            let mean =
                slopes[..count].iter().copied().sum::<Interval>() / Interval::at(count as f64);
            let off = (0..count).map(|i| values[i] - represented - (slopes[i] - mean));
            let most = off.map(Interval::magnitude).fold(0.0, f64::max);
            errors[node as usize] = up(errors[node as usize], most);
        });
        if of_tau < of_cell {
            (known_part, tau, norm) = (0.0, with, of_tau);
            rounding = 0.0;
        } else {
            errors = own;
        }
    }
    let of_leaves = |mean_square: fn(&Away) -> f64| {
        let leaves = of_leaves.iter();
        length(leaves.map(|l| above_of_product(l.scale, root_of_product(measure, mean_square(l)))))
    };

    // The unknown: the same flux for e - ē, or Poincaré's inequality.
    let bounds = tree.averages(errors.clone());
    let mut away = Vec::new();
    tree.for_each(&mut |node, _, share| {
        let off = Interval::at(errors[node as usize]) - Interval::at(bounds[0]);
        away.push(above_of_product(share, off.square().high));
    });
    let mut spread = above_of_product(scale.high, root_of_product(measure, above_of_all(away)));
    let of_errors = |node: u32| Interval::at(errors[node as usize]) - Interval::at(bounds[0]);
    let mut off = tree.mean(of_errors).magnitude();
    if spread > enough {
        let (_, norm) = of_means(&bounds, &[], &mut |_, node, represented| {
            let missing = Interval::at(errors[node as usize]) - represented;
            off = off.max(missing.magnitude());
        });
        spread = spread.min(norm);
    }
    Balance {
        oscillation: up(known_part, of_leaves(|l| l.wave)),
        error: up(up(bounds[0], off), up(known.abs(), rounding)),
        spread: up(spread, of_leaves(|l| l.spots)),
        tau,
        norm,
        carried: None,
    }
}

fn wave(scale: f64, measure: f64, wave: f64) -> f64 {
    if wave == 0.0 {
        return 0.0;
    }
    let size = Interval::at(measure).root() * Interval::at(wave);
    (Interval::at(scale) * size).high
}

/// About r less its mean at the corners.
fn slopes(values: &[Interval]) -> [f64; 4] {
    let mean = values.iter().map(|r| r.mid()).sum::<f64>() / values.len() as f64;
    let mut slopes = [0.0; 4];
    for (slope, r) in slopes.iter_mut().zip(values) {
        *slope = r.mid() - mean;
    }
    slopes
}

/// The part that Poincaré's inequality bounds on one leaf.
struct Away {
    /// C h_S
    scale: f64,
    /// Share times the mean square of the wave.
    wave: f64,
    /// … and of what is not known on spots.
    spots: f64,
}

/// r on the leaves.
struct Leaves<'a, L> {
    cell: &'a Simplex,
    tree: &'a Tree,
    left: L,
    means: Vec<Interval>,
    errors: Vec<f64>,
    away: Vec<Away>,
    /// Share and values at the corners.
    plain: Vec<(f64, [Interval; 4])>,
}

impl<L: Fn(&[f64; 4], f64) -> Interval> Leaves<'_, L> {
    fn look(&mut self, node: u32, piece: &Piece, share: f64) {
        let dim = self.cell.dim;
        let count = dim + 1;
        if let Some(indices) = self.tree.below_of(node) {
            for (index, (part, of_node)) in indices.iter().zip(self.tree.parts_of(node, piece)) {
                self.look(*index, &part, share * of_node);
            }
            return;
        }
        let leaf = *self.tree.leaf(node);
        let mut values = [Interval::ZERO; 4];
        for j in 0..count {
            values[j] = (self.left)(&piece[j], leaf.values[j]);
        }
        let mean = values[..count].iter().copied().sum::<Interval>() / Interval::at(count as f64);
        self.means[node as usize] = mean;
        self.errors[node as usize] = leaf.unknown();
        self.away.push(Away {
            scale: (poincare(dim) * Interval::at(diameter(self.cell, piece))).high,
            wave: above_of_product(share, Interval::at(leaf.swell).square().high),
            spots: above_of_product(share, leaf.spots[1]),
        });
        self.plain.push((share, values));
    }
}

/// The longest edge of a part of a cell, or more.
fn diameter(cell: &Simplex, piece: &Piece) -> f64 {
    let mut longest = 0.0_f64;
    for i in 0..=cell.dim {
        for j in 0..i {
            let edge =
                std::array::from_fn(|k| Interval::at(piece[i][k]) - Interval::at(piece[j][k]));
            longest = longest.max(norm(&cell.vector(&edge), cell.dim).high);
        }
    }
    longest
}

/// τ from the means of all nodes, level by level.
struct Flux<'a, F> {
    tree: &'a Tree,
    dim: usize,
    means: &'a [f64],
    /// Gets each leaf: where it is, its share, τ at its corners, and -div τ there.
    leaves: &'a mut F,
}

impl<F: FnMut(u32, &Piece, f64, [Coefficients; 4], Interval)> Flux<'_, F> {
    /// `at` and `represented` are τ and its divergence so far.
    fn below(
        &mut self,
        node: u32,
        piece: &Piece,
        share: f64,
        at: [Coefficients; 4],
        represented: Interval,
    ) {
        let Some(indices) = self.tree.below_of(node) else {
            return (self.leaves)(node, piece, share, at, represented);
        };
        let [a, b] = self.tree.edge(node);
        let both = self.tree.parts_of(node, piece);
        let [first, second] = both.map(|(_, share)| share);
        let point = std::array::from_fn(|k| second * at[a][k] + first * at[b][k]);
        // One number δ, and ε from it, or the fluxes through their common face would differ.
        let delta = Interval::at(self.means[indices[0] as usize] - self.means[node as usize]);
        let epsilon = -(first * delta) / Interval::at(second);
        let of_parts = [(a, b, delta), (b, a, epsilon)];
        let both = indices.into_iter().zip(both);
        for ((index, (half, of_node)), (corner, new, delta)) in both.zip(of_parts) {
            let mut inside = at;
            inside[new] = point;
            let weight = -delta / Interval::at(self.dim as f64);
            for (value, x) in inside.iter_mut().zip(&half).take(self.dim + 1) {
                for (k, b) in value.iter_mut().enumerate().take(self.dim + 1) {
                    *b += weight * (Interval::at(x[k]) - Interval::at(half[corner][k]));
                }
            }
            self.below(index, &half, share * of_node, inside, represented + delta);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::model::{Domain, Effort};
    use super::super::tree::Leaf;
    use super::*;
    use crate::quadrature::exact;
    use crate::scene::{Expression, Scene};
    use faceoff_mesh::mesh::Triangulation;
    use faceoff_mesh::mesh::generate::union_jack;

    /// Calls `check` for the cells of a scene with n = 2 on which f has a flux τ: how many these are.
    fn each_with_tau(
        scene: &str,
        f: &str,
        mut check: impl FnMut(&Triangulation, usize, &Tree, &Balance),
    ) -> usize {
        let mesh = Scene::find(scene).unwrap().triangulation(Some(2)).unwrap();
        let f = Expression::parse(f).unwrap();
        let domain = Domain {
            expression: &f,
            vertices: Box::new(|cell| mesh.vertices(cell)),
            measures: vec![1.0; mesh.cell_count()],
            dim: mesh.dim,
            space: mesh.dim,
            unit: 0,
        };
        let effort = Effort {
            tolerance: 1e-3,
            budget: 60 * mesh.cell_count(),
        };
        let mut count = 0;
        for (cell, tree) in domain.enclose(&effort).unwrap().iter().enumerate() {
            let simplex = Simplex::new(&mesh, cell);
            let found = balance(&simplex, tree, 0.0, |_, value| Interval::at(value));
            if !found.tau.is_empty() {
                count += 1;
                check(&mesh, cell, tree, &found);
            }
        }
        count
    }

    /// Half of the unit square cut in the middle of its longest edge, by what its halves have.
    fn two_halves(leaves: [Leaf; 2]) -> Balance {
        let mesh = Triangulation::new("square", &union_jack(1, [1.0, 1.0])).unwrap();
        let [a, b, c, _] = mesh.vertices(0);
        let is_longest = |(x, y): ([f64; 3], [f64; 3])| x[0] != y[0] && x[1] != y[1];
        let edges = [((a, b), [0, 1]), ((a, c), [0, 2]), ((b, c), [1, 2])];
        let longest = edges.into_iter().find(|(ends, _)| is_longest(*ends));
        let tree = Tree {
            whole: Leaf {
                edge: longest.unwrap().1,
                at: 0.5,
                parts: 1,
                ..Leaf::default()
            },
            rest: leaves.to_vec(),
            ..Tree::default()
        };
        let simplex = Simplex::new(&mesh, 0);
        balance(&simplex, &tree, 0.0, |_, value| Interval::at(value))
    }

    /// (τ, ∇φ) = (r - r̄, φ) for polynomials φ: -div τ is r less its mean, there is no jump of τ·n inside and none of it on ∂κ.
    #[test]
    fn tau_has_the_divergence_of_the_leaves_and_no_normal_trace() {
        for (scene, f) in [
            (
                "one-zone",
                "if(x + 2*y < 0.8, 1 + 3*x, if(x < 0.2, -3*y, 5 - y))",
            ),
            (
                "one-zone-3d",
                "if(x + 2*y - z < 0.1, 1 + 3*x, if(x < 0.2, -3*y, 5 - z))",
            ),
        ] {
            let cut = each_with_tau(scene, f, |mesh, cell, tree, found| {
                let (dim, simplex) = (mesh.dim, Simplex::new(mesh, cell));
                let rule = exact(dim, 5);
                let p = |node: u32| &tree.leaf(node).values[..=dim];
                let of_leaf = |node: u32| p(node).iter().sum::<f64>() / (dim + 1) as f64;
                let mean = tree.mean(|node| Interval::at(of_leaf(node))).mid();
                let mut leaves = Vec::new();
                tree.for_each(&mut |node, _, _| leaves.push(tree.leaf(node).values));
                let geometry = mesh.geometry(cell);
                for power in [
                    [1, 0, 0],
                    [0, 1, 0],
                    [1, 1, 0],
                    [2, 1, 0],
                    [0, 1, 2],
                    [3, 0, 0],
                ] {
                    if power[dim..].iter().any(|p| *p > 0) {
                        continue;
                    }
                    let phi = |x: [f64; 3]| (0..3).map(|k| x[k].powi(power[k])).product::<f64>();
                    let slope = |x: [f64; 3], k: usize| match power[k] {
                        0 => 0.0,
                        p => {
                            f64::from(p) * x[k].powi(p - 1) * {
                                let others = (0..3).filter(|j| *j != k);
                                others.map(|j| x[j].powi(power[j])).product::<f64>()
                            }
                        }
                    };
                    let mut sums = [0.0; 2];
                    for (tau, values) in found.tau.iter().zip(&leaves) {
                        let field = tau.field::<3>(&simplex);
                        for (inner, weight) in rule.iter() {
                            let inside = |i: usize| -> f64 {
                                (0..=dim).map(|k| inner[k] * tau.piece[k][i]).sum()
                            };
                            let x = geometry.point(&std::array::from_fn(inside));
                            let here = field.at(&inner, dim);
                            let along = (0..dim).map(|k| here[k] * slope(x, k));
                            let r: f64 = (0..=dim).map(|k| inner[k] * values[k]).sum();
                            sums[0] += tau.share * weight * along.sum::<f64>();
                            sums[1] += tau.share * weight * (r - mean) * phi(x);
                        }
                    }
                    let [left, right] = sums;
                    assert!(
                        (left - right).abs() < 1e-13,
                        "{scene} {cell} {power:?}: {sums:?}"
                    );
                }
            });
            assert!(cut >= 2, "{scene}: {cut}");
        }
    }

    /// f64 has no 1e15 + 2⁻⁴: what the divergence of τ is off by is charged as unknown.
    #[test]
    fn what_rounding_leaves_beside_tau_is_charged() {
        let of = |value: f64| Leaf {
            values: [value, value, value, 0.0],
            ..Leaf::default()
        };
        let found = two_halves([of(1e15 + 0.125), of(-1e15)]);
        assert!(!found.tau.is_empty());
        // -div τ is 1e15 and -1e15 on the halves: 0.125 is left of r on the first.
        assert!(found.error >= 0.125, "{found:?}");
    }

    /// With τ, waves cost their size by the lengths of leaves: ‖s‖ h_S/j₁₁.
    #[test]
    fn waves_on_leaves_are_charged() {
        let of = |value: f64| Leaf {
            values: [value, value, value, 0.0],
            wave: 0.9,
            swell: 0.7,
            ..Leaf::default()
        };
        let found = two_halves([of(1.0), of(-1.0)]);
        assert!(!found.tau.is_empty());
        let expected = 0.7 * 0.5_f64.sqrt() / 3.831_705_970_207_512_3;
        let ratio = found.oscillation / expected;
        assert!((1.0..1.0 + 1e-12).contains(&ratio), "{ratio}");
    }

    /// What is not known on spots is in the mean of the unknown, and its mean square by the lengths of leaves: ‖r‖ h_S/j₁₁.
    #[test]
    fn spots_on_leaves_are_charged() {
        let of = |value: f64| Leaf {
            values: [value, value, value, 0.0],
            error: 0.25,
            spots: [0.5, 0.9],
            peak: 2.0,
            ..Leaf::default()
        };
        let found = two_halves([of(1.0), of(-1.0)]);
        assert!(found.error >= 0.75 && found.error < 0.751, "{found:?}");
        let expected = 0.9_f64.sqrt() * 0.5_f64.sqrt() / 3.831_705_970_207_512_3;
        let ratio = found.spread / expected;
        assert!((1.0..1.0 + 1e-12).contains(&ratio), "{ratio}");
    }

    /// f64 has no difference of 1e15 + 2⁻⁴ and its mean on a leaf either: what τ's linear divergence is off by is charged.
    #[test]
    fn what_rounding_leaves_beside_slopes_is_charged() {
        let values = [1e15 + 0.125, -1e15, 3.0, 0.0];
        let of = |sign: f64| Leaf {
            values: values.map(|v| sign * v),
            ..Leaf::default()
        };
        let found = two_halves([of(1.0), of(-1.0)]);
        assert!(
            !found.tau.is_empty() && found.error >= 0.125 / 3.0,
            "{found:?}"
        );
    }

    /// (e - ē, w) for e = 1 and 3 on the halves and w = 1 + λ_b - λ_a, ab the longest edge, is 1/6, and ‖∇w‖ is 1.
    #[test]
    fn what_is_off_the_mean_of_the_unknown_is_charged() {
        let of = |error: f64| Leaf {
            error,
            ..Leaf::default()
        };
        let found = two_halves([of(1.0), of(3.0)]);
        assert!((2.0..2.0 + 1e-12).contains(&found.error), "{found:?}");
        assert!((1.0 / 6.0..0.21).contains(&found.spread), "{found:?}");
    }
}
