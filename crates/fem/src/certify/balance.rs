//! What is left of f on a cell once σ has taken its moments: explicit fluxes for what has mean 0 on the cell.
//!
//! Let r be f + div σ on a cell κ whose tree was cut. Its mean m on κ, and the part that the tree does not know, go to
//! the majorant flux. Constants on leaves that have mean 0 on κ are the divergence of an explicit flux τ without normal
//! trace on ∂κ. In a simplex T cut in 2^d with d_j the mean on child j relative to T's (their sum is 0):
//!
//! ```text
//! τ = -d_j (x-x_j)/d     in the child at the vertex x_j
//! ```
//!
//! has no flux through ∂T, and the flux d_j |child| (the same on all of it) into the middle. In 2D the middle is one
//! triangle with vertices m_j opposite x_j, and τ = Σ d_j (x-m_j)/2 there. In 3D it is a ring of four tetrahedra around
//! a diagonal; each has one face in common with a corner's child, and what goes round the ring is chosen with mean 0.
//! Summed over all levels -div τ is r's constants, and τ is added to σ: no Poincaré inequality, and a peak of width ε in a
//! cell of size h costs (log h/ε)^½ where that would cost h/ε. What is linear on a leaf with mean 0, and the wave s of the
//! model, are bounded by Poincaré's inequality on the leaf. Where that inequality on all of κ is good enough there is no τ.

use super::model::Tree;
use super::simplex::{Simplex, Vector, length, mean_square_of_linear, norm, root_of_product, up};
use crate::interval::{Interval, above_of_all, above_of_product};
use crate::quadrature::{Piece, WHOLE, parts};

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

/// What is left of f on one cell.
#[derive(Debug, Clone, Default)]
pub(super) struct Balance {
    /// |(left, w)| ≤ oscillation ‖∇w‖_κ for what is known and not in τ.
    pub oscillation: f64,
    /// ē: the mean over κ of what bounds the unknown.
    pub error: f64,
    /// |(e - ē, |w|)| ≤ spread ‖∇w‖_κ
    pub spread: f64,
    /// τ by its values at the corners of each leaf; empty where it is none.
    pub tau: Vec<(Piece, f64, [Coefficients; 4])>,
    /// ‖τ‖_κ
    pub norm: f64,
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
        return Balance {
            oscillation: wave(scale.high, measure, leaf.swell),
            error: up(leaf.error, most.fold(0.0, f64::max)),
            ..Balance::default()
        };
    }
    let nodes = 1 + tree.rest.len();
    let mut found = Leaves {
        cell,
        tree,
        left,
        means: vec![Interval::ZERO; nodes],
        errors: vec![0.0; nodes],
        linear: Vec::new(),
        plain: Vec::new(),
    };
    found.look(0, &WHOLE, 1.0);
    let Leaves {
        means: exact,
        mut errors,
        linear,
        plain,
        ..
    } = found;
    let means = averages(tree, dim, exact.iter().map(|m| m.mid()).collect());
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
    let of_means = |means: &[f64], missing: &mut dyn FnMut(u32, Interval)| {
        let mut tau = Vec::new();
        let mut flux = Flux {
            tree,
            dim,
            means,
            leaves: &mut |node: u32,
                          piece: &Piece,
                          share: f64,
                          at: [Coefficients; 4],
                          represented: Interval| {
                missing(node, Interval::at(means[0]) + represented);
                tau.push((*piece, share, at));
            },
        };
        flux.below(0, &WHOLE, 1.0, [[Interval::ZERO; 4]; 4], Interval::ZERO);
        let squares = tau
            .iter()
            .map(|(_, share, at)| above_of_product(*share, mean_square(cell, at).high));
        let norm = root_of_product(measure, above_of_all(squares));
        (tau, norm)
    };
    let (mut known_part, mut tau, mut norm) = (of_cell, Vec::new(), 0.0);
    // What rounding leaves of the mean.
    let mut rounding = mean_of(tree, dim, |node| exact[node as usize] - Interval::at(known));
    if of_cell > enough {
        let own = errors.clone();
        let (with, of_tau) = of_means(&means, &mut |node, represented| {
            // What rounding leaves between the leaf's mean and the divergence of τ.
            let off = exact[node as usize] - represented;
            errors[node as usize] = up(errors[node as usize], off.magnitude());
        });
        let of_leaves = length(
            linear
                .iter()
                .map(|leaf| above_of_product(leaf.scale, root_of_product(measure, leaf.square))),
        );
        if up(of_tau, of_leaves) < of_cell {
            (known_part, tau, norm) = (of_leaves, with, of_tau);
            rounding = 0.0;
        } else {
            errors = own;
        }
    }
    let waves = length(
        linear
            .iter()
            .map(|l| above_of_product(l.scale, root_of_product(measure, l.wave))),
    );

    // The unknown: the same flux for e - ē, or Poincaré's inequality.
    let bounds = averages(tree, dim, errors.clone());
    let mut away = Vec::new();
    tree.for_each(dim, &mut |node, _, share| {
        let off = Interval::at(errors[node as usize]) - Interval::at(bounds[0]);
        away.push(above_of_product(share, off.square().high));
    });
    let mut spread = above_of_product(scale.high, root_of_product(measure, above_of_all(away)));
    let of_errors = |node: u32| Interval::at(errors[node as usize]) - Interval::at(bounds[0]);
    let mut off = mean_of(tree, dim, of_errors);
    if spread > enough {
        let (_, norm) = of_means(&bounds, &mut |node, represented| {
            let missing = Interval::at(errors[node as usize]) - represented;
            off = off.max(missing.magnitude());
        });
        spread = spread.min(norm);
    }
    Balance {
        oscillation: up(known_part, waves),
        error: up(up(bounds[0], off), up(known.abs(), rounding)),
        spread,
        tau,
        norm,
    }
}

/// The size of the mean of what is known of each leaf.
fn mean_of(tree: &Tree, dim: usize, of: impl Fn(u32) -> Interval) -> f64 {
    let mut sum = Interval::ZERO;
    tree.for_each(dim, &mut |node, _, share| sum += share * of(node));
    sum.magnitude()
}

fn wave(scale: f64, measure: f64, wave: f64) -> f64 {
    if wave == 0.0 {
        return 0.0;
    }
    let size = Interval::at(measure).root() * Interval::at(wave);
    (Interval::at(scale) * size).high
}

/// The mean of |τ|² over a leaf, of its values at the corners.
fn mean_square(cell: &Simplex, at: &[Coefficients; 4]) -> Interval {
    let corners: Vec<Vector> = at[..=cell.dim].iter().map(|b| cell.vector(b)).collect();
    (0..cell.dim)
        .map(|k| mean_square_of_linear(&corners.iter().map(|c| c[k]).collect::<Vec<_>>()))
        .sum()
}

/// Means of all nodes from those of the leaves.
fn averages(tree: &Tree, dim: usize, mut means: Vec<f64>) -> Vec<f64> {
    // The parts of a node stand behind it.
    for node in (0..means.len()).rev() {
        if let Some(parts) = tree.parts_of(node as u32, dim) {
            let all: f64 = parts.map(|part| means[part as usize]).sum();
            means[node] = all / (1 << dim) as f64;
        }
    }
    means
}

/// The linear part of r on one leaf.
struct Linear {
    /// C h_S
    scale: f64,
    /// Share times the mean square of r less its mean.
    square: f64,
    /// Share times the mean square of the wave.
    wave: f64,
}

/// r on the leaves.
struct Leaves<'a, L> {
    cell: &'a Simplex,
    tree: &'a Tree,
    left: L,
    means: Vec<Interval>,
    errors: Vec<f64>,
    linear: Vec<Linear>,
    /// Share and values at the corners.
    plain: Vec<(f64, [Interval; 4])>,
}

impl<L: Fn(&[f64; 4], f64) -> Interval> Leaves<'_, L> {
    fn look(&mut self, node: u32, piece: &Piece, share: f64) {
        let dim = self.cell.dim;
        let count = dim + 1;
        if let Some(indices) = self.tree.parts_of(node, dim) {
            let share = share / (1 << dim) as f64;
            for (index, part) in indices.zip(parts(piece, dim)) {
                self.look(index, &part, share);
            }
            return;
        }
        let leaf = *self.tree.leaf(node);
        let mut values = [Interval::ZERO; 4];
        for j in 0..count {
            values[j] = (self.left)(&piece[j], leaf.values[j]);
        }
        let mean = values[..count].iter().copied().sum::<Interval>() / Interval::at(count as f64);
        let off: Vec<Interval> = values[..count].iter().map(|r| *r - mean).collect();
        self.means[node as usize] = mean;
        self.errors[node as usize] = leaf.error;
        self.linear.push(Linear {
            scale: (poincare(dim) * Interval::at(diameter(self.cell, piece))).high,
            square: above_of_product(share, mean_square_of_linear(&off).high),
            wave: above_of_product(share, Interval::at(leaf.swell).square().high),
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
        let Some(indices) = self.tree.parts_of(node, self.dim) else {
            return (self.leaves)(node, piece, share, at, represented);
        };
        let dim = self.dim;
        let indices: Vec<u32> = indices.collect();
        let own = self.means[node as usize];
        let d: Vec<f64> = indices
            .iter()
            .map(|&k| self.means[k as usize] - own)
            .collect();
        let share = share / (1 << dim) as f64;
        for (k, part) in parts(piece, dim).iter().enumerate() {
            // (x-x_i)/dim times these, i the corners of the part, is what this level adds.
            let own = own_fluxes(dim, k, &d);
            let mut inside = [[Interval::ZERO; 4]; 4];
            for (j, value) in inside.iter_mut().enumerate().take(dim + 1) {
                *value = interpolated(&at, piece, &part[j], dim);
                for (i, flux) in own.iter().enumerate().take(dim + 1) {
                    let weight = *flux / Interval::at(dim as f64);
                    for (c, b) in value.iter_mut().enumerate().take(dim + 1) {
                        *b += weight * (Interval::at(part[j][c]) - Interval::at(part[i][c]));
                    }
                }
            }
            let divergence: Interval = own.iter().copied().sum();
            let represented = represented - divergence;
            self.below(indices[k], part, share, inside, represented);
        }
    }
}

/// The fluxes out of a part through its faces, over its measure, by the corner opposite: for the means d of all parts.
fn own_fluxes(dim: usize, part: usize, d: &[f64]) -> [Interval; 4] {
    let at = Interval::at;
    let mut fluxes = [Interval::ZERO; 4];
    if part <= dim {
        // The corner itself is the one opposite the only face that is inside.
        fluxes[part] = -at(d[part]);
        return fluxes;
    }
    if dim == 2 {
        // [ab, bc, ac]: opposite ab is the child at c, opposite bc that at a, opposite ac that at b.
        return [at(d[2]), at(d[0]), at(d[1]), Interval::ZERO];
    }
    // The ring: parts 4 (child a), 5 (b), 7 (c), 6 (d), each with the next one through a face with the diagonal ac-bd.
    let s = [d[4] + d[0], d[5] + d[1], d[7] + d[2], d[6] + d[3]];
    // g_k - g_{k-1} = -s_k, with mean 0.
    let mut g = [0.0; 4];
    for k in 1..4 {
        g[k] = g[k - 1] - s[k];
    }
    let mean = 0.25 * g.iter().sum::<f64>();
    let g = g.map(|g| g - mean);
    // g[0]: 4 → 5 by ab, g[1]: 5 → 7 by bc, g[2]: 7 → 6 by cd, g[3]: 6 → 4 by ad.
    match part {
        // [ab, ac, ad, bd]: opposite bd is child a; opposite ad the face with ab; opposite ab that with ad.
        4 => [-at(g[3]), Interval::ZERO, at(g[0]), at(d[0])],
        // [ab, ac, bd, bc]: opposite ac is child b; opposite bc the face with ab; opposite ab that with bc.
        5 => [at(g[1]), at(d[1]), Interval::ZERO, -at(g[0])],
        // [ac, ad, bd, cd]: opposite ac is child d; opposite cd the face with ad; opposite ad that with cd.
        6 => [at(d[3]), -at(g[2]), Interval::ZERO, at(g[3])],
        // [ac, bc, cd, bd]: opposite bd is child c; opposite cd the face with bc; opposite bc that with cd.
        _ => [Interval::ZERO, at(g[2]), -at(g[1]), at(d[2])],
    }
}

/// A linear function of given values at a piece's corners, at a point inside, both in the cell's coordinates.
fn interpolated(
    at: &[Coefficients; 4],
    piece: &Piece,
    point: &[f64; 4],
    dim: usize,
) -> Coefficients {
    // The corners of a part are corners of the piece or midpoints of its edges.
    let half = |i: usize, j: usize| (0..4).all(|k| point[k] == 0.5 * (piece[i][k] + piece[j][k]));
    for i in 0..=dim {
        for j in 0..=i {
            if half(i, j) {
                return std::array::from_fn(|k| {
                    let sum = at[i][k] + at[j][k];
                    Interval::new(0.5 * sum.low, 0.5 * sum.high)
                });
            }
        }
    }
    // No part has another corner; nothing is known of one that has.
    [Interval::WHOLE; 4]
}
