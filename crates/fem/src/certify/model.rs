//! An expression on simplices, proved: on each leaf of a tree of parts it is p + s + r with p linear, s of mean 0 and
//! |s| ≤ `wave`, |r| ≤ `error` everywhere.
//!
//! p and s come from Taylor's formula about a point c of the leaf with the remainder in interval arithmetic (K. Makino,
//! M. Berz, Int. J. Pure Appl. Math. 4, 2003), of whichever order leaves least:
//!
//! ```text
//! order 2   f(x) = f(c) + ∇f(c)·(x-c) + ½ (x-c)·H(x-c),   H in the box's interval: its middle makes s, its radius r
//! order 1   f(x) = f(c) + ∇f·(x-c),                       ∇f in the box's interval
//! order 0   f(x) in the box's interval
//! ```
//!
//! Where an `if` is not decided on a leaf only order 0 is known. Leaves are cut where they cost most.

use rayon::prelude::*;

use super::simplex::{Vector, corners, up};
use crate::interval::{Interval, above_of_all, above_of_product};
use crate::quadrature::{Piece, WHOLE, parts};
use crate::scene::Expression;
use crate::scene::expression::{AXES, Order};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;

/// A leaf, or a part that was cut.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Leaf {
    /// p at the corners.
    pub values: [f64; 4],
    /// |s| is at most this, and the mean of s is 0.
    pub wave: f64,
    /// |r| is at most this.
    pub error: f64,
    /// The first of its 2^d parts among the nodes of its tree; 0 where it was not cut.
    pub parts: u32,
}

impl Leaf {
    /// The largest |p|.
    fn size(&self) -> f64 {
        self.values.iter().fold(0.0, |m: f64, v| m.max(v.abs()))
    }

    /// ∫ |r| at most; an none where r is 0.
    fn cost(&self, measure: f64) -> f64 {
        if self.error == 0.0 {
            0.0
        } else {
            measure * self.error
        }
    }
}

/// An expression on one simplex.
#[derive(Debug, Clone, Default)]
pub(super) struct Tree {
    /// The whole first.
    pub whole: Leaf,
    /// Its parts, theirs, …; empty where it was not cut.
    pub rest: Vec<Leaf>,
}

impl Tree {
    pub fn leaf(&self, index: u32) -> &Leaf {
        match index {
            0 => &self.whole,
            _ => &self.rest[index as usize - 1],
        }
    }

    fn node_mut(&mut self, index: u32) -> &mut Leaf {
        match index {
            0 => &mut self.whole,
            _ => &mut self.rest[index as usize - 1],
        }
    }

    pub fn is_cut(&self) -> bool {
        !self.rest.is_empty()
    }

    /// Calls `visit` with every leaf's number, where it is, and its share of the whole.
    pub fn for_each(&self, dim: usize, visit: &mut impl FnMut(u32, &Piece, f64)) {
        self.below(0, &WHOLE, 1.0, dim, visit);
    }

    fn below(
        &self,
        index: u32,
        piece: &Piece,
        share: f64,
        dim: usize,
        visit: &mut impl FnMut(u32, &Piece, f64),
    ) {
        let Some(indices) = self.parts_of(index, dim) else {
            return visit(index, piece, share);
        };
        let share = share / (1 << dim) as f64;
        for (index, part) in indices.zip(parts(piece, dim)) {
            self.below(index, &part, share, dim, visit);
        }
    }

    /// The parts of a node that was cut.
    pub fn parts_of(&self, index: u32, dim: usize) -> Option<impl Iterator<Item = u32>> {
        let first = self.leaf(index).parts;
        (first != 0).then(|| (0..1_u32 << dim).map(move |k| first + k))
    }
}

/// Where an expression is modelled: simplices of dimension `dim` in a space of `space` dimensions.
pub(super) struct Domain<'a> {
    pub expression: &'a Expression,
    /// Of each simplex, `dim + 1` of them.
    pub vertices: Vec<[[f64; 3]; 4]>,
    /// |S|, roughly: only what is cut first depends on it.
    pub measures: Vec<f64>,
    pub dim: usize,
    pub space: usize,
    /// Data are multiplied by 2^unit.
    pub unit: i32,
}

/// What enclosing may take.
pub(super) struct Effort {
    /// ∫ |r| wanted, relative to (∫ f²)^½.
    pub tolerance: f64,
    /// Leaves in all, beyond one a simplex.
    pub budget: usize,
}

/// A part is cut no more often than this: its corners are then exact dyadic combinations.
const DEEPEST: usize = 40;
/// Those are cut that cost at least this part of the costliest.
const COSTLY: f64 = 0.125;

impl Domain<'_> {
    /// The trees of all simplices, and whether the tolerance was met.
    ///
    /// # Errors
    /// An interruption.
    pub fn enclose(&self, effort: &Effort) -> Result<Vec<Tree>> {
        let count = self.vertices.len();
        let mut trees: Vec<Tree> = (0..count)
            .into_par_iter()
            .map(|k| {
                cancel::check()?;
                let whole = self.model(k, &WHOLE);
                Ok(Tree {
                    whole,
                    rest: Vec::new(),
                })
            })
            .collect::<Result<_>>()?;
        let squares = trees
            .iter()
            .zip(&self.measures)
            .map(|(tree, m)| m * tree.whole.size().powi(2));
        let mut square: f64 = squares.sum();
        let costs = trees.iter().zip(&self.measures);
        let total = above_of_all(costs.map(|(tree, measure)| tree.whole.cost(*measure)));
        if total <= effort.tolerance * square.sqrt() {
            return Ok(trees);
        }
        let mut left = effort.budget;
        // Leaves that still count: simplex, node, piece, depth, and ∫ |r| on it.
        let mut open: Vec<Open> = (0..count)
            .map(|simplex| {
                Open::new(
                    simplex,
                    0,
                    WHOLE,
                    0,
                    self.measures[simplex],
                    &trees[simplex].whole,
                )
            })
            .collect();
        loop {
            cancel::check()?;
            let total = above_of_all(open.iter().map(|o| o.cost));
            if total <= effort.tolerance * square.sqrt() {
                break;
            }
            let worst = open.iter().map(|o| o.cost).fold(0.0, f64::max);
            let is_costly = |o: &Open| o.cost >= COSTLY * worst && o.depth < DEEPEST;
            let (mut chosen, kept): (Vec<Open>, Vec<Open>) = open.into_iter().partition(is_costly);
            open = kept;
            let children = 1 << self.dim;
            let most = left / children;
            if most == 0 || chosen.is_empty() {
                break;
            }
            if chosen.len() > most {
                chosen.sort_by(|a, b| b.cost.total_cmp(&a.cost));
                open.extend(chosen.drain(most..));
            }
            left -= children * chosen.len();
            let made: Vec<Vec<(Piece, Leaf)>> = chosen
                .par_iter()
                .map(|o| {
                    cancel::check()?;
                    let of = |piece: Piece| (piece, self.model(o.simplex, &piece));
                    Ok(parts(&o.piece, self.dim).into_iter().map(of).collect())
                })
                .collect::<Result<_>>()?;
            for (parent, made) in chosen.iter().zip(made) {
                let tree = &mut trees[parent.simplex];
                let first = tree.rest.len() as u32 + 1;
                tree.node_mut(parent.node).parts = first;
                square -= parent.square;
                for (k, (piece, leaf)) in made.into_iter().enumerate() {
                    let measure = parent.measure / children as f64;
                    let node = first + k as u32;
                    let child = Open::new(
                        parent.simplex,
                        node,
                        piece,
                        parent.depth + 1,
                        measure,
                        &leaf,
                    );
                    square += child.square;
                    tree.rest.push(leaf);
                    open.push(child);
                }
            }
            square = square.max(0.0);
        }
        Ok(trees)
    }

    /// p, s and r on a part of a simplex.
    fn model(&self, simplex: usize, piece: &Piece) -> Leaf {
        let count = self.dim + 1;
        let corners = corners(&self.vertices[simplex][..count], piece, self.space);
        let scaled = |of: Interval| of.times_power_of_two(self.unit);
        let mut around = corners[0];
        for corner in &corners[1..count] {
            around = std::array::from_fn(|k| around[k].hull(corner[k]));
        }
        let on_box = self
            .expression
            .enclosure_inside(around, self.space, Order::Hessian, self.dim);
        let range = scaled(on_box.value);
        let flat = |error: f64| Leaf {
            values: [range.mid(); 4],
            error,
            ..Leaf::default()
        };
        // A constant, or nothing but the range is known.
        if range.radius() == 0.0 || !on_box.gradient.iter().all(|g| g.is_finite()) {
            return flat(range.radius());
        }
        let centre: [f64; 3] = std::array::from_fn(|k| {
            let sum: f64 = corners[..count].iter().map(|c| c[k].mid()).sum();
            (sum / count as f64).clamp(around[k].low, around[k].high)
        });
        let at_centre = centre.map(Interval::at);
        let taylor = self
            .expression
            .enclosure(at_centre, self.space, Order::Gradient);
        let middle = scaled(taylor.value);
        let steps: Vec<Vector> = corners[..count]
            .iter()
            .map(|c| std::array::from_fn(|k| c[k] - at_centre[k]))
            .collect();
        // |x_k - c_k| is at most this.
        let reach: [f64; 3] =
            std::array::from_fn(|k| steps.iter().map(|s| s[k].magnitude()).fold(0.0, f64::max));
        let linear = |gradient: [Interval; 3]| -> f64 {
            let terms = (0..self.space).map(|k| above_of_product(gradient[k].radius(), reach[k]));
            up(middle.radius(), above_of_all(terms))
        };
        let of_order_1 = linear(on_box.gradient.map(scaled));
        let hessian = on_box.hessian.map(scaled);
        let weights: [f64; 6] = AXES.map(|[i, j]| if i == j { 0.5 } else { 1.0 });
        let second = self.space * (self.space + 1) / 2;
        let over = |size: &dyn Fn(Interval) -> f64| -> f64 {
            above_of_all((0..second).map(|k| {
                let [i, j] = AXES[k];
                let product = above_of_product(reach[i], reach[j]);
                weights[k] * above_of_product(size(hessian[k]), product)
            }))
        };
        let mut of_order_2 = up(linear(taylor.gradient.map(scaled)), over(&|h| h.radius()));
        let mut mean = Interval::ZERO;
        let wave = over(&|h| h.mid().abs());
        if of_order_2.is_finite() && wave.is_finite() {
            // The mean of (x-c)(x-c)ᵀ: (Σ δδᵀ + (Σ δ)(Σ δ)ᵀ) / ((d+1)(d+2)) of the corners' δ.
            let all: Vector = std::array::from_fn(|k| steps.iter().map(|s| s[k]).sum());
            for k in (0..second).filter(|&k| hessian[k].mid() != 0.0) {
                let [i, j] = AXES[k];
                let products: Interval = steps.iter().map(|s| s[i] * s[j]).sum();
                let covariance = products + all[i] * all[j];
                mean += (weights[k] * hessian[k].mid()) * covariance;
            }
            mean = mean / Interval::at((count * (count + 1)) as f64);
            of_order_2 = up(of_order_2, mean.radius());
        }
        let (gradient, shift, wave, error) = if of_order_2 < of_order_1 {
            (
                taylor.gradient.map(scaled),
                mean.mid(),
                up(wave, mean.magnitude()),
                of_order_2,
            )
        } else {
            (on_box.gradient.map(scaled), 0.0, 0.0, of_order_1)
        };
        if !(error < range.radius()) {
            return flat(range.radius());
        }
        let mut leaf = Leaf {
            wave,
            error,
            ..Leaf::default()
        };
        let mut rounding = 0.0_f64;
        for (value, step) in leaf.values.iter_mut().zip(&steps) {
            let slope: Interval = (0..self.space).map(|k| gradient[k].mid() * step[k]).sum();
            let exact = Interval::at(middle.mid()) + Interval::at(shift) + slope;
            *value = exact.mid();
            rounding = rounding.max(exact.radius());
        }
        leaf.error = up(leaf.error, rounding);
        leaf
    }
}

/// A leaf that may be cut.
struct Open {
    simplex: usize,
    node: u32,
    piece: Piece,
    depth: usize,
    measure: f64,
    /// ∫ |r|
    cost: f64,
    /// ∫ f², roughly.
    square: f64,
}

impl Open {
    fn new(
        simplex: usize,
        node: u32,
        piece: Piece,
        depth: usize,
        measure: f64,
        leaf: &Leaf,
    ) -> Self {
        Open {
            simplex,
            node,
            piece,
            depth,
            measure,
            cost: leaf.cost(measure),
            square: measure * leaf.size() * leaf.size(),
        }
    }
}
