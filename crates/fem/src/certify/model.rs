//! An expression on simplices, proved: on each leaf of a tree of parts it is p + s + r with p linear, s of mean 0 and
//! |s| ≤ `wave`, |r| ≤ `error` everywhere but on spots.
//!
//! p and s come from Taylor's formula about a point c of the leaf with the remainder in interval arithmetic (K. Makino,
//! M. Berz, Int. J. Pure Appl. Math. 4, 2003), of whichever order m leaves least:
//!
//! ```text
//! f(x) = Σ_{|α| < m} f_α(c) (x-c)^α + Σ_{|α| = m} f_α (x-c)^α,   f_α = ∂^α f/α! somewhere in the box of the leaf
//! ```
//!
//! In the last sum the middles of the intervals that hold f_α belong to p and s, their radii make r. Where an `if` is not
//! decided on a leaf only order 0 is known, or one side of the jump on all of it, and the other as a spot. Leaves that cost
//! most get derivatives up to the fourth, and are cut where these do not help: along a jump, or in the middle.

use std::collections::HashMap;

use super::carried::Carried;
use super::jump;
use super::line::Lines;
use super::polynomial::{AT_FIRST, polynomial};
use super::simplex::{Vector, around, corners, longest_edge_of};
use super::tree::{Leaf, Tree};
use crate::interval::{Interval, above_of_all, above_of_product};
use crate::quadrature::{Piece, WHOLE, cut};
use crate::scene::Expression;
use crate::scene::expression::{
    IN_PLANE, IN_SPACE, MOST, ON_LINE, SECOND_IN_PLANE, SECOND_IN_SPACE, Taylor, spanned,
};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::parallel;

/// Where an expression is modelled: simplices of dimension `dim` in a space of `space` dimensions.
pub(super) struct Domain<'a> {
    pub expression: &'a Expression,
    /// The corners of a simplex, `dim + 1` of them.
    pub vertices: Box<dyn Fn(usize) -> [[f64; 3]; 4] + Sync + 'a>,
    /// |S|, roughly: only what is cut first depends on it.
    pub measures: Vec<f64>,
    pub dim: usize,
    pub space: usize,
    /// Data are multiplied by 2^unit.
    pub unit: i32,
}

/// The budget for enclosing.
pub(super) struct Effort {
    /// ∫ |r| wanted, relative to (∫ f²)^½.
    pub tolerance: f64,
    /// Leaves in all, beyond one a simplex.
    pub budget: usize,
}

/// The cache of one task: cells in rows have their boxes in common, and along the axes on which an expression does not depend all
/// cells do.
#[derive(Default)]
struct Boxes {
    /// The derivatives on boxes and at their middles, and whether a jump may be inside.
    derivatives: HashMap<Place, (Vec<Interval>, bool)>,
    /// Models of data that depend on only one axis.
    on_line: HashMap<PlaceOnLine, Leaf>,
}

/// A box along the axes that count, as bits; the derivatives that are taken; is a simplex all that counts?
type Place = ([[u64; 2]; 3], usize, bool);
/// The corners along the axis, as bits, the rest as a [`Place`] has it, and the share of a simplex.
type PlaceOnLine = ([[u64; 2]; 4], usize, bool, u64);

/// The number of boxes that are kept.
const BOXES: usize = 4096;

/// The corners of all parts are exact dyadic combinations, in multiples of 2 to the power of less this.
const FINEST: i32 = 52;
/// Those are cut that cost at least this part of the costliest.
const COSTLY: f64 = 0.125;
/// More derivatives are worth their time where they leave less than this part.
pub(super) const WORTH: f64 = 0.25;
/// The square of h_S ‖r‖_S on spots of a leaf S is no more than this part of that of a jump as high on the whole simplex, or the
/// leaf is taken to know nothing: what is off the mean on spots would cost more than all else.
const LITTLE: f64 = 0.0025;
/// Cuts along jumps may leave this many times the tolerance by their bounds, which are several times too large, more so on small
/// leaves.
const OF_JUMPS: f64 = 100.0;
/// The smallest number of cells per task.
const TOGETHER: usize = 1024;

/// The fate of a leaf.
pub(super) enum Improved {
    /// No further cut helps.
    Final,
    /// All derivatives were taken.
    Smoother(Leaf),
    Carried(Leaf, Box<Carried>),
    /// Its parts, the edge on which it was cut, and the share of the first.
    Cut([usize; 2], f64, Box<[Open; 2]>),
}

impl Domain<'_> {
    /// The trees of all simplices, and whether the tolerance was met.
    ///
    /// # Errors
    /// An interruption.
    pub fn enclose(&self, effort: &Effort) -> Result<Vec<Tree>> {
        let (count, axes) = (self.measures.len(), self.axes());
        // Cells have models along one axis in common: the fewer tasks, the more.
        let least = if axes.len() == 1 { TOGETHER } else { 1 };
        let trees = parallel::chunks(count, parallel::share(count).max(least), |chunk| {
            let mut boxes = Boxes::default();
            let tree = |k| {
                cancel::check()?;
                let whole = self.model((k, &WHOLE, 1.0), AT_FIRST, &axes, &mut boxes);
                Ok(Tree {
                    whole,
                    ..Tree::default()
                })
            };
            chunk.map(tree).collect()
        });
        let mut trees: Vec<Tree> = trees.into_iter().collect::<Result<_>>()?;
        let is_enough = |total: f64, square: f64| total <= effort.tolerance * square.sqrt();
        let all = || trees.iter().zip(&self.measures);
        // Mostly that is all: there is no need to keep every simplex open.
        let mut square: f64 = all().map(|(tree, m)| m * tree.whole.size().powi(2)).sum();
        let total = above_of_all(all().map(|(tree, m)| tree.whole.cost(*m)));
        if is_enough(total, square) {
            return Ok(trees);
        }
        let whole = |(simplex, (tree, measure)): (usize, (&Tree, &f64))| Open {
            simplex,
            node: 0,
            piece: WHOLE,
            share: 1.0,
            is_final: false,
            order: AT_FIRST,
            measure: *measure,
            leaf: tree.whole,
        };
        let mut open: Vec<Open> = all().enumerate().map(whole).collect();
        let jumps = open.iter().filter(|o| o.may_jump()).count().max(1) as f64;
        let mut left = effort.budget;
        let measure: f64 = self.measures.iter().sum();
        loop {
            cancel::check()?;
            open.retain(|o| o.cost() > 0.0);
            let costs: Vec<f64> = open.iter().map(Open::cost).collect();
            if is_enough(above_of_all(costs.iter().copied()), square) {
                break;
            }
            let least = COSTLY * costs.iter().copied().fold(0.0, f64::max);
            let is_chosen = |k: &usize| costs[*k] >= least && !open[*k].is_final;
            let mut chosen: Vec<usize> = (0..open.len()).filter(is_chosen).collect();
            if chosen.is_empty() {
                break;
            }
            // What may not be cut any more may still get more derivatives.
            chosen.sort_by(|&a, &b| costs[b].total_cmp(&costs[a]));
            for &late in chosen.iter().skip(left) {
                open[late].is_final = true;
            }
            let aim = 0.5 * effort.tolerance * square.sqrt() / measure;
            let of_jump = OF_JUMPS * effort.tolerance * square.sqrt() / jumps;
            let lines = self.lines(&open, &chosen, &axes, aim)?;
            let improved = parallel::map_with(Boxes::default, &chosen, |boxes, &k| {
                cancel::check().map(|()| self.improved(&open[k], &axes, &lines, of_jump, boxes))
            });
            let improved: Vec<Improved> = improved.into_iter().collect::<Result<_>>()?;
            for (k, improved) in chosen.into_iter().zip(improved) {
                let leaf = &mut open[k];
                let tree = &mut trees[leaf.simplex];
                square -= leaf.square();
                match improved {
                    Improved::Final => leaf.is_final = true,
                    Improved::Smoother(model) => (leaf.leaf, leaf.order) = (model, MOST),
                    Improved::Carried(model, carried) => {
                        (leaf.leaf, leaf.is_final) = (model, true);
                        tree.carried = Some(carried);
                    }
                    Improved::Cut(edge, at, parts) => {
                        left -= 1;
                        let [mut one, mut other] = *parts;
                        [one.node, other.node] =
                            tree.cut(leaf.node, edge, at, [one.leaf, other.leaf]);
                        square += one.square() + other.square();
                        *leaf = one;
                        open.push(other);
                        continue;
                    }
                }
                *tree.node_mut(leaf.node) = leaf.leaf;
                square += leaf.square();
            }
            square = square.max(0.0);
        }
        tracing::debug!(
            simplices = count,
            leaves = open.len(),
            budget_left = left,
            "enclosed in parts"
        );
        Ok(trees)
    }

    /// More derivatives, the model along an axis, or parts: whichever comes first of what helps. A jump may leave ∫ |r| = `of_jump`
    /// on all parts of a simplex, on each by its size.
    fn improved(
        &self,
        parent: &Open,
        axes: &[usize],
        lines: &Lines,
        of_jump: f64,
        boxes: &mut Boxes,
    ) -> Improved {
        if parent.may_be_smoother() {
            let place = (parent.simplex, &parent.piece, parent.share);
            let leaf = self.model(place, MOST, axes, boxes);
            let worth = if parent.is_final { 1.0 } else { WORTH };
            if leaf.unknown() < worth * parent.leaf.unknown() {
                return Improved::Smoother(leaf);
            }
            if self.axis_of(parent, axes).is_some() {
                return Improved::Smoother(parent.leaf);
            }
        }
        if let Some(found) = self.along_axis(parent, axes, lines) {
            return found;
        }
        let vertices = (self.vertices)(parent.simplex);
        let edge = longest_edge_of(&vertices, &parent.piece, self.dim);
        let leaf = &parent.leaf;
        let share = parent.share.powf((self.dim as f64 - 1.0) / self.dim as f64);
        let height = leaf.peak.max(2.0 * leaf.error);
        let is_little = leaf.wrong * height * parent.measure <= of_jump * share;
        let along_jump =
            (leaf.at > 0.0 && is_little).then(|| (leaf.edge.map(usize::from), leaf.at));
        let parts = along_jump
            .into_iter()
            .chain([(edge, 0.5)])
            .find_map(|(edge, at)| {
                let parts = exact_parts(&parent.piece, parent.share, edge, at)?;
                Some((edge, at, parts))
            });
        let (false, Some((edge, at, parts))) = (parent.is_final, parts) else {
            return Improved::Final;
        };
        let of = |(piece, share): (Piece, f64)| Open {
            leaf: self.model((parent.simplex, &piece, share), parent.order, axes, boxes),
            piece,
            measure: share / parent.share * parent.measure,
            share,
            ..*parent
        };
        Improved::Cut(edge, at, Box::new(parts.map(of)))
    }

    /// Cuts all leaves of a tree in halves, a given number of times, where p + s is nearer to f than p: p is then nearer, too.
    pub fn straighten(&self, simplex: usize, tree: &mut Tree, times: usize) {
        let (axes, mut boxes) = (self.axes(), Boxes::default());
        let vertices = (self.vertices)(simplex);
        for _ in 0..times {
            let mut leaves = Vec::new();
            tree.for_each(&mut |node, piece, share| leaves.push((node, *piece, share)));
            for (node, piece, share) in leaves {
                let edge = longest_edge_of(&vertices, &piece, self.dim);
                let is_bent = tree.leaf(node).wave > tree.leaf(node).most();
                if let (true, Some(parts)) = (is_bent, exact_parts(&piece, share, edge, 0.5)) {
                    let parts = parts.map(|(piece, share)| {
                        self.model((simplex, &piece, share), MOST, &axes, &mut boxes)
                    });
                    tree.cut(node, edge, 0.5, parts);
                }
            }
        }
    }

    /// The axes along which the expression varies, at most.
    fn axes(&self) -> Vec<usize> {
        let all = self.expression.axes().into_iter();
        all.filter(|axis| *axis < self.space).collect()
    }

    /// p, s and r on a part of a simplex from a given number of derivatives along these axes.
    fn model(
        &self,
        (simplex, piece, share): (usize, &Piece, f64),
        order: usize,
        axes: &[usize],
        boxes: &mut Boxes,
    ) -> Leaf {
        let count = self.dim + 1;
        let corners = corners(&(self.vertices)(simplex)[..count], piece, self.space);
        let corners = (&corners[..count], share);
        match (axes, order) {
            ([], _) => self.model_of::<ON_LINE>(corners, order, axes, boxes),
            ([axis], _) => {
                let mut bits = [[0; 2]; 4];
                for (bits, corner) in bits.iter_mut().zip(corners.0) {
                    *bits = [corner[*axis].low.to_bits(), corner[*axis].high.to_bits()];
                }
                let is_spanned = spanned(around(corners.0), self.dim).is_some();
                let place = (bits, order, is_spanned, share.to_bits());
                if let Some(leaf) = boxes.on_line.get(&place) {
                    return *leaf;
                }
                let leaf = self.model_of::<ON_LINE>(corners, order, axes, boxes);
                if boxes.on_line.len() >= BOXES {
                    boxes.on_line.clear();
                }
                boxes.on_line.insert(place, leaf);
                leaf
            }
            ([_, _], ..=AT_FIRST) => self.model_of::<SECOND_IN_PLANE>(corners, order, axes, boxes),
            ([_, _], _) => self.model_of::<IN_PLANE>(corners, order, axes, boxes),
            (_, ..=AT_FIRST) => self.model_of::<SECOND_IN_SPACE>(corners, order, axes, boxes),
            _ => self.model_of::<IN_SPACE>(corners, order, axes, boxes),
        }
    }

    /// ∂^α f/α! at all points of a box, and behind them at a point in its middle.
    fn derivatives<'b, const N: usize>(
        &self,
        around: [Interval; 3],
        centre: [Interval; 3],
        order: usize,
        axes: &[usize],
        boxes: &'b mut Boxes,
    ) -> &'b (Vec<Interval>, bool) {
        let mut bits = [[0; 2]; 3];
        for (bits, axis) in bits.iter_mut().zip(axes) {
            let x = around[*axis];
            *bits = [x.low.to_bits(), x.high.to_bits()];
        }
        let is_spanned = spanned(around, self.dim);
        let place = (bits, order, is_spanned.is_some());
        let known = &mut boxes.derivatives;
        if known.len() >= BOXES && !known.contains_key(&place) {
            known.clear();
        }
        known.entry(place).or_insert_with(|| {
            let inside: Taylor<N> = self.expression.over(around, axes, order, is_spanned);
            let at_centre: Taylor<N> = self.expression.enclosure(centre, axes, order - 1);
            let both = inside
                .coefficients
                .into_iter()
                .chain(at_centre.coefficients);
            let all = both.map(|c| c.times_power_of_two(self.unit)).collect();
            (all, inside.may_jump)
        })
    }

    fn model_of<const N: usize>(
        &self,
        (corners, share): (&[Vector], f64),
        order: usize,
        axes: &[usize],
        boxes: &mut Boxes,
    ) -> Leaf {
        let around = around(corners);
        // From the middle of the box no point is far.
        let centre = around.map(|x| Interval::at(x.mid().clamp(x.low, x.high)));
        let (known, may_jump) = self.derivatives::<N>(around, centre, order, axes, boxes);
        let mut leaf = polynomial::<N>(corners, centre, axes, order, known);
        if !may_jump || self.dim != self.space {
            return leaf;
        }
        let Some(jump) = jump::find(self.expression, corners, axes) else {
            return leaf;
        };
        if let Some(cut) = jump.cut {
            leaf.edge = cut.edge.map(|corner| corner as u8);
            (leaf.at, leaf.wrong) = (cut.at, cut.wrong);
        }
        if axes.len() == 1 && self.dim == 2 && share == 1.0 {
            // It may be carried, which leaves less.
            return leaf;
        }
        // One side of the jump on all of the leaf.
        let of = |at, order| -> Taylor<N> {
            let inside = spanned(around, self.dim);
            self.expression
                .over_by(at, axes, order, inside, &jump.chosen, None)
        };
        let both = [of(around, order), of(centre, order - 1)];
        let side = both.map(|of| of.coefficients.map(|c| c.times_power_of_two(self.unit)));
        let side = polynomial::<N>(corners, centre, axes, order, side.as_flattened());
        let peak = side.farthest(known[0], corners.len());
        let spots =
            [jump.share, above_of_product(jump.share, peak)].map(|c| above_of_product(c, peak));
        let side = Leaf {
            spots,
            peak: if jump.share > 0.0 { peak } else { 0.0 },
            edge: leaf.edge,
            at: leaf.at,
            wrong: leaf.wrong,
            ..side
        };
        let is_little = jump.share * share * share <= LITTLE;
        let is_better = peak.is_finite() && is_little && side.unknown() < leaf.unknown();
        if is_better { side } else { leaf }
    }
}

/// The parts of what is cut at this share of an edge, and their shares of the whole: where f64 has all of them exactly.
fn exact_parts(
    piece: &Piece,
    share: f64,
    [i, j]: [usize; 2],
    at: f64,
) -> Option<[(Piece, f64); 2]> {
    let is_exact = |a: f64, b: f64| a.mul_add(b, -(a * b)) == 0.0;
    let along = piece[i].iter().zip(&piece[j]).map(|(i, j)| j - i);
    let shares = [at, 1.0 - at];
    let parts = cut(piece, [i, j], at);
    let is_coordinate = |x: &f64| (x * 2.0_f64.powi(FINEST)).fract() == 0.0;
    let all_are = 0.0 < at
        && along.into_iter().all(|edge| is_exact(at, edge))
        && shares.iter().all(|of| is_exact(share, *of))
        && parts.iter().flatten().flatten().all(is_coordinate);
    let [first, second] = parts;
    all_are.then_some([(first, share * shares[0]), (second, share * shares[1])])
}

/// A leaf that may be cut.
#[derive(Clone, Copy)]
pub(super) struct Open {
    pub simplex: usize,
    pub node: u32,
    pub piece: Piece,
    /// The share of the simplex, exact.
    pub share: f64,
    /// Whether it is not cut any more.
    pub is_final: bool,
    /// The number of derivatives.
    pub order: usize,
    pub measure: f64,
    pub leaf: Leaf,
}

impl Open {
    /// ∫ |r|
    fn cost(&self) -> f64 {
        self.leaf.cost(self.measure)
    }

    fn may_jump(&self) -> bool {
        !self.leaf.is_smooth || self.leaf.peak > 0.0
    }

    /// Whether more derivatives may give a better model.
    pub fn may_be_smoother(&self) -> bool {
        self.order < MOST && self.leaf.is_smooth && self.leaf.error >= self.leaf.spots[0]
    }

    /// ∫ f², roughly.
    fn square(&self) -> f64 {
        self.measure * self.leaf.size().powi(2)
    }
}

#[cfg(test)]
mod tests;
